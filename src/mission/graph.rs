//! The mission as a graph: a chain of poses with odometry between them, and sightings of landmarks.
//!
//! Odometry from pose k to k+1 is a pose z in the axes of k, with the error in the axes of k+1, as
//! `EDGE_SE2` has it (Kümmerle et al., ICRA 2011): e = z⁻¹ ⊕ (p_k⁻¹ ⊕ p_{k+1}). A sighting is a
//! point in the axes of its pose: e = R(θ)ᵀ(l − t) − z. Both come with the information of their
//! error.
//!
//! Identities that a recording knows are carried along as truth and decide nothing.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::error::MissionError;
use crate::import::{Increment, Noise, Recording, Seen};
use crate::sighting::Pose;

/// Odometry is never known better than this per step: standard deviations of x and y (m) and of the
/// heading (rad). A robot that stands still would otherwise be known without error.
const LEAST_STD: [f64; 2] = [1e-4, 1e-5];

/// Odometry between a pose and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// The next pose in the axes of the pose (m, rad).
    pub relative: Pose,
    /// Information of its error in the axes of the next pose (x, y, heading; 1/m², 1/(m·rad),
    /// 1/rad²).
    pub information: Matrix3<f64>,
}

/// A landmark seen from a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The number of the pose, from 0.
    pub pose: usize,
    /// Where it was seen in the axes of the pose, m.
    pub at_m: [f64; 2],
    /// Information of that place in the same axes: xx, xy, yy, 1/m².
    pub information: [f64; 3],
    /// The landmark truly seen, where the recording knows it. Nothing here depends on it.
    pub landmark: Option<i64>,
}

impl Observation {
    /// The information as a matrix.
    pub(super) fn weight(&self) -> Matrix2<f64> {
        let [xx, xy, yy] = self.information;
        Matrix2::new(xx, xy, xy, yy)
    }

    /// Where it lies if it is seen from a pose (m), and the information of that (1/m²).
    pub(super) fn in_frame(&self, pose: Pose) -> (Vector2<f64>, Matrix2<f64>) {
        let (sin, cos) = libm::sincos(pose.heading_rad);
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let place = turn * Vector2::from(self.at_m) + Vector2::new(pose.x_m, pose.y_m);
        (place, turn * self.weight() * turn.transpose())
    }
}

/// A whole mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    /// The first pose, which defines the frame.
    pub start: Pose,
    /// When the robot was at each pose, s.
    pub times_s: Vec<f64>,
    /// From each pose to the next: one fewer than poses.
    pub odometry: Vec<Odometry>,
    /// In the order of poses.
    pub observations: Vec<Observation>,
}

impl Graph {
    /// The graph of a recording. Where the recording states no errors, `noise` does. Stops of a
    /// stream of odometry alone (no stated error, nothing seen) are joined to the next stop at
    /// which something was seen, so that there is a pose for each scan.
    ///
    /// # Errors
    /// A recording without a sighting, or with errors that are not positive definite.
    pub fn of_recording(recording: &Recording, noise: &Noise) -> Result<Self, MissionError> {
        let mut graph = Self {
            start: recording.start,
            times_s: Vec::new(),
            odometry: Vec::new(),
            observations: Vec::new(),
        };
        let mut way = Way::NONE;
        for (ix, stop) in recording.stops.iter().enumerate() {
            if ix > 0 {
                way = way.then(&stop.increment, noise);
            }
            let is_stated = stop.increment.covariance.is_some();
            let is_last = ix + 1 == recording.stops.len();
            if ix > 0 && !is_stated && stop.seen.is_empty() && !is_last {
                continue;
            }
            if ix > 0 {
                graph.odometry.push(way.odometry(ix)?);
                way = Way::NONE;
            }
            let pose = graph.times_s.len();
            graph.times_s.push(stop.time_s);
            for seen in &stop.seen {
                graph.observations.push(observation(pose, seen, noise)?);
            }
        }
        if graph.observations.is_empty() {
            return Err(MissionError::NothingSeen);
        }
        Ok(graph)
    }

