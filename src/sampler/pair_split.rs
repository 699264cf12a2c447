//! Split-merge moves of the literature, kept as references, with the model's surrogate score for the
//! predictive density.
//!
//! Two different detections are drawn uniformly; U is the union of their sets. If they share a set it is split: each
//! opens a block, and the others of U are placed by [allocation](super::allocation), whose probability is that of the
//! proposal. If not, their sets are merged, and the allocation replays the present sets for the way back.
//!
//! - *Sequential allocation* (Dahl 2003, "An improved merge-split sampler for conjugate Dirichlet process
//!   mixture models"): the others are placed in uniformly random order, each seeing those placed before.
//! - *Restricted Gibbs* (Jain & Neal 2004, "A split-merge Markov chain Monte Carlo procedure for the Dirichlet
//!   process mixture model"): a launch state puts the others into the two blocks by fair coins, and a few Gibbs
//!   scans follow. One more scan counts.

use super::allocation::Allocation;
use super::choices::{Choices, pair, shuffle};
use super::moves::{Proposal, Scene};
use crate::partition::Change;

/// Scans of restricted Gibbs before the one that counts, as Jain & Neal have it.
const N_LAUNCH_SCANS: usize = 5;

/// One of the two moves, with its working space.
#[derive(Clone, Debug)]
pub struct PairSplit {
    allocation: Allocation,
    /// U without the two.
    order: Vec<u32>,
    /// Scans of the launch state; `None` for sequential allocation.
    n_launch_scans: Option<usize>,
}

impl PairSplit {
    /// Dahl's, for N detections.
    pub fn sequential(n_detections: usize) -> Self {
        Self::new(n_detections, None)
    }

    /// Jain & Neal's, for N detections.
    pub fn restricted_gibbs(n_detections: usize) -> Self {
        Self::new(n_detections, Some(N_LAUNCH_SCANS))
    }

    /// With another number of scans.
    pub fn new(n_detections: usize, n_launch_scans: Option<usize>) -> Self {
        Self {
            allocation: Allocation::new(n_detections, 0.0),
            order: Vec::new(),
            n_launch_scans,
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
        let is_split = first == second;
        self.order.clear();
        for set in [first, second] {
            if !change.removed().contains(&set) {
                change.remove(set);
                let members = partition.sets()[set as usize].iter().copied();
                self.order.extend(members.filter(|i| !anchors.contains(i)));
            }
        }
        let allocation = &mut self.allocation;
        allocation.clear();
        allocation.open(surrogate, anchors[0]);
        allocation.open(surrogate, anchors[1]);
        match self.n_launch_scans {
            None => shuffle(&mut self.order, choices),
            Some(n_scans) => {
                // One order for both directions: that of the detections.
                self.order.sort_unstable();
                for &i in &self.order {
                    allocation.join(surrogate, i, choices.below(2));
                }
                for _ in 0..n_scans {
                    for &i in &self.order {
                        allocation.lift(surrogate, i);
                        allocation.draw(surrogate, i, choices);
                    }
                }
                allocation.forget_choices();
            }
        }
        for &i in &self.order {
            if self.n_launch_scans.is_some() {
                allocation.lift(surrogate, i);
            }
            if is_split {
                allocation.draw(surrogate, i, choices);
            } else {
                let block = usize::from(partition.set_of()[i as usize] != first);
                allocation.replay(surrogate, i, block);
            }
        }
        let everyone = || anchors.iter().chain(&self.order).copied();
        let ln_split = allocation.ln_probability();
        if is_split {
            for block in [0, 1] {
                let members = change.add();
                members.extend(everyone().filter(|&i| allocation.block_of(i) == block));
            }
        } else {
            change.add().extend(everyone());
        }
        Proposal::Change {
            ln_ratio: if is_split { -ln_split } else { ln_split },
        }
    }
}
