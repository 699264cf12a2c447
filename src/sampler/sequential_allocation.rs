//! Sequentially-allocated split-merge (Dahl 2003, "An improved merge-split sampler for conjugate
//! Dirichlet process mixture models"), with the model's surrogate score for the predictive density.
//!
//! Two different detections are drawn uniformly. If they share a set it is split: each opens a block, and
//! the other members, in uniformly random order, are [allocated](super::allocation) one by one. If not,
//! their sets are merged, and the probability of the split back replays the present sets.

use super::allocation::Allocation;
use super::choices::{Choices, pair, shuffle};
use super::moves::{Proposal, Scene};
use crate::partition::Change;

/// Working space.
#[derive(Clone, Debug)]
pub struct SequentialAllocation {
    allocation: Allocation,
    order: Vec<u32>,
}

impl SequentialAllocation {
    /// For N detections.
    pub fn new(n_detections: usize) -> Self {
        Self {
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
        let others = |set: u32| {
            let members = partition.sets()[set as usize].iter().copied();
            members.filter(|i| !anchors.contains(i))
        };
        self.order.clear();
        self.order.extend(others(first));
        change.remove(first);
        if first != second {
            self.order.extend(others(second));
            change.remove(second);
        }
        shuffle(&mut self.order, choices);
        let allocation = &mut self.allocation;
        allocation.clear();
        allocation.open(surrogate, anchors[0]);
        allocation.open(surrogate, anchors[1]);
        for &i in &self.order {
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

/// The change to the two blocks of a split, or to the one set of a merge.
pub(super) fn describe(
    anchors: &[u32; 2],
    order: &[u32],
    allocation: &Allocation,
    is_split: bool,
    change: &mut Change,
) -> Proposal {
    let everyone = || anchors.iter().chain(order).copied();
    if is_split {
        for block in [0, 1] {
            let members = change.add();
            members.extend(everyone().filter(|&i| allocation.block_of(i) == block));
        }
    } else {
        change.add().extend(everyone());
    }
    let ln_split = allocation.ln_probability();
    Proposal::Change {
        ln_ratio: if is_split { -ln_split } else { ln_split },
    }
}
