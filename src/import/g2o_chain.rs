//! The chain of poses in a g2o file: which edges are odometry, and in which order.
//!
//! The format marks neither. Two rules, in this order:
//! 1. Growing numbers of poses are the order of time, if an edge, either way round, joins each to the
//!    next. So it is in what front ends write, whatever the order of lines.
//! 2. Else the first edge in the file that arrives at a pose is odometry, and these must make one path.
//!
//! All other edges are loop closures. Odometry must state a positive definite information.

use std::collections::{BTreeMap, BTreeSet};

use super::error::ImportError;
use super::recording::{Increment, ORIGIN};

/// An `EDGE_SE2`.
#[derive(Clone, Debug)]
pub(super) struct Odometry {
    pub line: u64,
    pub from: i64,
    pub to: i64,
    /// Without covariance if the information is not positive definite.
    pub increment: Increment,
}

impl Odometry {
    /// The same edge walked the other way. Its error moves from the axes of one end to those of the
    /// other: with Z⁻¹ in place of Z, e' = −Ad(Z)·e.
    fn reversed(&self) -> Self {
        let z = self.increment.relative;
        let (sin, cos) = libm::sincos(z.heading_rad);
        let adjoint = nalgebra::Matrix3::new(cos, -sin, z.y_m, sin, cos, -z.x_m, 0.0, 0.0, 1.0);
        let covariance = self.increment.covariance;
        Self {
            line: self.line,
            from: self.to,
            to: self.from,
            increment: Increment {
                relative: z.to(ORIGIN),
                covariance: covariance.map(|c| adjoint * c * adjoint.transpose()),
            },
        }
    }
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
                got: "an information that is not positive definite".to_owned(),
                expected: "a positive definite one, as the pose is reached by this edge".to_owned(),
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
