//! Every move × estimator × model × prior at N = 6, and every R.

use topometric::chain::{self, Start, Trace, TraceRecorder};
use topometric::detections::Covariance;
use topometric::exact::{self, ExactTopology};
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::rng::Purpose;
use topometric::sampler::{Arithmetic, Estimator, SamplerSettings, SplitRule, Tempering, n_tuning};

use crate::statistic::{threshold, total_variation};

const POSITIONS_M: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [0.4, 0.3],
    [1.4, -0.2],
    [1.6, 0.5],
    [0.7, 1.1],
    [2.1, 1.3],
];

const PRIORS: [Prior; 3] = [
    Prior::Uniform,
    Prior::Poisson { rate: 0.2 },
    // α is small so that large sets are common: with many singletons the term for a set's size would be
    // next to nothing, and its sign untested.
    Prior::DirichletProcess { concentration: 0.3 },
];

const MOVES: [&str; 7] = [
    "split-merge=0.8,refresh=0.2",
    "split-merge=0.3,reassign=0.5,refresh=0.2",
    "split-merge=0.3,pair-reassign=0.5,refresh=0.2",
    "anchors=0.8,refresh=0.2",
    "sequential-allocation=0.8,refresh=0.2",
    "restricted-gibbs=0.8,refresh=0.2",
    "split-merge=0.1,reassign=0.2,pair-reassign=0.2,anchors=0.2,refresh=0.3",
];

fn penalty(shape: PenaltyShape, radius_m: f64, height: f64) -> Penalty {
    Penalty {
        shape,
        radius_m,
        height,
    }
}

fn metric(shape: PenaltyShape, height: f64) -> Model {
    MetricModel::new(&POSITIONS_M, 0.5, 0.6, penalty(shape, 1.2, height)).into()
}

/// Some detections have covariances of their own, so no two terms of eq. 6 are alike.
fn covariance(shape: PenaltyShape, height: f64) -> Model {
    let covariances_m2: Vec<Covariance> = (0..6)
        .map(|i| Covariance {
            xx: 0.4 + 0.1 * f64::from(i),
            xy: 0.2 - 0.1 * f64::from(i),
            yy: 0.5,
        })
        .collect();
    let penalty = penalty(shape, 1.8, height);
    CovarianceModel::new(&POSITIONS_M, &covariances_m2, 0.7, 0.9, penalty)
        .expect("good covariances")
        .into()
}

