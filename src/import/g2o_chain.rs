//! The chain of poses in a g2o file: which edges are odometry, and in which order.
//!
//! The format marks neither. Two rules, in this order:
//! 1. Growing numbers of poses are the order of time, if an edge, either way round, joins each to the
//!    next. So it is in what front ends write, whatever the order of lines.
//! 2. Else the first edge in the file that arrives at a pose is odometry, and these must make one path.
//!
//! All other edges are loop closures. Odometry must state a positive definite information.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;

use super::error::ImportError;
use super::g2o_measure::numbers;
use super::recording::{Increment, ORIGIN};
use crate::sighting::Pose;

/// An edge between two poses, such as `EDGE_SE2`.
#[derive(Clone, Debug)]
pub(super) struct Odometry {
    pub line: u64,
    pub from: i64,
    pub to: i64,
    /// xx xy xθ yy yθ θθ as stated.
    pub information: [f64; 6],
    /// Without covariance if the information is not positive definite.
    pub increment: Increment,
}

impl Odometry {
    /// An edge between two poses, the second seen from the first.
    pub fn new(line: u64, [from, to]: [i64; 2], relative: Pose, information: [f64; 6]) -> Self {
        let [xx, xy, xt, yy, yt, tt] = information;
        Self {
            line,
            from,
            to,
            information,
            increment: Increment {
                relative,
                covariance: Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
                    .cholesky()
                    .map(|root| root.inverse())
                    .filter(|c| c.iter().all(|value| value.is_finite())),
            },
        }
    }

    /// The edge between the robots, if it was one between sensors that sit at these offsets. The
    /// error moves from the axes of the second sensor to those of its robot: e' = Ad(offset)·e.
    pub fn between_sensors(self, first: Pose, second: Pose) -> Self {
        let relative = first.then(self.increment.relative).then(second.to(ORIGIN));
        let adjoint = adjoint(second);
        let covariance = self.increment.covariance;
        Self {
            increment: Increment {
                relative,
                covariance: covariance.map(|c| adjoint * c * adjoint.transpose()),
            },
            ..self
        }
    }

    /// The same edge walked the other way. Its error moves from the axes of one end to those of the
    /// other: with Z⁻¹ in place of Z, e' = −Ad(Z)·e.
    fn reversed(&self) -> Self {
        let z = self.increment.relative;
        let adjoint = adjoint(z);
        let covariance = self.increment.covariance;
        Self {
            line: self.line,
            from: self.to,
            to: self.from,
            information: self.information,
            increment: Increment {
                relative: z.to(ORIGIN),
                covariance: covariance.map(|c| adjoint * c * adjoint.transpose()),
            },
        }
    }
}

/// Moves an error from the axes of a pose to those that the pose is given in.
fn adjoint(pose: Pose) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(pose.heading_rad);
    Matrix3::new(cos, -sin, pose.y_m, sin, cos, -pose.x_m, 0.0, 0.0, 1.0)
}

/// Poses in order of time, and how each was reached; the first by [`Increment::NONE`].
pub(super) fn chain(
    poses: &BTreeSet<i64>,
    edges: &[Odometry],
    path: &str,
) -> Result<(Vec<i64>, Vec<Increment>), ImportError> {
    let walked = match by_number(poses, edges) {
        Ok(walked) => walked,
        Err((a, b)) => by_arrival(poses, edges).ok_or_else(|| ImportError::Disagrees {
            place: path.to_owned(),
            got: format!("no EDGE_SE2 between the poses {a} and {b}"),
            expected: "odometry that joins all poses to one path".to_owned(),
            change: "add the edge, or cut the file there",
        })?,
    };
    let first = walked.first().map(|edge| edge.from);
    let first = first.or_else(|| poses.first().copied());
    let order = first.into_iter().chain(walked.iter().map(|edge| edge.to));
    let mut increments = vec![Increment::NONE];
    for edge in &walked {
        if edge.increment.covariance.is_none() {
            return Err(ImportError::Disagrees {
                place: format!("{path}, line {}", edge.line),
                got: format!("the information {}", numbers(&edge.information)),
                expected: "a positive definite one (xx xy xθ yy yθ θθ), as the pose is reached by \
                           this edge"
                    .to_owned(),
                change: "correct the line",
            });
        }
        increments.push(edge.increment);
    }
    Ok((order.collect(), increments))
}

/// Rule 1, or the first pair of poses that nothing joins.
fn by_number(poses: &BTreeSet<i64>, edges: &[Odometry]) -> Result<Vec<Odometry>, (i64, i64)> {
    let mut first: BTreeMap<(i64, i64), &Odometry> = BTreeMap::new();
    for edge in edges {
        first.entry((edge.from, edge.to)).or_insert(edge);
    }
    let pairs = poses.iter().zip(poses.iter().skip(1));
    let joined = pairs.map(|(&a, &b)| match (first.get(&(a, b)), first.get(&(b, a))) {
        (Some(edge), _) => Ok((*edge).clone()),
        (None, Some(edge)) => Ok(edge.reversed()),
        (None, None) => Err((a, b)),
    });
    joined.collect()
}

/// Rule 2.
fn by_arrival(poses: &BTreeSet<i64>, edges: &[Odometry]) -> Option<Vec<Odometry>> {
    let mut arrivals: BTreeMap<i64, &Odometry> = BTreeMap::new();
    for edge in edges {
        arrivals.entry(edge.to).or_insert(edge);
    }
    // If a loop closure arrives at the start too, the start is where the file's first edge leaves.
    let unreached = poses.iter().find(|pose| !arrivals.contains_key(pose));
    let start = *unreached.unwrap_or(&edges.first()?.from);
    arrivals.remove(&start);
    let onward: BTreeMap<i64, &Odometry> =
        arrivals.values().map(|edge| (edge.from, *edge)).collect();
    let mut walked: Vec<Odometry> = Vec::new();
    while walked.len() + 1 < poses.len() {
        let here = walked.last().map_or(start, |edge| edge.to);
        walked.push((*onward.get(&here)?).clone());
    }
    // A path through a cycle would be as long and miss a pose.
    let ends: BTreeSet<i64> = walked.iter().map(|edge| edge.to).chain([start]).collect();
    (ends.len() == poses.len()).then_some(walked)
}
