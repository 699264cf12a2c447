//! Mean and standard deviation of values with weights: of a chain's states with their dwell times.

/// Weighted mean and standard deviation (of the weighted values, not of their mean).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// West's (1979) one-pass update; `None` if the weights sum to 0.
pub fn moments(values: impl Iterator<Item = (f64, u64)>) -> Option<Moments> {
    let (mut total, mut mean, mut sum_of_squares) = (0_u64, 0.0, 0.0);
    for (value, weight) in values {
        if weight == 0 {
            continue;
        }
        total += weight;
        let deviation = value - mean;
        mean += deviation * (weight as f64 / total as f64);
        sum_of_squares += weight as f64 * deviation * (value - mean);
    }
    (total > 0).then(|| Moments {
        mean,
        sd: (sum_of_squares / total as f64).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_count_as_repetitions() {
        let Moments { mean, sd } = moments([(1.0, 3), (5.0, 1)].into_iter()).expect("weights");
        assert!((mean - 2.0).abs() < 1e-15);
        assert!((sd - 3.0_f64.sqrt()).abs() < 1e-15);
        assert_eq!(moments(std::iter::empty()), None);
    }
}
