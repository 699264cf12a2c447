//! What is known of the factors u of the drift: before anything is seen N(0, I), then by every difference between detections
//! of one landmark, which are linear in u. One at a time by Kalman updates, all at once by their information.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, Matrix2xX, OMatrix, U2, Vector2};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// What is known of u: N(mean, covariance).
#[derive(Clone, Debug)]
pub(super) struct Factors {
    pub(super) mean: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Factors {
    /// Of nothing seen.
    pub(super) fn unknown(n_factors: usize) -> Self {
        Self {
            mean: DVector::zeros(n_factors),
            covariance: DMatrix::identity(n_factors, n_factors),
        }
    }

    /// What something of loading B (2×r) comes to.
    pub(super) fn predict(&self, loading: &Matrix2xX<f64>) -> Shift {
        self.of_one(loading).shift
    }

    /// The same, ready to be compared with others.
    pub(super) fn of_one(&self, loading: &Matrix2xX<f64>) -> OfOne {
        let with_factors = &self.covariance * loading.transpose();
        OfOne {
            shift: Shift {
                mean_m: loading * &self.mean,
                spread_m2: loading * &with_factors,
            },
            with_factors,
        }
    }

    /// After a difference (2, m) = G·u + noise was seen; with the noise's covariance (2×2, m²) negative, before one was that
    /// is taken back. Gives what that changes; `None` if the difference says nothing by rounding, when the next
    /// rebuilding is near.
    pub(super) fn observe(
        &mut self,
        loading: &Matrix2xX<f64>,
        difference: Vector2<f64>,
        noise: Matrix2<f64>,
    ) -> Option<Step> {
        let OfOne {
            shift,
            with_factors,
        } = self.of_one(loading);
        let gain = &with_factors * (shift.spread_m2 + noise).try_inverse()?;
        let surprise_m = difference - shift.mean_m;
        self.mean += &gain * surprise_m;
        self.covariance
            .gemm(-1.0, &gain, &with_factors.transpose(), 1.0);
        Some(Step {
            gain,
            with_factors,
            surprise_m,
        })
    }
}

/// Mean (2, m) and covariance (2×2, m²) of B·u.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    pub(super) mean_m: Vector2<f64>,
    pub(super) spread_m2: Matrix2<f64>,
}

/// [`Shift`] of one detection, and its covariance with u (r×2, m).
pub(super) struct OfOne {
    shift: Shift,
    with_factors: OMatrix<f64, Dyn, U2>,
}

impl OfOne {
    /// How it differs from something of another loading and shift, at the cost of r and not of r².
    pub(super) fn from(&self, loading: &Matrix2xX<f64>, other: &Shift) -> Shift {
        let shared = loading * &self.with_factors;
        Shift {
            mean_m: self.shift.mean_m - other.mean_m,
            spread_m2: self.shift.spread_m2 + other.spread_m2 - shared - shared.transpose(),
        }
    }
}

/// How an observation changed what is known of u.
pub(super) struct Step {
    gain: OMatrix<f64, Dyn, U2>,
    with_factors: OMatrix<f64, Dyn, U2>,
    surprise_m: Vector2<f64>,
}

impl Step {
    /// What it changes of a shift of a loading.
    pub(super) fn change(&self, loading: &Matrix2xX<f64>, shift: &mut Shift) {
        let gain = loading * &self.gain;
        shift.mean_m += gain * self.surprise_m;
        shift.spread_m2 -= gain * (loading * &self.with_factors).transpose();
    }
}

/// What sets say of u, but for s²: the likelihood of u is exp(−(uᵀPu − 2uᵀw)/(2s²)).
pub(super) struct Information {
    precision: DMatrix<f64>,
    weighted: DVector<f64>,
}

impl Information {
    /// Of no sets.
    pub(super) fn none(n_factors: usize) -> Self {
        Self {
            precision: DMatrix::zeros(n_factors, n_factors),
            weighted: DVector::zeros(n_factors),
        }
    }

    /// With a difference (2, m) of loading G (2×r) and noise of precision (2×2, m⁻²) times 1/s².
    pub(super) fn add(
        &mut self,
        precision: &Matrix2<f64>,
        loading: &Matrix2xX<f64>,
        difference: &Vector2<f64>,
    ) {
        let weights = precision * loading;
        self.precision.gemm_tr(1.0, &weights, loading, 1.0);
        self.weighted.gemv_tr(1.0, &weights, difference, 1.0);
    }

    /// With the prior N(0, I): (I + P/s²) = LLᵀ, and the mean.
    fn solve(&self, variance: f64) -> (Cholesky<f64, Dyn>, DVector<f64>) {
        let n = self.weighted.len();
        let precision = DMatrix::identity(n, n) + &self.precision / variance;
        let root = precision.cholesky().expect("I plus a sum of squares");
        let mean = root.solve(&(&self.weighted / variance));
        (root, mean)
    }

    pub(super) fn factors(&self, variance: f64) -> Factors {
        let (root, mean) = self.solve(variance);
        Factors {
            mean,
            covariance: root.inverse(),
        }
    }

    pub(super) fn draw(&self, variance: f64, rng: &mut impl Rng) -> DVector<f64> {
        let (root, mean) = self.solve(variance);
        let normal = DVector::from_fn(mean.len(), |_, _| StandardNormal.sample(rng));
        let from_mean = root.l().tr_solve_lower_triangular(&normal);
        mean + from_mean.expect("a root has no zero on its diagonal")
    }
}
