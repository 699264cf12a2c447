//! What solving a mission takes, gives and tells.

use super::fit::Fit;
use super::graph::Graph;
use super::noise::NoiseFactors;
use crate::partition::Topology;
use crate::sighting::Pose;

/// How a mission is solved. [`SolveSettings::with_seed`] has what is usual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolveSettings {
    /// The same seed gives the same solution, bit for bit.
    pub seed: u64,
    /// Sweeps at temperature 1 after the best partition is found, from which the probabilities
    /// come. With 0 there are none.
    pub sweeps: usize,
    /// Whether the noise is calibrated by evidence, and not taken as it is stated.
    pub is_calibrated: bool,
    /// How often the search improves each first map, every time with other random numbers. At
    /// least 1.
    pub starts: usize,
}

impl SolveSettings {
    /// Calibrated noise, 20 sweeps, one start.
    pub fn with_seed(seed: u64) -> Self {
        Self {
            seed,
            sweeps: 20,
            is_calibrated: true,
            starts: 1,
        }
    }
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

/// A map: a partition of the sightings, with poses and landmarks at the optimum of the graph.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedMap {
    /// Poses of the graph, in the frame of the first.
    pub poses: Vec<Pose>,
    /// The landmark of each sighting, from 0 in the order of sightings.
    pub labels: Vec<u32>,
    /// Where the landmarks are, by label, m.
    pub landmarks_m: Vec<[f64; 2]>,
    /// Log of the posterior of the partition, nats, up to a constant of the mission and its noise.
    /// Compare it between partitions of one mission only.
    pub ln_posterior: f64,
    /// Its share of the posterior of all maps that were found.
    pub weight: f64,
}

/// The most probable map that was found, what is known of its parts, and other maps.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The map.
    pub map: SolvedMap,
    /// What multiplies the stated noise. All else is of the graph with that noise
    /// ([`Graph::with_noise`]).
    pub noise: NoiseFactors,
    /// The landmarks by label.
    pub landmarks: Vec<SolvedLandmark>,
    /// The probability of each sighting's label: the expected share of its landmark's other
    /// sightings that are of one landmark with it; of a landmark of one sighting, that it is one.
    pub probabilities: Vec<f64>,
    /// How well the map fits the noise.
    pub fit: Fit,
    /// Sightings that were fused with another of their scan, as a landmark reported twice.
    pub n_duplicates: usize,
    /// The draws: partitions of all sightings, one for each sweep.
    pub draws: Vec<Topology>,
    /// Whether the front end that defers doubt found it, and not the eager one.
    pub is_deferred: bool,
    /// Other partitions that were found, with a thousandth of the weight of the map or more; the
    /// most probable first.
    pub alternatives: Vec<SolvedMap>,
}

impl SolvedMap {
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

/// Where [`solve`](super::solve) has got to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The noise is being calibrated.
    Calibrating,
    /// So many poses are in the first map.
    Poses(usize),
    /// The first map is being improved.
    Improving,
    /// So many sweeps are done.
    Sweeps(usize),
}
