//! The parts of the report between the answer and the table of cells, in the order of reading.

use super::section::{Block, Entry, Section, Table};
use super::{
    Figure, Material, comparisons, factors, faults, figures, knob, notes, sensitivity, words,
};
use crate::results::{CellVerdict, Verdict};
use crate::run::Stop;

/// All parts that have something to say; the answer's picture is not repeated.
pub(super) fn all(material: Material<'_>, answer: &Figure) -> Vec<Section> {
    let parts = [
        faults::section(material),
        comparisons(material),
        verdicts(material),
        which_knob(material),
        sensitivity::section(material),
        every_cell(material),
        chains(material),
        worlds(material),
    ];
    let mut parts: Vec<Section> = parts.into_iter().flatten().collect();
    for part in &mut parts {
        part.blocks
            .retain(|block| !matches!(block, Block::Figure(figure) if figure.file == answer.file));
    }
    parts.retain(|part| !part.blocks.is_empty());
    parts
}

fn comparisons(material: Material<'_>) -> Option<Section> {
    let comparisons = comparisons::comparisons(material);
    let head = [
        "setting",
        "remark",
        "as it should be",
        "as the faulty program computes it",
        "finding",
    ];
    let row = |c: &comparisons::Comparison| {
        vec![
            c.label.as_str().into(),
            c.note.as_str().into(),
            c.correct.as_str().into(),
            c.faulty.as_str().into(),
            Entry::strong(c.finding()),
        ]
    };
    let mut blocks = Vec::new();
    if !comparisons.is_empty() {
        blocks.push(Block::Table(Table {
            head: head.map(str::to_owned).to_vec(),
            rows: comparisons.iter().map(row).collect(),
        }));
    }
    blocks.extend(figures::side_by_side(material).map(Block::from));
    (!blocks.is_empty()).then(|| Section {
        id: "method".into(),
        title: "Which findings are the method’s".to_owned(),
        blocks,
    })
}

/// What became of every cell and world, zeros too.
fn verdicts(material: Material<'_>) -> Option<Section> {
    let results = material.results;
    let n_with = |verdict: Verdict| {
        let of = |cell: &crate::results::CellResult| cell.worlds.n(verdict);
        results.cells.iter().map(of).sum::<usize>()
    };
    let row = |verdict: CellVerdict| {
        let cells = results.cells.iter().filter(|cell| cell.verdict == verdict);
        let n_worlds = match verdict {
            CellVerdict::Of(verdict) => n_with(verdict).to_string(),
            // A word for cells alone.
            CellVerdict::Undecided => words::dash(),
        };
        vec![
            Entry::link(verdict.words(), "#what-now"),
            n_worlds.into(),
            cells.count().to_string().into(),
            super::advice::meaning(verdict).into(),
        ]
    };
    let unknown = CellVerdict::Of(Verdict::ConvergedTruthUnknown);
    let knows_truth = n_with(Verdict::ConvergedTruthUnknown) == 0;
    let is_shown = |verdict: &CellVerdict| *verdict != unknown || !knows_truth;
    let mut blocks = vec![
            Block::Text(
                "Every cell is judged world by world, and has the verdict that the most of its worlds have. A good verdict needs more: an \
                 exact test at 5 % must show that more than half of worlds like these are good (5 of 5, 7 of 8, 9 of 10, 15 of 20, 26 of 40), \
                 and of the worlds whose chains converged at most 1 in 20 may have a wrong map. Otherwise the cell is undecided. A recovery \
                 rate is worth as much as the share that converged."
                    .to_owned(),
            ),
            Block::Table(Table {
                head: ["verdict", "worlds, all cells together", "cells", "which means"]
                    .map(str::to_owned)
                    .to_vec(),
                rows: CellVerdict::ALL
                    .into_iter()
                    .filter(is_shown)
                    .map(row)
                    .collect(),
            }),
        ];
    blocks.insert(0, Block::Text(notes::verdicts(material)));
    blocks.extend(stopping(material).map(Block::Text));
    blocks.push(figures::run_status(material).into());
    Some(Section {
        id: "verdicts".into(),
        title: "Did the chains converge?".to_owned(),
        blocks,
    })
}

