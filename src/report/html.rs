//! The report as HTML pages that need no network and no server. Everything is escaped by `maud`.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::pages::{cell_file, choice_words};
use super::{Figure, Material, figures, findings, words};
use crate::results::{CellResult, Convergence, Diagnosis, SweepResults, Verdict};
use crate::run::{ChainStatus, ExactComparison};
use crate::sweep::Cell;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("table.js");

fn page(title: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    }
    .into_string()
}

fn picture(figure: &Figure, to_root: &str) -> Markup {
    html! {
        figure {
            a href=(format!("{to_root}{}", figure.file)) {
                img src=(format!("{to_root}{}", figure.file)) alt=(figure.caption) loading="lazy";
            }
            figcaption { (figure.caption) }
        }
    }
}

/// The page that everything is reached from: question, answer, figures, cells.
pub(super) fn index(material: Material<'_>, figures: &[Figure], chosen: &[usize]) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let comparisons = findings::comparisons(material);
    let body = html! {
        h1 { (sweep.title) }
        @if !sweep.description.is_empty() { p.soft { (sweep.description) } }
        ul.answer { @for sentence in findings::sentences(material) { li { (sentence) } } }
        @if !comparisons.is_empty() {
            h2 { "Which findings are the method’s" }
            div.wide { table {
                thead { tr {
                    th { "setting" } th { "remark" } th { "as it should be" }
                    th { "as the faulty program computes it" } th { "finding" }
                } }
                tbody { @for c in &comparisons {
                    tr { td { (c.label) } td { (c.note) } td { (c.correct) } td { (c.faulty) } td { b { (c.verdict) } } }
                } }
            } }
        }
        h2 { "Figures" }
        @for figure in figures { (picture(figure, "")) }
        h2 id="cells" { "Cells" }
        p.soft {
            (choice_words(sweep.cells.len())) (words::interval_kinds(&results.cells))
            " Click a heading to sort."
        }
        input #filter type="search" placeholder="filter, as in: one-cluster c01" aria-label="filter the cells";
        div.wide { table.sortable {
            thead { tr {
                @for name in headings(material) { th { button { (name) } } }
            } }
            tbody { @for &cell in results.ranking() {
                (cell_row(material, cell, chosen.contains(&cell)))
            } }
        } }
        h2 { "Files" }
        p {
            @for name in ["chains", "cells", "topologies", "convergence"] {
                (name) " (" a href=(format!("{name}.parquet")) { "Parquet" } ", "
                a href=(format!("{name}.csv")) { "CSV" } ") · "
            }
            a href="report.md" { "report.md" } " · " a href="sweep.toml" { "sweep.toml" }
        }
        script { (PreEscaped(SCRIPT)) }
    };
    page(&sweep.title, &body)
}

fn headings(material: Material<'_>) -> Vec<String> {
    let factors = material
        .sweep
        .factors
        .iter()
        .map(|factor| words::axis_name(factor.key));
    let results = [
        "verdict",
        "recovery",
        "worlds converged",
        "truth mass",
        "ARI",
        "M",
        "acceptance",
        "burn-in",
        "chains agree",
        "distance to exact",
        "never settled",
        "failed",
        "missing",
    ];
    std::iter::once("cell".to_owned())
        .chain(factors)
        .chain(results.map(str::to_owned))
        .collect()
}

fn cell_row(material: Material<'_>, cell_ix: usize, has_page: bool) -> Markup {
    let (cell, result) = (
        &material.sweep.cells[cell_ix],
        &material.results.cells[cell_ix],
    );
    let sort =
        |value: Option<f64>| value.map_or_else(|| "-1".to_owned(), |value| value.to_string());
    let number =
        |value: Option<f64>, text: String| html! { td.number data-value=(sort(value)) { (text) } };
    html! {
        tr {
            td {
                @if has_page { a href=(cell_file(material, cell_ix)) { (cell.title()) } }
                @else { (cell.title()) }
                @if !cell.settings.faults().is_empty() { " " span.warn { "incorrect" } }
            }
            @for factor in &material.sweep.factors {
                td { (cell.settings.get(factor.key.name)) }
            }
            td data-value=(result.verdict as usize) { (badge(result.verdict, &words::verdict(result))) }
            (number(result.recovery.map(|rate| rate.rate), words::rate(result.recovery)))
            (number(result.converged_share(), words::gate(result)))
            (number(result.truth_mass, words::percent(result.truth_mass)))
            (number(result.adjusted_rand_index, words::number(result.adjusted_rand_index, 2)))
            (number(result.n_sets, words::number(result.n_sets, 1)))
            (number(result.acceptance_rate, words::percent(result.acceptance_rate)))
            (number(result.burn_in, words::number(result.burn_in, 0)))
            (number(result.map_agreement, words::percent(result.map_agreement)))
            (number(result.exact.largest, words::distance(result.exact.largest, result.exact.high)))
            td.number { (result.n_never_settled) "/" (result.n_chains) }
            td.number { (result.n_failed) }
            td.number { (result.n_missing) }
        }
    }
}

