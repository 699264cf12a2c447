//! Dead reckoning: a recording into sightings, with account of how unsure their frame is.
//!
//! Increments that state no covariance get one from what odometry of this kind is worth, as random
//! walks, so that it does not matter into how many increments a way is cut: over d metres and t
//! radians (turned either way) x and y each gain N(0, q²·d), the heading N(0, η²·d + τ²·t), and,
//! once for the mission, b ~ N(0, 1), the heading β·d·b. The first two are the velocity motion model
//! (Thrun, Burgard & Fox, Probabilistic Robotics, 2005, §5.3) with variances that grow with the way
//! and not with its square per step; β is the part that a random walk cannot have: a robot whose
//! wheels differ keeps bending the same way. Errors turn about the middle of an increment.

use nalgebra::{Matrix3, Vector3};

use super::recording::{Increment, ORIGIN, Recording, Seen};
use crate::sighting::{FrameDrift, Pose, Sighting, wrap_rad};

/// What a sensor's sightings are worth where the recording does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of a range at distance 0, m.
    pub range_m: f64,
    /// Its growth with distance, m per m.
    pub range_growth: f64,
    /// Standard deviation of a bearing, rad.
    pub bearing_rad: f64,
}

/// What odometry is worth where the recording does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftNoise {
    /// q: random walk of the position, m per √m driven.
    pub position: f64,
    /// η: random walk of the heading, rad per √m driven.
    pub heading: f64,
    /// τ: random walk of the heading, rad per √rad turned.
    pub turn: f64,
    /// β: standard deviation of a steady bend, rad per m driven.
    pub bend: f64,
}

/// Both, and a factor on every standard deviation, stated ones too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Of sightings.
    pub sensor: SensorNoise,
    /// Of increments.
    pub drift: DriftNoise,
    /// Multiplies all of them.
    pub factor: f64,
}

impl Noise {
    /// Covariance of the error of an increment (x, y, heading; m², m·rad, rad²) in the axes of the
    /// stop where it ends. The steady bend counts as a random walk with the same variance over 1 m.
    pub fn increment_covariance(&self, increment: &Increment) -> Matrix3<f64> {
        let relative = increment.relative;
        let (mut noise, _, middle) = self.of_increment(increment, ORIGIN, relative);
        if increment.covariance.is_some() {
            return noise;
        }
        let driven_m = libm::hypot(relative.x_m, relative.y_m);
        noise[(2, 2)] += (self.factor * self.drift.bend).powi(2) * driven_m;
        let arm = relative.to(middle);
        let (sin, cos) = libm::sincos(arm.heading_rad);
        let carried = Matrix3::new(cos, -sin, arm.y_m, sin, cos, -arm.x_m, 0.0, 0.0, 1.0);
        carried * noise * carried.transpose()
    }

    /// Standard deviations of a sighting's range (m) and bearing (rad), and their correlation.
    pub fn of_sighting(&self, seen: &Seen) -> [f64; 3] {
        let sensor = self.sensor;
        let [range_std_m, bearing_std_rad, correlation] = seen.stated.unwrap_or([
            sensor.range_m + sensor.range_growth * seen.range_m,
            sensor.bearing_rad,
            0.0,
        ]);
        [
            self.factor * range_std_m,
            self.factor * bearing_std_rad,
            correlation,
        ]
    }

    /// Covariance of an increment and its mean per unit of the steady error, and the pose they turn
    /// about.
    fn of_increment(
        &self,
        increment: &Increment,
        before: Pose,
        after: Pose,
    ) -> (Matrix3<f64>, Vector3<f64>, Pose) {
        if let Some(covariance) = increment.covariance {
            return (covariance * self.factor.powi(2), Vector3::zeros(), after);
        }
        let relative = increment.relative;
        let driven_m = libm::hypot(relative.x_m, relative.y_m);
        let turned_rad = relative.heading_rad.abs();
        let position_m2 = (self.factor * self.drift.position).powi(2) * driven_m;
        let heading_rad2 = (self.factor * self.drift.heading).powi(2) * driven_m
            + (self.factor * self.drift.turn).powi(2) * turned_rad;
        let noise = Matrix3::from_diagonal(&Vector3::new(position_m2, position_m2, heading_rad2));
        let steady = Vector3::new(0.0, 0.0, self.factor * self.drift.bend * driven_m);
        let middle = before.then(Pose {
            x_m: relative.x_m / 2.0,
            y_m: relative.y_m / 2.0,
            heading_rad: relative.heading_rad / 2.0,
        });
        (noise, steady, middle)
    }
}

/// The sightings of a recording, in its order, each from where the robot then believed to be.
pub fn dead_reckon(recording: &Recording, noise: &Noise) -> Vec<Sighting> {
    let mut sightings = Vec::with_capacity(recording.n_seen());
    let (mut pose, mut drift) = (recording.start, FrameDrift::NONE);
    for (ix, stop) in recording.stops.iter().enumerate() {
        if ix > 0 {
            let before = pose;
            pose = before.then(stop.increment.relative);
            let (random, steady, pivot) = noise.of_increment(&stop.increment, before, pose);
            drift = drift.after(pivot, &random, &steady);
        }
        for seen in &stop.seen {
            let [range_std_m, bearing_std_rad, correlation] = noise.of_sighting(seen);
            sightings.push(Sighting {
                time_s: stop.time_s,
                believed_pose: pose,
                range_m: seen.range_m,
                bearing_rad: wrap_rad(seen.bearing_rad),
                range_std_m,
                bearing_std_rad,
                correlation,
                drift: Some(drift),
                corner: None,
                landmark: seen.landmark,
            });
        }
    }
    sightings
}
