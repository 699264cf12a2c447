//! Pairs of detections that are sometimes in one set and sometimes not, and when.
//!
//! A verdict asks of such pairs whether the chains agree and how fast they forget. Which pairs it
//! asks of must be the same in every chain, though each chain is recorded by itself. So pairs are
//! ranked by a fixed hash of their two numbers, and a chain keeps the first [`MAX_PAIRS`] of those
//! that it is unsure of. Chains that are unsure of the same pairs keep the same ones.

use std::cmp::Reverse;

use serde::{Deserialize, Serialize};

use crate::chain::ChainSums;

/// Pairs kept of a chain at most: a verdict looks at 24, and chains are unsure of slightly different
/// ones.
const MAX_PAIRS: usize = 32;
/// A chain is unsure of a pair that shares a set in this share of its draws or more, and in no more
/// than all but this share. Less than the .05 from which a verdict looks at a pair of all chains.
pub const UNSURE: f64 = 0.02;

/// One pair, and in which of a chain's stretches it shares a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSeries {
    /// Detections i < j.
    pub pair: (u32, u32),
    /// Bit k % 64 of word k / 64 says whether they share a set in stretch k.
    words: Vec<u64>,
}

impl PairSeries {
    /// From one truth value a stretch.
    pub fn new(pair: (u32, u32), together: impl IntoIterator<Item = bool>) -> Self {
        let mut words = Vec::new();
        for (k, together) in together.into_iter().enumerate() {
            if k % 64 == 0 {
                words.push(0);
            }
            words[k / 64] |= u64::from(together) << (k % 64);
        }
        Self { pair, words }
    }

    /// Whether the pair shares a set in stretch `k`.
    pub fn is_together(&self, k: usize) -> bool {
        self.words[k / 64] >> (k % 64) & 1 == 1
    }
}

/// The fixed rank of a pair: the finaliser of SplitMix64, which mixes all bits.
pub fn rank((i, j): (u32, u32)) -> u64 {
    let mut z = (u64::from(i) << 32 | u64::from(j)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Of a chain whose kept stretches stand at topologies with these labels.
pub(super) fn unsure_pairs(labels: &[&[u32]], sums: &ChainSums) -> Vec<PairSeries> {
    let n = sums.n_sets.n as f64;
    let is_unsure = |steps: u64| (UNSURE..=1.0 - UNSURE).contains(&(steps as f64 / n));
    let unsure = sums.pairs.iter().filter(|(_, steps)| is_unsure(**steps));
    let mut pairs: Vec<(u32, u32)> = unsure.map(|(pair, _)| *pair).collect();
    pairs.sort_unstable_by_key(|pair| Reverse(rank(*pair)));
    pairs.truncate(MAX_PAIRS);
    let together = |(i, j): (u32, u32)| {
        labels
            .iter()
            .map(move |labels| labels[i as usize] == labels[j as usize])
    };
    pairs
        .into_iter()
        .map(|pair| PairSeries::new(pair, together(pair)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_where_they_were_put() {
        let together = |k: usize| k.is_multiple_of(3) || k == 64;
        let series = PairSeries::new((2, 5), (0..150).map(together));
        assert!((0..150).all(|k| series.is_together(k) == together(k)));
        let text = serde_json::to_string(&series).expect("a record");
        assert_eq!(
            serde_json::from_str::<PairSeries>(&text).expect("the record"),
            series
        );
    }

    #[test]
    fn ranks_differ_and_know_no_order() {
        let ranks: Vec<u64> = (0..64).map(|j| rank((0, j))).collect();
        let ups = ranks.windows(2).filter(|pair| pair[0] < pair[1]).count();
        assert!((20..44).contains(&ups), "{ups} of 63 rise");
        assert_ne!(rank((1, 2)), rank((2, 1)));
    }
}
