//! The answer of a list: settings side by side, and whose finding each is where a faulty program
//! computes them too.

use super::{Finding, listed};
use crate::report::{Leading, Material, comparisons, figures, words};
use crate::results::told_apart::{Judged, judged, recovery_difference};

/// Findings of pairs that are written out.
const MOST_GROUPS: usize = 7;

pub(super) fn question(material: Material<'_>) -> String {
    if comparisons::comparisons(material).is_empty() {
        format!(
            "How do these {} settings compare?",
            material.sweep.cells.len()
        )
    } else {
        "Which of these settings recover the true map, and which failures are the program’s and not \
         the method’s?"
            .to_owned()
    }
}

/// What the comparison shows.
pub(super) fn finding(material: Material<'_>) -> Option<Finding> {
    let whose = comparisons::whose(material);
    if whose.is_empty() {
        return compared(material);
    }
    let parts: Vec<String> = (whose.iter().take(MOST_GROUPS))
        .map(|(labels, verdict)| format!("{} {verdict}", labels.join(", ")))
        .collect();
    let text = format!("{}.", parts.join("; "));
    Some(Finding::new("Whose fault", text))
}

/// Groups of rates that are written out.
const MOST_RATES: usize = 4;
/// Settings that a group names.
const MOST_NAMES: usize = 3;

/// The settings by their recovery rate, and which of them are worse than the best by more than
/// chance.
fn compared(material: Material<'_>) -> Option<Finding> {
    let best = material.results.recommended()?.cell;
    let rate = |cell: usize| material.results.cells[cell].recovery.map(|rate| rate.rate);
    rate(best)?;
    let mut by_rate: Vec<(f64, Vec<usize>)> = Vec::new();
    for cell in material.results.ranking().iter().copied() {
        let Some(rate) = rate(cell) else { continue };
        match by_rate.iter_mut().find(|(known, _)| *known == rate) {
            Some((_, cells)) => cells.push(cell),
            None => by_rate.push((rate, vec![cell])),
        }
    }
    by_rate.sort_by(|a, b| b.0.total_cmp(&a.0));
    let group = |(rate, cells): &(f64, Vec<usize>)| {
        let titles = cells.iter().map(|cell| material.sweep.cells[*cell].title());
        let names = match cells.len() {
            n if n <= MOST_NAMES => listed(&titles.collect::<Vec<_>>()),
            n => words::counted(n, "setting"),
        };
        format!("{} with {names}", words::percent(Some(*rate)))
    };
    let groups: Vec<String> = by_rate.iter().take(MOST_RATES).map(group).collect();
    let worse = worse_than(material, best);
    let test = if worse.is_empty() {
        "no difference to the best is more than chance".to_owned()
    } else {
        format!(
            "{} of {} do worse than the best by more than chance",
            worse.len(),
            material.sweep.cells.len() - 1
        )
    };
    let text = format!(
        "Recovery is {}; {test} (5\u{a0}% level, Holm-corrected).",
        listed(&groups)
    );
    Some(Finding::new("What matters", text))
}

/// Cells that recover less often than this one by more than chance explains.
pub(super) fn worse_than(material: Material<'_>, best: usize) -> Vec<usize> {
    let cells = material.results.cells.len();
    let others: Vec<usize> = (0..cells).filter(|cell| *cell != best).collect();
    let tests = others
        .iter()
        .map(|&cell| recovery_difference(material.sweep, material.results, best, cell));
    let found = judged(&tests.collect::<Vec<_>>());
    let rate = |cell: usize| material.results.cells[cell].recovery.map(|rate| rate.rate);
    let is_worse = |(cell, test): &(&usize, &Option<Judged>)| {
        test.is_some_and(|test| test.differs()) && rate(**cell) < rate(best)
    };
    let worse = others.iter().zip(&found).filter(is_worse);
    worse.map(|(cell, _)| *cell).collect()
}

/// The settings side by side.
pub(super) fn figure(material: Material<'_>) -> Option<Leading> {
    Some(figures::side_by_side(material)?.into())
}
