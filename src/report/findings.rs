//! What a sweep found, in sentences; the same in Markdown and HTML.

use super::{Material, advice, comparisons, faults, knob, words};
use crate::results::told_apart::{Judged, LEVEL, judged, recovery_difference};
use crate::results::{CellResult, CellVerdict, Verdict};
use crate::run::Stop;
use crate::sweep::Design;

/// A sentence of the answer, with the question that it answers.
pub(super) struct Finding {
    /// The question in a few words.
    pub lead: &'static str,
    /// The sentence.
    pub text: String,
    /// The cell that it recommends.
    pub cell: Option<usize>,
}

/// What every report asks.
pub(super) const QUESTION: &str = "Which settings recover the truth, how surely, did the chains converge, and which knob matters?";

/// The answer, in the order in which a reader needs it.
pub(super) fn answer(material: Material<'_>) -> Vec<Finding> {
    let say = |lead, text| Finding {
        lead,
        text,
        cell: None,
    };
    let mut findings = Vec::new();
    findings.extend(faults::answer(material).map(|text| say("Whose fault", text)));
    findings.extend(knob::which_knob(material).map(|text| say("The knob that matters most", text)));
    let whose = comparisons::whose_findings(material);
    if !whose.is_empty() {
        findings.push(say("Whose findings these are", whose.join(" ")));
    }
    findings.extend(cell_to_use(material).map(|(cell, text)| Finding {
        cell,
        ..say("The cell to use", text)
    }));
    findings.push(say("How surely", how_many_recover(material)));
    findings.push(say("Did the chains converge", verdicts(material)));
    findings
}

/// What else a reader should know.
pub(super) fn notes(material: Material<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(exact_distance(material));
    notes.extend(caveats(material));
    notes
}

/// Chains on small data sets against the exact posterior.
fn exact_distance(material: Material<'_>) -> Option<String> {
    let cells = &material.results.cells;
    let count = |of: fn(&CellResult) -> usize| cells.iter().map(of).sum::<usize>();
    let n_compared = count(|cell| cell.exact.n_compared);
    let furthest = (cells.iter())
        .filter(|cell| cell.exact.largest.is_some())
        .max_by(|a, b| {
            let of = |cell: &CellResult| cell.exact.largest.unwrap_or(0.0);
            of(a).total_cmp(&of(b))
        })?;
    let title = |cell: &CellResult| material.sweep.cells[cell.cell].title();
    let differing: Vec<String> = (cells.iter())
        .filter(|cell| cell.exact.n_differ > 0)
        .map(|cell| {
            let (n, all) = (cell.exact.n_differ, cell.exact.n_compared);
            format!("{} ({n} of {all})", title(cell))
        })
        .collect();
    let verdict = if differing.is_empty() {
        "no chain that can be judged is further off than a correct one of its effective sample size gets".to_owned()
    } else {
        let cells = differing.join(", ");
        format!("NOT drawn from the posterior, further off than chance explains: {cells}")
    };
    let undecided = match count(|cell| cell.exact.n_undecided) {
        0 => String::new(),
        n => format!(
            "; {} cannot be judged (standing still, mixing slowly, or short)",
            words::counted(n, "chain")
        ),
    };
    Some(format!(
        "{} on data of at most {} detections compared with the exact posterior: the largest total \
         variation is {} in {}; {verdict}{undecided}.",
        words::counted(n_compared, "chain"),
        material.sweep.base.count("exact_up_to"),
        words::distance(furthest.exact.largest, furthest.exact.high),
        title(furthest),
    ))
}

fn how_many_recover(material: Material<'_>) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let rates: Vec<f64> = results
        .cells
        .iter()
        .filter_map(|cell| cell.recovery)
        .map(|r| r.rate)
        .collect();
    let size = format!(
        "{} × {} × {}",
        words::counted(sweep.cells.len(), "cell"),
        match (sweep.stopping(), sweep.is_simulated()) {
            (Some(_), _) => format!("{} worlds", words::worlds_per_cell(&results.cells)),
            (None, true) => words::counted(sweep.n_replicates() as usize, "world"),
            (None, false) => words::counted(sweep.n_replicates() as usize, "data set"),
        },
        words::counted(sweep.n_chains() as usize, "chain"),
    );
    if rates.is_empty() {
        return format!(
            "{size}; the truth of these detections is not known, so recovery is not judged."
        );
    }
    let (all, none) = (
        rates.iter().filter(|&&r| r == 1.0).count(),
        rates.iter().filter(|&&r| r == 0.0).count(),
    );
    format!(
        "{size}: {} recover the true topology in every chain, {} in none, {} in some.",
        words::counted(all, "cell"),
        none,
        rates.len() - all - none
    )
}

