//! Poses and landmarks at the optimum of the graph under a partition, and the log posterior there.
//!
//! Gauss–Newton with the poses eliminated first. Landmarks follow from the poses, so a step is
//! judged, and halved if it must be, by χ² with every landmark at its best place. A landmark of one
//! sighting says nothing of the poses and stays out. At the optimum the integral over poses and
//! landmarks is −χ²/2 − ½ ln det H_p − ½ ln det H_m + M ln 2π up to what all partitions share; it
//! is exact if the graph is linear.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2, Vector3};

use super::graph::{Observation, Part};
use super::linear::{Linear, residual, scans};
use super::state::compact;
use super::view::{Reach, Seen, View};
use crate::sighting::{Pose, wrap_rad};

/// A step that moves no pose by more than this is the last, m and rad.
const LEAST_STEP: f64 = 1e-8;
/// χ² is known to this share, by rounding.
const ROUNDING: f64 = 1e-12;
/// A step is halved at most so often.
const MOST_HALVINGS: usize = 6;

/// The optimum of a graph under a partition.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// In the frame of the first pose.
    pub poses: Vec<Pose>,
    /// The landmark of each sighting, from 0 in the order of sightings.
    pub labels: Vec<u32>,
    /// Places by label, m.
    pub landmarks_m: Vec<[f64; 2]>,
    /// The weighted squares of all residuals.
    pub chi_square: f64,
    /// Log of the posterior of the partition, up to a constant of the mission; nats.
    pub ln_posterior: f64,
    /// The part of it that is the prior's.
    pub ln_prior: f64,
}

impl Optimum {
    /// Numbers that a partition leaves free: two per sighting less two per landmark.
    pub fn degrees_of_freedom(&self) -> usize {
        2 * self.labels.len() - 2 * self.landmarks_m.len()
    }
}

/// Improves `poses` under a partition by at most so many steps. Gives χ² and what the determinants
/// add to the log posterior; `None` if an information is not positive definite.
pub(super) fn optimise(
    part: Part<'_>,
    poses: &mut Vec<Pose>,
    labels: &[u32],
    most_steps: usize,
) -> Option<(f64, f64)> {
    let shared = Shared::of(part.observations, labels);
    let active = Part {
        odometry: part.odometry,
        observations: &shared.observations,
    };
    let mut chi_square = shared.chi_square(active, poses);
    for step in 0..=most_steps {
        let places = shared.places(poses);
        let points: Vec<[f64; 2]> = shared.labels.iter().map(|&m| places[m as usize]).collect();
        let linear = Linear::new(active, poses, Some(&points))?;
        let (joint, _, ln_det) = linear.joint(&shared.labels, shared.n_landmarks)?;
        let all = linear.half_ln_det_poses() + 0.5 * ln_det + shared.half_ln_det_single;
        if step == most_steps {
            return Some((chi_square, -all));
        }
        let shift = linear.pose_shift(|s| joint.mean_m[shared.labels[s] as usize]);
        let mut taken = None;
        let mut share = 1.0;
        for _ in 0..MOST_HALVINGS {
            let tried = moved(poses, &shift, share);
            let there = shared.chi_square(active, &tried);
            if there <= chi_square * (1.0 + ROUNDING) {
                taken = Some((tried, there));
                break;
            }
            share *= 0.5;
        }
        let is_last = match taken {
            None => true,
            Some((tried, there)) => {
                *poses = tried;
                chi_square = there;
                shift.iter().all(|step| step.amax() < LEAST_STEP)
            }
        };
        if is_last {
            return Some((chi_square, -all));
        }
    }
    None
}

/// The optimum with its log posterior. `None` if an information is not positive definite.
pub(super) fn optimum(
    part: Part<'_>,
    poses: &[Pose],
    labels: &[u32],
    reach: Reach,
    most_steps: usize,
) -> Option<Optimum> {
    let (labels, n) = compact(labels);
    let mut poses = poses.to_vec();
    let (chi_square, ln_determinants) = optimise(part, &mut poses, &labels, most_steps)?;
    let scans = scans(part.observations);
    let ln_area_m2 = reach.ln_explored_m2(scans.iter().map(|scan| poses[scan.pose]));
    let landmarks_m = places(part.observations, &poses, &labels, n);
    let mut view = View::new(reach, &scans, &poses, ln_area_m2);
    let at = landmarks_m.iter();
    let mut seen: Vec<Seen> = at
        .map(|&at_m| Seen {
            at_m,
            scans: Vec::new(),
        })
        .collect();
    for (number, scan) in scans.iter().enumerate() {
        for &label in &labels[scan.first..scan.end] {
            seen[label as usize].scans.push(number as u32);
        }
    }
    let cost = view.whole_cost(&seen);
    let m = n as f64;
    let ln_prior = libm::lgamma(m + 1.0) - m * ln_area_m2 - cost;
    Some(Optimum {
        landmarks_m,
        ln_posterior: -0.5 * chi_square + ln_determinants + m * libm::log(TAU) + ln_prior,
        ln_prior,
        chi_square,
        poses,
        labels,
    })
}

