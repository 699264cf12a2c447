//! Explicit locations: X is part of the state (the estimator `explicit`).
//!
//! The chain has the law π(T, X) ∝ P(T)·exp(−E(X;T) − Pen(X;T)), one location x_i (m) for each
//! detection. Its marginal over T is π(T), with no average over draws, so a change costs what it
//! touches: a pair interacts only if it lies within D at its present locations. Given T and without
//! the penalty, the locations of a set have a normal law, or lie below one ([`joint`]). The moves
//! know no model: [`laws`] has what they need of one.
//!
//! | move | changes | accepted by |
//! |---|---|---|
//! | [`site`] | set and location of one detection | Metropolised Gibbs over [`particles`] |
//! | [`flip`] | the same, out of a set or into one, by score | weights and scores of both sides |
//! | [`mod@slice`] | the locations of one set | elliptical slice sampling |
//! | [`group`] | two or three detections out of a set or into one | [`blocks`] |
//! | [`cut`] | one set into two along a line, two into one, two into two others | [`blocks`] |
//! | [`split_merge`] | two sets into one, one set into two | [`blocks`] |
//!
//! The present locations are weighed anew, beside fresh ones, at each proposal, so luck does not
//! last. ln target of the state is ln P(T) + Σ ln B + ln P(O|T), B the bounds of the sets (I₀ in the
//! metric model): a function of T alone, without E[exp(h − Pen)]. It stands still while T does, so a trace is a list of stretches; ln π(T, X) itself
//! would hide T under the noise of 2N coordinates.
//!
//! Sources: conditional importance sampling, Andrieu, Doucet & Holenstein (2010, JRSS B 72(3));
//! Metropolised Gibbs, Liu (1996, Biometrika 83(3)); elliptical slice sampling, Murray, Adams &
//! MacKay (2010, AISTATS).

mod area;
mod blocks;
mod cells;
mod cut;
mod flip;
mod group;
mod joint;
mod laws;
mod lines;
mod pairs;
mod particles;
mod placement;
mod roster;
mod site;
mod slice;
mod split_merge;
mod sum_tree;
pub mod tiles;

pub use placement::Placement;

use super::choices::Random;
use super::{Move, MoveKind, MoveMix, Outcome, State, StepInfo};
use crate::model::{Model, Prior};
use crate::partition::{Change, Partition};
use blocks::Blocks;
use joint::Joint;
use laws::Laws;
use particles::{Particles, Stratum};

/// The moves of one chain, with their working space.
pub(super) struct Explicit<'a> {
    laws: Laws<'a>,
    particles: Particles,
    blocks: Blocks,
    slice: slice::Slice,
    group: group::Group,
    cut: cut::Cut,
    change: Change,
    joint: Joint,
}

impl<'a> Explicit<'a> {
    /// Of a model, with R candidates for the locations of sets, 2R particles for a set of its own
    /// and R/2 for each candidate.
    pub(super) fn new(model: &'a Model, prior: Prior, n_candidates: usize) -> Self {
        Self::of(Laws::new(model, prior), n_candidates)
    }

    fn of(laws: Laws<'a>, n_candidates: usize) -> Self {
        let n = laws.n_detections();
        Self {
            particles: Particles::new(n, 2 * n_candidates, n_candidates.div_ceil(2)),
            blocks: Blocks::new(n_candidates),
            slice: slice::Slice::default(),
            group: group::Group::new(n),
            cut: cut::Cut::default(),
            change: Change::default(),
            joint: Joint::default(),
            laws,
        }
    }

    /// ln of a set's factor of π(T).
    pub(super) fn ln_bound(&mut self, members: &[u32]) -> f64 {
        let tally = self.laws.appearance().tally(members);
        self.laws.ln_bound(members, tally, &mut self.joint)
    }

    /// Locations for a partition.
    pub(super) fn place(&self, partition: &Partition, random: &mut impl Random) -> Box<Placement> {
        Box::new(Placement::new(&self.laws, partition, random))
    }

    /// A partition with these locations, and ln B of each set.
    pub(super) fn place_at(
        &self,
        partition: &Partition,
        x_m: Vec<[f64; 2]>,
    ) -> (Box<Placement>, Vec<f64>) {
        let (placement, ln_bounds) = Placement::at(&self.laws, partition, x_m, &[]);
        (Box::new(placement), ln_bounds)
    }

