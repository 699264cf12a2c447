//! The whole way from a graph to its best partition, with poses, landmarks and probabilities.

use rayon::join;

use super::duplicates::{Fused, fuse, fuse_by_label, unfused};
use super::error::MissionError;
use super::finish::finish;
use super::front::{self, Front};
use super::graph::Graph;
use super::optimum::{Optimum, chi_square, optimum};
use super::search::Mission;
use super::sweeps::{Sweeper, Tally};
use super::view::Reach;
use crate::partition::Topology;
use crate::rng::Purpose;
use crate::sighting::Pose;

/// Gauss–Newton steps from dead reckoning.
const MOST_STEPS: usize = 200;

/// How a mission is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolveSettings {
    /// The same seed gives the same solution, bit for bit.
    pub seed: u64,
    /// Sweeps at temperature 1 after the best partition is found, from which the probabilities
    /// come. With 0 there are none.
    pub sweeps: usize,
}

/// A landmark of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedLandmark {
    /// Where it is in the frame of the first pose, m.
    pub position_m: [f64; 2],
    /// Covariance of that given the partition: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// The probability that exactly its sightings are a landmark.
    pub probability: f64,
}

/// The most probable partition that was found, and the graph's optimum under it.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Poses of the graph, in the frame of the first.
    pub poses: Vec<Pose>,
    /// The landmark of each sighting, from 0 in the order of sightings.
    pub labels: Vec<u32>,
    /// The landmarks by label.
    pub landmarks: Vec<SolvedLandmark>,
    /// The probability of each sighting's label: the expected share of its landmark's other
    /// sightings that are of one landmark with it; of a landmark of one sighting, that it is one.
    pub probabilities: Vec<f64>,
    /// Log of the posterior of the partition, nats, up to a constant of the mission. Compare it
    /// between partitions of one mission only.
    pub ln_posterior: f64,
    /// The weighted squares of all residuals.
    pub chi_square: f64,
    /// Two for each sighting less two for each landmark.
    pub degrees_of_freedom: usize,
    /// Sightings that were fused with another of their scan, as a landmark reported twice.
    pub n_duplicates: usize,
    /// The draws: partitions of all sightings, one for each sweep.
    pub draws: Vec<Topology>,
    /// Whether the front end that defers doubt found it, and not the eager one.
    pub is_deferred: bool,
}

impl Solution {
    /// Where each sighting of the graph lies, seen from its solved pose, m.
    pub fn sighted_m(&self, graph: &Graph) -> Vec<[f64; 2]> {
        let places = graph.observations.iter().map(|one| {
            let relative = Pose {
                x_m: one.at_m[0],
                y_m: one.at_m[1],
                heading_rad: 0.0,
            };
            self.poses[one.pose].then(relative).position_m()
        });
        places.collect()
    }
}

/// Where [`solve`] has got to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// So many poses are in the first map.
    Poses(usize),
    /// The first map is being improved.
    Improving,
    /// So many sweeps are done.
    Sweeps(usize),
}

/// Solves a mission. `watch` hears how far it has come, from more than one thread.
///
/// Two front ends, an eager one and one that defers doubt, each finished by the same search; the
/// higher log posterior is kept, and sweeps from there give the probabilities.
///
/// # Errors
/// Information that is not positive definite at some poses.
pub fn solve(
    graph: &Graph,
    settings: SolveSettings,
    watch: &(dyn Fn(Stage) + Sync),
) -> Result<Solution, MissionError> {
    if graph.observations.is_empty() {
        return Err(MissionError::NothingSeen);
    }
    let purpose = |what: &str| Purpose::new("mission-1", settings.seed).text("use", what);
    let mut found = None;
    for fused in [Some(unfused(graph)), fuse(graph)].into_iter().flatten() {
        found = better(
            found,
            searched(&fused, &purpose, watch).map(|map| (map, fused)),
        );
    }
    let ((best, is_deferred), fused) = found.ok_or(MissionError::Diverged)?;
    let reach = Reach::of(&fused.graph.observations);
    let mut rng = purpose("sweeps").generator();
    let swept = swept(&fused, &best, reach, settings.sweeps, watch, &mut rng);
    let Swept {
        landmarks,
        probabilities,
        draws,
    } = swept.ok_or(MissionError::Diverged)?;
    let of_all = |s: &usize| best.labels[*s];
    let labels: Vec<u32> = fused.place_of.iter().map(of_all).collect();
    Ok(Solution {
        chi_square: chi_square(graph.part(), &best.poses, &labels),
        degrees_of_freedom: 2 * labels.len() - 2 * landmarks.len(),
        probabilities: fused.place_of.iter().map(|&s| probabilities[s]).collect(),
        ln_posterior: best.ln_posterior + fused.ln_differences,
        n_duplicates: labels.len() - best.labels.len(),
        poses: best.poses,
        labels,
        landmarks,
        draws,
        is_deferred,
    })
}

