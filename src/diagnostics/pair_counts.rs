//! Agreement pair by pair: which pairs of detections are of one landmark, in truth and as found.

use super::contingency::{Contingency, n_pairs};
use crate::partition::Topology;

/// Unordered pairs of detections, by what two topologies do with them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairCounts {
    /// Together in both.
    pub both: u64,
    /// Together in the found topology only: wrongly merged.
    pub only_found: u64,
    /// Together in the true topology only: wrongly split.
    pub only_truth: u64,
    /// Apart in both.
    pub neither: u64,
}

impl PairCounts {
    /// Counts the pairs of all detections.
    pub fn new(truth: &Topology, found: &Topology) -> Self {
        let table = Contingency::new(truth, found);
        let both = table.joint.iter().map(|(_, _, n)| n_pairs(*n)).sum();
        let in_truth: u64 = table.of_a.iter().map(|n| n_pairs(*n)).sum();
        let in_found: u64 = table.of_b.iter().map(|n| n_pairs(*n)).sum();
        Self {
            both,
            only_found: in_found - both,
            only_truth: in_truth - both,
            neither: n_pairs(table.n) + both - in_truth - in_found,
        }
    }

    /// Share of the found pairs that are true; `None` if no pair was found.
    pub fn precision(&self) -> Option<f64> {
        share(self.both, self.both + self.only_found)
    }

    /// Share of the true pairs that were found; `None` if there is no true pair.
    pub fn recall(&self) -> Option<f64> {
        share(self.both, self.both + self.only_truth)
    }

    /// Share of all pairs on which the two disagree: Binder's loss with equal costs, 1 − Rand index
    /// (Binder 1978; Rand 1971). A metric on topologies. `None` below two detections.
    pub fn disagreement(&self) -> Option<f64> {
        let wrong = self.only_found + self.only_truth;
        share(wrong, wrong + self.both + self.neither)
    }
}

fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_has_no_rate() {
        let counts = |truth: &[u32], found: &[u32]| {
            PairCounts::new(&Topology::canonical(truth), &Topology::canonical(found))
        };
        let apart = counts(&[0, 0, 1], &[0, 1, 2]);
        assert_eq!((apart.precision(), apart.recall()), (None, Some(0.0)));
        let merged = counts(&[0, 1, 2], &[0, 0, 1]);
        assert_eq!((merged.precision(), merged.recall()), (Some(0.0), None));
        assert_eq!(counts(&[0], &[0]).disagreement(), None);
        assert_eq!(merged.disagreement(), Some(1.0 / 3.0));
    }
}
