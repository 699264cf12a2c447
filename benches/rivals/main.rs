//! Whole missions by `ptm solve` and by its rivals, on recordings whose landmarks are known.
//!
//! `cargo bench --bench rivals -- DATA` takes a folder with `graphs/*.g2o` (landmark vertices are
//! the true ids; a `*_truth.csv` of x,y,theta beside it is the true path) and, if it is there,
//! `mrclam_ds6`, and prints a table in Markdown. `-- DATA PART` takes the recordings with PART in
//! their name. Methods marked * are told something of the truth.
//!
//! Each method gives a landmark for each sighting and is then given the same back end: the optimum
//! of the graph with its ids. So the trajectories differ by association alone. What the rivals are,
//! `filter` and `clusters` say.
#![allow(missing_docs)]
#![allow(clippy::print_stdout, reason = "a table is what this is for")]
#![allow(
    clippy::unwrap_used,
    reason = "a study that cannot go on should say where"
)]

mod assignment;
mod clusters;
mod data;
mod filter;
mod score;

use std::path::Path;
use std::time::Instant;

use data::Case;
use filter::Association;
use score::{Score, mean_of};
use topometric::mission::{Graph, SolveSettings, optimum_of, solve};
use topometric::partition::Topology;
use topometric::sighting::Pose;

/// What a method says: a landmark for each sighting, and its own poses if it has some.
type Answer = (Vec<u32>, Option<Vec<Pose>>);

/// A name, and what does it.
type Method = (&'static str, fn(&Case) -> Answer);

const METHODS: [Method; 9] = [
    ("true ids*", |case| (case.truth.clone(), None)),
    ("ptm solve", |case| {
        let settings = SolveSettings {
            sweeps: 0,
            ..SolveSettings::with_seed(1)
        };
        let found = solve(&case.graph, settings, &|_| {}).unwrap();
        (found.map.labels, Some(found.map.poses))
    }),
    ("EKF, exclusive", |case| {
        (filter::labels(&case.graph, Association::Exclusive), None)
    }),
    ("EKF, joint compatibility", |case| {
        (filter::labels(&case.graph, Association::Joint), None)
    }),
    ("NP-Graph's rule", |case| {
        (clusters::by_count(&case.graph), None)
    }),
    ("k-means and graph in turn*", |case| {
        (clusters::k_means(&case.graph, case.n_landmarks()), None)
    }),
    ("DBSCAN, dead reckoning", |case| {
        (clusters::dbscan(&case.graph), None)
    }),
    ("gating, dead reckoning", |case| {
        (clusters::gating(&case.graph), None)
    }),
    ("odometry", |case| {
        let alone = (0..case.truth.len() as u32).collect();
        (alone, Some(case.graph.dead_reckoned()))
    }),
];

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|one| one != "--bench");
    let Some(folder) = arguments.next() else {
        println!("skipped: give the folder with the recordings");
        return;
    };
    let part = arguments.next().unwrap_or_default();
    let groups = data::groups(Path::new(&folder), &part);
    if groups.is_empty() {
        println!("skipped: no recording in {folder}");
        return;
    }
    println!(
        "| recording (sightings, landmarks) | method | adjusted Rand index | pair precision | pair \
         recall | landmarks − true | RMS of the path, m | χ²/dof | time, s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, cases) in groups {
        for (method, run) in METHODS {
            let scores: Vec<Score> = cases.iter().map(|case| scored(case, run)).collect();
            let n: usize = cases.iter().map(|case| case.truth.len()).sum();
            let k: usize = cases.iter().map(Case::n_landmarks).sum();
            println!("| {name} ({n}, {k}) | {method} | {} |", mean_of(&scores));
        }
    }
}

fn scored(case: &Case, run: fn(&Case) -> Answer) -> Score {
    let started = Instant::now();
    let (labels, poses) = run(case);
    let seconds = started.elapsed().as_secs_f64();
    let labels = Topology::canonical(&labels).labels().to_vec();
    let poses = poses.or_else(|| path(&case.graph, &labels));
    Score::new(case, &labels, poses.as_deref(), seconds)
}

/// Poses at the optimum of the graph with these ids.
fn path(graph: &Graph, labels: &[u32]) -> Option<Vec<Pose>> {
    optimum_of(graph, labels).ok().map(|found| found.poses)
}
