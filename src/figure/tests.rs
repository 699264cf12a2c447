//! Every figure drawn from realistic and from extreme numbers: no panic, the same bytes twice, all
//! text on the page and none over other text.
//!
//! With `PTM_FIGURE_GALLERY=DIR` the images are written there to be looked at.

use super::axes::{Axis, Scale};
use super::chains_page::ChainsPage;
use super::dimensionality_trace::{ChainTrace, DimensionalityTrace, TraceBin};
use super::effects::{Effects, FactorEffect, Interval, LevelEffect};
use super::factor_indices::{FactorIndices, IndexPanel, IndexRow};
use super::figure7::{Figure7Column, Figure7Page, Figure7Row};
use super::heat_map::{HeatCategory, HeatFactor, HeatMap};
use super::nested_loop::{LoopFactor, NestedLoop};
use super::plane::{Plane, PlaneKey, PlanePoint};
use super::rank_ecdf::{RankEcdfPlot, RankLine};
use super::response_curves::{Curve, CurvePanel, ResponseCurves};
use super::scaling::{Scaling, ScalingLine};
use super::scene::{Hover, Rect, Scene};
use super::small_multiples::{MultiplePanel, Series, SmallMultiples};
use super::style::{MUTED, Palette, SERIES, STATUS};
use super::topology_bars::{TopologyBar, TopologyBars};
use super::topology_by_chain::{TopologyByChain, TopologyGroup};
use super::topology_map::{MapEdge, TopologyMap, topology_title};
use super::traces_by_init::{InitTraces, TracesByInit};
use super::world_map::WorldMap;
use super::{cut_page, page};

const CORNERS_M: [[f64; 2]; 8] = [
    [-10.0, -10.0],
    [45.0, -10.0],
    [25.0, 10.0],
    [10.0, 10.0],
    [10.0, 25.0],
    [-10.0, 45.0],
    [45.0, 45.0],
    [25.0, 25.0],
];

const LONG: &str =
    "penalty radius in metres with a needlessly long explanation that goes on and on";

/// Uniform on [0, 1), from a multiplicative congruence: the tests need numbers, not randomness.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn around(&mut self, width: f64) -> f64 {
        (self.next() - 0.5) * 2.0 * width
    }
}

fn square(low: f64, high: f64) -> Vec<[f64; 2]> {
    vec![[low, low], [high, low], [high, high], [low, high]]
}

fn walls() -> Vec<Vec<[f64; 2]>> {
    vec![square(-10.0, 45.0), square(10.0, 25.0)]
}

fn detections() -> Vec<[f64; 2]> {
    let mut noise = Noise(3);
    let visit = |drift: f64, noise: &mut Noise| {
        CORNERS_M.map(|[x, y]| {
            [
                x + drift + noise.around(1.0),
                y - drift * 0.7 + noise.around(1.2),
            ]
        })
    };
    [visit(0.0, &mut noise), visit(2.2, &mut noise)].concat()
}

fn covariances() -> Vec<[[f64; 2]; 2]> {
    let mut noise = Noise(5);
    let mut one = || {
        let (a, d) = (0.1 + 1.7 * noise.next(), 0.1 + 1.7 * noise.next());
        let b = noise.around(0.8) * (a * d).sqrt();
        [[a, b], [b, d]]
    };
    (0..16).map(|_| one()).collect()
}

/// Once and a quarter round the ring, drifting.
fn ring_path(drift: f64) -> Vec<[f64; 2]> {
    let stops = [
        [0.0, 0.0],
        [35.0, 0.0],
        [35.0, 35.0],
        [0.0, 35.0],
        [0.0, 0.0],
        [35.0, 0.0],
        [35.0, 12.0],
    ];
    let legs = stops.windows(2).flat_map(|leg| {
        (0..50).map(move |k| f64::from(k) / 50.0).map(move |t| {
            [
                leg[0][0] + t * (leg[1][0] - leg[0][0]),
                leg[0][1] + t * (leg[1][1] - leg[0][1]),
            ]
        })
    });
    let n = 300.0;
    legs.enumerate()
        .map(|(i, [x, y])| {
            let s = i as f64 / n;
            [
                x + drift * s * 2.5 + drift * (s * 23.0).sin() * 0.3,
                y - drift * s * 1.8 + drift * (s * 31.0).cos() * 0.3,
            ]
        })
        .collect()
}

fn world() -> WorldMap {
    WorldMap {
        title: "Noisy square ring: what the robot saw".to_owned(),
        walls_m: walls(),
        believed_path_m: ring_path(1.0),
        true_path_m: ring_path(0.0),
        detections_m: detections(),
        covariances_m2: covariances(),
        ellipse_sigmas: 2.0,
    }
}

fn topology(rank: usize, frequency: f64, labels: &[usize]) -> TopologyMap {
    let detections_m = detections();
    let n_sets = labels.iter().max().map_or(0, |m| m + 1);
    let nodes_m = (0..n_sets)
        .map(|set| {
            let members: Vec<_> = detections_m
                .iter()
                .zip(labels)
                .filter(|(_, l)| **l == set)
                .map(|(p, _)| *p)
                .collect();
            let n = members.len() as f64;
            [
                members.iter().map(|p| p[0]).sum::<f64>() / n,
                members.iter().map(|p| p[1]).sum::<f64>() / n,
            ]
        })
        .collect();
    let mut edges: Vec<MapEdge> = Vec::new();
    for pair in labels.windows(2).filter(|pair| pair[0] != pair[1]) {
        let (from_set, to_set) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        match edges
            .iter_mut()
            .find(|e| (e.from_set, e.to_set) == (from_set, to_set))
        {
            Some(edge) => edge.multiplicity += 1,
            None => edges.push(MapEdge {
                from_set,
                to_set,
                multiplicity: 1,
            }),
        }
    }
    let is_truth = labels == truth_labels();
    let title = topology_title(rank, Some(frequency), n_sets, is_truth);
    TopologyMap {
        title,
        walls_m: walls(),
        detections_m,
        labels: labels.to_vec(),
        nodes_m,
        edges,
    }
}

