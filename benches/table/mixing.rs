//! How well a mix of moves mixes: effective samples per second, and how soon it finds the truth.

use std::time::Instant;

use topometric::chain::{self, Start, TraceRecorder};
use topometric::diagnostics::chains::Chains;
use topometric::diagnostics::ess::ess_bulk;
use topometric::model::Prior;
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::Estimator;
use topometric::sampler::mix::DEFAULT_MOVES;

use crate::cost::{median, settings};
use crate::worlds;

/// The mixes that are compared; the first is the default.
pub const MIXES: [(&str, &str); 6] = [
    ("default", DEFAULT_MOVES),
    (
        "anchors and reassign",
        "split-merge=0.1,reassign=0.4,anchors=0.4,refresh=0.1",
    ),
    ("anchors", "anchors=0.9,refresh=0.1"),
    (
        "sequential allocation",
        "sequential-allocation=0.5,reassign=0.4,refresh=0.1",
    ),
    (
        "restricted Gibbs",
        "restricted-gibbs=0.5,reassign=0.4,refresh=0.1",
    ),
    ("blind split-merge", "split-merge=0.9,refresh=0.1"),
];

/// What one mix does from one start.
pub struct Mixing {
    pub mix: &'static str,
    pub start: &'static str,
    /// Seeds that sampled the truth within [`SOON`] proposals, and the median of when, `None` if most did not.
    pub n_soon: usize,
    pub first: Option<f64>,
    /// ESS per second of M and of ln target over the second half: lower quartile, median, upper quartile.
    pub n_sets_per_s: [f64; 3],
    pub ln_target_per_s: [f64; 3],
}

pub const SOON: u64 = 20_000;
pub const N_SEEDS: u64 = 20;
const N_STEPS: u64 = 60_000;

/// 8 landmarks × 8 detections, R = 30; every mix from one cluster and from singletons.
pub fn compare() -> Vec<Mixing> {
    let mut rows = Vec::new();
    for (start_name, start) in [
        ("one cluster", Start::OneCluster),
        ("singletons", Start::Singletons),
    ] {
        for (mix, moves) in MIXES {
            let settings = settings(Estimator::Common, moves, 30);
            let (mut firsts, mut n_sets, mut ln_target) = (Vec::new(), Vec::new(), Vec::new());
            for seed in 1..=N_SEEDS {
                let world = worlds::grid(8, 8, seed);
                let model = worlds::metric(&world);
                let truth = Topology::canonical(&world.landmarks);
                let mut recorder = TraceRecorder::new(100_000);
                let before = Instant::now();
                let purpose = Purpose::new("bench", seed);
                let prior = Prior::Uniform;
                chain::run(
                    &model,
                    prior,
                    &settings,
                    &start,
                    N_STEPS,
                    &purpose,
                    &mut recorder,
                );
                let seconds = before.elapsed().as_secs_f64() / 2.0;
                let trace = recorder.finish();
                let at_truth = trace
                    .dwell_times(0)
                    .find(|(run, _)| trace.topologies.get(run.topology) == Some(&truth));
                firsts.push(at_truth.map_or(f64::INFINITY, |(run, _)| run.first_step as f64 + 1.0));
                let half = N_STEPS as usize / 2;
                let ess = |values: Vec<f64>| {
                    let chains = Chains::from_draws(&[values[half..].to_vec()]);
                    // A chain that stands still has no effective sample.
                    chains
                        .and_then(|chains| ess_bulk(&chains))
                        .map_or(0.0, |ess| ess.ess)
                };
                n_sets.push(ess(trace.expand(|run| f64::from(run.n_sets))) / seconds);
                ln_target.push(ess(trace.expand(|run| run.ln_target)) / seconds);
            }
            rows.push(Mixing {
                mix,
                start: start_name,
                n_soon: firsts.iter().filter(|&&first| first <= SOON as f64).count(),
                first: Some(median(&mut firsts)).filter(|first| first.is_finite()),
                n_sets_per_s: quartiles(&mut n_sets),
                ln_target_per_s: quartiles(&mut ln_target),
            });
        }
    }
    rows
}

fn quartiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| values[(values.len() - 1) * quarter / 4])
}
