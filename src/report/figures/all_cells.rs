//! Every cell of the sweep in one heat map.

use std::collections::HashMap;

use super::super::pages::cell_file;
use super::super::{Figure, Material, words};
use super::{level_key, level_names, verdict_colour};
use crate::figure::heat_map::{HeatCategory, HeatFactor, HeatMap};
use crate::figure::scene::Hover;
use crate::figure::style::Palette;
use crate::results::{CellResult, CellVerdict, Verdict};
use crate::sweep::{Cell, Design, SampledDesign, Sampling};

/// Cells up to which every map says what its tiles are; of more only that of verdicts does.
const MOST_IN_EACH: usize = 2000;

/// Every cell of the sweep in one heat map: nested factors for a grid, labels otherwise.
pub(super) fn all_cells(
    material: Material<'_>,
    file: &str,
    what: &str,
    value: impl Fn(&CellResult) -> Option<f64>,
) -> Option<Figure> {
    let cells = &material.results.cells;
    let values: Vec<Option<f64>> = cells.iter().map(value).collect();
    if values.iter().all(Option::is_none) {
        return None;
    }
    let is_recovery = file == "recovery";
    let text = |cell: usize| match (is_recovery, values[cell]) {
        (true, _) => {
            let rate = words::rate(cells[cell].recovery).replacen(" [", "\n[", 1);
            format!("{rate}\nconverged {}", words::gate(&cells[cell]))
        }
        (false, value) => words::percent(value),
    };
    // Acceptance rates differ by orders of magnitude: by their logarithm.
    let positive = || {
        values
            .iter()
            .flatten()
            .copied()
            .filter(|value| *value > 0.0)
    };
    let lowest = positive().fold(1.0, f64::min);
    let highest = positive().fold(lowest, f64::max);
    let range = if is_recovery {
        (0.0, 1.0)
    } else {
        (nice_floor(lowest), nice_ceiling(highest))
    };
    let grid = Grid::new(material);
    let figure = HeatMap {
        title: String::new(),
        row_factors: grid.rows.clone(),
        column_factors: grid.columns.clone(),
        values: grid
            .cell_at
            .iter()
            .map(|cell| cell.and_then(|cell| values[cell]))
            .collect(),
        texts: grid
            .cell_at
            .iter()
            .map(|cell| cell.map_or_else(String::new, text))
            .collect(),
        value_name: what.to_owned(),
        range,
        percent: true,
        is_log: !is_recovery,
        palette: if is_recovery {
            Palette::Viridis
        } else {
            Palette::Cividis
        },
        // Words on every tile of two maps would take a browser more than a second.
        hovers: if cells.len() <= MOST_IN_EACH {
            grid.hovers(material)
        } else {
            Vec::new()
        },
        marked: grid.marked(material),
        ..HeatMap::default()
    };
    let (width, height) = grid.size_px();
    Some(Figure {
        file: format!("figures/{file}"),
        caption: match material.sweep.design {
            Design::Grid(_) if is_recovery => format!(
                "{what} of every cell, with its 95 % interval and the worlds its chains have converged on; factors \
                 nested, the outermost matter most.{}",
                level_key(&material.sweep.factors)
            ),
            Design::Grid(_) => format!(
                "{what} of every cell, coloured by its logarithm; factors nested, the outermost matter most.{}",
                level_key(&material.sweep.factors)
            ),
            _ if is_recovery => format!(
                "{what} of every cell, with its 95 % interval and the worlds its chains have converged on."
            ),
            _ => format!("{what} of every cell, coloured by its logarithm."),
        },
        scene: figure.page(width, height),
    })
}

