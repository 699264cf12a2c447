//! Does `ptm tune` choose the distance up to which to merge as well as one can? On simulated worlds of known truth,
//! beside fixed multiples of the noise that it finds, and the best rung of its ladder.
//!
//! Worlds are drawn from flat laws: 8 to 40 landmarks, one to a square metre on average, anywhere or (every other world)
//! 0.2 to 0.6 m apart at least; a robot between random way-points sees those within a circle that holds 2 to 8 of them, until
//! there are 2 to 8 detections of each; a detection is a sighting, or a stretch of them; noise of 0.03 to 0.3 m per axis, in
//! half of the worlds half of its variance a random walk that neighbouring detections share.
//!
//! `cargo bench --bench tuning -- FIRST COUNT` prints the table in docs/tune.md; worlds 100 to 219 are those that the
//! rule was chosen on.
#![allow(missing_docs)]
#![allow(clippy::print_stdout)]

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use topometric::chain::Start;
use topometric::dataset::DataSet;
use topometric::detections::{Detection, Detections};
use topometric::results::evaluation::baselines;
use topometric::rng::Purpose;
use topometric::tune::rule::{ModelKind, Tuned, settings_for};
use topometric::tune::trial::{self, Errors};
use topometric::tune::{Request, tune};

struct Laws {
    n_landmarks: usize,
    noise_m: f64,
    apart_m: f64,
    drift: f64,
    in_view: f64,
    visits: f64,
    stretches: bool,
}

fn world(k: u64) -> (f64, Detections) {
    let mut rng = Purpose::new("tuning study", k).generator();
    let uniform = |lo: f64, hi: f64, rng: &mut dyn FnMut() -> f64| lo + (hi - lo) * rng();
    let mut u = || rng.random_range(0.0..1.0);
    let laws = Laws {
        n_landmarks: uniform(8.0, 40.0, &mut u) as usize,
        noise_m: libm::exp(uniform(libm::log(0.03), libm::log(0.3), &mut u)),
        apart_m: if k.is_multiple_of(2) {
            0.0
        } else {
            uniform(0.2, 0.6, &mut u)
        },
        drift: if (k / 2).is_multiple_of(2) { 0.0 } else { 0.5 },
        in_view: uniform(2.0, 8.0, &mut u),
        visits: uniform(2.0, 8.0, &mut u),
        stretches: !(k / 4).is_multiple_of(2),
    };
    let side = (laws.n_landmarks as f64).sqrt();
    let mut landmarks: Vec<[f64; 2]> = Vec::new();
    while landmarks.len() < laws.n_landmarks {
        let place = [side * u(), side * u()];
        if landmarks
            .iter()
            .all(|o| libm::hypot(o[0] - place[0], o[1] - place[1]) >= laws.apart_m)
        {
            landmarks.push(place);
        }
    }
    let view = (laws.in_view / std::f64::consts::PI).sqrt();
    let mut at = [side * u(), side * u()];
    let mut goal = [side * u(), side * u()];
    let target = (laws.n_landmarks as f64 * laws.visits) as usize;
    let mut stretch: Vec<Option<usize>> = vec![None; laws.n_landmarks];
    // Landmark, first and last time.
    let mut rows: Vec<(usize, usize, usize)> = Vec::new();
    let mut t = 0;
    while rows.len() < target && t < 100_000 {
        let d = libm::hypot(goal[0] - at[0], goal[1] - at[1]);
        let step = view / 2.0;
        if d < step {
            goal = [side * u(), side * u()];
        } else {
            at = [0, 1].map(|a| at[a] + (goal[a] - at[a]) * step / d);
        }
        for (l, place) in landmarks.iter().enumerate() {
            let seen = libm::hypot(place[0] - at[0], place[1] - at[1]) < view;
            if !seen {
                stretch[l] = None;
                continue;
            }
            match stretch[l].filter(|_| laws.stretches) {
                Some(row) => rows[row].2 = t,
                None => {
                    stretch[l] = Some(rows.len());
                    rows.push((l, t, t));
                }
            }
        }
        t += 1;
    }
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    // A random walk of variance drift·s² on average over the mission.
    let mut walk = vec![[0.0; 2]; t + 1];
    let step_m = (2.0 * laws.drift / t as f64).sqrt() * laws.noise_m;
    for i in 1..=t {
        walk[i] = walk[i - 1].map(|v| v + step_m * normal());
    }
    let detections: Vec<Detection> = rows
        .iter()
        .map(|&(l, first, last)| {
            let white = laws.noise_m * (1.0 - laws.drift).sqrt();
            let [x, y] = [0, 1].map(|a| landmarks[l][a] + walk[first][a] + white * normal());
            Detection {
                landmark: Some(l as i64),
                first_seen_s: Some(first as f64),
                last_seen_s: Some(last as f64 + 0.5),
                ..Detection::at(x, y)
            }
        })
        .collect();
    (laws.noise_m, Detections::new(detections).expect("finite"))
}

