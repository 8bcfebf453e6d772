//! Adjusted functions: programs against the same expressions in real numbers.

use caustic_heightfield::adjusted::*;
use half::f16;
use proptest::prelude::*;

/// A step of a random expression; operands are picked among all earlier values.
#[derive(Clone, Debug)]
enum Step {
    Sum { c: f64, f: usize, d: f64, g: usize, constant: f64 },
    Product { f: usize, g: usize },
    Table { f: usize },
    TableOfTwo { f: usize, g: usize },
}

fn step() -> impl Strategy<Value = Step> {
    let pick = || any::<prop::sample::Index>().prop_map(|i| i.index(1 << 16));
    let factor = || -2.0..2.0_f64;
    prop_oneof![
        (factor(), pick(), factor(), pick(), factor()).prop_map(|(c, f, d, g, constant)| Step::Sum {
            c,
            f,
            d,
            g,
            constant
        }),
        (pick(), pick()).prop_map(|(f, g)| Step::Product { f, g }),
        pick().prop_map(|f| Step::Table { f }),
        (pick(), pick()).prop_map(|(f, g)| Step::TableOfTwo { f, g }),
    ]
}

fn curve(x: f64) -> f64 {
    x / (1.0 + x * x).sqrt()
}

fn surface(x: f64, y: f64) -> f64 {
    (0.3 * x).sin() + curve(y)
}

/// Inputs: one of each sign, one of both. Their ranges are these, their values a share of the way through.
const RANGES: [(f64, f64); 3] = [(0.0, 3.0), (-5.0, -1.0), (-0.5, 2.0)];

fn build(steps: &[Step]) -> (Expressions, Vec<Node>) {
    let mut e = Expressions::new();
    let mut nodes: Vec<Node> =
        RANGES.iter().map(|(low, high)| e.input("input", Interval::between(*low, *high), 0.0)).collect();
    for step in steps {
        let of = |f: &usize| nodes[f % nodes.len()];
        let node = match step {
            Step::Sum { c, f, d, g, constant } => e.sum("sum", &[(*c, of(f)), (*d, of(g))], *constant),
            Step::Product { f, g } => e.product("product", of(f), of(g)),
            Step::Table { f } => e.table("table", of(f), curve),
            Step::TableOfTwo { f, g } => e.table_of_two("table of two", [of(f), of(g)], surface),
        };
        nodes.push(node);
    }
    (e, nodes)
}

fn real(steps: &[Step], shares: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> =
        RANGES.iter().zip(shares).map(|((low, high), share)| low + share * (high - low)).collect();
    for step in steps {
        let of = |f: &usize| values[f % values.len()];
        let value = match step {
            Step::Sum { c, f, d, g, constant } => c * of(f) + d * of(g) + constant,
            Step::Product { f, g } => of(f) * of(g),
            Step::Table { f } => curve(of(f)),
            Step::TableOfTwo { f, g } => surface(of(f), of(g)),
        };
        values.push(value);
    }
    values
}

/// Every value of every expression is within its bound of the truth, and the truth within its range.
fn check<F: Format>(steps: &[Step], shares: &[f64], format: F) -> Result<(), TestCaseError> {
    let (expressions, nodes) = build(steps);
    let program = expressions.compile(&nodes, format).expect("finite ranges");
    let expected = real(steps, shares);
    let values = program.run(1, |number, _| expected[number]);
    for (output, expected) in expected.iter().enumerate() {
        let report = program.output(output);
        let got = program.value(output, values.cells[output][0]);
        let slack = 1e-12 * (1.0 + report.range.largest());
        prop_assert!(
            (got - expected).abs() <= report.error_bound + slack,
            "{} {output}: {got} for {expected}, bound {}",
            report.name,
            report.error_bound
        );
        let known = expressions.range(nodes[output]);
        prop_assert!((known.low - slack..=known.high + slack).contains(expected), "{known:?}: {expected}");
    }
    Ok(())
}