    /// Pen of where a state has its locations, nats.
    pub(super) fn penalty(&self, state: &State) -> f64 {
        let sum = self.laws.sum_of_all(&state.partition, state.placement());
        self.laws.penalty_of(sum)
    }

    /// Takes over a state of the same model with another height of the penalty.
    pub(super) fn adopt(&self, state: &mut State) {
        let State {
            partition,
            placement,
            ..
        } = state;
        let placement = placement.as_mut().expect("explicit keeps its locations");
        placement.score_anew(&self.laws, partition);
    }

    /// One move of the mix.
    pub(super) fn step(
        &mut self,
        moves: &MoveMix,
        state: &mut State,
        random: &mut impl Random,
    ) -> StepInfo {
        match moves.choose(random) {
            Move::Site => self.site(state, random),
            Move::Flip => self.flip(state, random),
            Move::Slice => self.slice(state, random),
            Move::Group => self.group(state, random),
            Move::Cut => self.cut(state, random),
            Move::SplitMerge => self.split_merge(state, random),
            other => panic!("the settings do not allow {other:?} with explicit locations"),
        }
    }

    /// Proposes locations for the change that a move has described, with ln q(T|T') − ln q(T'|T), and
    /// makes it if it is accepted; `None` where there is no change.
    fn try_change(
        &mut self,
        kind: MoveKind,
        ln_ratio: Option<f64>,
        state: &mut State,
        random: &mut impl Random,
    ) -> StepInfo {
        let Some(ln_ratio) = ln_ratio else {
            return info(kind, Outcome::Impossible, 0);
        };
        let Self {
            blocks,
            laws,
            change,
            ..
        } = self;
        let accepted = blocks.run(laws, state, change, ln_ratio, random);
        settled(kind, if accepted { change.added().len() } else { 0 })
    }

    /// Puts the detection of `self.particles` where particle k is. Returns how many sets are new:
    /// none if only its location changes.
    fn take(&mut self, state: &mut State, k: usize) -> usize {
        let particle = self.particles.particles[k];
        let to = match particle.stratum {
            Stratum::New => None,
            Stratum::Joins(ix) => Some(self.particles.candidates[ix].set_ix),
        };
        self.put(state, to, particle.x_m)
    }

    /// Puts the detection of `self.particles` into a set, or one of its own, at a location.
    fn put(&mut self, state: &mut State, to: Option<u32>, x_m: [f64; 2]) -> usize {
        let i = self.particles.detection;
        let own = state.partition.set_of()[i as usize];
        let sets = state.partition.sets();
        let members = &sets[own as usize];
        let stays = match to {
            None => members.len() == 1,
            Some(set_ix) => set_ix == own,
        };
        if stays {
            let State {
                partition,
                placement,
                ..
            } = state;
            let placement = placement.as_mut().expect("explicit keeps its locations");
            placement.move_one(partition, i, x_m);
            return 0;
        }
        let change = &mut self.change;
        change.clear();
        change.remove(own);
        if members.len() > 1 {
            let left = change.add();
            left.extend(members.iter().filter(|&&j| j != i));
        }
        let joined = change.add();
        if let Some(set_ix) = to {
            joined.extend_from_slice(&sets[set_ix as usize]);
        }
        joined.push(i);
        if let Some(set_ix) = to {
            change.remove(set_ix);
        }
        let moved = std::iter::once((i, x_m));
        placement::commit(&self.laws, state, change, moved, &mut self.joint);
        self.change.added().len()
    }
}

/// What is recorded of a move.
fn info(kind: MoveKind, outcome: Outcome, n_new_sets: usize) -> StepInfo {
    StepInfo {
        kind,
        outcome,
        evaluated: outcome != Outcome::Impossible,
        underflowed: false,
        n_new_sets: n_new_sets as u32,
    }
}

/// The same of a move that brought so many new sets; none is a proposal that left the topology as
/// it was.
fn settled(kind: MoveKind, n_new_sets: usize) -> StepInfo {
    let outcome = if n_new_sets > 0 {
        Outcome::Accepted
    } else {
        Outcome::Rejected
    };
    info(kind, outcome, n_new_sets)
}

#[cfg(test)]
mod tests;
