//! Chains with the options of the model switched on, against the law that enumeration gives them.

use topometric::chain::{self, Start, Trace, TraceRecorder};
use topometric::detections::{Corner, Covariance};
use topometric::exact::{self, ExactSettings, ExactTopology};
use topometric::model::{
    Appearance, Confusion, CovarianceModel, MetricModel, Model, OptimumMethod, Penalty,
    PenaltyShape, Prior,
};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::{Estimator, SamplerSettings};
use topometric::settings::Settings;

use crate::statistic::{threshold, total_variation};

const POSITIONS_M: [[f64; 2]; 5] = [[0.0, 0.0], [0.4, 0.3], [1.4, -0.2], [1.6, 0.5], [0.7, 1.1]];

fn metric(height: f64) -> MetricModel {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.5,
        height,
    };
    MetricModel::new(&POSITIONS_M, 0.5, 0.6, penalty)
}

fn sample(model: &Model, n_steps: u64) -> Trace {
    let mut recorder = TraceRecorder::new(1000);
    let settings = SamplerSettings {
        importance_samples: 4,
        estimator: Estimator::Fresh,
        moves: "split-merge".parse().expect("a good mix"),
        ..Settings::default().sampler(4)
    };
    let purpose = Purpose::new("stationary law test", 1);
    let start = &Start::Singletons;
    chain::run(
        model,
        Prior::Uniform,
        &settings,
        start,
        n_steps,
        &purpose,
        &mut recorder,
    );
    recorder.finish()
}

fn enumerate(model: &Model) -> Vec<ExactTopology> {
    let mut rng = Purpose::new("stationary law test", 2).generator();
    exact::enumerate(model, Prior::Uniform, 50_000, &mut rng)
}

/// Where the chain stood, step by step.
fn path(trace: &Trace) -> Vec<(Option<&Topology>, u64)> {
    let runs = trace.runs.iter();
    runs.map(|run| (trace.topologies.get(run.topology), run.first_step))
        .collect()
}

/// The law is that of the closed form's enumeration, which no optimiser has touched.
#[test]
fn chains_on_an_optimiser_have_the_law_of_the_closed_form() {
    let exact = enumerate(&metric(3.0).into());
    let chain = |method| sample(&metric(3.0).with_optimum(method).into(), 200_000);
    let (bfgs, newton) = (chain(OptimumMethod::Bfgs), chain(OptimumMethod::Newton));
    let (distance, bound) = (
        total_variation(&bfgs, 0, &exact),
        threshold(&bfgs, 0, &exact),
    );
    assert!(distance < bound, "{distance} {bound}");
    // With the same seed BFGS and Newton place the same draws to eight digits, and no acceptance of this chain is
    // as near as that: they stand at the same topology at every step.
    assert_eq!(path(&bfgs), path(&newton));
    // The closed form takes ε to X by another root of Σ than Cholesky's, so its draws and its path differ.
    assert_ne!(path(&bfgs), path(&chain(OptimumMethod::ClosedForm)));
}

/// Without a penalty no draw counts, and all three stand at the same topology at every step.
#[test]
fn without_a_penalty_every_way_takes_the_same_path() {
    let chain = |method| sample(&metric(0.0).with_optimum(method).into(), 50_000);
    let closed = chain(OptimumMethod::ClosedForm);
    assert!(closed.runs.len() > 1000);
    for method in [OptimumMethod::Bfgs, OptimumMethod::Newton] {
        assert_eq!(path(&chain(method)), path(&closed), "{method}");
    }
}

/// Both models with kinds that speak against the nearest pairs, one of them unknown.
fn with_kinds() -> [(Model, Model); 2] {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 2.0,
        height: 2.0,
    };
    let covariances_m2 = [Covariance {
        xx: 0.4,
        xy: 0.1,
        yy: 0.5,
    }; 5];
    let covariance = CovarianceModel::new(&POSITIONS_M, &covariances_m2, 0.7, 0.9, penalty);
    let (open, closed) = (Some(Corner::Open), Some(Corner::Closed));
    let confusion = Confusion {
        open_as_closed: 0.05,
        closed_as_open: 0.1,
    };
    let kinds = vec![open, closed, closed, open, None];
    let appearance = Appearance::default().with_corner_kinds(confusion, kinds);
    [
        metric(3.0).into(),
        covariance.expect("good covariances").into(),
    ]
    .map(|plain: Model| (plain.clone().with_appearance(appearance.clone()), plain))
}

#[test]
fn chains_see_corner_kinds_and_know_nothing_of_them() {
    for (model, plain) in with_kinds() {
        let trace = sample(&model, 400_000);
        let exact = enumerate(&model);
        let (distance, bound) = (
            total_variation(&trace, 0, &exact),
            threshold(&trace, 0, &exact),
        );
        assert!(distance < bound, "{distance} {bound}");
        // The term matters here, so a chain that left it out would fail.
        let ignored = total_variation(&trace, 0, &enumerate(&plain));
        assert!(ignored > 5.0 * bound, "{ignored} {bound}");
    }
}

/// `ptm exact` integrates sets by their laws, `enumerate` by the sampler's bounds: the term is in both, once. And it is the
/// likelihood of the kinds: π with it is π without it times P(O|T), normalised anew.
#[test]
fn exact_posteriors_have_the_term_once() {
    for (model, plain) in with_kinds() {
        let posterior = |model: &Model| {
            let purpose = Purpose::new("stationary law test", 3);
            exact::posterior(model, Prior::Uniform, &ExactSettings::default(), &purpose).topologies
        };
        let (with, without) = (posterior(&model), posterior(&plain));
        let by_bounds = enumerate(&model);
        for row in &with {
            let of = |rows: &[ExactTopology]| {
                let found = rows.iter().find(|other| other.topology == row.topology);
                found.cloned().expect("every partition")
            };
            let labels = row.topology.labels();
            let ln_likelihood: f64 = (0..row.topology.n_sets() as u32)
                .map(|set| {
                    let members: Vec<u32> = (0..5).filter(|&i| labels[i as usize] == set).collect();
                    model.appearance().ln_likelihood(&members)
                })
                .sum();
            let (plain, bound) = (of(&without), of(&by_bounds));
            // Five joint standard errors: 52 rows of either model.
            let joint = |other: &ExactTopology| 5.0 * row.se.hypot(other.se) + 1e-6;
            let apart = row.ln_unnormalised - plain.ln_unnormalised - ln_likelihood;
            assert!(apart.abs() < joint(&plain), "{}: {apart}", row.topology);
            let apart = row.ln_unnormalised - bound.ln_unnormalised;
            assert!(apart.abs() < joint(&bound), "{}: {apart}", row.topology);
        }
    }
}
