//! The page of wall-clock times: the one page that differs from run to run.

use std::collections::HashMap;
use std::path::Path;

use super::pages::cell_file;
use super::section::{Block, Entry, Section, Table};
use super::{Material, ReportError, figures, html, put, words};
use crate::diagnostics::student::UnitMean;
use crate::results::timing::{CellCost, LevelRate, cell_costs, rates_by_level};
use crate::results::verdicts_by_level;
use crate::sweep::Design;

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
    let mut parts = vec![Section {
        id: "timing".into(),
        title: "Effective draws per second".to_owned(),
        blocks,
    }];
    if n_timed > 0 {
        let factors = 0..material.sweep.factors.len();
        for part in factors.filter_map(|factor| by_level(material, seconds, factor)) {
            if let Some(figure) = part.figures().next() {
                figure.write(folder)?;
            }
            parts.push(part);
        }
    }
    let page = html::part_page("What it cost", &material.sweep.title, &parts);
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
            material.results.cells[cost.cell].verdict_words().into(),
            words::number(cost.seconds_per_chain, 4).into(),
            words::number(cost.ess_per_second, 0).into(),
            format!(
                "{} of {}",
                cost.n_measured,
                material.results.cells[cost.cell].worlds.n_all()
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

/// Which level of a factor gives most per second; `None` without levels that could be compared.
fn by_level(
    material: Material<'_>,
    seconds: &HashMap<String, f64>,
    factor_ix: usize,
) -> Option<Section> {
    let sweep = material.sweep;
    if matches!(sweep.design, Design::List(_) | Design::Sampled(_)) {
        return None;
    }
    let (rates, best) = rates_by_level(sweep, material.results, seconds, factor_ix);
    let factor = &sweep.factors[factor_ix];
    let (best, winner) = best.and_then(|best| Some((best, rates[best]?)))?;
    let unit = if sweep.has_many_worlds() {
        "worlds"
    } else {
        "the one data set, which shows no spread"
    };
    let text = format!(
        "Most effective draws per second, by the slower of M and ln target: {} {}, {}. {} Intervals are 95 %, Student over {unit}; \
         a chain that has no effective draw counts as 0. Each chain's ESS is its own: a mix that is stuck may look fast, so the \
         share of worlds that converged stands beside it.",
        factor.key.label(),
        words::level(&factor.levels[best]),
        with_interval(&winner.slower),
        next_behind(&rates),
    );
    let verdicts = verdicts_by_level(sweep, &material.results.cells, factor_ix);
    let row = |(ix, rate): (usize, &Option<LevelRate>)| {
        let name = words::level(&factor.levels[ix]);
        let name = if ix == best {
            Entry::strong(name)
        } else {
            name.into()
        };
        let of = |what: fn(&LevelRate) -> &UnitMean| {
            let words = rate.as_ref().map(|rate| with_interval(what(rate)));
            words.unwrap_or_else(words::dash).into()
        };
        let times = rate.as_ref().and_then(|rate| rate.ln_behind_best.as_ref());
        let without = rate.as_ref().map_or_else(words::dash, |rate| {
            format!("{} of {}", rate.n_without, rate.n_chains)
        });
        let (n_judged, n_converged) = (verdicts[ix].n_judged(), verdicts[ix].n_converged());
        vec![
            name,
            of(|rate| &rate.n_sets),
            of(|rate| &rate.ln_target),
            times.map_or_else(words::dash, times_words).into(),
            without.into(),
            format!("{n_converged} of {n_judged}").into(),
        ]
    };
    let table = Table {
        head: [
            factor.key.label(),
            "effective draws of M per second",
            "of ln target per second",
            "the best over it, by the slower",
            "chains without",
            "worlds converged",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: rates.iter().enumerate().map(row).collect(),
    };
    let mut blocks = vec![Block::Text(text)];
    blocks.extend(figures::ess_by_level(material, factor_ix, &rates).map(Block::from));
    blocks.push(Block::Table(table));
    Some(Section {
        id: "by-level".into(),
        title: format!("By {}", factor.key.label()),
        blocks,
    })
}

/// "1,234 [1,100, 1,400]".
fn with_interval(found: &UnitMean) -> String {
    let round = |value: f64| words::number(Some(value), 0);
    match found.interval {
        Some(interval) => format!(
            "{} [{}, {}]",
            round(found.mean),
            round(interval.low.max(0.0)),
            round(interval.high)
        ),
        None => round(found.mean),
    }
}

/// "1.8 [1.5, 2.2] times".
fn times_words(ln: &UnitMean) -> String {
    let times = |ln: f64| format!("{:.2}", ln.exp());
    match ln.interval {
        Some(interval) => format!(
            "{} [{}, {}] times",
            times(ln.mean),
            times(interval.low),
            times(interval.high)
        ),
        None => format!("{} times", times(ln.mean)),
    }
}

/// How far the next best is behind, and whether that is more than chance.
fn next_behind(rates: &[Option<LevelRate>]) -> String {
    let behind = rates
        .iter()
        .flatten()
        .filter_map(|rate| rate.ln_behind_best);
    let Some(next) = behind.min_by(|a, b| a.mean.total_cmp(&b.mean)) else {
        return String::new();
    };
    let sure = next.interval.is_some_and(|interval| interval.low > 0.0);
    format!(
        "In the mean over worlds that is {} as much as the next{}.",
        times_words(&next),
        if sure { "" } else { ", which may be chance" }
    )
}
