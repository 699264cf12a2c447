//! UTIAS MRCLAM folders (Leung, Halpern, Barfoot & Liu, IJRR 30(8), 2011): one robot of several.
//!
//! `Robot<n>_Odometry.dat`: t s, v m/s, ω rad/s, held until the next line.
//! `Robot<n>_Measurement.dat`: t s, **barcode**, range m, bearing rad. `Barcodes.dat`: subject, barcode.
//! Optional: `Robot<n>_Groundtruth.dat`: t s, x m, y m, heading rad. `Landmark_Groundtruth.dat`:
//! subject, x m, y m, and their standard deviations. Plain or gzip, comments from `#`.
//!
//! Subjects of the landmark file are landmarks; without it, those above 5, as in all nine data sets of
//! the authors. Sightings of other subjects, the robots, are dropped: they move. Unknown barcodes are
//! misread ones and stay, as clutter. Times are counted from the robot's first line of odometry.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::error::ImportError;
use super::lines::{Line, lines};
use super::recording::{Increment, ORIGIN, Recording, Seen, Stop, notes};
use super::truth::Truth;
use super::units::MAX_ANGLE_RAD;
use crate::input::{InputError, Source};
use crate::sighting::Pose;

/// Subjects up to here are robots where no file says which are landmarks.
const LAST_ROBOT: i64 = 5;
/// Odometry comes some 50 times a second; a longer pause is worth a word, s.
const LONG_GAP_S: f64 = 2.0;

/// Reads what one robot recorded; `robot` may be left out if the folder has only one.
///
/// # Errors
/// A folder without the files named above, a line of them that will not do, or no such robot.
pub fn read_mrclam(folder: &Path, robot: Option<u32>) -> Result<Recording, ImportError> {
    let robot = choose(robots(folder)?, robot, folder)?;
    let text = |name: &str| -> Result<Text, ImportError> {
        let path = find(folder, name).unwrap_or_else(|| folder.join(name));
        Ok(Text {
            text: Source::open(&path)?.read_lossy()?,
            path: path.display().to_string(),
        })
    };
    let optional = |name: &str| find(folder, name).map(|_| text(name)).transpose();
    Files {
        barcodes: text("Barcodes.dat")?,
        odometry: text(&format!("Robot{robot}_Odometry.dat"))?,
        measurements: text(&format!("Robot{robot}_Measurement.dat"))?,
        landmarks: optional("Landmark_Groundtruth.dat")?,
        poses: optional(&format!("Robot{robot}_Groundtruth.dat"))?,
    }
    .parse()
}

/// The file of that name, or its gzip.
fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    let plain = folder.join(name);
    let packed = folder.join(format!("{name}.gz"));
    [plain, packed].into_iter().find(|path| path.is_file())
}

/// The robots whose measurements lie in a folder.
fn robots(folder: &Path) -> Result<BTreeSet<u32>, ImportError> {
    let read = |source| InputError::Read {
        path: folder.to_owned(),
        source,
    };
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).map_err(read)? {
        let name = entry.map_err(read)?.file_name();
        let name = name.to_string_lossy();
        let number = name.strip_prefix("Robot").and_then(|rest| {
            let rest = rest.strip_suffix(".gz").unwrap_or(rest);
            rest.strip_suffix("_Measurement.dat")?.parse::<u32>().ok()
        });
        found.extend(number);
    }
    Ok(found)
}

fn choose(there: BTreeSet<u32>, robot: Option<u32>, folder: &Path) -> Result<u32, ImportError> {
    let list: Vec<String> = there.iter().map(u32::to_string).collect();
    let choice = |got: String| ImportError::Choice {
        flag: "--robot",
        got,
        expected: format!(
            "one of the robots of {}: {}",
            folder.display(),
            list.join(", ")
        ),
    };
    match robot {
        _ if there.is_empty() => Err(ImportError::Disagrees {
            place: folder.display().to_string(),
            got: "no file Robot<n>_Measurement.dat".to_owned(),
            expected: "a folder of UTIAS MRCLAM".to_owned(),
            change: "give the folder that holds the .dat files, or a file",
        }),
        Some(robot) if there.contains(&robot) => Ok(robot),
        Some(robot) => Err(choice(robot.to_string())),
        None if there.len() == 1 => Ok(there.into_iter().next().expect("there is one")),
        None => Err(choice("nothing".to_owned())),
    }
}

