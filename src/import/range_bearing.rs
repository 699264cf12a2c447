//! The plain range-bearing CSV, one sighting a row, with the dead-reckoned pose it was made from:
//! `t,robot_x,robot_y,robot_theta,range,bearing` in seconds, metres and radians, and optionally
//! `true_landmark_id`, a whole number or a name; −1 (or nothing) is clutter. A row with neither
//! range nor bearing is a pose from which nothing was seen. [`crate::input::Table`] says how files
//! may differ.
//!
//! Rows may come in any order of time; neighbours of the same time and pose are one scan.

use std::path::Path;

use super::error::ImportError;
use super::recording::{Increment, ORIGIN, Recording, Seen, Stop};
use super::units;
use crate::input::{Column, Identities, Layout, MAX_LINES, Note, Row, Source, Table};
use crate::sighting::{Pose, Sighting, wrap_rad};

const LAYOUT: Layout = Layout {
    rows: "sightings",
    columns: &[
        Column::required("t", "s"),
        Column::required("robot_x", "m"),
        Column::required("robot_y", "m"),
        Column::required("robot_theta", "rad"),
        Column::required("range", "m"),
        Column::required("bearing", "rad"),
        Column::optional("true_landmark_id"),
    ],
    max_rows: MAX_LINES as usize,
};

const T: usize = 0;
const X: usize = 1;
const Y: usize = 2;
const THETA: usize = 3;
const RANGE: usize = 4;
const BEARING: usize = 5;
const LANDMARK: usize = 6;

/// Time (s) of a row, and the landmark truly seen.
pub type RowIdentity = (f64, Option<i64>);

/// Reads a recording, and the time (s) and landmark of each row as they come in the file.
///
/// # Errors
/// A file that cannot be read, lacks a column, or holds a value that will not do.
pub fn read_range_bearing(path: &Path) -> Result<(Recording, Vec<RowIdentity>), ImportError> {
    read(Source::open(path)?)
}

pub(super) fn read(source: Source<'_>) -> Result<(Recording, Vec<RowIdentity>), ImportError> {
    let scans = parse(source)?;
    let landmark = |row: &PoseRow| row.seen.and_then(|seen| seen.landmark);
    let identities = scans.rows.iter().map(|row| (row.time_s, landmark(row)));
    let identities = identities.collect();
    Ok((recording(scans), identities))
}

/// Poses with their times (s) and what was seen from them as such a file. Both are in the order of
/// time; a sighting is of the pose of its time.
pub fn range_bearing_csv(
    poses: impl Iterator<Item = (f64, Pose)>,
    sightings: &[Sighting],
) -> String {
    let mut text = String::from("t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id\n");
    let mut left = sightings;
    for (time_s, pose) in poses {
        let n = left.partition_point(|one| one.time_s <= time_s);
        let (here, later) = left.split_at(n);
        left = later;
        let (x, y, heading) = (pose.x_m, pose.y_m, pose.heading_rad);
        for one in here {
            let id = one.landmark.map_or(-1, |id| id);
            let (range, bearing) = (one.range_m, one.bearing_rad);
            text += &format!("{time_s},{x},{y},{heading},{range},{bearing},{id}\n");
        }
        if here.is_empty() {
            text += &format!("{time_s},{x},{y},{heading},,,\n");
        }
    }
    text
}

/// A row of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseRow {
    pub line: u64,
    pub time_s: f64,
    pub pose: Pose,
    /// `None` where nothing was seen.
    pub seen: Option<Seen>,
}

/// The rows of a file, and what else it says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scans {
    rows: Vec<PoseRow>,
    landmark_names: Vec<String>,
    notes: Vec<Note>,
}

fn recording(scans: Scans) -> Recording {
    let mut in_time: Vec<&PoseRow> = scans.rows.iter().collect();
    in_time.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let start = in_time.first().map_or(ORIGIN, |row| row.pose);
    let mut stops = Vec::new();
    let mut last = start;
    for scan in in_time.chunk_by(|a, b| a.time_s == b.time_s && a.pose == b.pose) {
        let pose = scan[0].pose;
        stops.push(Stop {
            time_s: scan[0].time_s,
            increment: Increment {
                relative: last.to(pose),
                covariance: None,
            },
            seen: scan.iter().filter_map(|row| row.seen).collect(),
        });
        last = pose;
    }
    Recording {
        start,
        stops,
        truth: None,
        landmark_names: scans.landmark_names,
        notes: scans.notes,
    }
}

