//! The cell to use, and how sure that is.

use super::{Finding, knows_truth};
use crate::report::{Material, advice, words};
use crate::results::Verdict;
use crate::results::told_apart::{Judged, judged, recovery_difference};
use crate::sweep::{Design, Sampling};

/// The half width of an interval that more worlds are planned for.
const WANTED_ERROR: f64 = 0.05;

/// Which cell, and what is behind it; nothing of designs that ask something else.
pub(super) fn findings(material: Material<'_>) -> [Option<Finding>; 2] {
    if let Design::Sampled(design) = &material.sweep.design
        && matches!(design.sampling, Sampling::Morris | Sampling::SobolIndices)
    {
        return [None, None];
    }
    let Some(found) = material.results.recommended() else {
        return [None, None];
    };
    let cell = found.cell;
    let best = &material.results.cells[cell];
    let name = named(material, cell);
    let say = |text: String, cell: Option<usize>| {
        Some(Finding {
            cell,
            ..Finding::new("Use", text)
        })
    };
    let Some(rate) = best.recovery else {
        return [
            match best.worlds.n(Verdict::ConvergedTruthUnknown) {
                0 => say(
                    "None: the chains converge with no setting.".to_owned(),
                    None,
                ),
                _ => say(
                    format!(
                        "{name}: its chains converged on {} of {} data sets{}.",
                        best.worlds.n_converged(),
                        best.worlds.n_run(),
                        around(material, cell)
                    ),
                    Some(cell),
                ),
            },
            None,
        ];
    };
    let rate = words::rate_words(rate);
    let n_good = best.worlds.n(Verdict::Recovered);
    if n_good == 0 {
        let text = format!(
            "None yet: no setting recovered the true map with converged chains; the most \
             successful is {name} with a recovery rate of {rate}, by luck."
        );
        return [say(text, Some(cell)), None];
    }
    let (is_shown, on) = (
        best.verdict == Verdict::Recovered.into(),
        if best.worlds.is_only_world {
            "on the one data set".to_owned()
        } else {
            format!("on {n_good} of {} worlds", best.worlds.n_run())
        },
    );
    let lead = if is_shown {
        ""
    } else {
        "the most successful, though not shown to be good: "
    };
    let text = format!(
        "{lead}{name}: its chains converged and found the true map {on} (recovery {rate}){}.",
        around(material, cell)
    );
    [say(text, Some(cell)), Some(how_sure(material, cell))]
}

/// "c053 (σₒ 0.5 m, …)".
fn named(material: Material<'_>, cell: usize) -> String {
    let own = &material.sweep.cells[cell];
    let differing = words::differing(material.sweep, own);
    match material.sweep.design {
        Design::List(_) => own.title(),
        _ if differing.is_empty() => own.title(),
        _ => format!("{} ({differing})", own.title()),
    }
}

/// "; the 31 settings around it did so on 84 % of theirs".
fn around(material: Material<'_>, cell: usize) -> String {
    let around = material.results.around(cell);
    let Some(share) = around.good else {
        return String::new();
    };
    let share = words::percent(Some(share));
    // A list has no levels, so what is around are other samplers of the same posterior.
    let is_list = matches!(material.sweep.design, Design::List(_));
    match (around.neighbours.len(), is_list) {
        (1, true) => format!("; the other setting with the same posterior did so on {share}"),
        (1, false) => format!("; the setting next to it did so on {share}"),
        (n, true) => format!("; the {n} other settings with the same posterior did so on {share}"),
        (n, false) => format!("; the {n} settings around it did so on {share} of theirs"),
    }
}

/// Ties, what cannot be told apart, and what more worlds would settle.
fn how_sure(material: Material<'_>, cell: usize) -> Finding {
    let results = material.results;
    let best = &results.cells[cell];
    let equal = results.recommended().map_or(0, |found| found.n_equal);
    let tied = results.recommended().map_or(0, |found| found.n_tied);
    let ties = match (equal, tied) {
        (0, _) => "No other setting did as well".to_owned(),
        (1, 0) => "1 other setting did as well, with worse settings around it".to_owned(),
        (1, _) => "1 other setting did exactly as well".to_owned(),
        (n, 0) => format!(
            "{} other settings did as well, with worse settings around them",
            words::thousands(n)
        ),
        (n, tied) => format!(
            "{} other settings did as well, {} of them amid equally good ones",
            words::thousands(n),
            words::thousands(tied)
        ),
    };
    let alike = not_told_apart(material, cell).map_or_else(String::new, |(alike, all)| {
        format!(
            "; {} of {} cannot be told from it",
            words::thousands(alike),
            words::thousands(all)
        )
    });
    let more = if best.worlds.is_only_world {
        "; only other data sets can show whether it holds there".to_owned()
    } else if best.verdict != Verdict::Recovered.into() {
        let needed = best.worlds.to_settle();
        match needed.in_all {
            Some(n) if needed.at_best > 0 => {
                format!("; {n} worlds (replicates = {n}) would settle it at the share seen so far")
            }
            _ => format!(". {}", advice::cell_what_now(best).trim_end_matches('.')),
        }
    } else {
        best.recovery.map_or_else(String::new, |rate| {
            let n = rate.worlds_for(WANTED_ERROR);
            let error = words::plain_points(WANTED_ERROR);
            format!("; about {n} worlds (replicates = {n}) would give its rate to ±{error} points")
        })
    };
    let text = format!("{ties}{alike}{more}.");
    debug_assert!(knows_truth(material), "rates are of a known truth");
    Finding::new("How sure", text)
}

/// How many other cells' recovery rates cannot be told apart from that of the best, and of how many.
fn not_told_apart(material: Material<'_>, best: usize) -> Option<(usize, usize)> {
    let cells = 0..material.results.cells.len();
    let found: Vec<_> = cells
        .filter(|cell| *cell != best)
        .map(|cell| recovery_difference(material.sweep, material.results, best, cell))
        .collect();
    let all: Vec<Judged> = judged(&found).into_iter().flatten().collect();
    let n_alike = all.iter().filter(|own| !own.differs()).count();
    (!all.is_empty()).then_some((n_alike, all.len()))
}
