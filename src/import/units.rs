//! Whether a recording is in seconds, metres and radians, as far as its numbers can tell.
//!
//! Nothing in a table of numbers states its units, so these are tests of what cannot be otherwise:
//! angles beyond 2π, times that no clock shows in seconds, headings that fit the way driven only in
//! degrees. What cannot be is refused, what is unlikely is noted.

use std::f64::consts::TAU;

use super::error::ImportError;
use super::range_bearing::PoseRow;
use super::recording::Recording;
use crate::input::Note;

/// Angles in radians are not larger, but for rounding.
pub(super) const MAX_ANGLE_RAD: f64 = TAU * (1.0 + 1e-6);

/// Seconds since 1970 reach this in the year 5138; milliseconds passed it in 1973.
const MAX_TIME_S: f64 = 1e11;
/// No robot is followed with scans so far apart, s.
const MAX_PERIOD_S: f64 = 1000.0;
/// Scans further apart than this are unusual, s.
const LONG_PERIOD_S: f64 = 5.0;
/// Robots that scan while they move are seldom slower, m/s.
const SLOW_M_PER_S: f64 = 0.02;
/// Nor faster.
const FAST_M_PER_S: f64 = 100.0;
/// From here on a mean of cos 2(direction driven − heading) says that they agree; 1 if always.
const AGREE: f64 = 0.8;
/// Below this they do not.
const DISAGREE: f64 = 0.5;

/// Refuses times and headings in other units, and notes what is unlikely.
pub(super) fn check(rows: &[PoseRow], path: &str) -> Result<Vec<Note>, ImportError> {
    let mut in_time: Vec<&PoseRow> = rows.iter().collect();
    in_time.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let times = check_times(&in_time, path)?;
    let headings = check_headings(&in_time, path)?;
    Ok(times.into_iter().chain(headings).collect())
}

fn check_times(rows: &[&PoseRow], path: &str) -> Result<Option<Note>, ImportError> {
    let pairs = || rows.windows(2).map(|pair| (pair[0], pair[1]));
    let passed = |(a, b): (&PoseRow, &PoseRow)| Some(b.time_s - a.time_s).filter(|s| *s > 0.0);
    let period_s = median(pairs().filter_map(passed).collect());
    let last = rows
        .iter()
        .max_by(|a, b| a.time_s.abs().total_cmp(&b.time_s.abs()));
    let is_far = |row: &&&PoseRow| row.time_s.abs() > MAX_TIME_S;
    let is_slow = period_s.is_some_and(|s| s > MAX_PERIOD_S);
    if let Some(row) = last.filter(|row| is_slow || is_far(row)) {
        let between = period_s.map_or_else(String::new, |s| format!(" and {s} between scans"));
        let guess = match (period_s, row.time_s.abs()) {
            (Some(s), _) if s * 1e-3 <= 10.0 => "milliseconds? divide them by 1e3",
            (Some(s), _) if s * 1e-6 <= 10.0 => "microseconds? divide them by 1e6",
            (Some(_), _) => "nanoseconds? divide them by 1e9",
            (None, time) if time > 1e17 => "nanoseconds? divide them by 1e9",
            (None, time) if time > 1e14 => "microseconds? divide them by 1e6",
            (None, _) => "milliseconds? divide them by 1e3",
        };
        return Err(ImportError::Unit {
            place: format!("{path}, line {}, column t", row.line),
            got: format!("the time {}{between}", row.time_s),
            expected: "seconds",
            guess,
        });
    }
    let speeds = pairs().filter_map(|(a, b)| {
        let way_m = libm::hypot(b.pose.x_m - a.pose.x_m, b.pose.y_m - a.pose.y_m);
        Some(way_m / passed((a, b))?).filter(|speed| *speed > 0.0)
    });
    let (Some(period_s), Some(speed)) = (period_s, median(speeds.collect())) else {
        return Ok(None);
    };
    let seems = format!("{period_s:.3} s between scans and {speed:.2e} m/s");
    Ok(if period_s > LONG_PERIOD_S && speed < SLOW_M_PER_S {
        Some(Note::plain(format!(
            "{seems}: is t in milliseconds, not seconds?"
        )))
    } else if speed > FAST_M_PER_S {
        Some(Note::plain(format!(
            "{seems}: are positions in millimetres, or times in another unit than seconds?"
        )))
    } else {
        None
    })
}

