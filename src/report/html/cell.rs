//! The page of one cell: what to make of it, its map, its diagnostics world by world, how to run it again.

use maud::{Markup, PreEscaped, html};

use super::super::{Figure, Material, advice, faults, rerun, words};
use super::{badge, page, picture};
use crate::results::{Answer, CellResult, Convergence, Diagnosis, Doubt, Sorted, SweepResults};
use crate::run::{ChainStatus, ExactComparison};

/// The page; `map` is part of it, `shown` lie beside it.
pub(in crate::report) fn cell_page(
    material: Material<'_>,
    cell_ix: usize,
    map: Option<&Figure>,
    shown: &[&Figure],
) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let (cell, result) = (&sweep.cells[cell_ix], &results.cells[cell_ix]);
    let title = format!("{} · {}", cell.title(), sweep.title);
    let faults = cell.settings.faults();
    let alone = rerun::cell_alone(material, cell);
    let body = html! {
        p { a href="../index.html#cells" { "← " (sweep.title) } }
        h1 { (cell.title()) }
        p { (words::differing(sweep, cell)) }
        @if !cell.note.is_empty() { p { (cell.note) } }
        @if !faults.is_empty() { p.warn { "Incorrect on purpose: " (faults.join("; ")) "." } }
        p.answer { (badge(result.verdict, &result.verdict_words())) ": " (advice::cell_meaning(result)) ". " (cell_sentence(result)) @if let Some(words) = words::stopping(result, sweep.stopping()) { " Worlds were added as needed: " (words) "." } }
        @if let Some(faults) = result.faults { p { strong { "Whose fault? " } (faults::counts(faults)) ". " (posteriors(results, cell_ix)) (faults::what_now(faults)) } }
        p { strong { "What now? " } (advice::cell_what_now(result)) " " a href="../index.html#what-now" { "Every verdict" } }
        @if let Some(map) = map {
            figure { div.embedded.map tabindex="0" { (PreEscaped(map.svg())) } figcaption { (map.caption) } }
        }
        @for figure in shown { (picture(figure, "../")) }
        @if shown.is_empty() {
            p.soft { "The pictures of its chains are not drawn yet: " code { "ptm report FOLDER --cell " (cell.id) } " draws them." }
        }
        h2 { "Convergence, world by world" }
        (convergence(results, cell_ix))
        (doubts(results, cell_ix))
        h2 { "Chains" }
        div.wide tabindex="0" { table {
            thead { tr { @for name in CHAIN_HEADINGS { th { (name) } } } }
            tbody { @for chain in results.chains_of(cell_ix) {
                tr {
                    td.number { (chain.replicate + 1) }
                    td.number { (chain.chain + 1) }
                    @match &chain.status {
                        ChainStatus::Failed { reason, .. } => td colspan="11" .warn { "failed: " (reason) },
                        ChainStatus::Done(outcome) => {
                            td { (outcome.recovered.map_or("unknown", |r| if r { "yes" } else { "no" })) }
                            td { (chain.sorted.map_or_else(words::dash, fault_word)) }
                            td.number { (words::percent(outcome.truth_mass)) }
                            td.number { (words::number(outcome.adjusted_rand_index, 2)) }
                            td.number { (outcome.n_detections) }
                            td.number { (words::number(Some(outcome.mean_n_sets), 1)) }
                            td.number { (words::percent(Some(outcome.acceptance_rate))) }
                            td.number { (outcome.burn_in.map_or_else(words::dash, |n| n.to_string())) }
                            td.words { (outcome.burn_in_reason) }
                            td title=(exact_title(&outcome.exact)) { (exact_words(&outcome.exact)) }
                            td { (outcome.n_topologies) @if outcome.count_error_bound > 0 { " (truncated)" } }
                        }
                    }
                }
            } }
        } }
        h2 { "Run it again" }
        p { "The cell alone, all its worlds and chains with the same random numbers, from the report’s folder:" }
        pre.command tabindex="0" { (alone) }
        @if let Some(command) = rerun::first_world(material, cell_ix) {
            p { "Its first world alone, with the flags of " code { "ptm sample" } ":" }
            pre.command tabindex="0" { (command) }
        }
        h2 { "Settings" }
        p { "Seed " (cell.settings.count("seed")) ". All settings, as in " code { "sweep.toml" } ":" }
        pre tabindex="0" { @for (key, value) in cell.settings.iter() {
            @if key.name != "detections" { (key.name) " = " (value) @if !key.unit.is_empty() { " " (key.unit) } "\n" }
        } }
    };
    page(&title, &body)
}

