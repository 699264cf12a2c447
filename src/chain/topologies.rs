//! The distinct topologies that a chain visits, in bounded memory.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::partition::{Partition, Topology};

/// Identity of a topology: [`Partition::hash`].
pub type TopologyId = u128;

/// Labels held at most, bytes: beyond some hundred detections this and not `max_topologies` is the bound.
const MAX_LABEL_BYTES: usize = 32 << 20;
/// So many topologies are held whatever their size.
const FEWEST: usize = 16;

/// A topology with the number of proposals after which the chain stood there.
#[derive(Clone, Debug)]
pub struct TopologyCount {
    /// The topology.
    pub topology: Topology,
    /// Number of proposals.
    pub count: u64,
}

#[derive(Clone, Serialize, Deserialize)]
struct Entry {
    topology: Topology,
    visits: u64,
}

/// Distinct topologies by hash, at most `max_topologies` of them and at most 32 MiB of labels.
///
/// When the table is full, the half visited least so far is dropped. The largest number of visits
/// dropped is added to [`error_bound`](Self::error_bound) (lossy counting, Manku & Motwani 2002): a
/// count may be too small by at most that much, and a topology that is not held was visited at most
/// that often.
#[derive(Clone, Serialize, Deserialize)]
pub struct TopologyTable {
    entries: HashMap<TopologyId, Entry>,
    max_topologies: usize,
    error_bound: u64,
}

impl TopologyTable {
    /// Holds at most `max_topologies` ≥ 2.
    pub fn new(max_topologies: usize) -> Self {
        Self {
            entries: HashMap::new(),
            max_topologies,
            error_bound: 0,
        }
    }

    /// Whether a new topology of N detections makes others go.
    pub fn is_full(&self, n_detections: usize) -> bool {
        let bytes = n_detections * size_of::<u32>();
        let most = (MAX_LABEL_BYTES / bytes.max(1)).max(FEWEST);
        self.entries.len() >= self.max_topologies.min(most)
    }

    /// The identity of the partition's topology, which is entered if it is new.
    pub fn enter(&mut self, partition: &Partition) -> TopologyId {
        let id = partition.hash();
        if self.entries.contains_key(&id) {
            return id;
        }
        if self.is_full(partition.n_detections()) {
            self.drop_least_visited();
        }
        let entry = Entry {
            topology: partition.topology(),
            visits: 0,
        };
        self.entries.insert(id, entry);
        id
    }

    /// Counts `visits` more proposals at a topology, if it is held.
    pub fn visit(&mut self, id: TopologyId, visits: u64) {
        if let Some(entry) = self.entries.get_mut(&id) {
            entry.visits += visits;
        }
    }

    /// The topology, while it is held.
    pub fn get(&self, id: TopologyId) -> Option<&Topology> {
        self.entries.get(&id).map(|entry| &entry.topology)
    }

    /// Number of topologies held.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether none is held.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// By how many proposals a count may be too small; 0 unless the table was ever full.
    pub fn error_bound(&self) -> u64 {
        self.error_bound
    }

    fn drop_least_visited(&mut self) {
        let visits = self.entries.iter().map(|(&id, entry)| (entry.visits, id));
        let mut held: Vec<(u64, TopologyId)> = visits.collect();
        // Ties go by hash, so that the rule does not depend on the order of a hash map.
        held.sort_unstable();
        held.truncate(held.len().div_ceil(2));
        self.error_bound += held.last().map_or(0, |(visits, _)| *visits);
        for (_, id) in held {
            self.entries.remove(&id);
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
            let id = table.enter(&Partition::from_labels(topology.labels()));
            table.visit(id, if k == 3 { 100 } else { 1 });
            assert!(table.len() <= 10);
        }
        let favourite = Partitions::of(5).nth(3).expect("Bell(5) is 52");
        let id = table.enter(&Partition::from_labels(favourite.labels()));
        assert_eq!(table.get(id), Some(&favourite));
        // 52 topologies through a table of 10 that is halved when full: nine times.
        assert_eq!(table.error_bound(), 9);
    }
}
