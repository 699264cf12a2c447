//! Distances between topologies that a point estimate minimises and a credible ball is measured in.

use super::information::variation_of_information;
use super::pair_counts::PairCounts;
use crate::partition::Topology;

/// A metric on the topologies of the same detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Share of pairs of detections that one puts together and the other does not (Binder 1978,
    /// equal costs), 0 to 1. Dahl's (2006) least squares minimises its mean. Tends to many small
    /// sets.
    Binder,
    /// In nats, 0 to ln N (Meilă 2007; Wade & Ghahramani, Bayesian Analysis 13, 2018).
    VariationOfInformation,
}

impl Loss {
    /// The distance of two topologies; 0 where there is nothing to disagree on.
    pub fn distance(self, a: &Topology, b: &Topology) -> f64 {
        match self {
            Self::Binder => PairCounts::new(a, b).disagreement(),
            Self::VariationOfInformation => variation_of_information(a, b),
        }
        .unwrap_or(0.0)
    }
}
