//! g2o files in the plane with landmarks (Kümmerle et al., ICRA 2011; format on the g2o wiki).
//!
//! `VERTEX_SE2 id x y θ`, `VERTEX_XY id x y`, `EDGE_SE2 i j x y θ I₁₁ I₁₂ I₁₃ I₂₂ I₂₃ I₃₃` (pose j seen from
//! pose i, with the upper triangle of the information), `EDGE_SE2_XY i l x y I₁₁ I₁₂ I₂₂` (landmark l
//! seen from pose i, in its axes), in any order of lines. An edge's error lies in the axes of its
//! measurement: of pose j for `EDGE_SE2`, of pose i for `EDGE_SE2_XY`.
//!
//! The stream is the chain of poses (see `g2o_chain`), one stop each; a stop's time is its place in the
//! chain, in "seconds". Identity is the landmark's vertex. Positions of vertices are somebody's estimate,
//! often the start of an optimiser, and taken neither for odometry nor for truth. `FIX` and `PARAMS…`
//! mean nothing here; sightings of bearing alone and tags not named above are left out and counted.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use nalgebra::{Matrix2, Matrix3};

use super::error::ImportError;
use super::g2o_chain::{Odometry, chain};
use super::lines::{Line, lines, read_bytes};
use super::recording::{Increment, ORIGIN, Recording, Seen, Stop, notes};
use crate::sighting::Pose;

/// Nearer than this a landmark has no direction, m.
const MIN_RANGE_M: f64 = 1e-3;

/// Reads a file.
///
/// # Errors
/// A file that cannot be read, a line of a known tag that will not do, poses that make no chain, or
/// no sightings of position.
pub fn read_g2o(path: &Path) -> Result<Recording, ImportError> {
    let bytes = read_bytes(path)?;
    parse(
        &String::from_utf8_lossy(&bytes),
        &path.display().to_string(),
    )
}

#[derive(Default)]
struct Graph {
    /// Poses that a `VERTEX_SE2` names.
    poses: BTreeSet<i64>,
    landmarks: BTreeSet<i64>,
    edges: Vec<Odometry>,
    /// Line, pose and what was seen from it.
    seen: Vec<(u64, i64, Seen)>,
    n_near: usize,
    /// Lines left out, by tag.
    skipped: BTreeMap<String, usize>,
}

pub(super) fn parse(text: &str, path: &str) -> Result<Recording, ImportError> {
    let mut graph = Graph::default();
    for line in lines(text, path) {
        graph.read(&line)?;
    }
    graph.check_names(path)?;
    let skipped = graph.skipped.iter();
    let skipped: Vec<_> = skipped
        .map(|(tag, n)| (*n, format!("{tag} left out")))
        .collect();
    if graph.seen.is_empty() {
        let words: Vec<String> = skipped
            .iter()
            .map(|(n, what)| format!(", {n} {what}"))
            .collect();
        return Err(ImportError::Empty {
            path: path.to_owned(),
            instead: format!(" by EDGE_SE2_XY{}", words.concat()),
        });
    }
    let poses = graph.poses.iter().copied();
    let from = graph.edges.iter().flat_map(|edge| [edge.from, edge.to]);
    let poses: BTreeSet<i64> = poses.chain(from).collect();
    let (order, increments) = chain(&poses, &graph.edges, path)?;
    let n_loops = graph.edges.len() + 1 - order.len();
    let mut by_pose: BTreeMap<i64, Vec<Seen>> = BTreeMap::new();
    for (_, pose, seen) in graph.seen {
        by_pose.entry(pose).or_default().push(seen);
    }
    let stops = order.iter().zip(increments).enumerate();
    let stops = stops.map(|(ix, (pose, increment))| Stop {
        time_s: ix as f64,
        increment,
        seen: by_pose.remove(pose).unwrap_or_default(),
    });
    let more = [
        (
            n_loops,
            "EDGE_SE2 off the chain (loop closures) left out".to_owned(),
        ),
        (
            graph.n_near,
            "landmarks seen under the robot left out".to_owned(),
        ),
    ];
    Ok(Recording {
        start: ORIGIN,
        stops: stops.collect(),
        truth: None,
        notes: notes(skipped.into_iter().chain(more)),
    })
}

