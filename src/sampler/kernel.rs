//! The kernel: a proposal, its value, the acceptance rule.

use rand::{Rng, RngExt};

use super::accept::{self, Arithmetic, Trial};
use super::anchors::Anchors;
use super::choices::Choices;
use super::explicit::Explicit;
use super::moves::{Move, MoveKind, Proposal, Scene};
use super::pair_reassign::PairReassign;
use super::pair_split::PairSplit;
use super::reassign::Reassign;
use super::{Estimator, Outcome, SamplerSettings, State, StepInfo, split_merge};
use crate::model::prior::PriorTable;
use crate::model::{CommonDraws, Draws, Model, Prior, Surrogate, Workspace};
use crate::partition::{Change, Partition};
use crate::rng::StepGenerators;

/// Running sums are rebuilt from scratch every so many steps at least, so that rounding does not pile up.
const FEWEST_BETWEEN_REBUILDS: u64 = 1 << 16;
/// And every so many steps for each detection: a rebuild looks at all of them, and must not be what a step costs.
const STEPS_PER_DETECTION: u64 = 64;

/// Steps from one rebuild of the running sums to the next, for N detections.
pub fn rebuild_interval(n_detections: usize) -> u64 {
    (STEPS_PER_DETECTION * n_detections as u64).max(FEWEST_BETWEEN_REBUILDS)
}

/// The kernel of one chain.
pub struct Kernel<'a> {
    model: &'a Model,
    pub(super) prior: PriorTable,
    settings: &'a SamplerSettings,
    generators: StepGenerators,
    work: Work<'a>,
    pub(super) moves: Moves<'a>,
    pub(super) change: Change,
    /// ln of the largest weight of each set that comes.
    ln_bound_of_added: Vec<f64>,
    /// N·ln(π/a).
    ln_constant: f64,
    /// The set that a refresh draws anew (`common`).
    refreshed: usize,
    rebuild_interval: u64,
    scratch: Vec<f64>,
}

/// What draws are evaluated in.
enum Work<'a> {
    Fresh(Box<Draws>),
    Common(Box<Workspace>),
    /// Nothing is drawn: it moves by itself.
    Explicit(Box<Explicit<'a>>),
}

impl Work<'_> {
    fn ln_bound(&mut self, model: &Model, members: &[u32]) -> f64 {
        match self {
            Self::Fresh(draws) => draws.ln_bound(model, members),
            Self::Common(work) => work.ln_bound(model, members),
            Self::Explicit(explicit) => explicit.ln_bound(members),
        }
    }
}

