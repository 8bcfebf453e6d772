//! What became of the light that met glass.

use asm_core::{Ledger, Statistics, Tally};

/// Picks one way's end out of the books of a wavelength.
type End = fn(&Ledger) -> Tally;

/// Shares of the emitted light by how its ways end, 0 to 1, in the order in which they are told; empty where nothing was emitted.
pub(crate) fn fates(statistics: &Statistics) -> Vec<(&'static str, f64)> {
    let ends: [(&str, End); 9] = [
        ("landed on the map", |l| l.landed),
        ("reflected outside", |l| l.reflected),
        ("reflected inside", |l| l.kept_inside),
        ("totally reflected", |l| l.total_reflection),
        ("absorbed", |l| l.absorbed),
        ("escaped", |l| l.escaped),
        ("beside the map", |l| l.outside_map),
        ("wrong side of a facet", |l| l.wrong_side),
        ("no exit in the image", |l| l.no_exit),
    ];
    let lumens = |tally: End| -> f64 {
        let light = |light: &asm_core::LightStatistics| -> f64 {
            let bands = light.ledgers.iter().zip(&light.lumens_per_unit);
            bands.map(|(ledger, per_unit)| tally(ledger).flux as f64 * per_unit).sum()
        };
        statistics.lights.iter().map(light).sum()
    };
    let emitted = lumens(|l| l.emitted);
    if emitted == 0.0 {
        return Vec::new();
    }
    ends.map(|(name, tally)| (name, lumens(tally) / emitted)).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use asm_core::LightStatistics;

    #[test]
    fn shares_are_of_lumens_over_lights_and_wavelengths() {
        let tally = |flux| Tally { flux, photons: 1 };
        let ledger = |landed, escaped| Ledger {
            emitted: tally(landed + escaped),
            landed: tally(landed),
            escaped: tally(escaped),
            ..Ledger::default()
        };
        let light = |ledgers: Vec<Ledger>, lumens_per_unit: Vec<f64>| LightStatistics {
            ledgers,
            lumens_per_unit,
            ..LightStatistics::default()
        };
        let statistics = Statistics {
            lights: vec![
                light(vec![ledger(30, 10), ledger(10, 0)], vec![1.0, 2.0]),
                light(vec![ledger(0, 5)], vec![4.0]),
            ],
            ..Statistics::default()
        };
        let fates = fates(&statistics);
        assert_eq!(fates[0], ("landed on the map", 50.0 / 80.0));
        let escaped = fates.iter().find(|(name, _)| *name == "escaped").expect("told").1;
        assert_eq!(escaped, 30.0 / 80.0);
        let all: f64 = fates.iter().map(|(_, share)| share).sum();
        assert!((all - 1.0).abs() < 1e-12);
    }

    #[test]
    fn no_light_has_no_fate() {
        assert!(fates(&Statistics::default()).is_empty());
    }
}