fn truth_labels() -> Vec<usize> {
    (0..16).map(|i| i % 8).collect()
}

fn split_labels() -> Vec<usize> {
    let mut labels = truth_labels();
    labels[15] = 8;
    labels[10] = 9;
    labels
}

fn merged_labels() -> Vec<usize> {
    vec![0, 1, 2, 2, 3, 4, 5, 3, 0, 1, 2, 2, 3, 4, 5, 3]
}

fn chain(name: &str, start: f64, settle: f64, steps: u64, per_bin: u64, seed: u64) -> ChainTrace {
    let mut noise = Noise(seed);
    let bins = (0..steps / per_bin).map(|k| {
        let first_step = k * per_bin;
        let mean = settle + (start - settle) * (-(first_step as f64) / (steps as f64 * 0.06)).exp();
        let wobble = if per_bin > 1 { noise.next() * 1.6 } else { 0.0 };
        let here = mean + noise.around(0.8);
        let (min, max) = (
            (here - wobble).round().max(1.0),
            (here + wobble).round().max(1.0),
        );
        TraceBin {
            first_step,
            min: min as u32,
            max: max as u32,
            mean: (min + max) / 2.0,
        }
    });
    ChainTrace {
        name: name.to_owned(),
        bins: bins.collect(),
        end_step: steps,
    }
}

fn bars(truth_first: bool, frequencies: [f64; 3]) -> TopologyBars {
    let bar = |(i, &frequency): (usize, &f64)| TopologyBar {
        label: format!("#{}", i + 1),
        frequency,
        is_truth: truth_first && i == 0,
    };
    TopologyBars {
        title: String::new(),
        bars: frequencies.iter().enumerate().map(bar).collect(),
        all_others: Some(1.0 - frequencies.iter().sum::<f64>()),
        highest: Some(1.0),
    }
}

fn trace() -> DimensionalityTrace {
    DimensionalityTrace {
        title: String::new(),
        chains: vec![chain("chain 0", 16.0, 8.2, 10_000, 40, 1)],
        burn_in: Some(1_200),
        truth: Some(8),
        m_range: Some((1, 16)),
    }
}

fn row(name: &str, good: bool) -> Figure7Row {
    let topologies = if good {
        vec![
            topology(1, 0.423, &truth_labels()),
            topology(2, 0.118, &split_labels()),
            topology(3, 0.071, &merged_labels()),
        ]
    } else {
        vec![
            topology(1, 0.0021, &merged_labels()),
            topology(2, 0.0020, &split_labels()),
        ]
    };
    Figure7Row {
        title: name.to_owned(),
        settings: "σₒ = 1 m, σₜ = 1 m, radius 10 m, height 100, R = 30, from singletons".to_owned(),
        topologies,
        bars: bars(
            good,
            if good {
                [0.423, 0.118, 0.071]
            } else {
                [0.0021, 0.0020, 0.0018]
            },
        ),
        trace: trace(),
    }
}

fn figure7() -> Figure7Page {
    let names = [
        "(a)",
        "(b) radius 50",
        "(c) σₒ 0.5",
        "(d) σₒ 5",
        "(e) σₜ 5",
        "(f) height 1000",
        "(g) from one cluster",
    ];
    let rows = |good: bool| {
        names
            .iter()
            .enumerate()
            .map(|(i, n)| Some(row(n, good || i == 0)))
            .collect()
    };
    let column = |heading: &str, good: bool| Figure7Column {
        heading: heading.to_owned(),
        rows: rows(good),
    };
    Figure7Page {
        title: "Figure 7 of the report: seven settings on sixteen detections".to_owned(),
        columns: vec![
            column("as the report's program computed it (incorrect)", false),
            column("as it should be", true),
        ],
    }
}

fn factor(name: &str, levels: &[&str]) -> HeatFactor {
    HeatFactor {
        name: name.to_owned(),
        levels: levels.iter().map(|&l| l.to_owned()).collect(),
    }
}

fn heat_map(row_factors: Vec<HeatFactor>, column_factors: Vec<HeatFactor>, texts: bool) -> HeatMap {
    let count = |factors: &[HeatFactor]| factors.iter().map(|f| f.levels.len()).product::<usize>();
    let (rows, columns) = (count(&row_factors), count(&column_factors));
    let value = |k: usize| {
        let (i, j) = (k / columns, k % columns);
        let wave = (i as f64 * 0.9).sin() * 0.3 + (j as f64 * 0.5).cos() * 0.35 + 0.45;
        (k % 11 != 7).then_some(wave.clamp(0.0, 1.0))
    };
    let values: Vec<Option<f64>> = (0..rows * columns).map(value).collect();
    let text = |v: &Option<f64>| {
        v.map_or(String::new(), |v| {
            format!(
                "{v:.2}\n[{:.2}, {:.2}]",
                (v - 0.2).max(0.0),
                (v + 0.15).min(1.0)
            )
        })
    };
    HeatMap {
        title: "Share of chains whose MAP topology is the truth (20 worlds per cell, Wilson 95 %)"
            .to_owned(),
        texts: if texts {
            values.iter().map(text).collect()
        } else {
            Vec::new()
        },
        row_factors,
        column_factors,
        values,
        value_name: "recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
        is_log: false,
        palette: Palette::Viridis,
        categories: Vec::new(),
        parts: Vec::new(),
        ..HeatMap::default()
    }
}

fn small_heat_map() -> HeatMap {
    let rows = factor("σₒ (m)", &["0.25", "0.5", "1", "2", "4"]);
    let columns = factor("penalty radius (m)", &["2", "5", "10", "20", "50"]);
    heat_map(vec![rows], vec![columns], true)
}

