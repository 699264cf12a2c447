//! What detections of one mission have in common: the drift of their frame, as a few factors.
//!
//! Dead reckoning moves its frame as one rigid body. A place x is believed to be at
//! z = exp(w_k)⋯exp(w_1)·x, with one twist w (3; m, m, rad) for each increment of the drift up to the sighting, about the
//! believed origin; detections have the increments up to the earlier one in common. How far the frame had drifted
//! is known at each of them, S and G of [`FrameDrift`], so w_k = W_k·u, u ~ N(0, I) of length r: every increment of S is
//! three factors, the steady bend is one. What is left of C_i, R_i, is a detection's own; as the one time at which a
//! group of sightings counts as seen is an approximation, that may be too little, and is kept above that of the surest detection of the tracker.
//!
//! About an estimate û of u the places are linear ([`SharedDrift::about`]): z̃_i = x_i(û) + B_i·û is off by B_i·u + e_i,
//! e_i ~ N(0, R_i), R_i turned back with the frame. At û = 0 that is B_i·B_jᵀ = A_i·(S_min(i,j) + G_i·G_jᵀ)·A_jᵀ, A_i = [I | ⊥z_i].
//!
//! Fewer factors do: increments that are small against what detections err by themselves wait for the next one,
//! and of the principal components of B the least are left out, until what is left out comes to a hundredth of
//! what detections err by themselves. What waits or is left out counts as a detection's own error, so C_i stays as stated.

use nalgebra::{
    DMatrix, DVector, Matrix2, Matrix2xX, Matrix3, Matrix3xX, SymmetricEigen, Vector2, Vector3,
};

use crate::detections::{Covariance, Detections};
use crate::sighting::{FrameDrift, shift_by_twist};
use crate::tracker::MIN_VARIANCE_M2;

/// An increment waits while it is less than this share of what the detection errs by itself.
const LEAST_INCREMENT: f64 = 0.05;
/// Increments at most; above it more of them wait.
const MOST_INCREMENTS: usize = 60;
/// The largest drift, over what the surest detection errs by itself: its square times sixteen, for s of a quarter, and some
/// hundreds of detections still leave four digits of the prior beside what is seen.
const MOST_DRIFT: f64 = 1e4;
/// Principal components that come to less than this share of what detections err by themselves are left out.
const LEFT_OUT: f64 = 0.01;

/// Detections whose drift is of no use.
#[derive(Debug, thiserror::Error)]
pub enum DriftError {
    /// No covariances.
    #[error(
        "got detections without covariances, expected some, of which drift is a part; add them"
    )]
    NoCovariances,
    /// Numbers overflow.
    #[error(
        "numbers overflow at the places or the drift of the detections, expected finite ones; correct the recording"
    )]
    NotFinite,
    /// So much drift that nothing is left of what detections say in the arithmetic.
    #[error(
        "got {drift_m:.3e} m of drift against {own_m:.3} m that a detection errs by itself, expected at most ten thousand \
         times as much; lower the noise of the odometry, or cut the recording into windows"
    )]
    TooLarge {
        /// Standard deviation of the drift where it is largest, m.
        drift_m: f64,
        /// That of the surest detection, m.
        own_m: f64,
    },
}

/// W and R.
#[derive(Clone, Debug)]
pub struct SharedDrift {
    /// The middle of the detections, m. Places and twists are about it: far away from its origin rounding would spoil S.
    middle_m: Vector2<f64>,
    /// From the middle, m.
    positions_m: Vec<Vector2<f64>>,
    /// W_k, 3×r.
    increments: Vec<Matrix3xX<f64>>,
    /// How many of them each detection has.
    known: Vec<usize>,
    /// R_i at û = 0, m².
    own_m2: Vec<Matrix2<f64>>,
}

/// Places as a linear function of u, about one value of it.
#[derive(Clone, Debug)]
pub struct Linear {
    /// x_i(û), m.
    pub places_m: Vec<Vector2<f64>>,
    /// z̃_i, m.
    pub positions_m: Vec<Vector2<f64>>,
    /// B_i, 2×r, m.
    pub loadings_m: Vec<Matrix2xX<f64>>,
    /// R_i, turned with the frame, m².
    pub own_m2: Vec<Covariance>,
}

