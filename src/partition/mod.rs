//! Set partitions of the detections: the topologies that the sampler walks over.
//!
//! A topology T is a set partition of {0, …, N−1} into M non-empty sets, 1 ≤ M ≤ N. Its canonical
//! form is the restricted growth string: labels in order of first appearance. Partitions know
//! nothing of geometry, and build no random number generator.

pub mod count;
mod enumerate;
mod labels;

pub use enumerate::Partitions;
pub use labels::{LabelsError, Topology};

use serde::{Deserialize, Serialize};

use rand::{Rng, RngExt};

use crate::rng::split_mix;

/// A replacement of some sets of a partition by others with the same members: every move is one.
///
/// The buffers are kept from step to step, so describing a move allocates nothing once they have
/// grown.
#[derive(Clone, Debug, Default)]
pub struct Change {
    removed: Vec<u32>,
    added: Vec<Vec<u32>>,
    n_added: usize,
}

impl Change {
    /// Forgets the last move.
    pub fn clear(&mut self) {
        self.removed.clear();
        self.n_added = 0;
    }

    /// Indices of the sets that go.
    pub fn removed(&self) -> &[u32] {
        &self.removed
    }

    /// Members of the sets that come, each in stored order.
    pub fn added(&self) -> &[Vec<u32>] {
        &self.added[..self.n_added]
    }

    /// Number of sets after the change, given the number before it.
    pub fn n_sets_after(&self, n_sets: usize) -> usize {
        n_sets + self.n_added - self.removed.len()
    }

    /// Marks a set as going.
    pub fn remove(&mut self, set_ix: u32) {
        self.removed.push(set_ix);
    }

    /// Opens an empty set that comes, to be filled by the caller.
    pub fn add(&mut self) -> &mut Vec<u32> {
        if self.n_added == self.added.len() {
            self.added.push(Vec::new());
        }
        self.n_added += 1;
        let members = &mut self.added[self.n_added - 1];
        members.clear();
        members
    }

    /// The set opened last. Panics if there is none.
    pub fn add_to_last(&mut self) -> &mut Vec<u32> {
        &mut self.added[self.n_added - 1]
    }

    /// Opens two empty sets that come.
    pub fn add_two(&mut self) -> (&mut Vec<u32>, &mut Vec<u32>) {
        self.add();
        self.add();
        let (before, last) = self.added.split_at_mut(self.n_added - 1);
        (&mut before[self.n_added - 2], &mut last[0])
    }
}

/// A set partition with its members at hand.
///
/// Sets are numbered 0..M without gaps; the numbers are of no meaning and change from move to
/// move. Within a set the members keep their *stored order*, which only the labelled fault
/// `--split prefix-cut` looks at.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Partition {
    set_of: Vec<u32>,
    sets: Vec<Vec<u32>>,
    non_singletons: Vec<u32>,
    /// Where a set stands in `non_singletons`; [`ABSENT`] for a singleton.
    place: Vec<u32>,
    spare: Vec<Vec<u32>>,
    hash: u128,
}

const ABSENT: u32 = u32::MAX;

impl Partition {
    /// Every detection by itself, M = N: the report's usual start.
    pub fn singletons(n: usize) -> Self {
        Self::from_sets(n, (0..n as u32).map(|i| vec![i]))
    }

    /// All detections together, M = 1: the start of the report's Fig. 7 (g).
    pub fn one_cluster(n: usize) -> Self {
        Self::from_sets(n, std::iter::once((0..n as u32).collect()))
    }

    /// From labels; any labels, canonical or not.
    pub fn from_labels(labels: &[u32]) -> Self {
        let topology = Topology::canonical(labels);
        let mut sets = vec![Vec::new(); topology.n_sets()];
        for (i, &label) in topology.labels().iter().enumerate() {
            sets[label as usize].push(i as u32);
        }
        Self::from_sets(labels.len(), sets)
    }

    /// A random partition: M uniform on 1..=N, then every detection to a uniform one of M places.
    /// (Empty places vanish, so this is no uniform law over partitions; as a start it need not be.)
    pub fn random(n: usize, rng: &mut impl Rng) -> Self {
        let n_places = rng.random_range(1..=n as u32);
        let labels: Vec<u32> = (0..n).map(|_| rng.random_range(0..n_places)).collect();
        Self::from_labels(&labels)
    }

    fn from_sets(n: usize, sets: impl IntoIterator<Item = Vec<u32>>) -> Self {
        let mut partition = Self {
            set_of: vec![ABSENT; n],
            sets: Vec::with_capacity(n),
            non_singletons: Vec::with_capacity(n),
            place: Vec::with_capacity(n),
            spare: Vec::new(),
            hash: 0,
        };
        for members in sets {
            partition.push_set(&members);
        }
        assert!(
            partition.set_of.iter().all(|&set| set != ABSENT),
            "the sets of a partition cover every detection"
        );
        partition
    }

