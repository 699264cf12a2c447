//! The page of a diagnosis of label chains: one file.

use maud::html;

use super::super::section::{Entry, Section, Table};
use super::super::summary::verdict_line;
use super::super::{Figure, figures};
use super::{section, still, still_page};
use crate::results::labels::{LabelChainSummary, LabelsResult};
use crate::results::sample::{Estimate, JudgedSummary, Measured};

/// Rows of the table of topologies.
const N_TOPOLOGIES: usize = 20;
/// Characters of labels that a table shows.
const MOST_LABELS: usize = 160;

/// The page, with the picture in it.
pub fn labels_page(found: &LabelsResult, title: &str) -> String {
    let (n_chains, n_draws, n_items) = (found.chains.len(), found.n_draws, found.n_items);
    let chains = if n_chains == 1 { "chain" } else { "chains" };
    let doubts = found.convergence.as_ref().map(|own| own.doubts.as_slice());
    let doubts = doubts.unwrap_or_default();
    let figure = Figure {
        file: String::new(),
        caption:
            "M, the number of sets, draw by draw; the topologies drawn most; and how probable \
                  it is that two items share a set, with the sets of the VI estimate framed."
                .to_owned(),
        scene: figures::labels_figure(found, String::new()),
    };
    let parts = [
        estimates(found),
        answers(found),
        judged(found),
        topologies(found),
        of_chains(found),
    ];
    let body = html! {
        h1 { (title) }
        p { (n_chains) " " (chains) " of " (n_draws) " draws of " (n_items) " items." }
        p { b { (verdict_line(found.convergence.as_ref())) } }
        @if doubts.len() > 1 {
            p { "What speaks against it:" }
            ul { @for doubt in doubts { li { (doubt) } } }
        }
        (still(&figure))
        @for part in parts.iter().flatten() { (section(part, "")) }
    };
    still_page(title, &body)
}

/// A number with so many digits, or why it is none.
fn number(measured: &Measured, digits: usize) -> Entry {
    let value = measured.value.map(|value| format!("{value:.digits$}"));
    value.unwrap_or_else(|| measured.state.to_owned()).into()
}

fn percent(share: f64) -> Entry {
    format!("{:.1} %", 100.0 * share).into()
}

fn shortened(labels: &str) -> Entry {
    match labels.char_indices().nth(MOST_LABELS) {
        Some((end, _)) => format!("{}…", &labels[..end]).into(),
        None => labels.into(),
    }
}

fn judged(found: &LabelsResult) -> Option<Section> {
    let rows = found.convergence.iter().flat_map(|own| &own.judged);
    // The worst first; what is undefined before all others.
    let mut rows: Vec<&JudgedSummary> = rows.collect();
    let ess = |own: &JudgedSummary| own.ess.value.unwrap_or(0.0);
    rows.sort_by(|a, b| ess(a).total_cmp(&ess(b)));
    let row = |own: &JudgedSummary| {
        vec![
            own.quantity.clone().into(),
            number(&own.r_hat, 3),
            number(&own.ess, 0),
        ]
    };
    Section::of_table(
        "judged",
        "What the verdict rests on",
        "What the chains are unsure of. Each needs R-hat of at most 1.01 and 100 effective draws a \
         chain.",
        Table::new(
            &["quantity", "R-hat", "effective draws"],
            rows.into_iter().map(row),
        ),
    )
}

fn answers(found: &LabelsResult) -> Option<Section> {
    if found.representatives.len() < 2 {
        return None;
    }
    let rows = found.representatives.iter().map(|own| {
        vec![
            format!("{:.1} ± {:.1} %", 100.0 * own.weight, 100.0 * own.weight_se).into(),
            own.n_sets.to_string().into(),
            format!("{:.3}", own.mean_distance).into(),
            shortened(&own.topology.to_string()),
        ]
    });
    let head = ["share of draws", "M", "mean distance, nats", "labels"];
    Section::of_table(
        "answers",
        "Several answers",
        "One topology does not stand for the posterior. These do together, each for the draws that \
         are nearest to it by variation of information.",
        Table::new(&head, rows),
    )
}

fn estimates(found: &LabelsResult) -> Option<Section> {
    let row = |own: &Estimate| {
        let unit = if own.loss == "vi" { "nats" } else { "of pairs" };
        let labels: Vec<String> = own.labels.iter().map(ToString::to_string).collect();
        vec![
            own.kind.to_uppercase().into(),
            own.n_sets.to_string().into(),
            percent(own.frequency),
            format!("{:.3} {unit}", own.credible_ball.radius).into(),
            shortened(&labels.join(",")),
        ]
    };
    Section::of_table(
        "estimates",
        "One topology for the posterior",
        "MAP is the topology drawn most. Binder and VI have the least expected loss: the share of \
         pairs that are treated otherwise, and the variation of information.",
        Table::new(
            &[
                "estimate",
                "M",
                "share of draws",
                "95 % of draws within",
                "labels",
            ],
            found.estimates.iter().map(row),
        ),
    )
}

fn topologies(found: &LabelsResult) -> Option<Section> {
    let rows = found.topologies.iter().take(N_TOPOLOGIES).enumerate();
    let rows = rows.map(|(place, own)| {
        vec![
            (place + 1).to_string().into(),
            format!("{:.2} %", 100.0 * own.frequency).into(),
            own.topology.n_sets().to_string().into(),
            shortened(&own.topology.to_string()),
        ]
    });
    let counted = if found.truncated { "held" } else { "distinct" };
    Section::of_table(
        "topologies",
        "Topologies drawn most",
        &format!(
            "{} {counted} topologies after the burn-in.",
            found.n_topologies
        ),
        Table::new(&["", "share of draws", "M", "labels"], rows),
    )
}

fn of_chains(found: &LabelsResult) -> Option<Section> {
    let row = |own: &LabelChainSummary| {
        let burn_in = own.burn_in.map_or_else(
            || format!("none found: {}", own.burn_in_reason),
            |n| n.to_string(),
        );
        vec![
            own.name.clone().into(),
            burn_in.into(),
            format!("{:.3}", own.mean_n_sets).into(),
            percent(own.map_frequency),
        ]
    };
    Section::of_table(
        "chains",
        "Chain by chain",
        "The largest burn-in is left out of every chain.",
        Table::new(
            &[
                "chain",
                "burn-in, draws",
                "mean of M",
                "share at its MAP topology",
            ],
            found.chains.iter().map(row),
        ),
    )
}
