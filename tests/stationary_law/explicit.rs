//! Explicit locations: every move, prior, penalty and R against enumeration.

use std::collections::HashMap;

use topometric::chain::{self, Start, Trace, TraceRecorder};
use topometric::detections::{Corner, Covariance};
use topometric::exact::{self, ExactSettings, ExactTopology};
use topometric::model::{
    Appearance, Confusion, CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior,
};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::{
    Arithmetic, Estimator, MoveMix, SamplerSettings, SplitRule, Tempering, n_tuning,
};

use crate::statistic::{threshold, total_variation};

const PRIORS: [Prior; 3] = [
    Prior::Uniform,
    Prior::Poisson { rate: 0.2 },
    Prior::DirichletProcess { concentration: 0.3 },
];

/// Every move with as little else as makes it reach everything.
const MOVES: [&str; 8] = [
    "site",
    "site=0.6,slice=0.4",
    "site=0.1,flip=0.6,slice=0.3",
    "split-merge",
    "split-merge=0.6,slice=0.4",
    "site=0.2,group=0.6,slice=0.2",
    "site=0.2,cut=0.6,slice=0.2",
    "auto",
];

fn settings(moves: &str, n_candidates: usize) -> SamplerSettings {
    let moves = match moves {
        "auto" => MoveMix::default_of(Estimator::Explicit),
        _ => moves.parse().expect("a good mix"),
    };
    SamplerSettings {
        moves,
        estimator: Estimator::Explicit,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 1,
        candidates: n_candidates,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

/// Data sets by number: a loose line, a crowd, two groups that are far apart, a crowd of two kinds
/// of corners; the same in the covariance model, with ellipses of several forms and directions.
fn models(shape: PenaltyShape) -> Vec<(&'static str, Model)> {
    let metric = |z: &[[f64; 2]], scales: [f64; 2], radius_m: f64, height: f64| {
        let penalty = Penalty {
            shape,
            radius_m,
            height,
        };
        MetricModel::new(z, scales[0], scales[1], penalty)
    };
    let covariance =
        |z: &[[f64; 2]], size_m2: f64, scales: [f64; 2], radius_m: f64, height: f64| {
            let ellipse = |i: usize| Covariance {
                xx: size_m2 * (0.4 + 0.4 * (i % 3) as f64),
                xy: 0.15 * size_m2 * ((i % 5) as f64 - 2.0),
                yy: size_m2 * (1.2 - 0.4 * (i % 2) as f64),
            };
            let covariances_m2: Vec<Covariance> = (0..z.len()).map(ellipse).collect();
            let penalty = Penalty {
                shape,
                radius_m,
                height,
            };
            CovarianceModel::new(z, &covariances_m2, scales[0], scales[1], penalty)
                .expect("good covariances")
        };
    let crowd = [
        [0.0, 0.0],
        [0.4, 0.3],
        [1.4, -0.2],
        [1.6, 0.5],
        [0.7, 1.1],
        [2.1, 1.3],
    ];
    let line = [[0.0, 0.0], [0.9, 0.1], [1.7, -0.1], [2.9, 0.2], [3.6, 0.0]];
    // Between the groups no set is a candidate: without far places nothing would lead from one to
    // the other.
    let apart = [[0.0, 0.0], [0.3, 0.1], [4.0, 0.0], [4.2, 0.3]];
    let kinds = [0, 1, 0, 2, 1, 0].map(|kind| match kind {
        0 => Some(Corner::Open),
        1 => Some(Corner::Closed),
        _ => None,
    });
    let confusion = Confusion {
        open_as_closed: 0.1,
        closed_as_open: 0.3,
    };
    let appearance = Appearance::default().with_corner_kinds(confusion, kinds.to_vec());
    vec![
        ("line", metric(&line, [0.6, 0.8], 1.3, 8.0).into()),
        ("crowd", metric(&crowd, [0.5, 0.6], 1.2, 3.0).into()),
        ("apart", metric(&apart, [1.1, 4.0], 0.5, 2.0).into()),
        (
            "kinds",
            metric(&crowd, [0.7, 0.5], 0.9, 5.0)
                .with_appearance(appearance.clone())
                .into(),
        ),
        (
            "no penalty",
            metric(&crowd[..4], [0.7, 2.0], 1.0, 0.0).into(),
        ),
        (
            "line of ellipses",
            covariance(&line, 0.5, [1.0, 2.0], 2.6, 8.0).into(),
        ),
        (
            "crowd of ellipses",
            covariance(&crowd, 0.6, [0.9, 2.0], 3.0, 3.0).into(),
        ),
        (
            "ellipses apart",
            covariance(&apart, 0.8, [1.1, 5.0], 0.5, 2.0).into(),
        ),
        (
            "ellipses of kinds",
            covariance(&crowd, 0.5, [0.9, 1.8], 2.5, 3.0)
                .with_appearance(appearance)
                .into(),
        ),
        (
            "ellipses without penalty",
            covariance(&crowd[..4], 0.4, [1.0, 3.0], 1.0, 0.0).into(),
        ),
    ]
}

fn sample(
    model: &Model,
    prior: Prior,
    settings: &SamplerSettings,
    n_steps: u64,
    seed: u64,
) -> Trace {
    let mut recorder = TraceRecorder::new(1000);
    let purpose = Purpose::new("explicit law test", seed);
    chain::run(
        model,
        prior,
        settings,
        &Start::Singletons,
        n_steps,
        &purpose,
        &mut recorder,
    );
    recorder.finish()
}

fn holds(exact: &[ExactTopology], trace: &Trace, widest: f64, context: &str) -> f64 {
    let (distance, bound) = (total_variation(trace, 0, exact), threshold(trace, 0, exact));
    assert!(bound < widest, "{context}: too short to tell, {bound}");
    assert!(distance < bound, "{context}: {distance} {bound}");
    distance
}

#[test]
fn every_move_has_the_law_of_enumeration() {
    for (number, shape) in [PenaltyShape::Quadratic, PenaltyShape::Cubic]
        .into_iter()
        .enumerate()
    {
        for (k, (name, model)) in models(shape).iter().enumerate() {
            let prior = PRIORS[(k + number) % 3];
            let mut rng = Purpose::new("explicit law test", 2).generator();
            let exact = exact::enumerate(model, prior, 40_000, &mut rng);
            for moves in MOVES {
                // Far places are rare, and nothing else leads across; ellipses mix more slowly.
                let is_slow = name.contains("apart") || name.contains("ellipses");
                let n_steps = if is_slow { 800_000 } else { 200_000 };
                let trace = sample(model, prior, &settings(moves, 2), n_steps, 1);
                let context = format!("{name} {shape} {prior} {moves}");
                holds(&exact, &trace, 0.1, &context);
            }
        }
    }
}

#[test]
fn every_number_of_candidates_has_the_law_of_enumeration() {
    let models = models(PenaltyShape::Quadratic);
    for ((name, model), prior) in [1, 6]
        .into_iter()
        .flat_map(|k| PRIORS.map(|prior| (&models[k], prior)))
    {
        let mut rng = Purpose::new("explicit law test", 3).generator();
        let exact = exact::enumerate(model, prior, 40_000, &mut rng);
        for n_candidates in [1, 2, 4, 8] {
            for moves in ["auto", "split-merge=0.4,site=0.2,group=0.4"] {
                let trace = sample(model, prior, &settings(moves, n_candidates), 600_000, 2);
                let context = format!("{name} {prior} {moves} R = {n_candidates}");
                holds(&exact, &trace, 0.1, &context);
            }
        }
    }
}

/// The coldest rung of a ladder has the law of a plain chain once the ladder stands.
#[test]
fn a_tempered_chain_has_the_law_of_enumeration() {
    let models = models(PenaltyShape::Quadratic);
    for ((name, model), prior) in [1, 6]
        .into_iter()
        .flat_map(|k| PRIORS.map(|prior| (&models[k], prior)))
    {
        let mut rng = Purpose::new("explicit law test", 5).generator();
        let exact = exact::enumerate(model, prior, 40_000, &mut rng);
        for n_temperatures in [2, 5] {
            let tempered = SamplerSettings {
                tempering: Some(Tempering {
                    n_temperatures,
                    swap_interval: 3,
                }),
                ..settings("auto", 2)
            };
            let trace = sample(model, prior, &tempered, 400_000, 1);
            let first = n_tuning(trace.n_steps);
            let distance = total_variation(&trace, first, &exact);
            let bound = threshold(&trace, first, &exact);
            let context = format!("{name} {prior} {n_temperatures} rungs");
            assert!(bound < 0.1, "{context}: too short to tell, {bound}");
            assert!(distance < bound, "{context}: {distance} {bound}");
        }
    }
}

/// The long form: ten million steps on every data set with every prior and R, in four chains of a
/// length at which a trace is still whole.
fn ten_million_steps(shape: PenaltyShape) {
    for (name, model) in &models(shape) {
        for prior in PRIORS {
            let purpose = Purpose::new("explicit law test", 4);
            let tolerance = ExactSettings {
                tolerance: 0.0005,
                ..ExactSettings::default()
            };
            let exact = exact::posterior(model, prior, &tolerance, &purpose).topologies;
            for n_candidates in [1, 2, 4, 8] {
                let context = format!("{name} {shape} {prior} R = {n_candidates}");
                let mut pooled: HashMap<Topology, f64> = HashMap::new();
                for seed in 0..4 {
                    let settings = settings("auto", n_candidates);
                    let trace = sample(model, prior, &settings, 2_500_000, 3 + seed);
                    holds(&exact, &trace, 0.05, &context);
                    for row in trace.frequencies(0) {
                        *pooled.entry(row.topology).or_default() += row.count as f64 / 1e7;
                    }
                }
                let apart = |row: &ExactTopology| {
                    let frequency = pooled.get(&row.topology).copied().unwrap_or(0.0);
                    (frequency - row.probability).abs() / 2.0
                };
                let distance: f64 = exact.iter().map(apart).sum();
                assert!(distance < 0.005, "{context}: {distance}");
            }
        }
    }
}

#[test]
#[ignore = "an hour"]
fn ten_million_steps_are_within_0_005_quadratic() {
    ten_million_steps(PenaltyShape::Quadratic);
}

#[test]
#[ignore = "an hour"]
fn ten_million_steps_are_within_0_005_cubic() {
    ten_million_steps(PenaltyShape::Cubic);
}
