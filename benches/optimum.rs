//! What X*, Σ and ln I₀ of a set cost by an optimiser and in closed form, and what a chain makes of it.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt;
use std::hint::black_box;
use topometric::chain::{self, Observer, Start};
use topometric::model::optimum::SetOptimum;
use topometric::model::{MetricModel, Model, OptimumMethod, Penalty, PenaltyShape, Prior};
use topometric::rng::Purpose;
use topometric::settings::Settings;

const N_STEPS: u64 = 2_000;

struct Nobody;
impl Observer for Nobody {}

/// Pairs of detections of landmarks some metres apart.
fn metric(n_detections: usize) -> MetricModel {
    let mut rng = Purpose::new("bench", n_detections as u64).generator();
    let positions_m: Vec<[f64; 2]> = (0..n_detections)
        .map(|i| [5 * (i / 2 % 4), 5 * (i / 8)].map(|k| k as f64 + rng.random::<f64>()))
        .collect();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 50.0,
    };
    MetricModel::new(&positions_m, 1.0, 0.5, penalty)
}

fn sets(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("X*, Σ and ln I0 of one set");
    for n in [2, 4, 8, 16] {
        let model = metric(n);
        let members: Vec<u32> = (0..n as u32).collect();
        group.bench_function(BenchmarkId::new("closed-form", n), |bencher| {
            bencher.iter(|| {
                let members = black_box(&members);
                (
                    model.mean_m(members),
                    model.shrinkage(n),
                    model.ln_gaussian(members),
                )
            });
        });
        for method in [OptimumMethod::Bfgs, OptimumMethod::Newton] {
            group.bench_function(BenchmarkId::new(method.to_string(), n), |bencher| {
                bencher.iter(|| SetOptimum::find(&model, black_box(&members), method));
            });
        }
    }
    group.finish();
}

fn chains(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("proposal by way of the optimum, N = 16, R = 30");
    group
        .throughput(Throughput::Elements(N_STEPS))
        .sample_size(10);
    let settings = Settings::default().sampler(4);
    let purpose = Purpose::new("bench", 1);
    for method in [
        OptimumMethod::ClosedForm,
        OptimumMethod::Bfgs,
        OptimumMethod::Newton,
    ] {
        let model = Model::from(metric(16).with_optimum(method));
        group.bench_function(method.to_string(), |bencher| {
            bencher.iter(|| {
                let start = &Start::Singletons;
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
    group.finish();
}

criterion_group!(benches, sets, chains);
criterion_main!(benches);
