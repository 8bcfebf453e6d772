//! What accuracy costs on a device, and the cheapest rung that fits.

use serde::{Deserialize, Serialize};

use crate::Rung;

/// What a rung takes and how far off it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Price {
    /// What is priced.
    pub rung: Rung,
    /// Milliseconds per frame.
    pub ms: f64,
    /// Mean CIEDE2000 of the caustic on the receiver against the oracle.
    pub delta_e: f64,
}

/// Prices of one scene on one device, in any order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PriceList {
    /// One a rung that the device can do.
    pub prices: Vec<Price>,
}

impl PriceList {
    /// The fastest rung whose error is at most `target_delta_e`.
    #[must_use]
    pub fn cheapest_for_error(&self, target_delta_e: f64) -> Option<&Price> {
        self.least(|price| price.delta_e <= target_delta_e, |price| (price.ms, price.delta_e))
    }

    /// The most accurate rung that takes at most `budget_ms`.
    #[must_use]
    pub fn best_within(&self, budget_ms: f64) -> Option<&Price> {
        self.least(|price| price.ms <= budget_ms, |price| (price.delta_e, price.ms))
    }

    /// The fastest rung.
    #[must_use]
    pub fn fastest(&self) -> Option<&Price> {
        self.best_by(|price| (price.ms, price.delta_e))
    }

    /// The most accurate rung.
    #[must_use]
    pub fn most_accurate(&self) -> Option<&Price> {
        self.best_by(|price| (price.delta_e, price.ms))
    }

    fn best_by(&self, key: impl Fn(&Price) -> (f64, f64)) -> Option<&Price> {
        self.least(|_| true, key)
    }

    fn least(&self, fits: impl Fn(&Price) -> bool, key: impl Fn(&Price) -> (f64, f64)) -> Option<&Price> {
        let fitting = self.prices.iter().filter(|price| fits(price));
        fitting.min_by(|a, b| {
            let ((a, then_a), (b, then_b)) = (key(a), key(b));
            a.total_cmp(&b).then(then_a.total_cmp(&then_b))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rungs;

    /// (ms, error) of the first rungs.
    fn list(prices: &[(f64, f64)]) -> PriceList {
        let price = |(rung, &(ms, delta_e)): (Rung, &(f64, f64))| Price { rung, ms, delta_e };
        PriceList { prices: rungs().into_iter().zip(prices).map(price).collect() }
    }

    fn figures(price: Option<&Price>) -> Option<(f64, f64)> {
        price.map(|price| (price.ms, price.delta_e))
    }

    #[test]
    fn the_cheapest_that_is_good_enough_and_the_best_that_is_quick_enough() {
        let list = list(&[(40.0, 0.5), (5.0, 4.0), (20.0, 1.0), (30.0, 1.0), (10.0, 6.0)]);
        assert_eq!(figures(list.cheapest_for_error(1.0)), Some((20.0, 1.0)));
        assert_eq!(figures(list.cheapest_for_error(0.9)), Some((40.0, 0.5)));
        assert_eq!(figures(list.best_within(35.0)), Some((20.0, 1.0)));
        assert_eq!(figures(list.best_within(10.0)), Some((5.0, 4.0)));
        assert_eq!(figures(list.fastest()), Some((5.0, 4.0)));
        assert_eq!(figures(list.most_accurate()), Some((40.0, 0.5)));
    }

    #[test]
    fn what_no_rung_does_is_none() {
        let list = list(&[(40.0, 0.5), (5.0, 4.0)]);
        assert_eq!(list.cheapest_for_error(0.4), None);
        assert_eq!(list.best_within(4.0), None);
        assert_eq!(PriceList::default().fastest(), None);
    }
}