proptest! {
    #[test]
    fn no_error_exceeds_its_bound(
        steps in prop::collection::vec(step(), 1..7),
        shares in prop::collection::vec(0.0..=1.0_f64, 3),
        bits in Fixed::BITS,
    ) {
        check(&steps, &shares, Fixed::new(bits).expect("4 to 16"))?;
        check(&steps, &shares, Float::<f16>::default())?;
        check(&steps, &shares, Float::<f32>::default())?;
    }

    /// Storing is off by half a step at most, and not at all the second time.
    #[test]
    fn storing_is_idempotent(bits in Fixed::BITS, share in 0.0..=1.0_f64, low in -4.0..4.0_f64, width in 0.0..8.0_f64) {
        let format = Fixed::new(bits).expect("4 to 16");
        let range = Interval::between(low, low + width);
        let adjust = format.adjust(range);
        let x = low + share * width;
        let once = adjust.undone(format.load(format.store(adjust.done(x))));
        prop_assert!((once - x).abs() <= format.rounding(range) * (1.0 + 1e-9) + 1e-12, "{once} for {x}");
        let twice = adjust.undone(format.load(format.store(adjust.done(once))));
        prop_assert_eq!(once.to_bits(), twice.to_bits());
    }
}

/// The paper's rules for one scale and bias, alpha = 1/4 and beta = 1/2 in 8 bits: f + c, f + g, c f and g f.
#[test]
fn rules_are_the_papers() {
    let format = Fixed::new(8).expect("4 to 16");
    let mut e = Expressions::new();
    let f = e.input("f", Interval::around_zero(2.0), 0.0);
    let g = e.input("g", Interval::between(0.0, 1.0), 0.0);
    let weighed = e.product("g f", f, g);
    let program = e.compile(&[f, weighed], format).expect("finite ranges");
    let half = Adjust { scale: 0.25, bias: 0.5 };
    assert_eq!((program.output(0).adjust, program.output(1).adjust), (half, half));
    // f~ = 0.25 f + 0.5 and g f~ + (1 - g) beta, rounded to 255ths.
    let (f, g) = (-1.2, 0.4);
    let cells = program.run(1, |number, _| [f, g][number]).cells;
    let stored = (255.0 * (0.25_f64 * f + 0.5)).round();
    assert_eq!(f64::from(cells[0][0]), stored);
    assert_eq!(f64::from(cells[1][0]), (g * stored + (1.0 - g) * 127.5).round());
}

/// Signed times signed takes the paper's three passes, a weight that is nowhere negative takes one.
#[test]
fn products_take_as_many_passes_as_the_paper_says() {
    let format = Fixed::new(8).expect("4 to 16");
    let passes = |low: f64| {
        let mut e = Expressions::new();
        let f = e.input("f", Interval::around_zero(1.0), 0.0);
        let g = e.input("g", Interval::between(low, 1.0), 0.0);
        let product = e.product("f g", f, g);
        e.compile(&[product], format).expect("finite ranges").passes().len() - 2
    };
    assert_eq!((passes(0.0), passes(-1.0)), (1, 3));
}

/// Each bit more halves what passes add; a value beyond a range that was asked for is clamped and counted.
#[test]
fn bits_buy_accuracy_and_ranges_hold() {
    let (e, nodes) = {
        let mut e = Expressions::new();
        let f = e.input("f", Interval::around_zero(1.0), 0.0);
        let clamped = e.sum_within("3 f", &[(3.0, f)], 0.0, Interval::between(-1.0, 1.0));
        (e, [f, clamped])
    };
    let bound =
        |bits| e.compile(&nodes, Fixed::new(bits).expect("4 to 16")).expect("finite").output(1).error_bound;
    for bits in 4..16 {
        let codes = f64::from((1_u32 << bits) - 1);
        assert!((bound(bits) / bound(bits + 1) - (2.0 * codes + 1.0) / codes).abs() < 1e-9);
    }
    let program = e.compile(&nodes, Fixed::new(8).expect("4 to 16")).expect("finite");
    let values = program.run(3, |_, sample| [0.1, 0.5, -0.9][sample]);
    assert_eq!(values.clamped, 2);
    assert!(program.value(1, values.cells[1][1]) == 1.0 && program.value(1, values.cells[1][2]) == -1.0);
}

#[test]
fn what_a_format_does_not_hold_is_refused() {
    let mut e = Expressions::new();
    let f = e.input("f", Interval::between(0.0, 300.0), 0.0);
    let square = e.product("f f", f, f);
    let error = e.compile(&[square], Float::<f16>::default()).err().expect("beyond 65504").to_string();
    assert!(error.contains("`f f`") && error.contains("9.000e4") && error.contains("f16"), "{error}");
    assert!(e.compile(&[square], Float::<f32>::default()).is_ok());
    let inverse = e.table("1 / f", f, |x| 1.0 / x);
    assert!(e.compile(&[inverse], Fixed::new(8).expect("4 to 16")).is_err());
    assert!(Fixed::new(3).is_none() && Fixed::new(17).is_none());
}