fn stacked_heat_map() -> HeatMap {
    let rows = vec![
        factor("σₒ (m)", &["0.5", "1", "2", "4"]),
        factor("σₜ (m)", &["0.25", "0.5", "1", "2", "4", "8"]),
    ];
    let columns = vec![
        factor("initial topology", &["singletons", "one cluster"]),
        factor("height", &["10", "100", "1000"]),
        factor("radius (m)", &["2", "10", "20", "50"]),
    ];
    HeatMap {
        palette: Palette::Cividis,
        ..heat_map(rows, columns, false)
    }
}

fn effects(n: usize, levels: usize) -> Effects {
    let names = [
        "penalty radius (m)",
        "initial topology",
        "σₒ (m)",
        "height",
        "σₜ (m)",
        "draws R",
        "noise (m)",
        "moves",
    ];
    let level = |f: usize, k: usize| {
        let estimate = 0.5 + 0.4 * ((k as f64 * 0.9 + f as f64).sin()) / (1.0 + f as f64 * 0.4);
        let label = if f == 1 {
            ["singletons", "one cluster", "random", "truth"][k % 4].to_owned()
        } else {
            (1 << k).to_string()
        };
        let rate = Interval {
            low: estimate - 0.09,
            estimate,
            high: (estimate + 0.08).min(1.0),
        };
        LevelEffect {
            label,
            rate: (k != 3 || f != 4).then_some(rate),
            gated: (f != 2).then_some(estimate * 0.8),
        }
    };
    let one = |f: usize| FactorEffect {
        name: names[f % 8].to_owned(),
        note: format!("range {:.2}", 0.8 / (1.0 + f as f64 * 0.4)),
        levels: (0..if f == 1 { levels.min(4) } else { levels })
            .map(|k| level(f, k))
            .collect(),
    };
    Effects {
        title: "Which setting decides whether the truth is recovered (95 % intervals)".to_owned(),
        factors: (0..n).map(one).collect(),
        value_name: "recovery rate".to_owned(),
        key: Some(("recovery rate".to_owned(), "converged too".to_owned())),
        range: (0.0, 1.0),
        percent: true,
    }
}

fn multiples(n_panels: usize, n_series: usize, n_levels: usize, name: &str) -> SmallMultiples {
    let rate = |p: usize, s: usize, k: usize| {
        let estimate = 0.5 + 0.45 * ((p * 3 + s * 2 + k) as f64).sin();
        (k != 2 || s != 1).then_some(Interval {
            low: (estimate - 0.2).max(0.0),
            estimate,
            high: (estimate + 0.15).min(1.0),
        })
    };
    let series = |p: usize, s: usize| Series {
        name: if s == 0 {
            name.to_owned()
        } else {
            s.to_string()
        },
        rates: (0..n_levels).map(|k| rate(p, s, k)).collect(),
    };
    let panel = |p: usize| MultiplePanel {
        title: format!("{name} {p}, σₜ 1 m"),
        series_name: name.to_owned(),
        series: (0..n_series).map(|s| series(p, s)).collect(),
    };
    SmallMultiples {
        title: String::new(),
        x_name: "radius D (m)".to_owned(),
        levels: (0..n_levels).map(|k| (3 * k).to_string()).collect(),
        panels: (0..n_panels).map(panel).collect(),
        n_columns: 3.min(n_panels),
        value_name: "Recovery rate".to_owned(),
    }
}

fn nested_loop(levels: &[usize], name: &str) -> NestedLoop {
    let n: usize = levels.iter().product();
    let inner = |factor: usize| levels[factor + 1..].iter().product::<usize>();
    let rate = |cell: usize| (cell % 7 != 6).then(|| 0.5 + 0.5 * (cell as f64 * 0.7).sin());
    let factor = |f: usize| LoopFactor {
        name: format!("{name} {f}"),
        levels: (0..levels[f]).map(|k| (10 * k).to_string()).collect(),
        level_of: (0..n).map(|cell| cell / inner(f) % levels[f]).collect(),
    };
    NestedLoop {
        title: String::new(),
        rates: (0..n)
            .map(|cell| rate(cell).map(|r| ((r - 0.2).max(0.0), r, (r + 0.2).min(1.0))))
            .collect(),
        gated: (0..n).map(|cell| rate(cell).map(|r| r * 0.7)).collect(),
        names: ["Recovery rate", "its 95 % interval", "converged too"].map(str::to_owned),
        factors: (0..levels.len()).map(factor).collect(),
        gated_colour: STATUS[0],
    }
}

fn response_curves(n: usize, curves: usize) -> ResponseCurves {
    let plain = effects(n, 4);
    let interval = |f: usize, k: usize, c: usize| {
        let estimate = 0.5 + 0.4 * ((k as f64 * 0.8 + (f * (c + 1)) as f64).sin());
        Interval {
            low: estimate - 0.1,
            estimate,
            high: estimate + 0.1,
        }
    };
    let panel = |f: usize| {
        let levels: Vec<String> = (plain.factors[f].levels.iter())
            .map(|level| level.label.clone())
            .collect();
        let curve = |c: usize| Curve {
            name: ["3", "10", "a longer level of 30", "100", "300"][c % 5].to_owned(),
            points: (0..levels.len())
                .map(|k| (k != 2 || f != 3 || c != 0).then(|| interval(f, k, c)))
                .collect(),
        };
        let n_curves = if f.is_multiple_of(2) { curves } else { 1 };
        CurvePanel {
            name: plain.factors[f].name.clone(),
            by: if n_curves > 1 {
                "penalty radius (m)".to_owned()
            } else {
                String::new()
            },
            curves: (0..n_curves).map(curve).collect(),
            best: (f == 1).then_some((1, 2)),
            levels,
        }
    };
    ResponseCurves {
        title: "What each factor does, and with which other".to_owned(),
        panels: (0..n).map(panel).collect(),
        value_name: "recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
    }
}