impl Graph {
    fn read(&mut self, line: &Line<'_>) -> Result<(), ImportError> {
        match line.fields[0] {
            "VERTEX_SE2" => {
                line.expect_fields(&[5], "5: VERTEX_SE2, id, x, y, heading")?;
                numbers::<3>(line, 2)?;
                let is_new = self.poses.insert(line.whole(1, "id")?);
                is_new
                    .then_some(())
                    .ok_or_else(|| line.bad(1, "id", "each vertex once"))
            }
            "VERTEX_XY" => {
                line.expect_fields(&[4], "4: VERTEX_XY, id, x, y")?;
                numbers::<2>(line, 2)?;
                let is_new = self.landmarks.insert(line.whole(1, "id")?);
                is_new
                    .then_some(())
                    .ok_or_else(|| line.bad(1, "id", "each vertex once"))
            }
            "EDGE_SE2" => self.read_odometry(line),
            "EDGE_SE2_XY" => self.read_sighting(line),
            "FIX" => (1..line.fields.len()).try_for_each(|k| line.whole(k, "id").map(|_| ())),
            tag if tag.starts_with("PARAMS") => Ok(()),
            tag if tag.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                *self
                    .skipped
                    .entry(tag.chars().take(40).collect())
                    .or_default() += 1;
                Ok(())
            }
            _ => Err(line.bad(0, "tag", "a tag, such as EDGE_SE2_XY")),
        }
    }

    fn read_odometry(&mut self, line: &Line<'_>) -> Result<(), ImportError> {
        line.expect_fields(
            &[12],
            "12: EDGE_SE2, from, to, x, y, heading, and 6 of the information",
        )?;
        let (from, to) = (line.whole(1, "from")?, line.whole(2, "to")?);
        if from == to {
            return Err(line.bad(2, "to", "another pose than the edge starts from"));
        }
        let [x_m, y_m, heading_rad] = numbers(line, 3)?;
        let [xx, xy, xt, yy, yt, tt] = numbers(line, 6)?;
        self.edges.push(Odometry {
            line: line.number,
            from,
            to,
            increment: Increment {
                relative: Pose {
                    x_m,
                    y_m,
                    heading_rad,
                },
                covariance: Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
                    .cholesky()
                    .map(|root| root.inverse())
                    .filter(|c| c.iter().all(|value| value.is_finite())),
            },
        });
        Ok(())
    }

    fn read_sighting(&mut self, line: &Line<'_>) -> Result<(), ImportError> {
        line.expect_fields(
            &[8],
            "8: EDGE_SE2_XY, pose, landmark, x, y, and 3 of the information",
        )?;
        let (pose, landmark) = (line.whole(1, "pose")?, line.whole(2, "landmark")?);
        let [x_m, y_m] = numbers(line, 3)?;
        let [xx, xy, yy] = numbers(line, 5)?;
        let not_positive = || line.bad(5, "information", "a positive definite information");
        let covariance = Matrix2::new(xx, xy, xy, yy)
            .cholesky()
            .map(|root| root.inverse())
            .filter(|c| c.iter().all(|value| value.is_finite()))
            .ok_or_else(not_positive)?;
        let range_m = libm::hypot(x_m, y_m);
        if range_m < MIN_RANGE_M {
            self.n_near += 1;
            return Ok(());
        }
        let (cos, sin) = (x_m / range_m, y_m / range_m);
        let polar = Matrix2::new(cos, sin, -sin / range_m, cos / range_m);
        let polar = polar * covariance * polar.transpose();
        let (range_std_m, bearing_std_rad) = (polar[(0, 0)].sqrt(), polar[(1, 1)].sqrt());
        let correlation = polar[(0, 1)] / (range_std_m * bearing_std_rad);
        if !(correlation.abs() < 1.0 && bearing_std_rad.is_finite()) {
            return Err(not_positive());
        }
        let seen = Seen {
            range_m,
            bearing_rad: libm::atan2(y_m, x_m),
            stated: Some([range_std_m, bearing_std_rad, correlation]),
            landmark: Some(landmark),
        };
        self.seen.push((line.number, pose, seen));
        Ok(())
    }

    /// Every sighting needs a pose that is one, and no vertex may be both pose and landmark.
    fn check_names(&self, path: &str) -> Result<(), ImportError> {
        let edges = self.edges.iter().flat_map(|edge| [edge.from, edge.to]);
        let poses: BTreeSet<i64> = self.poses.iter().copied().chain(edges).collect();
        let disagrees = |line: u64, got: String, expected: &str| ImportError::Disagrees {
            place: format!("{path}, line {line}"),
            got,
            expected: expected.to_owned(),
            change: "correct the numbers of the vertices",
        };
        for (line, pose, seen) in &self.seen {
            if !poses.contains(pose) {
                let got = format!("a sighting from vertex {pose}");
                return Err(disagrees(
                    *line,
                    got,
                    "a pose that a VERTEX_SE2 or EDGE_SE2 names",
                ));
            }
            let landmark = seen.landmark.unwrap_or_default();
            if poses.contains(&landmark) {
                let got = format!("a sighting of vertex {landmark}, which is a pose");
                return Err(disagrees(*line, got, "a landmark"));
            }
        }
        for edge in &self.edges {
            let ends = [edge.from, edge.to];
            if let Some(end) = ends.iter().find(|end| self.landmarks.contains(end)) {
                let got = format!("odometry of vertex {end}, which is a VERTEX_XY");
                return Err(disagrees(edge.line, got, "two poses"));
            }
        }
        Ok(())
    }
}

/// N finite numbers from a place on.
fn numbers<const N: usize>(line: &Line<'_>, first: usize) -> Result<[f64; N], ImportError> {
    let mut values = [0.0; N];
    for (k, value) in values.iter_mut().enumerate() {
        *value = line.number(first + k, "values")?;
    }
    Ok(values)
}
