//! Explicit locations: every move, prior, penalty and R against enumeration.

use topometric::chain::{self, Start, Trace, TraceRecorder};
use topometric::detections::Corner;
use topometric::exact::{self, ExactSettings, ExactTopology};
use topometric::model::{Appearance, Confusion, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::rng::Purpose;
use topometric::sampler::{Arithmetic, Estimator, MoveMix, SamplerSettings, SplitRule};

use crate::statistic::{threshold, total_variation};

const PRIORS: [Prior; 3] = [
    Prior::Uniform,
    Prior::Poisson { rate: 0.2 },
    Prior::DirichletProcess { concentration: 0.3 },
];

/// Every move with as little else as makes it reach everything.
const MOVES: [&str; 7] = [
    "site",
    "site=0.6,slice=0.4",
    "site=0.1,flip=0.6,slice=0.3",
    "split-merge",
    "split-merge=0.6,slice=0.4",
    "site=0.2,group=0.6,slice=0.2",
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
        importance_samples: n_candidates,
        early_rejection: true,
        tempering: None,
    }
}

/// Data sets by number: a loose line, a crowd, two groups that are far apart, a crowd of two kinds
/// of corners.
fn models(shape: PenaltyShape) -> Vec<(&'static str, Model)> {
    let metric = |z: &[[f64; 2]], scales: [f64; 2], radius_m: f64, height: f64| {
        let penalty = Penalty {
            shape,
            radius_m,
            height,
        };
        MetricModel::new(z, scales[0], scales[1], penalty)
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
                .with_appearance(appearance)
                .into(),
        ),
        (
            "no penalty",
            metric(&crowd[..4], [0.7, 2.0], 1.0, 0.0).into(),
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
                // Far places are rare, and nothing else leads across.
                let n_steps = if *name == "apart" { 800_000 } else { 200_000 };
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
    let (name, model) = &models[1];
    for prior in PRIORS {
        let mut rng = Purpose::new("explicit law test", 3).generator();
        let exact = exact::enumerate(model, prior, 40_000, &mut rng);
        for n_candidates in [1, 2, 4, 8] {
            for moves in ["auto", "split-merge=0.4,site=0.2,group=0.4"] {
                let trace = sample(model, prior, &settings(moves, n_candidates), 200_000, 2);
                let context = format!("{name} {prior} {moves} R = {n_candidates}");
                holds(&exact, &trace, 0.1, &context);
            }
        }
    }
}

/// The posterior to a twentieth of what the long forms below are held to.
fn close(model: &Model, prior: Prior) -> Vec<ExactTopology> {
    let purpose = Purpose::new("explicit law test", 4);
    let settings = ExactSettings {
        tolerance: 0.0005,
        ..ExactSettings::default()
    };
    exact::posterior(model, prior, &settings, &purpose).topologies
}

/// A long form: ten million steps on every data set with every prior, penalty and R.
#[test]
#[ignore = "half an hour"]
fn ten_million_steps_are_within_0_01() {
    for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
        for (name, model) in &models(shape) {
            for prior in PRIORS {
                let exact = close(model, prior);
                for n_candidates in [1, 2, 4, 8] {
                    let settings = settings("auto", n_candidates);
                    let trace = sample(model, prior, &settings, 10_000_000, 3);
                    let context = format!("{name} {shape} {prior} R = {n_candidates}");
                    let distance = holds(&exact, &trace, 0.02, &context);
                    assert!(distance < 0.01, "{context}: {distance}");
                }
            }
        }
    }
}

/// Another: where ten million steps leave 0.005 of noise, forty million leave half of it.
#[test]
#[ignore = "ten minutes"]
fn forty_million_steps_on_a_crowd_are_within_0_004() {
    let model = &models(PenaltyShape::Quadratic)[1].1;
    let exact = close(model, Prior::Uniform);
    for n_candidates in [2, 1, 4, 8] {
        let settings = settings("auto", n_candidates);
        let trace = sample(model, Prior::Uniform, &settings, 40_000_000, 5);
        let distance = holds(&exact, &trace, 0.01, &format!("R = {n_candidates}"));
        assert!(distance < 0.004, "R = {n_candidates}: {distance}");
    }
}