fn check_headings(rows: &[&PoseRow], path: &str) -> Result<Option<Note>, ImportError> {
    let Some(beyond) = rows
        .iter()
        .find(|row| row.pose.heading_rad.abs() > MAX_ANGLE_RAD)
    else {
        return Ok(None);
    };
    // A robot drives along its heading, forwards or backwards: weighted by the way driven.
    let agreement = |unit_rad: f64| {
        let (mut sum, mut all) = (0.0, 0.0);
        for pair in rows.windows(2) {
            let (a, b) = (pair[0].pose, pair[1].pose);
            let (dx, dy) = (b.x_m - a.x_m, b.y_m - a.y_m);
            let (way_m, direction) = (libm::hypot(dx, dy), libm::atan2(dy, dx));
            for heading in [a.heading_rad, b.heading_rad] {
                sum += way_m * libm::cos(2.0 * (direction - unit_rad * heading));
                all += way_m;
            }
        }
        if all > 0.0 { sum / all } else { f64::NAN }
    };
    let (as_radians, as_degrees) = (agreement(1.0), agreement(TAU / 360.0));
    if as_degrees > AGREE && as_radians < DISAGREE {
        return Err(ImportError::Unit {
            place: format!("{path}, line {}, column robot_theta", beyond.line),
            got: format!(
                "the heading {}, where headings fit the way driven only as degrees",
                beyond.pose.heading_rad
            ),
            expected: "radians",
            guess: "degrees? multiply them by π/180",
        });
    }
    // Radians that were not wrapped begin near 0 and never jump.
    let starts_beyond = rows[0].pose.heading_rad.abs() > MAX_ANGLE_RAD;
    let jump = |pair: &[&PoseRow]| (pair[1].pose.heading_rad - pair[0].pose.heading_rad).abs();
    let wraps = rows
        .windows(2)
        .any(|pair| (300.0..=360.0).contains(&jump(pair)));
    let is_doubtful = as_radians.is_nan() || as_radians < AGREE;
    Ok((is_doubtful && (starts_beyond || wraps)).then(|| {
        let (heading, line) = (beyond.pose.heading_rad, beyond.line);
        Note::plain(format!(
            "robot_theta is {heading} on line {line}, beyond 2π: is it in degrees?"
        ))
    }))
}

/// What the errors that a recording states come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// How well the heading against the start is known at the end, rad.
    pub heading_std_rad: f64,
    /// How well the place of a detection is known, m.
    pub precision_m: f64,
    /// How far apart detections lie, m.
    pub extent_m: f64,
}