/// What became of every cell: its worlds by verdict, side by side in its tile. Verdicts that no world
/// has stand in the key with a 0.
pub(in crate::report) fn run_status(material: Material<'_>) -> Figure {
    let cells = &material.results.cells;
    let grid = Grid::new(material);
    let count = |verdict: Verdict| cells.iter().map(|c| c.worlds.n(verdict)).sum::<usize>();
    let n_cells = |verdict: CellVerdict| cells.iter().filter(|c| c.verdict == verdict).count();
    let knows_truth = count(Verdict::ConvergedTruthUnknown) == 0;
    let is_shown = |verdict: &Verdict| match verdict {
        // On data of known truth no world can have this verdict, and the other way round.
        Verdict::ConvergedTruthUnknown => !knows_truth,
        _ => true,
    };
    let shown: Vec<Verdict> = Verdict::ALL.into_iter().filter(is_shown).collect();
    let category = |verdict: &Verdict| HeatCategory {
        name: format!(
            "{}: {}, {}",
            verdict.words(),
            words::counted(count(*verdict), "world"),
            words::counted(n_cells((*verdict).into()), "cell")
        ),
        colour: verdict_colour(*verdict),
    };
    // No world is undecided, so no tile has a part of that; the key says how many cells are.
    let undecided = HeatCategory {
        name: format!(
            "{}: {}",
            CellVerdict::Undecided.words(),
            words::counted(n_cells(CellVerdict::Undecided), "cell")
        ),
        colour: verdict_colour(CellVerdict::Undecided),
    };
    let place = |verdict: CellVerdict| {
        let place = shown.iter().position(|known| verdict == (*known).into());
        place.unwrap_or(shown.len())
    };
    let parts = |cell: usize| -> Vec<f64> {
        let n_worlds = |verdict: &Verdict| cells[cell].worlds.n(*verdict) as f64;
        shown.iter().map(n_worlds).chain([0.0]).collect()
    };
    let categories = shown.iter().map(category).chain([undecided]).collect();
    let of_cell = |cell: usize| (place(cells[cell].verdict), parts(cell));
    let mut figure = grid.tiles(categories, of_cell);
    figure.hovers = grid.hovers(material);
    figure.marked = grid.marked(material);
    let (n_failed, n_missing) = (
        cells.iter().map(|cell| cell.n_failed).sum(),
        cells.iter().map(|cell| cell.n_missing).sum(),
    );
    let (width, height) = grid.size_px();
    Figure {
        file: "figures/run-status".to_owned(),
        caption: format!(
            "What became of every cell: its worlds by verdict, side by side in its tile. The key counts the worlds of all \
             cells with each verdict, and the cells that have it as a whole. Recovered by luck: some chain found the truth, but \
             convergence is not shown. Undecided: too few worlds, or too many wrong maps, to rely on. Chains: {}.{}",
            words::missingness(n_failed, n_missing),
            match material.sweep.design {
                Design::Grid(_) => level_key(&material.sweep.factors),
                _ => String::new(),
            }
        ),
        scene: figure.page(width + 250, height),
    }
}

/// The heat map of all cells without its colours.
pub(super) struct Grid {
    rows: Vec<HeatFactor>,
    columns: Vec<HeatFactor>,
    /// The cell at each place, row by row.
    cell_at: Vec<Option<usize>>,
    n_columns: usize,
}

impl Grid {
    pub(super) fn new(material: Material<'_>) -> Self {
        let (rows, columns) = layout(material);
        let places = places(&rows, &columns);
        let cell_of = coordinates(material);
        let n_levels = |side: &HeatFactor| side.levels.len();
        Self {
            cell_at: places
                .iter()
                .map(|place| cell_of.get(place).copied())
                .collect(),
            n_columns: columns.iter().map(n_levels).product::<usize>().max(1),
            rows,
            columns,
        }
    }

    /// Each cell a tile with the colour of its category and, side by side in it, how much of it is of each.
    pub(super) fn tiles(
        &self,
        categories: Vec<HeatCategory>,
        of_cell: impl Fn(usize) -> (usize, Vec<f64>),
    ) -> HeatMap {
        let at = |cell: &Option<usize>| Some(of_cell((*cell)?).0 as f64);
        let parts = |cell: &Option<usize>| cell.map_or_else(Vec::new, |cell| of_cell(cell).1);
        HeatMap {
            title: String::new(),
            row_factors: self.rows.clone(),
            column_factors: self.columns.clone(),
            values: self.cell_at.iter().map(at).collect(),
            texts: Vec::new(),
            value_name: String::new(),
            range: (0.0, 1.0),
            percent: false,
            is_log: false,
            palette: Palette::Viridis,
            categories,
            parts: self.cell_at.iter().map(parts).collect(),
            ..HeatMap::default()
        }
    }

    /// What each tile says under a pointer, with the page that a click leads to.
    pub(super) fn hovers(&self, material: Material<'_>) -> Vec<Option<Hover>> {
        let of_cell = |cell: usize| Hover {
            text: words::tile(material, cell),
            href: Some(cell_file(material, cell)),
        };
        self.cell_at.iter().map(|cell| cell.map(of_cell)).collect()
    }

    /// The place of the cell to use.
    fn marked(&self, material: Material<'_>) -> Option<(usize, String)> {
        let cell = material.results.recommended()?.cell;
        let place = self.cell_at.iter().position(|own| *own == Some(cell))?;
        Some((
            place,
            format!("to use: {}", material.sweep.cells[cell].title()),
        ))
    }

    /// A page that suits it.
    pub(super) fn size_px(&self) -> (u32, u32) {
        let n_rows = self.cell_at.len() / self.n_columns;
        let (width, height) = (900 + 60 * self.n_columns as u32, 420 + 44 * n_rows as u32);
        (width.clamp(1400, 2600), height.clamp(700, 2400))
    }
}

/// The next of 1, 2 and 5 times the powers of ten at or below a share above 0.
fn nice_floor(share: f64) -> f64 {
    let decade = 10f64.powf(share.log10().floor());
    let digits = [5.0, 2.0, 1.0].map(|digit| digit * decade);
    let fits = |value: &f64| *value <= share * (1.0 + 1e-9);
    digits.into_iter().find(fits).unwrap_or(decade)
}

/// The next of them at or above it.
fn nice_ceiling(share: f64) -> f64 {
    let decade = 10f64.powf(share.log10().floor());
    let digits = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade);
    let fits = |value: &f64| *value >= share * (1.0 - 1e-9);
    digits.into_iter().find(fits).unwrap_or(1.0)
}

