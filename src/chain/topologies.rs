//! The distinct topologies that a chain visits, in bounded memory.

use std::collections::HashMap;

use crate::partition::{Partition, Topology};

/// Index of a topology in the order of first visits; [`TopologyTable::DROPPED`] stands for any
/// that is no longer held.
pub type TopologyIx = u32;

/// A topology with the number of proposals after which the chain stood there.
#[derive(Clone, Debug)]
pub struct TopologyCount {
    /// The topology.
    pub topology: Topology,
    /// Number of proposals.
    pub count: u64,
}

struct Entry {
    hash: u128,
    topology: Topology,
    visits: u64,
}

/// Distinct topologies by hash, at most `max_topologies` of them.
///
/// When the table is full, the half visited least so far is dropped. The largest number of visits
/// dropped is added to [`error_bound`](Self::error_bound) (lossy counting, Manku & Motwani 2002): a
/// count may be too small by at most that much, and a topology that is not held was visited at most
/// that often.
pub struct TopologyTable {
    index_of: HashMap<u128, TopologyIx>,
    entries: Vec<Option<Entry>>,
    max_topologies: usize,
    error_bound: u64,
}

impl TopologyTable {
    /// Stands for a topology that is no longer held.
    pub const DROPPED: TopologyIx = TopologyIx::MAX;

    /// Holds at most `max_topologies` ≥ 2.
    pub fn new(max_topologies: usize) -> Self {
        Self {
            index_of: HashMap::new(),
            entries: Vec::new(),
            max_topologies,
            error_bound: 0,
        }
    }

    /// The index of the partition's topology, which is entered if it is new.
    pub fn index(&mut self, partition: &Partition) -> TopologyIx {
        if let Some(&index) = self.index_of.get(&partition.hash()) {
            return index;
        }
        if self.index_of.len() >= self.max_topologies {
            self.drop_least_visited();
        }
        let index = self.entries.len() as TopologyIx;
        let entry = Entry {
            hash: partition.hash(),
            topology: partition.topology(),
            visits: 0,
        };
        self.entries.push(Some(entry));
        self.index_of.insert(partition.hash(), index);
        index
    }

    /// Counts `visits` more proposals at a topology that is held.
    pub fn visit(&mut self, index: TopologyIx, visits: u64) {
        if let Some(entry) = &mut self.entries[index as usize] {
            entry.visits += visits;
        }
    }

    /// The topology, while it is held.
    pub fn get(&self, index: TopologyIx) -> Option<&Topology> {
        self.entries
            .get(index as usize)?
            .as_ref()
            .map(|entry| &entry.topology)
    }

    /// Number of topologies held.
    pub fn len(&self) -> usize {
        self.index_of.len()
    }

    /// Whether none is held.
    pub fn is_empty(&self) -> bool {
        self.index_of.is_empty()
    }

    /// By how many proposals a count may be too small; 0 unless the table was ever full.
    pub fn error_bound(&self) -> u64 {
        self.error_bound
    }

    fn drop_least_visited(&mut self) {
        let mut held: Vec<(u64, TopologyIx)> = self
            .index_of
            .values()
            .filter_map(|&index| Some((self.entries[index as usize].as_ref()?.visits, index)))
            .collect();
        held.sort_unstable();
        held.truncate(held.len().div_ceil(2));
        self.error_bound += held.last().map_or(0, |(visits, _)| *visits);
        for (_, index) in held {
            if let Some(entry) = self.entries[index as usize].take() {
                self.index_of.remove(&entry.hash);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::Partitions;

    #[test]
    fn a_full_table_drops_the_rarest_and_says_so() {
        let mut table = TopologyTable::new(10);
        for (k, topology) in Partitions::of(5).enumerate() {
            let index = table.index(&Partition::from_labels(topology.labels()));
            table.visit(index, if k == 3 { 100 } else { 1 });
            assert!(table.len() <= 10);
        }
        let favourite = Partitions::of(5).nth(3).expect("Bell(5) is 52");
        let index = table.index(&Partition::from_labels(favourite.labels()));
        assert_eq!(table.get(index), Some(&favourite));
        // 52 topologies through a table of 10 that is halved when full: nine times.
        assert_eq!(table.error_bound(), 9);
    }
}
