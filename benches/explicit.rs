//! Effective draws per CPU second of the estimator `explicit`, on a CSV of detections.
//!
//! `cargo bench --no-default-features --bench explicit -- FILE.csv [key value …]` with the settings
//! σ_o = σ_t = 1, D = 3, H = 50. Keys: `seconds` (of CPU, 20), `R` (2), `moves` (the default mix),
//! `init` (singletons, one or truth), `seed`, `every` (steps between two lines, N), `record` (1:
//! with the trace recorder of a chain, 0), `trace` (a file of lines: step, CPU seconds, M, ln
//! target). Prints steps per second, M and its effective draws per second by batch means.
#![allow(clippy::print_stdout, missing_docs, reason = "a program that prints")]

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use topometric::chain::{Observer, TraceRecorder};
use topometric::detections::Detections;
use topometric::model::{MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::Partition;
use topometric::rng::{Purpose, StepGenerators};
use topometric::sampler::{Arithmetic, Estimator, Kernel, MoveMix, SamplerSettings, SplitRule};

/// CPU seconds of this thread (Linux).
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = text.split(' ').next().expect("a number");
    nanoseconds.parse::<f64>().expect("a number") * 1e-9
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let Some((file, keys)) = arguments.split_first() else {
        println!("no file of detections: nothing is measured");
        return;
    };
    let keys: HashMap<&str, &str> = keys
        .chunks_exact(2)
        .map(|pair| (pair[0].as_str(), pair[1].as_str()))
        .collect();
    let number = |key: &str, default: f64| {
        let text = keys.get(key);
        text.map_or(default, |text| text.parse().expect("a number"))
    };
    let detections = Detections::read_csv(Path::new(file)).expect("detections");
    let n = detections.len();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 50.0,
    };
    let model = Model::from(MetricModel::new(
        &detections.positions_m(),
        1.0,
        1.0,
        penalty,
    ));
    let settings = SamplerSettings {
        moves: match keys.get("moves") {
            Some(moves) => moves.parse().expect("a mix of moves"),
            None => MoveMix::default_of(Estimator::Explicit),
        },
        estimator: Estimator::Explicit,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 1,
        candidates: number("R", 2.0) as usize,
        early_rejection: true,
        tempering: None,
        tiles: false,
    };
    let purpose = Purpose::new("explicit bench", number("seed", 1.0) as u64);
    let generators = StepGenerators::new(&purpose.clone().text("use", "draws"));
    let mut kernel = Kernel::new(&model, Prior::Uniform, &settings, generators);
    let partition = match keys.get("init") {
        Some(&"one") => Partition::one_cluster(n),
        Some(&"truth") => {
            let truth: Vec<i64> = detections
                .truth()
                .iter()
                .map(|id| id.expect("a truth"))
                .collect();
            let topology = topometric::partition::Topology::canonical(&truth);
            Partition::from_labels(topology.labels())
        }
        _ => Partition::singletons(n),
    };
    let (seconds, every) = (number("seconds", 20.0), number("every", n as f64) as u64);
    let mut rng = purpose.generator();
    let (start, mut in_lines) = (cpu_seconds(), 0.0);
    let mut state = kernel.init(partition);
    let mut recorder = TraceRecorder::new(100_000);
    let records = number("record", 0.0) > 0.0;
    if records {
        recorder.start(&state);
    }
    let (mut lines, mut n_sets, mut times) = (String::new(), Vec::new(), Vec::new());
    let mut counts: HashMap<(&str, String), u64> = HashMap::new();
    for step in 0.. {
        let info = kernel.step(&mut state, step, &mut rng);
        if records {
            recorder.step(step, &state, &info);
        }
        if (step + 1) % every == 0 {
            let now = cpu_seconds();
            let time = now - start - in_lines;
            let (m, ln_target) = (state.partition().n_sets(), state.ln_target());
            writeln!(lines, "{} {time:.4} {m} {ln_target:.3} 0", step + 1).expect("memory");
            n_sets.push(m as f64);
            times.push(time);
            // Of the moves one in so many is counted.
            let outcome = format!("{:?}", info.outcome);
            *counts.entry((info.kind.name(), outcome)).or_default() += 1;
            in_lines += cpu_seconds() - now;
            if time > seconds {
                break;
            }
        }
    }
    if let Some(path) = keys.get("trace") {
        std::fs::write(path, lines).expect("a file that can be written");
    }
    // The second half, in fifty batches.
    let half = n_sets.len() / 2;
    let (kept, size) = (&n_sets[half..], n_sets.len() / 2 / 50);
    let mean = kept.iter().sum::<f64>() / kept.len() as f64;
    let variance = kept.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / kept.len() as f64;
    let batches = kept.chunks_exact(size.max(1));
    let of_means = batches
        .clone()
        .map(|batch| (batch.iter().sum::<f64>() / batch.len() as f64 - mean).powi(2));
    let ess = batches.len() as f64 * variance / (of_means.sum::<f64>() / batches.len() as f64);
    let took = times[times.len() - 1];
    println!(
        "{file}: {:.0} steps/s, M {mean:.3}, {:.1} effective draws of M per CPU second",
        (n_sets.len() as u64 * every) as f64 / took,
        ess / (took - times[half])
    );
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort();
    println!("{counts:?}");
}
