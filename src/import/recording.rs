//! A recording: one stream of stops, whatever format it came from.
//!
//! A stop is an instant at which something was seen or the odometry spoke; between two stops lies an
//! increment. Poses follow by chaining the increments from the first pose.

use nalgebra::Matrix3;

use super::truth::Truth;
use crate::input::Note;
use crate::sighting::Pose;

/// How the robot moved between two stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Increment {
    /// The pose of the stop as seen from the one before (m, rad).
    pub relative: Pose,
    /// Covariance of its error (x, y, heading; m², m·rad, rad²) in the axes of the stop, if the
    /// recording states it.
    pub covariance: Option<Matrix3<f64>>,
}

impl Increment {
    /// Of a robot that stood still.
    pub const NONE: Self = Self {
        relative: ORIGIN,
        covariance: None,
    };
}

/// The pose that frames start from where the recording names none.
pub(super) const ORIGIN: Pose = Pose {
    x_m: 0.0,
    y_m: 0.0,
    heading_rad: 0.0,
};

/// One sighting, relative to the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Distance, m.
    pub range_m: f64,
    /// Direction, rad, counter-clockwise from ahead.
    pub bearing_rad: f64,
    /// Standard deviations of range (m) and bearing (rad) and their correlation, if stated.
    pub stated: Option<[f64; 3]>,
    /// The landmark truly seen, where the recording knows it.
    pub landmark: Option<i64>,
}

/// An instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// When, s.
    pub time_s: f64,
    /// How the robot came here from the stop before.
    pub increment: Increment,
    /// What it saw here.
    pub seen: Vec<Seen>,
}

/// What a reader gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where the robot believed to be at the first stop.
    pub start: Pose,
    /// In order of time.
    pub stops: Vec<Stop>,
    /// What is known of where things were.
    pub truth: Option<Truth>,
    /// The name of each landmark from 0 on; empty if the recording numbers them.
    pub landmark_names: Vec<String>,
    /// What was left out or put up with.
    pub notes: Vec<Note>,
}

impl Recording {
    /// All sightings in it.
    pub fn n_seen(&self) -> usize {
        self.stops.iter().map(|stop| stop.seen.len()).sum()
    }

    /// Keeps the stops from one time (s) on and before another. Dead reckoning then starts at the
    /// first that is kept, from where it had got to.
    pub fn keep_window(&mut self, from_s: f64, until_s: f64) {
        let mut pose = self.start;
        let mut n_before = 0;
        for (ix, stop) in self.stops.iter().enumerate() {
            if ix > 0 {
                pose = pose.then(stop.increment.relative);
            }
            if stop.time_s >= from_s {
                self.start = pose;
                break;
            }
            n_before += 1;
        }
        self.stops.drain(..n_before);
        let end = self.stops.partition_point(|stop| stop.time_s < until_s);
        self.stops.truncate(end);
        if let Some(first) = self.stops.first_mut() {
            first.increment = Increment::NONE;
        }
    }

    /// Keeps the sightings of every `n`-th of the stops that have any, the first among them, and of
    /// those the ones within a distance (m). The odometry stays whole. With `n` = 0 as with 1.
    pub fn thin(&mut self, n: usize, max_range_m: f64) {
        let with_seen = self.stops.iter_mut().filter(|stop| !stop.seen.is_empty());
        for (ix, stop) in with_seen.enumerate() {
            if ix % n.max(1) == 0 {
                stop.seen.retain(|seen| seen.range_m <= max_range_m);
            } else {
                stop.seen.clear();
            }
        }
    }
}

/// Counts by what was counted; those of nothing are left out.
pub(super) fn notes(counts: impl IntoIterator<Item = (usize, String)>) -> Vec<Note> {
    let counted = counts.into_iter().filter(|(count, _)| *count > 0);
    let note = |(count, what)| Note {
        count: Some(count),
        what,
    };
    counted.map(note).collect()
}