fn settings(moves: &str, estimator: Estimator, importance_samples: usize) -> SamplerSettings {
    SamplerSettings {
        moves: moves.parse().expect("a good mix"),
        estimator,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

fn sample(model: &Model, prior: Prior, settings: &SamplerSettings, n_steps: u64) -> Trace {
    let mut recorder = TraceRecorder::new(1000);
    let purpose = Purpose::new("matrix test", 1);
    let start = &Start::Singletons;
    chain::run(
        model,
        prior,
        settings,
        start,
        n_steps,
        &purpose,
        &mut recorder,
    );
    recorder.finish()
}

fn tempered(n_temperatures: usize) -> SamplerSettings {
    SamplerSettings {
        tempering: Some(Tempering {
            n_temperatures,
            swap_interval: 3,
        }),
        ..settings(MOVES[0], Estimator::Common, 8)
    }
}

fn enumerate(model: &Model, prior: Prior) -> Vec<ExactTopology> {
    let mut rng = Purpose::new("matrix test", 2).generator();
    exact::enumerate(model, prior, 40_000, &mut rng)
}

fn holds_the_law(model: &Model, prior: Prior, name: &str) {
    let exact = enumerate(model, prior);
    for estimator in [Estimator::Fresh, Estimator::Common] {
        for moves in MOVES {
            let trace = sample(model, prior, &settings(moves, estimator, 8), 300_000);
            let (distance, bound) = (
                total_variation(&trace, 0, &exact),
                threshold(&trace, 0, &exact),
            );
            let context = format!("{name} {prior} {estimator} {moves}");
            assert!(bound < 0.1, "{context}: too short to tell, {bound}");
            assert!(distance < bound, "{context}: {distance} {bound}");
        }
    }
}

#[test]
fn the_metric_model_has_its_law_under_every_move_and_estimator() {
    for (prior, shape) in PRIORS.into_iter().zip([
        PenaltyShape::Quadratic,
        PenaltyShape::Cubic,
        PenaltyShape::Quadratic,
    ]) {
        holds_the_law(&metric(shape, 3.0), prior, "metric");
    }
}

#[test]
fn the_covariance_model_has_its_law_under_every_move_and_estimator() {
    for (prior, shape) in PRIORS.into_iter().zip([
        PenaltyShape::Quadratic,
        PenaltyShape::Quadratic,
        PenaltyShape::Cubic,
    ]) {
        holds_the_law(&covariance(shape, 3.0), prior, "covariance");
    }
}

/// The prior matters here, so that a chain which ignored it would fail.
#[test]
fn the_priors_differ_by_more_than_the_thresholds() {
    for model in [
        metric(PenaltyShape::Quadratic, 3.0),
        covariance(PenaltyShape::Quadratic, 3.0),
    ] {
        let laws = PRIORS.map(|prior| enumerate(&model, prior));
        for (a, law) in laws.iter().enumerate() {
            for other in &laws[..a] {
                let apart: f64 = law
                    .iter()
                    .zip(other)
                    .map(|(x, y)| (x.probability - y.probability).abs())
                    .sum();
                assert!(apart / 2.0 > 0.1, "{apart}");
            }
        }
    }
}

#[test]
fn the_stationary_law_does_not_depend_on_r() {
    for model in [
        metric(PenaltyShape::Quadratic, 4.0),
        covariance(PenaltyShape::Quadratic, 4.0),
    ] {
        let exact = enumerate(&model, Prior::Uniform);
        for estimator in [Estimator::Fresh, Estimator::Common] {
            for importance_samples in [1, 4, 16, 64] {
                let settings = settings(MOVES[6], estimator, importance_samples);
                let trace = sample(&model, Prior::Uniform, &settings, 400_000);
                let (distance, bound) = (
                    total_variation(&trace, 0, &exact),
                    threshold(&trace, 0, &exact),
                );
                assert!(
                    distance < bound,
                    "{estimator} R = {importance_samples}: {distance} {bound}"
                );
            }
        }
    }
}

/// Without refresh `common` samples π(T | ε), which is another law, and this test would tell: the chain is
/// built by hand, as the settings refuse it.
#[test]
fn common_without_refresh_is_caught() {
    let model = metric(PenaltyShape::Quadratic, 4.0);
    let exact = enumerate(&model, Prior::Uniform);
    let settings = settings("split-merge=0.5,reassign=0.5", Estimator::Common, 2);
    let trace = sample(&model, Prior::Uniform, &settings, 400_000);
    let (distance, bound) = (
        total_variation(&trace, 0, &exact),
        threshold(&trace, 0, &exact),
    );
    assert!(distance > 3.0 * bound, "{distance} {bound}");
}

/// The report's faulty proposal must fail: the same test would catch a wrong ratio.
#[test]
fn a_wrong_ratio_is_caught() {
    // A low penalty, so that the faulty chain mixes and its law, not its sluggishness, is tested.
    let model = metric(PenaltyShape::Quadratic, 1.0);
    let exact = enumerate(&model, Prior::Uniform);
    for (split, n_steps) in [
        (SplitRule::Uniform, 400_000),
        (SplitRule::PrefixCut, 4_000_000),
    ] {
        let settings = SamplerSettings {
            split,
            ..settings("split-merge", Estimator::Fresh, 8)
        };
        let trace = sample(&model, Prior::Uniform, &settings, n_steps);
        let (distance, bound) = (
            total_variation(&trace, 0, &exact),
            threshold(&trace, 0, &exact),
        );
        match split {
            SplitRule::Uniform => assert!(distance < bound, "{distance} {bound}"),
            SplitRule::PrefixCut => assert!(distance > 5.0 * bound, "{distance} {bound}"),
        }
    }
}

/// The coldest rung has the law of a plain chain once its ladder stands, with two rungs and with five, in both models and
/// under every prior.
#[test]
fn a_tempered_chain_has_its_law() {
    for prior in PRIORS {
        for (name, model) in [
            ("metric", metric(PenaltyShape::Quadratic, 3.0)),
            ("covariance", covariance(PenaltyShape::Cubic, 3.0)),
        ] {
            let exact = enumerate(&model, prior);
            for n_temperatures in [2, 5] {
                let trace = sample(&model, prior, &tempered(n_temperatures), 300_000);
                let first = n_tuning(trace.n_steps);
                let (distance, bound) = (
                    total_variation(&trace, first, &exact),
                    threshold(&trace, first, &exact),
                );
                let context = format!("{name} {prior} {n_temperatures} rungs");
                assert!(bound < 0.1, "{context}: too short to tell, {bound}");
                assert!(distance < bound, "{context}: {distance} {bound}");
            }
        }
    }
}
