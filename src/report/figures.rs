//! From results to figures: which numbers go where.

use std::collections::{BTreeMap, HashMap};

use super::words;
use super::{Figure, Material};
use crate::dataset::DataSet;
use crate::detections::Detections;
use crate::diagnostics::rate::Rate;
use crate::figure::dimensionality_trace::{ChainTrace, DimensionalityTrace, TraceBin};
use crate::figure::effects::{self, Effects, LevelEffect};
use crate::figure::figure7::{Figure7Column, Figure7Page, Figure7Row};
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::style::{Palette, Style};
use crate::figure::topology_bars::{TopologyBar, TopologyBars};
use crate::figure::topology_map::{MapEdge, TopologyMap, topology_title};
use crate::figure::traces_by_init::{InitTraces, TracesByInit};
use crate::figure::world_map::WorldMap;
use crate::map::TopometricMap;
use crate::partition::Topology;
use crate::results::{CellResult, ChainResult};
use crate::run::ChainOutcome;
use crate::sweep::{Cell, Design, Factor};

/// Topologies drawn for each setting, as in the source report's Fig. 7.
const N_SHOWN: usize = 3;
/// Worlds drawn at most.
const N_WORLDS: usize = 4;
/// Traces overlaid for one start at most; more only blacken the panel.
const N_TRACES: usize = 40;

/// The figures of the whole sweep, in the order in which they are read.
pub(super) fn summary(material: Material<'_>) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(side_by_side(material));
    figures.extend(effects(material));
    figures.extend(pair_recovery(material));
    figures.extend(all_cells(material, "recovery", "Recovery rate", |cell| {
        cell.recovery.map(|r| r.rate)
    }));
    figures.extend(all_cells(
        material,
        "acceptance",
        "Acceptance rate",
        |cell| cell.acceptance_rate,
    ));
    figures.extend(by_init(material));
    figures.extend(worlds(material));
    figures
}

