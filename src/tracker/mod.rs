//! Sorts raw sightings into coherent groups, each of which becomes one detection.
//!
//! Scan by scan (a scan is all sightings of one instant), a sighting joins the nearest open group
//! whose gate it passes, νᵀS⁻¹ν ≤ −2·ln(1−p), the p-quantile of chi-square with 2 degrees of
//! freedom; else it opens a group of its own. At most one sighting of a scan joins a group: pairs
//! are taken by growing distance. A group not seen for `group_timeout_s` is closed, so a later
//! visit starts a new one. After the source report, section 2; the filter is in `group`.
//!
//! Two things the report does not say. Groups with at least `min_sightings` sightings choose before
//! younger ones (confirmed before tentative tracks, Blackman and Popoli 1999): otherwise every
//! outlier opens a wide group beside the sharp one, which then steals its sightings. And groups
//! that never reach `min_sightings` are dropped as false.
//!
//! The gate is exact only for the linearised filter. A true sighting outside the gate opens a group;
//! within the first `min_sightings` scans, before its elder is confirmed, such a group may survive,
//! so a corner can be detected twice at once (1 of 660 missions in the square ring at p = 0.999).
//!
//! Limits: the frame's drift is followed, not removed, so a detection is where the landmark was in
//! the believed frame *when last seen*; and two landmarks closer than their gates share groups. With
//! [`TrackerSettings::since_start`] a covariance is against the frame of the start; the errors of two
//! detections then have the drift up to the earlier one in common, which no covariance of one says.

mod group;
#[cfg(test)]
mod tests;

use crate::detections::{Detections, DetectionsError};
use crate::sighting::{FrameDrift, Sighting};

use group::Group;
pub use group::{MIN_BEARING_STD_RAD, MIN_RANGE_STD_M, MIN_VARIANCE_M2};

/// How sightings are sorted.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerSettings {
    /// p of the gate: a sighting of the group's own landmark passes with this probability.
    pub gate_probability: f64,
    /// A group not seen for longer is closed, s.
    pub group_timeout_s: f64,
    /// Groups with fewer sightings are dropped.
    pub min_sightings: usize,
    /// Random walk of the believed position against the true one, m per √m driven.
    pub odometry_noise: f64,
    /// Random walk of the believed heading against the true one, rad per √m driven.
    pub heading_noise: f64,
    /// Whether a detection's covariance holds the drift of the frame since the start of the mission,
    /// where the sightings keep account of it; else it holds what has come since the first sighting.
    pub since_start: bool,
}

/// Why sightings gave no detections.
#[derive(Debug, thiserror::Error)]
pub enum TrackerError {
    /// Not a single group was kept.
    #[error(
        "tracker: got no group of at least {min_sightings} sightings out of {n_sightings} sightings, \
         expected at least one; lower min_sightings, or raise max_range or laps"
    )]
    NothingKept {
        /// The threshold in force.
        min_sightings: usize,
        /// All sightings there were.
        n_sightings: usize,
    },
    /// A sighting holds a value that is not finite.
    #[error(
        "tracker, sighting {number}: got {value} as its {what}, expected a finite number; correct the recording"
    )]
    NotFinite {
        /// The sighting, from 1.
        number: usize,
        /// Which of its values.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// A group came out impossible as a detection.
    #[error(transparent)]
    Detections(#[from] DetectionsError),
}

/// The squared Mahalanobis distance that a sighting of the group's own landmark keeps with
/// probability p: the quantile of chi-square with 2 degrees of freedom is −2·ln(1−p).
pub fn gate_squared_distance(gate_probability: f64) -> f64 {
    -2.0 * libm::log1p(-gate_probability)
}

/// Detections, and what else is known of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// In the order in which they were first seen.
    pub detections: Detections,
    /// The drift since the start of the mission that the place of each has; `None` if sightings keep no account of it.
    pub drifts: Option<Vec<FrameDrift>>,
    /// The detection that each sighting became part of; `None` where its group was dropped.
    pub detection_of: Vec<Option<usize>>,
}

/// Turns sightings into detections, in the order in which they were first seen.
///
/// Sightings may come in any order of time; those of one instant share one believed pose.
pub fn track(
    sightings: &[Sighting],
    settings: &TrackerSettings,
) -> Result<Detections, TrackerError> {
    track_in_full(sightings, settings).map(|tracked| tracked.detections)
}

/// As [`track`], and says how far the frame had drifted and what became of each sighting.
pub fn track_in_full(
    sightings: &[Sighting],
    settings: &TrackerSettings,
) -> Result<Tracked, TrackerError> {
    check(sightings)?;
    let mut order: Vec<usize> = (0..sightings.len()).collect();
    order.sort_by(|&a, &b| sightings[a].time_s.total_cmp(&sightings[b].time_s));
    let in_time: Vec<&Sighting> = order.iter().map(|&ix| &sightings[ix]).collect();
    let mut tracker = Tracker::new(settings);
    let mut group_of = Vec::with_capacity(sightings.len());
    for scan in in_time.chunk_by(|a, b| a.time_s == b.time_s) {
        group_of.extend(tracker.step(scan));
    }
    let is_kept = |group: &Group| group.n_sightings >= settings.min_sightings;
    // Groups are opened in order of time, so their order is that of first sighting.
    let mut n_kept = 0;
    let numbers = tracker.groups.iter().map(|group| {
        is_kept(group).then(|| {
            n_kept += 1;
            n_kept - 1
        })
    });
    let numbers: Vec<Option<usize>> = numbers.collect();
    let mut detection_of = vec![None; sightings.len()];
    for (ix, group_ix) in order.into_iter().zip(group_of) {
        detection_of[ix] = numbers[group_ix];
    }
    let groups: Vec<Group> = tracker.groups.into_iter().filter(is_kept).collect();
    if groups.is_empty() {
        let min_sightings = settings.min_sightings;
        return Err(TrackerError::NothingKept {
            min_sightings,
            n_sightings: sightings.len(),
        });
    }
    let frame_at = |group: &Group| {
        let random = drift_at(&in_time, group.frame_time_s)?.random;
        let steady = drift_at(&in_time, group.mean_seen_s)?.steady;
        Some(FrameDrift { random, steady })
    };
    let drifts = groups.iter().map(frame_at).collect();
    let rows = groups
        .into_iter()
        .map(|group| group.into_detection(settings.since_start))
        .collect();
    Ok(Tracked {
        detections: Detections::new(rows)?,
        drifts,
        detection_of,
    })
}