    /// The first poses, up to the one with which there are so many sightings; all if there are
    /// not.
    pub(super) fn first_sightings(&self, n: usize) -> Self {
        let last = self.observations.get(n.saturating_sub(1));
        let n_poses = last.map_or(self.times_s.len(), |one| one.pose + 1);
        let part = self.part().first(n_poses);
        Self {
            start: self.start,
            times_s: self.times_s[..n_poses].to_vec(),
            odometry: part.odometry.to_vec(),
            observations: part.observations.to_vec(),
        }
    }

    /// All of it, to be looked at.
    pub(super) fn part(&self) -> Part<'_> {
        Part {
            odometry: &self.odometry,
            observations: &self.observations,
        }
    }

    /// Poses by odometry alone.
    pub fn dead_reckoned(&self) -> Vec<Pose> {
        let mut poses = vec![self.start];
        extend_by_odometry(&mut poses, &self.odometry);
        poses
    }
}

/// Appends poses by odometry until there is one more pose than odometry.
pub(super) fn extend_by_odometry(poses: &mut Vec<Pose>, odometry: &[Odometry]) {
    while poses.len() <= odometry.len() {
        let last = poses[poses.len() - 1];
        poses.push(last.then(odometry[poses.len() - 1].relative));
    }
}

/// The beginning of a mission, or all of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    /// As in [`Graph`].
    pub odometry: &'a [Odometry],
    /// As in [`Graph`].
    pub observations: &'a [Observation],
}

impl Part<'_> {
    /// The number of poses.
    pub fn n_poses(&self) -> usize {
        self.odometry.len() + 1
    }

    /// The first so many poses, and what was seen from them.
    pub fn first(&self, n_poses: usize) -> Self {
        let n = self.observations.partition_point(|one| one.pose < n_poses);
        Self {
            odometry: &self.odometry[..n_poses - 1],
            observations: &self.observations[..n],
        }
    }
}

/// Increments joined to one.
struct Way {
    relative: Pose,
    /// In the axes of the end.
    covariance: Matrix3<f64>,
}

impl Way {
    const NONE: Self = Self {
        relative: Increment::NONE.relative,
        covariance: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    fn then(&self, increment: &Increment, noise: &Noise) -> Self {
        let carried = adjoint(increment.relative.to(Increment::NONE.relative));
        Self {
            relative: self.relative.then(increment.relative),
            covariance: carried * self.covariance * carried.transpose()
                + noise.increment_covariance(increment),
        }
    }

    fn odometry(&self, stop: usize) -> Result<Odometry, MissionError> {
        let [place, heading] = LEAST_STD.map(|std| std * std);
        let mut covariance = self.covariance;
        for (axis, least) in [place, place, heading].into_iter().enumerate() {
            if covariance[(axis, axis)] < least {
                covariance[(axis, axis)] += least;
            }
        }
        let root = covariance.cholesky();
        let root = root.ok_or(MissionError::Odometry { stop })?;
        Ok(Odometry {
            relative: self.relative,
            information: root.inverse(),
        })
    }
}

/// Moves an error from the axes of a pose to those that the pose is given in.
fn adjoint(pose: Pose) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(pose.heading_rad);
    Matrix3::new(cos, -sin, pose.y_m, sin, cos, -pose.x_m, 0.0, 0.0, 1.0)
}

fn observation(pose: usize, seen: &Seen, noise: &Noise) -> Result<Observation, MissionError> {
    let [range_std, bearing_std, correlation] = noise.of_sighting(seen);
    let (sin, cos) = libm::sincos(seen.bearing_rad);
    let across = seen.range_m * bearing_std;
    let polar = Matrix2::new(
        range_std * range_std,
        range_std * across * correlation,
        range_std * across * correlation,
        across * across,
    );
    let turn = Matrix2::new(cos, -sin, sin, cos);
    let information = (turn * polar * turn.transpose()).try_inverse();
    let information = information.filter(|i| i.iter().all(|value| value.is_finite()));
    let information = information.ok_or(MissionError::Sighting { pose })?;
    Ok(Observation {
        pose,
        at_m: [seen.range_m * cos, seen.range_m * sin],
        information: [information.m11, information.m12, information.m22],
        landmark: seen.landmark,
    })
}
