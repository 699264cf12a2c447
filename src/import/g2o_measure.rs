//! What the numbers of a sighting in a graph say: range and bearing with their errors.

use nalgebra::{Matrix2, Vector2};

use super::recording::Seen;
use crate::sighting::Pose;

/// Nearer than this a landmark has no direction, m.
const MIN_RANGE_M: f64 = 1e-3;

/// A measurement as a line states it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured {
    /// A point in the axes of the sensor, with the covariance of its information.
    Point {
        /// Where, m.
        at_m: [f64; 2],
        /// m².
        covariance_m2: Matrix2<f64>,
        /// xx, xy, yy as stated, 1/m².
        information: [f64; 3],
    },
    /// Range (m) and bearing (rad), with standard deviations of both and their correlation.
    Polar {
        /// Distance, m.
        range_m: f64,
        /// Direction, rad.
        bearing_rad: f64,
        /// As [`Seen::stated`].
        stated: [f64; 3],
    },
}

impl Measured {
    /// A point; `None` if its information is not positive definite.
    pub fn point(at_m: [f64; 2], information: [f64; 3]) -> Option<Self> {
        let [xx, xy, yy] = information;
        let covariance_m2 = Matrix2::new(xx, xy, xy, yy)
            .cholesky()
            .map(|root| root.inverse())
            .filter(|c| c.iter().all(|value| value.is_finite()))?;
        Some(Self::Point {
            at_m,
            covariance_m2,
            information,
        })
    }

    /// As seen from the robot, whose sensor sits at an offset; `Ok(None)` if it is too near to have
    /// a direction.
    ///
    /// # Errors
    /// The numbers of an information that is too near to singular.
    pub fn seen(&self, offset: Option<Pose>, landmark: i64) -> Result<Option<Seen>, String> {
        let (mut at_m, mut covariance, information) = match *self {
            Self::Point {
                at_m,
                covariance_m2,
                information,
            } => (at_m, covariance_m2, information),
            Self::Polar {
                range_m,
                bearing_rad,
                stated,
            } => {
                return Ok(Some(Seen {
                    range_m,
                    bearing_rad,
                    stated: Some(stated),
                    landmark: Some(landmark),
                }));
            }
        };
        if let Some(offset) = offset {
            let (sin, cos) = libm::sincos(offset.heading_rad);
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let turned = turn * Vector2::new(at_m[0], at_m[1]);
            at_m = [offset.x_m + turned[0], offset.y_m + turned[1]];
            covariance = turn * covariance * turn.transpose();
        }
        let [x_m, y_m] = at_m;
        let range_m = libm::hypot(x_m, y_m);
        if range_m < MIN_RANGE_M {
            return Ok(None);
        }
        let (cos, sin) = (x_m / range_m, y_m / range_m);
        let polar = Matrix2::new(cos, sin, -sin / range_m, cos / range_m);
        let polar = polar * covariance * polar.transpose();
        let (range_std_m, bearing_std_rad) = (polar[(0, 0)].sqrt(), polar[(1, 1)].sqrt());
        let correlation = polar[(0, 1)] / (range_std_m * bearing_std_rad);
        if !(correlation.abs() < 1.0 && bearing_std_rad.is_finite()) {
            return Err(numbers(&information));
        }
        Ok(Some(Seen {
            range_m,
            bearing_rad: libm::atan2(y_m, x_m),
            stated: Some([range_std_m, bearing_std_rad, correlation]),
            landmark: Some(landmark),
        }))
    }
}

/// The numbers of a matrix for a message, with few digits each.
pub(super) fn numbers(values: &[f64]) -> String {
    let short = |value: &f64| match value.abs() {
        size if size == 0.0 || (1e-5..1e16).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    };
    values.iter().map(short).collect::<Vec<_>>().join(" ")
}

/// From TORO's order xx xy yy θθ xθ yθ to that of rows.
pub(super) fn toro([xx, xy, yy, tt, xt, yt]: [f64; 6]) -> [f64; 6] {
    [xx, xy, xt, yy, yt, tt]
}