fn check(sightings: &[Sighting]) -> Result<(), TrackerError> {
    for (ix, sighting) in sightings.iter().enumerate() {
        let values = [
            ("time", sighting.time_s),
            ("x", sighting.believed_pose.x_m),
            ("y", sighting.believed_pose.y_m),
            ("heading", sighting.believed_pose.heading_rad),
            ("range", sighting.range_m),
            ("bearing", sighting.bearing_rad),
            ("range std", sighting.range_std_m),
            ("bearing std", sighting.bearing_std_rad),
            ("correlation", sighting.correlation),
            (
                "drift",
                match sighting.drift {
                    Some(drift) if !drift.is_finite() => f64::NAN,
                    _ => 0.0,
                },
            ),
        ];
        if let Some((what, value)) = values.into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(TrackerError::NotFinite {
                number: ix + 1,
                what,
                value,
            });
        }
    }
    Ok(())
}

struct Tracker<'a> {
    settings: &'a TrackerSettings,
    max_squared_distance: f64,
    odometer_m: f64,
    last_position_m: Option<[f64; 2]>,
    /// Groups in the order in which they were opened.
    groups: Vec<Group>,
    /// Indices into `groups`.
    open: Vec<usize>,
}

impl<'a> Tracker<'a> {
    fn new(settings: &'a TrackerSettings) -> Self {
        Self {
            settings,
            max_squared_distance: gate_squared_distance(settings.gate_probability),
            odometer_m: 0.0,
            last_position_m: None,
            groups: Vec::new(),
            open: Vec::new(),
        }
    }

    /// Sorts the sightings of one instant; gives the group of each.
    fn step(&mut self, scan: &[&Sighting]) -> Vec<usize> {
        let time_s = scan[0].time_s;
        let position_m = scan[0].believed_pose.position_m();
        if let Some([x_m, y_m]) = self.last_position_m.replace(position_m) {
            self.odometer_m += libm::hypot(position_m[0] - x_m, position_m[1] - y_m);
        }
        let timeout_s = self.settings.group_timeout_s;
        self.open
            .retain(|ix| time_s - self.groups[*ix].last_seen_s <= timeout_s);

        let mut group_of = vec![None; scan.len()];
        let mut is_updated = vec![false; self.open.len()];
        for (open_ix, scan_ix, innovation) in self.pairs_within_gate(scan) {
            if group_of[scan_ix].is_none() && !is_updated[open_ix] {
                let group_ix = self.open[open_ix];
                (group_of[scan_ix], is_updated[open_ix]) = (Some(group_ix), true);
                self.groups[group_ix].update(scan[scan_ix], &innovation, self.odometer_m);
            }
        }
        let groups = scan.iter().zip(group_of).map(|(sighting, group_ix)| {
            group_ix.unwrap_or_else(|| {
                self.open.push(self.groups.len());
                self.groups.push(Group::open(sighting, self.odometer_m));
                self.groups.len() - 1
            })
        });
        groups.collect()
    }

    /// (place in `open`, place in the scan, innovation), confirmed groups first, then by distance.
    fn pairs_within_gate(&self, scan: &[&Sighting]) -> Vec<(usize, usize, group::Innovation)> {
        let mut pairs = Vec::new();
        for (open_ix, group_ix) in self.open.iter().enumerate() {
            let group = &self.groups[*group_ix];
            for (scan_ix, sighting) in scan.iter().enumerate() {
                let innovation = group.innovation(sighting, self.odometer_m, self.settings);
                if let Some(innovation) =
                    innovation.filter(|i| i.squared_distance <= self.max_squared_distance)
                {
                    pairs.push((open_ix, scan_ix, innovation));
                }
            }
        }
        let is_tentative = |open_ix: usize| {
            self.groups[self.open[open_ix]].n_sightings < self.settings.min_sightings
        };
        // The sort is stable: ties go to the older group, then to the earlier sighting.
        pairs.sort_by(|(a_ix, _, a), (b_ix, _, b)| {
            is_tentative(*a_ix)
                .cmp(&is_tentative(*b_ix))
                .then(a.squared_distance.total_cmp(&b.squared_distance))
        });
        pairs
    }
}

/// The drift at a time (s), between those of the sightings around it.
fn drift_at(in_time: &[&Sighting], time_s: f64) -> Option<FrameDrift> {
    let next = in_time.partition_point(|sighting| sighting.time_s < time_s);
    let Some(after) = in_time.get(next) else {
        return in_time.last()?.drift;
    };
    let Some(before) = next.checked_sub(1).and_then(|last| in_time.get(last)) else {
        return after.drift;
    };
    let share = (time_s - before.time_s) / (after.time_s - before.time_s);
    Some(before.drift?.towards(after.drift?, share))
}
