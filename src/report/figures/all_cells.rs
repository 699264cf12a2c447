//! Every cell of the sweep in one heat map.

use std::collections::HashMap;

use super::super::{Figure, Material, words};
use super::level_names;
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::style::Palette;
use crate::results::CellResult;
use crate::sweep::{Cell, Design};

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
        (true, _) => words::rate(cells[cell].recovery).replacen(" [", "\n[", 1),
        (false, value) => words::percent(value),
    };
    let highest = values.iter().flatten().copied().fold(0.0, f64::max);
    let range = (
        0.0,
        if is_recovery {
            1.0
        } else {
            nice_ceiling(highest)
        },
    );
    let (rows, columns) = layout(material);
    let side = |factors: &[Side]| -> Vec<HeatFactor> {
        factors
            .iter()
            .map(|s| HeatFactor {
                name: s.name.clone(),
                levels: s.levels.clone(),
            })
            .collect()
    };
    let places = places(&rows, &columns);
    let cell_of = coordinates(material);
    let cell_at: Vec<Option<usize>> = places
        .iter()
        .map(|place| cell_of.get(place).copied())
        .collect();
    let n_columns: usize = columns
        .iter()
        .map(|s| s.levels.len())
        .product::<usize>()
        .max(1);
    let n_rows = places.len() / n_columns;
    let figure = HeatMap {
        title: String::new(),
        row_factors: side(&rows),
        column_factors: side(&columns),
        values: cell_at
            .iter()
            .map(|cell| cell.and_then(|cell| values[cell]))
            .collect(),
        texts: cell_at
            .iter()
            .map(|cell| cell.map_or_else(String::new, text))
            .collect(),
        value_name: what.to_owned(),
        range,
        percent: true,
        palette: if is_recovery {
            Palette::Viridis
        } else {
            Palette::Cividis
        },
    };
    let (width, height) = (900 + 60 * n_columns as u32, 420 + 44 * n_rows as u32);
    Some(Figure {
        file: format!("figures/{file}.png"),
        caption: match material.sweep.design {
            Design::Grid(_) => {
                format!("{what} of every cell; factors nested, the outermost matter most.")
            }
            _ => format!("{what} of every cell."),
        },
        png: figure.png(width.clamp(1400, 2600), height.clamp(700, 2400)),
    })
}

/// The next of 0.01, 0.02, 0.05, 0.1, … at or above a share.
fn nice_ceiling(share: f64) -> f64 {
    [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
        .into_iter()
        .find(|&ceiling| share <= ceiling)
        .unwrap_or(1.0)
}

/// One factor of one side of the heat map of all cells.
struct Side {
    name: String,
    levels: Vec<String>,
}

/// Rows and columns of the heat map of all cells, outer to inner: for a grid the strongest factors
/// outermost, alternating between the sides; otherwise labels by variants.
fn layout(material: Material<'_>) -> (Vec<Side>, Vec<Side>) {
    if let Design::Grid(_) = material.sweep.design {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (k, factor) in order_of_factors(material).into_iter().enumerate() {
            let factor = &material.sweep.factors[factor];
            let side = Side {
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
    let (labels, variants) = labels_and_variants(material);
    let rows = Side {
        name: "Cell".to_owned(),
        levels: labels,
    };
    let columns = Side {
        name: String::new(),
        levels: variants,
    };
    (vec![rows], vec![columns])
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

fn order_of_factors(material: Material<'_>) -> Vec<usize> {
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
fn places(rows: &[Side], columns: &[Side]) -> Vec<Vec<usize>> {
    let mut places = vec![Vec::new()];
    for side in rows.iter().chain(columns) {
        let extended = places.iter().flat_map(|place: &Vec<usize>| {
            (0..side.levels.len()).map(|level| [place.as_slice(), &[level]].concat())
        });
        places = extended.collect();
    }
    places
}
