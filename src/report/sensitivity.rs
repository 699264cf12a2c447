//! The section on what each factor does to each response: sentences, figures and one table.

use super::section::{Block, Entry, Section, Table};
use super::{Material, figures, words};
use crate::diagnostics::estimate_noise::RECOMMENDED_SD;
use crate::results::NoiseBySamples;
use crate::results::sensitivity::{Contrast, Gate, Response, Sensitivity};
use crate::settings::Key;

/// Interactions named in a sentence at most.
const N_INTERACTIONS: usize = 3;

/// The largest difference that one factor makes to one response, in words.
struct Row {
    response: &'static str,
    factor: String,
    levels: String,
    difference: String,
    p: String,
    gate: String,
    missing: String,
}

const HEADINGS: [&str; 7] = [
    "response",
    "factor",
    "largest difference",
    "by how much",
    "p (Holm)",
    "converged there",
    "chains without outcome",
];

const EXPLANATION: &str = "For each response and factor the two levels that differ most, paired by world: the difference is taken on each world \
     and then averaged, with Student's 95 % interval over worlds. p is Holm's over all pairs of levels of all factors, so below 0.05 is more \
     than chance; converged: cells and worlds on which the chains are shown to have converged, at the one level and at the other. The tables effects, \
     contrasts and interactions have all of them.";

/// The section; none for a list of cells.
pub(super) fn section(material: Material<'_>) -> Option<Section> {
    let rows = rows(material);
    if rows.is_empty() {
        return None;
    }
    let mut blocks: Vec<Block> = sentences(material).into_iter().map(Block::Text).collect();
    blocks.extend(figures::indices(material).map(Block::from));
    blocks.extend(figures::curves(material).into_iter().map(Block::from));
    blocks.push(Block::Text(EXPLANATION.to_owned()));
    blocks.push(Block::Table(Table {
        head: HEADINGS.map(str::to_owned).to_vec(),
        rows: rows.into_iter().map(Row::entries).collect(),
    }));
    Some(Section {
        id: "sensitivity".into(),
        title: "What each factor does".to_owned(),
        blocks,
    })
}

impl Row {
    fn entries(self) -> Vec<Entry> {
        [
            self.response.to_owned(),
            self.factor,
            self.levels,
            self.difference,
            self.p,
            self.gate,
            self.missing,
        ]
        .map(Entry::from)
        .into()
    }
}

/// "σₒ" or "radius D".
fn label(found: &Sensitivity, factor: usize) -> &'static str {
    let key: &Key = found.factors[factor].key;
    key.label()
}

fn rows(material: Material<'_>) -> Vec<Row> {
    let found = &material.results.sensitivity;
    let of = |response: Response| {
        let strongest = found.strongest(response).into_iter();
        strongest.map(move |contrast| row(found, response, contrast))
    };
    found.responses().into_iter().flat_map(of).collect()
}

fn row(found: &Sensitivity, response: Response, contrast: &Contrast) -> Row {
    let levels = &found.factors[contrast.factor].labels;
    let gate = |level: usize| {
        let curve = found.curve(response, contrast.factor);
        curve.get(level).map_or_else(Gate::default, |row| row.gate)
    };
    let (from, to) = (gate(contrast.from), gate(contrast.to));
    Row {
        response: response.words(),
        factor: label(found, contrast.factor).to_owned(),
        levels: format!("{} → {}", levels[contrast.from], levels[contrast.to]),
        difference: difference(response, contrast),
        p: p_value(contrast.p_holm),
        gate: format!(
            "{} → {}",
            words::percent(from.converged_share()),
            words::percent(to.converged_share())
        ),
        missing: words::missingness(from.n_failed + to.n_failed, from.n_missing + to.n_missing),
    }
}

/// "+12 points [4, 20]" of shares, "+1.2 [0.3, 2.1]" of other numbers.
fn difference(response: Response, contrast: &Contrast) -> String {
    let Some(estimate) = contrast.estimate else {
        return words::dash();
    };
    let (scale, digits, unit) = match response {
        Response::Acceptance => (100.0, 2, " points"),
        _ if response.is_share() => (100.0, 0, " points"),
        _ => (1.0, 2, ""),
    };
    let signed = |x: f64| format!("{:+.digits$}", scale * x).replace('-', "−");
    match estimate.interval {
        Some(i) => format!(
            "{}{unit} [{}, {}]",
            signed(estimate.mean),
            signed(i.low),
            signed(i.high)
        ),
        None if estimate.n == 1 => format!("{}{unit} (one unit)", signed(estimate.mean)),
        None => format!("{}{unit} (all {} agree)", signed(estimate.mean), estimate.n),
    }
}

