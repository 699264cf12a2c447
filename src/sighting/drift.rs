//! How unsure a frame of dead reckoning has become.
//!
//! To first order the errors of dead reckoning move the frame as one rigid body: an increment that
//! ends at p with error (w, ω) shifts everything seen later by w + ω·⊥(m − p), ⊥(x, y) = (−y, x),
//! wherever m lies. About the origin that is the twist (u, ω), u = w − ω·⊥p, so the errors of
//! increments add up, and the shift of m is A(m)·(u, ω) with A(m) = [I | ⊥m] (2×3). Kept are
//!
//! - S (3×3; m², m·rad, rad²), the covariance of the sum of independent increments, and
//! - G (3; m, rad), the sum per unit of one steady error b ~ N(0, 1) that lasts the whole mission,
//!   such as a wheel that is smaller than its data sheet says.
//!
//! Between two times m shifts by a random part of covariance A·(S₂ − S₁)·Aᵀ and by A·(G₂ − G₁)·b: no
//! heading of the robot and no pose in between is needed. It is the right-invariant form of the pose
//! covariance (Barrau & Bonnabel, IEEE TAC 62, 2017). Where it fails: first order holds while the
//! heading is known to some 0.3 rad; beyond that the places of far landmarks lie on arcs.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use super::Pose;

/// The uncertainty of a frame since the start of the mission, see above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameDrift {
    /// S.
    pub random: Matrix3<f64>,
    /// G.
    pub steady: Vector3<f64>,
}

/// A(m): how a point (m) shifts by a small twist.
pub fn shift_by_twist([x, y]: [f64; 2]) -> Matrix2x3<f64> {
    Matrix2x3::new(1.0, 0.0, -y, 0.0, 1.0, x)
}

impl FrameDrift {
    /// That of the start.
    pub const NONE: Self = Self {
        random: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        steady: Vector3::new(0.0, 0.0, 0.0),
    };

    /// After one more increment.
    ///
    /// `pivot` is the pose that the error turns about, in the frame itself; `noise` its covariance
    /// (x, y, heading; m², m·rad, rad²) and `steady` its mean per unit of the steady error (m, rad),
    /// both in the axes of `pivot`.
    #[must_use]
    pub fn after(self, pivot: Pose, noise: &Matrix3<f64>, steady: &Vector3<f64>) -> Self {
        let (sin, cos) = libm::sincos(pivot.heading_rad);
        let (x, y) = (pivot.x_m, pivot.y_m);
        let twist = Matrix3::new(cos, -sin, y, sin, cos, -x, 0.0, 0.0, 1.0);
        Self {
            random: self.random + twist * noise * twist.transpose(),
            steady: self.steady + twist * steady,
        }
    }

    /// How a point (m) has shifted since an earlier time: covariance of the random part (2×2, m²)
    /// and the shift per unit of the steady error (2, m).
    pub fn since(self, earlier: Self, point_m: [f64; 2]) -> (Matrix2<f64>, Vector2<f64>) {
        let a = shift_by_twist(point_m);
        (
            a * (self.random - earlier.random) * a.transpose(),
            a * (self.steady - earlier.steady),
        )
    }

    /// The same with its origin at a point (m): u about it is u + ω·⊥point.
    #[must_use]
    pub fn about(self, [x, y]: [f64; 2]) -> Self {
        let twist = Matrix3::new(1.0, 0.0, -y, 0.0, 1.0, x, 0.0, 0.0, 1.0);
        Self {
            random: twist * self.random * twist.transpose(),
            steady: twist * self.steady,
        }
    }

    /// A share of the way from this time to a later one.
    #[must_use]
    pub fn towards(self, later: Self, share: f64) -> Self {
        Self {
            random: self.random + (later.random - self.random) * share,
            steady: self.steady + (later.steady - self.steady) * share,
        }
    }

    /// Whether all of it is finite.
    pub fn is_finite(self) -> bool {
        let values = self.random.iter().chain(self.steady.iter());
        values.copied().all(f64::is_finite)
    }

    /// Standard deviation of the heading against the start, rad.
    pub fn heading_std_rad(self) -> f64 {
        (self.random[(2, 2)] + self.steady[2].powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_at_a_pose_shifts_a_point_across_the_line_from_there() {
        // 0.1 rad at (2, 1), seen from 3 m: 0.3 m across, whatever the frame's origin; nothing at the
        // pose itself.
        let pivot = Pose {
            x_m: 2.0,
            y_m: 1.0,
            heading_rad: 0.7,
        };
        let noise = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.01));
        let drift = FrameDrift::NONE.after(pivot, &noise, &Vector3::new(0.0, 0.0, 0.1));
        let (random, steady) = drift.since(FrameDrift::NONE, [2.0, 4.0]);
        let expected = Matrix2::new(0.09, 0.0, 0.0, 0.0);
        assert!((random - expected).norm() < 1e-12, "{random}");
        assert!((steady - Vector2::new(-0.3, 0.0)).norm() < 1e-12);
        assert!(drift.since(FrameDrift::NONE, [2.0, 1.0]).0.norm() < 1e-12);
        assert!((drift.heading_std_rad() - 0.02f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn another_origin_shifts_points_alike() {
        let pivot = Pose {
            x_m: 2.0,
            y_m: 1.0,
            heading_rad: 0.7,
        };
        let noise = Matrix3::from_diagonal(&Vector3::new(0.02, 0.01, 0.03));
        let drift = FrameDrift::NONE.after(pivot, &noise, &Vector3::new(0.1, 0.2, 0.3));
        let before = drift.since(FrameDrift::NONE, [7.0, -4.0]);
        let after = drift.about([5.0, 3.0]).since(FrameDrift::NONE, [2.0, -7.0]);
        assert!((before.0 - after.0).norm() < 1e-12 && (before.1 - after.1).norm() < 1e-12);
    }

    #[test]
    fn noise_along_the_heading_turns_with_it() {
        let pivot = Pose {
            x_m: 5.0,
            y_m: 5.0,
            heading_rad: std::f64::consts::FRAC_PI_2,
        };
        let noise = Matrix3::from_diagonal(&Vector3::new(0.04, 0.0, 0.0));
        let before = FrameDrift::NONE.after(pivot, &noise, &Vector3::zeros());
        let drift = before.after(pivot, &noise, &Vector3::zeros());
        let (random, _) = drift.since(before, [0.0, 0.0]);
        assert!((random - Matrix2::new(0.0, 0.0, 0.0, 0.04)).norm() < 1e-12);
    }
}
