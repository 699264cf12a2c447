//! Whether an importance sampling estimate can be trusted: the shape of its weights' upper tail.
//!
//! The largest min(S/5, 3√S) of S weights are fitted by a generalised Pareto law (Zhang & Stephens,
//! Technometrics 51, 2009) as in Vehtari et al. (JMLR 25, 2024), without their prior on k. Above k = 0.7
//! the error of the estimate is of no use at any S that can be had; above 0.5 the variance is infinite as
//! far as the tail shows. Weights that are bounded have k < 0 in the end, but the end may lie beyond
//! every draw: what is fitted is the tail that was seen.

/// Above this an estimate is not to be trusted (Vehtari et al.).
pub const MAX_PARETO_K: f64 = 0.7;
/// Fewer tail weights than this are no tail.
const MIN_TAIL: usize = 5;

/// k̂ of weights given by their logarithms; `None` if there are fewer than 25, or if they do not vary.
pub fn pareto_k(ln_weights: &[f64]) -> Option<f64> {
    let n_weights = ln_weights.len();
    let n_tail = (n_weights / 5).min((3.0 * (n_weights as f64).sqrt()) as usize);
    if n_tail < MIN_TAIL {
        return None;
    }
    let mut sorted = ln_weights.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = *sorted.last()?;
    let weight = |l: f64| libm::exp(l - largest);
    let cut = weight(sorted[n_weights - n_tail - 1]);
    let tail: Vec<f64> = sorted[n_weights - n_tail..]
        .iter()
        .map(|&l| weight(l) - cut)
        .collect();
    let quartile = tail[((n_tail as f64 / 4.0 + 0.5) as usize).max(1) - 1];
    if !(quartile > 0.0 && largest.is_finite()) {
        return None;
    }
    let n = n_tail as f64;
    let n_grid = 30 + n.sqrt() as usize;
    let shape = |b: f64| tail.iter().map(|&x| libm::log1p(-b * x)).sum::<f64>() / n;
    let grid: Vec<(f64, f64)> = (1..=n_grid)
        .map(|place| {
            let root = (n_grid as f64 / (place as f64 - 0.5)).sqrt();
            let b = (1.0 - root) / (3.0 * quartile) + 1.0 / tail[n_tail - 1];
            let k = shape(b);
            (b, n * (libm::log(-b / k) - k - 1.0))
        })
        .collect();
    let top = grid
        .iter()
        .map(|(_, l)| *l)
        .fold(f64::NEG_INFINITY, f64::max);
    let (mut total, mut mean) = (0.0, 0.0);
    for (b, l) in grid.into_iter().filter(|(_, l)| l.is_finite()) {
        total += libm::exp(l - top);
        mean += b * libm::exp(l - top);
    }
    let k = shape(mean / total);
    k.is_finite().then_some(k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    /// Weights u^{−k} have a Pareto tail of shape k. With 300 tail weights the standard error of k̂ is
    /// about (1 + k)/√300, by the Fisher information; five of them.
    #[test]
    fn finds_the_shape_of_a_pareto_tail() {
        let mut rng = Purpose::new("pareto test", 1).generator();
        for k in [0.2, 0.5, 0.9] {
            let ln_weights: Vec<f64> = (0..10_000)
                .map(|_| -k * (1.0 - rng.random::<f64>()).ln())
                .collect();
            let found = pareto_k(&ln_weights).expect("a tail");
            assert!(
                (found - k).abs() < 5.0 * (1.0 + k) / 300_f64.sqrt(),
                "{k} {found}"
            );
            // The scale of the weights is of no meaning.
            let shifted: Vec<f64> = ln_weights.iter().map(|l| l - 5000.0).collect();
            let other = pareto_k(&shifted).expect("a tail");
            assert!((found - other).abs() < 1e-6);
        }
    }

    #[test]
    fn what_has_no_tail_has_no_shape() {
        assert_eq!(pareto_k(&[0.0; 1000]), None);
        assert_eq!(pareto_k(&[1.0, 2.0, 3.0]), None);
        assert_eq!(pareto_k(&[f64::NEG_INFINITY; 100]), None);
    }
}
