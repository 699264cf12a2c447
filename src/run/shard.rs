//! One of N parts of a sweep, for one of N machines.
//!
//! Every distinct chain of the plan belongs to one shard, by its place in the plan; nothing has to be
//! agreed on while they run. Neighbouring chains, which cost alike, go to different shards. Under a stopping rule
//! every cell belongs to one shard, by its number: what a cell needs next depends on its chains and on no others, so
//! still nothing has to be agreed on.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use super::{Journal, Plan};

/// Part `index` of `count`, counted from 0; written as `K/N`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// Part `index < count`.
    pub fn new(index: u64, count: u64) -> Option<Self> {
        (index < count).then_some(Self { index, count })
    }

    /// From 0.
    pub fn index(self) -> u64 {
        self.index
    }

    /// How many there are.
    pub fn count(self) -> u64 {
        self.count
    }

    /// Whether the chain at this place among the distinct chains of the plan, or the cell of this number, is of this
    /// part.
    pub fn holds(self, place: usize) -> bool {
        place as u64 % self.count == self.index
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (k, n) = text.split_once('/')?;
            let (k, n): (u64, u64) = (k.parse().ok()?, n.parse().ok()?);
            Self::new(k.checked_sub(1)?, n)
        };
        parse().ok_or_else(|| "K/N with 1 <= K <= N, as in 3/8".to_owned())
    }
}

/// The shards of `count` that have a chain without a record, in order, with how many each.
pub fn gaps(plan: &Plan, journal: &Journal, count: u64) -> BTreeMap<Shard, usize> {
    let mut found = BTreeMap::new();
    for (index, task) in plan.chains_by_shard(count) {
        if journal.get(&task.key).is_none()
            && let Some(shard) = Shard::new(index, count)
        {
            *found.entry(shard).or_insert(0) += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chain_is_of_one_shard() {
        for count in [1, 2, 7, 50] {
            let shards: Vec<Shard> = (0..count).filter_map(|k| Shard::new(k, count)).collect();
            assert_eq!(shards.len() as u64, count);
            for place in 0..40 {
                let of = shards.iter().filter(|shard| shard.holds(place));
                assert_eq!(of.count(), 1, "{place} of {count}");
            }
        }
    }

    #[test]
    fn a_shard_reads_back_and_nonsense_does_not() {
        let shard: Shard = "3/8".parse().expect("a shard");
        assert_eq!(
            (shard.index(), shard.count(), shard.to_string()),
            (2, 8, "3/8".to_owned())
        );
        for text in [
            "", "3", "0/8", "9/8", "3/0", "-1/8", "3/8/9", "a/b", "1e0/2", "+1/ 2",
        ] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
