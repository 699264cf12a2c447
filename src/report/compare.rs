//! The page of `ptm compare`: two or more sweeps, each against the first.
//!
//! For each pair a question, its answer, the map of differences over the settings that vary, and
//! the paired differences by setting and level.

use std::collections::BTreeMap;

use super::section::{Block, Entry, Section, Table};
use super::{Figure, html, words};
use crate::figure::effects::Interval;
use crate::figure::factor_indices::{FactorIndices, IndexPanel, IndexRow};
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::scene::Hover;
use crate::figure::style::Palette;
use crate::results::compare::{CellComparison, Comparison, Difference, Measure, level_order};
use crate::settings::KEYS;

/// Cells named in the table at most.
const MOST_CELLS: usize = 30;

/// Two sweeps compared, with their names.
pub struct Compared<'a> {
    /// The folder of A.
    pub a: String,
    /// The folder of B.
    pub b: String,
    /// What was found.
    pub found: &'a Comparison,
}

/// The page, one file with its figures in it.
pub fn compare_page(all: &[Compared<'_>]) -> String {
    let parts: Vec<Section> = all
        .iter()
        .enumerate()
        .flat_map(|(k, own)| part(k, own))
        .collect();
    html::compared_page("Sweeps compared", &parts)
}

fn part(place: usize, own: &Compared<'_>) -> Vec<Section> {
    let mut blocks: Vec<Block> = answer(own).into_iter().map(Block::Text).collect();
    blocks.extend(map(place, own).map(Block::from));
    blocks.extend(effects(place, own).map(Block::from));
    blocks.push(Block::Table(overall(own.found)));
    blocks.extend(cells(own.found).map(Block::Table));
    vec![Section {
        id: format!("compared-{}", place + 1).into(),
        title: format!("Does {} (B) differ from {} (A)?", own.b, own.a),
        blocks,
    }]
}

/// At most five sentences.
fn answer(own: &Compared<'_>) -> Vec<String> {
    let found = own.found;
    let [alone_a, alone_b] = found.n_alone;
    let alone = match (alone_a, alone_b) {
        (0, 0) => String::new(),
        _ => format!(
            "; {} only in A and {} only in B are left out",
            words::counted(alone_a, "cell"),
            words::counted(alone_b, "cell")
        ),
    };
    let mut sentences = vec![format!(
        "{} are compared on {} each, and {} gave the same in every chain{alone}.",
        words::counted(found.cells.len(), "cell"),
        words::counted(found.n_worlds, "world"),
        words::thousands(found.n_identical)
    )];
    let recovery = found
        .overall
        .iter()
        .find(|row| row.measure == Measure::Recovery);
    if let Some(row) = recovery {
        let p = row
            .p_adjusted
            .map_or_else(String::new, |p| format!(", {}", words::p_value(p)));
        let interval = row.interval.map_or_else(String::new, |(low, high)| {
            let (low, high) = (words::plain_points(low), words::plain_points(high));
            format!(" (95 % interval {low} to {high} points{p})")
        });
        sentences.push(if row.found {
            format!(
                "B changes the recovery rate by {} points over all cells, from {} to {}{interval}.",
                words::signed_points(row.difference),
                words::percent(Some(row.a)),
                words::percent(Some(row.b))
            )
        } else {
            format!(
                "Over all cells the recovery rates cannot be told apart: {} in A, {} in B{interval}.",
                words::percent(Some(row.a)),
                words::percent(Some(row.b))
            )
        });
    }
    let others: Vec<String> = (found.overall.iter())
        .filter(|row| row.measure != Measure::Recovery && row.found)
        .map(|row| {
            let [a, b, _] = numbers(row);
            format!("{} ({a} in A, {b} in B)", row.measure.words())
        })
        .collect();
    if !others.is_empty() {
        sentences.push(format!("They differ in {}.", others.join(", ")));
    }
    let n = |is: fn(&Difference) -> bool| {
        let differs = |cell: &&CellComparison| {
            let recovery = |row: &&Difference| row.measure == Measure::Recovery && row.found;
            cell.differences.iter().filter(recovery).any(is)
        };
        found.cells.iter().filter(differs).count()
    };
    let (better, worse) = (n(|row| row.difference > 0.0), n(|row| row.difference < 0.0));
    sentences.push(match (better, worse) {
        (0, 0) => "In no single cell is the recovery rate shown to differ.".to_owned(),
        _ => format!(
            "B recovers more often in {} and less often in {} by more than chance.",
            words::counted(better, "cell"),
            words::counted(worse, "cell")
        ),
    });
    let settings: Vec<String> = (found.settings_that_differ.iter())
        .map(|(name, [a, b])| format!("{name} ({a} in A, {b} in B)"))
        .collect();
    if !settings.is_empty() {
        sentences.push(format!("Their settings differ in {}.", settings.join("; ")));
    }
    sentences
}

/// A, B and B less A as a reader writes them.
fn numbers(row: &Difference) -> [String; 3] {
    if matches!(row.measure, Measure::Recovery | Measure::Acceptance) {
        let share = |x: f64| words::percent(Some(x));
        [
            share(row.a),
            share(row.b),
            words::signed_points(row.difference),
        ]
    } else {
        [row.a, row.b, row.difference].map(|x| format!("{x:.2}").replace('-', "−"))
    }
}

fn interval(row: &Difference) -> String {
    let Some((low, high)) = row.interval else {
        return words::dash();
    };
    if matches!(row.measure, Measure::Recovery | Measure::Acceptance) {
        format!(
            "{} to {}",
            words::plain_points(low),
            words::plain_points(high)
        )
    } else {
        format!("{low:.2} to {high:.2}").replace('-', "−")
    }
}

fn overall(found: &Comparison) -> Table {
    let row = |own: &Difference| {
        let [a, b, difference] = numbers(own);
        let name = own.measure.words();
        vec![
            if own.found {
                Entry::strong(name)
            } else {
                name.into()
            },
            a.into(),
            b.into(),
            difference.into(),
            interval(own).into(),
            own.p_adjusted
                .map_or_else(words::dash, words::p_value)
                .into(),
        ]
    };
    Table {
        head: [
            "over all cells",
            "A",
            "B",
            "B less A",
            "95 % interval",
            "p (Holm)",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: found.overall.iter().map(row).collect(),
    }
}

/// Single cells that differ, the clearest first.
fn cells(found: &Comparison) -> Option<Table> {
    let mut single: Vec<(&CellComparison, &Difference)> = (found.cells.iter())
        .flat_map(|cell| cell.differences.iter().map(move |row| (cell, row)))
        .filter(|(_, row)| row.found)
        .collect();
    let p = |row: &Difference| row.p_adjusted.unwrap_or(1.0);
    single.sort_by(|a, b| p(a.1).total_cmp(&p(b.1)));
    let row = |(cell, own): &(&CellComparison, &Difference)| {
        let [a, b, difference] = numbers(own);
        vec![
            cell.a.as_str().into(),
            cell.b.as_str().into(),
            settings(cell).into(),
            own.measure.words().into(),
            a.into(),
            b.into(),
            difference.into(),
            own.p_adjusted
                .map_or_else(words::dash, words::p_value)
                .into(),
        ]
    };
    let head = [
        "cell of A",
        "cell of B",
        "settings",
        "differs in",
        "A",
        "B",
        "B less A",
        "p (Benjamini & Hochberg)",
    ];
    (!single.is_empty()).then(|| Table {
        head: head.map(str::to_owned).to_vec(),
        rows: single.iter().take(MOST_CELLS).map(row).collect(),
    })
}

fn settings(cell: &CellComparison) -> String {
    let parts = cell
        .settings
        .iter()
        .map(|(name, value)| format!("{name} {}", plain(value)));
    parts.collect::<Vec<_>>().join(", ")
}

/// The difference of the recovery rates of every cell, over the settings that vary.
fn map(place: usize, own: &Compared<'_>) -> Option<Figure> {
    let mut levels: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for cell in &own.found.cells {
        for (name, value) in &cell.settings {
            let known = levels.entry(name).or_default();
            if !known.contains(&value.as_str()) {
                known.push(value);
            }
        }
    }
    let mut factors: Vec<(&str, Vec<&str>)> = levels.into_iter().collect();
    factors.retain(|(_, levels)| levels.len() > 1);
    for (_, levels) in &mut factors {
        levels.sort_by(|a, b| level_order(a, b));
    }
    factors.sort_by_key(|(_, levels)| std::cmp::Reverse(levels.len()));
    let side = |first: usize| -> Vec<(&str, Vec<&str>)> {
        factors.iter().skip(first).step_by(2).cloned().collect()
    };
    let (columns, rows) = (side(0), side(1));
    let heat = |side: &[(&str, Vec<&str>)]| -> Vec<HeatFactor> {
        let factor = |(name, levels): &(&str, Vec<&str>)| HeatFactor {
            name: label(name),
            levels: levels.iter().map(|level| plain(level).to_owned()).collect(),
        };
        side.iter().map(factor).collect()
    };
    let place_of = |side: &[(&str, Vec<&str>)], cell: &CellComparison| {
        side.iter().try_fold(0, |place, (name, levels)| {
            let value = cell.settings.get(*name)?;
            let level = levels.iter().position(|level| level == value)?;
            Some(place * levels.len() + level)
        })
    };
    let size = |side: &[(&str, Vec<&str>)]| side.iter().map(|(_, l)| l.len()).product::<usize>();
    let (n_rows, n_columns) = (size(&rows), size(&columns));
    let n = n_rows * n_columns;
    let (mut values, mut texts) = (vec![None; n], vec![String::new(); n]);
    let mut hovers = vec![None; n];
    for cell in &own.found.cells {
        let at = place_of(&rows, cell)? * n_columns + place_of(&columns, cell)?;
        let recovery = cell
            .differences
            .iter()
            .find(|row| row.measure == Measure::Recovery);
        let Some(row) = recovery else { continue };
        let [a, b, difference] = numbers(row);
        values[at] = Some(row.difference);
        texts[at] = if row.found {
            format!("{difference} *")
        } else {
            difference.clone()
        };
        hovers[at] = Some(Hover {
            text: format!(
                "{} · A {a}, B {b}, B less A {difference} points [{}]{}",
                settings(cell),
                interval(row),
                if row.found { " · beyond chance" } else { "" }
            ),
            href: None,
        });
    }
    let largest = values
        .iter()
        .flatten()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    if factors.is_empty() || values.iter().all(Option::is_none) {
        return None;
    }
    let end = ((largest * 10.0).ceil() / 10.0).max(0.1);
    let figure = HeatMap {
        row_factors: heat(&rows),
        column_factors: heat(&columns),
        values,
        texts,
        value_name: "Recovery rate, B less A".to_owned(),
        range: (-end, end),
        percent: true,
        palette: Palette::RedBlue,
        hovers,
        ..HeatMap::default()
    };
    let width = (500 + 70 * n_columns as u32).clamp(1200, 2400);
    Some(Figure {
        file: format!("difference-map-{}", place + 1),
        caption: "The difference of the recovery rates, cell by cell, in points: blue where B \
                  recovers more often, red where A does. A star: beyond chance (5 %, Benjamini & \
                  Hochberg). Hatched: not in both sweeps."
            .to_owned(),
        scene: figure.page(width, (320 + 60 * n_rows as u32).clamp(560, 2400)),
    })
}

/// "10" for "10.0": tables write every number of a column alike.
fn plain(level: &str) -> &str {
    level.strip_suffix(".0").unwrap_or(level)
}

/// "radius D (m)" for penalty_radius.
fn label(name: &str) -> String {
    let key = KEYS.iter().find(|key| key.name == name);
    key.map_or_else(|| name.to_owned(), words::axis_name)
}

/// The paired differences over all cells and at each level of each setting.
fn effects(place: usize, own: &Compared<'_>) -> Option<Figure> {
    let found = own.found;
    let all = found
        .overall
        .iter()
        .find(|row| row.measure == Measure::Recovery)?;
    let row = |name: String, own: &Difference| IndexRow {
        name,
        marks: vec![Some(Interval {
            low: own.interval.map_or(own.difference, |(low, _)| low),
            estimate: own.difference,
            high: own.interval.map_or(own.difference, |(_, high)| high),
        })],
        noise: None,
    };
    let mut rows = vec![row("all cells".to_owned(), all)];
    rows.extend((found.by_level.iter()).map(|level| {
        let name = format!("{} {}", label(&level.setting), plain(&level.level));
        row(name, &level.difference)
    }));
    let ends = rows.iter().flat_map(|row| row.marks.iter().flatten());
    let end = ends.fold(0.1_f64, |most, own| {
        most.max(own.low.abs()).max(own.high.abs())
    });
    let n_rows = rows.len() as u32;
    let figure = FactorIndices {
        title: String::new(),
        marks: vec![format!(
            "B less A, with its 95 % interval over {}",
            found.units
        )],
        panels: vec![IndexPanel {
            name: "Recovery rate".to_owned(),
            remark: String::new(),
            rows,
            range: (-end, end),
        }],
        value_name: "B less A".to_owned(),
        percent: true,
    };
    Some(Figure {
        file: format!("paired-effects-{}", place + 1),
        caption: format!(
            "Paired differences of the recovery rate: taken on each of the {} and then averaged, \
             over all cells and at each level of each setting. Right of the line B recovers more.",
            found.units
        ),
        scene: figure.page(1400, 300 + 52 * n_rows),
    })
}