/// Poses moved by a share of a step (m, m, rad).
pub(super) fn moved(poses: &[Pose], shift: &[Vector3<f64>], share: f64) -> Vec<Pose> {
    let pairs = poses.iter().zip(shift);
    let moved = pairs.map(|(pose, shift)| Pose {
        x_m: pose.x_m + share * shift.x,
        y_m: pose.y_m + share * shift.y,
        heading_rad: wrap_rad(pose.heading_rad + share * shift.z),
    });
    moved.collect()
}

/// χ² of a mission at these poses, every landmark at its best place.
pub(super) fn chi_square(part: Part<'_>, poses: &[Pose], labels: &[u32]) -> f64 {
    let shared = Shared::of(part.observations, labels);
    shared.chi_square(part, poses)
}

/// The sightings of landmarks that were seen more than once.
struct Shared {
    observations: Vec<Observation>,
    labels: Vec<u32>,
    n_landmarks: usize,
    /// ½ ln det of the information of all other sightings.
    half_ln_det_single: f64,
}

impl Shared {
    fn of(observations: &[Observation], labels: &[u32]) -> Self {
        let n = labels.iter().max().map_or(0, |&most| most as usize + 1);
        let mut counts = vec![0_u32; n];
        for &label in labels {
            counts[label as usize] += 1;
        }
        let mut kept = Vec::new();
        let mut kept_labels = Vec::new();
        let mut half_ln_det_single = 0.0;
        for (one, &label) in observations.iter().zip(labels) {
            if counts[label as usize] > 1 {
                kept.push(*one);
                kept_labels.push(label);
            } else {
                let [xx, xy, yy] = one.information;
                half_ln_det_single += 0.5 * libm::log(xx * yy - xy * xy);
            }
        }
        let (labels, n_landmarks) = compact(&kept_labels);
        Self {
            observations: kept,
            labels,
            n_landmarks,
            half_ln_det_single,
        }
    }

    fn places(&self, poses: &[Pose]) -> Vec<[f64; 2]> {
        places(&self.observations, poses, &self.labels, self.n_landmarks)
    }

    fn chi_square(&self, part: Part<'_>, poses: &[Pose]) -> f64 {
        let mut sum = 0.0;
        for (k, edge) in part.odometry.iter().enumerate() {
            let (error, _) = residual(edge, poses[k], poses[k + 1]);
            sum += error.dot(&(edge.information * error));
        }
        let places = self.places(poses);
        for (one, &label) in self.observations.iter().zip(&self.labels) {
            let (place, weight) = one.in_frame(poses[one.pose]);
            let error = place - Vector2::from(places[label as usize]);
            sum += error.dot(&(weight * error));
        }
        sum
    }
}

/// The best place of each landmark at these poses, m.
pub(super) fn places(
    observations: &[Observation],
    poses: &[Pose],
    labels: &[u32],
    n: usize,
) -> Vec<[f64; 2]> {
    let mut sums = vec![(Matrix2::zeros(), Vector2::zeros()); n];
    // About the first sighting of each, so that far from the origin no digits are lost.
    let mut centres = vec![None; n];
    for (one, &label) in observations.iter().zip(labels) {
        let (place, weight) = one.in_frame(poses[one.pose]);
        let centre = *centres[label as usize].get_or_insert(place);
        let (information, vector) = &mut sums[label as usize];
        *information += weight;
        *vector += weight * (place - centre);
    }
    let places = sums.iter().zip(centres);
    let places = places.map(|((information, vector), centre)| {
        let centre = centre.unwrap_or_default();
        let inverse = information.try_inverse().unwrap_or_else(Matrix2::zeros);
        (centre + inverse * vector).into()
    });
    places.collect()
}
