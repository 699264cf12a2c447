//! One open group of sightings, filtered by an extended Kalman filter.
//!
//! State: the landmark's position m (2, m) and covariance P (2×2, m²) in the frame of the believed
//! path. Measurement: range and bearing, h(m) = (|m−p|, atan2(m−p) − θ), linearised at the
//! predicted mean, with R = diag(σ_r², σ_β²). To first order this is the same filter, and the same
//! gate, as one on the converted sighting with covariance J·R·Jᵀ; the polar form does not need the
//! noisy bearing to turn R. The first sighting is converted: m = p + r·(cos, sin), P = J·R·Jᵀ.
//!
//! Drift: the landmark stands still but the frame does not, so between two updates P grows by
//! q²·d·I + η²·d·ρ²·n·nᵀ, with q the odometry noise (m/√m), η the heading noise (rad/√m), d the
//! distance driven (m), ρ the distance of the group (m) and n the unit vector across the line of
//! sight. What is left out: a heading error that has already accumulated also shifts the group
//! *systematically* while the robot moves on; at the default noise that shift is well below the
//! random one.
//!
//! Where the sightings keep account of the drift ([`FrameDrift`]), that takes the place of q and η:
//! there a heading error turns the path too, so the frame moves as one and nothing is left out. The
//! error e = m − a against the apparent place a then has companions: with b ~ N(0, 1) the frame's
//! steady error and d = a − (true place) its drift so far, c = Cov(e, b) and C = Cov(e, d). While a
//! moves by w + g·b, w ~ N(0, Q):
//!
//! P ← P + Q + ggᵀ − cgᵀ − gcᵀ,  c ← c − g,  C ← C + cgᵀ − Q − g·Cov(b, d) − ggᵀ
//!
//! and an update multiplies c and C by I − KH. Against the frame of the start a group is off by
//! e + d, of covariance P + C + Cᵀ + Cov(d): a group seen while the frame drifts is the mean of where
//! the landmark seemed to be, and so nearer to the truth than its last sighting.
//!
//! What of e + d is drift is said by two times. With the sightings' weights w in the mean, its variance is that of
//! the random drift at τ, Σ wₖwₗ·min(tₖ, tₗ), and the steady bend has gone as far as at μ = Σ wₖtₖ, if both grow evenly
//! while the group is seen. (A later group has the drift at μ in common with it; τ says a little less, and is never more than
//! there is.) A gain g makes w of it, so that μ ← (1−g)μ + g·t and τ ← (1−g)²τ + 2g(1−g)μ + g²t.

use nalgebra::{Matrix2, Vector2};

use crate::detections::{Corner, Covariance, Detection};
use crate::sighting::{FrameDrift, Pose, Sighting, wrap_rad};
use crate::tracker::TrackerSettings;

/// Stated standard deviations below these are raised to them: a perfect detector would make the
/// innovation covariance singular. 5 cm and 0.1° are finer than any corner detector we know of.
pub const MIN_RANGE_STD_M: f64 = 0.05;
/// See [`MIN_RANGE_STD_M`].
pub const MIN_BEARING_STD_RAD: f64 = 0.002;
/// No detection claims to be surer than 5 cm: the smallest eigenvalue of its covariance, m².
pub const MIN_VARIANCE_M2: f64 = 0.0025;
/// The direction to a group this near is undefined, m.
const MIN_RANGE_M: f64 = 1e-6;

/// A sighting against a group's prediction.
#[derive(Clone, Debug)]
pub(crate) struct Innovation {
    residual: Vector2<f64>,
    jacobian: Matrix2<f64>,
    noise: Matrix2<f64>,
    predicted: Uncertainty,
    inverse: Matrix2<f64>,
    /// νᵀS⁻¹ν: chi-square with 2 degrees of freedom if the sighting belongs to the group.
    pub(crate) squared_distance: f64,
}