/// The moves with their working space.
pub(super) struct Moves<'a> {
    surrogate: Option<Surrogate<'a>>,
    reassign: Reassign,
    pair_reassign: PairReassign,
    anchors: Anchors,
    sequential_allocation: PairSplit,
    pub(super) restricted_gibbs: PairSplit,
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
                Estimator::Explicit => {
                    Work::Explicit(Box::new(Explicit::new(model, prior, settings.candidates)))
                }
            },
            moves: Moves {
                surrogate: settings.moves.scores().then(|| Surrogate::of(model)),
                reassign: Reassign::new(n),
                pair_reassign: PairReassign::default(),
                anchors: Anchors::new(n),
                sequential_allocation: PairSplit::sequential(n),
                restricted_gibbs: PairSplit::restricted_gibbs(n),
            },
            change: Change::default(),
            ln_bound_of_added: Vec::new(),
            ln_constant: model.ln_constant(),
            refreshed: 0,
            rebuild_interval: rebuild_interval(n),
            scratch: Vec::new(),
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
        let (mut draws, mut placement) = (None, None);
        let ln_mean = match &mut self.work {
            Work::Fresh(work) => {
                let sets = partition.sets().iter().map(Vec::as_slice);
                work.ln_mean_exp(self.model, sets, &mut rng)
            }
            Work::Common(work) => {
                let n_draws = self.settings.importance_samples;
                let topology = (partition.sets(), partition.set_of());
                let drawn = CommonDraws::new(self.model, n_draws, topology, work, &mut rng);
                let drawn = draws.insert(drawn);
                drawn.ln_mean(self.model, &mut Vec::new())
            }
            Work::Explicit(explicit) => {
                placement = Some(explicit.place(&partition, &mut rng));
                0.0
            }
        };
        State {
            ln_prior: self.ln_prior(&partition),
            ln_bound: ln_bound_of.iter().sum(),
            ln_bound_of,
            blocks,
            ln_mean,
            draws,
            placement,
            partition,
        }
    }

    /// ln of the part of a state's weight that depends on the height of the penalty, as this kernel
    /// sees it: ln of the mean over the kept draws, or −Pen of the locations.
    pub(super) fn ln_penalised(&mut self, state: &State) -> f64 {
        match &self.work {
            Work::Explicit(explicit) => -explicit.penalty(state),
            _ => {
                let draws = state.draws.as_ref().expect("common keeps its draws");
                draws.ln_mean(self.model, &mut self.scratch)
            }
        }
    }

    /// Lists the sets of a state by their first detections, and its locations by sets (`explicit`):
    /// what the law of the next step does not depend on.
    pub fn list_anew(&self, state: &mut State) {
        let Work::Explicit(explicit) = &self.work else {
            return;
        };
        let labels = state.partition.topology();
        state.partition = Partition::from_labels(labels.labels());
        let x_m = state.take_locations();
        let (placement, ln_bound_of) = explicit.place_at(&state.partition, x_m);
        state.placement = Some(placement);
        state.ln_bound = ln_bound_of.iter().sum();
        state.ln_bound_of = ln_bound_of;
        state.ln_prior = self.ln_prior(&state.partition);
    }

    /// The same of the state that stands here.
    pub(super) fn ln_penalised_here(&mut self, state: &State) -> f64 {
        match self.work {
            Work::Explicit(_) => self.ln_penalised(state),
            _ => state.ln_mean,
        }
    }

    /// Takes over a state from a kernel of the same model with another height of the penalty, where
    /// this kernel has said what [`ln_penalised`](Self::ln_penalised) is.
    pub(super) fn adopt(&mut self, state: &mut State, ln_penalised: f64) {
        match &self.work {
            Work::Explicit(explicit) => explicit.adopt(state),
            _ => state.ln_mean = ln_penalised,
        }
    }

    /// Step number `step`: proposes, and moves the state if the proposal is accepted.
    pub fn step(&mut self, state: &mut State, step: u64, rng: &mut impl Rng) -> StepInfo {
        if (step + 1).is_multiple_of(self.rebuild_interval) {
            self.rebuild(state);
        }
        if let Work::Explicit(explicit) = &mut self.work {
            return explicit.step(&self.settings.moves, state, rng);
        }
        self.change.clear();
        let (kind, proposal) = self.propose(state, rng);
        let underflowed = self.settings.arithmetic == Arithmetic::Linear
            && accept::Value::new(state.ln_target(), self.ln_constant).linear() == 0.0;
        let info = |outcome, evaluated| StepInfo {
            kind,
            outcome,
            evaluated,
            underflowed,
            n_new_sets: 0,
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
        StepInfo {
            n_new_sets: self.change.added().len() as u32,
            ..info(Outcome::Accepted, true)
        }
    }

    /// The change that is described, on its way through the acceptance rule.
    pub(super) fn trial(&mut self, state: &State, ln_ratio: f64, u: f64) -> Trial {
        let ln_constant = self.ln_constant;
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
    pub(super) fn propose(
        &mut self,
        state: &State,
        choices: &mut impl Choices,
    ) -> (MoveKind, Proposal) {
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
                    Work::Common(_) => choices.below(partition.n_sets()),
                    _ => 0,
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
            other => panic!("the settings allow {other:?} with explicit locations only"),
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
            Work::Explicit(_) => unreachable!("explicit locations move by themselves"),
        }
    }

    pub(super) fn ln_prior(&self, partition: &Partition) -> f64 {
        self.prior.ln_prior(partition.sets().iter().map(Vec::len))
    }

    /// Running sums from scratch.
    pub(super) fn rebuild(&mut self, state: &mut State) {
        state.ln_bound = state.ln_bound_of.iter().sum();
        state.ln_prior = self.ln_prior(&state.partition);
        if let (Work::Common(work), Some(draws)) = (&mut self.work, &mut state.draws) {
            let set_of = state.partition.set_of();
            debug_assert!(draws.drift(self.model, set_of, work) < 1e-9);
            draws.rebuild(self.model, set_of, work);
            state.ln_mean = draws.ln_mean(self.model, &mut Vec::new());
        }
        if let Some(placement) = &mut state.placement {
            placement.rebuild(&state.partition);
        }
    }

    /// Σ over sets of ln of the largest weight, of the proposed topology.
    fn ln_bound_after(&mut self, state: &State) -> f64 {
        let removed = self.change.removed().iter();
        let gone: f64 = removed.map(|&set| state.ln_bound_of[set as usize]).sum();
        self.ln_bound_of_added.clear();
        for members in self.change.added() {
            let ln_bound = self.work.ln_bound(self.model, members);
            self.ln_bound_of_added.push(ln_bound);
        }
        let come: f64 = self.ln_bound_of_added.iter().sum();
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
        ln_bound_of.extend_from_slice(&self.ln_bound_of_added);
        if let Some(surrogate) = &self.moves.surrogate {
            let added = self.change.added().iter();
            blocks.extend(added.map(|members| surrogate.block(members)));
        }
    }
}
