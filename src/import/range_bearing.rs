//! The plain range-bearing CSV, one sighting a row, with the dead-reckoned pose it was made from:
//! `t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id` in seconds, metres and radians;
//! identity −1 (or nothing) is clutter. Plain, or compressed with gzip.
//!
//! Rows may come in any order of time; neighbours of the same time and pose are one scan.

use std::path::Path;

use super::error::ImportError;
use super::lines::{read_bytes, whole};
use super::recording::{Increment, ORIGIN, Recording, Seen, Stop};
use crate::excerpt::message;
use crate::sighting::{Pose, wrap_rad};

const COLUMNS: [&str; 7] = [
    "t",
    "robot_x",
    "robot_y",
    "robot_theta",
    "range",
    "bearing",
    "true_landmark_id",
];

/// Time (s) of a row, and the landmark truly seen.
pub type RowIdentity = (f64, Option<i64>);

/// Reads a recording, and the time (s) and landmark of each row as they come in the file.
///
/// # Errors
/// A file that cannot be read, lacks a column, or holds a value that will not do.
pub fn read_range_bearing(path: &Path) -> Result<(Recording, Vec<RowIdentity>), ImportError> {
    let bytes = read_bytes(path)?;
    let rows = parse(&bytes, &path.display().to_string())?;
    let identities = rows.iter().map(|(t, _, seen)| (*t, seen.landmark));
    Ok((recording(&rows), identities.collect()))
}

type SightingRow = (f64, Pose, Seen);

pub(super) fn recording(rows: &[SightingRow]) -> Recording {
    let mut in_time: Vec<&SightingRow> = rows.iter().collect();
    in_time.sort_by(|a, b| a.0.total_cmp(&b.0));
    let start = in_time.first().map_or(ORIGIN, |row| row.1);
    let mut stops = Vec::new();
    let mut last = start;
    for scan in in_time.chunk_by(|a, b| a.0 == b.0 && a.1 == b.1) {
        let (time_s, pose, _) = *scan[0];
        stops.push(Stop {
            time_s,
            increment: Increment {
                relative: last.to(pose),
                covariance: None,
            },
            seen: scan.iter().map(|row| row.2).collect(),
        });
        last = pose;
    }
    Recording {
        start,
        stops,
        truth: None,
        notes: Vec::new(),
    }
}

pub(super) fn parse(bytes: &[u8], path: &str) -> Result<Vec<SightingRow>, ImportError> {
    let mut table = Table::new(bytes, path, &COLUMNS)?;
    let mut rows = Vec::new();
    while let Some(row) = table.next_row()? {
        let range_m = row.number(4)?;
        if range_m <= 0.0 {
            return Err(row.bad(4, "a range above 0 m"));
        }
        let landmark = match row.field(6) {
            "" => None,
            text => Some(whole(text).ok_or_else(|| row.bad(6, "a whole number, -1 for clutter"))?),
        };
        let pose = Pose {
            x_m: row.number(1)?,
            y_m: row.number(2)?,
            heading_rad: row.number(3)?,
        };
        let seen = Seen {
            range_m,
            bearing_rad: wrap_rad(row.number(5)?),
            stated: None,
            landmark: landmark.filter(|&id| id >= 0),
        };
        rows.push((row.number(0)?, pose, seen));
    }
    if rows.is_empty() {
        return Err(ImportError::Empty {
            path: path.to_owned(),
            instead: " below the header".to_owned(),
        });
    }
    Ok(rows)
}

/// A CSV with a header, read by the names of columns.
pub(super) struct Table<'a> {
    path: &'a str,
    columns: &'static [&'static str],
    places: Vec<usize>,
    reader: csv::Reader<&'a [u8]>,
    record: csv::StringRecord,
}

impl<'a> Table<'a> {
    pub fn new(
        bytes: &'a [u8],
        path: &'a str,
        columns: &'static [&'static str],
    ) -> Result<Self, ImportError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let header = reader
            .headers()
            .map_err(|error| malformed(path, &error))?
            .clone();
        let place = |column: &&str| header.iter().position(|name| name == *column);
        let Some(places) = columns.iter().map(place).collect() else {
            let got = header
                .iter()
                .collect::<Vec<_>>()
                .join(",")
                .replace(['\n', '\r'], " ");
            return Err(ImportError::Header {
                path: path.to_owned(),
                got: got.chars().take(200).collect::<String>(),
                expected: columns.join(","),
            });
        };
        Ok(Self {
            path,
            columns,
            places,
            reader,
            record: csv::StringRecord::new(),
        })
    }

    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, ImportError> {
        let is_row = self
            .reader
            .read_record(&mut self.record)
            .map_err(|error| malformed(self.path, &error))?;
        Ok(is_row.then_some(Row { table: self }))
    }
}

