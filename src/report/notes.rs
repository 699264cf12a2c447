//! What a reader should know beside the answer, in sentences; the same in Markdown and HTML.

use super::{Material, words};
use crate::results::{CellResult, CellVerdict, Verdict};
use crate::run::Stop;

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

/// What the rates are worth: worlds by verdict, and the chains without an outcome, zeros too.
pub(super) fn verdicts(material: Material<'_>) -> String {
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
        "Of the {} of all cells, {}. Of {}, {}. Chains: {}.",
        words::counted(results.worlds.len(), "world"),
        parts.join(", "),
        words::counted(results.cells.len(), "cell"),
        cells.join(", "),
        words::missingness(n_failed, n_missing)
    )
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
