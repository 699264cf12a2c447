//! How far the law of a chain may be from its posterior after t steps, by the times at which
//! coupled chains meet.
//!
//! Of two chains from starts of one rule, one L steps ahead, that meet at step τ of the one ahead,
//! TV(law after t steps, π) ≤ E[max(0, ⌈(τ − L − t)/L⌉)] (Biswas, Jacob & Vanetti 2019, NeurIPS,
//! theorem 2.5). The mean over pairs estimates the right-hand side.

/// A mean over pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The mean; total variation is at most 1, and it may be more.
    pub value: f64,
    /// Its standard error; 0 of a single pair.
    pub se: f64,
}

/// The bound after `t` steps, from the steps at which each pair met, of lag `lag` ≥ 1; at least one
/// pair.
pub fn total_variation(met: &[u64], lag: u64, t: u64) -> Bound {
    let terms = || {
        let beyond = met.iter().map(|met| met.saturating_sub(lag + t));
        beyond.map(|beyond| beyond.div_ceil(lag) as f64)
    };
    let n = met.len() as f64;
    let value = terms().sum::<f64>() / n;
    let variance = terms().map(|term| (term - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Bound {
        value,
        se: (variance / n).sqrt(),
    }
}

/// The fewest steps after which the bound is at most `most` ≥ 0.
pub fn steps_until(met: &[u64], lag: u64, most: f64) -> u64 {
    let (mut low, mut high) = (0, met.iter().copied().max().unwrap_or(0));
    while low < high {
        let middle = low + (high - low) / 2;
        if total_variation(met, lag, middle).value <= most {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain that is at π with probability p after each step, and stays where it is otherwise:
    /// coupled at its best it meets after a geometric number of steps, and TV after t steps is (1 −
    /// p)^t.
    #[test]
    fn the_bound_of_a_chain_whose_distance_is_known() {
        let (p, lag, n) = (0.01_f64, 200, 20_000);
        // Quantiles of the geometric law instead of draws.
        let quantile = |k: u64| {
            let u = (k as f64 + 0.5) / n as f64;
            ((1.0 - u).ln() / (1.0 - p).ln()).ceil() as u64
        };
        let met: Vec<u64> = (0..n).map(|k| lag + quantile(k)).collect();
        for t in [0, 50, 200, 700] {
            let distance = (1.0 - p).powi(t as i32);
            let bound = total_variation(&met, lag, t);
            // Σ_k P(geometric > t + kL) = (1 − p)^t / (1 − (1 − p)^L).
            let expected = distance / (1.0 - (1.0 - p).powi(lag as i32));
            assert!(
                (bound.value - expected).abs() < 0.01 * expected + 1e-3,
                "{t}"
            );
            assert!(bound.value > distance * 0.999, "{t}");
            assert!(bound.se < 0.02);
        }
        let t = steps_until(&met, lag, 0.01);
        assert!(total_variation(&met, lag, t).value <= 0.01);
        assert!(total_variation(&met, lag, t - 1).value > 0.01);
        assert_eq!(steps_until(&[lag], lag, 0.0), 0);
        assert_eq!(
            total_variation(&[lag + 1], lag, 0),
            Bound {
                value: 1.0,
                se: 0.0
            }
        );
    }
}