fn fault_word(sorted: Sorted) -> String {
    match sorted {
        Sorted::Recovered => words::dash(),
        Sorted::Failed(fault) => fault.name().to_owned(),
    }
}

/// What the posterior of each of its worlds prefers.
fn posteriors(results: &SweepResults, cell: usize) -> String {
    let answers: Vec<Answer> = results.worlds_of(cell).filter_map(|w| w.answer).collect();
    let n = |is: fn(&Answer) -> bool| answers.iter().filter(|answer| is(answer)).count();
    format!(
        "Of the posteriors of its {}, {} have the truth as their MAP topology, {} prefer another map, {} are undecided.",
        words::counted(answers.len(), "world"),
        n(|answer| *answer == Answer::Truth),
        n(|answer| *answer == Answer::OtherMap),
        n(|answer| matches!(answer, Answer::Undecided(_)))
    )
}

/// What to try about each doubt that any of its worlds has.
fn doubts(results: &SweepResults, cell: usize) -> Markup {
    let mut found: Vec<(String, &'static str)> = Vec::new();
    for world in results.worlds_of(cell) {
        let diagnosis = world.diagnosis.as_ref();
        let doubts: &[Doubt] = diagnosis.map_or(&[], |found| found.convergence.doubts());
        for doubt in doubts {
            if let Some(advice) = advice::about(doubt)
                && !found.iter().any(|(word, _)| *word == doubt.word())
            {
                found.push((doubt.word(), advice));
            }
        }
    }
    html! {
        @if !found.is_empty() {
            ul { @for (word, advice) in &found { li { code { (word) } ": " (advice) } } }
        }
    }
}

const CHAIN_HEADINGS: [&str; 13] = [
    "world",
    "chain",
    "recovered",
    "whose fault",
    "truth mass",
    "ARI",
    "N",
    "M",
    "acceptance",
    "burn-in",
    "because",
    "distance to exact",
    "topologies",
];

/// Diagnostics of the chains on each world, and what to make of them.
fn convergence(results: &SweepResults, cell: usize) -> Markup {
    html! {
        p.soft { (CONVERGENCE_NOTE) }
        div.wide tabindex="0" { table {
            thead { tr { @for name in WORLD_HEADINGS { th { (name) } } } }
            tbody { @for world in results.worlds_of(cell) {
                tr {
                    td.number { (world.replicate + 1) }
                    td.reason {
                        (badge(world.verdict, world.verdict.words()))
                        @if let Some(found) = &world.diagnosis { ": " (convergence_words(found)) }
                    }
                    td { (world.n_planned - world.n_failed - world.n_missing) " (" (words::missingness(world.n_failed, world.n_missing)) ")" }
                    @if let Some(found) = &world.diagnosis {
                        @for quantity in [&found.n_sets, &found.ln_target] {
                            td.number { (words::measured(quantity.r_hat, 3)) }
                            td.number { (words::measured(quantity.ess_bulk, 0)) " / " (words::measured(quantity.ess_tail, 0)) }
                            td.number { (words::measured(quantity.mcse, 3)) }
                        }
                        td.number { (topology_distance(found)) }
                        td.number { (co_clustering(found)) }
                        td.number { (words::measured(found.unseen.map(|unseen| unseen.mass), 3)) }
                        td.number { (words::measured(found.n_holding.map(|n| n.n as f64), 0)) }
                    } @else {
                        td colspan="10" { "no chain ran to its end" }
                    }
                }
            } }
        } }
    }
}

const CONVERGENCE_NOTE: &str = "Chains on a world are pooled after the largest burn-in of any. They have converged if they mix \
    (R-hat of M and of ln target at most 1.01 and ESS at least 100 for each chain, Vehtari et al. 2021; total variation between \
    the topologies of two chains no more than chance explains in 99 of 100 cases at their ESS), or are at rest: each came by \
    itself to one and the same topology and spends 95 % of its draws there. Starts that have each converged must agree as well \
    (nested R-hat). Words stand for what is undefined: constant, \
    stuck-disagree (each chain stands still, at different values), too-rare (fewer than ten changes), too-short.";

const WORLD_HEADINGS: [&str; 13] = [
    "world",
    "verdict",
    "chains",
    "R-hat M",
    "ESS M bulk / tail",
    "MCSE M",
    "R-hat ln target",
    "ESS ln target bulk / tail",
    "MCSE ln target",
    "topologies apart (TV)",
    "co-clustering apart",
    "unseen mass",
    "topologies holding 95 %",
];

/// "0.12 (≤ 0.20 by chance)".
fn topology_distance(found: &Diagnosis) -> String {
    match &found.topologies {
        Ok(distance) => {
            let d = &distance.total_variation;
            format!("{:.3} (≤\u{a0}{:.3} by chance)", d.largest, d.null_95)
        }
        Err(reason) => reason.name().to_owned(),
    }
}

/// "0.12 ± 0.03, 0.01 on average".
fn co_clustering(found: &Diagnosis) -> String {
    match &found.co_clustering {
        Ok(d) => format!(
            "{:.3} ± {:.3}, {:.3} on average",
            d.largest, d.standard_error, d.mean
        ),
        Err(reason) => reason.name().to_owned(),
    }
}

fn convergence_words(found: &Diagnosis) -> String {
    let shown = match &found.convergence {
        Convergence::Mixes => "the chains mix and agree".to_owned(),
        Convergence::AtRest => "every chain came to rest at this topology".to_owned(),
        Convergence::Exact { largest } => {
            format!("every probability is within {largest:.3} of the exact posterior")
        }
        Convergence::Not(doubts) => {
            let sentences: Vec<String> = doubts.iter().map(ToString::to_string).collect();
            return sentences.join("; ");
        }
    };
    format!("{shown}; {}", words::starts(found))
}

/// "0.012 (≤ 0.015)", marked where it is further off than chance explains.
fn exact_words(exact: &ExactComparison) -> Markup {
    let ExactComparison::Compared(d) = exact else {
        return html! { (words::dash()) };
    };
    let text = words::distance(Some(d.total_variation), d.high);
    html! { @if d.differs() == Some(true) { span.warn { (text) } } @else { (text) } }
}

fn exact_title(exact: &ExactComparison) -> String {
    match exact {
        ExactComparison::Not { reason } => format!("not compared: {reason}"),
        ExactComparison::Compared(d) => format!(
            "total variation to the exact posterior; in brackets what a correct chain of {} effective samples \
             stays below (99.9 %), {} on average; the exact posterior is known to {:.4}",
            words::number(d.effective_samples, 0),
            words::number(d.expected, 3),
            d.table_error
        ),
    }
}

fn cell_sentence(result: &CellResult) -> String {
    let recovery = match result.recovery {
        Some(rate) => format!(
            "Recovers the truth in {} ({})",
            words::rate(Some(rate)),
            rate.kind.words()
        ),
        None => "Whether it recovers the truth is not known".to_owned(),
    };
    let agreement = match result.map_agreement {
        Some(share) => format!(
            " Chains on one world agree on the MAP topology in {} of pairs.",
            words::percent(Some(share))
        ),
        None => String::new(),
    };
    let exact = &result.exact;
    let distance = match (&exact.reason, exact.largest) {
        (_, Some(_)) => format!(
            " Largest distance of a chain to the exact posterior {} (in brackets: what a correct chain of its \
             effective sample size stays below); {} of {} are further off than that, {} cannot be judged.",
            words::distance(exact.largest, exact.high),
            exact.n_differ,
            words::counted(exact.n_compared, "chain"),
            exact.n_undecided
        ),
        (Some(reason), None) => format!(" Not compared with the exact posterior: {reason}."),
        (None, None) => String::new(),
    };
    let gate = format!(
        "; the chains are shown to have converged on {} worlds ({})",
        words::gate(result),
        words::missingness(result.n_failed, result.n_missing)
    );
    format!(
        "{recovery}{gate}; {} of the draws are at the truth.{agreement} Acceptance {}, mean M {} of {} detections.{distance}",
        words::percent(result.truth_mass),
        words::percent(result.acceptance_rate),
        words::number(result.n_sets, 1),
        result
            .n_detections
            .map_or_else(words::dash, |n| n.to_string())
    )
}
