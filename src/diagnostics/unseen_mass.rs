//! How much of the posterior lies on topologies that were never drawn, by Good and Turing (Good,
//! Biometrika 40, 1953): about as much as the share of draws that were seen exactly once.

use std::collections::BTreeMap;

use super::undefined::Undefined;

/// The mass of the unseen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnseenMass {
    /// f₁/n, the share of draws whose topology was drawn once.
    pub mass: f64,
    /// √(f₁(1 − f₁/n) + 2f₂)/n, of the difference to the true mass (Esty, Annals of Statistics 11,
    /// 1983). `None` if no topology was drawn once or twice: then all that is known is that about
    /// 3/n is not exceeded.
    pub standard_error: Option<f64>,
    /// f₁, topologies drawn once.
    pub n_once: u64,
    /// n, independent draws.
    pub n_draws: u64,
}

/// From how often each topology was drawn, in **independent** draws. The proposals of a chain are
/// not: a chain dwells, and sees little once. Take draws an autocorrelation time apart, as
/// [`spaced_counts`] does.
///
/// # Errors
/// [`Undefined::TooShort`] below two draws.
pub fn unseen_mass(counts: &[u64]) -> Result<UnseenMass, Undefined> {
    let n_draws: u64 = counts.iter().sum();
    if n_draws < 2 {
        return Err(Undefined::TooShort {
            n: n_draws,
            fewest: 2,
        });
    }
    let seen = |times: u64| counts.iter().filter(|count| **count == times).count() as f64;
    let (once, twice, n) = (seen(1), seen(2), n_draws as f64);
    Ok(UnseenMass {
        mass: once / n,
        standard_error: (once + twice > 0.0)
            .then(|| (once * (1.0 - once / n) + 2.0 * twice).sqrt() / n),
        n_once: once as u64,
        n_draws,
    })
}

/// How often each topology is met at every `stride`-th step of a chain given as (topology, number
/// of steps): at the last step of each whole stride. In the order of the topologies' indices.
pub fn spaced_counts(stretches: impl Iterator<Item = (u32, u64)>, stride: u64) -> Vec<u64> {
    assert!(stride > 0, "a stride of at least one step");
    let (mut step, mut counts) = (0, BTreeMap::new());
    for (topology, n) in stretches {
        let met = (step + n) / stride - step / stride;
        if met > 0 {
            *counts.entry(topology).or_insert(0) += met;
        }
        step += n;
    }
    counts.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    #[test]
    fn known_counts() {
        let found = unseen_mass(&[5, 1, 2, 1, 1]).expect("ten draws");
        assert_eq!((found.mass, found.n_once, found.n_draws), (0.3, 3, 10));
        let error = (3.0 * 0.7 + 2.0_f64).sqrt() / 10.0;
        assert!((found.standard_error.expect("some") - error).abs() < 1e-15);
        assert_eq!(unseen_mass(&[7, 5]).expect("draws").standard_error, None);
        assert_eq!(
            unseen_mass(&[1]),
            Err(Undefined::TooShort { n: 1, fewest: 2 })
        );
    }

    /// Draws from a law on 400 topologies whose unseen mass is known: over 400 repetitions, error
    /// over standard error has mean 0 and variance 1, to within five standard errors of each.
    #[test]
    fn errors_are_as_large_as_said() {
        let weight = |k: u32| 1.0 / (1.0 + f64::from(k));
        let total: f64 = (0..400).map(weight).sum();
        let cumulative: Vec<f64> = (0..400)
            .scan(0.0, |sum, k| {
                *sum += weight(k) / total;
                Some(*sum)
            })
            .collect();
        let mut rng = Purpose::new("unseen", 1).generator();
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..400 {
            let mut counts = vec![0_u64; 400];
            for _ in 0..300 {
                let u = rng.random::<f64>();
                counts[cumulative.partition_point(|c| *c <= u).min(399)] += 1;
            }
            let unseen: f64 = (0..400)
                .filter(|k| counts[*k as usize] == 0)
                .map(weight)
                .sum();
            let found = unseen_mass(&counts).expect("draws");
            let z = (found.mass - unseen / total) / found.standard_error.expect("some");
            sum += z;
            squares += z * z;
        }
        let (mean, variance) = (sum / 400.0, squares / 400.0 - (sum / 400.0) * (sum / 400.0));
        assert!(mean.abs() < 5.0 / 20.0, "{mean}");
        assert!(
            (variance - 1.0).abs() < 5.0 * (2.0_f64 / 400.0).sqrt(),
            "{variance}"
        );
    }

    #[test]
    fn every_third_step() {
        let stretches = [(4, 2), (7, 5), (4, 1), (9, 1)];
        // Steps 3, 6 and 9 of 4 4 7 7 7 7 7 4 9.
        assert_eq!(spaced_counts(stretches.into_iter(), 3), [2, 1]);
        assert_eq!(spaced_counts(stretches.into_iter(), 1), [3, 5, 1]);
        assert!(spaced_counts(stretches.into_iter(), 10).is_empty());
    }
}