fn factor_indices(n_rows: usize, percent: bool) -> FactorIndices {
    let names = effects(8, 2).factors;
    let row = |k: usize| {
        let total = 0.9 / (1.0 + k as f64);
        let around = |estimate: f64| Interval {
            low: estimate - 0.07,
            estimate,
            high: estimate + 0.09,
        };
        IndexRow {
            name: names[k % 8].name.clone(),
            marks: vec![Some(around(total * 0.6)), (k != 4).then(|| around(total))],
            noise: (!percent).then_some(0.12),
        }
    };
    let panel = |place: usize| IndexPanel {
        name: [
            "recovery rate",
            "acceptance rate",
            "log₁₀ ESS of topologies",
        ][place % 3]
            .to_owned(),
        remark: "variance 1.2e-1 by settings, 3.4e-2 by worlds, 5.6e-2 by noise".to_owned(),
        rows: (0..n_rows).map(row).collect(),
        range: if percent { (-0.1, 1.0) } else { (0.0, 1.0) },
    };
    FactorIndices {
        title: "How much each factor matters".to_owned(),
        marks: vec![
            "first order: by itself".to_owned(),
            "total: with all its interactions".to_owned(),
        ],
        panels: (0..3).map(panel).collect(),
        value_name: "share of the variance".to_owned(),
        percent,
    }
}

fn by_init() -> TracesByInit {
    let init = |name: &str, start: f64, n: u64| InitTraces {
        name: name.to_owned(),
        chains: (0..n)
            .map(|s| chain("", start, 8.0 + (s % 3) as f64 * 0.4, 10_000, 50, s + 7))
            .collect(),
        burn_in: (n > 5).then_some(2_000),
    };
    TracesByInit {
        title: "Does the start matter? Dimensionality by initial topology".to_owned(),
        inits: vec![
            init("singletons", 16.0, 20),
            init("one cluster", 1.0, 20),
            init("random", 6.0, 20),
            init("truth", 8.0, 5),
        ],
        truth: Some(8),
    }
}

/// Cost over size: a flat line, a growing one, and two that end at one place.
fn scaling() -> Scaling {
    let line = |name: &str, first: f64, power: f64| ScalingLine {
        name: name.to_owned(),
        points: (2..8)
            .map(|k| 4f64.powi(k))
            .map(|n| (n, first * (n / 16.0).powf(power)))
            .collect(),
    };
    Scaling {
        title: "Time of one proposal over the number of detections".to_owned(),
        x_name: "number of detections N".to_owned(),
        y_name: "time of one proposal (ns)".to_owned(),
        lines: vec![
            line("common, metric", 600.0, 0.05),
            line("common, covariance", 620.0, 0.05),
            line("fresh, metric", 2000.0, 1.0),
            line(
                "a name that is too long for the room beside the plot",
                1e-6,
                0.0,
            ),
        ],
    }
}

/// Morris' plane of ten settings, two of which lie at one place.
fn plane() -> Plane {
    let interval = |at: f64, reach: f64| Interval {
        low: (at - reach).max(0.0),
        estimate: at,
        high: at + reach,
    };
    let point = |k: usize| PlanePoint {
        name: if k == 9 {
            LONG.to_owned()
        } else {
            format!("setting {k}")
        },
        x: interval(0.05 * (k / 2) as f64, 0.03),
        y: interval(0.06 * (k % 5) as f64, 0.04),
        colour: if k > 4 { SERIES } else { MUTED },
        is_hollow: k <= 4,
        hover: Some(Hover {
            text: format!("setting {k}"),
            href: Some("#x".to_owned()),
        }),
    };
    let axis = |name: &str| Axis::new(Scale::Continuous(0.0, 0.3), name);
    Plane {
        axes: (
            axis("μ*, mean size of the effect"),
            axis("σ, how much it varies"),
        ),
        points: (0..10).map(point).collect(),
        key: vec![PlaneKey {
            colour: SERIES,
            is_hollow: false,
            words: "more than noise".to_owned(),
        }],
        diagonal: Some("σ = μ*".to_owned()),
    }
}

/// Realistic figures by name.
/// Twelve cells, of which the first has worlds of every verdict and one has no worlds.
fn run_status() -> HeatMap {
    let factor = |name: &str, levels: &[&str]| HeatFactor {
        name: name.to_owned(),
        levels: levels.iter().map(|level| (*level).to_owned()).collect(),
    };
    let names = [
        "recovered and converged",
        "by luck",
        "wrong map",
        "not converged",
        LONG,
    ];
    let category = |(name, colour): (&&str, &super::style::Colour)| HeatCategory {
        name: format!("{name}: 12"),
        colour: *colour,
    };
    HeatMap {
        values: (0..12)
            .map(|k| (k != 7).then_some(f64::from(k % 5)))
            .collect(),
        categories: names.iter().zip(&STATUS).map(category).collect(),
        hovers: vec![
            Some(Hover {
                text: "c001: 5 of 5 worlds".to_owned(),
                href: Some("cells/c001.html".to_owned()),
            });
            12
        ],
        marked: Some((5, "the cell to use".to_owned())),
        parts: (0..12)
            .map(|k| match k {
                0 => vec![1.0; 5],
                k => (0..5).map(|c| f64::from(u8::from(k % 5 == c))).collect(),
            })
            .collect(),
        ..heat_map(
            vec![factor("start", &["singletons", "one-cluster", "random"])],
            vec![factor("radius D (m)", &["1", "3", "10", "30"])],
            false,
        )
    }
}