/// A verdict with the colour that it has in the figures.
fn badge(verdict: Verdict, words: &str) -> Markup {
    let colour = figures::verdict_colour(verdict);
    let mark = format!("--mark:rgb({},{},{})", colour.0, colour.1, colour.2);
    html! { span.verdict style=(mark) { (words) } }
}

/// The page of one cell.
pub(super) fn cell_page(material: Material<'_>, cell_ix: usize, shown: &[&Figure]) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let (cell, result) = (&sweep.cells[cell_ix], &results.cells[cell_ix]);
    let title = format!("{} · {}", cell.title(), sweep.title);
    let faults = cell.settings.faults();
    let body = html! {
        p { a href="../index.html#cells" { "← " (sweep.title) } }
        h1 { (cell.title()) }
        p.soft { (words::differing(sweep, cell)) }
        @if !cell.note.is_empty() { p { (cell.note) } }
        @if !faults.is_empty() { p.warn { "Incorrect on purpose: " (faults.join("; ")) "." } }
        p.answer { (badge(result.verdict, &words::verdict(result))) ". " (cell_sentence(result)) }
        @for figure in shown { (picture(figure, "../")) }
        h2 { "Convergence, world by world" }
        (convergence(results, cell_ix))
        h2 { "Chains" }
        div.wide { table {
            thead { tr { @for name in CHAIN_HEADINGS { th { (name) } } } }
            tbody { @for chain in results.chains_of(cell_ix) {
                tr {
                    td.number { (chain.replicate + 1) }
                    td.number { (chain.chain + 1) }
                    @match &chain.status {
                        ChainStatus::Failed { reason, .. } => td colspan="10" .warn { "failed: " (reason) },
                        ChainStatus::Done(outcome) => {
                            td { (outcome.recovered.map_or("unknown", |r| if r { "yes" } else { "no" })) }
                            td.number { (words::percent(outcome.truth_mass)) }
                            td.number { (words::number(outcome.adjusted_rand_index, 2)) }
                            td.number { (outcome.n_detections) }
                            td.number { (words::number(Some(outcome.mean_n_sets), 1)) }
                            td.number { (words::percent(Some(outcome.acceptance_rate))) }
                            td.number { (outcome.burn_in.map_or_else(words::dash, |n| n.to_string())) }
                            td { (outcome.burn_in_reason) }
                            td title=(exact_title(&outcome.exact)) { (exact_words(&outcome.exact)) }
                            td { (outcome.n_topologies) @if outcome.count_error_bound > 0 { " (truncated)" } }
                        }
                    }
                }
            } }
        } }
        @if let Some(command) = rerun_command(material, cell) {
            h2 { "Run its first world alone, from the report’s folder" }
            pre { (command) }
        }
        h2 { "Settings" }
        div.wide { table { tbody { @for (key, value) in cell.settings.iter() {
            @if key.name != "detections" {
                tr { td { code { (key.name) } } td { (value) " " (key.unit) } td.soft { (key.help) } }
            }
        } } } }
    };
    page(&title, &body)
}

const CHAIN_HEADINGS: [&str; 12] = [
    "world",
    "chain",
    "recovered",
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
        div.wide { table {
            thead { tr { @for name in WORLD_HEADINGS { th { (name) } } } }
            tbody { @for world in results.worlds_of(cell) {
                tr {
                    td.number { (world.replicate + 1) }
                    td.reason {
                        (badge(world.verdict, world.verdict.words()))
                        @if let Some(found) = &world.diagnosis { ": " (convergence_words(&found.convergence)) }
                    }
                    td { (world.n_planned - world.n_failed - world.n_missing) " (" (words::missingness(world.n_failed, world.n_missing)) ")" }
                    @if let Some(found) = &world.diagnosis {
                        @for quantity in [&found.n_sets, &found.ln_target] {
                            td.number { (words::measured(quantity.r_hat, 3)) }
                            td.number { (words::measured(quantity.ess_bulk, 0)) " / " (words::measured(quantity.ess_tail, 0)) }
                            td.number { (words::measured(quantity.mean.map(|mean| mean.mcse), 3)) }
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
    itself to one and the same topology and spends 95 % of its draws there. Words stand for what is undefined: constant, \
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

fn convergence_words(convergence: &Convergence) -> String {
    match convergence {
        Convergence::Mixes => "the chains mix and agree".to_owned(),
        Convergence::AtRest => "every chain came to rest at this topology".to_owned(),
        Convergence::Not(doubts) => {
            let sentences: Vec<String> = doubts.iter().map(ToString::to_string).collect();
            sentences.join("; ")
        }
    }
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

/// The command that samples the cell's first world again by itself.
fn rerun_command(material: Material<'_>, cell: &Cell) -> Option<String> {
    use crate::settings::Section;
    let data = super::detections_file(material, cell)?;
    let mut command = format!("ptm sample {data}");
    for (key, value) in cell.settings.iter() {
        let is_flag = matches!(
            key.section,
            Section::Model | Section::Sampler | Section::Run
        ) && key.name != "exact_up_to";
        if is_flag && *value != (key.default)() {
            command.push_str(&format!(
                " --{} {}",
                key.flag(),
                shell_word(&value.to_string())
            ));
        }
    }
    Some(command)
}

fn shell_word(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:=/".contains(c);
    if text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