/// A file's path and text. Bytes that are no text can only stand in comments: elsewhere they are no
/// numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Text {
    pub path: String,
    pub text: String,
}

impl Text {
    fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        lines(&self.text, &self.path)
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Files {
    pub barcodes: Text,
    pub odometry: Text,
    pub measurements: Text,
    pub landmarks: Option<Text>,
    pub poses: Option<Text>,
}

impl Files {
    pub fn parse(&self) -> Result<Recording, ImportError> {
        let subjects = barcodes(&self.barcodes)?;
        let landmarks_m = self.landmarks.as_ref().map(landmarks).transpose()?;
        let is_landmark = |subject: i64| match &landmarks_m {
            Some(known) => known.contains_key(&subject),
            None => subject > LAST_ROBOT,
        };
        let (odometry, n_unordered) = in_time(table(&self.odometry, ODOMETRY)?);
        let Some(&(start_s, _)) = odometry.first() else {
            return Err(ImportError::Disagrees {
                place: self.odometry.path.clone(),
                got: "no line of odometry".to_owned(),
                expected: "at least one".to_owned(),
                change: "give the whole file",
            });
        };
        let odometry: Vec<(f64, [f64; 2])> = odometry
            .iter()
            .map(|(t, row)| (t - start_s, *row))
            .collect();
        let end_s = odometry.last().map_or(0.0, |(t, _)| *t);

        let (mut n_robots, mut n_unknown, mut n_outside) = (0, 0, 0);
        let mut seen = Vec::new();
        for (time_s, barcode, mut one) in sightings(&self.measurements)? {
            let time_s = time_s - start_s;
            let subject = subjects.get(&barcode).copied();
            if subject.is_some_and(|subject| !is_landmark(subject)) {
                n_robots += 1;
            } else if time_s < 0.0 || time_s > end_s {
                n_outside += 1;
            } else {
                n_unknown += usize::from(subject.is_none());
                one.landmark = subject;
                seen.push((time_s, one));
            }
        }
        if seen.is_empty() {
            return Err(ImportError::Empty {
                path: self.measurements.path.clone(),
                instead: format!(
                    " of landmarks while there was odometry, {n_robots} of robots, {n_outside} at \
                     other times"
                ),
            });
        }
        let gaps = odometry.windows(2).map(|pair| pair[1].0 - pair[0].0);
        let n_gaps = gaps.filter(|gap_s| *gap_s > LONG_GAP_S).count();
        let poses = match &self.poses {
            Some(text) => in_time(table(text, POSES)?).0,
            None => Vec::new(),
        };
        let poses = poses.into_iter().map(|(t, [x_m, y_m, heading_rad])| {
            let pose = Pose {
                x_m,
                y_m,
                heading_rad,
            };
            (t - start_s, pose)
        });
        Ok(Recording {
            start: ORIGIN,
            stops: stops(&odometry, in_time(seen).0),
            truth: Some(Truth {
                landmarks_m: landmarks_m.unwrap_or_default(),
                poses: poses.collect(),
            }),
            landmark_names: Vec::new(),
            notes: notes([
                (n_robots, "sightings of other robots dropped".to_owned()),
                (n_outside, "sightings without odometry dropped".to_owned()),
                (
                    n_unknown,
                    "sightings of unknown barcodes kept as clutter".to_owned(),
                ),
                (
                    n_unordered,
                    "lines of odometry sorted into order of time".to_owned(),
                ),
                (
                    n_gaps,
                    format!("pauses of the odometry above {LONG_GAP_S} s, velocities held"),
                ),
            ]),
        })
    }
}

/// Odometry and sightings as one stream.
fn stops(odometry: &[(f64, [f64; 2])], seen: Vec<(f64, Seen)>) -> Vec<Stop> {
    let mut stops: Vec<Stop> = Vec::with_capacity(odometry.len() + seen.len());
    let mut velocities = [0.0; 2];
    let mut now_s = 0.0;
    let mut seen = seen.into_iter().peekable();
    let mut odometry = odometry.iter().peekable();
    loop {
        let next_seen = seen.peek().map(|(t, _)| *t);
        let next_odometry = odometry.peek().map(|(t, _)| *t);
        let (Some(next_s), is_odometry) = (match (next_seen, next_odometry) {
            (Some(a), Some(b)) => (Some(a.min(b)), b <= a),
            (a, b) => (a.or(b), b.is_some()),
        }) else {
            return stops;
        };
        if stops.is_empty() || next_s > now_s {
            stops.push(Stop {
                time_s: next_s,
                increment: arc(velocities, next_s - now_s),
                seen: Vec::new(),
            });
            now_s = next_s;
        }
        if is_odometry {
            velocities = odometry.next().map_or(velocities, |(_, row)| *row);
        } else if let (Some((_, one)), Some(stop)) = (seen.next(), stops.last_mut()) {
            stop.seen.push(one);
        }
    }
}

/// The way driven at constant velocities (m/s, rad/s) in a time (s): a chord of v·t·sinc(ωt/2) under ωt/2.
fn arc([v, w]: [f64; 2], time_s: f64) -> Increment {
    let half_rad = w * time_s / 2.0;
    let (sin, cos) = libm::sincos(half_rad);
    let shrink = if half_rad.abs() < 1e-6 {
        1.0
    } else {
        sin / half_rad
    };
    let chord_m = v * time_s * shrink;
    Increment {
        relative: Pose {
            x_m: chord_m * cos,
            y_m: chord_m * sin,
            heading_rad: 2.0 * half_rad,
        },
        covariance: None,
    }
}

/// Names of the columns of a table of times, first for messages as a whole, then each.
type Columns<const N: usize> = (&'static str, [&'static str; N]);
const ODOMETRY: Columns<2> = (
    "3: time, forward velocity, angular velocity",
    ["forward velocity", "angular velocity"],
);
const POSES: Columns<3> = ("4: time, x, y, orientation", ["x", "y", "orientation"]);

