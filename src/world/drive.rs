//! The drive: the believed path, and the true path that drifts away from it.
//!
//! The robot drives the closed route at constant speed and believes to be exactly on it (source
//! report, section 2). Its true pose is the believed one plus a random walk: over d metres x and y
//! each gain N(0, q²·d), the heading N(0, η²·d), with q in m/√m and η in rad/√m. The heading error
//! turns what the robot sees, not where it goes: the report adds noise to the pose, no more.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::geometry::{Point, Segment, sides};
use super::{SimulationSettings, World};
use crate::sighting::{Pose, wrap_rad};

/// Poses at the times of the scans.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drive {
    pub times_s: Vec<f64>,
    pub believed: Vec<Pose>,
    pub true_: Vec<Pose>,
}

/// A closed route, measured from its first waypoint.
pub(super) struct Route {
    legs: Vec<Segment>,
    pub lap_m: f64,
}

impl Route {
    pub fn new(waypoints: &[Point]) -> Self {
        let legs: Vec<Segment> = sides(waypoints).collect();
        let lap_m = legs.iter().map(|leg| leg.length_m()).sum();
        Self { legs, lap_m }
    }

    /// The pose after a distance, laps included, heading along the leg.
    pub fn pose_at(&self, driven_m: f64) -> Pose {
        let mut left_m = driven_m.rem_euclid(self.lap_m);
        let mut legs = self.legs.iter().peekable();
        while let Some(leg) = legs.next() {
            let length_m = leg.length_m();
            // At a waypoint the robot has turned already. Rounding may overshoot the last leg.
            if left_m < length_m || legs.peek().is_none() {
                let share = left_m / length_m;
                let [dx, dy] = [leg.b[0] - leg.a[0], leg.b[1] - leg.a[1]];
                return Pose {
                    x_m: leg.a[0] + share * dx,
                    y_m: leg.a[1] + share * dy,
                    heading_rad: libm::atan2(dy, dx),
                };
            }
            left_m -= length_m;
        }
        unreachable!("a checked world has at least two legs, and the last one returns")
    }
}

/// The number of scans of a drive: one at the start, then one per interval to the end.
pub(super) fn n_scans(world: &World, settings: &SimulationSettings) -> f64 {
    let length_m = Route::new(world.waypoints()).lap_m * settings.laps;
    let n_intervals = length_m / (settings.speed_m_per_s * settings.sighting_interval_s);
    // A drive of a whole number of intervals must not lose its last scan to rounding.
    1.0 + (n_intervals + 1e-9).floor()
}

/// Drives the route.
pub(super) fn drive(world: &World, settings: &SimulationSettings, rng: &mut impl Rng) -> Drive {
    let route = Route::new(world.waypoints());
    let step_m = settings.speed_m_per_s * settings.sighting_interval_s;
    let position_std_m = settings.scaled_odometry_noise() * step_m.sqrt();
    let heading_std_rad = settings.scaled_heading_noise() * step_m.sqrt();
    let mut normal = || -> f64 { StandardNormal.sample(rng) };

    let n = n_scans(world, settings) as usize;
    let mut drive = Drive {
        times_s: vec![],
        believed: vec![],
        true_: vec![],
    };
    let (mut x_error_m, mut y_error_m, mut heading_error_rad) = (0.0, 0.0, 0.0);
    for scan in 0..n {
        if scan > 0 {
            x_error_m += position_std_m * normal();
            y_error_m += position_std_m * normal();
            heading_error_rad += heading_std_rad * normal();
        }
        let believed = route.pose_at(scan as f64 * step_m);
        drive
            .times_s
            .push(scan as f64 * settings.sighting_interval_s);
        drive.believed.push(believed);
        drive.true_.push(Pose {
            x_m: believed.x_m + x_error_m,
            y_m: believed.y_m + y_error_m,
            heading_rad: wrap_rad(believed.heading_rad + heading_error_rad),
        });
    }
    drive
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, WORLD_SEMANTICS};

    fn ring() -> World {
        World::built_in("square-ring").expect("built in")
    }

    #[test]
    fn laps_need_not_be_whole_and_end_where_they_should() {
        let mut rng = Purpose::new(WORLD_SEMANTICS, 1).generator();
        for (laps, end, n) in [
            (0.5, [35.0, 35.0], 141),
            (1.0, [0.0, 0.0], 281),
            (1.25, [35.0, 0.0], 351),
            (2.125, [17.5, 0.0], 596),
        ] {
            let settings = SimulationSettings {
                laps,
                noise: 0.0,
                ..Default::default()
            };
            let drive = drive(&ring(), &settings, &mut rng);
            let last = drive.believed[drive.believed.len() - 1];
            assert_eq!(drive.believed.len(), n, "{laps}");
            assert_eq!(drive.times_s[n - 1], (n - 1) as f64 * 0.5);
            assert!(
                (last.x_m - end[0]).hypot(last.y_m - end[1]) < 1e-9,
                "{laps} {last:?}"
            );
            assert_eq!(drive.believed, drive.true_);
        }
    }

    #[test]
    fn the_robot_looks_along_its_leg() {
        let route = Route::new(ring().waypoints());
        use std::f64::consts::{FRAC_PI_2, PI};
        for (driven_m, heading) in [
            (0.0, 0.0),
            (34.9, 0.0),
            (35.0, FRAC_PI_2),
            (75.0, PI),
            (139.0, -FRAC_PI_2),
            (140.0, 0.0),
        ] {
            assert_eq!(route.pose_at(driven_m).heading_rad, heading, "{driven_m}");
        }
    }

    #[test]
    fn drift_grows_with_the_root_of_the_distance_whatever_the_step() {
        let mut rng = Purpose::new(WORLD_SEMANTICS, 2).generator();
        for sighting_interval_s in [0.5, 5.0] {
            let settings = SimulationSettings {
                noise: 2.0,
                sighting_interval_s,
                ..Default::default()
            };
            let n = 400;
            let (mut x2, mut heading2) = (0.0, 0.0);
            for _ in 0..n {
                let drive = drive(&ring(), &settings, &mut rng);
                let last = drive.believed.len() - 1;
                x2 += (drive.true_[last].x_m - drive.believed[last].x_m).powi(2);
                let error = drive.true_[last].heading_rad - drive.believed[last].heading_rad;
                heading2 += wrap_rad(error).powi(2);
            }
            // 175 m at 0.4 m/√m and 0.004 rad/√m; a mean square of n normals has relative standard
            // deviation √(2/n); four of them.
            let four_std = 4.0 * (2.0 / n as f64).sqrt();
            assert!(
                (x2 / n as f64 / (0.16 * 175.0) - 1.0).abs() < four_std,
                "{x2}"
            );
            assert!(
                (heading2 / n as f64 / (1.6e-5 * 175.0) - 1.0).abs() < four_std,
                "{heading2}"
            );
        }
    }
}