/// What the rates are worth: worlds by verdict, and the chains without an outcome, zeros too.
fn verdicts(material: Material<'_>) -> String {
    let results = material.results;
    let count = |verdict: Verdict| {
        let of = |cell: &CellResult| cell.worlds.n(verdict);
        results.cells.iter().map(of).sum::<usize>()
    };
    let is_shown =
        |verdict: &Verdict| *verdict != Verdict::ConvergedTruthUnknown || count(*verdict) > 0;
    let parts = Verdict::ALL.into_iter().filter(is_shown);
    let parts: Vec<String> = parts
        .map(|verdict| format!("{} {}", count(verdict), verdict.words()))
        .collect();
    let n_cells = |verdict: CellVerdict| {
        let own = results.cells.iter().filter(|cell| cell.verdict == verdict);
        own.count()
    };
    let cells: Vec<String> = CellVerdict::ALL
        .into_iter()
        .filter(|verdict| n_cells(*verdict) > 0)
        .map(|verdict| format!("{} {}", n_cells(verdict), verdict.words()))
        .collect();
    let n_missing = results.cells.iter().map(|cell| cell.n_missing).sum();
    let n_failed = results.cells.iter().map(|cell| cell.n_failed).sum();
    format!(
        "of the {} of all cells, {}. Of {}, {}. Chains: {}.",
        words::counted(results.worlds.len(), "world"),
        parts.join(", "),
        words::counted(results.cells.len(), "cell"),
        cells.join(", "),
        words::missingness(n_failed, n_missing)
    )
}

/// The cell to use, of those that are computed correctly, and why; no cell where none can be
/// recommended.
fn cell_to_use(material: Material<'_>) -> Option<(Option<usize>, String)> {
    let (sweep, results) = (material.sweep, material.results);
    if !matches!(sweep.design, Design::Grid(_) | Design::OneAtATime(_)) {
        return None;
    }
    let is_correct = |cell: &usize| sweep.cells[*cell].settings.faults().is_empty();
    let first = results.ranking().iter().copied().find(is_correct)?;
    let best = &results.cells[first];
    let what = format!(
        "{} ({})",
        sweep.cells[first].title(),
        words::differing(sweep, &sweep.cells[first])
    );
    let Some(rate) = best.recovery else {
        let n = (results.cells.iter())
            .filter(|cell| cell.verdict == Verdict::ConvergedTruthUnknown.into())
            .count();
        let of = words::counted(results.cells.len(), "cell");
        return Some(match n {
            0 => (
                None,
                format!("none: the truth is not known, and the chains converge in none of {of}."),
            ),
            _ => (
                Some(first),
                format!(
                    "one of the {n} of {of} whose chains converge, as {what}; the truth is not known, so recovery is not judged."
                ),
            ),
        });
    };
    let rate_words = words::rate(Some(rate));
    if best.worlds.n(Verdict::Recovered) == 0 {
        return Some((
            None,
            format!(
                "none: no cell recovers the truth with chains that are shown to have converged; the most \
                 successful is {what}, with a recovery rate of {rate_words} by luck."
            ),
        ));
    }
    if best.verdict != Verdict::Recovered.into() {
        return Some((
            Some(first),
            format!(
                "none is shown to be one yet. The most successful is {what}: {}, recovery {rate_words}. {}",
                best.verdict_words(),
                advice::cell_what_now(best)
            ),
        ));
    }
    let around = results.neighbours_rate(first).map(|neighbours| {
        format!(
            " The cells next to it recover {} on average.",
            words::percent(Some(neighbours))
        )
    });
    Some((
        Some(first),
        format!(
            "{what}: {}, recovery {rate_words}.{}{}{}",
            best.worlds.split(),
            if best.worlds.is_only_world {
                " No other world was tried.".to_owned()
            } else {
                format!(
                    " So most worlds like these are recovered, at least {} of them (95 % bound).",
                    words::percent(Some(best.worlds.share_at_least(Verdict::Recovered)))
                )
            },
            around.unwrap_or_default(),
            not_told_apart(material, first).unwrap_or_default()
        ),
    ))
}

