//! `flip`: a detection leaves its set, or one that is alone joins a set, where that is worth a try.
//!
//! i is drawn with probability v_i/V, v its [`score`](crate::model::leaving) and V the sum of all.
//! If it is in a set it proposes one of the [`particles`](super::particles) of "new", if it is
//! alone one of those that join, drawn with probability ∝ w. With a prime for what is after the
//! move, it is accepted with
//!
//! min(1, [Σw of the proposed side · v'_i/V'] / [Σw of the present side · v_i/V]).
//!
//! A detection whose set is no candidate stays.

use super::particles::{Present, Stratum};
use super::placement::SetSums;
use super::{Explicit, MoveKind, Outcome, info, settled};
use crate::model::leaving::{MOST_SCORED, SCORE_IN_LARGE};
use crate::sampler::choices::Random;
use crate::sampler::{State, StepInfo};

impl Explicit<'_> {
    pub(super) fn flip(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        let kind = MoveKind::Flip;
        let i = state.placement().draw_leaving(&state.partition, random);
        self.particles.look(&self.laws, state, i);
        let leaves = match self.particles.present {
            Present::Far => return settled(kind, 0),
            Present::In(Stratum::New) if self.particles.candidates.is_empty() => {
                return info(kind, Outcome::Impossible, 0);
            }
            Present::In(stratum) => stratum != Stratum::New,
        };
        self.particles.draw(&self.laws, state, random);
        let side = self.particles.side(leaves);
        let weights = &self.particles.weights;
        let proposed: f64 = weights[side.clone()].iter().sum();
        let present: f64 = weights[..side.start]
            .iter()
            .chain(&weights[side.end..])
            .sum();
        if proposed.is_nan() || proposed <= 0.0 {
            return settled(kind, 0);
        }
        let drawn = side.start + random.pick(&weights[side], proposed);
        let [before, after] = self.scores(state, drawn);
        let accepted = random.accepts(proposed * after, present * before);
        let n_new_sets = if accepted { self.take(state, drawn) } else { 0 };
        settled(kind, n_new_sets)
    }

    /// v_i/V now, and once particle k is taken.
    pub(super) fn scores(&self, state: &State, k: usize) -> [f64; 2] {
        let (partition, placement) = (&state.partition, state.placement());
        let i = self.particles.detection;
        let own = partition.set_of()[i as usize];
        let total = placement.total_leaving();
        let joined = match self.particles.particles[k].stratum {
            Stratum::New => own,
            Stratum::Joins(ix) => self.particles.candidates[ix].set_ix,
        };
        let (members, sums) = (
            &partition.sets()[joined as usize],
            &placement.sums[joined as usize],
        );
        let (z_m, one) = (self.laws.z_m(i), self.laws.appearance().tally(&[i]));
        let there = placement.leaving_of_set(joined);
        if joined == own {
            let now = placement.leaving_of(i, members.len());
            let rest = SetSums {
                z: sums.z.without(z_m),
                tally: sums.tally.without(one),
                ..*sums
            };
            let left = members.iter().copied().filter(|&j| j != i);
            let of_rest = self.laws.leaving(left, &rest, |_, _| {});
            return [now / total, 1.0 / (total - there + of_rest + 1.0)];
        }
        let whole = SetSums {
            z: sums.z.with(z_m),
            tally: sums.tally.with(one),
            ..*sums
        };
        let mut own_score = SCORE_IN_LARGE;
        let joined = members.iter().copied().chain(std::iter::once(i));
        let of_whole = self.laws.leaving(joined, &whole, |j, score| {
            if j == i {
                own_score = score;
            }
        });
        debug_assert!(members.len() <= MOST_SCORED || own_score == SCORE_IN_LARGE);
        [1.0 / total, own_score / (total - 1.0 - there + of_whole)]
    }
}
