//! Which cells are at which level of each factor.
//!
//! Of a grid, all cells with that level. Round a baseline, those with all other factors at the baseline. Of
//! a sampled design, the cells in a bin: an equal share of the factor's range.

use crate::settings::Key;
use crate::sweep::{Axis, Cell, Design, Factor, SampledDesign, Sampling, Sweep};

/// Cells that a bin of a sampled design should hold on average.
const CELLS_PER_BIN: usize = 8;
/// Bins at most: a curve of more says nothing that the table of cells does not.
const MOST_BINS: usize = 6;

/// A factor with its levels, and each cell's.
#[derive(Clone)]
pub struct FactorLevels {
    /// The setting.
    pub key: &'static Key,
    /// Its levels or bins in order, as a figure writes them.
    pub labels: Vec<String>,
    /// The level of each cell, by its index; `None` for a cell that is not compared.
    pub of_cell: Vec<Option<usize>>,
}

impl FactorLevels {
    /// Cells at a level.
    pub fn n_cells(&self, level: usize) -> usize {
        self.of_cell
            .iter()
            .filter(|own| **own == Some(level))
            .count()
    }
}

impl std::fmt::Debug for FactorLevels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {:?}", self.key.name, self.labels)
    }
}

/// All factors of the sweep; none for a list, whose cells are not laid out so that levels could be compared.
pub(super) fn factor_levels(sweep: &Sweep) -> Vec<FactorLevels> {
    match &sweep.design {
        Design::List(_) => Vec::new(),
        Design::Sampled(design) => {
            let bins = |axis: &Axis| binned(sweep, design, axis);
            design.axes.iter().filter_map(bins).collect()
        }
        Design::Grid(_) => by_level(sweep, false),
        Design::OneAtATime(_) => by_level(sweep, true),
    }
}

fn by_level(sweep: &Sweep, round_baseline: bool) -> Vec<FactorLevels> {
    let n_off_baseline: Vec<usize> = (sweep.cells.iter())
        .map(|cell| {
            let differs = |key: &&Key| cell.settings.get(key.name) != sweep.base.get(key.name);
            sweep
                .factors
                .iter()
                .map(|factor| factor.key)
                .filter(differs)
                .count()
        })
        .collect();
    let levels = |factor: &Factor| {
        let name = factor.key.name;
        let of_cell = |(place, cell): (usize, &Cell)| {
            let value = cell.settings.get(name);
            let own = usize::from(value != sweep.base.get(name));
            if round_baseline && n_off_baseline[place] != own {
                return None;
            }
            factor.levels.iter().position(|level| level == value)
        };
        FactorLevels {
            key: factor.key,
            labels: factor.levels.iter().map(ToString::to_string).collect(),
            of_cell: sweep.cells.iter().enumerate().map(of_cell).collect(),
        }
    };
    sweep.factors.iter().map(levels).collect()
}

fn binned(sweep: &Sweep, design: &SampledDesign, axis: &Axis) -> Option<FactorLevels> {
    let most = match design.sampling {
        // The levels of its grid.
        Sampling::Morris => 4,
        _ => (sweep.cells.len() / CELLS_PER_BIN).clamp(2, MOST_BINS),
    };
    let n = axis.n_bins(most);
    if n < 2 {
        return None;
    }
    let value = |cell: &Cell| axis.bin(cell.settings.get(axis.key.name), n);
    Some(FactorLevels {
        key: axis.key,
        labels: (0..n).map(|bin| axis.bin_label(bin, n)).collect(),
        of_cell: sweep.cells.iter().map(value).collect(),
    })
}