/// Rows and columns of the heat map of all cells, outer to inner: for a grid the strongest factors
/// outermost, alternating between the sides; otherwise labels by variants.
fn layout(material: Material<'_>) -> (Vec<HeatFactor>, Vec<HeatFactor>) {
    if let Design::Grid(_) = material.sweep.design {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (k, factor) in order_of_factors(material).into_iter().enumerate() {
            let factor = &material.sweep.factors[factor];
            let side = HeatFactor {
                name: words::axis_name(factor.key),
                levels: level_names(factor),
            };
            if k % 2 == 0 {
                columns.push(side)
            } else {
                rows.push(side)
            }
        }
        return (rows, columns);
    }
    if let Design::Sampled(design) = &material.sweep.design {
        return blocks(design, material.sweep.cells.len());
    }
    let (labels, variants) = labels_and_variants(material);
    let rows = HeatFactor {
        name: "Cell".to_owned(),
        levels: labels,
    };
    let columns = HeatFactor {
        name: String::new(),
        levels: variants,
    };
    (vec![rows], vec![columns])
}

/// Points side by side: those of a trajectory or base point in a row, plain points eight in a row.
fn blocks(design: &SampledDesign, n_cells: usize) -> (Vec<HeatFactor>, Vec<HeatFactor>) {
    let width = row_width(design);
    let name = match design.sampling {
        Sampling::Morris => "trajectory",
        Sampling::SobolIndices => "base point",
        Sampling::LatinHypercube | Sampling::Sobol => "points from",
    };
    let row = |k: usize| match design.n_each() {
        1 => format!("{}", k * width + 1),
        _ => format!("{}", k + 1),
    };
    let side = |name: &str, levels: Vec<String>| HeatFactor {
        name: name.to_owned(),
        levels,
    };
    (
        vec![side(name, (0..n_cells.div_ceil(width)).map(row).collect())],
        vec![side("", (1..=width).map(|k| k.to_string()).collect())],
    )
}

fn row_width(design: &SampledDesign) -> usize {
    match design.n_each() {
        1 => 8,
        n => n,
    }
}

fn labels_and_variants(material: Material<'_>) -> (Vec<String>, Vec<String>) {
    let (mut labels, mut variants) = (Vec::new(), Vec::new());
    for cell in &material.sweep.cells {
        let label = if cell.label.is_empty() {
            cell.id.clone()
        } else {
            cell.label.clone()
        };
        if !labels.contains(&label) {
            labels.push(label);
        }
        if !variants.contains(&cell.variant) {
            variants.push(cell.variant.clone());
        }
    }
    (labels, variants)
}

pub(super) fn order_of_factors(material: Material<'_>) -> Vec<usize> {
    let mut order: Vec<usize> = material
        .results
        .effects
        .iter()
        .map(|effect| effect.factor)
        .collect();
    order.extend(
        (0..material.sweep.factors.len())
            .filter(|f| !order.contains(f))
            .collect::<Vec<_>>(),
    );
    order
}

/// Every cell by its levels: along the rows, then along the columns.
fn coordinates(material: Material<'_>) -> HashMap<Vec<usize>, usize> {
    let sweep = material.sweep;
    let place = |names: &[String], name: &String| {
        names
            .iter()
            .position(|known| known == name)
            .expect("a name that was collected")
    };
    if let Design::Sampled(design) = &sweep.design {
        let width = row_width(design);
        let cells = 0..sweep.cells.len();
        return cells
            .map(|cell| (vec![cell / width, cell % width], cell))
            .collect();
    }
    if !matches!(sweep.design, Design::Grid(_)) {
        let (labels, variants) = labels_and_variants(material);
        let of_cell = |cell: &Cell| {
            let label = if cell.label.is_empty() {
                &cell.id
            } else {
                &cell.label
            };
            vec![place(&labels, label), place(&variants, &cell.variant)]
        };
        return sweep.cells.iter().map(of_cell).zip(0..).collect();
    }
    let order = order_of_factors(material);
    let level = |cell: &Cell, factor: usize| {
        let factor = &sweep.factors[factor];
        let value = cell.settings.get(factor.key.name);
        factor
            .levels
            .iter()
            .position(|level| level == value)
            .expect("a level of the factor")
    };
    let of_cell = |cell: &Cell| -> Vec<usize> {
        let (columns, rows) = (order.iter().step_by(2), order.iter().skip(1).step_by(2));
        rows.chain(columns)
            .map(|&factor| level(cell, factor))
            .collect()
    };
    sweep.cells.iter().map(of_cell).zip(0..).collect()
}

/// Levels of every place of the heat map, row by row.
fn places(rows: &[HeatFactor], columns: &[HeatFactor]) -> Vec<Vec<usize>> {
    let mut places = vec![Vec::new()];
    for side in rows.iter().chain(columns) {
        let extended = places.iter().flat_map(|place: &Vec<usize>| {
            (0..side.levels.len()).map(|level| [place.as_slice(), &[level]].concat())
        });
        places = extended.collect();
    }
    places
}
