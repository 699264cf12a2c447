//! Where a chain stands between two steps: everything that the steps to come depend on, and nothing else.
//!
//! A chain that goes on from here is the same, bit for bit, as one that never stopped. So a position holds what
//! was summed as it was summed and what was listed in the order in which it was listed, as the sets of a
//! partition, the draws and their running sums, and the cells of the grid over them. Working space and
//! memories of what is a function of a set alone are left out: they are made again.

use serde::{Deserialize, Serialize};

use super::tiled::Tiled;
use crate::rng::Generator;
use crate::sampler::{Ladder, Replicas, State, SwapCounts};

/// A position, lent for saving.
#[derive(Serialize)]
pub struct Position<'a> {
    /// The next step.
    pub(super) step: u64,
    pub(super) chain: Standing<'a>,
}

/// As [`SavedStanding`], to which it must stay parallel: one is written, the other read.
#[derive(Serialize)]
pub(super) enum Standing<'a> {
    Plain {
        state: &'a State,
        rng: &'a Generator,
    },
    Tempered {
        ladder: &'a Ladder,
        replicas: &'a Replicas,
        swaps: &'a [SwapCounts],
        rngs: &'a [Generator],
        n_tuning: u64,
    },
    Tiled(&'a Tiled),
}

/// A position that was saved, or that a chain came to.
#[derive(Deserialize)]
pub struct SavedPosition {
    pub(super) step: u64,
    pub(super) chain: SavedStanding,
}

#[derive(Deserialize)]
pub(super) enum SavedStanding {
    Plain {
        state: Box<State>,
        rng: Generator,
    },
    Tempered {
        ladder: Ladder,
        replicas: Replicas,
        swaps: Vec<SwapCounts>,
        rngs: Vec<Generator>,
        n_tuning: u64,
    },
    Tiled(Box<Tiled>),
}

impl SavedPosition {
    /// The next step.
    pub fn step(&self) -> u64 {
        self.step
    }
}
