//! Rows of the source report's Fig. 7: one setting each, or many side by side.

use std::collections::BTreeMap;

use super::super::{Figure, Material, words};
use super::traces::chain_trace;
use super::worlds::walls_m;
use crate::dataset::DataSet;
use crate::figure::dimensionality_trace::DimensionalityTrace;
use crate::figure::figure7::{Figure7Column, Figure7Page, Figure7Row};
use crate::figure::scene::Scene;
use crate::figure::style::Style;
use crate::figure::topology_bars::{TopologyBar, TopologyBars};
use crate::figure::topology_map::{MapEdge, TopologyMap, topology_title};
use crate::map::TopometricMap;
use crate::partition::Topology;
use crate::results::{Answer, ChainResult};
use crate::run::{ChainOutcome, PosteriorTopology};
use crate::settings::Settings;
use crate::sweep::Design;

/// Topologies drawn for each setting, as in the source report's Fig. 7.
const N_SHOWN: usize = 3;
/// Width of one of several columns of rows.
const COLUMN_PX: u32 = 1800;

/// The row of the source report's Fig. 7 for one cell: its first world and chain.
pub(in crate::report) fn cell(material: Material<'_>, cell: usize) -> Option<Figure> {
    let row = figure7_row(material, cell)?;
    let settings = &material.sweep.cells[cell];
    let caption = format!(
        "{}: the three topologies sampled most after burn-in, their shares, and the number of sets M \
         after every proposal; on the first world, of the first chain with the MAP topology that is \
         found most often.",
        settings.title()
    );
    Some(Figure {
        file: format!("figures/cells/{}", settings.id),
        caption,
        scene: row_page(&row),
    })
}

/// The map that the cell's typical chain sampled most, small enough to be part of a page.
pub(in crate::report) fn cell_map(material: Material<'_>, cell: usize) -> Option<Figure> {
    let chain = typical_chain(material, cell)?;
    let (outcome, data) = (chain.outcome()?, data_of(material, chain)?);
    let top = outcome.top.first()?;
    let is_truth = top.is_truth.unwrap_or(false);
    let title = topology_title(1, Some(top.frequency), top.n_sets as usize, is_truth);
    let settings = &material.sweep.cells[cell];
    Some(Figure {
        file: format!("figures/cells/{}-map", settings.id),
        caption: format!(
            "The map of {}: the topology sampled most after burn-in on the first world, its detections by set.",
            settings.title()
        ),
        scene: topology_map(data, &top.labels, title).page(1400, 1000),
    })
}

fn data_of<'a>(material: Material<'a>, chain: &ChainResult) -> Option<&'a DataSet> {
    material.plan.data_sets[chain.data]
        .as_ref()
        .ok()
        .map(AsRef::as_ref)
}

fn figure7_row(material: Material<'_>, cell: usize) -> Option<Figure7Row> {
    let chain = typical_chain(material, cell)?;
    let (outcome, data) = (chain.outcome()?, data_of(material, chain)?);
    let cell = &material.sweep.cells[cell];
    let faults = cell.settings.faults();
    let mut settings = words::settings_line(cell);
    if !faults.is_empty() {
        settings = format!("INCORRECT: {}. {settings}", faults.join("; "));
    }
    Some(row_of(outcome, data, cell.title(), settings))
}

/// Of the chains on the cell's first world, the first whose MAP topology is the one found most often.
fn typical_chain<'a>(material: Material<'a>, cell: usize) -> Option<&'a ChainResult> {
    let chains = || {
        material
            .results
            .chains_of(cell)
            .filter(|chain| chain.replicate == 0)
    };
    let map = |chain: &ChainResult| Some(chain.outcome()?.top.first()?.labels.clone());
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for labels in chains().filter_map(map) {
        *counts.entry(labels).or_default() += 1;
    }
    let most = counts.values().max().copied()?;
    chains().find(|chain| map(chain).is_some_and(|labels| counts.get(&labels) == Some(&most)))
}

