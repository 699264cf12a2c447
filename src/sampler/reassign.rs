//! Reassign: one detection to another set, by the model's surrogate score.
//!
//! A uniform detection i is taken out. Candidates are the sets of T∖i that hold a neighbour of i, and
//! "new", with weights exp(s) and 1; the neighbour graph comes from z alone, so the way back has the same
//! candidates and ln q(T|T') − ln q(T'|T) = ln w_old − ln w_new. If the set that i leaves is not empty and
//! holds no neighbour of i, the move could not be reversed: it is a **hold**, proposed and not
//! accepted. So is choosing the present place. Because of the holds it is not irreducible alone.

use super::choices::Choices;
use super::moves::{Proposal, Scene};
use crate::partition::Change;

/// Working space.
#[derive(Clone, Debug)]
pub struct Reassign {
    /// Where a set stands in `candidates`, or `NONE`.
    place_of: Vec<u32>,
    candidates: Vec<Candidate>,
    probabilities: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    set_ix: u32,
    /// The largest cost of being apart from a neighbour in it, then s.
    score: f64,
}

const NONE: u32 = u32::MAX;

impl Reassign {
    /// For N detections.
    pub fn new(n_detections: usize) -> Self {
        Self {
            place_of: vec![NONE; n_detections],
            candidates: Vec::new(),
            probabilities: Vec::new(),
        }
    }

    /// Describes the move in `change`.
    pub fn propose(
        &mut self,
        scene: &Scene,
        change: &mut Change,
        choices: &mut impl Choices,
    ) -> Proposal {
        let (partition, surrogate) = (scene.partition, scene.surrogate);
        let i = choices.below(partition.n_detections()) as u32;
        let own_ix = partition.set_of()[i as usize];
        let own = &partition.sets()[own_ix as usize];
        self.gather(scene, i);
        let old_place = self.candidates.iter().position(|c| c.set_ix == own_ix);
        let is_alone = own.len() == 1;
        if !is_alone && old_place.is_none() {
            return Proposal::Hold;
        }
        let mut largest = 0.0_f64;
        for candidate in &mut self.candidates {
            let block = scene.blocks[candidate.set_ix as usize];
            candidate.score += if candidate.set_ix == own_ix {
                surrogate.ln_gain(&surrogate.without(&block, i), i)
            } else {
                surrogate.ln_gain(&block, i)
            };
            largest = largest.max(candidate.score);
        }
        // The first place is "new", with a score of 0.
        self.probabilities.clear();
        self.probabilities.push(libm::exp(-largest));
        let weights = self.candidates.iter();
        self.probabilities
            .extend(weights.map(|candidate| libm::exp(candidate.score - largest)));
        let total: f64 = self.probabilities.iter().sum();
        for probability in &mut self.probabilities {
            *probability /= total;
        }
        let chosen = match choices.index(&self.probabilities) {
            0 => None,
            place => Some(self.candidates[place - 1]),
        };
        let stays = match chosen {
            None => is_alone,
            Some(candidate) => candidate.set_ix == own_ix,
        };
        if stays {
            return Proposal::Hold;
        }
        change.remove(own_ix);
        if !is_alone {
            change.add().extend(own.iter().copied().filter(|&j| j != i));
        }
        let target = change.add();
        if let Some(candidate) = chosen {
            target.extend_from_slice(&partition.sets()[candidate.set_ix as usize]);
        }
        target.push(i);
        if let Some(candidate) = chosen {
            change.remove(candidate.set_ix);
        }
        let old_score = old_place.map_or(0.0, |place| self.candidates[place].score);
        let new_score = chosen.map_or(0.0, |candidate| candidate.score);
        Proposal::Change {
            ln_ratio: old_score - new_score,
        }
    }

    /// The sets that hold a neighbour of i, in the order of the graph, with what being apart from them costs.
    fn gather(&mut self, scene: &Scene, i: u32) {
        self.candidates.clear();
        let (neighbours, costs) = scene.surrogate.neighbours().of_detection(i);
        for (&j, &cost) in neighbours.iter().zip(costs) {
            let set_ix = scene.partition.set_of()[j as usize];
            let place = &mut self.place_of[set_ix as usize];
            if *place == NONE {
                *place = self.candidates.len() as u32;
                self.candidates.push(Candidate { set_ix, score: 0.0 });
            }
            let score = &mut self.candidates[*place as usize].score;
            *score = score.max(cost);
        }
        for candidate in &self.candidates {
            self.place_of[candidate.set_ix as usize] = NONE;
        }
    }
}
