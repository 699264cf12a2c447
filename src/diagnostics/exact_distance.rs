//! How far a chain's topology frequencies are from the exact posterior, and how far a correct chain's are.
//!
//! TV = ½ Σ_T |n_T/n − p_T|. It is never 0 for a finite chain, so it is laid beside its null: the law of TV
//! if the counts were multinomial with the chain's effective sample size. Batch means over a hundred
//! batches give that (Flegal & Jones, Annals of Statistics 38, 2010): the smallest over M and the
//! indicators of the likeliest topologies.

use rand::Rng;
use rand_distr::{Binomial, Distribution};

/// Batches of the effective sample size.
const N_BATCHES: usize = 100;
/// Simulations of the null, and its place from the top that is read: the 99.9 % quantile.
const N_SIMULATIONS: usize = 4000;
const PLACE: usize = 4;
/// Topologies of a smaller expected count are taken together.
const LEAST_EXPECTED: f64 = 1e-3;

/// Total variation between frequencies and probabilities. `shares` holds for every topology its
/// frequency and probability; frequencies may sum to less than 1 where a truncated table dropped some.
pub fn total_variation(shares: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut apart, mut seen, mut total) = (0.0, 0.0, 0.0);
    for (frequency, probability) in shares {
        apart += (frequency - probability).abs();
        seen += frequency;
        total += probability;
    }
    // What was dropped could be anywhere: it counts as missing where it should be.
    (0.5 * (apart + (total - seen).max(0.0))).min(1.0)
}

/// Effective sample size of a mean over the series: a batch mean has variance σ²·B/ESS. `None` for a
/// series of fewer than ten steps a batch, or one that stands still: it says nothing of its law.
pub fn effective_sample_size(series: &[f64]) -> Option<f64> {
    let size = series.len() / N_BATCHES;
    if size < 10 {
        return None;
    }
    let series = &series[series.len() - size * N_BATCHES..];
    let n = series.len() as f64;
    let mean = series.iter().sum::<f64>() / n;
    let variance = series.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    let of_means = series
        .chunks_exact(size)
        .map(|batch| (batch.iter().sum::<f64>() / size as f64 - mean).powi(2))
        .sum::<f64>()
        / (N_BATCHES - 1) as f64;
    (of_means > 0.0).then(|| (variance / of_means * N_BATCHES as f64).clamp(1.0, n))
}

/// Effective samples below which batches are too short against the chain's memory for their number to be
/// believed: three a batch, where the bias of batch means is about a sixth.
pub const LEAST_EFFECTIVE: f64 = 3.0 * N_BATCHES as f64;

/// What an estimate of the effective sample size is at least, 999 times in 1,000: the variance of batch
/// means is χ²₉₉/99 of what it should be, of 0.1 % quantile 0.61.
pub fn at_least(effective: f64) -> f64 {
    0.61 * effective
}

/// What the total variation of a correct chain is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Null {
    /// Its mean.
    pub mean: f64,
    /// Its 99.9 % quantile.
    pub high: f64,
}

/// The law of TV between multinomial frequencies of `effective` ≥ 1 draws and their probabilities.
pub fn null(probabilities: &[f64], effective: f64, rng: &mut impl Rng) -> Null {
    let n = effective.round().max(1.0) as u64;
    let mut common: Vec<f64> = probabilities
        .iter()
        .copied()
        .filter(|p| p * n as f64 >= LEAST_EXPECTED)
        .collect();
    common.sort_unstable_by(|a, b| b.total_cmp(a));
    let rare = (1.0 - common.iter().sum::<f64>()).max(0.0);
    let mut distances: Vec<f64> = (0..N_SIMULATIONS)
        .map(|_| {
            let (mut left, mut mass, mut apart) = (n, 1.0_f64, 0.0);
            for &p in &common {
                let share = if mass > 0.0 {
                    (p / mass).clamp(0.0, 1.0)
                } else {
                    1.0
                };
                let count = Binomial::new(left, share).map_or(0, |law| law.sample(rng));
                left -= count;
                mass -= p;
                apart += (count as f64 / n as f64 - p).abs();
            }
            // Of the rare ones no two draws hit the same: all of their mass is misplaced.
            0.5 * (apart + left as f64 / n as f64 + rare)
        })
        .collect();
    distances.sort_unstable_by(|a, b| b.total_cmp(a));
    Null {
        mean: distances.iter().sum::<f64>() / N_SIMULATIONS as f64,
        high: distances[PLACE - 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    /// No two of five draws hit the same of 10,000 topologies: all mass is misplaced.
    #[test]
    fn of_rare_topologies_all_mass_is_misplaced() {
        let mut rng = Purpose::new("test", 1).generator();
        let found = null(&[1e-4; 10_000], 5.0, &mut rng);
        assert!((found.mean - 1.0).abs() < 1e-9 && (found.high - 1.0).abs() < 1e-9);
    }

    #[test]
    fn total_variation_of_known_shares() {
        let shares = [(0.5, 0.25), (0.5, 0.25), (0.0, 0.5)];
        assert_eq!(total_variation(shares.into_iter()), 0.5);
        assert_eq!(total_variation([(1.0, 1.0)].into_iter()), 0.0);
        // A tenth was dropped.
        let dropped = total_variation([(0.4, 0.5), (0.5, 0.5)].into_iter());
        assert!((dropped - 0.1).abs() < 1e-15);
    }

    /// One fair coin: TV = |k/n − ½|, of mean √(1/(2πn)) and 99.9 % quantile 3.29/(2√n).
    #[test]
    fn the_null_of_a_coin() {
        let mut rng = Purpose::new("exact distance test", 1).generator();
        let n = 10_000.0_f64;
        let found = null(&[0.5, 0.5], n, &mut rng);
        let mean = 1.0 / (2.0 * std::f64::consts::PI * n).sqrt();
        assert!((found.mean / mean - 1.0).abs() < 0.05, "{found:?}");
        let high = 3.29 / (2.0 * n.sqrt());
        assert!((found.high / high - 1.0).abs() < 0.15, "{found:?}");
    }

    /// A two-state chain that turns with probability t a step: ESS/n = t/(1 − t) for t < ½.
    #[test]
    fn effective_sample_size_of_a_lazy_coin() {
        let mut rng = Purpose::new("exact distance test", 2).generator();
        let (n, turn) = (200_000, 0.05);
        let mut state = 0.0;
        let series: Vec<f64> = (0..n)
            .map(|_| {
                if rng.random::<f64>() < turn {
                    state = 1.0 - state;
                }
                state
            })
            .collect();
        let found = effective_sample_size(&series).expect("it moves") / f64::from(n);
        let expected = turn / (1.0 - turn);
        // Ninety-nine squares: a relative standard deviation of 14 %; four of those.
        assert!((found / expected - 1.0).abs() < 0.6, "{found} {expected}");
        assert_eq!(effective_sample_size(&vec![1.0; 5000]), None);
        assert_eq!(effective_sample_size(&[0.0, 1.0]), None);
    }
}
