//! What a sweep found, in sentences; the same in Markdown and HTML.

use super::{Material, factors, words};
use crate::results::{CellResult, Verdict};
use crate::run::Stop;
use crate::sweep::{Cell, Design};

/// A setting computed correctly and as a faulty program computes it.
pub(super) struct Comparison {
    /// Its label.
    pub label: String,
    /// The remark of the sweep file.
    pub note: String,
    /// What the correct computation does.
    pub correct: String,
    /// What the faulty one does.
    pub faulty: String,
    /// Whose finding it is.
    pub verdict: String,
}

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
    findings.extend(which_knob(material).map(|text| say("The knob that matters most", text)));
    let whose = whose_findings(material);
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

fn which_knob(material: Material<'_>) -> Option<String> {
    let (sweep, results) = (material.sweep, material.results);
    let strongest = results.effects.first()?;
    if strongest.range == 0.0 {
        let rate = strongest.by_level.iter().flatten().next()?.rate;
        let rate = words::percent(Some(rate));
        return Some(format!(
            "none: the recovery rate is {rate} at every level of every setting."
        ));
    }
    let describe = |effect: &crate::results::FactorEffect| {
        let factor = &sweep.factors[effect.factor];
        let low = factors::extreme(effect, f64::min)?;
        let high = factors::extreme(effect, f64::max)?;
        Some(format!(
            "{}: recovery goes from {} to {}",
            factor.key.label(),
            factors::at(factor, effect, low),
            factors::at(factor, effect, high)
        ))
    };
    let others = results.effects[1..].iter().take(2).filter_map(|effect| {
        let label = sweep.factors[effect.factor].key.label();
        (effect.range > 0.0).then(|| format!("{label} ({})", words::points(effect.range)))
    });
    let others: Vec<String> = others.collect();
    let then = if others.is_empty() {
        String::new()
    } else {
        format!(
            ", a change of {}; then {}",
            words::points(strongest.range),
            others.join(" and ")
        )
    };
    Some(format!("{}{then}.", describe(strongest)?))
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
        let of = |cell: &CellResult| cell.n_worlds_with(verdict);
        results.cells.iter().map(of).sum::<usize>()
    };
    let is_shown =
        |verdict: &Verdict| *verdict != Verdict::ConvergedTruthUnknown || count(*verdict) > 0;
    let parts = Verdict::ALL.into_iter().filter(is_shown);
    let parts: Vec<String> = parts
        .map(|verdict| format!("{} {}", count(verdict), verdict.words()))
        .collect();
    let n_missing = results.cells.iter().map(|cell| cell.n_missing).sum();
    let n_failed = results.cells.iter().map(|cell| cell.n_failed).sum();
    format!(
        "of {} worlds of cells, {}; chains: {}.",
        results.worlds.len(),
        parts.join(", "),
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
            .filter(|cell| cell.verdict == Verdict::ConvergedTruthUnknown)
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
    let n_good = best.n_worlds_with(Verdict::Recovered);
    if n_good == 0 {
        return Some((
            None,
            format!(
                "none: no cell recovers the truth with chains that are shown to have converged; the most \
                 successful is {what}, with a recovery rate of {rate_words} by luck."
            ),
        ));
    }
    let score = |cell: &CellResult| {
        (
            cell.n_worlds_with(Verdict::Recovered) * best.n_worlds,
            cell.recovery.map(|r| r.rate),
        )
    };
    let n_ties = (results.cells.iter())
        .filter(|cell| (score(cell).0, score(cell).1) == (n_good * cell.n_worlds, Some(rate.rate)))
        .count();
    let deepest = match (n_ties, results.neighbours_rate(first)) {
        (2.., Some(neighbours)) => format!(
            " {n_ties} cells do as well; this one lies deepest among them: the cells next to it recover {} on average.",
            words::percent(Some(neighbours))
        ),
        (2.., None) => format!(" {n_ties} cells do as well."),
        (_, Some(neighbours)) => format!(
            " The cells next to it recover {} on average.",
            words::percent(Some(neighbours))
        ),
        (_, None) => String::new(),
    };
    Some((
        Some(first),
        format!(
            "{what}: recovery {rate_words}, chains converged on {} worlds.{deepest}",
            words::gate(best)
        ),
    ))
}

/// Whose findings the compared settings show: which labels share a verdict.
fn whose_findings(material: Material<'_>) -> Vec<String> {
    let mut by_verdict: Vec<(String, Vec<String>)> = Vec::new();
    for comparison in comparisons(material) {
        match by_verdict
            .iter_mut()
            .find(|(verdict, _)| *verdict == comparison.verdict)
        {
            Some((_, labels)) => labels.push(comparison.label),
            None => by_verdict.push((comparison.verdict, vec![comparison.label])),
        }
    }
    by_verdict
        .into_iter()
        .map(|(verdict, labels)| {
            let labels: Vec<String> = labels.iter().map(|label| format!("({label})")).collect();
            format!("{}: {verdict}.", labels.join(", "))
        })
        .collect()
}