/// A doubt about a recording that states its errors (an information for each edge), if they are so
/// large that covariances may stand in the place of information.
pub fn information_doubt(recording: &Recording, stated: &Stated) -> Option<String> {
    let increments = recording.stops.iter().map(|stop| &stop.increment);
    let steps: Vec<[f64; 2]> = increments
        .filter_map(|increment| {
            let c = increment.covariance?;
            let way_m = libm::hypot(increment.relative.x_m, increment.relative.y_m);
            Some([way_m, ((c[(0, 0)] + c[(1, 1)]) / 2.0).sqrt()])
        })
        .collect();
    let way_m = median(
        steps
            .iter()
            .map(|step| step[0])
            .filter(|m| *m > 0.0)
            .collect(),
    );
    let std_m = median(steps.iter().map(|step| step[1]).collect())?;
    let is_inverse = way_m.is_some_and(|way_m| std_m > way_m && 1.0 / std_m < way_m);
    let Stated {
        heading_std_rad,
        precision_m,
        extent_m,
    } = *stated;
    let what = if heading_std_rad > TAU / 2.0 {
        format!("the heading is known to {heading_std_rad:.0} rad only, so it is not known at all")
    } else if extent_m > 0.0 && precision_m > extent_m {
        format!("places are known to {precision_m:.1} m and lie within {extent_m:.1} m")
    } else if is_inverse {
        let way_m = way_m.unwrap_or_default();
        format!("a step of {way_m:.2} m is known to {std_m:.2} m only")
    } else {
        return None;
    };
    let question =
        "does the file state covariances where their inverse, the information, is expected?";
    Some(format!("{what}: {question}"))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sighting::Pose;

    /// A round of radius 2 m, with times and headings in some unit.
    fn round(time_unit: f64, period_s: f64, heading_unit: f64) -> Vec<PoseRow> {
        let row = |k: u32| {
            let turned = f64::from(k) * 0.02;
            PoseRow {
                line: u64::from(k) + 2,
                time_s: f64::from(k) * period_s * time_unit,
                pose: Pose {
                    x_m: 2.0 * turned.cos(),
                    y_m: 2.0 * turned.sin(),
                    heading_rad: (turned + TAU / 4.0) * heading_unit,
                },
                seen: None,
            }
        };
        (0..400).map(row).collect()
    }

    fn said(rows: &[PoseRow]) -> String {
        match check(rows, "a.csv") {
            Ok(notes) => notes.iter().map(|note| note.to_string()).collect(),
            Err(error) => format!("refused: {error}"),
        }
    }

    #[test]
    fn seconds_and_radians_are_nothing_to_speak_of_wrapped_or_not() {
        assert_eq!(said(&round(1.0, 0.1, 1.0)), "");
        let mut wrapped = round(1.0, 0.1, 1.0);
        for row in &mut wrapped {
            row.pose.heading_rad = row.pose.heading_rad.rem_euclid(TAU);
            row.time_s += 1.7e9;
        }
        assert_eq!(said(&wrapped), "");
        assert_eq!(said(&[]), "");
    }

    #[test]
    fn times_in_other_units_are_refused_or_noted() {
        for (unit, word) in [(1e3, "milli"), (1e6, "micro"), (1e9, "nano")] {
            let since_1970: Vec<PoseRow> = round(unit, 0.1, 1.0)
                .into_iter()
                .map(|row| PoseRow {
                    time_s: row.time_s + 1.7e9 * unit,
                    ..row
                })
                .collect();
            assert!(
                said(&since_1970).contains(&format!("{word}seconds? divide")),
                "{unit}"
            );
            assert!(said(&since_1970).starts_with("refused: a.csv, line 401, column t: got"));
            let said = said(&round(unit, 0.1, 1.0));
            assert!(said.contains(&format!("{word}seconds")), "{said}");
        }
        let mut far = round(1.0, 0.1, 1.0);
        far.iter_mut().for_each(|row| {
            row.pose.x_m *= 1e3;
            row.pose.y_m *= 1e3;
        });
        assert!(said(&far).contains("millimetres"));
    }

    #[test]
    fn headings_in_degrees_are_refused_or_noted() {
        let degrees = round(1.0, 0.1, 360.0 / TAU);
        assert_eq!(
            said(&degrees),
            "refused: a.csv, line 2, column robot_theta: got the heading 90, where headings fit \
             the way driven only as degrees, expected radians; is it in degrees? multiply them by π/180"
        );
        let mut still = degrees.clone();
        still
            .iter_mut()
            .for_each(|row| (row.pose.x_m, row.pose.y_m) = (0.0, 0.0));
        assert!(said(&still).contains("beyond 2π: is it in degrees?"));
    }
}