    /// Number of detections N.
    pub fn n_detections(&self) -> usize {
        self.set_of.len()
    }

    /// Number of sets M, the dimensionality.
    pub fn n_sets(&self) -> usize {
        self.sets.len()
    }

    /// Members of every set, in stored order.
    pub fn sets(&self) -> &[Vec<u32>] {
        &self.sets
    }

    /// The set of every detection.
    pub fn set_of(&self) -> &[u32] {
        &self.set_of
    }

    /// Indices of the sets with two or more members; their number is N_s of Algorithm 2.
    pub fn non_singletons(&self) -> &[u32] {
        &self.non_singletons
    }

    /// Identity of the topology: equal partitions have equal hashes whatever the numbering of
    /// their sets and the order of their members; different ones collide with probability 2⁻¹²⁸.
    pub fn hash(&self) -> u128 {
        self.hash
    }

    /// The canonical form.
    pub fn topology(&self) -> Topology {
        Topology::of_numbered_sets(self.set_of.iter().copied(), self.sets.len())
    }

    /// Number of non-singleton sets once `change` is applied.
    pub fn non_singletons_after(&self, change: &Change) -> usize {
        let gone = change
            .removed
            .iter()
            .filter(|&&set| self.place[set as usize] != ABSENT)
            .count();
        let come = change
            .added()
            .iter()
            .filter(|members| members.len() > 1)
            .count();
        self.non_singletons.len() + come - gone
    }

    /// Applies a change. The sets that come take the last numbers.
    ///
    /// `relocate(from, to)` is called whenever a set that stays is renumbered, and before it for
    /// each set that goes, so that the caller can keep an array parallel to the sets: it is always
    /// "swap-remove the entry `to`, of a vector whose last entry is `from`".
    pub fn apply(&mut self, change: &Change, mut relocate: impl FnMut(usize, usize)) {
        let mut going = [0_u32; 4];
        assert!(
            change.removed.len() <= going.len(),
            "a move touches at most four sets"
        );
        let going = &mut going[..change.removed.len()];
        going.copy_from_slice(&change.removed);
        // From the highest number down, so that no removal renumbers one still to come.
        going.sort_unstable_by(|a, b| b.cmp(a));
        for &set in going.iter() {
            relocate(self.sets.len() - 1, set as usize);
            self.swap_remove_set(set as usize);
        }
        for members in change.added() {
            self.push_set(members);
        }
    }

    fn push_set(&mut self, members: &[u32]) {
        assert!(!members.is_empty(), "the sets of a partition are not empty");
        let set_ix = self.sets.len() as u32;
        for &i in members {
            self.set_of[i as usize] = set_ix;
        }
        self.hash = self.hash.wrapping_add(set_hash(members));
        if members.len() > 1 {
            self.place.push(self.non_singletons.len() as u32);
            self.non_singletons.push(set_ix);
        } else {
            self.place.push(ABSENT);
        }
        let mut stored = self.spare.pop().unwrap_or_default();
        stored.extend_from_slice(members);
        self.sets.push(stored);
    }

    fn swap_remove_set(&mut self, set_ix: usize) {
        let place = self.place.swap_remove(set_ix);
        if place != ABSENT {
            self.non_singletons.swap_remove(place as usize);
            if let Some(&moved) = self.non_singletons.get(place as usize) {
                // The moved entry may be the last set, whose place has just been swapped in.
                let slot = if moved as usize == self.place.len() {
                    set_ix
                } else {
                    moved as usize
                };
                self.place[slot] = place;
            }
        }
        let mut members = self.sets.swap_remove(set_ix);
        self.hash = self.hash.wrapping_sub(set_hash(&members));
        members.clear();
        self.spare.push(members);
        if set_ix < self.sets.len() {
            for &i in &self.sets[set_ix] {
                self.set_of[i as usize] = set_ix as u32;
            }
            if self.place[set_ix] != ABSENT {
                self.non_singletons[self.place[set_ix] as usize] = set_ix as u32;
            }
        }
    }
}

/// Hash of a set: a strong mix of the sum of its members' words, so that it does not depend on
/// their order; the hash of a topology is the sum over its sets (Zobrist hashing).
fn set_hash(members: &[u32]) -> u128 {
    let mut sum = 0_u128;
    for &i in members {
        let low = split_mix(u64::from(i));
        sum = sum.wrapping_add(
            u128::from(split_mix(low ^ 0x5851_F42D_4C95_7F2D)) << 64 | u128::from(low),
        );
    }
    let (high, low) = ((sum >> 64) as u64, sum as u64);
    let first = split_mix(low ^ split_mix(high));
    u128::from(split_mix(high ^ first)) << 64 | u128::from(first)
}

#[cfg(test)]
mod tests;