/// The row of the source report's Fig. 7 for one cell: its first world and chain.
pub(super) fn cell(material: Material<'_>, cell: usize) -> Option<Figure> {
    let row = figure7_row(material, cell)?;
    let settings = &material.sweep.cells[cell];
    let caption = format!(
        "{}: the three topologies sampled most after burn-in, their shares, and the number of sets M \
         after every proposal; on the first world, of the first chain with the MAP topology that is \
         found most often.",
        settings.title()
    );
    Some(Figure {
        file: format!("figures/cells/{}.png", settings.id),
        caption,
        png: row_png(&row),
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
    let shown = || outcome.top.iter().take(N_SHOWN);
    let topologies = shown().enumerate().map(|(k, top)| {
        let heading = topology_title(
            k + 1,
            Some(top.frequency),
            top.n_sets as usize,
            top.is_truth.unwrap_or(false),
        );
        topology_map(data, &top.labels, heading)
    });
    let share: f64 = shown().map(|top| top.frequency).sum();
    let bars = shown().enumerate().map(|(k, top)| TopologyBar {
        label: format!("#{}", k + 1),
        frequency: top.frequency,
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
        trace: DimensionalityTrace {
            title: String::new(),
            chains: vec![chain_trace(outcome, String::new())],
            burn_in: outcome.burn_in,
            truth: outcome.n_landmarks.map(|n| n as u32),
            m_range: None,
        },
    }
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

fn walls_m(data: &DataSet) -> Vec<Vec<[f64; 2]>> {
    let Some(scene) = &data.scene else {
        return Vec::new();
    };
    scene
        .world
        .outer()
        .iter()
        .chain(scene.world.obstacles())
        .cloned()
        .collect()
}

fn chain_trace(outcome: &ChainOutcome, name: String) -> ChainTrace {
    let bins = outcome.n_sets_bins.iter();
    let bins = bins.map(|(first_step, min, max, mean)| TraceBin {
        first_step,
        min,
        max,
        mean,
    });
    ChainTrace {
        name,
        bins: bins.collect(),
        end_step: outcome.n_steps,
    }
}

/// A list whose cells have variants: all rows of Fig. 7, the variants side by side.
fn side_by_side(material: Material<'_>) -> Option<Figure> {
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
    let page = Figure7Page {
        title: material.sweep.title.clone(),
        columns: variants.iter().map(column).collect(),
    };
    Some(Figure {
        file: "figures/side-by-side.png".to_owned(),
        caption: "Every setting, computed in each way: the three topologies sampled most after burn-in, \
                  their shares, and the number of sets M after every proposal, of the first chain with the \
                  MAP topology that is found most often."
            .to_owned(),
        png: page.png(3600),
    })
}

fn level_names(factor: &Factor) -> Vec<String> {
    factor.levels.iter().map(words::level).collect()
}

fn effects(material: Material<'_>) -> Option<Figure> {
    let results = material.results;
    if results.effects.is_empty() {
        return None;
    }
    let factors = results.effects.iter().map(|effect| {
        let factor = &material.sweep.factors[effect.factor];
        let levels =
            level_names(factor)
                .into_iter()
                .zip(&effect.by_level)
                .map(|(label, marginal)| {
                    let interval = |m: &Rate| {
                        let (low, high) = m.interval.map_or((m.rate, m.rate), |i| (i.low, i.high));
                        effects::Interval {
                            low,
                            estimate: m.rate,
                            high,
                        }
                    };
                    LevelEffect {
                        label,
                        rate: marginal.as_ref().map(interval),
                    }
                });
        effects::FactorEffect {
            name: words::axis_name(factor.key),
            note: format!("range {:.2}", effect.range),
            levels: levels.collect(),
        }
    });
    let n = results.effects.len();
    let rows = n.div_ceil(4) as u32;
    let figure = Effects {
        title: String::new(),
        factors: factors.collect(),
        value_name: "Recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
    };
    let unit = if material.sweep.is_simulated() {
        "worlds"
    } else {
        "chain numbers"
    };
    Some(Figure {
        file: "figures/effects.png".to_owned(),
        caption: format!(
            "Which knob matters: the recovery rate at each level of each factor, {}, by falling range. \
             Whiskers: 95 % intervals over {unit}.",
            if matches!(material.sweep.design, Design::OneAtATime(_)) {
                "all others at the baseline"
            } else {
                "averaged over all others"
            }
        ),
        png: figure.png(2000, 120 + 520 * rows),
    })
}

fn pair_recovery(material: Material<'_>) -> Option<Figure> {
    let pair = material.results.pair.as_ref()?;
    let factor = |ix: usize| &material.sweep.factors[ix];
    let heat_factor = |ix: usize| HeatFactor {
        name: words::axis_name(factor(ix).key),
        levels: level_names(factor(ix)),
    };
    let values: Vec<Option<&Rate>> = pair
        .by_levels
        .iter()
        .flatten()
        .map(Option::as_ref)
        .collect();
    let text = |rate: &Option<&Rate>| words::rate(rate.copied()).replacen(" [", "\n[", 1);
    let figure = HeatMap {
        title: String::new(),
        row_factors: vec![heat_factor(pair.rows)],
        column_factors: vec![heat_factor(pair.columns)],
        values: values
            .iter()
            .map(|marginal| marginal.map(|m| m.rate))
            .collect(),
        texts: values.iter().map(text).collect(),
        value_name: "Recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
        palette: Palette::Viridis,
    };
    Some(Figure {
        file: "figures/recovery-pair.png".to_owned(),
        caption: format!(
            "Recovery rate by the two factors that matter most, {} and {}, with 95 % intervals over worlds.",
            factor(pair.rows).key.label(),
            factor(pair.columns).key.label()
        ),
        png: figure.png(1600, 1000),
    })
}

/// Every cell of the sweep in one heat map: nested factors for a grid, labels otherwise.
fn all_cells(
    material: Material<'_>,
    file: &str,
    what: &str,
    value: impl Fn(&CellResult) -> Option<f64>,
) -> Option<Figure> {
    let cells = &material.results.cells;
    let values: Vec<Option<f64>> = cells.iter().map(value).collect();
    if values.iter().all(Option::is_none) {
        return None;
    }
    let is_recovery = file == "recovery";
    let text = |cell: usize| match (is_recovery, values[cell]) {
        (true, _) => words::rate(cells[cell].recovery).replacen(" [", "\n[", 1),
        (false, value) => words::percent(value),
    };
    let highest = values.iter().flatten().copied().fold(0.0, f64::max);
    let range = (
        0.0,
        if is_recovery {
            1.0
        } else {
            nice_ceiling(highest)
        },
    );
    let (rows, columns) = layout(material);
    let side = |factors: &[Side]| -> Vec<HeatFactor> {
        factors
            .iter()
            .map(|s| HeatFactor {
                name: s.name.clone(),
                levels: s.levels.clone(),
            })
            .collect()
    };
    let places = places(&rows, &columns);
    let cell_of = coordinates(material);
    let cell_at: Vec<Option<usize>> = places
        .iter()
        .map(|place| cell_of.get(place).copied())
        .collect();
    let n_columns: usize = columns
        .iter()
        .map(|s| s.levels.len())
        .product::<usize>()
        .max(1);
    let n_rows = places.len() / n_columns;
    let figure = HeatMap {
        title: String::new(),
        row_factors: side(&rows),
        column_factors: side(&columns),
        values: cell_at
            .iter()
            .map(|cell| cell.and_then(|cell| values[cell]))
            .collect(),
        texts: cell_at
            .iter()
            .map(|cell| cell.map_or_else(String::new, text))
            .collect(),
        value_name: what.to_owned(),
        range,
        percent: true,
        palette: if is_recovery {
            Palette::Viridis
        } else {
            Palette::Cividis
        },
    };
    let (width, height) = (900 + 60 * n_columns as u32, 420 + 44 * n_rows as u32);
    Some(Figure {
        file: format!("figures/{file}.png"),
        caption: format!("{what} of every cell; factors nested, the outermost matter most."),
        png: figure.png(width.clamp(1400, 2600), height.clamp(700, 2400)),
    })
}

/// The next of 0.01, 0.02, 0.05, 0.1, … at or above a share.
fn nice_ceiling(share: f64) -> f64 {
    [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
        .into_iter()
        .find(|&ceiling| share <= ceiling)
        .unwrap_or(1.0)
}

/// One factor of one side of the heat map of all cells.
struct Side {
    name: String,
    levels: Vec<String>,
}

/// Rows and columns of the heat map of all cells, outer to inner: for a grid the strongest factors
/// outermost, alternating between the sides; otherwise labels by variants.
fn layout(material: Material<'_>) -> (Vec<Side>, Vec<Side>) {
    if let Design::Grid(_) = material.sweep.design {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (k, factor) in order_of_factors(material).into_iter().enumerate() {
            let factor = &material.sweep.factors[factor];
            let side = Side {
                name: words::axis_name(factor.key),
                levels: level_names(factor),
            };
            if k % 2 == 0 {
                columns.push(side)
            } else {
                rows.push(side)
            }
        }
        return (rows, columns);
    }
    let (labels, variants) = labels_and_variants(material);
    let rows = Side {
        name: "Cell".to_owned(),
        levels: labels,
    };
    let columns = Side {
        name: String::new(),
        levels: variants,
    };
    (vec![rows], vec![columns])
}

fn labels_and_variants(material: Material<'_>) -> (Vec<String>, Vec<String>) {
    let (mut labels, mut variants) = (Vec::new(), Vec::new());
    for cell in &material.sweep.cells {
        let label = if cell.label.is_empty() {
            cell.id.clone()
        } else {
            cell.label.clone()
        };
        if !labels.contains(&label) {
            labels.push(label);
        }
        if !variants.contains(&cell.variant) {
            variants.push(cell.variant.clone());
        }
    }
    (labels, variants)
}

fn order_of_factors(material: Material<'_>) -> Vec<usize> {
    let mut order: Vec<usize> = material
        .results
        .effects
        .iter()
        .map(|effect| effect.factor)
        .collect();
    order.extend(
        (0..material.sweep.factors.len())
            .filter(|f| !order.contains(f))
            .collect::<Vec<_>>(),
    );
    order
}

/// Every cell by its levels: along the rows, then along the columns.
fn coordinates(material: Material<'_>) -> HashMap<Vec<usize>, usize> {
    let sweep = material.sweep;
    let place = |names: &[String], name: &String| {
        names
            .iter()
            .position(|known| known == name)
            .expect("a name that was collected")
    };
    if !matches!(sweep.design, Design::Grid(_)) {
        let (labels, variants) = labels_and_variants(material);
        let of_cell = |cell: &Cell| {
            let label = if cell.label.is_empty() {
                &cell.id
            } else {
                &cell.label
            };
            vec![place(&labels, label), place(&variants, &cell.variant)]
        };
        return sweep.cells.iter().map(of_cell).zip(0..).collect();
    }
    let order = order_of_factors(material);
    let level = |cell: &Cell, factor: usize| {
        let factor = &sweep.factors[factor];
        let value = cell.settings.get(factor.key.name);
        factor
            .levels
            .iter()
            .position(|level| level == value)
            .expect("a level of the factor")
    };
    let of_cell = |cell: &Cell| -> Vec<usize> {
        let (columns, rows) = (order.iter().step_by(2), order.iter().skip(1).step_by(2));
        rows.chain(columns)
            .map(|&factor| level(cell, factor))
            .collect()
    };
    sweep.cells.iter().map(of_cell).zip(0..).collect()
}

/// Levels of every place of the heat map, row by row.
fn places(rows: &[Side], columns: &[Side]) -> Vec<Vec<usize>> {
    let mut places = vec![Vec::new()];
    for side in rows.iter().chain(columns) {
        let extended = places.iter().flat_map(|place: &Vec<usize>| {
            (0..side.levels.len()).map(|level| [place.as_slice(), &[level]].concat())
        });
        places = extended.collect();
    }
    places
}

fn by_init(material: Material<'_>) -> Option<Figure> {
    let mut inits: Vec<InitTraces> = Vec::new();
    let mut truth: Vec<u64> = Vec::new();
    let mut n_total = 0;
    for chain in &material.results.chains {
        let Some(outcome) = chain.outcome() else {
            continue;
        };
        n_total += 1;
        truth.extend(outcome.n_landmarks);
        let name = material.sweep.cells[chain.cell].settings.text("init");
        if !inits.iter().any(|init| init.name == name) {
            inits.push(InitTraces {
                name: name.to_owned(),
                chains: Vec::new(),
            });
        }
        if let Some(init) = inits.iter_mut().find(|init| init.name == name) {
            init.chains.push(chain_trace(outcome, String::new()));
        }
    }
    if inits.is_empty() {
        return None;
    }
    for init in &mut inits {
        let n = init.chains.len();
        if n > N_TRACES {
            let mut place = 0;
            init.chains.retain(|_| {
                place += 1;
                // Every k-th, evenly: the cells of a sweep are ordered by their factors.
                (place * N_TRACES) / n != ((place - 1) * N_TRACES) / n
            });
        }
    }
    truth.dedup();
    let shown: usize = inits.iter().map(|init| init.chains.len()).sum();
    let figure = TracesByInit {
        title: String::new(),
        inits,
        truth: match truth.as_slice() {
            [n] => Some(*n as u32),
            _ => None,
        },
        burn_in: None,
    };
    Some(Figure {
        file: "figures/traces-by-init.png".to_owned(),
        caption: format!(
            "Number of sets M after every proposal, by initial topology: {shown} of {n_total} chains, \
             evenly over the cells."
        ),
        png: figure.png(2000, 760),
    })
}

fn worlds(material: Material<'_>) -> Vec<Figure> {
    let mut seen = Vec::new();
    for task in material
        .plan
        .tasks
        .iter()
        .filter(|task| task.replicate == 0)
    {
        if !seen.iter().any(|(data, _)| *data == task.data) {
            seen.push((task.data, task.cell));
        }
    }
    let n_worlds = seen.len();
    let mut figures = Vec::new();
    for (place, (data, cell)) in seen.into_iter().take(N_WORLDS).enumerate() {
        let Ok(data) = &material.plan.data_sets[data] else {
            continue;
        };
        let cell = &material.sweep.cells[cell];
        let what = match &data.scene {
            Some(scene) => format!("World {}, first replicate", scene.world.name()),
            None => "The detections".to_owned(),
        };
        let noise = match (&data.scene, n_worlds) {
            (Some(_), 2..) => format!(", noise {}", cell.settings.get("noise")),
            _ => String::new(),
        };
        figures.push(Figure {
            file: format!("figures/world-{}.png", place + 1),
            caption: format!(
                "{what}{noise}: {} detections in the order of the mission, with 2σ ellipses.",
                data.detections.len()
            ),
            png: world_map(data, String::new()).png(1600, 1400),
        });
    }
    figures
}

fn world_map(data: &DataSet, title: String) -> WorldMap {
    let path = |poses: Option<&Vec<crate::sighting::Pose>>| {
        poses.map_or_else(Vec::new, |poses| {
            poses.iter().map(|pose| pose.position_m()).collect()
        })
    };
    let scene = data.scene.as_ref();
    WorldMap {
        title,
        walls_m: walls_m(data),
        believed_path_m: path(scene.map(|scene| &scene.believed_path)),
        true_path_m: path(scene.map(|scene| &scene.true_path)),
        detections_m: data.detections.positions_m(),
        covariances_m2: covariances_m2(&data.detections),
        ellipse_sigmas: 2.0,
    }
}

fn covariances_m2(detections: &Detections) -> Vec<[[f64; 2]; 2]> {
    let all = detections.covariances_m2().unwrap_or_default();
    all.into_iter()
        .map(|c| [[c.xx, c.xy], [c.xy, c.yy]])
        .collect()
}

/// The map of a simulation, as a PNG: walls, believed and true path, detections with 2σ ellipses.
pub fn simulation_figure(data: &DataSet, title: String) -> Vec<u8> {
    world_map(data, title).png(1600, 1400)
}

/// The picture of `ptm sample`, as a PNG: the three topologies sampled most by the first chain, their
/// shares, and the trace of every chain.
pub fn sample_figure(
    outcomes: &[ChainOutcome],
    data: &DataSet,
    title: String,
    settings: String,
) -> Option<Vec<u8>> {
    let first = outcomes.first()?;
    let mut row = row_of(first, data, title, settings);
    let name = |k: usize| {
        if outcomes.len() > 1 {
            format!("chain {}", k + 1)
        } else {
            String::new()
        }
    };
    row.trace.chains = outcomes
        .iter()
        .enumerate()
        .map(|(k, o)| chain_trace(o, name(k)))
        .collect();
    Some(row_png(&row))
}

/// A row by itself, as wide as a page and as high as its maps need.
fn row_png(row: &Figure7Row) -> Vec<u8> {
    const WIDTH_PX: u32 = 1900;
    let height_px = Figure7Row::natural_height_px(f64::from(WIDTH_PX), &Style::default());
    row.png(WIDTH_PX, height_px.ceil() as u32)
}