/// What is known of the error e of a group's mean, see above.
#[derive(Clone, Copy, Debug)]
struct Uncertainty {
    /// P = Cov(e), m².
    covariance_m2: Matrix2<f64>,
    /// c = Cov(e, b), m.
    with_steady_m: Vector2<f64>,
    /// C = Cov(e, d), m².
    with_drift_m2: Matrix2<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub(crate) mean_m: Vector2<f64>,
    uncertainty: Uncertainty,
    /// Of the frame when last updated.
    drift: Option<FrameDrift>,
    pub(crate) first_seen_s: f64,
    pub(crate) last_seen_s: f64,
    /// μ, s.
    pub(crate) mean_seen_s: f64,
    /// τ, s.
    pub(crate) frame_time_s: f64,
    pub(crate) n_sightings: usize,
    /// Distance driven when last updated, m.
    odometer_m: f64,
    /// Sightings that looked open and closed.
    n_corners: [usize; 2],
    /// True landmarks among the sightings, with their numbers.
    landmarks: Vec<(i64, usize)>,
}

impl Group {
    pub(crate) fn open(sighting: &Sighting, odometer_m: f64) -> Self {
        let (sin, cos) = libm::sincos(sighting.believed_pose.heading_rad + sighting.bearing_rad);
        let j = Matrix2::new(cos, -sighting.range_m * sin, sin, sighting.range_m * cos);
        let mut group = Self {
            mean_m: Vector2::from(sighting.point_m()),
            uncertainty: Uncertainty {
                covariance_m2: j * noise(sighting) * j.transpose(),
                with_steady_m: Vector2::zeros(),
                with_drift_m2: Matrix2::zeros(),
            },
            drift: sighting.drift,
            first_seen_s: sighting.time_s,
            last_seen_s: sighting.time_s,
            mean_seen_s: sighting.time_s,
            frame_time_s: sighting.time_s,
            n_sightings: 0,
            odometer_m,
            n_corners: [0; 2],
            landmarks: Vec::new(),
        };
        group.count(sighting, odometer_m);
        group
    }

    /// The uncertainty as it has grown by drift on the way to the sighting.
    fn predicted(
        &self,
        sighting: &Sighting,
        odometer_m: f64,
        settings: &TrackerSettings,
    ) -> Uncertainty {
        let mut grown = self.uncertainty;
        let (Some(before), Some(now)) = (self.drift, sighting.drift) else {
            grown.covariance_m2 +=
                self.drift_by_metres_m2(sighting.believed_pose, odometer_m, settings);
            return grown;
        };
        let point_m = self.mean_m.into();
        let (w, g) = now.since(before, point_m);
        let (_, steady_before) = before.since(FrameDrift::NONE, point_m);
        let c = self.uncertainty.with_steady_m;
        let cgt = c * g.transpose();
        grown.covariance_m2 += w + g * g.transpose() - cgt - cgt.transpose();
        grown.with_steady_m -= g;
        grown.with_drift_m2 += cgt - w - g * (steady_before + g).transpose();
        grown
    }

    /// How much P grows where only the tracker's settings say how the frame drifts, m².
    fn drift_by_metres_m2(
        &self,
        pose: Pose,
        odometer_m: f64,
        drift: &TrackerSettings,
    ) -> Matrix2<f64> {
        let driven_m = odometer_m - self.odometer_m;
        let sight = self.mean_m - Vector2::from(pose.position_m());
        let across = Vector2::new(-sight.y, sight.x);
        Matrix2::identity() * (drift.odometry_noise.powi(2) * driven_m)
            + across * across.transpose() * (drift.heading_noise.powi(2) * driven_m)
    }

    /// `None` if the robot stands on the group or the innovation covariance cannot be inverted.
    pub(crate) fn innovation(
        &self,
        sighting: &Sighting,
        odometer_m: f64,
        settings: &TrackerSettings,
    ) -> Option<Innovation> {
        let pose = sighting.believed_pose;
        let sight = self.mean_m - Vector2::from(pose.position_m());
        let range_m = sight.norm();
        if range_m < MIN_RANGE_M {
            return None;
        }
        let (cos, sin) = (sight.x / range_m, sight.y / range_m);
        let jacobian = Matrix2::new(cos, sin, -sin / range_m, cos / range_m);
        let bearing_rad = libm::atan2(sight.y, sight.x) - pose.heading_rad;
        let residual = Vector2::new(
            sighting.range_m - range_m,
            wrap_rad(sighting.bearing_rad - bearing_rad),
        );
        let predicted = self.predicted(sighting, odometer_m, settings);
        let predicted_m2 = predicted.covariance_m2;
        let noise = noise(sighting);
        let inverse = (jacobian * predicted_m2 * jacobian.transpose() + noise).try_inverse()?;
        let squared_distance = (residual.transpose() * inverse * residual)[0];
        Some(Innovation {
            residual,
            jacobian,
            noise,
            predicted,
            inverse,
            squared_distance,
        })
    }

