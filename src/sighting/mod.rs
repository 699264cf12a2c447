//! Raw sightings: what a detector says it saw from where the robot believed to be.
//!
//! The common ground of simulated worlds and imported recordings; the tracker turns them into
//! detections. A sighting at pose (x, y, θ) with range r and bearing β lies at
//! (x + r·cos(θ+β), y + r·sin(θ+β)) in the frame of the believed path.

mod drift;

use std::f64::consts::{PI, TAU};

use crate::detections::Corner;
pub use drift::{FrameDrift, shift_by_twist};

/// A pose in the plane.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Heading, rad, counter-clockwise from east.
    pub heading_rad: f64,
}

impl Pose {
    /// The place of the pose, m.
    pub fn position_m(self) -> [f64; 2] {
        [self.x_m, self.y_m]
    }

    /// The point at a range and a bearing from here, m.
    pub fn point_at_m(self, range_m: f64, bearing_rad: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.heading_rad + bearing_rad);
        [self.x_m + range_m * cos, self.y_m + range_m * sin]
    }

    /// The pose that lies `relative` from here, in the axes of this one.
    pub fn then(self, relative: Self) -> Self {
        let (sin, cos) = libm::sincos(self.heading_rad);
        Self {
            x_m: self.x_m + cos * relative.x_m - sin * relative.y_m,
            y_m: self.y_m + sin * relative.x_m + cos * relative.y_m,
            heading_rad: wrap_rad(self.heading_rad + relative.heading_rad),
        }
    }

    /// The other pose as seen from here: `a.then(a.to(b))` is b.
    pub fn to(self, other: Self) -> Self {
        let (sin, cos) = libm::sincos(self.heading_rad);
        let (dx, dy) = (other.x_m - self.x_m, other.y_m - self.y_m);
        Self {
            x_m: cos * dx + sin * dy,
            y_m: cos * dy - sin * dx,
            heading_rad: wrap_rad(other.heading_rad - self.heading_rad),
        }
    }

    /// Range (m) and bearing (rad, in (−π, π]) of a point.
    pub fn range_and_bearing_to(self, point_m: [f64; 2]) -> (f64, f64) {
        let (dx, dy) = (point_m[0] - self.x_m, point_m[1] - self.y_m);
        (
            libm::hypot(dx, dy),
            wrap_rad(libm::atan2(dy, dx) - self.heading_rad),
        )
    }
}

/// One sighting of what looked like a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// When, s. Sightings of the same instant are one scan.
    pub time_s: f64,
    /// Where the robot believed to be.
    pub believed_pose: Pose,
    /// Distance to what was seen, m.
    pub range_m: f64,
    /// Its direction relative to the heading, rad, counter-clockwise.
    pub bearing_rad: f64,
    /// Standard deviation of the range as the detector states it, m.
    pub range_std_m: f64,
    /// Standard deviation of the bearing as the detector states it, rad.
    pub bearing_std_rad: f64,
    /// Correlation of the two errors, in (−1, 1).
    pub correlation: f64,
    /// How unsure the frame of the believed path has become by now; `None` if whoever made the
    /// sighting keeps no account of it, as simulated worlds, whose drift is the tracker's settings.
    pub drift: Option<FrameDrift>,
    /// What the corner looked like.
    pub corner: Option<Corner>,
    /// The landmark truly seen; `None` if unknown or a false sighting. Never read by the tracker
    /// but to carry it through.
    pub landmark: Option<i64>,
}

impl Sighting {
    /// Where it lies in the frame of the believed path, m.
    pub fn point_m(&self) -> [f64; 2] {
        self.believed_pose
            .point_at_m(self.range_m, self.bearing_rad)
    }
}

/// The same angle in (−π, π], rad.
pub fn wrap_rad(angle_rad: f64) -> f64 {
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_found_again_at_its_range_and_bearing() {
        let pose = Pose {
            x_m: 1.0,
            y_m: -2.0,
            heading_rad: 3.0,
        };
        let point = [-4.0, 7.5];
        let (range_m, bearing_rad) = pose.range_and_bearing_to(point);
        let again = pose.point_at_m(range_m, bearing_rad);
        assert!((again[0] - point[0]).abs() < 1e-12 && (again[1] - point[1]).abs() < 1e-12);
    }

    #[test]
    fn poses_chain_and_unchain() {
        let pose = |x_m, y_m, heading_rad| Pose {
            x_m,
            y_m,
            heading_rad,
        };
        let quarter = pose(1.0, 2.0, PI / 2.0).then(pose(3.0, 1.0, PI));
        assert!((quarter.x_m - 0.0).abs() < 1e-12 && (quarter.y_m - 5.0).abs() < 1e-12);
        assert!((quarter.heading_rad + PI / 2.0).abs() < 1e-12);
        let (a, b) = (pose(1.0, -2.0, 3.0), pose(-4.0, 0.5, -2.5));
        let again = a.then(a.to(b));
        assert!((again.x_m - b.x_m).abs() + (again.y_m - b.y_m).abs() < 1e-12);
        assert!((again.heading_rad - b.heading_rad).abs() < 1e-12);
    }

    #[test]
    fn angles_wrap_to_the_half_open_turn() {
        for (angle, expected) in [(3.5 * PI, -0.5 * PI), (-PI, PI), (PI, PI), (-0.25, -0.25)] {
            assert!((wrap_rad(angle) - expected).abs() < 1e-12, "{angle}");
        }
    }
}
