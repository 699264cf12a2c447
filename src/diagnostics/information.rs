//! Agreement by information, in nats: variation of information (Meilă, Journal of
//! Multivariate Analysis 98, 2007) and V-measure (Rosenberg & Hirschberg, EMNLP 2007).
//!
//! With n_ab the number of detections in set a of one topology and b of the other, H(A|B) = −Σ
//! (n_ab/n) ln(n_ab/n_b): how much is not known of a detection's set in A once its set in B is.

use super::contingency::Contingency;
use crate::partition::Topology;

/// H(A|B) and H(B|A) in nats; `None` without detections. Sums of terms ≥ 0, so 0 exactly where one
/// topology is a refinement of the other.
pub fn conditional_entropies(a: &Topology, b: &Topology) -> Option<(f64, f64)> {
    let table = Contingency::new(a, b);
    let n = (table.n > 0).then_some(table.n as f64)?;
    let (mut a_given_b, mut b_given_a) = (0.0, 0.0);
    for &(in_a, in_b, n_ab) in &table.joint {
        let share = n_ab as f64 / n;
        let term = |n_set: u64| share * libm::log(n_set as f64 / n_ab as f64);
        a_given_b += term(table.of_b[in_b as usize]);
        b_given_a += term(table.of_a[in_a as usize]);
    }
    Some((a_given_b, b_given_a))
}

/// VI = H(A|B) + H(B|A) in nats, from 0 to ln n: a metric on topologies (Meilă 2007). `None`
/// without detections.
pub fn variation_of_information(a: &Topology, b: &Topology) -> Option<f64> {
    let (a_given_b, b_given_a) = conditional_entropies(a, b)?;
    Some(a_given_b + b_given_a)
}

/// Homogeneity, completeness and their harmonic mean, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VMeasure {
    /// 1 − H(truth|found)/H(truth): 1 if no set mixes landmarks. 1 if there is one landmark.
    pub homogeneity: f64,
    /// 1 − H(found|truth)/H(found): 1 if no landmark is split over sets. 1 if there is one set.
    pub completeness: f64,
}

impl VMeasure {
    /// Of a found topology; `None` without detections.
    pub fn new(truth: &Topology, found: &Topology) -> Option<Self> {
        let (truth_given_found, found_given_truth) = conditional_entropies(truth, found)?;
        // H(A) = H(A|one cluster).
        let together = Topology::canonical(&vec![0_u8; truth.labels().len()]);
        let entropy = |topology| conditional_entropies(topology, &together).map(|(h, _)| h);
        let share = |left: f64, all: f64| {
            if all == 0.0 {
                1.0
            } else {
                (1.0 - left / all).max(0.0)
            }
        };
        Some(Self {
            homogeneity: share(truth_given_found, entropy(truth)?),
            completeness: share(found_given_truth, entropy(found)?),
        })
    }

    /// The harmonic mean (β = 1); 0 if both are 0.
    pub fn v_measure(&self) -> f64 {
        let sum = self.homogeneity + self.completeness;
        if sum == 0.0 {
            return 0.0;
        }
        2.0 * self.homogeneity * self.completeness / sum
    }
}
