//! Pose graphs in the plane with landmarks: g2o files (Kümmerle et al., ICRA 2011; format on the
//! g2o wiki), those of its tutorial, and text files of iSAM, gtsam and TORO. `g2o_tags` lists the
//! lines.
//!
//! An edge's error lies in the axes of its measurement: of pose j for odometry from i to j, of pose
//! i for a landmark, and of the sensor where that has an offset. Lines may come in any order.
//!
//! The stream is the chain of poses (see `g2o_chain`), one stop each; a stop's time is its place in
//! the chain, in "seconds". Identity is the landmark's number, which iSAM's files count by itself
//! and g2o among the vertices. Positions of vertices are somebody's estimate, often the start of an
//! optimiser, and taken neither for odometry nor for truth. `FIX` and other `PARAMS…` mean nothing
//! here; sightings of bearing alone and other tags are left out and counted. Graphs in space are
//! refused.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::error::ImportError;
use super::g2o_chain::{Odometry, chain};
use super::g2o_measure::{Measured, toro};
use super::g2o_tags::{Naming, Order, Tag, tag};
use super::lines::{Line, TextLines};
use super::recording::{ORIGIN, Recording, Seen, Stop, notes};
use super::units::MAX_ANGLE_RAD;
use crate::input::{Note, Source};
use crate::sighting::Pose;

/// Reads a file.
///
/// # Errors
/// A file that cannot be read, a line of a known tag that will not do, poses that make no chain, or
/// no sightings of position.
pub fn read_g2o(path: &Path) -> Result<Recording, ImportError> {
    parse(Source::open(path)?)
}

#[derive(Default)]
struct Graph {
    /// Poses that a vertex names.
    poses: BTreeSet<i64>,
    landmarks: BTreeSet<i64>,
    /// Where sensors sit on the robot.
    offsets: BTreeMap<i64, Pose>,
    edges: Vec<Edge>,
    seen: Vec<Sighting>,
    /// Lines left out, by tag.
    skipped: BTreeMap<String, usize>,
}

/// Odometry as a line states it.
struct Edge {
    odometry: Odometry,
    order: Order,
    /// Of the sensors at both ends.
    offsets: Option<[i64; 2]>,
}

/// A line about a landmark.
struct Sighting {
    line: u64,
    pose: i64,
    landmark: i64,
    naming: Naming,
    measured: Measured,
    /// Of the sensor.
    offset: Option<i64>,
}

pub(super) fn parse(source: Source<'_>) -> Result<Recording, ImportError> {
    let path = source.path().display().to_string();
    let mut graph = Graph::default();
    let mut lines = TextLines::new(source);
    while lines.advance()? {
        if let Some(line) = lines.line(&path) {
            graph.read(&line)?;
        }
    }
    graph.check_names(&path)?;
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
            path,
            instead: format!(" by EDGE_SE2_XY, LANDMARK or the like{}", words.concat()),
        });
    }
    let is_toro = graph.is_toro();
    let edges = graph.odometry(is_toro, &path)?;
    let poses = graph.poses.iter().copied();
    let from = edges.iter().flat_map(|edge| [edge.from, edge.to]);
    let poses: BTreeSet<i64> = poses.chain(from).collect();
    let (order, increments) = chain(&poses, &edges, &path)?;
    let n_loops = edges.len() + 1 - order.len();
    let (mut by_pose, n_near) = graph.seen_by_pose(&path)?;
    let turns = increments
        .iter()
        .map(|increment| increment.relative.heading_rad.abs());
    let n_turns = turns.filter(|turn| *turn > MAX_ANGLE_RAD).count();
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
        (n_near, "landmarks seen under the robot left out".to_owned()),
        (
            n_turns,
            "headings of odometry beyond 2π: are they in degrees?".to_owned(),
        ),
    ];
    let mut all = notes(skipped.into_iter().chain(more));
    if is_toro {
        let what = "EDGE2 states its information in TORO's order (xx xy yy θθ xθ yθ)";
        all.push(Note::plain(what));
    }
    Ok(Recording {
        start: ORIGIN,
        stops: stops.collect(),
        truth: None,
        landmark_names: Vec::new(),
        notes: all,
    })
}

