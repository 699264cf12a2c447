//! Restricted-Gibbs split-merge (Jain & Neal 2004, "A split-merge Markov chain Monte Carlo procedure for
//! the Dirichlet process mixture model"), with the model's surrogate score for the predictive density.
//!
//! Two different detections are drawn uniformly; U is the union of their sets. A *launch* state has each of
//! them in a block of its own and the others by fair coins, then a few Gibbs scans between the two
//! blocks. If the two share a set it is split by one more scan, whose probability is that of the
//! proposal; if not their sets are merged, and the scan replays the present sets for the way back.

use super::allocation::Allocation;
use super::choices::{Choices, pair};
use super::moves::{Proposal, Scene};
use super::sequential_allocation::describe;
use crate::partition::Change;

/// Scans before the one that counts; Jain & Neal use five.
const N_LAUNCH_SCANS: usize = 5;

/// Working space.
#[derive(Clone, Debug)]
pub struct RestrictedGibbs {
    allocation: Allocation,
    order: Vec<u32>,
    n_launch_scans: usize,
}

impl RestrictedGibbs {
    /// For N detections.
    pub fn new(n_detections: usize) -> Self {
        Self::with_launch_scans(n_detections, N_LAUNCH_SCANS)
    }

    /// With another number of scans before the one that counts.
    pub fn with_launch_scans(n_detections: usize, n_launch_scans: usize) -> Self {
        Self {
            n_launch_scans,
            allocation: Allocation::new(n_detections, 0.0),
            order: Vec::new(),
        }
    }

    /// Describes the move in `change`. Impossible with one detection.
    pub fn propose(
        &mut self,
        scene: &Scene,
        change: &mut Change,
        choices: &mut impl Choices,
    ) -> Proposal {
        let (partition, surrogate) = (scene.partition, scene.surrogate);
        if partition.n_detections() < 2 {
            return Proposal::Impossible;
        }
        let anchors = pair(partition.n_detections(), choices);
        let [first, second] = anchors.map(|i| partition.set_of()[i as usize]);
        self.order.clear();
        for set in [first, second] {
            if change.removed().contains(&set) {
                continue;
            }
            change.remove(set);
            let members = partition.sets()[set as usize].iter().copied();
            self.order.extend(members.filter(|i| !anchors.contains(i)));
        }
        // One order for both directions: that of the detections.
        self.order.sort_unstable();
        let allocation = &mut self.allocation;
        allocation.clear();
        allocation.open(surrogate, anchors[0]);
        allocation.open(surrogate, anchors[1]);
        for &i in &self.order {
            allocation.join(surrogate, i, choices.below(2));
        }
        for _ in 0..self.n_launch_scans {
            for &i in &self.order {
                allocation.lift(surrogate, i);
                allocation.draw(surrogate, i, choices);
            }
        }
        allocation.forget_choices();
        for &i in &self.order {
            allocation.lift(surrogate, i);
            if first == second {
                allocation.draw(surrogate, i, choices);
            } else {
                let block = usize::from(partition.set_of()[i as usize] != first);
                allocation.replay(surrogate, i, block);
            }
        }
        describe(&anchors, &self.order, allocation, first == second, change)
    }
}
