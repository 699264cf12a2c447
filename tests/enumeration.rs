//! Chains against exact posteriors that no code of this project computed (`tests/oracle`).

#[path = "common/oracle.rs"]
mod oracle;

use std::collections::HashMap;

use oracle::{Oracle, c1, m1, m3};

use topometric::chain::{self, Start, Trace, TraceRecorder};
use topometric::exact;
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::{Arithmetic, Estimator, MoveMix, SamplerSettings, SplitRule};

fn sample(oracle: &Oracle, start: &Start, n_steps: u64) -> Trace {
    sample_model(&oracle.model, start, n_steps)
}

fn sample_model(model: &Model, start: &Start, n_steps: u64) -> Trace {
    sample_with(model, &report(), start, n_steps)
}

/// The report's sampler.
fn report() -> SamplerSettings {
    SamplerSettings {
        moves: "split-merge".parse().expect("a good mix"),
        estimator: Estimator::Fresh,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 30,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

fn sample_with(model: &Model, settings: &SamplerSettings, start: &Start, n_steps: u64) -> Trace {
    let mut recorder = TraceRecorder::new(1000);
    let purpose = Purpose::new("enumeration test", 1);
    chain::run(
        model,
        Prior::Uniform,
        settings,
        start,
        n_steps,
        &purpose,
        &mut recorder,
    );
    recorder.finish()
}

fn total_variation(oracle: &Oracle, trace: &Trace) -> f64 {
    let counts: HashMap<Topology, u64> = trace
        .frequencies(0)
        .into_iter()
        .map(|row| (row.topology, row.count))
        .collect();
    assert!(
        counts
            .keys()
            .all(|topology| oracle.probabilities.contains_key(topology))
    );
    let apart = oracle.probabilities.iter().map(|(topology, probability)| {
        let frequency = counts.get(topology).copied().unwrap_or(0) as f64 / trace.n_steps as f64;
        (frequency - probability).abs()
    });
    apart.sum::<f64>() / 2.0
}

/// 0.015 is what the project promises for 10⁶ samples at R = 30.
#[test]
fn a_million_samples_are_within_0_015_of_the_exact_posterior() {
    for (name, oracle) in [("m1", m1()), ("m3", m3()), ("c1", c1())] {
        for start in [Start::Singletons, Start::OneCluster] {
            let trace = sample(&oracle, &start, 1_000_000);
            let distance = total_variation(&oracle, &trace);
            assert!(distance <= 0.015, "{name} from {start:?}: {distance}");
            let n_sets = trace.expand(|run| f64::from(run.n_sets));
            let mean = n_sets.iter().sum::<f64>() / n_sets.len() as f64;
            assert!(
                (mean - oracle.expected_n_sets).abs() < 0.05,
                "{name}: {mean}"
            );
        }
    }
}

/// The same of explicit locations, at every R.
#[test]
fn explicit_locations_are_within_0_015_of_the_exact_posterior() {
    for (name, oracle) in [("m1", m1()), ("m3", m3()), ("c1", c1())] {
        for candidates in [1, 2, 4, 8] {
            let settings = SamplerSettings {
                moves: MoveMix::default_of(Estimator::Explicit),
                estimator: Estimator::Explicit,
                candidates,
                ..report()
            };
            let start = Start::OneCluster;
            let trace = sample_with(&oracle.model, &settings, &start, 1_000_000);
            let distance = total_variation(&oracle, &trace);
            assert!(distance <= 0.015, "{name} R = {candidates}: {distance}");
        }
    }
}

/// Enumeration in this crate against the oracle: rows above 10⁻³ within five joint standard errors
/// (218 rows, so a fluke has a chance of 10⁻⁴), the table within 0.005.
#[test]
fn enumeration_agrees_with_the_oracle() {
    for (name, oracle) in [("m1", m1()), ("m3", m3()), ("c1", c1())] {
        let mut rng = Purpose::new("enumeration test", 2).generator();
        let rows = exact::enumerate(&oracle.model, Prior::Uniform, 400_000, &mut rng);
        assert_eq!(rows.len(), oracle.rows.len());
        let by_topology: HashMap<&Topology, &exact::ExactTopology> =
            rows.iter().map(|row| (&row.topology, row)).collect();
        let mut distance = 0.0;
        for (topology, probability, ln_unnormalised, se) in &oracle.rows {
            let row = by_topology[topology];
            distance += (row.probability - probability).abs() / 2.0;
            if *probability > 1e-3 {
                // 10⁻⁶ for the digits that the file was written with.
                let joint = (row.se * row.se + se * se).sqrt() + 1e-6;
                let apart = (row.ln_unnormalised - ln_unnormalised).abs();
                assert!(
                    apart < 5.0 * joint,
                    "{name} {topology}: {apart} against {joint}"
                );
            }
        }
        assert!(distance < 0.005, "{name}: {distance}");
    }
}

/// What `ptm exact` promises: the table within 0.005, rows above 10⁻³ within four joint standard
/// errors, rows from 10⁻⁶ on within six.
#[test]
fn the_posterior_to_a_tolerance_agrees_with_the_oracle() {
    for (name, oracle) in [("m1", m1()), ("m3", m3()), ("c1", c1())] {
        let purpose = Purpose::new("enumeration test", 3);
        let settings = exact::ExactSettings::default();
        let posterior = exact::posterior(&oracle.model, Prior::Uniform, &settings, &purpose);
        assert!(
            posterior.error.total() <= 0.002,
            "{name}: {:?}",
            posterior.error
        );
        let mut distance = 0.0;
        for row in &posterior.topologies {
            let expected = oracle
                .rows
                .iter()
                .find(|(topology, ..)| *topology == row.topology);
            let (topology, probability, ln_unnormalised, se) = expected.expect("every partition");
            distance += (row.probability - probability).abs() / 2.0;
            let joint = (row.se * row.se + se * se).sqrt() + 1e-6;
            let bound = match probability {
                p if *p > 1e-3 => 4.0 * joint,
                p if *p > 1e-6 => 6.0 * joint,
                _ => f64::INFINITY,
            };
            let apart = (row.ln_unnormalised - ln_unnormalised).abs();
            assert!(apart < bound, "{name} {topology}: {apart} against {bound}");
        }
        assert!(distance < 0.005, "{name}: {distance}");
        assert!((posterior.expected_n_sets() - oracle.expected_n_sets).abs() < 0.02);
    }
}

/// The report's Fig. 5 and 6: two rows of three detections with ranges that cross.
fn crossing(sigma_o: f64, sigma_t: f64, radius_m: f64) -> [Model; 2] {
    let detections = topometric::world::crossing_ranges();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m,
        height: 50.0,
    };
    let positions_m = detections.positions_m();
    let covariances_m2 = detections.covariances_m2().expect("covariances");
    let covariance = CovarianceModel::new(&positions_m, &covariances_m2, sigma_o, sigma_t, penalty);
    [
        MetricModel::new(&positions_m, sigma_o, sigma_t, penalty).into(),
        covariance.expect("good covariances").into(),
    ]
}

#[test]
fn crossing_ranges_are_three_pairs_under_the_covariance_model_alone() {
    let pairs = Topology::canonical(&[0, 1, 2, 0, 1, 2]);
    let settings = exact::ExactSettings {
        tolerance: 0.01,
        ..exact::ExactSettings::default()
    };
    let exact = |model: &Model| {
        let purpose = Purpose::new("crossing test", 1);
        exact::posterior(model, Prior::Uniform, &settings, &purpose).topologies
    };
    let [metric, covariance] = crossing(0.5, 1.5, 3.0);
    let rows = exact(&covariance);
    assert_eq!(rows[0].topology, pairs);
    assert!(rows[0].probability > 0.9, "{}", rows[0].probability);
    for start in [Start::Singletons, Start::OneCluster] {
        let trace = sample_model(&covariance, &start, 200_000);
        let first = trace.frequencies(100_000).swap_remove(0);
        assert_eq!(first.topology, pairs);
        assert!(first.count > 90_000);
    }
    // Four groupings of neighbours, about a quarter each; none is the three pairs.
    let rows = exact(&metric);
    for row in &rows[..4] {
        assert!((row.probability - 0.25).abs() < 0.05);
        assert_ne!(row.topology, pairs);
    }
    // With the settings of the report's program eq. 6 prefers singletons.
    let [_, covariance] = crossing(2.5, 1.5, 2.0);
    let first = exact(&covariance).swap_remove(0);
    assert_eq!(first.topology, Topology::canonical(&[0, 1, 2, 3, 4, 5]));
    assert!((first.probability - 0.81).abs() < 0.02);
}
