//! Intervals for rates.

use rand::{Rng, RngExt};

/// A 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// 97.5 % quantile of the standard normal law.
pub(super) const Z_95: f64 = 1.959_963_984_540_054;
/// Bootstrap replications; the ends of a 95 % interval are then known to about 1 % of its width.
const N_BOOTSTRAP: usize = 4000;

/// Wilson's (1927) score interval for `successes` out of `n` independent trials; `None` if n is 0.
pub fn wilson(successes: f64, n: u64) -> Option<Interval> {
    if n == 0 {
        return None;
    }
    let (n, z2) = (n as f64, Z_95 * Z_95);
    let p = successes / n;
    let centre = p + z2 / (2.0 * n);
    let half = Z_95 * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z2 / n;
    Some(Interval {
        low: ((centre - half) / scale).max(0.0),
        high: ((centre + half) / scale).min(1.0),
    })
}

/// Percentile bootstrap (Efron 1979) of the mean of independent values; `None` for fewer than two.
pub fn bootstrap_mean(values: &[f64], rng: &mut impl Rng) -> Option<Interval> {
    if values.len() < 2 {
        return None;
    }
    let mut means: Vec<f64> = (0..N_BOOTSTRAP)
        .map(|_| {
            let draw = || values[rng.random_range(0..values.len())];
            std::iter::repeat_with(draw).take(values.len()).sum::<f64>() / values.len() as f64
        })
        .collect();
    means.sort_unstable_by(f64::total_cmp);
    let quantile = |p: f64| means[((N_BOOTSTRAP - 1) as f64 * p).round() as usize];
    Some(Interval {
        low: quantile(0.025),
        high: quantile(0.975),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    #[test]
    fn wilson_on_known_answers() {
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let none = wilson(0.0, 20).expect("twenty trials");
        assert!(
            none.low == 0.0 && close(none.high, 0.161_125_158),
            "{none:?}"
        );
        let some = wilson(535.0, 1000).expect("a thousand trials");
        assert!(
            close(some.low, 0.504_011_246) && close(some.high, 0.565_720_881),
            "{some:?}"
        );
        assert_eq!(wilson(0.0, 0), None);
    }

    #[test]
    fn bootstrap_covers_and_is_as_wide_as_theory_says() {
        let mut rng = Purpose::new("test", 1).generator();
        let values: Vec<f64> = (0..200).map(|i| f64::from(i % 4) / 3.0).collect();
        let interval = bootstrap_mean(&values, &mut rng).expect("many values");
        // Standard deviation √(5/36) of a value; the normal interval is ±1.96 of it over √200.
        let half = Z_95 * (5.0_f64 / 36.0 / 200.0).sqrt();
        assert!(
            (interval.low - (0.5 - half)).abs() < 0.2 * half,
            "{interval:?}"
        );
        assert!(
            (interval.high - (0.5 + half)).abs() < 0.2 * half,
            "{interval:?}"
        );
        assert_eq!(bootstrap_mean(&[1.0], &mut rng), None);
    }
}
