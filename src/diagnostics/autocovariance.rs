//! Autocovariances of several series about their means, one lag after another.
//!
//! ĉ_t is the mean over m series of (1/n) Σ_s x_s x_{s+t}. The first [`DIRECT_LAGS`] are sums; most
//! series that mix need no more. Whoever asks further pays once for all lags, by the Wiener–Khinchin
//! theorem: ĉ is the inverse Fourier transform of the power spectrum of the series, which are padded with
//! zeros to at least twice their length so that none meets itself from behind. Two series share a transform,
//! as real and imaginary part of z: Re Σ z̄_s z_{s+t} is the sum of what belongs to both.
//!
//! The transform is a plain one of radix two. Libraries choose another algorithm for each processor, and
//! take their sines from the system's mathematics; here the same series gives the same bits everywhere.

use std::cell::OnceCell;
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Lags that are summed one by one.
const DIRECT_LAGS: usize = 64;

/// Series about their means with their autocovariances.
pub(super) struct Autocovariances {
    deviations: Vec<Vec<f64>>,
    of_all_lags: OnceCell<Vec<f64>>,
}

impl Autocovariances {
    /// Of series of one length, each with its mean taken off.
    pub(super) fn new(deviations: Vec<Vec<f64>>) -> Self {
        Self {
            deviations,
            of_all_lags: OnceCell::new(),
        }
    }

    /// ĉ at a lag below the length of the series.
    pub(super) fn at(&self, lag: usize) -> f64 {
        if lag < DIRECT_LAGS {
            self.summed(lag)
        } else {
            self.of_all_lags.get_or_init(|| self.transformed())[lag]
        }
    }

    fn summed(&self, lag: usize) -> f64 {
        let of_series =
            |x: &Vec<f64>| lanes::inner_product(&x[..x.len() - lag], &x[lag..]) / x.len() as f64;
        self.deviations.iter().map(of_series).sum::<f64>() / self.deviations.len() as f64
    }

    fn transformed(&self) -> Vec<f64> {
        let n = self.deviations[0].len();
        let size = (2 * n).next_power_of_two();
        let mut power = vec![0.0; size];
        let (mut re, mut im) = (vec![0.0; size], vec![0.0; size]);
        for pair in self.deviations.chunks(2) {
            for (part, series) in [(&mut re, pair.first()), (&mut im, pair.get(1))] {
                part.fill(0.0);
                if let Some(series) = series {
                    part[..n].copy_from_slice(series);
                }
            }
            transform(&mut re, &mut im);
            for (k, sum) in power.iter_mut().enumerate() {
                *sum += re[k] * re[k] + im[k] * im[k];
            }
        }
        im.fill(0.0);
        transform_back(&mut power, &mut im);
        let scale = 1.0 / (size as f64 * n as f64 * self.deviations.len() as f64);
        power.truncate(n);
        power.iter_mut().for_each(|sum| *sum *= scale);
        power
    }
}

/// cos and sin of πj/h for j below h, h a power of two; made once.
fn turns(half: usize) -> &'static (Vec<f64>, Vec<f64>) {
    static TURNS: [OnceLock<(Vec<f64>, Vec<f64>)>; usize::BITS as usize] =
        [const { OnceLock::new() }; usize::BITS as usize];
    TURNS[half.ilog2() as usize].get_or_init(|| {
        let angles = (0..half).map(|j| PI * j as f64 / half as f64);
        angles.map(|x| (libm::cos(x), libm::sin(x))).unzip()
    })
}

/// Σ_s z_s exp(−2πi ks/n) with k in the order of reversed bits: decimation in frequency.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let mut half = re.len() / 2;
    while half > 0 {
        lanes::forward(re, im, turns(half));
        half /= 2;
    }
}

/// Σ_k z_k exp(2πi ks/n) of what [`transform`] gave, without its bits ever being put in order:
/// decimation in time.
fn transform_back(re: &mut [f64], im: &mut [f64]) {
    let mut half = 1;
    while half < re.len() {
        lanes::back(re, im, turns(half));
        half *= 2;
    }
}

mod lanes {
    // `multiversion` checks what the CPU has and then calls the version compiled for it; the order of the sums is the
    // same in all, and none fuses a product with a sum, so they give the same bits.
    #![allow(unsafe_code)]

