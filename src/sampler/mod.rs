//! The Metropolis–Hastings kernel over topologies (source report, algorithms 1 and 2).
//!
//! A kernel is [`Kernel::init`] and [`Kernel::step`]: the [`State`] holds what the next step needs,
//! the [`StepInfo`] what is only recorded. The rule that accepts ([`accept`]) stands apart from the
//! moves that propose (`split_merge`), and no move knows the model.
//!
//! The estimator is `fresh`: every proposal draws R new importance samples, and the current state
//! keeps the estimate it was accepted with. That makes the chain pseudo-marginal (Andrieu &
//! Roberts 2009), exact for every R ≥ 1; re-estimating both sides at each step would not be.

pub mod accept;
pub mod moves;
mod split_merge;

pub use accept::Arithmetic;
pub use moves::{Move, MoveKind, MoveMix};
pub use split_merge::SplitRule;

use rand::{Rng, RngExt};

use crate::model::prior::PriorTable;
use crate::model::{Draws, Model, Prior};
use crate::partition::{Change, Partition};
use crate::rng::StepGenerators;

/// What the next step needs.
#[derive(Clone, Debug)]
pub struct State {
    partition: Partition,
    /// ln of the largest weight of every set, parallel to the partition's sets.
    ln_bound_of: Vec<f64>,
    ln_prior: f64,
    ln_estimate: f64,
}

impl State {
    /// The current topology.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// ln Ẑ(T): the log estimate of ∫exp(−E−Pen) that this state was accepted with, without N ln(π/a).
    pub fn ln_estimate(&self) -> f64 {
        self.ln_estimate
    }

    /// ln P(T), without constants.
    pub fn ln_prior(&self) -> f64 {
        self.ln_prior
    }

    /// ln P(T) + ln Ẑ(T).
    pub fn ln_target(&self) -> f64 {
        self.ln_prior + self.ln_estimate
    }
}

/// What became of a proposal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The chain moved.
    Accepted,
    /// Proposed and not accepted.
    Rejected,
    /// The move could not be made from this state; it counts as proposed.
    Impossible,
}

/// What is recorded of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepInfo {
    /// The kind of move proposed.
    pub kind: MoveKind,
    /// What became of it.
    pub outcome: Outcome,
    /// Whether the importance draws of the proposal were evaluated at all.
    pub evaluated: bool,
    /// Whether the state's posterior value was 0 before this step (`--arithmetic linear` only).
    pub underflowed: bool,
}

/// How the chain moves.
#[derive(Clone, Debug)]
pub struct SamplerSettings {
    /// Weights of the moves.
    pub moves: MoveMix,
    /// How a set is split; one of them is a labelled fault.
    pub split: SplitRule,
    /// In which arithmetic the acceptance ratio is computed; one of them is a labelled fault.
    pub arithmetic: Arithmetic,
    /// R, the number of importance samples.
    pub importance_samples: usize,
    /// Whether hopeless proposals are rejected before their draws are evaluated. Changes no bit of
    /// the chain; off only to measure and to test that.
    pub early_rejection: bool,
}

/// The kernel of one chain.
pub struct Kernel<'a> {
    model: &'a Model,
    prior: PriorTable,
    settings: &'a SamplerSettings,
    generators: StepGenerators,
    draws: Draws,
    change: Change,
}

impl<'a> Kernel<'a> {
    /// For one data set; `generators` make the importance draws of each step.
    pub fn new(
        model: &'a Model,
        prior: Prior,
        settings: &'a SamplerSettings,
        generators: StepGenerators,
    ) -> Self {
        let n = model.n_detections();
        Self {
            model,
            prior: prior.table(n),
            settings,
            generators,
            draws: Draws::new(n, settings.importance_samples),
            change: Change::default(),
        }
    }

    /// The state that stands at `partition`, with its first estimate.
    pub fn init(&mut self, partition: Partition) -> State {
        let sets = || partition.sets().iter().map(Vec::as_slice);
        let ln_bound_of: Vec<f64> = sets()
            .map(|members| self.draws.ln_bound(self.model, members))
            .collect();
        let ln_prior = self.prior.ln_prior(sets().map(<[u32]>::len));
        // Steps count from 0; the initial draws are those of a step that never comes.
        let mut rng = self.generators.at(u64::MAX);
        let ln_mean = self.draws.ln_mean_exp(self.model, sets(), &mut rng);
        let ln_estimate = ln_bound_of.iter().sum::<f64>() + ln_mean;
        State {
            ln_prior,
            ln_estimate,
            ln_bound_of,
            partition,
        }
    }