/// How many other cells' recovery rates cannot be told apart from that of the best.
fn not_told_apart(material: Material<'_>, best: usize) -> Option<String> {
    let cells = 0..material.results.cells.len();
    let found: Vec<_> = cells
        .filter(|cell| *cell != best)
        .map(|cell| recovery_difference(material.sweep, material.results, best, cell))
        .collect();
    let all: Vec<Judged> = judged(&found).into_iter().flatten().collect();
    let test = all.first()?.found.test;
    let n_alike = all.iter().filter(|own| !own.differs()).count();
    Some(format!(
        " By recovery rate {n_alike} of the other {} cannot be told apart from it ({}, Holm over {}, p > {LEVEL}).",
        words::counted(all.len(), "cell"),
        test.words(),
        words::counted(all.len(), "test")
    ))
}

fn caveats(material: Material<'_>) -> Vec<String> {
    let (sweep, results) = (material.sweep, material.results);
    let mut caveats = Vec::new();
    let n_done = results
        .chains
        .iter()
        .filter(|chain| chain.outcome().is_some())
        .count();
    let count = |of: fn(&CellResult) -> usize| results.cells.iter().map(of).sum::<usize>();
    let n_never = count(|cell| cell.n_never_settled);
    if n_never > 0 {
        caveats.push(format!(
            "{n_never} of {n_done} chains have no burn-in (MSER finds none in their first half, or they are \
             too short to tell); nothing is left out of those, and their outcome says little."
        ));
    }
    let judged = || results.cells.iter().filter_map(|cell| cell.map_agreement);
    let disagree = judged().filter(|&agreement| agreement < 0.5).count();
    if disagree > 0 {
        caveats.push(format!(
            "In {disagree} of {} the chains mostly end at different MAP topologies on the same data: they \
             are stuck or spread, not converged, however still each stands by itself.",
            words::counted(judged().count(), "cell")
        ));
    }
    if results.n_failed() > 0 {
        caveats.push(format!(
            "{} failed; the table of chains says why.",
            words::counted(results.n_failed(), "chain")
        ));
    }
    let of_posteriors = results.posteriors.iter().map(|own| own.n_missing);
    let missing = material.plan.tasks_of_cells().count() - results.chains.len()
        + of_posteriors.sum::<usize>();
    if missing > 0 {
        caveats.push(format!("{} not run yet.", words::counted(missing, "chain")));
    }
    let at_cap = |cell: &&CellResult| cell.stop == Some(Stop::AtCap);
    let n_at_cap = results.cells.iter().filter(at_cap).count();
    if let Some(rule) = sweep.stopping().filter(|_| n_at_cap > 0) {
        caveats.push(format!(
            "{} stopped at the cap of {} worlds before the recovery rate was known to ± {}; their intervals are \
             wider than asked for.",
            words::counted(n_at_cap, "cell"),
            rule.most,
            words::within(Some(rule.error))
        ));
    }
    let n_truncated = count(|cell| cell.n_truncated);
    if n_truncated > 0 {
        caveats.push(format!(
            "In {} the table of topologies was full and the rarest were dropped (truncated).",
            words::counted(n_truncated, "chain")
        ));
    }
    let faulty = sweep
        .cells
        .iter()
        .filter(|cell| !cell.settings.faults().is_empty())
        .count();
    if faulty > 0 {
        caveats.push(format!(
            "{} computed INCORRECTLY on purpose, as the source report's program does; they are marked.",
            if faulty == 1 { "1 cell is".to_owned() } else { format!("{faulty} cells are") }
        ));
    }
    if !sweep.dropped_factors.is_empty() {
        caveats.push(format!(
            "The data come from a CSV, so what the sweep says of simulated worlds is left out: {}.",
            sweep.dropped_factors.join(", ")
        ));
    }
    caveats
}
