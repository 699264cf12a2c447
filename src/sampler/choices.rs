//! The random choices that moves make.
//!
//! A choice of [`Choices`] is discrete and says its probabilities, so that a chain can draw it from
//! a generator and a test can walk through all of them and know exactly how probable each proposal
//! is. Moves of locations draw from [`Random`], through which a test can script what they draw, or
//! bias what they accept.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::model::nearby::Nearby;

/// Where choices come from.
pub trait Choices {
    /// A uniform number below n ≥ 1.
    fn below(&mut self, n: usize) -> usize;
    /// n ≤ 64 fair coins, in the lowest bits.
    fn coins(&mut self, n: usize) -> u64;
    /// An index with these probabilities, which sum to 1 but for rounding.
    fn index(&mut self, probabilities: &[f64]) -> usize;
}

impl<R: Rng> Choices for R {
    fn below(&mut self, n: usize) -> usize {
        self.random_range(0..n as u32) as usize
    }

    fn coins(&mut self, n: usize) -> u64 {
        let coins = self.next_u64();
        if n < 64 {
            coins & ((1 << n) - 1)
        } else {
            coins
        }
    }

    fn index(&mut self, probabilities: &[f64]) -> usize {
        let mut left: f64 = self.random();
        let mut chosen = 0;
        for (ix, probability) in probabilities.iter().enumerate() {
            if *probability > 0.0 {
                chosen = ix;
                if left < *probability {
                    break;
                }
                left -= probability;
            }
        }
        chosen
    }
}

/// What moves of locations draw besides, and the numbers that decide whether they are accepted.
pub trait Random: Choices {
    /// A uniform number in (0, 1).
    fn uniform(&mut self) -> f64;
    /// Two independent standard normal numbers.
    fn normals(&mut self) -> [f64; 2];

    /// An exponential number with mean 1.
    fn exponential(&mut self) -> f64 {
        -libm::log(self.uniform())
    }

    /// A uniform point of the unit circle.
    fn direction(&mut self) -> [f64; 2] {
        loop {
            let [x, y] = [2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0];
            let square = x * x + y * y;
            if square > 1e-12 && square <= 1.0 {
                let scale = 1.0 / square.sqrt();
                return [x * scale, y * scale];
            }
        }
    }

    /// An index with probability proportional to these weights, whose sum is `total` > 0.
    fn pick(&mut self, weights: &[f64], total: f64) -> usize {
        let mut left = self.uniform() * total;
        let mut chosen = 0;
        for (ix, weight) in weights.iter().enumerate() {
            if *weight > 0.0 {
                chosen = ix;
                left -= weight;
                if left <= 0.0 {
                    break;
                }
            }
        }
        chosen
    }

    /// ln u of an acceptance rule, u uniform on (0, 1): a proposal is accepted if it is below ln of
    /// its ratio.
    fn ln_threshold(&mut self) -> f64 {
        libm::log(self.uniform())
    }

    /// Whether a proposal with the ratio `part`/`whole` is accepted. A NaN never is.
    fn accepts(&mut self, part: f64, whole: f64) -> bool {
        self.uniform() * whole < part
    }

    /// How far above the present −ln likelihood a slice reaches, nats.
    fn slice_height(&mut self) -> f64 {
        self.exponential()
    }
}

impl<R: Rng> Random for R {
    #[inline]
    fn uniform(&mut self) -> f64 {
        ((self.next_u64() >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
    }

    #[inline]
    fn normals(&mut self) -> [f64; 2] {
        [StandardNormal.sample(self), StandardNormal.sample(self)]
    }
}

/// Shuffles uniformly (Fisher & Yates).
pub fn shuffle(list: &mut [u32], choices: &mut impl Choices) {
    for last in (1..list.len()).rev() {
        list.swap(last, choices.below(last + 1));
    }
}

/// Two different detections, every ordered pair alike. Needs N ≥ 2.
pub fn pair(n_detections: usize, choices: &mut impl Choices) -> [u32; 2] {
    let first = choices.below(n_detections);
    let other = choices.below(n_detections - 1);
    [first as u32, (other + usize::from(other >= first)) as u32]
}

/// A partner for detection i by the law of [`Nearby`]. Needs N ≥ 2.
pub fn nearby(law: &Nearby, i: u32, choices: &mut impl Choices) -> u32 {
    let level = choices.below(law.n_levels());
    match law.n_others(level, i) {
        0 => law.other(law.n_levels() - 1, i, choices.below(law.n_detections() - 1)),
        n_others => law.other(level, i, choices.below(n_others)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    #[test]
    fn directions_lie_on_the_circle_and_favour_none() {
        let mut rng = Purpose::new("choices test", 1).generator();
        let n = 40_000;
        let mut sums = [0.0; 4];
        for _ in 0..n {
            let [x, y] = rng.direction();
            assert!((x * x + y * y - 1.0).abs() < 1e-12);
            // The first and the second harmonic.
            for (sum, value) in sums.iter_mut().zip([x, y, x * x - y * y, 2.0 * x * y]) {
                *sum += value;
            }
        }
        // Each has mean 0 and variance ½: five standard deviations.
        let most = 5.0 * (0.5 * f64::from(n)).sqrt();
        assert!(sums.iter().all(|sum| sum.abs() < most), "{sums:?}");
    }

    #[test]
    fn a_shuffle_brings_each_to_each_place() {
        let mut rng = Purpose::new("choices test", 2).generator();
        let n = 24_000;
        let mut counts = [0_u32; 24];
        for _ in 0..n {
            let mut list = [0, 1, 2, 3];
            shuffle(&mut list, &mut rng);
            let rest = |from: usize| list[from + 1..].iter().filter(|&&x| x < list[from]).count();
            counts[6 * rest(0) + 2 * rest(1) + rest(2)] += 1;
        }
        // χ² with 23 degrees of freedom is below 59 in all but 5 of 100,000 cases.
        let expected = f64::from(n) / 24.0;
        let chi2: f64 = counts
            .iter()
            .map(|&count| (f64::from(count) - expected).powi(2) / expected)
            .sum();
        assert!(chi2 < 59.0, "{counts:?}");
    }
}
