//! The Metropolis–Hastings kernel over topologies (source report, algorithms 1 and 2, and beyond).
//!
//! A kernel is [`Kernel::init`] and [`Kernel::step`]: the [`State`] holds what the next step needs,
//! the [`StepInfo`] what is only recorded. The rule that accepts ([`accept`]) stands apart from the
//! moves that propose (one file each), and no move knows the model: those that look at the data ask it
//! for scores.
//!
//! With `fresh` every proposal draws R new importance samples, and the current state keeps the estimate
//! it was accepted with. That makes the chain pseudo-marginal (Andrieu & Roberts 2009), exact for every
//! R ≥ 1; re-estimating both sides at each step would not be. With `common` the draws are part of the
//! state, and a proposal differs from it by what it touches ([`CommonDraws`]).

pub mod accept;
mod allocation;
mod anchors;
mod choices;
mod estimator;
pub mod moves;
mod pair_reassign;
mod reassign;
mod restricted_gibbs;
mod sequential_allocation;
mod split_merge;

pub use accept::Arithmetic;
pub use estimator::Estimator;
pub use moves::{Move, MoveKind, MoveMix};
pub use split_merge::SplitRule;

use rand::{Rng, RngExt};

use crate::model::prior::PriorTable;
use crate::model::{Block, CommonDraws, Draws, Model, Prior, Surrogate, Workspace};
use crate::partition::{Change, Partition};
use crate::rng::StepGenerators;
use anchors::Anchors;
use choices::Choices;
use moves::{Proposal, Scene};
use pair_reassign::PairReassign;
use reassign::Reassign;
use restricted_gibbs::RestrictedGibbs;
use sequential_allocation::SequentialAllocation;

/// Running sums are rebuilt from scratch every so many steps, so that rounding does not pile up.
pub const REBUILD_INTERVAL: u64 = 1 << 16;

/// What the next step needs.
#[derive(Clone, Debug)]
pub struct State {
    partition: Partition,
    /// ln of the largest weight of every set, parallel to the partition's sets.
    ln_bound_of: Vec<f64>,
    /// Their sum.
    ln_bound: f64,
    /// Statistics of every set, for moves that ask for scores; else empty.
    blocks: Vec<Block>,
    ln_prior: f64,
    /// ln of the mean over the draws of exp(h − Pen).
    ln_mean: f64,
    /// The draws, where they are part of the state.
    draws: Option<CommonDraws>,
}

impl State {
    /// The current topology.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// ln Ẑ(T): the log estimate of ∫exp(−E−Pen) that this state was accepted with, without N ln(π/a).
    pub fn ln_estimate(&self) -> f64 {
        self.ln_bound + self.ln_mean
    }

    /// ln P(T), without constants.
    pub fn ln_prior(&self) -> f64 {
        self.ln_prior
    }

    /// ln P(T) + ln Ẑ(T).
    pub fn ln_target(&self) -> f64 {
        self.ln_prior + self.ln_estimate()
    }

    /// The draws that the state keeps (`common`).
    pub fn draws(&self) -> Option<&CommonDraws> {
        self.draws.as_ref()
    }
}

/// What became of a proposal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The chain moved.
    Accepted,
    /// Proposed and not accepted; a hold too.
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
    /// Whether importance draws of the proposal were evaluated at all.
    pub evaluated: bool,
    /// Whether the state's posterior value was 0 before this step (`--arithmetic linear` only).
    pub underflowed: bool,
}

/// How the chain moves.
#[derive(Clone, Debug)]
pub struct SamplerSettings {
    /// Weights of the moves.
    pub moves: MoveMix,
    /// Where the importance draws come from.
    pub estimator: Estimator,
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
    work: Work,
    moves: Moves<'a>,
    change: Change,
    /// The set that a refresh draws anew (`common`).
    refreshed: usize,
}

/// What draws are evaluated in.
enum Work {
    Fresh(Box<Draws>),
    Common(Box<Workspace>),
}

impl Work {
    fn ln_bound(&mut self, model: &Model, members: &[u32]) -> f64 {
        match self {
            Self::Fresh(draws) => draws.ln_bound(model, members),
            Self::Common(work) => work.ln_bound(model, members),
        }
    }
}

/// The moves with their working space.
struct Moves<'a> {
    surrogate: Option<Surrogate<'a>>,
    reassign: Reassign,
    pair_reassign: PairReassign,
    anchors: Anchors,
    sequential_allocation: SequentialAllocation,
    restricted_gibbs: RestrictedGibbs,
}

/// A proposal on its way through the acceptance rule.
struct Trial {
    arithmetic: Arithmetic,
    threshold: accept::Threshold,
    current: accept::Value,
    ln_constant: f64,
    ln_prior: f64,
    ln_bound: f64,
    ln_ratio: f64,
}

