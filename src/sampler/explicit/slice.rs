//! `slice`: the locations of one set, by elliptical slice sampling.
//!
//! Given T and the other locations, X_S has the density γ·exp(h − Pen of S against the others), γ
//! normal ([`joint`](super::joint)). With ν drawn from γ about its mean μ and ξ the present
//! deviation from μ, the points μ + ξ cos θ + ν sin θ are tried from θ uniform on a bracket that shrinks towards 0, until one is within the
//! slice: it never rejects (Murray, Adams & MacKay 2010). In the covariance model the locations of
//! a set are independent given all others, so each has a slice of its own.
//!
//! The set is that of a uniform detection (share 0.3), or of one drawn by its score, or of a
//! neighbour of such a one. All of that depends on T and z alone, which stay.

use std::f64::consts::TAU;

use super::joint::Joint;
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
    joint: Joint,
    mean_m: Vec<[f64; 2]>,
    drawn_m: Vec<[f64; 2]>,
    /// Where the locations go.
    to_m: Vec<[f64; 2]>,
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

    /// Pen of the location of a detection against all sets but its own.
    pub(super) fn penalty_outside(&self, state: &State, i: u32, x_m: [f64; 2]) -> f64 {
        let own = state.partition.set_of()[i as usize];
        let placement = state.placement();
        let sum = self
            .laws
            .sum_near(placement, i, x_m, |set_ix| set_ix == own);
        self.laws.penalty_of(sum)
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
        let mut space = std::mem::take(&mut self.slice);
        space.joint.fill(&self.laws, members);
        space.drawn_m.clear();
        let drawn_m = &mut space.drawn_m;
        space.joint.draw(&self.laws, members, random, drawn_m);
        space.mean_m.clear();
        space.joint.means(&self.laws, members, &mut space.mean_m);
        space.to_m.clear();
        let (size, mut moved) = (space.joint.n_tied(), false);
        for part in members.chunks(size) {
            let found = self.slice_part(state, part, &mut space, random);
            moved |= found;
        }
        if moved {
            let State {
                partition,
                placement,
                ..
            } = state;
            let placement = placement.as_mut().expect("explicit keeps its locations");
            placement.move_set(set_ix, &partition.sets()[set_ix as usize], &space.to_m);
        }
        self.slice = space;
        moved
    }

    /// The next members of a set, which move together; puts where they go behind those before.
    fn slice_part(
        &self,
        state: &State,
        part: &[u32],
        space: &mut Slice,
        random: &mut impl Random,
    ) -> bool {
        let placement = state.placement();
        let Slice {
            joint,
            mean_m,
            drawn_m,
            to_m,
        } = space;
        let start = to_m.len();
        // −ln of the likelihood of the location of the k-th member of the set.
        let cost = |k: usize, i: u32, x_m: [f64; 2]| {
            self.penalty_outside(state, i, x_m) - joint.ln_excess(k, x_m)
        };
        let mut present = 0.0;
        for (k, &i) in (start..).zip(part) {
            present += cost(k, i, placement.x_m[i as usize]);
        }
        let most = present + random.slice_height();
        let mut angle = random.uniform() * TAU;
        let (mut low, mut high) = (angle - TAU, angle);
        for _ in 0..MOST_TRIES {
            let (sin, cos) = libm::sincos(angle);
            let mut tried = 0.0;
            for (k, &i) in (start..).zip(part) {
                let (x_m, mean_m, drawn_m) = (placement.x_m[i as usize], mean_m[k], drawn_m[k]);
                let at = |axis: usize| {
                    let present = (x_m[axis] - mean_m[axis]) * cos;
                    mean_m[axis] + present + (drawn_m[axis] - mean_m[axis]) * sin
                };
                let x_m = [at(0), at(1)];
                tried += cost(k, i, x_m);
                if tried > most {
                    break;
                }
                to_m.push(x_m);
            }
            if to_m.len() == start + part.len() {
                return true;
            }
            to_m.truncate(start);
            if angle < 0.0 {
                low = angle;
            } else {
                high = angle;
            }
            angle = low + random.uniform() * (high - low);
        }
        to_m.extend(part.iter().map(|&i| placement.x_m[i as usize]));
        false
    }
}