fn row_of(outcome: &ChainOutcome, data: &DataSet, title: String, settings: String) -> Figure7Row {
    let shown = outcome.top.iter().take(N_SHOWN);
    let shown = shown.map(|top| PosteriorTopology {
        labels: top.labels.clone(),
        n_sets: top.n_sets,
        probability: top.frequency,
        is_truth: top.is_truth,
    });
    let trace = DimensionalityTrace {
        title: String::new(),
        chains: vec![chain_trace(outcome, String::new())],
        burn_in: outcome.burn_in,
        truth: outcome.n_landmarks.map(|n| n as u32),
        m_range: None,
    };
    row_with(&shown.collect::<Vec<_>>(), data, (title, settings), trace)
}

/// A row of these topologies.
fn row_with(
    shown: &[PosteriorTopology],
    data: &DataSet,
    (title, settings): (String, String),
    trace: DimensionalityTrace,
) -> Figure7Row {
    let topologies = shown.iter().enumerate().map(|(k, top)| {
        let heading = topology_title(
            k + 1,
            Some(top.probability),
            top.n_sets as usize,
            top.is_truth.unwrap_or(false),
        );
        topology_map(data, &top.labels, heading)
    });
    let share: f64 = shown.iter().map(|top| top.probability).sum();
    let bars = shown.iter().enumerate().map(|(k, top)| TopologyBar {
        label: format!("#{}", k + 1),
        frequency: top.probability,
        is_truth: top.is_truth.unwrap_or(false),
    });
    Figure7Row {
        title,
        settings,
        topologies: topologies.collect(),
        bars: TopologyBars {
            title: String::new(),
            bars: bars.collect(),
            all_others: Some((1.0 - share).max(0.0)),
            highest: Some(1.0),
        },
        trace,
    }
}

/// What the posterior of a cell on its first world says: its likeliest topologies, and M in the reference chains.
fn posterior_row(material: Material<'_>, cell: usize, title: String) -> Option<Figure7Row> {
    let index = material.plan.posterior_of(cell, 0)?;
    let asked = &material.plan.posteriors()[index];
    let found = &material.results.posteriors[index];
    let data = material.plan.data_sets[asked.data].as_ref().ok()?;
    let answer = match found.answer {
        Some(Answer::Truth) => "the truth is the MAP topology of the posterior".to_owned(),
        Some(Answer::OtherMap) => "the posterior prefers another map to the truth".to_owned(),
        Some(Answer::Undecided(why)) => format!("UNDECIDED: {}", why.words()),
        None => "the truth is not known".to_owned(),
    };
    let chains = &found.chains;
    let by = if found.is_exact {
        "the exact posterior".to_owned()
    } else {
        words::counted(chains.len(), "reference chain")
    };
    let first_step = found.diagnosis.as_ref().map(|found| found.first_step);
    let trace = DimensionalityTrace {
        title: String::new(),
        chains: chains
            .iter()
            .map(|own| chain_trace(own, String::new()))
            .collect(),
        burn_in: first_step.filter(|first_step| *first_step > 0),
        truth: chains
            .first()
            .and_then(|own| own.n_landmarks)
            .map(|n| n as u32),
        m_range: None,
    };
    let n_shown = found.topologies.len().min(N_SHOWN);
    let shown = &found.topologies[..n_shown];
    Some(row_with(
        shown,
        data,
        (title, format!("{answer}; by {by}")),
        trace,
    ))
}

fn topology_map(data: &DataSet, labels: &str, title: String) -> TopologyMap {
    let positions_m = data.detections.positions_m();
    let topology: Topology = labels.parse().expect("labels that this program wrote");
    let map = TopometricMap::new(&topology, &positions_m);
    let edges = map.edges.iter().map(|edge| MapEdge {
        from_set: edge.first,
        to_set: edge.second,
        multiplicity: edge.weight,
    });
    TopologyMap {
        title,
        walls_m: walls_m(data),
        labels: topology
            .labels()
            .iter()
            .map(|&label| label as usize)
            .collect(),
        nodes_m: map.nodes_m.clone(),
        edges: edges.collect(),
        detections_m: positions_m,
    }
}

