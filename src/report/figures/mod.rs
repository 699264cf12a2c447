//! From results to figures: which numbers go where.

mod agreement;
mod all_cells;
mod effects;
mod maps;
mod multiples;
mod reliability;
mod rows;
mod sensitivity;
mod timing;
mod traces;
mod worlds;

pub use maps::map_figure;
pub use reliability::reliability_figure;
pub use rows::sample_figure;
pub use worlds::simulation_figure;

pub(super) use agreement::chains;
pub(super) use all_cells::run_status;
pub(super) use effects::{effect, effects, pair_recovery};
pub(super) use multiples::interactions;
pub(super) use rows::{cell, cell_map, side_by_side};
pub(super) use sensitivity::{curves, indices};
pub(super) use timing::{ess_against_cost, ess_by_level};
pub(super) use traces::by_init as traces_by_init;
pub(super) use worlds::worlds;

use super::{Figure, Material, words};
use crate::figure::style::{Colour, STATUS};
use crate::results::Verdict;
use crate::sweep::Factor;

/// What every cell did, in the order in which it is read.
pub(super) fn every_cell(material: Material<'_>) -> Vec<Figure> {
    let recovery = all_cells::all_cells(material, "recovery", "Recovery rate", |cell| {
        cell.recovery.map(|r| r.rate)
    });
    let acceptance = all_cells::all_cells(material, "acceptance", "Acceptance rate", |cell| {
        cell.acceptance_rate
    });
    [
        multiples::recovery(material),
        multiples::nested_loop(material),
        recovery,
        acceptance,
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The colour that a verdict has in figures and pages.
pub(super) fn verdict_colour(verdict: Verdict) -> Colour {
    STATUS[verdict as usize]
}

fn level_names(factor: &Factor) -> Vec<String> {
    factor.levels.iter().map(words::level).collect()
}