    /// Step number `step`: proposes, and moves the state if the proposal is accepted.
    pub fn step(&mut self, state: &mut State, step: u64, rng: &mut impl Rng) -> StepInfo {
        self.change.clear();
        let partition = &state.partition;
        let (kind, ln_proposal_ratio) = match self.settings.moves.choose(rng) {
            Move::SplitMerge => {
                split_merge::propose(self.settings.split, partition, &mut self.change, rng)
            }
            Move::Refresh => (MoveKind::Refresh, Some(0.0)),
        };
        let arithmetic = self.settings.arithmetic;
        let current = accept::Value::new(state.ln_target(), self.model.ln_constant());
        let underflowed = arithmetic == Arithmetic::Linear && current.linear() == 0.0;
        let info = |outcome, evaluated| StepInfo {
            kind,
            outcome,
            evaluated,
            underflowed,
        };
        let Some(ln_proposal_ratio) = ln_proposal_ratio else {
            return info(Outcome::Impossible, false);
        };

        // u is drawn before the estimate, so that the bound below can use it.
        let u: f64 = 1.0 - rng.random::<f64>();
        let ln_bound = self.ln_bound_after(state);
        let ln_prior = self.ln_prior_after(state);
        let accepts = |ln_estimate: f64| {
            let proposed = accept::Value::new(ln_prior + ln_estimate, self.model.ln_constant());
            arithmetic.accepts(u, current, proposed, ln_proposal_ratio)
        };
        // The draws can only lower the estimate: what fails at the bound fails with them.
        if self.settings.early_rejection && !accepts(ln_bound) {
            return info(Outcome::Rejected, false);
        }

        let change = &self.change;
        let staying = partition.sets().iter().enumerate();
        let staying = staying.filter(|(set_ix, _)| !change.removed().contains(&(*set_ix as u32)));
        let sets = staying
            .map(|(_, members)| members)
            .chain(change.added())
            .map(Vec::as_slice);
        let mut draw_rng = self.generators.at(step);
        let ln_estimate = ln_bound + self.draws.ln_mean_exp(self.model, sets, &mut draw_rng);
        if !accepts(ln_estimate) {
            return info(Outcome::Rejected, true);
        }
        self.apply(state);
        state.ln_prior = ln_prior;
        state.ln_estimate = ln_estimate;
        info(Outcome::Accepted, true)
    }

    /// Bound on ln Ẑ of the proposed topology, summed anew so that rounding never accumulates.
    fn ln_bound_after(&mut self, state: &State) -> f64 {
        let removed = self.change.removed();
        let staying = state.ln_bound_of.iter().enumerate();
        let staying: f64 = staying
            .filter(|(set_ix, _)| !removed.contains(&(*set_ix as u32)))
            .map(|(_, ln_bound)| ln_bound)
            .sum();
        let added: f64 = self
            .change
            .added()
            .iter()
            .map(|members| self.draws.ln_bound(self.model, members))
            .sum();
        staying + added
    }

    fn ln_prior_after(&self, state: &State) -> f64 {
        let size = |set_ix: &u32| state.partition.sets()[*set_ix as usize].len();
        let gone: f64 = self
            .change
            .removed()
            .iter()
            .map(|set| self.prior.ln_size(size(set)))
            .sum();
        let come: f64 = self
            .change
            .added()
            .iter()
            .map(|members| self.prior.ln_size(members.len()))
            .sum();
        let n_sets = state.partition.n_sets();
        let n_sets_after = self.change.n_sets_after(n_sets);
        state.ln_prior
            + (come - gone)
            + (self.prior.ln_n_sets(n_sets_after) - self.prior.ln_n_sets(n_sets))
    }

    fn apply(&mut self, state: &mut State) {
        let State {
            partition,
            ln_bound_of,
            ..
        } = state;
        partition.apply(&self.change, |_, set_ix| {
            ln_bound_of.swap_remove(set_ix);
        });
        ln_bound_of.extend(
            self.change
                .added()
                .iter()
                .map(|members| self.draws.ln_bound(self.model, members)),
        );
    }
}

#[cfg(test)]
mod tests;
