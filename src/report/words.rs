//! Numbers in words, the same in Markdown, HTML and captions.

use super::Material;
use crate::diagnostics::rate::Rate;
use crate::diagnostics::undefined::Undefined;
use crate::results::convergence::most_elsewhere;
use crate::results::{CellResult, Diagnosis};
use crate::run::Stop;
use crate::settings::{Key, Section, Value};
use crate::sweep::{Cell, Stopping, Sweep};

/// "42 %" with a space that does not break, or "–" for what is undefined.
pub fn percent(share: Option<f64>) -> String {
    share.map_or_else(dash, |share| {
        let value = share * 100.0;
        let digits = if value > 0.0 && value < 9.95 { 1 } else { 0 };
        format!("{value:.digits$}\u{a0}%").replace('-', "−")
    })
}

/// "60 points": a difference of two shares, in percentage points.
pub fn points(difference: f64) -> String {
    let value = difference * 100.0;
    let digits = if value > 0.0 && value < 9.95 { 1 } else { 0 };
    format!("{value:.digits$}\u{a0}points")
}

/// "60": a difference in points without the word, with the sign where it is negative.
pub fn plain_points(difference: f64) -> String {
    let value = difference * 100.0;
    let digits = if value != 0.0 && value.abs() < 9.5 && value.fract() != 0.0 {
        1
    } else {
        0
    };
    // Not "−0".
    format!("{:.digits$}", value + 0.0).replace('-', "−")
}

/// "+60", "−5": the same with either sign.
pub fn signed_points(difference: f64) -> String {
    let words = plain_points(difference);
    if words.starts_with('−') || words == "0" {
        words
    } else {
        format!("+{words}")
    }
}

/// "1,620": a count as people write it.
pub fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// "80 %, 95 % interval 38 to 96 %": for sentences.
pub fn rate_words(rate: Rate) -> String {
    format!(
        "{}, 95\u{a0}% interval {} to {}",
        percent(Some(rate.rate)),
        plain_points(rate.interval.low),
        percent(Some(rate.interval.high))
    )
}

/// "16.5 %": an error of a rate, with a digit that matters.
pub fn within(error: Option<f64>) -> String {
    error.map_or_else(dash, |error| format!("{:.1}\u{a0}%", 100.0 * error))
}

/// A number with so many digits after the point, or "–".
pub fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(dash, |value| format!("{value:.digits$}"))
}

/// What stands for the undefined.
pub fn dash() -> String {
    "–".to_owned()
}

/// "80 % [38 %, 96 %]".
pub fn rate(rate: Option<Rate>) -> String {
    let Some(rate) = rate else { return dash() };
    format!(
        "{} [{}, {}]",
        percent(Some(rate.rate)),
        percent(Some(rate.interval.low)),
        percent(Some(rate.interval.high))
    )
}

/// "3 of 5": worlds whose chains are shown to have converged, of those with chains: what a recovery
/// rate is worth.
pub fn gate(cell: &CellResult) -> String {
    format!(
        "{} of {}",
        cell.worlds.n_converged(),
        cell.worlds.n_judged()
    )
}

/// "p = 0.014", "p < 0.001".
pub fn p_value(p: f64) -> String {
    if p < 0.001 {
        "p\u{a0}<\u{a0}0.001".to_owned()
    } else {
        let digits = if p < 0.0995 { 3 } else { 2 };
        format!("p\u{a0}=\u{a0}{p:.digits$}")
    }
}

/// "0 failed, 0 missing": chains without an outcome, said even where there are none.
pub fn missingness(n_failed: usize, n_missing: usize) -> String {
    format!("{n_failed} failed, {n_missing} missing")
}

/// "12 worlds, its rate known to ± 9 %": where a cell stands under a stopping rule; `None` without one.
pub fn stopping(cell: &CellResult, rule: Option<Stopping>) -> Option<String> {
    let (stop, rule) = (cell.stop?, rule?);
    let worlds = counted(cell.n_replicates as usize, "world");
    let error = cell.recovery.map(|rate| rate.error());
    let known = format!(
        "its rate is known to ± {}, of ± {} asked for",
        within(error),
        within(Some(rule.error))
    );
    Some(match stop {
        Stop::Reached => format!("{worlds}; {known}"),
        Stop::AtCap => format!("stopped at the cap of {worlds}; {known}"),
        Stop::NoNewWorlds => {
            format!("stopped after {worlds} that are one and the same; {known}")
        }
        Stop::NoRate => format!("stopped after {worlds} without a known outcome"),
        Stop::Unfinished => format!("unfinished, {worlds} so far; {known}"),
    })
}

