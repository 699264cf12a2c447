//! How many topologies hold most of the posterior.

use super::interval::Z_95;
use super::undefined::Undefined;

/// The size of the smallest set of topologies that holds a given share of the draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberHolding {
    /// Topologies needed.
    pub n: usize,
    /// Lower end of a 95 % interval.
    pub low: usize,
    /// Upper end; `None` if the draws cannot tell it, since the share plus its error reaches 1.
    pub high: Option<usize>,
    /// Topologies seen.
    pub n_seen: usize,
}

/// The fewest topologies that hold a share `level` of all counts, for 0 < level < 1. Its interval:
/// of how many effective draws the share of a fixed set is known to ±1.96 √(level(1 − level)/ESS),
/// the numbers that hold the two ends. It leaves out what was never seen: see
/// [`unseen_mass`](super::unseen_mass).
///
/// # Errors
/// [`Undefined::TooShort`] without counts.
pub fn number_holding(counts: &[u64], level: f64, ess: f64) -> Result<NumberHolding, Undefined> {
    assert!(level > 0.0 && level < 1.0, "a share between 0 and 1");
    let total: u64 = counts.iter().sum();
    if total == 0 {
        return Err(Undefined::TooShort { n: 0, fewest: 1 });
    }
    let mut falling: Vec<u64> = counts.iter().copied().filter(|n| *n > 0).collect();
    falling.sort_unstable_by(|a, b| b.cmp(a));
    let n_to_hold = |share: f64| {
        let mut sum = 0;
        let reaches = |count: &u64| {
            sum += count;
            sum as f64 >= share * total as f64
        };
        falling
            .iter()
            .position(reaches)
            .map_or(falling.len(), |place| place + 1)
    };
    let (low, high) = share_interval(level, ess);
    Ok(NumberHolding {
        n: n_to_hold(level),
        low: n_to_hold(low),
        high: (high < 1.0).then(|| n_to_hold(high)),
        n_seen: falling.len(),
    })
}

/// ±1.96 standard errors about a share of ESS independent draws; the ends may leave [0, 1].
pub(super) fn share_interval(share: f64, ess: f64) -> (f64, f64) {
    let half = Z_95 * (share * (1.0 - share) / ess).sqrt();
    (share - half, share + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewest_that_hold_the_share() {
        let counts = [1, 50, 0, 30, 15, 4];
        let holding = |level, ess| number_holding(&counts, level, ess).expect("counts");
        let half_width = Z_95 * (0.95_f64 * 0.05 / 1000.0).sqrt();
        assert!((0.013..0.014).contains(&half_width));
        let found = holding(0.95, 1000.0);
        assert_eq!(
            (found.n, found.low, found.high, found.n_seen),
            (3, 3, Some(4), 5)
        );
        // 0.95 ± 0.151.
        let unsure = holding(0.95, 8.0);
        assert_eq!((unsure.low, unsure.n, unsure.high), (2, 3, None));
        assert_eq!((holding(0.5, 1e9).n, holding(0.51, 1e9).n), (1, 2));
        assert!(number_holding(&[], 0.95, 10.0).is_err());
    }
}
