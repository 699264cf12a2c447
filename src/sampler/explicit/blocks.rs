//! Sets that become others of the same members, with all their locations: conditional importance
//! sampling.
//!
//! Sets A become sets B of the same members U, one or two on each side. R candidates X_U are drawn
//! from q_B = Π_{S∈B} γ_S, the normal laws of [`joint`](super::joint), [tilted](crate::model::tilt)
//! where B is two sets, with the weights
//!
//! ln w = ln(γ_B/q_B) + h − Pen of the pairs inside U in different sets of B − Pen of U against all
//! others,
//!
//! γ_B the normal law without the tilt. W' is their mean, and one is drawn with probability ∝ w.
//! For the way back the present X_U and R − 1 fresh draws from q_A give W. The move is accepted
//! with
//!
//! min(1, [P(T')·Π_B B_S·W'] / [P(T)·Π_A B_S·W] · q(T|T')/q(T'|T)),
//!
//! B_S the bounds of the sets, I₀ in the metric model.
//!
//! A proposal that fails although W' were as large, and W as small, as it can be is rejected before
//! it is drawn.

use super::joint::Joint;
use super::laws::Laws;
use super::placement::{Placement, commit};
use crate::model::numeric::ln_mean_exp;
use crate::model::tilt::{NORMAL, Part, Tilt};
use crate::partition::Change;
use crate::sampler::State;
use crate::sampler::choices::Random;

/// No sets with more members together: the pairs of a candidate are all looked at.
pub(super) const MOST: usize = 512;

/// One side of the change: all members, set after set.
#[derive(Default)]
pub(super) struct Side {
    members: Vec<u32>,
    /// Where the second set begins.
    cut: usize,
    sets: [Joint; 2],
    pub(super) tilt: Option<Tilt>,
    ln_bound: f64,
}

impl Side {
    fn fill<'a>(&mut self, laws: &Laws, sets: impl Iterator<Item = &'a [u32]>) {
        self.members.clear();
        self.cut = usize::MAX;
        self.ln_bound = 0.0;
        let mut n_sets = 0;
        for members in sets {
            if n_sets == 1 {
                self.cut = self.members.len();
            }
            let tally = laws.appearance().tally(members);
            self.ln_bound += laws.ln_bound(members, tally, &mut self.sets[n_sets])
                + laws.prior.ln_size(members.len());
            self.members.extend_from_slice(members);
            n_sets += 1;
        }
        self.cut = self.cut.min(self.members.len());
        let (first, second) = self.members.split_at(self.cut);
        self.tilt = if n_sets == 2 {
            laws.tilt([&self.sets[0], &self.sets[1]], [first, second])
        } else {
            None
        };
    }

    /// The most that ln(γ/q) can be.
    fn most(&self) -> f64 {
        self.tilt.map_or(0.0, |_| -libm::log(NORMAL))
    }

    /// Draws a candidate at the end of `to_m`.
    pub(super) fn draw(&self, laws: &Laws, random: &mut impl Random, to_m: &mut Vec<[f64; 2]>) {
        let start = to_m.len();
        let (first, second) = self.members.split_at(self.cut);
        self.sets[0].draw(laws, first, random, to_m);
        if !second.is_empty() {
            self.sets[1].draw(laws, second, random, to_m);
        }
        let Some(tilt) = &self.tilt else {
            return;
        };
        let h = match Tilt::part(random.uniform()) {
            Part::Normal => return,
            Part::Exponential => random.exponential(),
            Part::Gamma => random.exponential() + random.exponential() + random.exponential(),
        };
        let wanted = tilt.place(random.direction(), h);
        let drawn = &mut to_m[start..];
        let now = self.difference(drawn);
        let change_m = [0, 1].map(|axis| wanted[axis] - now[axis]);
        let (first, second) = drawn.split_at_mut(self.cut);
        for ((set, x_m), share) in self.sets.iter().zip([first, second]).zip(tilt.shares) {
            set.shift(tilt, share, change_m, x_m);
        }
    }

    /// The difference of the mean locations of the two sets.
    fn difference(&self, x_m: &[[f64; 2]]) -> [f64; 2] {
        let (first, second) = x_m.split_at(self.cut);
        let mean = |x_m: &[[f64; 2]], axis: usize| {
            x_m.iter().map(|x| x[axis]).sum::<f64>() / x_m.len() as f64
        };
        [0, 1].map(|axis| mean(first, axis) - mean(second, axis))
    }

    /// ln w of a candidate; the locations of `gone` are not looked at.
    fn ln_weight(&self, laws: &Laws, placement: &Placement, gone: &[u32], x_m: &[[f64; 2]]) -> f64 {
        let (members, at) = (self.members.split_at(self.cut), x_m.split_at(self.cut));
        let mut sum = laws.sum_between([members.0, members.1], [at.0, at.1]);
        let [a, b] = [gone[0], gone[gone.len() - 1]];
        for (&i, &x_m) in self.members.iter().zip(x_m) {
            sum += laws.sum_near(placement, i, x_m, |set_ix| set_ix == a || set_ix == b);
        }
        let mut ln_weight = self
            .tilt
            .map_or(0.0, |tilt| tilt.ln_correction(self.difference(x_m)));
        for (set, x_m) in self.sets.iter().zip([at.0, at.1]) {
            for (k, &x_m) in x_m.iter().enumerate() {
                ln_weight += set.ln_excess(k, x_m);
            }
        }
        ln_weight - laws.penalty_of(sum)
    }
}