fn parse(source: Source<'_>) -> Result<Scans, ImportError> {
    let mut table = Table::new(source, LAYOUT)?;
    let mut identities = Identities::default();
    let mut rows = Vec::new();
    let mut n_seen = 0;
    while let Some(mut row) = table.next_row()? {
        let pose = Pose {
            x_m: row.number(X)?,
            y_m: row.number(Y)?,
            heading_rad: row.number(THETA)?,
        };
        let seen = sighting(&mut row, &mut identities)?;
        n_seen += usize::from(seen.is_some());
        rows.push(PoseRow {
            line: row.line(),
            time_s: row.number(T)?,
            pose,
            seen,
        });
    }
    if rows.is_empty() {
        return Err(table.no_rows().into());
    }
    let path = table.path().display().to_string();
    if n_seen == 0 {
        return Err(ImportError::Empty {
            path,
            instead: format!(", {} poses without range and bearing", rows.len()),
        });
    }
    let numbered = identities.finish();
    // Until all rows were in, an identity was its key.
    for seen in rows.iter_mut().filter_map(|row| row.seen.as_mut()) {
        seen.landmark = seen.landmark.map(|key| numbered.numbers[key as usize]);
    }
    let mut notes = table.notes();
    if !table.has(LANDMARK) {
        notes.push(Note::plain(
            "no column true_landmark_id: who was seen is unknown",
        ));
    }
    notes.extend(units::check(&rows, &path)?);
    Ok(Scans {
        rows,
        landmark_names: numbered.names,
        notes,
    })
}

