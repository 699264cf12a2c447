//! The random choices that moves make.
//!
//! Every choice is discrete and says its probabilities, so that a chain can draw it from a generator and a
//! test can walk through all of them and know exactly how probable each proposal is.

use rand::{Rng, RngExt};

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