/// Chains beside each other: as many as are given, of whom the last disagrees.
fn chains_page(n: usize) -> ChainsPage {
    let line = |k: usize| RankLine {
        points: (0..=50)
            .map(|i| {
                let x = f64::from(i) / 50.0;
                let lift = if k + 1 == n { 0.4 } else { 0.05 };
                (x, lift * x * (1.0 - x) * (1.0 + k as f64 / 10.0))
            })
            .collect(),
        band: (k != 1).then_some(0.07),
    };
    let ranks = |title: &str| RankEcdfPlot {
        title: title.to_owned(),
        chains: (0..n).map(line).collect(),
        note: String::new(),
    };
    let group = |k: usize| TopologyGroup {
        label: if k == 5 {
            "others".to_owned()
        } else {
            format!("#{}", k + 1)
        },
        is_truth: k == 0,
        shares: (0..n)
            .map(|c| 0.5_f64.powi(k as i32 + 1) / (1.0 + c as f64 / 9.0))
            .collect(),
    };
    let side = || HeatFactor {
        name: "detection".to_owned(),
        levels: (1..=16).map(|i| i.to_string()).collect(),
    };
    let matrix = |title: &str| HeatMap {
        title: title.to_owned(),
        values: (0..256)
            .map(|k| Some(f64::from(u8::from(k % 16 / 2 == k / 32))))
            .collect(),
        value_name: "probability".to_owned(),
        percent: false,
        ..heat_map(vec![side()], vec![side()], false)
    };
    ChainsPage {
        chains: (0..n).map(|k| format!("chain {}", k + 1)).collect(),
        ranks: vec![
            ranks("Number of sets M"),
            RankEcdfPlot {
                title: "ln target".to_owned(),
                note: "constant: the value is 8 throughout".to_owned(),
                ..RankEcdfPlot::default()
            },
        ],
        topologies: TopologyByChain {
            title: "Topologies sampled most".to_owned(),
            groups: (0..6).map(group).collect(),
        },
        co_clustering: vec![matrix("In one set"), matrix("Largest difference")],
    }
}

fn gallery() -> Vec<(&'static str, Scene)> {
    let many = DimensionalityTrace {
        title: "Dimensionality of four chains".to_owned(),
        chains: (0..4)
            .map(|i| {
                chain(
                    &format!("chain {i}"),
                    [16.0, 1.0, 8.0, 12.0][i],
                    8.0,
                    100_000,
                    500,
                    i as u64 + 1,
                )
            })
            .collect(),
        burn_in: Some(12_500),
        truth: Some(8),
        m_range: None,
    };
    let mut wide_bars = bars(true, [0.423, 0.118, 0.071]);
    wide_bars.title = "Most sampled topologies".to_owned();
    wide_bars.highest = None;
    let page7 = figure7();
    let (w, h) = (3600, page7.natural_height_px(3600));
    let diverging = HeatMap {
        range: (-1.0, 1.0),
        palette: Palette::RedBlue,
        percent: false,
        value_name: "difference in recovery".to_owned(),
        ..small_heat_map()
    };
    let logarithmic = HeatMap {
        is_log: true,
        range: (0.01, 1.0),
        ..small_heat_map()
    };
    vec![
        (
            "multiples",
            page(1800, 1560, |s, a, st| {
                multiples(9, 3, 3, "height H").draw(s, a, st)
            }),
        ),
        (
            "nested_loop",
            page(2200, 1120, |s, a, st| {
                nested_loop(&[3, 3, 3, 3, 2, 2], "factor").draw(s, a, st)
            }),
        ),
        (
            "heat_map_log",
            page(1600, 1000, |s, a, st| logarithmic.draw(s, a, st)),
        ),
        (
            "world_map",
            cut_page(1400, 1000, |s, a, st| world().draw(s, a, st)),
        ),
        (
            "topology_map",
            cut_page(1100, 1000, |s, a, st| {
                topology(1, 0.423, &split_labels()).draw(s, a, st)
            }),
        ),
        (
            "topology_bars",
            page(900, 700, |s, a, st| wide_bars.draw(s, a, st)),
        ),
        (
            "dimensionality_trace",
            page(1600, 800, |s, a, st| many.draw(s, a, st)),
        ),
        (
            "figure7_row",
            page(1760, 520, |s, a, st| {
                row("(a) the report's good settings", true).draw(s, a, st)
            }),
        ),
        ("figure7_page", page(w, h, |s, a, st| page7.draw(s, a, st))),
        (
            "heat_map",
            page(1600, 1000, |s, a, st| small_heat_map().draw(s, a, st)),
        ),
        (
            "heat_map_diverging",
            page(1600, 1000, |s, a, st| diverging.draw(s, a, st)),
        ),
        (
            "heat_map_stacked",
            page(1600, 1200, |s, a, st| stacked_heat_map().draw(s, a, st)),
        ),
        (
            "effects",
            page(1600, 900, |s, a, st| effects(6, 5).draw(s, a, st)),
        ),
        (
            "scaling",
            page(1600, 900, |s, a, st| scaling().draw(s, a, st)),
        ),
        (
            "response_curves",
            page(2000, 1150, |s, a, st| response_curves(6, 3).draw(s, a, st)),
        ),
        (
            "sobol_indices",
            page(2000, 750, |s, a, st| factor_indices(6, true).draw(s, a, st)),
        ),
        (
            "morris_effects",
            page(2000, 1000, |s, a, st| {
                factor_indices(10, false).draw(s, a, st)
            }),
        ),
        (
            "traces_by_init",
            page(1600, 700, |s, a, st| by_init().draw(s, a, st)),
        ),
        ("plane", page(1300, 900, |s, a, st| plane().draw(s, a, st))),
        (
            "plane_narrow",
            page(660, 700, |s, a, st| plane().draw(s, a, st)),
        ),
        (
            "effects_narrow",
            page(660, 1900, |s, a, st| effects(5, 4).draw(s, a, st)),
        ),
        (
            "response_curves_narrow",
            page(660, 1900, |s, a, st| response_curves(4, 3).draw(s, a, st)),
        ),
        (
            "indices_narrow",
            page(660, 900, |s, a, st| {
                let mut figure = factor_indices(6, true);
                figure.panels.truncate(1);
                figure.draw(s, a, st)
            }),
        ),
        (
            "run_status",
            page(1650, 700, |s, a, st| run_status().draw(s, a, st)),
        ),
        (
            "chains_page",
            page(2000, 1500, |s, a, st| chains_page(4).draw(s, a, st)),
        ),
        (
            "chains_page_of_one",
            page(2000, 1500, |s, a, st| chains_page(1).draw(s, a, st)),
        ),
    ]
}