impl SharedDrift {
    /// Of detections whose covariances are against the frame of the start, and its drift at each.
    ///
    /// # Errors
    /// Detections without covariances, or so far away that numbers overflow.
    pub fn of(detections: &Detections, drifts: &[FrameDrift]) -> Result<Self, DriftError> {
        let stated = detections.covariances_m2();
        let stated = stated.ok_or(DriftError::NoCovariances)?;
        let n = detections.len() as f64;
        let places = detections.iter().map(|row| Vector2::from(row.position_m));
        let middle_m = places.clone().fold(Vector2::zeros(), |sum, z| sum + z / n);
        let positions_m: Vec<Vector2<f64>> = places.map(|z| z - middle_m).collect();
        let drifts: Vec<FrameDrift> = drifts
            .iter()
            .map(|drift| drift.about(middle_m.into()))
            .collect();
        let own = |(i, z): (usize, &Vector2<f64>)| {
            let (random, steady) = drifts[i].since(FrameDrift::NONE, (*z).into());
            above_least(matrix(stated[i]) - random - steady * steady.transpose())
        };
        let own: Option<Vec<Matrix2<f64>>> = positions_m.iter().enumerate().map(own).collect();
        let own = own.ok_or(DriftError::NotFinite)?;
        let mut order: Vec<usize> = (0..drifts.len()).collect();
        order.sort_by(|&i, &j| {
            drifts[i]
                .random
                .trace()
                .total_cmp(&drifts[j].random.trace())
        });
        let mut least = LEAST_INCREMENT;
        let (ends, known) = loop {
            let (ends, known) = increments(&order, &drifts, &positions_m, &own, least);
            if ends.len() <= MOST_INCREMENTS {
                break (ends, known);
            }
            least *= 2.0;
        };
        let n_factors = 3 * ends.len() + 1;
        let mut last = FrameDrift::NONE;
        let mut found = Self {
            middle_m,
            positions_m,
            increments: Vec::with_capacity(ends.len()),
            known,
            own_m2: own,
        };
        for (k, end) in ends.into_iter().enumerate() {
            let mut increment = Matrix3xX::zeros(n_factors);
            increment
                .fixed_columns_mut::<3>(3 * k)
                .copy_from(&root(end.random - last.random));
            increment.set_column(n_factors - 1, &(end.steady - last.steady));
            found.increments.push(increment);
            last = end;
        }
        let total: f64 = found.own_m2.iter().map(Matrix2::trace).sum();
        let loadings = found.about(&DVector::zeros(n_factors))?.loadings_m;
        let kept = principal(&loadings, LEFT_OUT * total).ok_or(DriftError::NotFinite)?;
        for increment in &mut found.increments {
            *increment = &*increment * &kept;
        }
        let loadings: Vec<Matrix2xX<f64>> = loadings.iter().map(|b| b * &kept).collect();
        let own = loadings.iter().zip(stated);
        let own = own.map(|(b, c)| above_least(matrix(c) - b * b.transpose()));
        let own: Option<Vec<Matrix2<f64>>> = own.collect();
        found.own_m2 = own.ok_or(DriftError::NotFinite)?;
        let drift_m = loadings.iter().map(Matrix2xX::norm).fold(0.0, f64::max);
        let least = found
            .own_m2
            .iter()
            .map(|own| own.symmetric_eigenvalues().min());
        let own_m = least.fold(f64::INFINITY, f64::min).sqrt();
        if drift_m > MOST_DRIFT * own_m {
            return Err(DriftError::TooLarge { drift_m, own_m });
        }
        Ok(found)
    }

    /// r.
    pub fn n_factors(&self) -> usize {
        self.increments.first().map_or(0, Matrix3xX::ncols)
    }

    /// Places about û.
    ///
    /// # Errors
    /// Places so far away that numbers overflow.
    pub fn about(&self, factors: &DVector<f64>) -> Result<Linear, DriftError> {
        let twists: Vec<Vector3<f64>> = self.increments.iter().map(|w| w * factors).collect();
        // The heading of the frame before each increment.
        let headings = twists.iter().scan(0.0, |sum, twist| {
            let before = *sum;
            *sum += twist.z;
            Some(before)
        });
        let headings: Vec<f64> = headings.collect();
        let n_factors = factors.len();
        let mut found = Linear {
            places_m: Vec::new(),
            positions_m: Vec::new(),
            loadings_m: Vec::new(),
            own_m2: Vec::new(),
        };
        // How a place moves with u in each increment: exp(−(w+δ)) ≈ exp(−J·δ)·exp(−w), J the left Jacobian at −w.
        let turned = self.increments.iter().zip(&twists);
        let turned: Vec<Matrix3xX<f64>> = turned
            .map(|(increment, twist)| left_jacobian(-twist) * increment)
            .collect();
        for ((&position_m, &known), own) in
            self.positions_m.iter().zip(&self.known).zip(&self.own_m2)
        {
            let mut place = position_m;
            let mut loading = Matrix2xX::zeros(n_factors);
            for k in (0..known).rev() {
                place = moved(-twists[k], place);
                loading += rotation(-headings[k]) * shift_by_twist(place.into()) * &turned[k];
            }
            let back = rotation(
                -known
                    .checked_sub(1)
                    .map_or(0.0, |k| headings[k] + twists[k].z),
            );
            found
                .positions_m
                .push(place + self.middle_m + &loading * factors);
            found.places_m.push(place + self.middle_m);
            found.loadings_m.push(loading);
            found.own_m2.push(covariance(back * own * back.transpose()));
        }
        let finite = found
            .positions_m
            .iter()
            .all(|z| z.iter().all(|v| v.is_finite()));
        finite.then_some(found).ok_or(DriftError::NotFinite)
    }
}

