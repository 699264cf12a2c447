//! How the worlds of all cells at each level of a factor fared: counts of verdicts, zeros too.
//!
//! What a recovery rate is worth is how much of it was had by chains that converged, so every rate
//! by level has these beside it. In a one-at-a-time design the other factors are at the baseline.

use super::{CellResult, WorldsByVerdict};
use crate::sweep::{Cell, Design, Sweep};

/// The worlds of all cells at each level of a factor.
pub fn verdicts_by_level(
    sweep: &Sweep,
    cells: &[CellResult],
    factor: usize,
) -> Vec<WorldsByVerdict> {
    let key = sweep.factors[factor].key.name;
    let round_baseline = matches!(sweep.design, Design::OneAtATime(_));
    let at_baseline = |cell: &Cell| {
        sweep.factors.iter().all(|other| {
            let name = other.key.name;
            name == key || cell.settings.get(name) == sweep.base.get(name)
        })
    };
    let of_level = |level| {
        let mut found = WorldsByVerdict::default();
        for (cell, result) in sweep.cells.iter().zip(cells) {
            if cell.settings.get(key) == level && (!round_baseline || at_baseline(cell)) {
                found.add(&result.worlds);
            }
        }
        found
    };
    sweep.factors[factor].levels.iter().map(of_level).collect()
}
