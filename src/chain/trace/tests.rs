//! Tests of traces.

use super::*;
use crate::chain::{self, Start};
use crate::model::{MetricModel, Model, Penalty, PenaltyShape, Prior};
use crate::rng::Purpose;
use crate::sampler::mix::DEFAULT_MOVES;
use crate::sampler::{Arithmetic, Estimator, SamplerSettings, SplitRule, Tempering};

fn recorder(max_runs: usize, values: &[f64]) -> Trace {
    let mut recorder = TraceRecorder::new(16);
    recorder.max_runs = max_runs;
    let mut last = f64::NAN;
    for (step, &ln_target) in (0..).zip(values) {
        if ln_target != last {
            recorder.push(Run {
                first_step: step,
                topology: 0,
                n_sets: 1,
                ln_target,
            });
        }
        last = ln_target;
        recorder.trace.n_steps = step + 1;
    }
    recorder.finish()
}

/// However far it is thinned, a trace is right at every step that it keeps.
#[test]
fn a_thinned_trace_is_right_where_it_is_kept() {
    let values: Vec<f64> = (0..1000_u32)
        .map(|step| f64::from(step * step % 37 / 5))
        .collect();
    let full = recorder(MAX_RUNS, &values);
    assert_eq!(
        (full.stride, full.expand(|run| run.ln_target)),
        (1, values.clone())
    );
    for max_runs in [8, 50, 300] {
        let thin = recorder(max_runs, &values);
        assert!(thin.stride > 1 && thin.runs.len() < max_runs);
        let expanded = thin.expand(|run| run.ln_target);
        assert_eq!(expanded.len(), values.len());
        for step in (0..values.len()).step_by(thin.stride as usize) {
            assert_eq!(expanded[step], values[step], "{step} of {max_runs}");
        }
    }
    let (series, every) = full.sample(100, |run| run.ln_target);
    assert_eq!((series.len(), every), (100, 10));
    assert!((0..100).all(|k| series[k] == values[10 * k]));
    assert_eq!(full.sample(5000, |run| run.ln_target), (values, 1));
}

/// A chain of seven detections, tempered or not, seen by two recorders: one that holds all of it, one
/// that holds next to nothing.
fn whole_and_thin(tempering: Option<Tempering>) -> (Trace, Trace) {
    let positions_m: Vec<[f64; 2]> = (0..7_i32)
        .map(|i| [f64::from(i % 3), 0.7 * f64::from(i / 3)])
        .collect();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.5,
        height: 4.0,
    };
    let model: Model = MetricModel::new(&positions_m, 0.5, 0.6, penalty).into();
    let settings = SamplerSettings {
        moves: DEFAULT_MOVES.parse().expect("a good mix"),
        estimator: Estimator::Common,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 4,
        candidates: 2,
        early_rejection: true,
        tempering,
        tiles: false,
    };
    let mut thin = TraceRecorder::new(40);
    thin.max_runs = 64;
    let mut both = (TraceRecorder::new(1000), thin);
    let purpose = Purpose::new("windows test", 1);
    let (prior, start) = (Prior::Uniform, Start::Singletons);
    chain::run(
        &model, prior, &settings, &start, 200_000, &purpose, &mut both,
    );
    (both.0.finish(), both.1.finish())
}

#[test]
fn sums_are_exact_when_neither_trace_nor_topologies_fit() {
    let tempering = Tempering {
        n_temperatures: 3,
        swap_interval: 5,
    };
    for tempering in [None, Some(tempering)] {
        let (whole, thin) = whole_and_thin(tempering);
        assert_eq!(whole.stride, 1);
        assert!(thin.stride > 1000 && thin.topologies.error_bound() > 0);
        // 200,000 steps: windows of 4,096 are joined twice.
        for (burn_in, first) in [(0, 0), (1, 16_384), (16_384, 16_384), (99_999, 114_688)] {
            let (exact, sums) = (whole.sums(first), thin.sums(burn_in));
            assert_eq!(sums.n_sets.n, whole.n_steps - first);
            assert_eq!(sums.pairs, exact.pairs);
            assert_eq!(sums.pair_error_bound, 0);
            for (sums, exact) in [
                (sums.n_sets, exact.n_sets),
                (sums.ln_target, exact.ln_target),
            ] {
                assert!((sums.mean - exact.mean).abs() < 1e-10);
                let (sd, exact) = (sums.sd().expect("steps"), exact.sd().expect("steps"));
                assert!((sd - exact).abs() < 1e-10);
            }
        }
    }
}