    use multiversion::multiversion;

    /// Sums beside one another in a fixed order: a single one would wait for every addition before the next.
    const LANES: usize = 16;

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn inner_product(a: &[f64], b: &[f64]) -> f64 {
        let mut sums = [0.0; LANES];
        let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
        for (x, y) in a.iter().zip(b) {
            for lane in 0..LANES {
                sums[lane] += x[lane] * y[lane];
            }
        }
        let rest = a_rest.iter().zip(b_rest);
        sums.iter().sum::<f64>() + rest.map(|(x, y)| x * y).sum::<f64>()
    }

    /// One stage of decimation in frequency: (a, b) → (a + b, (a − b) w̄_j) in blocks of twice the turns.
    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn forward(re: &mut [f64], im: &mut [f64], turns: &(Vec<f64>, Vec<f64>)) {
        stage(re, im, turns, |a, b, [cos, sin]| {
            let [x, y] = [a[0] - b[0], a[1] - b[1]];
            let turned = [x * cos + y * sin, y * cos - x * sin];
            ([a[0] + b[0], a[1] + b[1]], turned)
        });
    }

    /// One stage of decimation in time: (a, b) → (a + b w_j, a − b w_j).
    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn back(re: &mut [f64], im: &mut [f64], turns: &(Vec<f64>, Vec<f64>)) {
        stage(re, im, turns, |a, b, [cos, sin]| {
            let [x, y] = [b[0] * cos - b[1] * sin, b[1] * cos + b[0] * sin];
            ([a[0] + x, a[1] + y], [a[0] - x, a[1] - y])
        });
    }

    /// Replaces every pair of numbers half a block apart by what the butterfly makes of them and of their turn.
    #[inline(always)]
    fn stage(
        re: &mut [f64],
        im: &mut [f64],
        (cos, sin): &(Vec<f64>, Vec<f64>),
        butterfly: impl Fn([f64; 2], [f64; 2], [f64; 2]) -> ([f64; 2], [f64; 2]),
    ) {
        let half = cos.len();
        let blocks = re.chunks_exact_mut(2 * half);
        for (re, im) in blocks.zip(im.chunks_exact_mut(2 * half)) {
            let ((a_re, b_re), (a_im, b_im)) = (re.split_at_mut(half), im.split_at_mut(half));
            let (a, b) = (a_re.iter_mut().zip(a_im), b_re.iter_mut().zip(b_im));
            for (((a_re, a_im), (b_re, b_im)), (cos, sin)) in a.zip(b).zip(cos.iter().zip(sin)) {
                let (a, b) = butterfly([*a_re, *a_im], [*b_re, *b_im], [*cos, *sin]);
                ([*a_re, *a_im], [*b_re, *b_im]) = (a, b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::tests::ar1;

    /// Lengths on both sides of a power of two, one series to a transform and two, and the last lags, where a
    /// series that is not padded enough would meet itself.
    #[test]
    fn all_lags_at_once_are_the_sums() {
        for (n_series, n) in [(1, 65), (2, 127), (3, 128), (4, 1000), (5, 4096)] {
            let series = (0..n_series).map(|k| ar1(0.9, n, k)).collect();
            let autocovariances = Autocovariances::new(series);
            let scale = autocovariances.summed(0);
            for lag in (0..n).step_by(n / 60).chain(n - 3..n) {
                let sum = autocovariances.summed(lag);
                let at_once = autocovariances.transformed()[lag];
                assert!(
                    (sum - at_once).abs() < 1e-14 * scale,
                    "{n_series} series of {n}, lag {lag}: {sum} and {at_once}"
                );
            }
        }
    }

    /// Where one way gives over to the other: each is asked for lags of its own.
    #[test]
    fn the_first_lags_need_no_transform() {
        let autocovariances = Autocovariances::new(vec![ar1(0.5, 200, 1)]);
        autocovariances.at(DIRECT_LAGS - 1);
        assert!(autocovariances.of_all_lags.get().is_none());
        autocovariances.at(DIRECT_LAGS);
        assert!(autocovariances.of_all_lags.get().is_some());
    }
}
