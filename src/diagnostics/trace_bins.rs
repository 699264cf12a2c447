//! A long trace in few bins, truthfully: the smallest and largest value of each, and their mean.

use serde::{Deserialize, Serialize};

/// A series in bins of equal width; the last one may be narrower. Thousands of chains are held at once, and few are drawn:
/// a bin is packed into three or four bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Columns", into = "Columns")]
pub struct TraceBins {
    n_steps: u64,
    width: u64,
    /// Of each bin the smallest value, how far the largest is above it, and how far the sum is above that of as many
    /// smallest ones, as variable-length integers.
    packed: Box<[u8]>,
}

/// One bin of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceBin {
    /// First step.
    pub first: u64,
    /// Number of steps.
    pub n: u64,
    /// Smallest value.
    pub low: u32,
    /// Largest value.
    pub high: u32,
    /// Sum of the values.
    pub sum: u64,
}

impl TraceBin {
    /// Mean of the values.
    pub fn mean(&self) -> f64 {
        self.sum as f64 / self.n as f64
    }
}

impl TraceBins {
    /// The bins in order.
    pub fn iter(&self) -> impl Iterator<Item = TraceBin> {
        let (mut rest, mut first) = (&*self.packed, 0);
        std::iter::from_fn(move || {
            let ((low, spread, excess), left) = postcard::take_from_bytes::<Packed>(rest).ok()?;
            rest = left;
            let n = self.width.min(self.n_steps - first);
            let bin = TraceBin {
                first,
                n,
                low,
                high: low + spread,
                sum: u64::from(low) * n + excess,
            };
            first += n;
            Some(bin)
        })
    }
}

type Packed = (u32, u32, u64);

/// As it is written down.
#[derive(Serialize, Deserialize)]
struct Columns {
    /// Number of steps in all.
    n_steps: u64,
    /// Steps per bin.
    width: u64,
    /// Smallest value in each bin.
    low: Vec<u32>,
    /// Largest value in each bin.
    high: Vec<u32>,
    /// Sum of the values in each bin.
    sum: Vec<u64>,
}

impl TryFrom<Columns> for TraceBins {
    type Error = &'static str;

    fn try_from(columns: Columns) -> Result<Self, Self::Error> {
        let (n_steps, width, n_bins) = (columns.n_steps, columns.width, columns.low.len());
        let n_covering = if width == 0 {
            0
        } else {
            n_steps.div_ceil(width)
        };
        if [n_bins, columns.high.len(), columns.sum.len()]
            .iter()
            .any(|&n| n as u64 != n_covering)
        {
            return Err("got bins of a trace that do not cover it");
        }
        let (mut packed, mut first) = (Vec::new(), 0);
        for bin in 0..n_bins {
            let (low, n) = (columns.low[bin], width.min(n_steps - first));
            let least = u64::from(low).checked_mul(n);
            let above = (
                columns.high[bin].checked_sub(low),
                least.and_then(|least| columns.sum[bin].checked_sub(least)),
            );
            let (Some(spread), Some(excess)) = above else {
                return Err("got a bin of a trace whose values contradict one another");
            };
            packed = postcard::to_extend(&(low, spread, excess), packed)
                .map_err(|_| "got a bin of a trace that cannot be packed")?;
            first += n;
        }
        Ok(Self {
            n_steps,
            width,
            packed: packed.into(),
        })
    }
}

impl From<TraceBins> for Columns {
    fn from(bins: TraceBins) -> Self {
        Self {
            n_steps: bins.n_steps,
            width: bins.width,
            low: bins.iter().map(|bin| bin.low).collect(),
            high: bins.iter().map(|bin| bin.high).collect(),
            sum: bins.iter().map(|bin| bin.sum).collect(),
        }
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
    let columns = Columns {
        n_steps,
        width,
        low,
        high,
        sum,
    };
    TraceBins::try_from(columns).expect("bins that were filled in order")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width, and of each bin the smallest and largest value and the mean.
    fn values(bins: &TraceBins) -> (u64, Vec<(u32, u32, f64)>) {
        let values = bins.iter().map(|bin| (bin.low, bin.high, bin.mean()));
        (bins.width, values.collect())
    }

    #[test]
    fn extremes_survive() {
        let bins = bin([(5, 4), (9, 1), (2, 6)].into_iter(), 11, 4);
        let expected = vec![(5, 5, 5.0), (2, 9, 16.0 / 3.0), (2, 2, 2.0), (2, 2, 2.0)];
        assert_eq!(values(&bins), (3, expected));
        let fine = bin([(1, 2), (2, 1)].into_iter(), 3, 100);
        assert_eq!(
            values(&fine),
            (1, vec![(1, 1, 1.0), (1, 1, 1.0), (2, 2, 2.0)])
        );
        assert_eq!(bin(std::iter::empty(), 0, 10).iter().count(), 0);
    }

    #[test]
    fn packing_loses_nothing() {
        let stretches = [(70_000, 3), (1, 1_000_000_000_000), (u32::MAX, 5), (0, 7)];
        let n_steps = stretches.iter().map(|(_, n)| n).sum();
        let bins = bin(stretches.into_iter(), n_steps, 7);
        let json = serde_json::to_string(&bins).expect("numbers");
        assert_eq!(
            serde_json::from_str::<TraceBins>(&json).expect("ours"),
            bins
        );
        let total: u64 = stretches.iter().map(|&(x, n)| u64::from(x) * n).sum();
        assert_eq!(bins.iter().map(|bin| bin.sum).sum::<u64>(), total);
        assert_eq!(bins.iter().map(|bin| bin.n).sum::<u64>(), n_steps);
        assert_eq!(bins.iter().map(|bin| bin.high).max(), Some(u32::MAX));
        let default = serde_json::to_string(&TraceBins::default()).expect("numbers");
        assert!(serde_json::from_str::<TraceBins>(&default).is_ok());
    }

    #[test]
    fn columns_that_contradict_one_another_are_refused() {
        for json in [
            r#"{"n_steps":4,"width":2,"low":[1],"high":[1],"sum":[2]}"#,
            r#"{"n_steps":4,"width":0,"low":[1],"high":[1],"sum":[2]}"#,
            r#"{"n_steps":2,"width":2,"low":[1],"high":[0],"sum":[2]}"#,
            r#"{"n_steps":2,"width":2,"low":[1],"high":[1],"sum":[1]}"#,
            r#"{"n_steps":2,"width":2,"low":[1],"high":[1,1],"sum":[2]}"#,
        ] {
            assert!(serde_json::from_str::<TraceBins>(json).is_err(), "{json}");
        }
    }
}
