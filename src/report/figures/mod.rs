//! From results to figures: which numbers go where.

mod agreement;
mod all_cells;
mod effects;
mod maps;
mod reliability;
mod rows;
mod traces;
mod worlds;

pub use maps::map_figure;
pub use reliability::reliability_figure;
pub use rows::sample_figure;
pub use worlds::simulation_figure;

pub(super) use agreement::chains;
pub(super) use rows::cell;

use super::{Figure, Material, words};
use crate::figure::style::{Colour, STATUS};
use crate::results::Verdict;
use crate::sweep::Factor;

/// The figures of the whole sweep, in the order in which they are read.
pub(super) fn summary(material: Material<'_>) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(rows::side_by_side(material));
    figures.push(all_cells::run_status(material));
    figures.extend(effects::effects(material));
    figures.extend(effects::pair_recovery(material));
    figures.extend(all_cells::all_cells(
        material,
        "recovery",
        "Recovery rate",
        |cell| cell.recovery.map(|r| r.rate),
    ));
    figures.extend(all_cells::all_cells(
        material,
        "acceptance",
        "Acceptance rate",
        |cell| cell.acceptance_rate,
    ));
    figures.extend(traces::by_init(material));
    figures.extend(worlds::worlds(material));
    figures
}

/// The colour that a verdict has in figures and pages.
pub(super) fn verdict_colour(verdict: Verdict) -> Colour {
    STATUS[verdict as usize]
}

fn level_names(factor: &Factor) -> Vec<String> {
    factor.levels.iter().map(words::level).collect()
}