/// Working space.
pub(super) struct Blocks {
    n_candidates: usize,
    ln_n: f64,
    pub(super) present: Side,
    pub(super) proposed: Side,
    present_m: Vec<[f64; 2]>,
    proposed_m: Vec<[f64; 2]>,
    ln_weights: Vec<f64>,
    weights: Vec<f64>,
    joint: Joint,
}

impl Blocks {
    /// With R candidates on each side.
    pub(super) fn new(n_candidates: usize) -> Self {
        Self {
            n_candidates,
            ln_n: libm::log(n_candidates as f64),
            present: Side::default(),
            proposed: Side::default(),
            present_m: Vec::new(),
            proposed_m: Vec::new(),
            ln_weights: Vec::new(),
            weights: Vec::new(),
            joint: Joint::default(),
        }
    }

    /// ln of the ratio of P(T)·Π B_S, for the sides of a change; fills both.
    pub(super) fn ln_closed(&mut self, laws: &Laws, state: &State, change: &Change) -> f64 {
        let sets = state.partition.sets();
        let gone = change
            .removed()
            .iter()
            .map(|&set| sets[set as usize].as_slice());
        self.present.fill(laws, gone);
        self.proposed
            .fill(laws, change.added().iter().map(Vec::as_slice));
        let n_sets = state.partition.n_sets();
        let ln_n_sets =
            laws.prior.ln_n_sets(change.n_sets_after(n_sets)) - laws.prior.ln_n_sets(n_sets);
        self.proposed.ln_bound - self.present.ln_bound + ln_n_sets
    }

    /// ln w of the present locations.
    pub(super) fn ln_present(&mut self, laws: &Laws, state: &State, change: &Change) -> f64 {
        let placement = state.placement();
        self.present_m.clear();
        let members = self.present.members.iter();
        self.present_m
            .extend(members.map(|&i| placement.x_m[i as usize]));
        self.present
            .ln_weight(laws, placement, change.removed(), &self.present_m)
    }

    /// Proposes locations for a change whose own ratio is q(T|T')/q(T'|T), and makes it if it is
    /// accepted.
    pub(super) fn run(
        &mut self,
        laws: &Laws,
        state: &mut State,
        change: &Change,
        ln_ratio: f64,
        random: &mut impl Random,
    ) -> bool {
        let ln_ratio = ln_ratio + self.ln_closed(laws, state, change);
        let ln_present = self.ln_present(laws, state, change);
        let least_present = ln_present - self.ln_n;
        let ln_u = random.ln_threshold();
        if ln_u >= ln_ratio + self.proposed.most() - least_present {
            return false;
        }
        let (placement, n) = (state.placement(), self.proposed.members.len());
        self.proposed_m.clear();
        self.ln_weights.clear();
        for r in 0..self.n_candidates {
            self.proposed.draw(laws, random, &mut self.proposed_m);
            let x_m = &self.proposed_m[r * n..];
            let gone = change.removed();
            self.ln_weights
                .push(self.proposed.ln_weight(laws, placement, gone, x_m));
        }
        let ln_proposed = ln_mean_exp(&self.ln_weights);
        let may_pass = ln_u < ln_ratio + ln_proposed - least_present;
        if !may_pass {
            return false;
        }
        self.weights.clear();
        let relative = self
            .ln_weights
            .iter()
            .map(|ln_w| libm::exp(ln_w - ln_proposed));
        self.weights.extend(relative);
        let drawn = random.pick(&self.weights, self.weights.iter().sum());
        self.ln_weights.clear();
        self.ln_weights.push(ln_present);
        for _ in 1..self.n_candidates {
            self.present_m.clear();
            self.present.draw(laws, random, &mut self.present_m);
            let (gone, x_m) = (change.removed(), &self.present_m);
            self.ln_weights
                .push(self.present.ln_weight(laws, placement, gone, x_m));
        }
        // False also for a NaN.
        let passes = ln_u < ln_ratio + ln_proposed - ln_mean_exp(&self.ln_weights);
        if !passes {
            return false;
        }
        let moved = &self.proposed_m[drawn * n..(drawn + 1) * n];
        let moved = self
            .proposed
            .members
            .iter()
            .copied()
            .zip(moved.iter().copied());
        commit(laws, state, change, moved, &mut self.joint);
        true
    }
}
