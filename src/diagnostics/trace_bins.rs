//! A long trace in few bins, truthfully: the smallest and largest value of each, and their mean.

use serde::{Deserialize, Serialize};

/// A series in bins of equal width; the last one may be narrower.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TraceBins {
    /// Number of steps in all.
    pub n_steps: u64,
    /// Steps per bin.
    pub width: u64,
    /// Smallest value in each bin.
    pub low: Vec<u32>,
    /// Largest value in each bin.
    pub high: Vec<u32>,
    /// Sum of the values in each bin.
    pub sum: Vec<u64>,
}

impl TraceBins {
    /// First step of every bin with the smallest, largest and mean value in it.
    pub fn iter(&self) -> impl Iterator<Item = (u64, u32, u32, f64)> {
        (0..self.low.len()).map(|bin| {
            let first = bin as u64 * self.width;
            let n = self.width.min(self.n_steps - first);
            (
                first,
                self.low[bin],
                self.high[bin],
                self.sum[bin] as f64 / n as f64,
            )
        })
    }
}

/// Bins a series of stretches (value, number of steps) into at most `max_bins`.
pub fn bin(stretches: impl Iterator<Item = (u32, u64)>, n_steps: u64, max_bins: u64) -> TraceBins {
    let width = n_steps.div_ceil(max_bins).max(1);
    let n_bins = n_steps.div_ceil(width) as usize;
    let (mut low, mut high, mut sum) = (vec![u32::MAX; n_bins], vec![0; n_bins], vec![0; n_bins]);
    let mut step = 0;
    for (value, n) in stretches {
        if n == 0 {
            continue;
        }
        let end = step + n;
        while step < end {
            let bin = (step / width) as usize;
            let bin_end = end.min((bin as u64 + 1) * width);
            low[bin] = low[bin].min(value);
            high[bin] = high[bin].max(value);
            sum[bin] += u64::from(value) * (bin_end - step);
            step = bin_end;
        }
    }
    assert_eq!(step, n_steps, "the stretches cover the series");
    TraceBins {
        n_steps,
        width,
        low,
        high,
        sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_survive() {
        let bins = bin([(5, 4), (9, 1), (2, 6)].into_iter(), 11, 4);
        assert_eq!(
            (bins.width, &bins.low, &bins.high),
            (3, &vec![5, 2, 2, 2], &vec![5, 9, 2, 2])
        );
        let means: Vec<f64> = bins.iter().map(|(_, _, _, mean)| mean).collect();
        assert_eq!(means, [5.0, 16.0 / 3.0, 2.0, 2.0]);
        let fine = bin([(1, 2), (2, 1)].into_iter(), 3, 100);
        assert_eq!(
            (fine.width, fine.low.clone(), fine.high),
            (1, vec![1, 1, 2], vec![1, 1, 2])
        );
        assert!(bin(std::iter::empty(), 0, 10).low.is_empty());
    }
}
