//! Draws of one quantity from several chains, run by run.
//!
//! A chain of set partitions stands still for most of its steps, so a series is held as *stretches*
//! (value, number of steps) and never step by step: ranks, quantiles, means, variances, halves and
//! batch means of a stretch cost as much as those of a single draw, and are exactly what the series
//! written out would give. A series of 10⁹ steps that moved a million times takes 16 MB.

use super::undefined::Undefined;

/// A value and the number of consecutive draws that have it.
pub type Stretch = (f64, u64);

/// Fewest draws of a chain: two in each half.
pub const FEWEST_DRAWS: u64 = 4;

/// Finite draws of at least one chain, all of the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct Chains {
    /// Neighbours differ, so a chain that stands still is one stretch.
    chains: Vec<Vec<Stretch>>,
    n_draws: u64,
}

impl Chains {
    /// From stretches, one list for each chain; stretches of length 0 are skipped.
    ///
    /// # Errors
    /// [`Undefined::TooFew`] without chains, [`Undefined::TooShort`] below [`FEWEST_DRAWS`] draws,
    /// [`Undefined::NotFinite`].
    ///
    /// # Panics
    /// If the chains differ in length: cut all of them at one burn-in first.
    pub fn new(chains: &[Vec<Stretch>]) -> Result<Self, Undefined> {
        let length = |chain: &Vec<Stretch>| chain.iter().map(|(_, n)| n).sum::<u64>();
        let Some(n_draws) = chains.first().map(length) else {
            return Err(Undefined::TooFew { n: 0, fewest: 1 });
        };
        assert!(
            chains.iter().all(|chain| length(chain) == n_draws),
            "chains of the same length"
        );
        if n_draws < FEWEST_DRAWS {
            return Err(Undefined::TooShort {
                n: n_draws,
                fewest: FEWEST_DRAWS,
            });
        }
        let infinite = chains.iter().flatten().filter(|(x, _)| !x.is_finite());
        let n = infinite.map(|(_, n)| n).sum();
        if n > 0 {
            return Err(Undefined::NotFinite { n });
        }
        let chains = chains.iter().map(|chain| coalesced(chain.iter().copied()));
        Ok(Self {
            chains: chains.collect(),
            n_draws,
        })
    }

    /// From draws written out, one slice for each chain; errors and panics as [`new`](Self::new).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_draws(chains: &[Vec<f64>]) -> Result<Self, Undefined> {
        let stretches = |chain: &Vec<f64>| chain.iter().map(|&x| (x, 1)).collect();
        Self::new(&chains.iter().map(stretches).collect::<Vec<_>>())
    }

    /// Number of chains.
    pub fn n_chains(&self) -> usize {
        self.chains.len()
    }

    /// Number of draws of each chain.
    pub fn n_draws(&self) -> u64 {
        self.n_draws
    }

    /// Draws of all chains together.
    pub fn n_total(&self) -> u64 {
        self.n_draws * self.chains.len() as u64
    }

    /// The stretches of each chain.
    pub fn iter(&self) -> impl Iterator<Item = &[Stretch]> {
        self.chains.iter().map(Vec::as_slice)
    }

    /// The stretches of all chains, one after another.
    pub fn pooled(&self) -> impl Iterator<Item = Stretch> {
        self.chains.iter().flatten().copied()
    }

    /// How often the value changes from one draw to the next, over all chains.
    pub fn n_changes(&self) -> u64 {
        self.chains.iter().map(|chain| chain.len() as u64 - 1).sum()
    }

    /// Why nothing varies within any chain; `None` if something does.
    pub fn standstill(&self) -> Option<Undefined> {
        if self.n_changes() > 0 {
            return None;
        }
        let values = || self.pooled().map(|(value, _)| value);
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        Some(if low == high {
            Undefined::Constant { value: low }
        } else {
            Undefined::StuckDisagree {
                n_chains: self.n_chains(),
                low,
                high,
            }
        })
    }

    /// Another quantity of the same draws; `value` must give finite numbers.
    #[must_use]
    pub fn map(&self, value: impl Fn(f64) -> f64) -> Self {
        let of_chain = |chain: &Vec<Stretch>| coalesced(chain.iter().map(|&(x, n)| (value(x), n)));
        Self {
            chains: self.chains.iter().map(of_chain).collect(),
            n_draws: self.n_draws,
        }
    }

    /// Draws `start..end` of each chain.
    #[must_use]
    pub fn window(&self, start: u64, end: u64) -> Self {
        assert!(start < end && end <= self.n_draws, "a window of the chain");
        let of_chain = |chain: &Vec<Stretch>| window(chain, start, end);
        Self {
            chains: self.chains.iter().map(of_chain).collect(),
            n_draws: end - start,
        }
    }

    /// The first and the last half of each chain as chains of their own, first halves first; the
    /// middle draw of an odd number is left out.
    #[must_use]
    pub fn split(&self) -> Self {
        let half = self.n_draws / 2;
        let mut halves = self.window(0, half);
        let last = self.window(self.n_draws - half, self.n_draws);
        halves.chains.extend(last.chains);
        halves
    }

    /// Mean of each chain.
    pub fn means(&self) -> Vec<f64> {
        self.iter().map(mean).collect()
    }

    /// Variance of each chain, over n − 1.
    pub fn variances(&self) -> Vec<f64> {
        let n = self.n_draws as f64;
        let of_chain = |chain: &[Stretch]| sum_of_squares(chain, mean(chain)) / (n - 1.0);
        self.iter().map(of_chain).collect()
    }

    /// Mean of all draws.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pooled().map(|(x, n)| x * n as f64).sum();
        sum / self.n_total() as f64
    }

    /// Variance of all draws, over their number − 1.
    pub fn variance(&self) -> f64 {
        let (mean, mut sum) = (self.mean(), 0.0);
        for (x, n) in self.pooled() {
            sum += n as f64 * (x - mean) * (x - mean);
        }
        sum / (self.n_total() as f64 - 1.0)
    }
}