/// A list whose cells have variants: all rows of Fig. 7, the variants side by side.
pub(in crate::report) fn side_by_side(material: Material<'_>) -> Option<Figure> {
    let cells = &material.sweep.cells;
    if !matches!(material.sweep.design, Design::List(_))
        || cells.iter().any(|c| c.variant.is_empty())
    {
        return None;
    }
    let mut variants: Vec<&str> = cells.iter().map(|cell| cell.variant.as_str()).collect();
    variants.sort_unstable();
    variants.dedup();
    let mut labels: Vec<&str> = cells.iter().map(|cell| cell.label.as_str()).collect();
    labels.dedup();
    let column = |variant: &&str| {
        let row = |label: &&str| {
            let found = cells
                .iter()
                .position(|cell| cell.label == *label && cell.variant == *variant)?;
            let mut row = figure7_row(material, found)?;
            row.title = format!("({label})");
            Some(row)
        };
        Figure7Column {
            heading: (*variant).to_owned(),
            rows: labels.iter().map(row).collect(),
        }
    };
    let mut columns: Vec<Figure7Column> = variants.iter().map(column).collect();
    if !material.results.posteriors.is_empty() {
        let row = |label: &&str| {
            let mut own = (0..cells.len()).filter(|&cell| cells[cell].label == *label);
            own.find_map(|cell| posterior_row(material, cell, format!("({label})")))
        };
        columns.push(Figure7Column {
            heading: "what the posterior says".to_owned(),
            rows: labels.iter().map(row).collect(),
        });
    }
    let n_columns = columns.len() as u32;
    let page = Figure7Page {
        title: material.sweep.title.clone(),
        columns,
    };
    Some(Figure {
        file: "figures/side-by-side".to_owned(),
        caption: "Every setting, computed in each way: the three topologies sampled most after burn-in, \
                  their shares, and the number of sets M after every proposal, of the first chain with the \
                  MAP topology that is found most often. What the posterior says: the same of the posterior, which no \
                  fault of a sampler reaches, by the exact posterior or all reference chains."
            .to_owned(),
        scene: page.page(COLUMN_PX * n_columns.max(1)),
    })
}

/// The picture of `ptm sample`, as a PNG: the three topologies sampled most by the first chain, their
/// shares, and the trace of every chain.
pub fn sample_figure(
    outcomes: &[&ChainOutcome],
    data: &DataSet,
    settings: &Settings,
    title: String,
) -> Option<Scene> {
    let first = outcomes.first()?;
    let mut row = row_of(first, data, title, settings_words(settings));
    let name = |k: usize| {
        if outcomes.len() > 1 {
            format!("chain {}", k + 1)
        } else {
            String::new()
        }
    };
    let chains = outcomes.iter().enumerate();
    row.trace.chains = chains.map(|(k, o)| chain_trace(o, name(k))).collect();
    Some(row_page(&row))
}

/// The settings that a reader wants beside the picture.
fn settings_words(settings: &Settings) -> String {
    let faults = settings.faults();
    let incorrect = if faults.is_empty() {
        String::new()
    } else {
        format!("INCORRECT: {}. ", faults.join("; "))
    };
    let locations = if settings.is_idle("importance_samples") {
        "explicit locations".to_owned()
    } else {
        format!("R {}", settings.get("importance_samples"))
    };
    format!(
        "{incorrect}σₒ {} m, σₜ {} m, radius {} m, height {} nats, {locations}, init {}",
        settings.get("sigma_o"),
        settings.get("sigma_t"),
        settings.get("penalty_radius"),
        settings.get("penalty_height"),
        settings.get("init")
    )
}

/// A row by itself, as wide as a page and as high as its maps need.
fn row_page(row: &Figure7Row) -> Scene {
    const WIDTH_PX: u32 = 1900;
    let height_px = Figure7Row::natural_height_px(f64::from(WIDTH_PX), &Style::default());
    row.page(WIDTH_PX, height_px.ceil() as u32)
}
