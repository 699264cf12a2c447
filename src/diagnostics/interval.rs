//! Intervals for rates.

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

/// Wilson's (1927) score interval for `successes` out of `n` independent trials; `None` if n is 0.
pub fn wilson(successes: f64, n: u64) -> Option<Interval> {
    if n == 0 {
        return None;
    }
    let n = n as f64;
    Some(wilson_at(successes / n, n))
}

/// Wilson's interval for a share `p` of `n` > 0 trials, which need not be whole.
pub fn wilson_at(p: f64, n: f64) -> Interval {
    let z2 = Z_95 * Z_95;
    let centre = p + z2 / (2.0 * n);
    let half = Z_95 * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z2 / n;
    Interval {
        low: ((centre - half) / scale).max(0.0),
        high: ((centre + half) / scale).min(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