/// The same figures from next to nothing and from too much.
fn extremes() -> Vec<(&'static str, Scene)> {
    let mut noise = Noise(9);
    let crowd: Vec<[f64; 2]> = (0..10_000)
        .map(|_| [noise.around(300.0), noise.around(80.0)])
        .collect();
    let same = vec![[5.0, 5.0]; 6];
    let map = |detections_m: Vec<[f64; 2]>| WorldMap {
        covariances_m2: vec![[[1.5, 0.2], [0.2, 0.7]]; detections_m.len()],
        detections_m,
        ellipse_sigmas: 1.0,
        ..WorldMap::default()
    };
    let many_sets = TopologyMap {
        title: LONG.repeat(3),
        labels: (0..60).map(|i| i % 30).collect(),
        detections_m: (0..60)
            .map(|i| {
                [
                    f64::from(i % 30 % 6) * 10.0 + f64::from(i / 30),
                    f64::from(i % 30 / 6) * 10.0,
                ]
            })
            .collect(),
        nodes_m: (0..30)
            .map(|i| [f64::from(i % 6) * 10.0 + 0.5, f64::from(i / 6) * 10.0])
            .collect(),
        ..TopologyMap::default()
    };
    let crowd_topology = TopologyMap {
        labels: (0..10_000).map(|i| i / 10).collect(),
        nodes_m: crowd.iter().copied().step_by(10).collect(),
        detections_m: crowd.clone(),
        ..TopologyMap::default()
    };
    let long_bars = TopologyBars {
        title: LONG.to_owned(),
        bars: (0..8)
            .map(|i| TopologyBar {
                label: format!("{LONG} {i}"),
                frequency: 0.0,
                is_truth: i == 3,
            })
            .collect(),
        all_others: Some(1.0),
        highest: None,
    };
    let flat = DimensionalityTrace {
        chains: vec![chain("one", 3.0, 3.0, 1, 1, 1)],
        ..DimensionalityTrace::default()
    };
    let hundred = DimensionalityTrace {
        chains: (0..100)
            .map(|i| chain(LONG, 900.0, 400.0, 1_000_000, 10_000, i))
            .collect(),
        truth: Some(400),
        burn_in: Some(1_000_000),
        ..DimensionalityTrace::default()
    };
    let long_names = HeatMap {
        title: LONG.repeat(4),
        ..heat_map(
            vec![factor(LONG, &[LONG, "b", "c"])],
            vec![factor(LONG, &[LONG, LONG, LONG, "x", "y", "z"])],
            true,
        )
    };
    let one_cell = heat_map(vec![factor("a", &["1"])], vec![factor("b", &["1"])], true);
    let equal = HeatMap {
        range: (0.5, 0.5),
        ..one_cell.clone()
    };
    let nothing = HeatMap {
        values: vec![],
        texts: vec![],
        row_factors: vec![],
        column_factors: vec![],
        ..one_cell.clone()
    };
    let deep = heat_map(
        vec![
            factor("a", &["1", "2"]),
            factor("b", &["1", "2", "3"]),
            factor("c", &["1", "2", "3", "4"]),
        ],
        vec![
            factor(LONG, &[LONG, "2"]),
            factor("e", &["1", "2", "3"]),
            factor("f", &["0.125", "0.25", "0.5", "1"]),
        ],
        false,
    );
    let long_effects = Effects {
        factors: (0..8)
            .map(|i| FactorEffect {
                name: LONG.to_owned(),
                note: LONG.to_owned(),
                levels: (0..10)
                    .map(|k| LevelEffect {
                        label: format!("{LONG} {k}"),
                        rate: (k != i).then_some(Interval {
                            low: 0.0,
                            estimate: 0.5,
                            high: 1.0,
                        }),
                        gated: Some(0.5),
                    })
                    .collect(),
            })
            .collect(),
        ..effects(1, 1)
    };
    vec![
        (
            "x_curves_many",
            page(2000, 1150, |s, a, st| response_curves(8, 5).draw(s, a, st)),
        ),
        (
            "x_curves_none",
            page(900, 500, |s, a, st| response_curves(0, 1).draw(s, a, st)),
        ),
        (
            "x_indices_one",
            page(900, 500, |s, a, st| factor_indices(1, true).draw(s, a, st)),
        ),
        (
            "x_world_empty",
            cut_page(1400, 1000, |s, a, st| WorldMap::default().draw(s, a, st)),
        ),
        (
            "x_world_one",
            cut_page(1400, 1000, |s, a, st| map(vec![[3.0, 4.0]]).draw(s, a, st)),
        ),
        (
            "x_world_same",
            cut_page(1400, 1000, |s, a, st| map(same.clone()).draw(s, a, st)),
        ),
        (
            "x_world_crowd",
            cut_page(1400, 1000, |s, a, st| map(crowd.clone()).draw(s, a, st)),
        ),
        (
            "x_topology_many_sets",
            cut_page(1100, 1000, |s, a, st| many_sets.draw(s, a, st)),
        ),
        (
            "x_topology_crowd",
            cut_page(1100, 1000, |s, a, st| crowd_topology.draw(s, a, st)),
        ),
        (
            "x_topology_empty",
            cut_page(1100, 1000, |s, a, st| TopologyMap::default().draw(s, a, st)),
        ),
        (
            "x_bars_long",
            page(900, 700, |s, a, st| long_bars.draw(s, a, st)),
        ),
        (
            "x_bars_empty",
            page(900, 700, |s, a, st| TopologyBars::default().draw(s, a, st)),
        ),
        (
            "x_trace_flat",
            page(1600, 800, |s, a, st| flat.draw(s, a, st)),
        ),
        (
            "x_trace_hundred",
            page(1600, 800, |s, a, st| hundred.draw(s, a, st)),
        ),
        (
            "x_trace_empty",
            page(1600, 800, |s, a, st| {
                DimensionalityTrace::default().draw(s, a, st)
            }),
        ),
        (
            "x_row_empty",
            page(1760, 520, |s, a, st| Figure7Row::default().draw(s, a, st)),
        ),
        (
            "x_page_empty",
            page(3600, 400, |s, a, st| Figure7Page::default().draw(s, a, st)),
        ),
        (
            "x_heat_long",
            page(1600, 1000, |s, a, st| long_names.draw(s, a, st)),
        ),
        (
            "x_heat_one",
            page(1600, 1000, |s, a, st| one_cell.draw(s, a, st)),
        ),
        (
            "x_heat_equal",
            page(1600, 1000, |s, a, st| equal.draw(s, a, st)),
        ),
        (
            "x_heat_nothing",
            page(1600, 1000, |s, a, st| nothing.draw(s, a, st)),
        ),
        (
            "x_heat_deep",
            page(1600, 1400, |s, a, st| deep.draw(s, a, st)),
        ),
        (
            "x_effects_one",
            page(1600, 900, |s, a, st| effects(1, 1).draw(s, a, st)),
        ),
        (
            "x_effects_eight",
            page(1600, 900, |s, a, st| effects(8, 10).draw(s, a, st)),
        ),
        (
            "x_effects_long",
            page(1600, 900, |s, a, st| long_effects.draw(s, a, st)),
        ),
        (
            "x_multiples",
            page(2000, 1400, |s, a, st| {
                multiples(6, 9, 12, LONG).draw(s, a, st)
            }),
        ),
        (
            "x_multiples_none",
            page(1600, 900, |s, a, st| multiples(0, 0, 0, "").draw(s, a, st)),
        ),
        (
            "x_nested_loop",
            page(2200, 1100, |s, a, st| {
                nested_loop(&[5, 4, 10, 2, 5], LONG).draw(s, a, st)
            }),
        ),
        (
            "x_nested_loop_one",
            page(1600, 900, |s, a, st| nested_loop(&[1], "f").draw(s, a, st)),
        ),
        (
            "x_effects_none",
            page(1600, 900, |s, a, st| effects(0, 0).draw(s, a, st)),
        ),
        (
            "x_init_none",
            page(1600, 700, |s, a, st| TracesByInit::default().draw(s, a, st)),
        ),
    ]
}

