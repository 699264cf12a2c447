//! The state of a chain, and what is recorded of a step.

use serde::{Deserialize, Serialize};

use super::{MoveKind, Placement};
use crate::model::{Block, CommonDraws};
use crate::partition::Partition;

/// What the next step needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    pub(super) partition: Partition,
    /// ln of the largest weight of every set, parallel to the partition's sets.
    pub(super) ln_bound_of: Vec<f64>,
    /// Their sum.
    pub(super) ln_bound: f64,
    /// Statistics of every set, for moves that ask for scores; else empty.
    pub(super) blocks: Vec<Block>,
    pub(super) ln_prior: f64,
    /// ln of the mean over the draws of exp(h − Pen).
    pub(super) ln_mean: f64,
    /// The draws, where they are part of the state.
    pub(super) draws: Option<CommonDraws>,
    /// The locations, where they are.
    pub(super) placement: Option<Box<Placement>>,
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

    /// ln P(T) + ln Ẑ(T); with `explicit`, ln P(T) + Σ ln I₀, without E[exp(−Pen)].
    pub fn ln_target(&self) -> f64 {
        self.ln_prior + self.ln_estimate()
    }

    /// The locations that the state keeps; panics if it keeps none.
    pub(super) fn placement(&self) -> &Placement {
        let placement = self.placement.as_deref();
        placement.expect("explicit keeps its locations")
    }

    /// Takes the locations out, m, for tiles to keep; none of an estimator without.
    pub(crate) fn take_locations(&mut self) -> Vec<[f64; 2]> {
        let placement = self.placement.take();
        placement.map_or_else(Vec::new, |placement| placement.into_locations_m())
    }

    /// The locations that the state keeps (`explicit`).
    pub fn locations(&self) -> Option<&Placement> {
        self.placement.as_deref()
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
    /// Sets that the step brought: the last so many of the partition; 0 if the topology is the same.
    pub n_new_sets: u32,
}