impl Trial {
    /// Whether the proposal is accepted if ln of the mean over its draws is `ln_mean`.
    fn accepts(&self, ln_mean: f64) -> bool {
        let ln_target = self.ln_prior + (self.ln_bound + ln_mean);
        let proposed = accept::Value::new(ln_target, self.ln_constant);
        self.arithmetic
            .accepts(self.threshold, self.current, proposed, self.ln_ratio)
    }
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
        let n_draws = settings.importance_samples;
        Self {
            model,
            prior: prior.table(n),
            settings,
            generators,
            work: match settings.estimator {
                Estimator::Fresh => Work::Fresh(Box::new(Draws::new(n, n_draws))),
                Estimator::Common => Work::Common(Box::new(Workspace::new(n, n_draws))),
            },
            moves: Moves {
                surrogate: settings.moves.scores().then(|| Surrogate::of(model)),
                reassign: Reassign::new(n),
                pair_reassign: PairReassign::default(),
                anchors: Anchors::new(n),
                sequential_allocation: SequentialAllocation::new(n),
                restricted_gibbs: RestrictedGibbs::new(n),
            },
            change: Change::default(),
            refreshed: 0,
        }
    }

    /// The state that stands at `partition`, with its first estimate.
    pub fn init(&mut self, partition: Partition) -> State {
        let ln_bound_of: Vec<f64> = partition
            .sets()
            .iter()
            .map(|members| self.work.ln_bound(self.model, members))
            .collect();
        let blocks = match &self.moves.surrogate {
            Some(surrogate) => partition
                .sets()
                .iter()
                .map(|members| surrogate.block(members))
                .collect(),
            None => Vec::new(),
        };
        // Steps count from 0; the initial draws are those of a step that never comes.
        let mut rng = self.generators.at(u64::MAX);
        let (ln_mean, draws) = match &mut self.work {
            Work::Fresh(draws) => {
                let sets = partition.sets().iter().map(Vec::as_slice);
                (draws.ln_mean_exp(self.model, sets, &mut rng), None)
            }
            Work::Common(work) => {
                let n_draws = self.settings.importance_samples;
                let topology = (partition.sets(), partition.set_of());
                let draws = CommonDraws::new(self.model, n_draws, topology, work, &mut rng);
                (draws.ln_mean(self.model), Some(draws))
            }
        };
        State {
            ln_prior: self.ln_prior(&partition),
            ln_bound: ln_bound_of.iter().sum(),
            ln_bound_of,
            blocks,
            ln_mean,
            draws,
            partition,
        }
    }

    /// Step number `step`: proposes, and moves the state if the proposal is accepted.
    pub fn step(&mut self, state: &mut State, step: u64, rng: &mut impl Rng) -> StepInfo {
        if step % REBUILD_INTERVAL == REBUILD_INTERVAL - 1 {
            self.rebuild(state);
        }
        self.change.clear();
        let (kind, proposal) = self.propose(state, rng);
        let underflowed = self.settings.arithmetic == Arithmetic::Linear
            && accept::Value::new(state.ln_target(), self.model.ln_constant()).linear() == 0.0;
        let info = |outcome, evaluated| StepInfo {
            kind,
            outcome,
            evaluated,
            underflowed,
        };
        let ln_ratio = match proposal {
            Proposal::Impossible => return info(Outcome::Impossible, false),
            Proposal::Hold => return info(Outcome::Rejected, false),
            Proposal::Change { ln_ratio } => ln_ratio,
        };
        // u is drawn before the estimate, so that the bounds below can use it.
        let u = 1.0 - rng.random::<f64>();
        let trial = self.trial(state, ln_ratio, u);
        // The draws can only lower the estimate: what fails at a bound fails with them.
        if self.settings.early_rejection && !trial.accepts(0.0) {
            return info(Outcome::Rejected, false);
        }
        let Some(ln_mean) = self.evaluate(state, kind, step, &trial) else {
            return info(Outcome::Rejected, true);
        };
        if !trial.accepts(ln_mean) {
            return info(Outcome::Rejected, true);
        }
        self.apply(state);
        state.ln_prior = trial.ln_prior;
        state.ln_bound = trial.ln_bound;
        state.ln_mean = ln_mean;
        info(Outcome::Accepted, true)
    }

    /// The change that is described, on its way through the acceptance rule.
    fn trial(&mut self, state: &State, ln_ratio: f64, u: f64) -> Trial {
        let ln_constant = self.model.ln_constant();
        Trial {
            arithmetic: self.settings.arithmetic,
            threshold: accept::Threshold::new(u),
            current: accept::Value::new(state.ln_target(), ln_constant),
            ln_constant,
            ln_prior: self.ln_prior_after(state),
            ln_bound: self.ln_bound_after(state),
            ln_ratio,
        }
    }

    /// Describes a move in `self.change`.
    fn propose(&mut self, state: &State, choices: &mut impl Choices) -> (MoveKind, Proposal) {
        let (partition, change) = (&state.partition, &mut self.change);
        let Moves {
            surrogate,
            reassign,
            pair_reassign,
            anchors,
            sequential_allocation,
            restricted_gibbs,
        } = &mut self.moves;
        let scene = || Scene {
            partition,
            blocks: &state.blocks,
            surrogate: surrogate.as_ref().expect("the mix has moves that score"),
        };
        match self.settings.moves.choose(choices) {
            Move::SplitMerge => {
                split_merge::propose(self.settings.split, partition, change, choices)
            }
            Move::Refresh => {
                self.refreshed = match self.work {
                    Work::Fresh(_) => 0,
                    Work::Common(_) => choices.below(partition.n_sets()),
                };
                (MoveKind::Refresh, Proposal::Change { ln_ratio: 0.0 })
            }
            Move::Reassign => {
                let proposal = reassign.propose(&scene(), change, choices);
                (MoveKind::Reassign, proposal)
            }
            Move::PairReassign => {
                let proposal = pair_reassign.propose(&scene(), change, choices);
                (MoveKind::PairReassign, proposal)
            }
            Move::Anchors => {
                let proposal = anchors.propose(&scene(), change, choices);
                (MoveKind::Anchors, proposal)
            }
            Move::SequentialAllocation => {
                let proposal = sequential_allocation.propose(&scene(), change, choices);
                (MoveKind::SequentialAllocation, proposal)
            }
            Move::RestrictedGibbs => {
                let proposal = restricted_gibbs.propose(&scene(), change, choices);
                (MoveKind::RestrictedGibbs, proposal)
            }
        }
    }

    /// ln of the mean over the draws of the proposal; `None` if a bound on it is rejected already.
    fn evaluate(&mut self, state: &State, kind: MoveKind, step: u64, trial: &Trial) -> Option<f64> {
        let (model, partition) = (self.model, &state.partition);
        let fails = |ln_bound| self.settings.early_rejection && !trial.accepts(ln_bound);
        // Each step has importance draws of its own, so that skipping them changes nothing after it.
        let mut draw_rng = self.generators.at(step);
        match &mut self.work {
            Work::Fresh(draws) => {
                let removed = self.change.removed();
                let staying = partition.sets().iter().enumerate();
                let staying = staying.filter(|(ix, _)| !removed.contains(&(*ix as u32)));
                let sets = staying
                    .map(|(_, members)| members)
                    .chain(self.change.added())
                    .map(Vec::as_slice);
                Some(draws.ln_mean_exp(model, sets, &mut draw_rng))
            }
            Work::Common(work) => {
                let draws = state.draws.as_ref().expect("common keeps its draws");
                let is_refresh = kind == MoveKind::Refresh;
                let sets_after = if is_refresh {
                    std::slice::from_ref(&partition.sets()[self.refreshed])
                } else {
                    self.change.added()
                };
                let set_of = partition.set_of();
                if fails(work.take_out(model, draws, set_of, sets_after)) {
                    return None;
                }
                if is_refresh {
                    work.refresh(&mut draw_rng);
                }
                if fails(work.put_in(model, draws, sets_after)) {
                    return None;
                }
                Some(work.ln_mean())
            }
        }
    }

    fn ln_prior(&self, partition: &Partition) -> f64 {
        self.prior.ln_prior(partition.sets().iter().map(Vec::len))
    }

    /// Running sums from scratch.
    fn rebuild(&mut self, state: &mut State) {
        state.ln_bound = state.ln_bound_of.iter().sum();
        state.ln_prior = self.ln_prior(&state.partition);
        if let (Work::Common(work), Some(draws)) = (&mut self.work, &mut state.draws) {
            let set_of = state.partition.set_of();
            debug_assert!(draws.drift(self.model, set_of, work) < 1e-9);
            draws.rebuild(self.model, set_of, work);
            state.ln_mean = draws.ln_mean(self.model);
        }
    }

    /// Σ over sets of ln of the largest weight, of the proposed topology.
    fn ln_bound_after(&mut self, state: &State) -> f64 {
        let removed = self.change.removed().iter();
        let gone: f64 = removed.map(|&set| state.ln_bound_of[set as usize]).sum();
        let added = self.change.added().iter();
        let come: f64 = added
            .map(|members| self.work.ln_bound(self.model, members))
            .sum();
        state.ln_bound + (come - gone)
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
        if let (Work::Common(work), Some(draws)) = (&mut self.work, &mut state.draws) {
            work.commit(draws);
        }
        let State {
            partition,
            ln_bound_of,
            blocks,
            ..
        } = state;
        partition.apply(&self.change, |_, set_ix| {
            ln_bound_of.swap_remove(set_ix);
            if !blocks.is_empty() {
                blocks.swap_remove(set_ix);
            }
        });
        for members in self.change.added() {
            ln_bound_of.push(self.work.ln_bound(self.model, members));
            if let Some(surrogate) = &self.moves.surrogate {
                blocks.push(surrogate.block(members));
            }
        }
    }
}

#[cfg(test)]
mod tests;