fn malformed(path: &str, error: &csv::Error) -> ImportError {
    let line = error.position().map_or(0, csv::Position::line);
    let (what, at) = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            len, expected_len, ..
        } => (
            format!("got {len} fields, expected {expected_len} as in the header"),
            line,
        ),
        csv::ErrorKind::Utf8 { .. } => ("got bytes that are not UTF-8, expected text".into(), line),
        _ => (message(&error.to_string()), line),
    };
    ImportError::Malformed {
        path: format!("{path}, line {}", at.max(1)),
        what,
    }
}

pub(super) struct Row<'a> {
    table: &'a Table<'a>,
}

impl Row<'_> {
    pub fn field(&self, k: usize) -> &str {
        let table = self.table;
        table.record.get(table.places[k]).unwrap_or_default()
    }

    pub fn is_blank_or_nan(&self, k: usize) -> bool {
        self.field(k).is_empty() || self.field(k).eq_ignore_ascii_case("nan")
    }

    pub fn bad(&self, k: usize, expected: &'static str) -> ImportError {
        ImportError::Value {
            path: self.table.path.to_owned(),
            line: self.table.record.position().map_or(0, csv::Position::line),
            column: self.table.columns[k],
            got: self.field(k).chars().take(40).collect(),
            expected,
        }
    }

    pub fn number(&self, k: usize) -> Result<f64, ImportError> {
        match self.field(k).parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.bad(k, "a finite number")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        parse(text.as_bytes(), "a.csv").map_or_else(|e| e.to_string(), |s| format!("{s:?}"))
    }

    fn good(text: &str) -> Recording {
        recording(&parse(text.as_bytes(), "a.csv").expect("a good recording"))
    }

    #[test]
    fn reads_columns_by_name_and_clutter_as_unknown() {
        let text = "\u{feff}true_landmark_id,t,robot_x,robot_y,robot_theta,range,bearing\r\n\
                    7,0.5,1,2,0,10,4.0\r\n-1,0.5,1,2,0,3,0\r\n";
        let recording = good(text);
        assert_eq!(recording.stops.len(), 1);
        let seen = &recording.stops[0].seen;
        assert_eq!((seen[0].landmark, seen[1].landmark), (Some(7), None));
        assert!((seen[0].bearing_rad - (4.0 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(recording.start.position_m(), [1.0, 2.0]);
    }

    #[test]
    fn rows_are_sorted_by_time_and_the_path_is_chained_again() {
        let header = COLUMNS.join(",");
        let text =
            format!("{header}\n2,3,4,1,1,0,1\n1,1,1,0.5,1,0,1\n1,1,1,0.5,2,0,2\n3,0,4,-3,1,0,1\n");
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
        let text = format!("{}\n1,0,0,0,1,0,1\n1,0.5,0,0,1,0,1\n", COLUMNS.join(","));
        let recording = good(&text);
        assert_eq!(recording.stops.len(), 2);
        assert_eq!(recording.stops[1].increment.relative.x_m, 0.5);
    }

    #[test]
    fn refusals_name_line_and_column() {
        let header = COLUMNS.join(",");
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,2,0.1,3\n1,0,nan,0,2,0.1,3\n")),
            "a.csv, line 3, column robot_y: got \"nan\", expected a finite number; correct the row"
        );
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,-2,0.1,3\n")),
            "a.csv, line 2, column range: got \"-2\", expected a range above 0 m; correct the row"
        );
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,2,0.1,two\n")),
            "a.csv, line 2, column true_landmark_id: got \"two\", expected a whole number, -1 for \
             clutter; correct the row"
        );
        assert!(refusal("t,x\n1,2\n").contains("got the columns t,x, expected t,robot_x"));
        assert_eq!(
            refusal(&format!("{header}\n")),
            "a.csv: got no sightings below the header, expected at least one; check the file"
        );
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,2,0.1,3\n1,2\n")),
            "a.csv, line 3: got 2 fields, expected 7 as in the header; give a text file, plain or \
             compressed with gzip"
        );
        let latin = parse(
            &[header.as_bytes(), b"\n1,0,\xe9,0,2,0.1,3\n"].concat(),
            "a.csv",
        );
        let latin = latin.expect_err("no text").to_string();
        assert!(
            latin.starts_with("a.csv, line 2: got bytes that are not UTF-8"),
            "{latin}"
        );
        for empty in ["", "\n\n", "\u{0}\u{1}"] {
            assert!(
                refusal(empty).starts_with("a.csv, line 1: got the columns"),
                "{empty:?}"
            );
        }
    }
}