/// Cells that a sentence names.
const MOST_NAMED: usize = 12;

/// How far the stopping rule came, and which cells stopped before their rate was known as well as asked for.
fn stopping(material: Material<'_>) -> Option<String> {
    let (sweep, results) = (material.sweep, material.results);
    let rule = sweep.stopping()?;
    let of = |stop: Stop| -> Vec<String> {
        let cells = results.cells.iter().filter(|cell| cell.stop == Some(stop));
        cells.map(|cell| sweep.cells[cell.cell].title()).collect()
    };
    let mut text = format!(
        "Worlds were added to each cell until its recovery rate was known to ± {} (half of its 95 % interval), from {} \
         to at most {}: {} of {} got there; cells have {} worlds.",
        words::within(Some(rule.error)),
        sweep.n_replicates(),
        rule.most,
        of(Stop::Reached).len(),
        words::counted(results.cells.len(), "cell"),
        words::worlds_per_cell(&results.cells)
    );
    let others = [
        (Stop::AtCap, "Stopped at the cap before that"),
        (
            Stop::NoNewWorlds,
            "Stopped because more worlds would be the same again",
        ),
        (Stop::NoRate, "Stopped because no outcome is known"),
        (Stop::Unfinished, "Not finished yet"),
    ];
    for (stop, words) in others {
        let mut names = of(stop);
        let n = names.len();
        names.truncate(MOST_NAMED);
        if n > MOST_NAMED {
            names.push(format!("{} more", n - MOST_NAMED));
        }
        if n > 0 {
            text.push_str(&format!(" {words}: {}.", names.join(", ")));
        }
    }
    Some(text)
}

fn which_knob(material: Material<'_>) -> Option<Section> {
    let effects = &material.results.effects;
    let row = |effect: &crate::results::FactorEffect| {
        let factor = &material.sweep.factors[effect.factor];
        let best = factors::extreme(effect, f64::max).map(|rate| factors::at(factor, effect, rate));
        let worst =
            factors::extreme(effect, f64::min).map(|rate| factors::at(factor, effect, rate));
        vec![
            Entry::link(words::axis_name(factor.key), factors::file(factor)),
            words::points(effect.range).into(),
            knob::knob(material, effect.factor)
                .map_or_else(words::dash, |knob| words::p_value(knob.p_holm))
                .into(),
            best.unwrap_or_else(words::dash).into(),
            worst.unwrap_or_else(words::dash).into(),
        ]
    };
    let mut blocks = Vec::new();
    if !effects.is_empty() {
        blocks.push(Block::Table(Table {
            head: [
                "factor",
                "recovery rate changes by",
                "beyond chance? (Holm)",
                "highest",
                "lowest",
            ]
            .map(str::to_owned)
            .to_vec(),
            rows: effects.iter().map(row).collect(),
        }));
    }
    blocks.extend(figures::effects(material).map(Block::from));
    blocks.extend(figures::pair_recovery(material).map(Block::from));
    (!blocks.is_empty()).then(|| Section {
        id: "factors".into(),
        title: "Which knob matters?".to_owned(),
        blocks,
    })
}

fn every_cell(material: Material<'_>) -> Option<Section> {
    let blocks: Vec<Block> = figures::every_cell(material)
        .into_iter()
        .map(Block::from)
        .collect();
    (!blocks.is_empty()).then(|| Section {
        id: "maps".into(),
        title: "Every cell at a glance".to_owned(),
        blocks,
    })
}

fn chains(material: Material<'_>) -> Option<Section> {
    Some(Section {
        id: "chains".into(),
        title: "Does the start matter?".to_owned(),
        blocks: vec![figures::traces_by_init(material)?.into()],
    })
}

fn worlds(material: Material<'_>) -> Option<Section> {
    let blocks: Vec<Block> = figures::worlds(material)
        .into_iter()
        .map(Block::from)
        .collect();
    (!blocks.is_empty()).then(|| Section {
        id: "worlds".into(),
        title: "The data".to_owned(),
        blocks,
    })
}
