//! The distinct topologies that a chain visits, in bounded memory.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::partition::{Partition, Topology};

/// Identity of a topology: [`Partition::hash`].
pub type TopologyId = u128;

/// Labels held at most, bytes: beyond some hundred detections this and not `max_topologies` is the bound.
const MAX_LABEL_BYTES: usize = 8 << 20;
/// So many topologies are held whatever their size.
const FEWEST: usize = 16;
/// Detections whose labels cost about as much as a proposal.
const PER_VISIT: u64 = 64;

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
    /// Not yet of a topology that is too new for its labels to be kept.
    topology: Option<Topology>,
    visits: u64,
}

/// Distinct topologies by hash, at most `max_topologies` of them and at most 8 MiB of labels.
///
/// When the table is full, the half visited least so far is dropped. The largest number of visits
/// dropped is added to [`error_bound`](Self::error_bound) (lossy counting, Manku & Motwani 2002): a
/// count may be too small by at most that much, and a topology that is not held was visited at most
/// that often.
///
/// A chain of many detections hardly ever comes back to a topology, and to write N labels down costs
/// as much as many proposals. So a table that was full once writes those of a new topology down only
/// when the chain has stood there for N/64 proposals, and the bound is that much wider.
#[derive(Clone, Serialize, Deserialize)]
pub struct TopologyTable {
    entries: HashMap<TopologyId, Entry>,
    /// Entries with labels.
    n_labelled: usize,
    max_topologies: usize,
    error_bound: u64,
    /// Visits after which the labels of a topology are kept.
    least_visits: u64,
}

impl TopologyTable {
    /// Holds at most `max_topologies` ≥ 2.
    pub fn new(max_topologies: usize) -> Self {
        Self {
            entries: HashMap::new(),
            n_labelled: 0,
            max_topologies,
            error_bound: 0,
            least_visits: 0,
        }
    }

    /// Whether a new topology of N detections makes others go.
    pub fn is_full(&self, n_detections: usize) -> bool {
        let bytes = n_detections * size_of::<u32>();
        let most = (MAX_LABEL_BYTES / bytes.max(1)).max(FEWEST);
        self.n_labelled >= most || self.entries.len() >= self.max_topologies
    }

    /// The identity of the partition's topology, which is entered if it is new.
    pub fn enter(&mut self, partition: &Partition) -> TopologyId {
        let id = partition.hash();
        if self.entries.contains_key(&id) {
            return id;
        }
        let n = partition.n_detections();
        if self.is_full(n) {
            self.drop_least_visited();
            self.least_visits = n as u64 / PER_VISIT;
        }
        let entry = Entry {
            topology: None,
            visits: 0,
        };
        self.entries.insert(id, entry);
        if self.least_visits == 0 {
            self.keep_labels(id, partition);
        }
        id
    }

    /// After how many more proposals at a topology its labels are to be kept; `None` if they are.
    pub fn visits_to_labels(&self, id: TopologyId) -> Option<u64> {
        let entry = self.entries.get(&id)?;
        let is_awaited = entry.topology.is_none();
        is_awaited.then(|| self.least_visits.saturating_sub(entry.visits))
    }

    /// Keeps the labels of the topology that is entered as `id`.
    pub fn keep_labels(&mut self, id: TopologyId, partition: &Partition) {
        if let Some(entry) = self.entries.get_mut(&id)
            && entry.topology.is_none()
        {
            entry.topology = Some(partition.topology());
            self.n_labelled += 1;
        }
    }

    /// Counts `visits` more proposals at a topology, if it is held.
    pub fn visit(&mut self, id: TopologyId, visits: u64) {
        if let Some(entry) = self.entries.get_mut(&id) {
            entry.visits += visits;
        }
    }

    /// The topology, while it is held.
    pub fn get(&self, id: TopologyId) -> Option<&Topology> {
        self.entries.get(&id)?.topology.as_ref()
    }

    /// Number of topologies held.
    pub fn len(&self) -> usize {
        self.n_labelled
    }

    /// Whether none is held.
    pub fn is_empty(&self) -> bool {
        self.n_labelled == 0
    }

    /// By how many proposals a count may be too small; 0 unless the table was ever full.
    pub fn error_bound(&self) -> u64 {
        self.error_bound + self.least_visits
    }

    fn drop_least_visited(&mut self) {
        let visits = self.entries.iter().map(|(&id, entry)| (entry.visits, id));
        let mut held: Vec<(u64, TopologyId)> = visits.collect();
        // Ties go by hash, so that the rule does not depend on the order of a hash map.
        held.sort_unstable();
        held.truncate(held.len().div_ceil(2));
        self.error_bound += held.last().map_or(0, |(visits, _)| *visits);
        for (_, id) in held {
            let gone = self.entries.remove(&id);
            let had_labels = gone.is_some_and(|entry| entry.topology.is_some());
            self.n_labelled -= usize::from(had_labels);
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

    /// Of 640 detections: a table that was full once holds those that are stood at for ten
    /// proposals, in one stay or in two.
    #[test]
    fn labels_of_many_detections_are_kept_where_a_chain_stays() {
        let mut table = TopologyTable::new(4);
        let topology = |k: usize| {
            let labels: Vec<u32> = (0..640)
                .map(|i| if i == k { 0 } else { i as u32 })
                .collect();
            Partition::from_labels(&labels)
        };
        let stay = |table: &mut TopologyTable, k: usize, visits: u64| {
            let id = table.enter(&topology(k));
            if table
                .visits_to_labels(id)
                .is_some_and(|after| after <= visits)
            {
                table.keep_labels(id, &topology(k));
            }
            table.visit(id, visits);
            table.get(id).is_some()
        };
        for k in 1..=4 {
            assert!(stay(&mut table, k, k as u64), "{k}");
        }
        // Two of the four go, of one and two visits.
        assert!(!stay(&mut table, 5, 9));
        assert_eq!((table.len(), table.error_bound()), (2, 2 + 10));
        assert!(stay(&mut table, 6, 10));
        // Full again: those of three and of four go, and the one of nine stays.
        assert!(!stay(&mut table, 7, 1));
        assert_eq!((table.len(), table.error_bound()), (1, 2 + 4 + 10));
        assert!(stay(&mut table, 5, 1));
        assert_eq!(table.len(), 2);
    }
}
