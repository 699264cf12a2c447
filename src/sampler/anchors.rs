//! Anchors: the sets of two or three detections, taken apart and put together again.
//!
//! k ∈ {2, 3} ordered anchors come from a law that does not look at T, so it cancels: the first uniform,
//! the others near it at some scale ([`Nearby`](crate::model::nearby::Nearby)), all different. U is the union of
//! their sets. The first anchor opens a block; each later one opens another with probability ½, or joins an
//! open one uniformly; then the other members of U, in uniformly random order, are
//! [allocated](super::allocation) one by one. The probability of the way back replays the present
//! allocation in the same order. Split, merge, two into two and three into two are one formula.

use super::allocation::{Allocation, MAX_BLOCKS};
use super::choices::{Choices, nearby, shuffle};
use super::moves::{Proposal, Scene};
use crate::partition::Change;

/// δ: what every block gets whatever its score, so that no way back is hopeless.
pub const FLOOR: f64 = 0.02;

/// Working space.
#[derive(Clone, Debug)]
pub struct Anchors {
    proposed: Allocation,
    present: Allocation,
    order: Vec<u32>,
}

impl Anchors {
    /// For N detections.
    pub fn new(n_detections: usize) -> Self {
        Self {
            proposed: Allocation::new(n_detections, FLOOR),
            present: Allocation::new(n_detections, FLOOR),
            order: Vec::new(),
        }
    }

    /// Describes the move in `change`. Impossible with more anchors than detections.
    pub fn propose(
        &mut self,
        scene: &Scene,
        change: &mut Change,
        choices: &mut impl Choices,
    ) -> Proposal {
        let n_anchors = 2 + choices.below(2);
        if n_anchors > scene.partition.n_detections() {
            return Proposal::Impossible;
        }
        let mut anchors = [0; MAX_BLOCKS];
        let anchors = &mut anchors[..n_anchors];
        draw_anchors(scene, anchors, choices);

        let (partition, surrogate) = (scene.partition, scene.surrogate);
        let (proposed, present) = (&mut self.proposed, &mut self.present);
        proposed.clear();
        present.clear();
        self.order.clear();
        // The present sets of the anchors, by their present block.
        let mut sets = [0; MAX_BLOCKS];
        for (place, &anchor) in anchors.iter().enumerate() {
            let set_ix = partition.set_of()[anchor as usize];
            match sets[..present.n_blocks()]
                .iter()
                .position(|&set| set == set_ix)
            {
                Some(block) => {
                    present.count_choice(0.5 / present.n_blocks() as f64);
                    present.join(surrogate, anchor, block);
                }
                None => {
                    if place > 0 {
                        present.count_choice(0.5);
                    }
                    sets[present.n_blocks()] = set_ix;
                    present.open(surrogate, anchor);
                    let others = partition.sets()[set_ix as usize].iter();
                    self.order.extend(others.filter(|i| !anchors.contains(i)));
                }
            }
            if place == 0 {
                proposed.open(surrogate, anchor);
            } else if choices.coins(1) == 1 {
                proposed.count_choice(0.5);
                proposed.open(surrogate, anchor);
            } else {
                let block = choices.below(proposed.n_blocks());
                proposed.count_choice(0.5 / proposed.n_blocks() as f64);
                proposed.join(surrogate, anchor, block);
            }
        }
        shuffle(&mut self.order, choices);
        let sets = &sets[..present.n_blocks()];
        for &i in &self.order {
            let set_ix = partition.set_of()[i as usize];
            let block = sets.iter().position(|&set| set == set_ix);
            present.replay(surrogate, i, block.expect("a member of an anchor's set"));
            proposed.draw(surrogate, i, choices);
        }
        // Blocks are numbered by their first anchor on both sides.
        let everyone = || anchors.iter().chain(&self.order).copied();
        if everyone().all(|i| proposed.block_of(i) == present.block_of(i)) {
            return Proposal::Hold;
        }
        for &set_ix in sets {
            change.remove(set_ix);
        }
        for block in 0..proposed.n_blocks() {
            let members = change.add();
            members.extend(everyone().filter(|&i| proposed.block_of(i) == block));
        }
        Proposal::Change {
            ln_ratio: present.ln_probability() - proposed.ln_probability(),
        }
    }
}

/// Different detections, by a law that does not look at the topology: the first uniform, the others near
/// it at some scale, or uniform among those left where that would repeat one.
fn draw_anchors(scene: &Scene, anchors: &mut [u32], choices: &mut impl Choices) {
    let n = scene.partition.n_detections();
    anchors[0] = choices.below(n) as u32;
    for place in 1..anchors.len() {
        let (taken, rest) = anchors.split_at_mut(place);
        rest[0] = nearby(scene.surrogate.nearby(), taken[0], choices);
        if taken.contains(&rest[0]) {
            // Numbers below n without those that are taken, lowest first.
            let mut gaps = [u32::MAX; MAX_BLOCKS];
            gaps[..place].copy_from_slice(taken);
            gaps[..place].sort_unstable();
            let draw = choices.below(n - place) as u32;
            let skip = |j: u32, &gap: &u32| j + u32::from(j >= gap);
            rest[0] = gaps[..place].iter().fold(draw, skip);
        }
    }
}