fn p_value(p: Option<f64>) -> String {
    match p {
        None => words::dash(),
        Some(p) if p < 0.001 => "< 0.001".to_owned(),
        Some(p) => format!("{p:.3}"),
    }
}

fn sentences(material: Material<'_>) -> Vec<String> {
    let found = &material.results.sensitivity;
    let mut sentences = Vec::new();
    sentences.extend(
        found
            .responses()
            .into_iter()
            .map(|response| of_response(found, response)),
    );
    if !found.round_baseline && !found.is_sampled {
        sentences.push(interactions(found));
    }
    sentences.extend(noise(material));
    sentences
}

/// Which number of importance samples suffices.
fn noise(material: Material<'_>) -> Option<String> {
    let found = &material.results.noise_by_samples;
    if found.is_empty() {
        return None;
    }
    let part = |own: &NoiseBySamples| {
        format!(
            "R = {}: {:.2} (too noisy in {} of {}, fewer samples would do in {})",
            own.n_samples,
            own.median_sd,
            own.n_too_few,
            words::counted(own.n_cells, "cell"),
            own.n_more_than_needed
        )
    };
    let parts: Vec<String> = found.iter().map(part).collect();
    let (low, high) = RECOMMENDED_SD;
    Some(format!(
        "Noise of the log estimate at the states visited, its standard deviation in nats, median over cells: {}. With new draws for \
         every proposal, {low} to {high} gives the most effective draws for the work. With common draws the noise is that of a difference of two \
         estimates, and more of it does no harm.",
        parts.join("; ")
    ))
}

/// Which factors change a response by more than chance explains.
fn of_response(found: &Sensitivity, response: Response) -> String {
    let strongest = found.strongest(response);
    let clear: Vec<String> = (found.upheld(response).into_iter())
        .map(|row| {
            let levels = &found.factors[row.factor].labels;
            format!(
                "{} ({} from {} to {}, p {})",
                label(found, row.factor),
                difference(response, row),
                levels[row.from],
                levels[row.to],
                p_value(row.p_holm)
            )
        })
        .collect();
    let what = response.words();
    let n_units = strongest.iter().filter_map(|row| Some(row.estimate?.n));
    let unit = if found.over_worlds {
        "world"
    } else {
        "chain number"
    };
    let n = words::counted(n_units.max().unwrap_or(0), unit);
    if clear.is_empty() {
        let smallest = strongest
            .iter()
            .filter_map(|row| row.p_holm)
            .reduce(f64::min);
        return format!(
            "{what}: no factor has an effect beyond chance (5 %, Holm; smallest p {}, {n}).",
            p_value(smallest)
        );
    }
    format!(
        "{what}: effects beyond chance (5 %, Holm, {n}): {}.",
        clear.join("; ")
    )
}

fn interactions(found: &Sensitivity) -> String {
    let response = Response::Recovery;
    let clear = found.clear_interactions(response);
    let mut seen = std::collections::HashSet::new();
    let named: Vec<String> = (clear.iter())
        .filter(|row| seen.insert(row.factors))
        .take(N_INTERACTIONS)
        .filter_map(|row| {
            let labels = |factor: usize, level: usize| {
                format!(
                    "{} {}",
                    label(found, factor),
                    found.factors[factor].labels[level]
                )
            };
            Some(format!(
                "{} with {} ({:+.0} points beyond the sum of both)",
                labels(row.factors.0, row.levels.0),
                labels(row.factors.1, row.levels.1),
                100.0 * row.interaction?.mean
            ))
        })
        .collect();
    if named.is_empty() {
        return "Interactions: no two factors act together on the recovery rate beyond chance (5 %, Holm).".to_owned();
    }
    format!(
        "Interactions on the recovery rate, the clearest: {}.",
        named.join("; ")
    )
}
