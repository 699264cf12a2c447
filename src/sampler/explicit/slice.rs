//! `slice`: the locations of one set, by elliptical slice sampling.
//!
//! Given T and the other locations, X_S has the density N(X\*_S, Σ_S)·exp(−Pen of S against the
//! others). With ν ~ N(0, Σ_S) and the present deviation ξ from X\*, the points X\* + ξ cos θ + ν
//! sin θ are tried from θ uniform on a bracket that shrinks towards 0, until one is within the
//! slice: it never rejects (Murray, Adams & MacKay 2010).
//!
//! The set is that of a uniform detection (share 0.3), or of one drawn by its score, or of a
//! neighbour of such a one. All of that depends on T and z alone, which stay.

use std::f64::consts::TAU;

use super::placement::draw_set;
use super::{Explicit, MoveKind, Outcome, info};
use crate::sampler::choices::Random;
use crate::sampler::{State, StepInfo};

/// Share of moves whose set is that of a uniform detection.
const UNIFORM: f64 = 0.3;
/// Larger sets are left to `site`: all their locations together hardly move.
const MOST: usize = 128;
/// Brackets tried at most: 2⁻²⁰⁰ of a turn is no change.
const MOST_TRIES: usize = 200;

/// Working space.
#[derive(Default)]
pub(super) struct Slice {
    optimum_m: Vec<[f64; 2]>,
    drawn_m: Vec<[f64; 2]>,
    tried_m: Vec<[f64; 2]>,
}

impl Explicit<'_> {
    pub(super) fn slice(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        let set_ix = self.set_to_slice(state, random);
        let moved = self.slice_set(state, set_ix, random);
        let outcome = if moved {
            Outcome::Accepted
        } else {
            Outcome::Rejected
        };
        info(MoveKind::Slice, outcome, 0)
    }

    fn set_to_slice(&self, state: &State, random: &mut impl Random) -> u32 {
        let partition = &state.partition;
        let i = if random.uniform() < UNIFORM {
            random.below(partition.n_detections()) as u32
        } else {
            let i = state.placement().draw_leaving(partition, random);
            let (near, _) = self.laws.neighbours.of_detection(i);
            if random.coins(1) == 1 && !near.is_empty() {
                near[random.below(near.len())]
            } else {
                i
            }
        };
        partition.set_of()[i as usize]
    }

    /// Pen of one location against all other sets.
    pub(super) fn penalty_outside(&self, state: &State, x_m: [f64; 2], set_ix: u32) -> f64 {
        let nobody = u32::MAX;
        let sum =
            super::particles::sum_without(&self.laws, state.placement(), x_m, (nobody, set_ix));
        self.laws.penalty().height * sum
    }

    pub(super) fn slice_set(
        &mut self,
        state: &mut State,
        set_ix: u32,
        random: &mut impl Random,
    ) -> bool {
        let members = &state.partition.sets()[set_ix as usize];
        if members.len() > MOST {
            return false;
        }
        let placement = state.placement();
        let sums = &placement.sums[set_ix as usize];
        let mut space = std::mem::take(&mut self.slice);
        let Slice {
            optimum_m,
            drawn_m,
            tried_m,
        } = &mut space;
        drawn_m.clear();
        draw_set(&self.laws, members, &sums.z, random, drawn_m);
        optimum_m.clear();
        let shrinkage = self.laws.model.shrinkage(members.len()).deviation;
        let mut present = 0.0;
        for &i in members {
            let (z_m, mean_m) = (self.laws.z_m(i), sums.z.mean_m);
            let at = |axis: usize| mean_m[axis] + shrinkage * (z_m[axis] - mean_m[axis]);
            optimum_m.push([at(0), at(1)]);
            present += self.penalty_outside(state, placement.x_m[i as usize], set_ix);
        }
        let most = present + random.slice_height();
        let mut angle = random.uniform() * TAU;
        let (mut low, mut high) = (angle - TAU, angle);
        let mut found = false;
        for _ in 0..MOST_TRIES {
            let (sin, cos) = libm::sincos(angle);
            tried_m.clear();
            let mut penalty = 0.0;
            for ((&i, optimum), drawn) in members.iter().zip(&*optimum_m).zip(&*drawn_m) {
                let x_m = placement.x_m[i as usize];
                let at = |axis: usize| {
                    let present = (x_m[axis] - optimum[axis]) * cos;
                    optimum[axis] + present + (drawn[axis] - optimum[axis]) * sin
                };
                let tried = [at(0), at(1)];
                penalty += self.penalty_outside(state, tried, set_ix);
                if penalty > most {
                    break;
                }
                tried_m.push(tried);
            }
            if tried_m.len() == members.len() {
                found = true;
                break;
            }
            if angle < 0.0 {
                low = angle;
            } else {
                high = angle;
            }
            angle = low + random.uniform() * (high - low);
        }
        if found {
            let State {
                partition,
                placement,
                ..
            } = state;
            let placement = placement.as_mut().expect("explicit keeps its locations");
            placement.move_set(set_ix, &partition.sets()[set_ix as usize], &space.tried_m);
        }
        self.slice = space;
        found
    }
}
