//! The Metropolis–Hastings kernel over topologies (source report, algorithms 1 and 2, and beyond).
//!
//! A kernel is [`Kernel::init`] and [`Kernel::step`]: the [`State`] holds what the next step needs,
//! the [`StepInfo`] what is only recorded. The rule that accepts ([`accept`]) stands apart from the
//! moves that propose, and no move knows the model: those that look at the data ask it
//! for scores.
//!
//! With `fresh` every proposal draws R new importance samples, and the current state keeps the estimate
//! it was accepted with. That makes the chain pseudo-marginal (Andrieu & Roberts 2009), exact for every
//! R ≥ 1; re-estimating both sides at each step would not be. With `common` the draws are part of the
//! state, and a proposal differs from it by what it touches ([`CommonDraws`](crate::model::CommonDraws)). With
//! `explicit` the locations are the state, and there is nothing to estimate.

pub mod accept;
mod allocation;
mod anchors;
mod choices;
mod estimator;
mod explicit;
mod kernel;
pub mod mix;
pub mod moves;
mod pair_reassign;
mod pair_split;
mod reassign;
mod split_merge;
mod state;
mod tempering;

pub use accept::Arithmetic;
pub use estimator::Estimator;
pub use explicit::{Placement, tiles};
pub use kernel::{Kernel, rebuild_interval};
pub use mix::MoveMix;
pub use moves::{Move, MoveKind};
pub use split_merge::SplitRule;
pub use state::{Outcome, State, StepInfo};
pub use tempering::{Ladder, Replicas, Rungs, SwapCounts, Tempering, n_tuning};

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
    /// R, the number of importance samples, where the estimator draws locations.
    pub importance_samples: usize,
    /// With `explicit`, the number of candidates for the locations of sets.
    pub candidates: usize,
    /// Whether hopeless proposals are rejected before their draws are evaluated. Changes no bit of
    /// the chain; off only to measure and to test that. `explicit` always does.
    pub early_rejection: bool,
    /// Parallel tempering on the penalty, for the estimator `common`.
    pub tempering: Option<Tempering>,
    /// Whether the plane is cut into tiles whose sets move at the same time, with `explicit` and a
    /// prior that does not look at M.
    pub tiles: bool,
}

#[cfg(test)]
mod tests;
