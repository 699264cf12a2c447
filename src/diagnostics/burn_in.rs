//! Burn-in by MSER-5 (White 1997; White & Spratt 2000).
//!
//! The series is cut into batches of five, and the burn-in is the number of batches d ≤ n/2 that
//! minimises the squared standard error of the mean of what is left, SS(d)/(n − d)². A minimum at
//! the end of that range means that the series was still on its way: it never settled.

/// Batch size of MSER-5 (White & Spratt 2000).
const BATCH: usize = 5;
/// A series shorter than this many batches is not judged.
const FEWEST_BATCHES: usize = 10;

/// Where a series settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BurnIn {
    /// After this many steps.
    Settled(u64),
    /// Nowhere in the first half.
    NeverSettled,
    /// The series is too short to tell.
    TooShort,
}

/// MSER-5 of a series of finite values.
pub fn mser(series: &[f64]) -> BurnIn {
    let batches: Vec<f64> = series
        .chunks_exact(BATCH)
        .map(|batch| batch.iter().sum::<f64>() / BATCH as f64)
        .collect();
    let n = batches.len();
    if n < FEWEST_BATCHES {
        return BurnIn::TooShort;
    }
    // Welford's update from the end: the sum of squares of a constant tail is exactly 0.
    let (mut mean, mut sum_of_squares) = (0.0, 0.0);
    let (mut best, mut best_d) = (f64::INFINITY, 0);
    for d in (0..n).rev() {
        let kept = (n - d) as f64;
        let deviation = batches[d] - mean;
        mean += deviation / kept;
        sum_of_squares += deviation * (batches[d] - mean);
        let statistic = sum_of_squares / (kept * kept);
        if d <= n / 2 && statistic <= best {
            (best, best_d) = (statistic, d);
        }
    }
    if best_d == n / 2 {
        BurnIn::NeverSettled
    } else {
        BurnIn::Settled((best_d * BATCH) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    #[test]
    fn finds_where_a_transient_ends() {
        let mut rng = Purpose::new("test", 1).generator();
        let series: Vec<f64> = (0..4000)
            .map(|t| if t < 600 { 8.0 - f64::from(t) / 100.0 } else { 2.0 } + rng.random::<f64>())
            .collect();
        let BurnIn::Settled(burn_in) = mser(&series) else {
            panic!("it settles")
        };
        assert!((450..=650).contains(&burn_in), "{burn_in}");
    }

    #[test]
    fn a_ramp_never_settles() {
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        assert_eq!(mser(&ramp), BurnIn::NeverSettled);
    }

    #[test]
    fn constants_settle_at_once_and_jumps_where_they_end() {
        assert_eq!(mser(&[3.0; 200]), BurnIn::Settled(0));
        let mut jump = vec![0.1; 60];
        jump.extend([0.3; 200]);
        assert_eq!(mser(&jump), BurnIn::Settled(60));
        assert_eq!(mser(&[1.0; 49]), BurnIn::TooShort);
    }
}