fn mean(chain: &[Stretch]) -> f64 {
    let (mut sum, mut total) = (0.0, 0);
    for &(x, n) in chain {
        sum += x * n as f64;
        total += n;
    }
    sum / total as f64
}

fn sum_of_squares(chain: &[Stretch], mean: f64) -> f64 {
    let square = |&(x, n): &Stretch| n as f64 * (x - mean) * (x - mean);
    chain.iter().map(square).sum()
}

fn coalesced(stretches: impl Iterator<Item = Stretch>) -> Vec<Stretch> {
    let mut merged: Vec<Stretch> = Vec::new();
    for (value, n) in stretches.filter(|(_, n)| *n > 0) {
        match merged.last_mut() {
            Some((last, total)) if *last == value => *total += n,
            _ => merged.push((value, n)),
        }
    }
    merged
}

fn window(chain: &[Stretch], start: u64, end: u64) -> Vec<Stretch> {
    let mut first = 0;
    let mut kept = Vec::new();
    for &(value, n) in chain {
        let (from, to) = (start.max(first), end.min(first + n));
        if from < to {
            kept.push((value, to - from));
        }
        first += n;
        if first >= end {
            break;
        }
    }
    kept
}

/// Means of consecutive batches of `length` draws; the first draws, fewer than one batch, are left
/// out where the length does not divide the series. Of a batch of one draw this is the draw itself.
pub fn batch_means(chain: &[Stretch], length: u64) -> Vec<f64> {
    let n_draws: u64 = chain.iter().map(|(_, n)| n).sum();
    let mut means = Vec::with_capacity((n_draws / length) as usize);
    let mut skip = n_draws % length;
    let (mut sum, mut filled) = (0.0, 0);
    for &(value, n) in chain {
        let skipped = n.min(skip);
        skip -= skipped;
        let mut left = n - skipped;
        while left > 0 {
            let taken = left.min(length - filled);
            sum += value * taken as f64;
            filled += taken;
            left -= taken;
            if filled == length {
                means.push(sum / length as f64);
                (sum, filled) = (0.0, 0);
            }
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chains(draws: &[&[f64]]) -> Result<Chains, Undefined> {
        Chains::from_draws(&draws.iter().map(|chain| chain.to_vec()).collect::<Vec<_>>())
    }

    #[test]
    fn refuses_what_has_no_statistics() {
        assert_eq!(Chains::new(&[]), Err(Undefined::TooFew { n: 0, fewest: 1 }));
        assert_eq!(
            chains(&[&[1.0, 2.0, 3.0]]),
            Err(Undefined::TooShort { n: 3, fewest: 4 })
        );
        let infinite = Chains::new(&[vec![(1.0, 3), (f64::NEG_INFINITY, 2), (f64::NAN, 1)]]);
        assert_eq!(infinite, Err(Undefined::NotFinite { n: 3 }));
    }

    #[test]
    #[should_panic(expected = "chains of the same length")]
    fn chains_of_different_length_are_our_mistake() {
        let _ = Chains::new(&[vec![(1.0, 5)], vec![(1.0, 6)]]);
    }

    #[test]
    fn says_how_it_stands_still() {
        let state = |draws: &[&[f64]]| chains(draws).expect("long enough").standstill();
        assert_eq!(
            state(&[&[2.0; 4], &[2.0; 4]]),
            Some(Undefined::Constant { value: 2.0 })
        );
        let apart = Undefined::StuckDisagree {
            n_chains: 2,
            low: 2.0,
            high: 7.0,
        };
        assert_eq!(state(&[&[7.0; 4], &[2.0; 4]]), Some(apart));
        assert_eq!(state(&[&[2.0, 2.0, 3.0, 3.0], &[2.0; 4]]), None);
    }

    #[test]
    fn halves_and_batches() {
        let chain = chains(&[&[1.0, 1.0, 1.0, 4.0, 4.0, 6.0, 6.0]]).expect("seven draws");
        assert_eq!(chain.n_changes(), 2);
        let split: Vec<Vec<Stretch>> = chain.split().iter().map(<[Stretch]>::to_vec).collect();
        assert_eq!(split, [vec![(1.0, 3)], vec![(4.0, 1), (6.0, 2)]]);
        let stretches = chain.iter().next().expect("one chain");
        assert_eq!(
            batch_means(stretches, 1),
            [1.0, 1.0, 1.0, 4.0, 4.0, 6.0, 6.0]
        );
        // The first draw is left over.
        assert_eq!(batch_means(stretches, 2), [1.0, 4.0, 6.0]);
        assert_eq!(batch_means(stretches, 3), [2.0, 16.0 / 3.0]);
        assert_eq!(
            batch_means(&[(2.0, 1_000_000_000)], 500_000_000),
            [2.0, 2.0]
        );
    }

    #[test]
    fn moments_are_those_of_the_draws() {
        let two = chains(&[&[1.0, 1.0, 2.0, 4.0], &[0.0, 3.0, 3.0, 6.0]]).expect("two chains");
        assert_eq!(two.means(), [2.0, 3.0]);
        assert_eq!(two.variances(), [2.0, 6.0]);
        assert_eq!(two.mean(), 2.5);
        assert!((two.variance() - 26.0 / 7.0).abs() < 1e-15);
    }
}
