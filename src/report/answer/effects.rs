//! Which settings change the outcome, as far as the test upholds it.

use super::{Finding, knows_truth, list, listed, measured};
use crate::report::{Material, words};
use crate::results::sensitivity::{Contrast, Response, Sensitivity};
use crate::results::told_apart::LEVEL;

/// Effects that are written out with size and interval.
const MOST_NAMED: usize = 3;
/// A partner that changes an effect by less than this is left to the figures.
const CLEAR_DEPENDENCE: f64 = 0.3;

/// The response that a headline is about.
pub(in crate::report) fn headline_response(material: Material<'_>) -> Response {
    if knows_truth(material) {
        Response::Recovery
    } else {
        Response::Converged
    }
}

/// The sentence; `None` where nothing was compared.
pub(super) fn finding(material: Material<'_>) -> Option<Finding> {
    let found = &material.results.sensitivity;
    let response = headline_response(material);
    let what = measured(knows_truth(material));
    let all = found.strongest(response);
    let largest = all.first()?;
    let clear = found.upheld(response);
    let text = if largest.estimate?.mean == 0.0 {
        let rate = found.levels.iter().find(|row| row.response == response);
        let rate = rate.and_then(|row| row.estimate).map(|own| own.mean);
        format!(
            "No setting changes {what}: the rate is {} at every level of every setting.",
            words::percent(rate)
        )
    } else if clear.is_empty() {
        format!(
            "No setting is shown to change {what} (5\u{a0}% level, Holm-corrected); the largest change \
             seen is {}{}{}{}.",
            size(found, largest, false),
            test(found, largest),
            more_units(found, response, largest),
            single_cells(material).unwrap_or_default()
        )
    } else {
        some(found, response, what, &clear, all.len())
    };
    Some(Finding::new("What matters", text))
}

/// Single settings that do worse than the best where no factor does: "; but c004 (…) recovers 0 %".
fn single_cells(material: Material<'_>) -> Option<String> {
    let best = material.results.recommended()?.cell;
    let worse = list::worse_than(material, best);
    if worse.is_empty() || worse.len() > MOST_NAMED {
        return None;
    }
    let name = |cell: &usize| {
        let own = &material.sweep.cells[*cell];
        let rate = material.results.cells[*cell].recovery.map(|rate| rate.rate);
        let settings = words::differing(material.sweep, own);
        format!(
            "{} ({settings}) recovers {}",
            own.title(),
            words::percent(rate)
        )
    };
    let names: Vec<String> = worse.iter().map(name).collect();
    let best = &material.sweep.cells[best];
    Some(format!(
        "; but {}, less than {} by more than chance",
        listed(&names),
        best.title()
    ))
}

fn some(
    found: &Sensitivity,
    response: Response,
    what: &str,
    clear: &[&Contrast],
    n_all: usize,
) -> String {
    let named: Vec<String> = (clear.iter().take(MOST_NAMED))
        .map(|row| format!("{} ({})", label(found, row.factor), size(found, row, true)))
        .collect();
    let left: Vec<String> = (clear.iter().skip(MOST_NAMED))
        .map(|row| label(found, row.factor).to_owned())
        .collect();
    let then = if left.is_empty() {
        String::new()
    } else {
        format!("; less so {}", listed(&left))
    };
    let is_clear = |factor: &usize| clear.iter().any(|row| row.factor == *factor);
    let of_others: Vec<String> = (0..found.factors.len())
        .filter(|factor| !is_clear(factor))
        .map(|factor| label(found, factor).to_owned())
        .collect();
    let others = if of_others.is_empty() {
        String::new()
    } else {
        format!("; no effect is shown of {}", listed(&of_others))
    };
    let n = clear.len();
    format!(
        "{n} of {n_all} {} {what} by more than chance: {}{then}{others}{}.",
        if n_all == 1 {
            "setting changes"
        } else if n == 1 {
            "settings changes"
        } else {
            "settings change"
        },
        listed(&named),
        dependence(found, response).unwrap_or_default()
    )
}

