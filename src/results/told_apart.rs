//! Which cells' recovery rates differ, by the one test of [`rate_difference`], with p-values
//! adjusted for all that are compared.

use super::{SweepResults, outcomes_by_world};
use crate::diagnostics::multiplicity::holm;
use crate::diagnostics::rate_difference::{Pairing, rate_difference};
pub use crate::diagnostics::rate_difference::{RateDifference, RateTest, Scope};
use crate::sweep::Sweep;

/// The probability of telling any two rates of a family apart if none differ, at most.
pub const LEVEL: f64 = 0.05;

/// Two rates compared, among others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The test.
    pub found: RateDifference,
    /// Its p-value by Holm, over those of the family that could have found anything.
    pub p_holm: f64,
    /// How many those are.
    pub n_tests: usize,
}

impl Judged {
    /// Whether the two differ by more than chance explains.
    pub fn differs(&self) -> bool {
        self.p_holm <= LEVEL
    }
}

/// The recovery rate of cell `b` less that of cell `a`; `None` where an outcome is unknown.
pub fn recovery_difference(
    sweep: &Sweep,
    results: &SweepResults,
    a: usize,
    b: usize,
) -> Option<RateDifference> {
    let outcomes = |cell: usize| outcomes_by_world(results.chains_of(cell));
    let pairing = if sweep.has_many_worlds() {
        pairing(results, a, b)
    } else {
        Pairing::OneDataSet
    };
    rate_difference(&outcomes(a), &outcomes(b), pairing, Scope::NewWorlds)
}

/// Whether two cells saw the same worlds: those whose settings of the world differ did not.
fn pairing(results: &SweepResults, a: usize, b: usize) -> Pairing {
    let data = |cell: usize| results.chains_of(cell).map(|own| (own.replicate, own.data));
    let of_a: std::collections::HashMap<u64, usize> = data(a).collect();
    let is_shared = |(replicate, data)| of_a.get(&replicate).is_none_or(|own| *own == data);
    if data(b).all(is_shared) {
        Pairing::SameWorlds
    } else {
        Pairing::OtherWorlds
    }
}

/// All of a family, judged together. A test that could not have found anything whatever came is
/// adjusted for nothing, and nothing is adjusted for it (Tarone, Biometrics 46, 1990).
pub fn judged(found: &[Option<RateDifference>]) -> Vec<Option<Judged>> {
    let could_find = |found: &&RateDifference| found.least_p_value <= LEVEL;
    let able: Vec<f64> = (found.iter().flatten())
        .filter(could_find)
        .map(|found| found.p_value)
        .collect();
    let n_tests = able.len();
    let mut adjusted = holm(&able).into_iter();
    let of = |found: &Option<RateDifference>| {
        let found = (*found)?;
        let p_holm = if could_find(&&found) {
            adjusted.next()?
        } else {
            1.0
        };
        Some(Judged {
            found,
            p_holm,
            n_tests,
        })
    };
    found.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chains(n_recovered: usize) -> Vec<Vec<bool>> {
        vec![(0..20).map(|k| k < n_recovered).collect()]
    }

    /// 18 against 10 of 20 beside comparisons of which nothing could come: 0 against 0, and all
    /// against all.
    #[test]
    fn tests_that_cannot_find_anything_cost_the_others_nothing() {
        let of = |a, b| {
            let (a, b) = (chains(a), chains(b));
            rate_difference(&a, &b, Pairing::OneDataSet, Scope::NewWorlds)
        };
        let family = [of(0, 0), of(18, 10), of(20, 20), None, of(0, 0), of(0, 20)];
        let found = judged(&family);
        let own = found[1].expect("a test");
        assert_eq!((own.n_tests, own.differs()), (2, true));
        assert!((own.p_holm - own.found.p_value).abs() < 1e-15);
        let first = found[0].expect("a test");
        assert_eq!((first.p_holm, first.differs()), (1.0, false));
        assert!(found[3].is_none());
        // The one that is clearest is multiplied by both.
        let last = found[5].expect("a test");
        assert!((last.p_holm - 2.0 * last.found.p_value).abs() < 1e-18);
    }
}
