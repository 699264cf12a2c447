//! Whether pairs said to be of one landmark with probability p are so in a share p of the cases.
//!
//! Pairs of one window share its drift and its chains, so the unit is the window, never the pair: the
//! band of a bin is a bootstrap over windows of (share that is true) − (mean p), about the mean p.
//! A bin outside its band means that the probabilities are off there.
//!
//! Recalibration replaces p by the share that pairs of that p had *in other windows*: isotonic
//! regression (pool adjacent violators, Ayer et al. 1955; Zadrozny & Elkan 2002), linear between the
//! means of its blocks.

use rand::{Rng, RngExt};

/// A pair of detections of known truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Probability that both are of one landmark.
    pub probability: f64,
    /// Whether they are.
    pub is_same: bool,
}

/// Pairs of about the same probability.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Bin {
    /// Lower end of the bin.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Mean of p.
    pub mean_probability: f64,
    /// Share that is of one landmark.
    pub share: f64,
    /// Pairs.
    pub n_pairs: usize,
    /// Windows that they are from.
    pub n_windows: usize,
    /// Where `share` lies 95 times in 100 if p is right: mean p plus what a bootstrap over windows
    /// shows the difference to vary by. `None` with fewer than [`FEWEST_WINDOWS`] windows.
    pub band: Option<(f64, f64)>,
}

impl Bin {
    /// Whether the share is inside the band; `None` without one.
    pub fn is_inside(&self) -> Option<bool> {
        let (low, high) = self.band?;
        Some((low..=high).contains(&self.share))
    }
}

/// Bins of equal width.
pub const N_BINS: usize = 10;
/// A bootstrap over fewer windows says nothing.
pub const FEWEST_WINDOWS: usize = 5;
const N_BOOTSTRAP: usize = 2000;

/// The reliability of the pairs of several windows; bins without pairs are left out.
pub fn reliability(windows: &[Vec<Pair>], rng: &mut impl Rng) -> Vec<Bin> {
    let bin_of = |pair: &Pair| ((pair.probability * N_BINS as f64) as usize).min(N_BINS - 1);
    let mut bins = Vec::new();
    for k in 0..N_BINS {
        // Of each window: pairs, Σp, how many are true.
        let mut sums: Vec<(f64, f64, f64)> = Vec::new();
        for window in windows {
            let here = window.iter().filter(|pair| bin_of(pair) == k);
            let sum = here.fold((0.0, 0.0, 0.0), |(n, p, same), pair| {
                (
                    n + 1.0,
                    p + pair.probability,
                    same + f64::from(u8::from(pair.is_same)),
                )
            });
            if sum.0 > 0.0 {
                sums.push(sum);
            }
        }
        let add = |a: (f64, f64, f64), b: &(f64, f64, f64)| (a.0 + b.0, a.1 + b.1, a.2 + b.2);
        let (n, p, same) = sums.iter().fold((0.0, 0.0, 0.0), add);
        if n == 0.0 {
            continue;
        }
        let (mean_probability, share) = (p / n, same / n);
        let difference = share - mean_probability;
        let band = (sums.len() >= FEWEST_WINDOWS).then(|| {
            let mut about: Vec<f64> = (0..N_BOOTSTRAP)
                .map(|_| {
                    let drawn = (0..sums.len()).map(|_| &sums[rng.random_range(0..sums.len())]);
                    let (n, p, same) = drawn.fold((0.0, 0.0, 0.0), add);
                    (same - p) / n - difference
                })
                .collect();
            about.sort_unstable_by(f64::total_cmp);
            let at = |q: f64| about[((N_BOOTSTRAP - 1) as f64 * q).round() as usize];
            // The basic bootstrap: the observed difference errs from 0 as resamples err from it.
            let (low, high) = (mean_probability + at(0.025), mean_probability + at(0.975));
            (low.max(0.0), high.min(1.0))
        });
        bins.push(Bin {
            low: k as f64 / N_BINS as f64,
            high: (k + 1) as f64 / N_BINS as f64,
            mean_probability,
            share,
            n_pairs: n as usize,
            n_windows: sums.len(),
            band,
        });
    }
    bins
}

