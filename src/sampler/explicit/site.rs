//! `site`: set and location of a uniform detection together.
//!
//! One of the [`particles`](super::particles) other than the present is drawn with probability ∝ w,
//! and accepted with (Σw − w_present)/(Σw − w_drawn): Metropolised Gibbs (Liu 1996).
//!
//! **Far places.** A set without a location near z_i is no candidate. So that no detection is stuck
//! in such a set, or kept from it, with probability ε a set is drawn by a uniform other detection
//! j. If it is no candidate, i proposes to go there, to a draw from its conditional law, with the
//! weight w_F = Z·exp(h − Pen); a detection that is in such a set proposes to come back to one of the
//! particles, drawn with probability ∝ w. With n_F members without i, the way back has the ratio
//! Σw·ε·n_F/(N−1)/w_F, and the way there its inverse, where Σw includes the present place.

use super::particles::{Around, Candidate, Present};
use super::{Explicit, MoveKind, settled};
use crate::sampler::choices::Random;
use crate::sampler::{State, StepInfo};

/// ε.
pub(super) const FAR: f64 = 0.02;

impl Explicit<'_> {
    pub(super) fn site(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        let n = state.partition.n_detections();
        let i = random.below(n) as u32;
        self.particles.look(&self.laws, state, i);
        let own = state.partition.set_of()[i as usize];
        let n_new_sets = if self.particles.present == Present::Far {
            self.come_back(state, own, random)
        } else if n > 1 && random.uniform() < FAR {
            let other = random.below(n - 1) as u32;
            let other = other + u32::from(other >= i);
            let set_ix = state.partition.set_of()[other as usize];
            let mut candidates = self.particles.candidates.iter();
            if candidates.any(|candidate| candidate.set_ix == set_ix) {
                0
            } else {
                self.go_far(state, set_ix, random)
            }
        } else {
            self.choose(state, random)
        };
        settled(MoveKind::Site, n_new_sets)
    }

    fn choose(&mut self, state: &mut State, random: &mut impl Random) -> usize {
        self.particles.draw(&self.laws, state, random);
        let weights = &self.particles.weights;
        let others: f64 = weights[1..].iter().sum();
        if others.is_nan() || others <= 0.0 {
            return 0;
        }
        let drawn = 1 + random.pick(&weights[1..], others);
        let mut without_drawn = 0.0;
        for (k, weight) in weights.iter().enumerate() {
            if k != drawn {
                without_drawn += weight;
            }
        }
        if !random.accepts(others, without_drawn) {
            return 0;
        }
        self.take(state, drawn)
    }

    /// From near to a set that is no candidate.
    fn go_far(&mut self, state: &mut State, set_ix: u32, random: &mut impl Random) -> usize {
        let far = self.far(state, set_ix);
        let x_m = far.law.place(random.normals());
        self.particles.draw(&self.laws, state, random);
        let ln_ratio = -self.ln_back(state, &far, x_m);
        if random.ln_threshold() < ln_ratio {
            self.put(state, Some(set_ix), x_m)
        } else {
            0
        }
    }

    /// From a set that is no candidate to near.
    fn come_back(&mut self, state: &mut State, own: u32, random: &mut impl Random) -> usize {
        let far = self.far(state, own);
        let x_m = state.placement().x_m[self.particles.detection as usize];
        self.particles.draw(&self.laws, state, random);
        let ln_ratio = self.ln_back(state, &far, x_m);
        if random.ln_threshold() < ln_ratio {
            let weights = &self.particles.weights;
            let drawn = random.pick(weights, weights.iter().sum());
            self.take(state, drawn)
        } else {
            0
        }
    }

    /// A set that is no candidate as if it were one.
    pub(super) fn far(&mut self, state: &State, set_ix: u32) -> Candidate {
        let i = self.particles.detection;
        let around = Around {
            laws: &self.laws,
            partition: &state.partition,
            placement: state.placement(),
            i,
            own: state.partition.set_of()[i as usize],
        };
        around.candidate_of(set_ix, &mut self.particles.cones).0
    }

    /// ln of the ratio of coming back from a set that is no candidate, at this location in it.
    pub(super) fn ln_back(&self, state: &State, far: &Candidate, x_m: [f64; 2]) -> f64 {
        let i = self.particles.detection;
        let partition = &state.partition;
        let is_own = partition.set_of()[i as usize] == far.set_ix;
        let n_others = partition.sets()[far.set_ix as usize].len() - usize::from(is_own);
        let chance = FAR * n_others as f64 / (partition.n_detections() - 1) as f64;
        let skips = |set_ix| set_ix == far.set_ix;
        let sum = self.laws.sum_near(state.placement(), i, x_m, skips);
        let ln_excess = far.law.ln_excess(&self.particles.cones, x_m);
        let ln_far = far.ln_z + ln_excess - self.laws.penalty_of(sum);
        let near: f64 = self.particles.weights.iter().sum();
        self.particles.ln_largest + libm::log(near) + libm::log(chance) - ln_far
    }
}