fn check(name: &str, scene: &Scene) {
    let page = scene.area();
    let boxes: Vec<(Rect, &str)> = scene
        .labels()
        .map(|label| (label.bounds(), label.text()))
        .collect();
    for (place, words) in &boxes {
        let inside =
            place.x0 >= 0.0 && place.y0 >= 0.0 && place.x1 <= page.x1 && place.y1 <= page.y1;
        assert!(inside, "{name}: {words:?} leaves the page: {place:?}");
    }
    for (i, (a, first)) in boxes.iter().enumerate() {
        for (b, second) in &boxes[i + 1..] {
            // Boxes hold room for accents and descenders, so they may touch by a little.
            let (a, b) = (a.inset(1.0, 3.0, 1.0, 3.0), b.inset(1.0, 3.0, 1.0, 3.0));
            assert!(
                !a.overlaps(&b),
                "{name}: {first:?} {a:?} covers {second:?} {b:?}"
            );
        }
    }
}

#[test]
fn text_stays_on_the_page_and_apart() {
    for (name, scene) in gallery().iter().chain(&extremes()) {
        check(name, scene);
    }
}

#[test]
fn every_figure_is_drawn_to_the_same_bytes_twice() {
    let scratch = tempfile::tempdir().expect("a directory for the images");
    let gallery_dir = std::env::var_os("PTM_FIGURE_GALLERY").map(std::path::PathBuf::from);
    let dir = gallery_dir.unwrap_or_else(|| scratch.path().to_owned());
    std::fs::create_dir_all(&dir).expect("the gallery directory can be made");
    let first: Vec<_> = gallery().into_iter().chain(extremes()).collect();
    let again: Vec<_> = gallery().into_iter().chain(extremes()).collect();
    let mut seconds = String::new();
    for ((name, scene), (_, same)) in first.iter().zip(&again) {
        let began = std::time::Instant::now();
        let canvas = scene.render();
        let drawn = began.elapsed();
        let png = canvas.into_png();
        seconds += &format!(
            "{name}: drawn {drawn:.0?}, with PNG {:.0?}, {} kB\n",
            began.elapsed(),
            png.len() / 1000
        );
        assert_eq!(png, same.png(), "{name} differs when drawn again");
        let svg = scene.svg(name);
        assert_eq!(svg, same.svg(name), "{name} differs as SVG");
        std::fs::write(dir.join(format!("{name}.svg")), svg)
            .expect("the gallery directory is writable");
        std::fs::write(dir.join(format!("{name}.png")), png)
            .expect("the gallery directory is writable");
    }
    std::fs::write(dir.join("timing.txt"), seconds).expect("the gallery directory is writable");
}

#[test]
fn neighbouring_cells_share_an_edge_without_a_seam() {
    // Eleven cells over a width that is no multiple of eleven, in one colour.
    let names: Vec<String> = (0..11).map(|k| k.to_string()).collect();
    let side = || {
        vec![HeatFactor {
            name: "k".to_owned(),
            levels: names.clone(),
        }]
    };
    let map = HeatMap {
        title: String::new(),
        values: vec![Some(1.0); 121],
        ..heat_map(side(), side(), false)
    };
    let scene = page(1001, 803, |s, a, st| map.draw(s, a, st));
    let canvas = scene.render();
    let (r, g, b) = (253, 231, 37);
    // Leave the colour bar out, which holds the same yellow at its end.
    let inked: Vec<(u32, u32)> = (0..803)
        .flat_map(|y| (0..780).map(move |x| (x, y)))
        .filter(|&(x, y)| canvas.pixel(x, y) == Some((r, g, b)))
        .collect();
    let (x0, x1) = (
        inked.iter().map(|p| p.0).min(),
        inked.iter().map(|p| p.0).max(),
    );
    let (y0, y1) = (
        inked.iter().map(|p| p.1).min(),
        inked.iter().map(|p| p.1).max(),
    );
    let extent =
        |low: Option<u32>, high: Option<u32>| (high.unwrap_or(0) + 1 - low.unwrap_or(0)) as usize;
    assert!(inked.len() > 100_000, "the cells are there");
    assert_eq!(
        inked.len(),
        extent(x0, x1) * extent(y0, y1),
        "a pixel between cells is not filled"
    );
}