fn table<const N: usize>(
    text: &Text,
    (names, columns): Columns<N>,
) -> Result<Vec<(f64, [f64; N])>, ImportError> {
    let row = |line: Line<'_>| {
        line.expect_fields(&[N + 1], names)?;
        let mut row = [0.0; N];
        for (k, (value, column)) in row.iter_mut().zip(columns).enumerate() {
            *value = line.number(k + 1, column)?;
        }
        Ok((line.number(0, "time")?, row))
    };
    text.lines().map(row).collect()
}

/// Sorted by time, and how many stood before an earlier one; equal times keep their order.
fn in_time<T>(mut rows: Vec<(f64, T)>) -> (Vec<(f64, T)>, usize) {
    let n_unordered = rows.windows(2).filter(|pair| pair[1].0 < pair[0].0).count();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    (rows, n_unordered)
}

/// Subject by barcode.
fn barcodes(text: &Text) -> Result<BTreeMap<i64, i64>, ImportError> {
    let mut subjects = BTreeMap::new();
    for line in text.lines() {
        line.expect_fields(&[2], "2: subject, barcode")?;
        let (subject, barcode) = (line.whole(0, "subject")?, line.whole(1, "barcode")?);
        if subjects
            .insert(barcode, subject)
            .is_some_and(|other| other != subject)
        {
            return Err(line.bad(1, "barcode", "a barcode that no other subject has"));
        }
    }
    Ok(subjects)
}

fn landmarks(text: &Text) -> Result<BTreeMap<i64, [f64; 2]>, ImportError> {
    let mut places_m = BTreeMap::new();
    for line in text.lines() {
        line.expect_fields(&[3, 5], "5: subject, x, y, and their standard deviations")?;
        let place = [line.number(1, "x")?, line.number(2, "y")?];
        if places_m.insert(line.whole(0, "subject")?, place).is_some() {
            return Err(line.bad(0, "subject", "each subject once"));
        }
    }
    Ok(places_m)
}

/// Times, barcodes, and sightings without identity.
fn sightings(text: &Text) -> Result<Vec<(f64, i64, Seen)>, ImportError> {
    let row = |line: Line<'_>| {
        line.expect_fields(&[4], "4: time, barcode, range, bearing")?;
        let range_m = line.number(2, "range")?;
        if range_m <= 0.0 {
            return Err(line.bad(2, "range", "a range above 0 m"));
        }
        let bearing_rad = line.number(3, "bearing")?;
        if bearing_rad.abs() > MAX_ANGLE_RAD {
            return Err(line.bad(3, "bearing", "radians within ±2π"));
        }
        let seen = Seen {
            range_m,
            bearing_rad,
            stated: None,
            landmark: None,
        };
        Ok((line.number(0, "time")?, line.whole(1, "barcode")?, seen))
    };
    text.lines().map(row).collect()
}
