//! The page of wall-clock times: the one page that differs from run to run.

use std::collections::HashMap;
use std::path::Path;

use super::pages::cell_file;
use super::section::{Block, Entry, Section, Table};
use super::{Material, ReportError, figures, html, put, words};
use crate::results::timing::{CellCost, cell_costs};

/// Cells in the table; all are in the figure.
const N_ROWS: usize = 50;

/// Writes `timing.html` and its figure, from the seconds of chains by their keys.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_timing(
    folder: &Path,
    material: Material<'_>,
    seconds: &HashMap<String, f64>,
) -> Result<(), ReportError> {
    let costs = cell_costs(material.results, seconds);
    let figure = figures::ess_against_cost(&costs);
    if let Some(figure) = &figure {
        figure.write(folder)?;
    }
    let n_timed = (material.results.chains.iter())
        .filter(|chain| seconds.contains_key(&chain.key))
        .count();
    let text = if n_timed == 0 {
        "No times are known: the chains were run elsewhere, or their times are lost.".to_owned()
    } else {
        format!(
            "Wall-clock times of {n_timed} of {} chains, on the machine that run.json names. They differ from run to run, so \
             nothing else in the report depends on them.",
            material.results.chains.len()
        )
    };
    let mut blocks = vec![Block::Text(text)];
    blocks.extend(figure.map(Block::from));
    if n_timed > 0 {
        blocks.push(Block::Table(most_per_second(material, &costs)));
    }
    let part = Section {
        id: "timing",
        title: "Effective draws per second".to_owned(),
        blocks,
    };
    let page = html::part_page("What it cost", &material.sweep.title, &[part]);
    put(&folder.join("timing.html"), page.as_bytes())
}

/// The cells with the most effective draws per second.
fn most_per_second(material: Material<'_>, costs: &[CellCost]) -> Table {
    let mut order: Vec<&CellCost> = costs.iter().collect();
    let ess = |cost: &CellCost| cost.ess_per_second.unwrap_or(-1.0);
    order.sort_by(|a, b| ess(b).total_cmp(&ess(a)).then(a.cell.cmp(&b.cell)));
    let row = |cost: &&CellCost| {
        let cell = &material.sweep.cells[cost.cell];
        vec![
            Entry::link(cell.title(), cell_file(material, cost.cell)),
            cost.verdict.words().into(),
            words::number(cost.seconds_per_chain, 4).into(),
            words::number(cost.ess_per_second, 0).into(),
            format!(
                "{} of {}",
                cost.n_measured, material.results.cells[cost.cell].n_worlds
            )
            .into(),
        ]
    };
    Table {
        head: [
            "cell",
            "verdict",
            "seconds per chain",
            "effective draws per second",
            "worlds measured",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: order.iter().take(N_ROWS).map(row).collect(),
    }
}