    pub(crate) fn update(&mut self, sighting: &Sighting, innovation: &Innovation, odometer_m: f64) {
        let Innovation {
            residual,
            jacobian: h,
            noise,
            predicted,
            inverse,
            ..
        } = innovation;
        let predicted_m2 = predicted.covariance_m2;
        let gain = predicted_m2 * h.transpose() * inverse;
        let keep = Matrix2::identity() - gain * h;
        self.mean_m += gain * residual;
        let (new, time_s) = ((gain * h).trace() / 2.0, sighting.time_s);
        let old = 1.0 - new;
        self.frame_time_s =
            old * old * self.frame_time_s + 2.0 * new * old * self.mean_seen_s + new * new * time_s;
        self.mean_seen_s = old * self.mean_seen_s + new * time_s;
        // Joseph's form stays symmetric and positive definite whatever the rounding.
        self.uncertainty = Uncertainty {
            covariance_m2: keep * predicted_m2 * keep.transpose() + gain * noise * gain.transpose(),
            with_steady_m: keep * predicted.with_steady_m,
            with_drift_m2: keep * predicted.with_drift_m2,
        };
        self.drift = sighting.drift;
        self.count(sighting, odometer_m);
    }

    fn count(&mut self, sighting: &Sighting, odometer_m: f64) {
        self.n_sightings += 1;
        self.last_seen_s = sighting.time_s;
        self.odometer_m = odometer_m;
        match sighting.corner {
            Some(Corner::Open) => self.n_corners[0] += 1,
            Some(Corner::Closed) => self.n_corners[1] += 1,
            None => {}
        }
        if let Some(landmark) = sighting.landmark {
            match self
                .landmarks
                .iter_mut()
                .find(|(known, _)| *known == landmark)
            {
                Some((_, n)) => *n += 1,
                None => self.landmarks.push((landmark, 1)),
            }
        }
    }

    /// P, or against the frame of the start P + C + Cᵀ + Cov(d), m².
    pub(crate) fn covariance_m2(&self, since_start: bool) -> Matrix2<f64> {
        let c = self.uncertainty.covariance_m2;
        let Some(drift) = self.drift.filter(|_| since_start) else {
            return c;
        };
        let (random, steady) = drift.since(FrameDrift::NONE, self.mean_m.into());
        let shared = self.uncertainty.with_drift_m2;
        c + shared + shared.transpose() + random + steady * steady.transpose()
    }

    pub(crate) fn into_detection(self, since_start: bool) -> Detection {
        let c = self.covariance_m2(since_start);
        let c = (c + c.transpose()) * 0.5;
        // Numbers that overflowed have no eigenvalues; the check of detections refuses them.
        let is_finite = c.iter().all(|value| value.is_finite());
        let smallest = if is_finite {
            c.symmetric_eigenvalues().min()
        } else {
            f64::NAN
        };
        let c = c + Matrix2::identity() * (MIN_VARIANCE_M2 - smallest).max(0.0);
        let [open, closed] = self.n_corners;
        let corner = match open.cmp(&closed) {
            std::cmp::Ordering::Greater => Some(Corner::Open),
            std::cmp::Ordering::Less => Some(Corner::Closed),
            std::cmp::Ordering::Equal => None,
        };
        let majority = self
            .landmarks
            .iter()
            .find(|(_, n)| 2 * n > self.n_sightings);
        Detection {
            position_m: self.mean_m.into(),
            covariance_m2: Some(Covariance {
                xx: c[(0, 0)],
                xy: c[(0, 1)],
                yy: c[(1, 1)],
            }),
            first_seen_s: Some(self.first_seen_s),
            last_seen_s: Some(self.last_seen_s),
            corner,
            landmark: majority.map(|(landmark, _)| *landmark),
        }
    }
}

/// R of one sighting, floored.
fn noise(sighting: &Sighting) -> Matrix2<f64> {
    let range_m = sighting.range_std_m.max(MIN_RANGE_STD_M);
    let bearing_rad = sighting.bearing_std_rad.max(MIN_BEARING_STD_RAD);
    let shared = sighting.correlation * range_m * bearing_rad;
    Matrix2::new(range_m.powi(2), shared, shared, bearing_rad.powi(2))
}
