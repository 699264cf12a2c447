//! What a recording knows of where things were: for checks only, never for a tracker or a sampler.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::ImportError;
use crate::input::{Column, Layout, MAX_LINES, Source, Table};
use crate::sighting::Pose;

/// True poses further apart than this in time are not drawn a line between, s.
const MAX_GAP_S: f64 = 0.5;

/// True places, in a frame of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Landmarks, m.
    pub landmarks_m: BTreeMap<i64, [f64; 2]>,
    /// Times (s, growing) and poses of the robot.
    pub poses: Vec<(f64, Pose)>,
}

impl Truth {
    /// The true pose at a time (s), between the two nearest; `None` where none is near.
    pub fn pose_at(&self, time_s: f64) -> Option<Pose> {
        let after = self.poses.partition_point(|(time, _)| *time < time_s);
        let (after_s, b) = *self.poses.get(after)?;
        if after_s == time_s {
            return Some(b);
        }
        let (before_s, a) = *self.poses.get(after.checked_sub(1)?)?;
        let gap_s = after_s - before_s;
        if gap_s > MAX_GAP_S {
            return None;
        }
        let share = (time_s - before_s) / gap_s;
        let step = a.to(b);
        let turned = a.then(Pose {
            heading_rad: share * step.heading_rad,
            ..super::recording::ORIGIN
        });
        Some(Pose {
            x_m: a.x_m + share * (b.x_m - a.x_m),
            y_m: a.y_m + share * (b.y_m - a.y_m),
            heading_rad: turned.heading_rad,
        })
    }

    /// Where the landmarks truly lie in the frame of a path that was at `believed` at a time (s):
    /// what dead reckoning without error from there would find. `None` if the true pose is unknown.
    pub fn landmarks_in_frame_m(
        &self,
        time_s: f64,
        believed: Pose,
    ) -> Option<BTreeMap<i64, [f64; 2]>> {
        let pose = self.pose_at(time_s)?;
        let place = |point_m: &[f64; 2]| {
            let (range_m, bearing_rad) = pose.range_and_bearing_to(*point_m);
            believed.point_at_m(range_m, bearing_rad)
        };
        let landmarks = self.landmarks_m.iter();
        Some(landmarks.map(|(id, point)| (*id, place(point))).collect())
    }
}

const LAYOUT: Layout = Layout {
    rows: "true poses",
    columns: &[
        Column::required("gt_x", "m"),
        Column::required("gt_y", "m"),
        Column::required("gt_theta", "rad"),
        Column::required("lm_x", "m"),
        Column::required("lm_y", "m"),
    ],
    max_rows: MAX_LINES as usize,
};

/// Reads the truth that goes with a range-bearing CSV: a CSV of the same rows, with the columns
/// `gt_x,gt_y,gt_theta` (true pose; m, rad) and `lm_x,lm_y` (true place of what was seen, m; nothing or
/// nan for clutter). `rows` are the time (s) and landmark of each row of the recording.
///
/// # Errors
/// A file that cannot be read, lacks a column, holds what is no number, or has other rows.
pub fn read_truth(path: &Path, rows: &[(f64, Option<i64>)]) -> Result<Truth, ImportError> {
    parse_truth(Source::open(path)?, rows)
}

pub(super) fn parse_truth(
    source: Source<'_>,
    rows: &[(f64, Option<i64>)],
) -> Result<Truth, ImportError> {
    let path = source.path().display().to_string();
    let mut table = Table::new(source, LAYOUT)?;
    let mut truth = Truth::default();
    let mut n_rows = 0;
    while let Some(mut row) = table.next_row()? {
        if let Some((time_s, landmark)) = rows.get(n_rows) {
            let pose = Pose {
                x_m: row.number(0)?,
                y_m: row.number(1)?,
                heading_rad: row.number(2)?,
            };
            truth.poses.push((*time_s, pose));
            if let Some(landmark) = landmark
                && !row.is_missing(3)
            {
                let place = [row.number(3)?, row.number(4)?];
                truth.landmarks_m.insert(*landmark, place);
            }
        }
        n_rows += 1;
    }
    if n_rows != rows.len() {
        return Err(ImportError::Disagrees {
            place: path,
            got: format!("{n_rows} rows"),
            expected: format!("{} as in the recording", rows.len()),
            change: "give the truth of this recording",
        });
    }
    truth.poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(truth)
}
