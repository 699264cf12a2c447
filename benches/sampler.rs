//! Nanoseconds per proposal, per importance draw and per pair: ratios within one run are what counts.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::hint::black_box;
use topometric::chain::{self, Observer, Start};
use topometric::detections::Covariance;
use topometric::model::{CovarianceModel, Draws, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::{Partition, Topology};
use topometric::rng::{Purpose, StepGenerators};
use topometric::sampler::mix::DEFAULT_MOVES;
use topometric::sampler::{Arithmetic, Estimator, Kernel, SamplerSettings, SplitRule};

const N_STEPS: u64 = 2_000;

struct Nobody;
impl Observer for Nobody {}

/// Landmarks on a jittered square grid 10 m apart, each detected twice with 0.3 m of noise.
fn grid_world(n_detections: usize) -> Vec<[f64; 2]> {
    let mut rng = Purpose::new("bench", n_detections as u64).generator();
    let side = ((n_detections / 2) as f64).sqrt().ceil() as usize;
    let mut positions_m = Vec::new();
    for landmark in 0..n_detections / 2 {
        let centre =
            [landmark / side, landmark % side].map(|k| 10.0 * k as f64 + rng.random::<f64>());
        for _ in 0..2 {
            positions_m.push(centre.map(|c| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                c + 0.3 * noise
            }));
        }
    }
    positions_m
}

fn penalty(shape: PenaltyShape) -> Penalty {
    Penalty {
        shape,
        radius_m: 3.0,
        height: 50.0,
    }
}

fn settings(estimator: Estimator, moves: &str, importance_samples: usize) -> SamplerSettings {
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

/// Covariances of their own for every detection, as the covariance model wants them.
fn covariance_model(positions_m: &[[f64; 2]]) -> Model {
    let covariances_m2: Vec<Covariance> = (0..positions_m.len())
        .map(|i| Covariance {
            xx: 0.3 + 0.01 * (i % 7) as f64,
            xy: 0.05,
            yy: 0.3,
        })
        .collect();
    let penalty = penalty(PenaltyShape::Quadratic);
    CovarianceModel::new(positions_m, &covariances_m2, 1.0, 1.0, penalty)
        .expect("good covariances")
        .into()
}

/// From the truth, pairs of detections: what a settled chain costs.
fn run(model: &Model, settings: &SamplerSettings, purpose: &Purpose) -> u64 {
    let labels: Vec<usize> = (0..model.n_detections()).map(|i| i / 2).collect();
    let start = Start::At(Topology::canonical(&labels));
    let n_steps = N_STEPS;
    chain::run(
        model,
        Prior::Uniform,
        settings,
        &start,
        n_steps,
        purpose,
        &mut Nobody,
    )
    .step()
}

/// Time of N_STEPS proposals, without setting up.
fn proposals(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("proposal from the truth, R = 8");
    group
        .throughput(Throughput::Elements(N_STEPS))
        .sample_size(10);
    for n_detections in [16, 64, 256, 1024, 4096, 16_384] {
        let positions_m = grid_world(n_detections);
        let metric: Model =
            MetricModel::new(&positions_m, 1.0, 1.0, penalty(PenaltyShape::Quadratic)).into();
        let covariance = covariance_model(&positions_m);
        for (name, model) in [("metric", &metric), ("covariance", &covariance)] {
            for estimator in [Estimator::Common, Estimator::Fresh] {
                if estimator == Estimator::Fresh && n_detections > 1024 {
                    // Its cost grows with N: milliseconds a proposal.
                    continue;
                }
                let settings = settings(estimator, DEFAULT_MOVES, 8);
                let name = format!("{estimator}, {name}");
                group.bench_function(BenchmarkId::new(name, n_detections), |bencher| {
                    let purpose = Purpose::new("bench", 1);
                    let generators = StepGenerators::new(&purpose);
                    let labels: Vec<u32> = (0..n_detections as u32).map(|i| i / 2).collect();
                    let mut kernel = Kernel::new(model, Prior::Uniform, &settings, generators);
                    let mut state = kernel.init(Partition::from_labels(&labels));
                    let mut rng = purpose.generator();
                    let mut step = 0;
                    bencher.iter(|| {
                        for _ in 0..N_STEPS {
                            kernel.step(&mut state, step, &mut rng);
                            step += 1;
                        }
                    });
                });
            }
        }
    }
    group.finish();
}

/// The report's sampler against ours at N = 16, R = 30, and what rejecting early saves.
fn estimators(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("proposal, N = 16, R = 30");
    group
        .throughput(Throughput::Elements(N_STEPS))
        .sample_size(20);
    let positions_m = grid_world(16);
    let model: Model =
        MetricModel::new(&positions_m, 1.0, 1.0, penalty(PenaltyShape::Quadratic)).into();
    let purpose = Purpose::new("bench", 1);
    for (name, estimator, moves) in [
        ("fresh, split-merge", Estimator::Fresh, "split-merge"),
        ("fresh, default moves", Estimator::Fresh, DEFAULT_MOVES),
        (
            "common, split-merge",
            Estimator::Common,
            "split-merge=0.8,refresh=0.2",
        ),
        ("common, default moves", Estimator::Common, DEFAULT_MOVES),
    ] {
        for early_rejection in [true, false] {
            let settings = SamplerSettings {
                early_rejection,
                ..settings(estimator, moves, 30)
            };
            let early = if early_rejection { "on" } else { "off" };
            let id = BenchmarkId::new(name, format!("early rejection {early}"));
            group.bench_function(id, |bencher| {
                bencher.iter(|| run(&model, &settings, &purpose))
            });
        }
    }
    group.finish();
}

fn estimates(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("estimate, N = 16, R = 64");
    let positions_m = grid_world(16);
    let partition = Partition::singletons(16);
    let mut draws = Draws::new(16, 64);
    for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
        let model: Model = MetricModel::new(&positions_m, 1.0, 1.0, penalty(shape)).into();
        let mut rng = Purpose::new("bench", 2).generator();
        group.bench_function(shape.to_string(), |bencher| {
            bencher.iter(|| {
                let sets = partition.sets().iter().map(Vec::as_slice);
                draws.ln_mean_exp(&model, sets, &mut rng)
            });
        });
    }
    // The bound: an estimate cannot cost less than its normals.
    let mut rng = Purpose::new("bench", 3).generator();
    group.bench_function("its 2,048 normals alone", |bencher| {
        bencher.iter(|| {
            (0..2 * 16 * 64)
                .map(|_| -> f64 { StandardNormal.sample(&mut rng) })
                .sum::<f64>()
        });
    });
    group.finish();
}

fn kernel(criterion: &mut Criterion) {
    const N_DRAWS: usize = 64;
    let mut group = criterion.benchmark_group("penalty of one pair, 64 draws");
    group.throughput(Throughput::Elements(N_DRAWS as u64));
    let mut rng = Purpose::new("bench", 4).generator();
    let mut slice = || -> Vec<f64> { (0..N_DRAWS).map(|_| 4.0 * rng.random::<f64>()).collect() };
    let values = [slice(), slice(), slice(), slice()];
    for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
        let penalty = penalty(shape);
        let mut sums = vec![0.0; N_DRAWS];
        group.bench_function(shape.to_string(), |bencher| {
            bencher.iter(|| {
                let [x1, y1, x2, y2] = black_box(&values);
                penalty.add_pair([x1, y1], [x2, y2], black_box(&mut sums));
            });
        });
    }
    group.finish();
}

criterion_group!(benches, proposals, estimators, estimates, kernel);
criterion_main!(benches);