/// Mean of (p − \[same\])² (Brier 1950): 0 at best; ¼ for p = ½ throughout. `None` without pairs.
pub fn brier_score(windows: &[Vec<Pair>]) -> Option<f64> {
    let errors = windows.iter().flatten();
    let errors = errors.map(|pair| (pair.probability - f64::from(u8::from(pair.is_same))).powi(2));
    let n = errors.clone().count();
    (n > 0).then(|| errors.sum::<f64>() / n as f64)
}

/// A rising map of probabilities, linear between its knots and flat outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Isotonic {
    knots: Vec<(f64, f64)>,
}

impl Isotonic {
    /// The rising map with the least squared error on these pairs; `None` of none.
    pub fn fit<'a>(pairs: impl Iterator<Item = &'a Pair>) -> Option<Self> {
        let mut points: Vec<(f64, f64)> = pairs
            .map(|pair| (pair.probability, f64::from(u8::from(pair.is_same))))
            .collect();
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        // Blocks of (n, Σp, Σ[same]); equal p first, as they cannot be told apart.
        let mut blocks: Vec<(f64, f64, f64)> = Vec::new();
        for equal in points.chunk_by(|a, b| a.0 == b.0) {
            let n = equal.len() as f64;
            let same: f64 = equal.iter().map(|point| point.1).sum();
            blocks.push((n, n * equal[0].0, same));
            while let [.., a, b] = blocks[..]
                && a.2 / a.0 >= b.2 / b.0
            {
                blocks.truncate(blocks.len() - 2);
                blocks.push((a.0 + b.0, a.1 + b.1, a.2 + b.2));
            }
        }
        let knots: Vec<(f64, f64)> = blocks.iter().map(|b| (b.1 / b.0, b.2 / b.0)).collect();
        (!knots.is_empty()).then_some(Self { knots })
    }

    /// The probability in the place of p.
    pub fn at(&self, p: f64) -> f64 {
        let above = self.knots.partition_point(|knot| knot.0 < p);
        match (
            above.checked_sub(1).map(|k| self.knots[k]),
            self.knots.get(above),
        ) {
            (Some((x0, y0)), Some(&(x1, y1))) => y0 + (y1 - y0) * (p - x0) / (x1 - x0),
            (Some((_, y)), None) | (None, Some(&(_, y))) => y,
            (None, None) => p,
        }
    }
}