/// What a row saw, its landmark by the key of its identity.
fn sighting(
    row: &mut Row<'_, '_>,
    identities: &mut Identities,
) -> Result<Option<Seen>, ImportError> {
    let key = row.identity(LANDMARK, identities)?;
    if row.is_missing(RANGE) && row.is_missing(BEARING) && key.is_none() {
        return Ok(None);
    }
    let range_m = row.number(RANGE)?;
    if range_m <= 0.0 {
        return Err(row.fault(RANGE, "a range above 0 m").into());
    }
    let bearing_rad = row.number(BEARING)?;
    if bearing_rad.abs() > units::MAX_ANGLE_RAD {
        let got = format!("{}, which is beyond 2π", row.text(BEARING));
        let change = "is it in degrees? multiply bearings by π/180";
        return Err(row
            .refuse(BEARING, &got, "radians within ±2π", change)
            .into());
    }
    Ok(Some(Seen {
        range_m,
        bearing_rad: wrap_rad(bearing_rad),
        stated: None,
        landmark: key.map(|key| key as i64),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::InputError;

    const HEADER: &str = "t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id";

    fn read_text(text: &str) -> Result<(Recording, Vec<RowIdentity>), ImportError> {
        read(Source::from_reader(text.as_bytes(), Path::new("a.csv"))?)
    }

    fn refusal(text: &str) -> String {
        read_text(text).map_or_else(|e| e.to_string(), |s| format!("{s:?}"))
    }

    fn good(text: &str) -> Recording {
        read_text(text).expect("a good recording").0
    }

    #[test]
    fn reads_columns_by_name_and_clutter_as_unknown() {
        let text = "\u{feff}true_landmark_id,T,Robot_X,robot_y,robot_theta,range,bearing\r\n\
                    7,0.5,1,2,0,10,4.0\r\n-1,0.5,1,2,0,3,0\r\nNaN,0.5,1,2,0,3,0\r\n";
        let recording = good(text);
        assert_eq!(recording.stops.len(), 1);
        let seen = &recording.stops[0].seen;
        let landmarks: Vec<_> = seen.iter().map(|one| one.landmark).collect();
        assert_eq!(landmarks, [Some(7), None, None]);
        assert!((seen[0].bearing_rad - (4.0 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(recording.start.position_m(), [1.0, 2.0]);
        assert_eq!(recording.notes, []);
    }

    #[test]
    fn rows_are_sorted_by_time_and_the_path_is_chained_again() {
        let text =
            format!("{HEADER}\n2,3,4,1,1,0,1\n1,1,1,0.5,1,0,1\n1,1,1,0.5,2,0,2\n3,0,4,-3,1,0,1\n");
        let recording = good(&text);
        let times: Vec<f64> = recording.stops.iter().map(|stop| stop.time_s).collect();
        assert_eq!(times, [1.0, 2.0, 3.0]);
        assert_eq!(recording.stops[0].seen.len(), 2);
        let end = recording
            .stops
            .iter()
            .skip(1)
            .fold(recording.start, |pose, stop| {
                pose.then(stop.increment.relative)
            });
        assert!(
            (end.x_m - 0.0).abs() + (end.y_m - 4.0).abs() + (end.heading_rad + 3.0).abs() < 1e-12
        );
    }

    #[test]
    fn one_time_and_two_poses_are_two_stops() {
        let text = format!("{HEADER}\n1,0,0,0,1,0,1\n1,0.5,0,0,1,0,1\n");
        let recording = good(&text);
        assert_eq!(recording.stops.len(), 2);
        assert_eq!(recording.stops[1].increment.relative.x_m, 0.5);
    }

    #[test]
    fn poses_from_which_nothing_was_seen_are_odometry_wherever_they_stand() {
        let text = format!(
            "{HEADER}\n0,0,0,0,,,\n1,1,0,0,1,0,3\n2,2,0,0,nan,nan,-1\n3,3,0,0,1,0,3\n4,4,1,0,,,\n"
        );
        let (recording, rows) = read_text(&text).expect("a good recording");
        let n_seen: Vec<usize> = recording.stops.iter().map(|stop| stop.seen.len()).collect();
        assert_eq!(n_seen, [0, 1, 0, 1, 0]);
        assert_eq!(recording.stops[4].increment.relative.y_m, 1.0);
        assert_eq!(rows[2], (2.0, None));
        // Half a sighting is none.
        for row in ["5,0,0,0,1,,3", "5,0,0,0,,0.5,", "5,0,0,0,,,3"] {
            assert!(
                refusal(&format!("{text}{row}\n")).contains("line 7, column"),
                "{row}"
            );
        }
        assert_eq!(
            refusal(&format!("{HEADER}\n0,0,0,0,,,\n")),
            "a.csv: got no sightings, 1 poses without range and bearing, expected at least one; \
             check the file"
        );
    }

    #[test]
    fn names_are_identities_and_the_column_may_be_missing() {
        let text = format!("{HEADER}\n0,0,0,0,1,0,tree0\n0,0,0,0,2,0,oak\n1,0,0,0,1,0,tree0\n");
        let recording = good(&text);
        let seen = recording.stops.iter().flat_map(|stop| &stop.seen);
        let landmarks: Vec<_> = seen.map(|one| one.landmark).collect();
        assert_eq!(landmarks, [Some(0), Some(1), Some(0)]);
        assert_eq!(recording.landmark_names, ["tree0", "oak"]);
        let without = good("t,robot_x,robot_y,robot_theta,range,bearing\n0,0,0,0,1,0\n");
        assert_eq!(without.stops[0].seen[0].landmark, None);
        assert_eq!(without.notes.len(), 1);
    }

    #[test]
    fn refusals_name_line_and_column() {
        assert_eq!(
            refusal(&format!("{HEADER}\n1,0,0,0,2,0.1,3\n1,0,inf,0,2,0.1,3\n")),
            "a.csv, line 3, column robot_y: got \"inf\", expected a finite number; correct the \
             value or remove the row"
        );
        assert_eq!(
            refusal(&format!("{HEADER}\n1,0,0,0,-2,0.1,3\n")),
            "a.csv, line 2, column range: got \"-2\", expected a range above 0 m; correct the \
             value or remove the row"
        );
        assert_eq!(
            refusal(&format!("{HEADER}\n1,0,0,0,2,0.1,2.5\n")),
            "a.csv, line 2, column true_landmark_id: got \"2.5\", expected a whole number, a name, \
             or nothing (or -1) for an unknown landmark; correct the value or remove the row"
        );
        assert_eq!(
            refusal(&format!("{HEADER}\n1,0,0,0,2,21.3,2\n")),
            "a.csv, line 2, column bearing: got 21.3, which is beyond 2π, expected radians within \
             ±2π; is it in degrees? multiply bearings by π/180"
        );
        assert!(
            refusal("t,x\n1,2\n").contains("got t,x in the header, expected the columns t,robot_x")
        );
        assert_eq!(
            refusal(&format!("{HEADER}\n")),
            "a.csv: got no sightings, expected at least one row below the header; add a row for each"
        );
        assert_eq!(
            refusal(&format!("{HEADER}\n1,0,0,0,2,0.1,3\n1,2\n")),
            "a.csv, line 3: got 2 fields, expected 7 as in the header; write one field per column, \
             separated by commas, with a decimal point"
        );
        let latin = [HEADER.as_bytes(), b"\n1,0,\xe9,0,2,0.1,3\n"].concat();
        let latin = Source::from_reader(&latin[..], Path::new("a.csv"));
        let latin = read(latin.expect("bytes")).expect_err("no text");
        assert!(matches!(latin, ImportError::Input(InputError::Content(_))));
        assert!(
            latin
                .to_string()
                .starts_with("a.csv, line 2: got bytes that are not UTF-8"),
            "{latin}"
        );
        for empty in ["", "\n\n"] {
            assert!(
                refusal(empty).starts_with("a.csv, line 1: got a blank file"),
                "{empty:?}"
            );
        }
    }
}