/// Ways of choosing; those marked are told the truth.
const WAYS: [&str; 8] = [
    "`ptm tune`",
    "within 3.0 s (90 %)",
    "within 3.5 s (95 %)",
    "within 4.3 s (99 %)",
    "best rung\\*",
    "DBSCAN\\*",
    "Ward\\*",
    "nearest centroid\\*",
];

/// Noise of the world, m, and what each way comes to.
fn score(k: u64) -> (f64, [f64; 8]) {
    let (noise_m, detections) = world(k);
    let request = Request {
        model: ModelKind::Metric,
        sensor_noise_m: None,
        simulate: false,
        seed: 1,
    };
    let found = tune(&detections, &request).expect("many detections");
    let errors = Errors::of(&detections, ModelKind::Metric).expect("no need of covariances");
    let data = DataSet::new(detections, None);
    let truth = data.truth.clone().expect("known");
    let positions_m = data.detections.positions_m();
    let index = |settings: &Tuned| {
        let model = errors.model(&positions_m, settings);
        let purpose = Purpose::new("tuning study", k).text("use", "chain");
        let map = trial::map(&model, &Start::Singletons, &purpose);
        truth.adjusted_rand_index(&map).expect("known")
    };
    let s = found.noise.value;
    let visits = positions_m.len() as f64 / found.n_landmarks.value;
    let within = |factor: f64| index(&settings_for(ModelKind::Metric, factor * s, s, visits));
    let rungs = found.ladder.iter().map(|rung| index(&rung.settings));
    let plain = baselines(&data, &truth);
    let baseline = |method: &str| {
        let score = plain.iter().find(|score| score.method == method);
        score.map_or(f64::NAN, |score| score.truth.adjusted_rand_index)
    };
    let indices = [
        index(&found.settings),
        within(3.035),
        within(3.462),
        within(4.292),
        rungs.fold(f64::NEG_INFINITY, f64::max),
        baseline("dbscan-tuned"),
        baseline("ward-true-number"),
        baseline("nearest-true-centroid"),
    ];
    (noise_m, indices)
}

fn main() {
    let numbers: Vec<u64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let is_test = std::env::args().any(|argument| argument == "--test");
    let from = numbers.first().copied().unwrap_or(1000);
    let count = if is_test {
        2
    } else {
        numbers.get(1).copied().unwrap_or(120)
    };
    let scores: Vec<(f64, [f64; 8])> = (from..from + count).into_par_iter().map(score).collect();
    println!("| noise, m | worlds | {} |", WAYS.join(" | "));
    println!("|---|---|{}", "---|".repeat(WAYS.len()));
    for (low, high) in [(0.0, 0.08), (0.08, 0.15), (0.15, 1.0), (0.0, 1.0)] {
        let these: Vec<&[f64; 8]> = scores
            .iter()
            .filter(|(noise_m, _)| (low..high).contains(noise_m))
            .map(|(_, indices)| indices)
            .collect();
        let n = these.len() as f64;
        let cell = |way: usize| {
            let mean = these.iter().map(|indices| indices[way]).sum::<f64>() / n;
            if way == 0 {
                return format!("{mean:.3}");
            }
            // Paired with the first.
            let d: Vec<f64> = these
                .iter()
                .map(|indices| indices[way] - indices[0])
                .collect();
            let m = d.iter().sum::<f64>() / n;
            let variance = d.iter().map(|d| (d - m).powi(2)).sum::<f64>() / (n - 1.0);
            format!("{mean:.3} ({m:+.3} ± {:.3})", 2.0 * (variance / n).sqrt())
        };
        let cells: Vec<String> = (0..WAYS.len()).map(cell).collect();
        println!("| {low} to {high} | {n} | {} |", cells.join(" | "));
    }
}