/// A map, whether the deferring front end found it, and the graph it is of.
type Found = ((Optimum, bool), Fused);

/// The one with the higher log posterior of all sightings.
fn better(one: Option<Found>, other: Option<Found>) -> Option<Found> {
    let ln = |((map, _), fused): &Found| map.ln_posterior + fused.ln_differences;
    match (one, other) {
        (Some(one), Some(other)) if ln(&other) > ln(&one) => Some(other),
        (one, other) => one.or(other),
    }
}

/// The better of the maps of both front ends, and whether it is that of the deferring one.
fn searched(
    fused: &Fused,
    purpose: &(impl Fn(&str) -> Purpose + Sync),
    watch: &(dyn Fn(Stage) + Sync),
) -> Option<(Optimum, bool)> {
    let reach = Reach::of(&fused.graph.observations);
    let start = |front: Front, name: &str| {
        let part = fused.graph.part();
        let told = |poses| watch(Stage::Poses(poses));
        let (poses, labels) = front::run(front, part, fused.graph.start, reach, &told)?;
        watch(Stage::Improving);
        finish(part, &poses, &labels, reach, &mut purpose(name).generator())
    };
    let (eager, deferred) = join(
        || start(Front::Eager, "eager"),
        || start(Front::Deferring, "deferring"),
    );
    match (eager, deferred) {
        (Some(eager), Some(deferred)) if deferred.ln_posterior <= eager.ln_posterior => {
            Some((eager, false))
        }
        (eager, None) => eager.map(|map| (map, false)),
        (_, Some(deferred)) => Some((deferred, true)),
    }
}

/// The optimum of a graph under a partition of its sightings, given as labels: as for [`solve`],
/// which finds the labels by itself. Sightings of one scan with one label count as one that was
/// reported twice.
///
/// # Errors
/// Information that is not positive definite at some poses.
pub fn optimum_of(graph: &Graph, labels: &[u32]) -> Result<Optimum, MissionError> {
    if graph.observations.is_empty() {
        return Err(MissionError::NothingSeen);
    }
    let fused = fuse_by_label(graph, labels);
    let mut fused_labels = vec![0; fused.graph.observations.len()];
    for (&place, &label) in fused.place_of.iter().zip(labels) {
        fused_labels[place] = label;
    }
    let poses = graph.dead_reckoned();
    let reach = Reach::of(&fused.graph.observations);
    let part = fused.graph.part();
    let mut found =
        optimum(part, &poses, &fused_labels, reach, MOST_STEPS).ok_or(MissionError::Diverged)?;
    found.ln_posterior += fused.ln_differences;
    found.labels = fused.place_of.iter().map(|&s| found.labels[s]).collect();
    Ok(found)
}

/// What sweeps say.
struct Swept {
    landmarks: Vec<SolvedLandmark>,
    /// Of the sightings that are left when duplicates are fused.
    probabilities: Vec<f64>,
    draws: Vec<Topology>,
}

fn swept(
    fused: &Fused,
    best: &Optimum,
    reach: Reach,
    sweeps: usize,
    watch: &(dyn Fn(Stage) + Sync),
    rng: &mut impl rand::Rng,
) -> Option<Swept> {
    let mission = Mission::new(fused.graph.part(), &best.poses, reach);
    let mut state = mission.state(best.poses.clone(), &best.labels)?;
    let n = best.landmarks_m.len();
    let covariance = |a: usize| {
        let [xx, xy, _, yy] = state.now.joint.block(a, a);
        [xx, xy, yy]
    };
    let covariances: Vec<[f64; 3]> = (0..n).map(covariance).collect();
    let sweeper = Sweeper::new(&state, mission.part);
    let mut draws = Vec::with_capacity(sweeps);
    let mut tally = Tally::new(&best.labels, n);
    if sweeps == 0 {
        tally.count(&state);
    }
    for sweep in 0..sweeps {
        sweeper.sweep(&mut state, rng)?;
        tally.count(&state);
        let labels = fused.place_of.iter().map(|&s| state.now.labels[s]);
        draws.push(Topology::canonical(&labels.collect::<Vec<_>>()));
        watch(Stage::Sweeps(sweep + 1));
    }
    let probabilities = tally.of_landmarks();
    let landmarks = (0..n).map(|a| SolvedLandmark {
        position_m: best.landmarks_m[a],
        covariance_m2: covariances[a],
        probability: probabilities[a],
    });
    Some(Swept {
        landmarks: landmarks.collect(),
        probabilities: tally.of_sightings(),
        draws,
    })
}
