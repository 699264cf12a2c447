//! What an exact posterior costs on one core: seconds and draws against the number of detections, easy
//! and crowded, in both models. `cargo bench --bench exact -- [TOLERANCE] [MAX_DRAWS]`.
#![allow(clippy::print_stdout)]

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use topometric::detections::Covariance;
use topometric::exact::{ExactSettings, Round, Watch, watched_posterior};
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::rng::Purpose;

/// The detections of a line of landmarks `spacing_m` apart, each seen about twice.
fn positions_m(n: usize, spacing_m: f64) -> Vec<[f64; 2]> {
    let place = |k: usize| {
        let (landmark, copy) = (k / 2, k % 2);
        let wobble = (k as f64 * 2.399_963).sin_cos();
        let along = landmark as f64 * spacing_m;
        let radius_m = 0.3 + 0.3 * copy as f64;
        [
            (landmark % 2) as f64 * spacing_m + radius_m * wobble.0,
            along * 0.7 + radius_m * wobble.1,
        ]
    };
    (0..n).map(place).collect()
}

/// Seven detections within the radius of one another, one a little apart.
const SEVEN: [[f64; 2]; 7] = [
    [0.049, 0.558],
    [2.447, 0.423],
    [1.111, 0.494],
    [4.874, -1.062],
    [0.081, -0.846],
    [2.060, -0.220],
    [0.266, 0.503],
];

fn main() {
    let numbers: Vec<f64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let settings = ExactSettings {
        tolerance: numbers.first().copied().unwrap_or(0.01),
        max_draws: numbers.get(1).copied().unwrap_or(2e7),
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    println!("case                     n  model      rounds     draws  seconds      error");
    let mut cases: Vec<(String, Vec<[f64; 2]>, f64, f64)> = Vec::new();
    for n in 4..=9 {
        cases.push(("easy D 3 H 10".into(), positions_m(n, 6.0), 3.0, 10.0));
        cases.push(("crowded D 3 H 10".into(), positions_m(n, 1.2), 3.0, 10.0));
        cases.push((
            "default D 10 H 100".into(),
            positions_m(n, 2.0),
            10.0,
            100.0,
        ));
    }
    cases.push(("seven D 3 H 10".into(), SEVEN.to_vec(), 3.0, 10.0));
    cases.push(("seven D 3 H 3".into(), SEVEN.to_vec(), 3.0, 3.0));
    cases.push(("seven D 3 H 100".into(), SEVEN.to_vec(), 3.0, 100.0));
    cases.push(("seven D 10 H 100".into(), SEVEN.to_vec(), 10.0, 100.0));
    for (name, positions_m, radius_m, height) in &cases {
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: *radius_m,
            height: *height,
        };
        let covariance = |k: usize| Covariance {
            xx: 0.5 + 0.05 * k as f64,
            xy: 0.1,
            yy: 0.6,
        };
        let covariances_m2: Vec<Covariance> = (0..positions_m.len()).map(covariance).collect();
        let metric: Model = MetricModel::new(positions_m, 1.0, 1.0, penalty).into();
        let covariance = CovarianceModel::new(positions_m, &covariances_m2, 1.0, 1.0, penalty);
        let covariance: Model = covariance.expect("good covariances").into();
        for (model_name, model) in [("metric", metric), ("covariance", covariance)] {
            let started = Instant::now();
            let mut rounds = 0;
            let found = one.install(|| {
                let purpose = Purpose::new("bench", 1);
                let watch = Watch {
                    round: &mut |round: &Round| rounds = round.number,
                    stop: &AtomicBool::new(false),
                };
                watched_posterior(&model, Prior::Uniform, &settings, &purpose, watch)
            });
            let found = found.expect("nobody stops it");
            println!(
                "{name:<22} {:>3}  {model_name:<10} {rounds:>6} {:>9.1e} {:>8.2} {:>10.1e} {:?}",
                positions_m.len(),
                found.n_draws,
                started.elapsed().as_secs_f64(),
                found.error.total(),
                found.ended
            );
        }
    }
}