#[test]
fn text_is_drawn_where_its_bounds_say() {
    use super::scene::Label;
    let anchors = |label: Label| {
        [
            label.clone(),
            label.clone().centred().middle(),
            label.ending().above(),
        ]
    };
    let labels = anchors(Label::new("Ågjσₒ 50 %", (200.0, 200.0), 40.0));
    for label in labels
        .into_iter()
        .flat_map(|label| [label.clone().upward(), label.bold()])
    {
        let bounds = label.bounds();
        let mut scene = Scene::new(400, 400);
        scene.label(label);
        let canvas = scene.render();
        let dark = |&(x, y): &(u32, u32)| canvas.pixel(x, y).is_some_and(|(r, _, _)| r < 200);
        let inked: Vec<_> = (0..400)
            .flat_map(|y| (0..400).map(move |x| (x, y)))
            .filter(dark)
            .collect();
        assert!(inked.len() > 500, "there is text");
        for (x, y) in inked {
            let (x, y) = (f64::from(x), f64::from(y));
            // The ring of Å may rise above the room kept for capitals.
            let near = bounds.inset(-8.0, -8.0, -8.0, -8.0);
            assert!(
                x >= near.x0 && x <= near.x1 && y >= near.y0 && y <= near.y1,
                "({x}, {y}) outside {bounds:?}"
            );
        }
    }
}

#[test]
fn numbers_are_written_as_readers_expect() {
    use super::style::{percent, tick_label};
    assert_eq!(tick_label(-2.5, 2.5), "−2.5");
    assert_eq!(tick_label(-0.0, 5.0), "0");
    assert_eq!(tick_label(12_000.0, 2_000.0), "12,000");
    assert_eq!(tick_label(0.3, 0.1), "0.3");
    assert_eq!(
        [percent(0.423), percent(1.0), percent(0.0), percent(0.0021)],
        ["42.3 %", "100 %", "0 %", "0.21 %"]
    );
}

/// Every label is in the SVG once, as text; markup in it stays text, and what XML forbids is replaced.
#[test]
fn an_svg_holds_the_text_of_the_page_and_no_markup_from_it() {
    use super::scene::Label;
    let hostile = "<script>alert(\"1\")</script> & ]]> \u{1}";
    let mut scene = Scene::new(300, 200);
    scene.label(Label::new(hostile, (10.0, 20.0), 20.0));
    let svg = scene.svg(hostile);
    let escaped = "&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt; &amp; ]]&gt; \u{fffd}</text>";
    assert!(svg.contains(escaped), "{svg}");
    assert!(!svg.contains("<script") && !svg.contains('\u{1}'));
    for (name, scene) in gallery().iter().chain(&extremes()) {
        let svg = scene.svg(name);
        assert_eq!(
            svg.matches("<text ").count(),
            scene.labels().count(),
            "{name}"
        );
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
    }
    for (name, scene) in gallery() {
        let kilobytes = scene.svg(name).len() / 1000;
        assert!(kilobytes < 500, "{name}: {kilobytes} kB");
    }
}

/// A block of the raster page covers the same pixels as in the SVG: edges on whole pixels.
#[test]
fn blocks_of_an_svg_have_the_pixels_of_the_png() {
    use super::backend::SUBPIXELS;
    let mut scene = Scene::new(40, 40);
    scene.block(Rect::new(3.6, 4.4, 11.5, 9.0), STATUS[0]);
    let svg = scene.svg("block");
    let unit = SUBPIXELS as i32;
    let path = format!(
        "M{} {}h{}v{}h-{}z",
        4 * unit,
        4 * unit,
        8 * unit,
        5 * unit,
        8 * unit
    );
    assert!(svg.contains(&path), "{svg}");
    let canvas = scene.render();
    let inside = |x, y| canvas.pixel(x, y) == Some((STATUS[0].0, STATUS[0].1, STATUS[0].2));
    assert!(inside(4, 4) && inside(11, 8));
    assert!(!inside(3, 4) && !inside(12, 8) && !inside(4, 3) && !inside(11, 9));
}

/// Places that say something are links above the marks; the page's own colours have dark counterparts.
#[test]
fn an_svg_has_words_links_and_a_dark_side() {
    let status = page(1650, 700, |s, a, st| run_status().draw(s, a, st));
    let svg = status.svg("status");
    let link = "<a href=\"cells/c001.html\"><path d=\"M";
    assert_eq!(svg.matches(link).count(), 12);
    let words = "<title>c001: 5 of 5 worlds</title></path></a>";
    assert_eq!(svg.matches(words).count(), 12);
    assert!(svg.contains("role=\"group\"") && svg.contains("prefers-color-scheme:dark"));
    assert!(svg.contains("[fill=\"#ffffff\"]{fill:#16181b}"), "{svg}");
    // What is written on a coloured tile is not the page's own ink.
    for on_tile in [super::style::ON_DARK, super::style::ON_LIGHT] {
        let is_swapped = super::style::DARK
            .iter()
            .any(|(light, _)| *light == on_tile);
        assert!(!is_swapped);
    }
    // A hostile label stays text.
    let mut scene = Scene::new(100, 100);
    let hover = Hover {
        text: "<b>\"&".to_owned(),
        href: Some("\"><script>".to_owned()),
    };
    scene.hover(Rect::new(1.0, 1.0, 9.0, 9.0), hover);
    assert!(!scene.svg("x").contains("<script>"));
}
