//! Whether a topology is the truth, as far as the truth is known.
//!
//! A detection's truth is the landmark of more than half of its sightings, or unknown. *Recovered*
//! means that the topology restricted to the detections of known truth equals the truth restricted
//! to them. The share of unknown ones, and how many of them are merged with known ones, stand
//! beside it.

use super::agreement::adjusted_rand_index;
use super::information::{VMeasure, variation_of_information};
use super::pair_counts::PairCounts;
use crate::partition::Topology;

/// The truth of a data set, where it is known.
#[derive(Clone, Debug)]
pub struct Truth {
    known: Vec<usize>,
    topology: Topology,
    n_detections: usize,
}

/// How far a topology is from the truth, over the detections of known truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// 1 for the truth, 0 on average for topologies drawn at random.
    pub adjusted_rand_index: f64,
    /// In nats, 0 for the truth.
    pub variation_of_information: f64,
    /// Homogeneity and completeness.
    pub v_measure: VMeasure,
    /// Pairs rightly and wrongly merged and split.
    pub pairs: PairCounts,
    /// Sets found − landmarks: below 0 if landmarks were merged.
    pub n_sets_error: i64,
    /// Detections that this rests on.
    pub n_known: usize,
}

impl Truth {
    /// From the landmark of each detection; `None` if none is known.
    pub fn new(landmarks: &[Option<i64>]) -> Option<Self> {
        let known: Vec<usize> = (0..landmarks.len())
            .filter(|&i| landmarks[i].is_some())
            .collect();
        let labels: Vec<i64> = landmarks.iter().flatten().copied().collect();
        if known.is_empty() {
            return None;
        }
        Some(Self {
            known,
            topology: Topology::canonical(&labels),
            n_detections: landmarks.len(),
        })
    }

    /// Number of landmarks among the detections of known truth.
    pub fn n_landmarks(&self) -> usize {
        self.topology.n_sets()
    }

    /// Share of detections whose truth is unknown.
    pub fn unknown_share(&self) -> f64 {
        1.0 - self.known.len() as f64 / self.n_detections as f64
    }

    /// The truth as a topology of all detections, the unknown ones each by itself: where a chain
    /// starts with `init = "truth"`.
    pub fn completed(&self) -> Topology {
        let mut labels: Vec<(bool, u32)> =
            (0..self.n_detections as u32).map(|i| (false, i)).collect();
        for (&i, &label) in self.known.iter().zip(self.topology.labels()) {
            labels[i] = (true, label);
        }
        Topology::canonical(&labels)
    }

    /// Whether `topology` is the truth, as far as that is known.
    pub fn is_recovered_by(&self, topology: &Topology) -> bool {
        topology.restricted_to(&self.known) == self.topology
    }

    /// Adjusted Rand index with the truth, over the detections of known truth.
    pub fn adjusted_rand_index(&self, topology: &Topology) -> Option<f64> {
        adjusted_rand_index(&topology.restricted_to(&self.known), &self.topology)
    }

    /// How far a topology is from the truth, over the detections of known truth.
    pub fn agreement(&self, topology: &Topology) -> Agreement {
        let found = topology.restricted_to(&self.known);
        let some = "the truth is known of at least one detection";
        Agreement {
            adjusted_rand_index: adjusted_rand_index(&found, &self.topology).expect(some),
            variation_of_information: variation_of_information(&found, &self.topology).expect(some),
            v_measure: VMeasure::new(&self.topology, &found).expect(some),
            pairs: PairCounts::new(&self.topology, &found),
            n_sets_error: found.n_sets() as i64 - self.topology.n_sets() as i64,
            n_known: self.known.len(),
        }
    }

    /// Number of detections of unknown truth that share a set with one of known truth.
    pub fn n_unknown_merged(&self, topology: &Topology) -> usize {
        let labels = topology.labels();
        let known_sets: std::collections::HashSet<u32> =
            self.known.iter().map(|&i| labels[i]).collect();
        let merged = labels
            .iter()
            .filter(|label| known_sets.contains(label))
            .count();
        merged - self.known.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_detections_do_not_decide() {
        let truth = Truth::new(&[Some(4), None, Some(4), Some(9), None]).expect("some are known");
        assert_eq!(truth.n_landmarks(), 2);
        assert_eq!(truth.completed(), Topology::canonical(&[0, 1, 0, 2, 3]));
        assert!((truth.unknown_share() - 0.4).abs() < 1e-15);
        let alone = Topology::canonical(&[0, 1, 0, 2, 3]);
        let merged = Topology::canonical(&[0, 0, 0, 2, 3]);
        let wrong = Topology::canonical(&[0, 1, 2, 2, 3]);
        assert!(truth.is_recovered_by(&alone) && truth.is_recovered_by(&merged));
        assert!(!truth.is_recovered_by(&wrong));
        assert_eq!(truth.n_unknown_merged(&alone), 0);
        assert_eq!(truth.n_unknown_merged(&merged), 1);
        assert_eq!(truth.adjusted_rand_index(&merged), Some(1.0));
        let (right, wrong) = (truth.agreement(&merged), truth.agreement(&wrong));
        assert_eq!(
            (right.variation_of_information, right.n_sets_error),
            (0.0, 0)
        );
        assert_eq!((right.pairs.precision(), right.n_known), (Some(1.0), 3));
        // {0, 2}, {3} are known; {0}, {2, 3} was found.
        assert_eq!(
            (wrong.pairs.precision(), wrong.n_sets_error),
            (Some(0.0), 0)
        );
        let singletons = truth.agreement(&Topology::canonical(&[0, 1, 2, 3, 4]));
        assert_eq!(
            (singletons.n_sets_error, singletons.v_measure.homogeneity),
            (1, 1.0)
        );
        assert_eq!(
            truth.agreement(&Topology::canonical(&[0; 5])).n_sets_error,
            -1
        );
        assert!(Truth::new(&[None, None]).is_none());
    }
}