/// The pairs with their probabilities recalibrated, each window by the others; `None` for one window.
pub fn recalibrated(windows: &[Vec<Pair>]) -> Option<Vec<Vec<Pair>>> {
    let one = |left_out: usize| {
        let others = windows.iter().enumerate().filter(|(k, _)| *k != left_out);
        let map = Isotonic::fit(others.flat_map(|(_, window)| window))?;
        let pairs = windows[left_out].iter().map(|pair| Pair {
            probability: map.at(pair.probability),
            is_same: pair.is_same,
        });
        Some(pairs.collect())
    };
    (0..windows.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    fn pair(probability: f64, is_same: bool) -> Pair {
        Pair {
            probability,
            is_same,
        }
    }

    /// Windows of pairs that are of one landmark with probability `truth(p)`; `shared` windows have
    /// one draw for all their pairs of a bin.
    fn windows(n: usize, truth: impl Fn(f64) -> f64, shared: bool, seed: u64) -> Vec<Vec<Pair>> {
        let mut rng = Purpose::new("test", seed).generator();
        let mut window = || {
            let draws: Vec<f64> = (0..10).map(|_| rng.random_range(0.0..1.0)).collect();
            (0..100)
                .map(|k| {
                    let p = (f64::from(k) + 0.5) / 100.0;
                    let own: f64 = rng.random_range(0.0..1.0);
                    let u = if shared { draws[k as usize / 10] } else { own };
                    pair(p, u < truth(p))
                })
                .collect()
        };
        (0..n).map(|_| window()).collect()
    }

    #[test]
    fn right_probabilities_stay_in_a_band_that_knows_of_windows() {
        let mut rng = Purpose::new("test", 1).generator();
        for shared in [false, true] {
            let inside: usize = (0..20)
                .map(|seed| {
                    let bins = reliability(&windows(60, |p| p, shared, seed), &mut rng);
                    assert_eq!(bins.len(), N_BINS);
                    bins.iter()
                        .filter(|bin| bin.is_inside() == Some(true))
                        .count()
                })
                .sum();
            // 200 bins at 95 %: 190 expected, standard deviation 3.1; the bootstrap of 60 windows is a
            // little narrow. A bootstrap over pairs would cover some 45 % of the shared ones.
            assert!(inside >= 176, "{shared}: {inside} of 200");
        }
        let wide = |shared| {
            let bins = reliability(
                &windows(60, |p| p, shared, 3),
                &mut Purpose::new("t", 1).generator(),
            );
            let (low, high) = bins[5].band.expect("60 windows");
            high - low
        };
        // 60 against 600 independent draws: √10 wider.
        assert!((wide(true) / wide(false) / 10f64.sqrt() - 1.0).abs() < 0.25);
    }

    #[test]
    fn wrong_probabilities_leave_the_band_and_are_recalibrated_by_other_windows() {
        let mut rng = Purpose::new("test", 2).generator();
        let before = windows(60, |p| p * p, false, 7);
        let outside = |bins: &[Bin]| bins.iter().filter(|b| b.is_inside() == Some(false)).count();
        assert!(outside(&reliability(&before, &mut rng)) >= 7);
        let after = recalibrated(&before).expect("many windows");
        let bins = reliability(&after, &mut rng);
        assert!(outside(&bins) <= 1, "{bins:?}");
        assert!(brier_score(&after) < brier_score(&before));
        // Nothing of a window goes into its own map.
        let alone = vec![vec![pair(0.3, true)], vec![pair(0.3, false)]];
        let after = recalibrated(&alone).expect("two windows");
        assert_eq!(after, [[pair(0.0, true)], [pair(1.0, false)]]);
        assert_eq!(recalibrated(&alone[..1]), None);
    }

    #[test]
    fn isotonic_pools_what_falls() {
        let pairs = [
            pair(0.1, false),
            pair(0.2, true),
            pair(0.4, false),
            pair(0.9, true),
            pair(0.9, true),
        ];
        // {0.2, 0.4} are pooled to ½ at 0.3.
        let map = Isotonic::fit(pairs.iter()).expect("pairs");
        let close = |p: f64, expected: f64| (map.at(p) - expected).abs() < 1e-12;
        assert!(
            close(0.1, 0.0) && close(0.3, 0.5) && close(0.9, 1.0),
            "{map:?}"
        );
        assert!(close(0.2, 0.25) && close(0.6, 0.75) && close(0.0, 0.0) && close(1.0, 1.0));
        assert_eq!(Isotonic::fit([].iter()), None);
    }

    #[test]
    fn a_bin_is_what_is_in_it() {
        let mut rng = Purpose::new("test", 3).generator();
        let window = vec![pair(0.12, true), pair(0.18, false), pair(1.0, true)];
        let bins = reliability(std::slice::from_ref(&window), &mut rng);
        assert_eq!((bins.len(), bins[0].n_pairs, bins[0].share), (2, 2, 0.5));
        assert!((bins[0].mean_probability - 0.15).abs() < 1e-12);
        assert_eq!(
            (bins[1].low, bins[1].n_windows, bins[1].band),
            (0.9, 1, None)
        );
        let score = brier_score(&[window]).expect("pairs");
        assert!((score - (0.88_f64.powi(2) + 0.18_f64.powi(2)) / 3.0).abs() < 1e-12);
        assert_eq!(brier_score(&[]), None);
    }
}