impl Graph {
    fn read(&mut self, line: &Line<'_>) -> Result<(), ImportError> {
        let word = line.fields[0];
        match tag(word) {
            Tag::Pose => {
                line.expect_fields(&[5], "5: VERTEX_SE2, id, x, y, heading")?;
                line.numbers::<3>(2)?;
                add_vertex(&mut self.poses, line)
            }
            Tag::Landmark => {
                line.expect_fields(&[4], "4: VERTEX_XY, id, x, y")?;
                line.numbers::<2>(2)?;
                add_vertex(&mut self.landmarks, line)
            }
            Tag::Odometry(order) => {
                let names = "12: EDGE_SE2, from, to, x, y, heading, and 6 of the information";
                line.expect_fields(&[12], names)?;
                self.read_odometry(line, order, None)
            }
            Tag::OffsetOdometry => {
                let names = "14: EDGE_SE2_OFFSET, from, to, two offsets, x, y, heading, and 6 of \
                             the information";
                line.expect_fields(&[14], names)?;
                let offsets = [line.whole(3, "offset")?, line.whole(4, "offset")?];
                self.read_odometry(line, Order::Rows, Some(offsets))
            }
            Tag::Point(naming) => {
                let names = "8: EDGE_SE2_XY, pose, landmark, x, y, and 3 of the information";
                line.expect_fields(&[8], names)?;
                self.read_point(line, naming, false)
            }
            Tag::OffsetPoint => {
                let names = "9: EDGE_SE2_POINTXY_OFFSET, pose, landmark, offset, x, y, and 3 of \
                             the information";
                line.expect_fields(&[9], names)?;
                self.read_point(line, Naming::Vertices, true)
            }
            Tag::TutorialPoint => {
                let names = "9: TUTORIAL_EDGE_SE2_POINT_XY, pose, landmark, offset, x, y, and 3 \
                             of the information";
                line.expect_fields(&[8, 9], names)?;
                self.read_point(line, Naming::Vertices, line.fields.len() == 9)
            }
            Tag::BearingRange => {
                let names = "7: BR, pose, landmark, bearing, range, and their standard deviations";
                line.expect_fields(&[7], names)?;
                self.read_bearing_range(line)
            }
            Tag::Offset => {
                line.expect_fields(&[5], "5: PARAMS_SE2OFFSET, id, x, y, heading")?;
                let [x_m, y_m, heading_rad] = line.numbers(2)?;
                let offset = Pose {
                    x_m,
                    y_m,
                    heading_rad,
                };
                match self.offsets.insert(line.whole(1, "id")?, offset) {
                    Some(other) if other != offset => Err(line.bad(1, "id", "each offset once")),
                    _ => Ok(()),
                }
            }
            Tag::Fix => (1..line.fields.len()).try_for_each(|k| line.whole(k, "id").map(|_| ())),
            Tag::Ignored => Ok(()),
            Tag::Spatial => Err(line.bad(
                0,
                "tag",
                "a graph in the plane (SE2); project poses and landmarks to the ground first",
            )),
            Tag::Other if word.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                let word = word.chars().take(40).collect();
                *self.skipped.entry(word).or_default() += 1;
                Ok(())
            }
            Tag::Other => Err(line.bad(0, "tag", "a tag, such as EDGE_SE2_XY")),
        }
    }

    fn read_odometry(
        &mut self,
        line: &Line<'_>,
        order: Order,
        offsets: Option<[i64; 2]>,
    ) -> Result<(), ImportError> {
        let (from, to) = (line.whole(1, "from")?, line.whole(2, "to")?);
        if from == to {
            return Err(line.bad(2, "to", "another pose than the edge starts from"));
        }
        let first = if offsets.is_some() { 5 } else { 3 };
        let [x_m, y_m, heading_rad] = line.numbers(first)?;
        let relative = Pose {
            x_m,
            y_m,
            heading_rad,
        };
        let information = line.numbers(first + 3)?;
        let odometry = Odometry::new(line.number, [from, to], relative, information);
        self.edges.push(Edge {
            odometry,
            order,
            offsets,
        });
        Ok(())
    }

    fn read_point(
        &mut self,
        line: &Line<'_>,
        naming: Naming,
        has_offset: bool,
    ) -> Result<(), ImportError> {
        let offset = has_offset.then(|| line.whole(3, "offset")).transpose()?;
        let first = if has_offset { 4 } else { 3 };
        let measured = Measured::point(line.numbers(first)?, line.numbers(first + 2)?);
        let measured = measured.ok_or_else(|| {
            let expected = "a positive definite information (xx xy yy)";
            line.bad_span(first + 2, 3, "information", expected)
        })?;
        self.push(line, naming, measured, offset)
    }

    fn read_bearing_range(&mut self, line: &Line<'_>) -> Result<(), ImportError> {
        let [bearing_rad, range_m, bearing_std_rad, range_std_m] = line.numbers(3)?;
        if bearing_rad.abs() > MAX_ANGLE_RAD {
            return Err(line.bad(3, "bearing", "radians within ±2π"));
        }
        if range_m <= 0.0 {
            return Err(line.bad(4, "range", "a range above 0 m"));
        }
        for (place, std) in [(5, bearing_std_rad), (6, range_std_m)] {
            if std <= 0.0 {
                return Err(line.bad(place, "standard deviation", "a number above 0"));
            }
        }
        let measured = Measured::Polar {
            range_m,
            bearing_rad,
            stated: [range_std_m, bearing_std_rad, 0.0],
        };
        self.push(line, Naming::Landmarks, measured, None)
    }

    fn push(
        &mut self,
        line: &Line<'_>,
        naming: Naming,
        measured: Measured,
        offset: Option<i64>,
    ) -> Result<(), ImportError> {
        let (pose, landmark) = (line.whole(1, "pose")?, line.whole(2, "landmark")?);
        if landmark < 0 {
            return Err(line.bad(2, "landmark", "a number from 0 on"));
        }
        self.seen.push(Sighting {
            line: line.number,
            pose,
            landmark,
            naming,
            measured,
            offset,
        });
        Ok(())
    }

    /// Whether `EDGE2` must be in TORO's order: by rows some information is not positive definite,
    /// and in TORO's order all are.
    fn is_toro(&self) -> bool {
        let either = self.edges.iter().filter(|e| e.order == Order::RowsOrToro);
        let by_rows = |edge: &Edge| edge.odometry.increment.covariance.is_some();
        let by_toro = |edge: &Edge| {
            let again = toro(edge.odometry.information);
            Odometry::new(0, [0, 1], ORIGIN, again)
                .increment
                .covariance
                .is_some()
        };
        either.clone().any(|edge| !by_rows(edge)) && either.clone().all(by_toro)
    }

    /// Odometry between poses, whatever the sensors.
    fn odometry(&self, is_toro: bool, path: &str) -> Result<Vec<Odometry>, ImportError> {
        let edges = self.edges.iter().map(|edge| {
            let mut odometry = edge.odometry.clone();
            if is_toro && edge.order == Order::RowsOrToro {
                let ends = [odometry.from, odometry.to];
                let information = toro(odometry.information);
                odometry = Odometry::new(
                    odometry.line,
                    ends,
                    odometry.increment.relative,
                    information,
                );
            }
            if let Some([from, to]) = edge.offsets {
                let line = odometry.line;
                let from = self.offset(from, line, path)?;
                return Ok(odometry.between_sensors(from, self.offset(to, line, path)?));
            }
            Ok(odometry)
        });
        edges.collect()
    }

    fn offset(&self, id: i64, line: u64, path: &str) -> Result<Pose, ImportError> {
        self.offsets
            .get(&id)
            .copied()
            .ok_or_else(|| ImportError::Disagrees {
                place: format!("{path}, line {line}"),
                got: format!("a sensor with the offset {id}"),
                expected: format!("a line PARAMS_SE2OFFSET {id} that says where it sits"),
                change: "add the line, with 0 0 0 for a sensor at the robot's centre",
            })
    }

    /// Sightings by pose in the order of lines, and how many were too near to have a direction.
    fn seen_by_pose(&self, path: &str) -> Result<(BTreeMap<i64, Vec<Seen>>, usize), ImportError> {
        let mut by_pose: BTreeMap<i64, Vec<Seen>> = BTreeMap::new();
        let mut n_near = 0;
        for one in &self.seen {
            let offset = one.offset.map(|id| self.offset(id, one.line, path));
            let seen = one.measured.seen(offset.transpose()?, one.landmark);
            let seen = seen.map_err(|got| ImportError::Disagrees {
                place: format!("{path}, line {}", one.line),
                got: format!("the information {got}"),
                expected: "a positive definite information (xx xy yy)".to_owned(),
                change: "correct the line",
            })?;
            match seen {
                Some(seen) => by_pose.entry(one.pose).or_default().push(seen),
                None => n_near += 1,
            }
        }
        Ok((by_pose, n_near))
    }

    /// Every sighting needs a pose that is one, and no vertex may be both pose and landmark.
    fn check_names(&self, path: &str) -> Result<(), ImportError> {
        let edges = self.edges.iter().map(|edge| &edge.odometry);
        let ends = edges.clone().flat_map(|edge| [edge.from, edge.to]);
        let poses: BTreeSet<i64> = self.poses.iter().copied().chain(ends).collect();
        let disagrees = |line: u64, got: String, expected: &str| ImportError::Disagrees {
            place: format!("{path}, line {line}"),
            got,
            expected: expected.to_owned(),
            change: "correct the numbers of the vertices",
        };
        let naming = self.seen.first().map(|one| one.naming);
        for one in &self.seen {
            let (line, pose, landmark) = (one.line, one.pose, one.landmark);
            if Some(one.naming) != naming {
                let got = "a sighting by EDGE_SE2_XY and one by LANDMARK or BR".to_owned();
                return Err(disagrees(
                    line,
                    got,
                    "landmarks that are all vertices, or none",
                ));
            }
            if !poses.contains(&pose) {
                let got = format!("a sighting from vertex {pose}");
                return Err(disagrees(
                    line,
                    got,
                    "a pose that a VERTEX_SE2 or EDGE_SE2 names",
                ));
            }
            if one.naming == Naming::Vertices && poses.contains(&landmark) {
                let got = format!("a sighting of vertex {landmark}, which is a pose");
                return Err(disagrees(line, got, "a landmark"));
            }
        }
        if naming == Some(Naming::Landmarks) {
            return Ok(());
        }
        for edge in edges {
            let ends = [edge.from, edge.to];
            if let Some(end) = ends.iter().find(|end| self.landmarks.contains(end)) {
                let got = format!("odometry of vertex {end}, which is a VERTEX_XY");
                return Err(disagrees(edge.line, got, "two poses"));
            }
        }
        Ok(())
    }
}

fn add_vertex(vertices: &mut BTreeSet<i64>, line: &Line<'_>) -> Result<(), ImportError> {
    let is_new = vertices.insert(line.whole(1, "id")?);
    is_new
        .then_some(())
        .ok_or_else(|| line.bad(1, "id", "each vertex once"))
}