fn caveats(material: Material<'_>) -> Vec<String> {
    let (sweep, results) = (material.sweep, material.results);
    let mut caveats = Vec::new();
    let n_done = results.chains.len() - results.n_failed();
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
    let missing = material.plan.tasks.len() - results.chains.len();
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

/// Settings that a list gives both correctly and with faults, side by side.
pub(super) fn comparisons(material: Material<'_>) -> Vec<Comparison> {
    if !matches!(material.sweep.design, Design::List(_)) {
        return Vec::new();
    }
    let cells = &material.sweep.cells;
    let is_faulty = |cell: &Cell| !cell.settings.faults().is_empty();
    let results = &material.results.cells;
    let pairs = cells
        .iter()
        .enumerate()
        .filter(|(_, cell)| !is_faulty(cell) && !cell.label.is_empty());
    pairs
        .filter_map(|(right, cell)| {
            let wrong = cells
                .iter()
                .position(|other| other.label == cell.label && is_faulty(other))?;
            Some(Comparison {
                label: cell.label.clone(),
                note: if cell.note.is_empty() {
                    cells[wrong].note.clone()
                } else {
                    cell.note.clone()
                },
                correct: behaviour(&results[right]),
                faulty: behaviour(&results[wrong]),
                verdict: verdict(&results[right], &results[wrong]).to_owned(),
            })
        })
        .collect()
}

/// A chain that stands at a posterior value of 0 for most of its proposals accepts whatever comes.
fn walks_at_random(cell: &CellResult) -> bool {
    cell.underflow_share.is_some_and(|share| share > 0.5)
}

fn recovers(cell: &CellResult) -> Option<bool> {
    cell.recovery.map(|rate| rate.rate > 0.5)
}

/// Chains that mostly end at different MAP topologies have not converged, whatever each does by itself.
fn disagree(cell: &CellResult) -> bool {
    cell.map_agreement.is_some_and(|agreement| agreement < 0.5)
}

fn behaviour(cell: &CellResult) -> String {
    let stuck = disagree(cell);
    let what = match (walks_at_random(cell), recovers(cell)) {
        (true, _) => "walks at random",
        (false, Some(true)) => "recovers the truth",
        (false, Some(false)) if stuck => "does not converge",
        (false, Some(false)) => "settles elsewhere",
        (false, None) => "samples",
    };
    let rate = match cell.recovery {
        Some(rate) => format!(" (recovery {})", words::rate(Some(rate))),
        None => String::new(),
    };
    let underflow = match cell.underflow_share {
        Some(share) => format!(", value 0 in {} of proposals", words::percent(Some(share))),
        None => String::new(),
    };
    format!(
        "{what}{rate}: {} over {}, M {} ± {}, acceptance {}{underflow}",
        match cell.n_maps_first_world {
            1 => "one MAP topology".to_owned(),
            n => format!("{n} MAP topologies"),
        },
        words::counted(cell.n_chains, "chain"),
        words::number(cell.n_sets, 1),
        words::number(cell.sd_n_sets, 1),
        words::percent(cell.acceptance_rate)
    )
}

/// Whether two rates can be told apart: their 95 % intervals do not overlap.
fn differ(a: &CellResult, b: &CellResult) -> bool {
    let interval = |cell: &CellResult| cell.recovery.and_then(|rate| rate.interval);
    match (interval(a), interval(b)) {
        (Some(a), Some(b)) => a.high < b.low || b.high < a.low,
        _ => recovers(a) != recovers(b),
    }
}

fn verdict(correct: &CellResult, faulty: &CellResult) -> &'static str {
    match (walks_at_random(faulty), recovers(correct)) {
        (true, Some(true)) => "floating-point underflow: in logarithms the truth is found",
        (true, _) if disagree(correct) => {
            "the random walk is floating-point underflow; in logarithms each chain freezes, at topologies \
             of its own"
        }
        (true, _) => {
            "the random walk is floating-point underflow; in logarithms the chains settle, though not at \
             the truth"
        }
        (false, _) if differ(correct, faulty) => {
            "the faulty proposal changes how often the truth is found, without any underflow"
        }
        (false, Some(false)) if disagree(correct) => {
            "the method's own: the chains do not converge in either computation"
        }
        (false, _) => "the method's own: the recovery rates cannot be told apart",
    }
}