/// What a tile says under a pointer: the cell, its settings, its rate and its verdict.
pub(super) fn tile(material: Material<'_>, cell: usize) -> String {
    let (own, result) = (&material.sweep.cells[cell], &material.results.cells[cell]);
    let mut parts = vec![own.title()];
    let settings = differing(material.sweep, own);
    if !settings.is_empty() {
        parts.push(settings);
    }
    if result.recovery.is_some() {
        parts.push(format!("recovery {}", rate(result.recovery)));
    }
    parts.push(result.verdict_words());
    parts.join(" · ")
}

/// "5", or "5 to 40" where a stopping rule gave cells different numbers of worlds.
pub fn worlds_per_cell(cells: &[CellResult]) -> String {
    let counts = || cells.iter().map(|cell| cell.n_replicates);
    match (counts().min().unwrap_or(0), counts().max().unwrap_or(0)) {
        (least, most) if least == most => most.to_string(),
        (least, most) => format!("{least} to {most}"),
    }
}

/// "1.004", or in a word why there is none.
pub fn measured(value: Result<f64, Undefined>, digits: usize) -> String {
    value.map_or_else(
        |reason| reason.name().to_owned(),
        |value| format!("{value:.digits$}"),
    )
}

/// "0.012 (≤ 0.015)": a distance, and what a correct chain stays below.
pub fn distance(distance: Option<f64>, high: Option<f64>) -> String {
    match (distance, high) {
        (Some(distance), Some(high)) => format!("{distance:.3} (≤\u{a0}{high:.3})"),
        (Some(distance), None) => format!("{distance:.3} (?)"),
        (None, _) => dash(),
    }
}

/// How the intervals of a sweep's rates were had: a sentence with every kind that occurs, or nothing
/// where no rate is known.
pub fn interval_kinds(cells: &[CellResult]) -> String {
    let mut kinds: Vec<&str> = cells
        .iter()
        .filter_map(|cell| cell.recovery)
        .map(|rate| rate.kind.words())
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    if kinds.is_empty() {
        return String::new();
    }
    format!(" Intervals are 95 %: {}.", kinds.join("; "))
}

/// "σₒ (m)".
pub fn axis_name(key: &Key) -> String {
    if key.unit.is_empty() {
        key.label().to_owned()
    } else {
        format!("{} ({})", key.label(), key.unit)
    }
}

/// A value as a figure writes it.
pub fn level(value: &Value) -> String {
    value.to_string()
}

/// What of a cell's settings differs within the sweep: "σₒ 1 m, radius D 10 m".
pub fn differing(sweep: &Sweep, cell: &Cell) -> String {
    let parts = sweep
        .factors
        .iter()
        .map(|factor| with_unit(factor.key, cell.settings.get(factor.key.name)));
    parts.collect::<Vec<_>>().join(", ")
}

/// The settings of model and sampler, in one line: what a figure's reader wants to know.
pub fn settings_line(cell: &Cell) -> String {
    let wanted = [
        "sigma_o",
        "sigma_t",
        "penalty_radius",
        "penalty_height",
        "importance_samples",
        "init",
    ];
    let parts = cell.settings.iter().filter(|(key, value)| {
        let differs = **value != (key.default)();
        let names_chain = matches!(key.section, Section::Model | Section::Sampler);
        let is_wanted = wanted.contains(&key.name) && !cell.settings.is_idle(key.name);
        is_wanted || (differs && (names_chain || key.name == "noise"))
    });
    parts
        .map(|(key, value)| with_unit(key, value))
        .collect::<Vec<_>>()
        .join(", ")
}

fn with_unit(key: &Key, value: &Value) -> String {
    format!("{} {}", key.label(), with_unit_of(key, &value.to_string()))
}

/// "10 m": a value with the unit of its setting, on one line.
pub fn with_unit_of(key: &Key, value: &str) -> String {
    match key.unit {
        "" => value.to_owned(),
        unit => format!("{value}\u{a0}{unit}"),
    }
}

/// "1 chain", "2 chains".
pub fn counted(n: usize, what: &str) -> String {
    if n == 1 {
        format!("1 {what}")
    } else {
        format!("{} {what}s", thousands(n))
    }
}

/// What the starts of converged chains can show of other modes.
pub fn starts(found: &Diagnosis) -> String {
    let (n_initial, probes) = (found.n_initial_topologies, found.probes);
    let starts = match n_initial {
        1 => "all chains started at one topology".to_owned(),
        n => format!("the chains started at {n} topologies"),
    };
    let probed = match probes.n {
        0 => "no probe was sent out".to_owned(),
        n => format!(
            "{} of {n} probes from random starts came to the same place",
            probes.n_came
        ),
    };
    let most = 100.0 * most_elsewhere(found.n_starts_that_ended_here());
    format!("{starts}, {probed}: by chance up to {most:.0} % of starts could end elsewhere")
}