/// sin θ/θ and (1 − cos θ)/θ.
fn along_and_across(angle: f64) -> (f64, f64) {
    if angle.abs() < 1e-6 {
        return (1.0, angle / 2.0);
    }
    let (sin, cos) = libm::sincos(angle);
    (sin / angle, (1.0 - cos) / angle)
}

/// exp(w)·x.
fn moved(twist: Vector3<f64>, point: Vector2<f64>) -> Vector2<f64> {
    let (along, across) = along_and_across(twist.z);
    let way = Matrix2::new(along, -across, across, along) * twist.xy();
    rotation(twist.z) * point + way
}

/// The left Jacobian of SE(2) (Solà, Deray & Atchuthan, A micro Lie theory for state estimation in robotics, 2018, eq. 163).
fn left_jacobian(twist: Vector3<f64>) -> Matrix3<f64> {
    let (along, across) = along_and_across(twist.z);
    let angle = twist.z;
    // (θ − sin θ)/θ² and (1 − cos θ)/θ², with their first terms near 0.
    let (a, b) = if angle.abs() < 1e-4 {
        (angle / 6.0, 0.5)
    } else {
        ((1.0 - along) / angle, across / angle)
    };
    let (x, y) = (twist.x, twist.y);
    Matrix3::new(
        along,
        -across,
        a * x + b * y,
        across,
        along,
        a * y - b * x,
        0.0,
        0.0,
        1.0,
    )
}

fn rotation(angle: f64) -> Matrix2<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix2::new(cos, -sin, sin, cos)
}

/// The drift at the end of each increment, and how many increments each detection has.
fn increments(
    order: &[usize],
    drifts: &[FrameDrift],
    positions_m: &[Vector2<f64>],
    own: &[Matrix2<f64>],
    least: f64,
) -> (Vec<FrameDrift>, Vec<usize>) {
    let mut last = FrameDrift::NONE;
    let (mut ends, mut known) = (Vec::new(), vec![0; drifts.len()]);
    for &i in order {
        let (random, steady) = drifts[i].since(last, positions_m[i].into());
        if random.trace() + steady.norm_squared() > least * own[i].trace() {
            ends.push(drifts[i]);
            last = drifts[i];
        }
        known[i] = ends.len();
    }
    (ends, known)
}

/// The principal components of B, as columns, without the least of them, whose squares add up to `left_out` at most.
fn principal(loadings: &[Matrix2xX<f64>], left_out: f64) -> Option<DMatrix<f64>> {
    let n_factors = loadings.first().map_or(0, Matrix2xX::ncols);
    let mut gram = DMatrix::zeros(n_factors, n_factors);
    for b in loadings {
        gram.gemm_tr(1.0, b, b, 1.0);
    }
    // The search for eigenvalues would not end.
    if !gram.iter().all(|v| v.is_finite()) {
        return None;
    }
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..n_factors).collect();
    order.sort_by(|&i, &j| eigenvalues[j].total_cmp(&eigenvalues[i]));
    let mut sum = 0.0;
    while let Some(&least) = order.last() {
        sum += eigenvalues[least].max(0.0);
        if sum > left_out {
            break;
        }
        order.pop();
    }
    Some(eigenvectors.select_columns(&order))
}

/// L with L·Lᵀ nearest to a matrix that is a covariance but for its rounding.
fn root(matrix: Matrix3<f64>) -> Matrix3<f64> {
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = matrix.symmetric_eigen();
    eigenvectors * Matrix3::from_diagonal(&eigenvalues.map(|value| value.max(0.0).sqrt()))
}

/// With eigenvalues of at least [`MIN_VARIANCE_M2`]; `None` of what is not finite.
fn above_least(matrix: Matrix2<f64>) -> Option<Matrix2<f64>> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = matrix.symmetric_eigen();
    let raised = Matrix2::from_diagonal(&eigenvalues.map(|value| value.max(MIN_VARIANCE_M2)));
    Some(eigenvectors * raised * eigenvectors.transpose())
}

/// As a matrix.
pub(super) fn matrix(c: Covariance) -> Matrix2<f64> {
    Matrix2::new(c.xx, c.xy, c.xy, c.yy)
}

/// Of a symmetric matrix.
pub(super) fn covariance(m: Matrix2<f64>) -> Covariance {
    Covariance {
        xx: m[(0, 0)],
        xy: (m[(0, 1)] + m[(1, 0)]) / 2.0,
        yy: m[(1, 1)],
    }
}
