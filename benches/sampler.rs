//! Nanoseconds per proposal, per importance draw and per pair: ratios within one run are what counts.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::hint::black_box;
use topometric::chain::{self, Observer, Start};
use topometric::model::{Draws, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::{Partition, Topology};
use topometric::rng::Purpose;
use topometric::sampler::{Arithmetic, Estimator, SamplerSettings, SplitRule};

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

fn settings(early_rejection: bool) -> SamplerSettings {
    SamplerSettings {
        moves: "split-merge".parse().expect("a good mix"),
        estimator: Estimator::Fresh,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 30,
        early_rejection,
    }
}

fn proposals(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("proposal, fresh, R = 30");
    group
        .throughput(Throughput::Elements(N_STEPS))
        .sample_size(20);
    for n_detections in [16, 64, 256] {
        let positions_m = grid_world(n_detections);
        let model: Model =
            MetricModel::new(&positions_m, 1.0, 1.0, penalty(PenaltyShape::Quadratic)).into();
        for early_rejection in [true, false] {
            let settings = settings(early_rejection);
            let name = if early_rejection {
                "early rejection on"
            } else {
                "early rejection off"
            };
            group.bench_function(BenchmarkId::new(name, n_detections), |bencher| {
                let purpose = Purpose::new("bench", 1);
                let labels: Vec<usize> = (0..n_detections).map(|i| i / 2).collect();
                let pairs = Start::At(Topology::canonical(&labels));
                bencher.iter(|| {
                    let start = &pairs;
                    chain::run(
                        &model,
                        Prior::Uniform,
                        &settings,
                        start,
                        N_STEPS,
                        &purpose,
                        &mut Nobody,
                    )
                });
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

criterion_group!(benches, proposals, estimates, kernel);
criterion_main!(benches);
