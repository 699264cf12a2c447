//! The report's split-merge proposal (algorithm 2), and its program's faulty version.
//!
//! Merge or split, each with probability ½. Merge: a uniform pair of sets. Split: a uniform
//! non-singleton set, then a uniform one of its S(n, 2) = 2^{n−1} − 1 two-way splits. With
//! N_m = C(M, 2) merges and N_s non-singleton sets, q(T|T')/q(T'|T) is
//!
//! - merge: N_m(T) / (N_s(T')·S(n, 2)), n the size of the merged set;
//! - split: N_s(T)·S(n, 2) / N_m(T'), n the size of the split set.

use std::fmt;
use std::str::FromStr;

use super::choices::{Choices, pair};
use super::moves::{MoveKind, Proposal};
use crate::partition::count::{ln_stirling_first_2, ln_stirling_second_2, n_merges};
use crate::partition::{Change, Partition};

/// How a set is split in two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitRule {
    /// A uniform one of the 2^{n−1} − 1 splits. Correct.
    Uniform,
    /// **Incorrect**, as in the source report's program: the stored order of the set is cut at a
    /// uniform place 0..n−1, with the unsigned Stirling number of the *first* kind in the ratio.
    /// Place 0 proposes T' = T with new draws, at the ratio N_s·c(n, 2)/C(M, 2), 0 if M is 1. The
    /// chain has no stationary law of interest.
    PrefixCut,
}

impl SplitRule {
    fn ln_splits(self, n: usize) -> f64 {
        match self {
            Self::Uniform => ln_stirling_second_2(n),
            Self::PrefixCut => ln_stirling_first_2(n),
        }
    }
}

/// Describes a merge or a split in `change`, and returns its kind. A merge at M = 1 and a split at
/// M = N are impossible.
pub fn propose(
    rule: SplitRule,
    partition: &Partition,
    change: &mut Change,
    choices: &mut impl Choices,
) -> (MoveKind, Proposal) {
    let (kind, ln_ratio) = if choices.coins(1) == 1 {
        (MoveKind::Merge, merge(rule, partition, change, choices))
    } else {
        (MoveKind::Split, split(rule, partition, change, choices))
    };
    let change = |ln_ratio| Proposal::Change { ln_ratio };
    (kind, ln_ratio.map_or(Proposal::Impossible, change))
}

fn merge(
    rule: SplitRule,
    partition: &Partition,
    change: &mut Change,
    choices: &mut impl Choices,
) -> Option<f64> {
    if partition.n_sets() < 2 {
        return None;
    }
    let [first, second] = pair(partition.n_sets(), choices);
    let members = change.add();
    members.extend_from_slice(&partition.sets()[first as usize]);
    members.extend_from_slice(&partition.sets()[second as usize]);
    let size = members.len();
    change.remove(first);
    change.remove(second);
    let n_splittable = partition.non_singletons_after(change) as f64;
    Some(libm::log(n_merges(partition.n_sets()) / n_splittable) - rule.ln_splits(size))
}

fn split(
    rule: SplitRule,
    partition: &Partition,
    change: &mut Change,
    choices: &mut impl Choices,
) -> Option<f64> {
    let candidates = partition.non_singletons();
    if candidates.is_empty() {
        return None;
    }
    let set_ix = candidates[choices.below(candidates.len())];
    let members = &partition.sets()[set_ix as usize];
    let n = members.len();
    let ln_ways = libm::log(candidates.len() as f64) + rule.ln_splits(n);
    match rule {
        SplitRule::Uniform => split_uniformly(members, change, choices),
        SplitRule::PrefixCut => {
            let cut = choices.below(n);
            if cut == 0 {
                // T' = T: nothing changes but the draws.
                let merges = n_merges(partition.n_sets());
                return Some(if merges == 0.0 {
                    f64::NEG_INFINITY
                } else {
                    ln_ways - libm::log(merges)
                });
            }
            change.add().extend_from_slice(&members[..cut]);
            change.add().extend_from_slice(&members[cut..]);
        }
    }
    change.remove(set_ix);
    Some(ln_ways - libm::log(n_merges(partition.n_sets() + 1)))
}

/// Fills two sets with a uniform one of the 2^{n−1} − 1 splits: the first member opens the first
/// set, every other joins by a fair coin, and the one outcome that leaves the second set empty is
/// drawn again.
fn split_uniformly(members: &[u32], change: &mut Change, choices: &mut impl Choices) {
    let (first, second) = change.add_two();
    loop {
        first.clear();
        second.clear();
        first.push(members[0]);
        for run in members[1..].chunks(64) {
            let mut coins = choices.coins(run.len());
            for &i in run {
                if coins & 1 == 0 {
                    first.push(i)
                } else {
                    second.push(i)
                }
                coins >>= 1;
            }
        }
        if !second.is_empty() {
            return;
        }
    }
}

impl fmt::Display for SplitRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Uniform => "uniform",
            Self::PrefixCut => "prefix-cut",
        })
    }
}

impl FromStr for SplitRule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "uniform" => Ok(Self::Uniform),
            "prefix-cut" => Ok(Self::PrefixCut),
            _ => Err("uniform, or prefix-cut (incorrect: the report's program)".to_owned()),
        }
    }
}
