//! Tables of published numbers, read from their CSV files while compiling.
//!
//! The files under `data/` stay as they were published and are the only copy of the numbers; a malformed file
//! fails the build. Every number has few enough digits (mantissa below 2^53, power of ten up to 22) for the one
//! division or multiplication below to be correctly rounded, so the table holds what `str::parse` would give.

/// The `ROWS x COLS` numbers of a CSV file with one header line.
///
/// Evaluated at compile time only; every failed assertion is a build error.
pub(crate) const fn parse_csv<const ROWS: usize, const COLS: usize>(text: &str) -> [[f64; COLS]; ROWS] {
    let bytes = text.as_bytes();
    let mut table = [[0.0; COLS]; ROWS];
    let mut at = 0;
    while bytes[at] != b'\n' {
        at += 1;
    }
    at += 1;
    let mut row = 0;
    while row < ROWS {
        let mut col = 0;
        while col < COLS {
            let start = at;
            while at < bytes.len() && bytes[at] != b',' && bytes[at] != b'\n' && bytes[at] != b'\r' {
                at += 1;
            }
            table[row][col] = parse_decimal(bytes, start, at);
            if col + 1 < COLS {
                assert!(bytes[at] == b',', "too few columns");
                at += 1;
            }
            col += 1;
        }
        while at < bytes.len() && (bytes[at] == b'\r' || bytes[at] == b'\n') {
            at += 1;
        }
        row += 1;
    }
    assert!(at == bytes.len(), "more rows or columns than expected");
    table
}

/// The decimal number in `bytes[start..end]`: sign, digits, point, exponent.
const fn parse_decimal(bytes: &[u8], start: usize, end: usize) -> f64 {
    assert!(start < end, "empty field");
    let mut at = start;
    let negative = bytes[at] == b'-';
    if negative {
        at += 1;
    }
    let mut mantissa: u64 = 0;
    let mut power_of_ten: i32 = 0;
    let mut after_point = false;
    while at < end && bytes[at] != b'e' {
        if bytes[at] == b'.' {
            after_point = true;
        } else {
            assert!(bytes[at].is_ascii_digit(), "not a decimal digit");
            mantissa = mantissa * 10 + (bytes[at] - b'0') as u64;
            if after_point {
                power_of_ten -= 1;
            }
        }
        at += 1;
    }
    if at < end {
        at += 1;
        let negative_exponent = bytes[at] == b'-';
        if negative_exponent || bytes[at] == b'+' {
            at += 1;
        }
        let mut exponent = 0;
        while at < end {
            assert!(bytes[at].is_ascii_digit(), "not a decimal exponent");
            exponent = exponent * 10 + (bytes[at] - b'0') as i32;
            at += 1;
        }
        power_of_ten += if negative_exponent { -exponent } else { exponent };
    }
    assert!(mantissa < 1 << 53, "mantissa not exact in f64");
    let mut scale = 1.0;
    let mut i = 0;
    while i < power_of_ten.unsigned_abs() {
        scale *= 10.0;
        i += 1;
    }
    assert!(i <= 22, "power of ten not exact in f64");
    let magnitude = if power_of_ten < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    if negative { -magnitude } else { magnitude }
}

/// Linear interpolation of one column at `x`, in a table whose first column runs from `first` in equal `step`s.
/// Zero outside the table and for NaN.
pub(crate) fn interpolate<const COLS: usize>(table: &[[f64; COLS]], column: usize, x: f64) -> f64 {
    let last = table.len() - 1;
    let (first, end) = (table[0][0], table[last][0]);
    if !(first..=end).contains(&x) {
        return 0.0;
    }
    let position = (x - first) / (end - first) * last as f64;
    // Truncation is floor here: position >= 0.
    let below = (position as usize).min(last - 1);
    let t = position - below as f64;
    table[below][column] * (1.0 - t) + table[below + 1][column] * t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const ROWS: usize, const COLS: usize>(text: &str, first: f64, step: f64) {
        let table = parse_csv::<ROWS, COLS>(text);
        let mut rows = 0;
        for (line, row) in text.lines().skip(1).zip(&table) {
            let mut fields = 0;
            for (field, value) in line.split(',').zip(row) {
                assert_eq!(field.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{line}");
                fields += 1;
            }
            assert_eq!(fields, COLS);
            assert_eq!(row[0], first + step * rows as f64);
            rows += 1;
        }
        assert_eq!(rows, ROWS);
    }

    #[test]
    fn tables_hold_what_the_files_say() {
        check::<471, 4>(include_str!("../data/cie_1931_2deg_1nm.csv"), 360.0, 1.0);
        check::<471, 4>(include_str!("../data/cie_1964_10deg_1nm.csv"), 360.0, 1.0);
        check::<81, 17>(include_str!("../data/cie_illuminants_5nm.csv"), 380.0, 5.0);
        check::<54, 4>(include_str!("../data/cie_daylight_basis_10nm.csv"), 300.0, 10.0);
        check::<81, 25>(include_str!("../data/colorchecker24_ohta.csv"), 380.0, 5.0);
    }

    #[test]
    fn numbers_in_every_notation_parse_exactly() {
        let table = parse_csv::<2, 3>("a,b,c\n-1.5,3.917e-06,0.0\r\n1e3,-0.25,12345678901");
        assert_eq!(table, [[-1.5, 3.917e-6, 0.0], [1000.0, -0.25, 12_345_678_901.0]]);
    }

    #[test]
    #[should_panic(expected = "too few columns")]
    fn a_short_row_is_refused() {
        parse_csv::<2, 2>("a,b\n1,2\n3\n");
    }

    #[test]
    #[should_panic(expected = "more rows")]
    fn an_extra_row_is_refused() {
        parse_csv::<1, 2>("a,b\n1,2\n3,4\n");
    }

    #[test]
    fn interpolation_is_linear_inside_and_zero_outside() {
        let table = [[10.0, 1.0], [20.0, 3.0], [30.0, 2.0]];
        for (x, expected) in [(10.0, 1.0), (15.0, 2.0), (20.0, 3.0), (22.5, 2.75), (30.0, 2.0)] {
            assert_eq!(interpolate(&table, 1, x), expected);
        }
        for x in [9.99, 30.01, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(interpolate(&table, 1, x), 0.0);
        }
    }
}