/// "+60 points from 3 to 10 m, 95 % interval 42 to 78".
fn size(found: &Sensitivity, row: &Contrast, with_interval: bool) -> String {
    let Some(estimate) = row.estimate else {
        return words::dash();
    };
    // From the level with less to the level with more.
    let (from, to, sign) = if estimate.mean < 0.0 {
        (row.to, row.from, -1.0)
    } else {
        (row.from, row.to, 1.0)
    };
    let levels = between(found, row.factor, from, to);
    let points = words::points(sign * estimate.mean);
    if !with_interval {
        return format!("{points} with {} ({levels})", label(found, row.factor));
    }
    let interval = estimate.interval.map_or_else(String::new, |i| {
        let (low, high) = if sign < 0.0 {
            (-i.high, -i.low)
        } else {
            (i.low, i.high)
        };
        format!(
            ", 95\u{a0}% interval {} to {}",
            words::plain_points(low),
            words::plain_points(high)
        )
    });
    format!("+{points} from {levels}{interval}")
}

/// "3 to 10 m".
fn between(found: &Sensitivity, factor: usize, from: usize, to: usize) -> String {
    let own = &found.factors[factor];
    words::with_unit_of(
        own.key,
        &format!("{} to {}", own.labels[from], own.labels[to]),
    )
}

fn label(found: &Sensitivity, factor: usize) -> &'static str {
    found.factors[factor].key.label()
}

/// ", p = 0.25 over 5 worlds".
fn test(found: &Sensitivity, row: &Contrast) -> String {
    match (row.p_holm, row.estimate) {
        (Some(p), Some(estimate)) => format!(
            ", {} over {}",
            words::p_value(p),
            words::counted(estimate.n, unit(found))
        ),
        _ => format!(", and one {} cannot tell it from chance", unit(found)),
    }
}

fn unit(found: &Sensitivity) -> &'static str {
    if found.over_worlds { "world" } else { "chain" }
}

/// What a test lacks that finds nothing although all units agree: units.
fn more_units(found: &Sensitivity, response: Response, row: &Contrast) -> String {
    let agree = row
        .estimate
        .is_some_and(|own| own.standard_error == Some(0.0));
    if !agree {
        return String::new();
    }
    let is_tested = |own: &&Contrast| own.response == response && own.p_holm.is_some();
    let n_contrasts = found.contrasts.iter().filter(is_tested).count();
    // 2^(1 − n) times the number of contrasts is below the level.
    let needed = 1.0 + libm::log2(n_contrasts as f64 / LEVEL);
    format!(
        "; {} {}s that agree would show it",
        needed.ceil(),
        unit(found)
    )
}

/// Where the effect of one setting rests on the level of another, if an upheld interaction says so
/// and the effect differs enough: "; the effect of temperatures depends on moves: +100 points at A,
/// +0 at B".
fn dependence(found: &Sensitivity, response: Response) -> Option<String> {
    let strongest = found.strongest(response);
    let clear = found.clear_interactions(response);
    let found_one = clear.iter().find_map(|row| {
        let own = strongest
            .iter()
            .find(|c| [row.factors.0, row.factors.1].contains(&c.factor))?;
        let (factor, other) = match row.factors {
            (a, b) if a == own.factor => (a, b),
            (a, b) => (b, a),
        };
        let by_level = simple_effects(found, response, own, other);
        let most = by_level
            .iter()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let least = by_level
            .iter()
            .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let is_clear = (most.1 - least.1).abs() >= CLEAR_DEPENDENCE;
        is_clear.then_some((factor, other, *most, *least))
    })?;
    let (factor, other, most, least) = found_one;
    let at = |level: usize| {
        let own = &found.factors[other];
        words::with_unit_of(own.key, &own.labels[level])
    };
    Some(format!(
        "; the effect of {} depends on {}: {} points at {}, {} at {}",
        label(found, factor),
        label(found, other),
        words::signed_points(most.1),
        at(most.0),
        words::signed_points(least.1),
        at(least.0)
    ))
}

/// The difference of the contrast at each level of another factor.
fn simple_effects(
    found: &Sensitivity,
    response: Response,
    own: &Contrast,
    other: usize,
) -> Vec<(usize, f64)> {
    let pair = found.pair(response, (own.factor.min(other), own.factor.max(other)));
    let mean = |level: usize, of_other: usize| {
        let wanted = if own.factor < other {
            (level, of_other)
        } else {
            (of_other, level)
        };
        let row = pair.iter().find(|row| row.levels == wanted)?;
        Some(row.estimate?.mean)
    };
    let levels = 0..found.factors[other].labels.len();
    levels
        .filter_map(|of_other| {
            let difference = mean(own.to, of_other)? - mean(own.from, of_other)?;
            Some((of_other, difference))
        })
        .collect()
}
