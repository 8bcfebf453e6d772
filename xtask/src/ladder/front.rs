//! The Pareto front, and what halving the error costs along it.

/// What a rung costs and how far off it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Price {
    /// Milliseconds per frame.
    pub(super) ms: f64,
    /// Distance from the oracle.
    pub(super) error: f64,
}

impl Price {
    /// As good in both, and better in one. Never where a figure is no number.
    fn dominates(self, other: Self) -> bool {
        self.ms <= other.ms && self.error <= other.error && (self.ms < other.ms || self.error < other.error)
    }

    fn is_a_price(self) -> bool {
        self.ms.is_finite() && self.error.is_finite() && self.ms > 0.0 && self.error >= 0.0
    }
}

/// Which of them nothing dominates; rungs without a price are not on the front, equal ones are there together.
pub(super) fn front(prices: &[Option<Price>]) -> Vec<bool> {
    let all: Vec<Price> = prices.iter().flatten().copied().filter(|price| price.is_a_price()).collect();
    let is_on = |price: &Option<Price>| {
        price.is_some_and(|p| p.is_a_price() && !all.iter().any(|other| other.dominates(p)))
    };
    prices.iter().map(is_on).collect()
}

/// What accuracy costs along a front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Halving {
    /// No rung has a price.
    Nothing,
    /// Nothing to pay for: all the others are slower and no better.
    One(Price),
    /// Both ends are less than a factor of two apart in error.
    OutOfReach {
        /// The cheapest.
        cheapest: Price,
        /// The most accurate.
        best: Price,
    },
    /// Time is a power of the error.
    Costs {
        /// The cheapest.
        cheapest: Price,
        /// The most accurate.
        best: Price,
        /// How often the error halves from the cheapest to the best.
        halvings: f64,
        /// Times as long, on average over these.
        mean: f64,
        /// Times as long, the last time.
        last: f64,
    },
}

impl Halving {
    /// Of the prices on a front, in any order.
    pub(super) fn along(front: &[Price]) -> Self {
        let mut ascending = front.to_vec();
        ascending.sort_by(|a, b| a.ms.total_cmp(&b.ms).then(b.error.total_cmp(&a.error)));
        ascending.dedup();
        let (Some(&cheapest), Some(&best)) = (ascending.first(), ascending.last()) else {
            return Self::Nothing;
        };
        if ascending.len() == 1 {
            return Self::One(best);
        }
        // An error of 0 would be halved for ever.
        let least = best.error.max(f64::MIN_POSITIVE);
        let halvings = (cheapest.error / least).log2();
        if halvings < 1.0 {
            return Self::OutOfReach { cheapest, best };
        }
        Self::Costs {
            cheapest,
            best,
            halvings,
            mean: (best.ms / cheapest.ms).powf(1.0 / halvings),
            last: best.ms / ms_at(&ascending, 2.0 * least),
        }
    }

    /// For people; `error` is what it is called, such as ΔE.
    pub(super) fn sentence(&self, error: &str) -> String {
        let price = |p: &Price| format!("{} at {} ms", digits(p.error), digits(p.ms));
        match self {
            Self::Nothing => format!("no rung has a price in {error}"),
            Self::One(only) => format!("one rung has the least {error} and the least time ({})", price(only)),
            Self::OutOfReach { cheapest, best } => format!(
                "time does not halve {error}: {} is the cheapest, {} the best",
                price(cheapest),
                price(best)
            ),
            Self::Costs { cheapest, best, halvings, mean, last } => format!(
                "halving {error} costs {mean:.1} times the time on average, from {} to {} ({halvings:.1} halvings), \
                 and {last:.1} times the last time",
                price(cheapest),
                price(best)
            ),
        }
    }
}

/// When a front of at least two prices, ascending in time, reaches an error that lies within it: between neighbours time is a
/// power of the error.
fn ms_at(ascending: &[Price], error: f64) -> f64 {
    let pair = ascending.windows(2).find(|pair| pair[1].error <= error);
    let Some(&[above, below]) = pair else { return f64::NAN };
    let least = below.error.max(f64::MIN_POSITIVE);
    let share = ((above.error / error).ln() / (above.error / least).ln()).clamp(0.0, 1.0);
    above.ms * (below.ms / above.ms).powf(share)
}

/// Three digits that count.
pub(super) fn digits(value: f64) -> String {
    let decimals = (2 - value.abs().max(1e-4).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn price(ms: f64, error: f64) -> Price {
        Price { ms, error }
    }

    #[test]
    fn what_is_slower_and_no_better_is_not_on_the_front() {
        let prices = [price(1.0, 8.0), price(2.0, 9.0), price(3.0, 2.0), price(4.0, 2.0), price(9.0, 1.0)];
        assert_eq!(front(&prices.map(Some)), [true, false, true, false, true]);
    }

    #[test]
    fn equal_prices_are_there_together_and_one_alone_is() {
        let tie = price(1.0, 1.0);
        assert_eq!(front(&[Some(tie), Some(tie), Some(price(1.0, 2.0))]), [true, true, false]);
        assert_eq!(front(&[Some(tie)]), [true]);
        assert_eq!(front(&[]), [false; 0]);
    }

    #[test]
    fn what_failed_or_is_no_number_neither_stands_on_the_front_nor_shuts_others_out() {
        let prices = [None, Some(price(1.0, f64::NAN)), Some(price(0.0, 0.0)), Some(price(2.0, 3.0))];
        assert_eq!(front(&prices), [false, false, false, true]);
    }

    #[test]
    fn halving_is_told_from_both_ends_and_from_the_end() {
        // Twice the time a halving up to 2, four times for the last.
        let front = [price(8.0, 1.0), price(1.0, 4.0), price(2.0, 2.0)];
        let Halving::Costs { halvings, mean, last, .. } = Halving::along(&front) else {
            panic!("{:?}", Halving::along(&front));
        };
        assert!((halvings - 2.0).abs() < 1e-12 && (last - 4.0).abs() < 1e-12);
        assert!((mean - 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(
            Halving::along(&front).sentence("ΔE"),
            "halving ΔE costs 2.8 times the time on average, from 4.00 at 1.00 ms to 1.00 at 8.00 ms (2.0 halvings), \
             and 4.0 times the last time"
        );
    }

    #[test]
    fn the_last_halving_may_end_between_two_rungs() {
        // Time is 1 / error, so that every halving doubles it.
        let front = [price(1.0, 8.0), price(8.0, 1.0)];
        let Halving::Costs { mean, last, .. } = Halving::along(&front) else { panic!() };
        assert!((mean - 2.0).abs() < 1e-12 && (last - 2.0).abs() < 1e-12, "{mean} {last}");
    }

    #[test]
    fn short_fronts_say_so() {
        assert_eq!(Halving::along(&[]), Halving::Nothing);
        let one = price(2.0, 1.0);
        assert_eq!(Halving::along(&[one, one]), Halving::One(one));
        let (cheapest, best) = (price(1.0, 1.5), price(9.0, 1.0));
        assert_eq!(Halving::along(&[best, cheapest]), Halving::OutOfReach { cheapest, best });
        assert!(Halving::along(&[best, cheapest]).sentence("ΔE").starts_with("time does not halve"));
    }

    #[test]
    fn an_exact_rung_leaves_numbers() {
        let Halving::Costs { mean, last, .. } = Halving::along(&[price(1.0, 4.0), price(4.0, 0.0)]) else {
            panic!()
        };
        assert!(mean.is_finite() && last.is_finite(), "{mean} {last}");
    }
}
