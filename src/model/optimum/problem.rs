//! E_S as a problem for argmin.
//!
//! With u the members relative to their mean, in units of the farthest one's distance (σ_o if all
//! coincide), and ρ = (σ_o/σ_t)², E_S = κ e(y), κ = (unit/σ_o)²,
//!
//! e(y) = Σ_i |y_i − u_i|² + ρ Σ_{i<j} |y_i − y_j|²,  y = x₀, y₀, x₁, y₁, …
//!
//! written out pair by pair, without using what the closed form knows of it. ∇²E_S in m⁻² is ∇²e/σ_o²,
//! whatever the unit.

use std::cell::Cell;

use argmin::core::{CostFunction, Error, Gradient, Hessian};
use argmin::solver::linesearch::condition::LineSearchCondition;
use argmin_math::{ArgminAdd, ArgminDot, ArgminL2Norm, ArgminMul, ArgminSub};
use nalgebra::{DMatrix, DVector};

use crate::model::MetricModel;

/// Evaluations after which a search is given up: its inner loops have no bound of their own.
const MAX_EVALUATIONS: u32 = 20_000;

/// e, with the number of its evaluations.
#[derive(Clone, Debug)]
pub struct SetEnergy {
    /// u.
    observed: DVector<f64>,
    ratio: f64,
    /// κ.
    pub scale: f64,
    n_evaluations: Cell<u32>,
}

/// How y lies in the model's coordinates: x = centre + unit · y, m.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    centre_m: [f64; 2],
    unit_m: f64,
}

impl Frame {
    /// Locations, m.
    pub fn to_model(self, point: &Point) -> Vec<[f64; 2]> {
        let y = &point.0;
        (0..y.len() / 2)
            .map(|i| [0, 1].map(|axis| self.centre_m[axis] + self.unit_m * y[2 * i + axis]))
            .collect()
    }
}

impl SetEnergy {
    /// e of a set of the model's detections.
    pub fn of(model: &MetricModel, members: &[u32]) -> (Self, Frame) {
        let centre_m = model.mean_m(members);
        let from_centre = |k: usize| {
            let z = model.positions_m()[members[k / 2] as usize];
            z[k % 2] - centre_m[k % 2]
        };
        let offsets_m = DVector::from_fn(2 * members.len(), |k, _| from_centre(k));
        let distances = (0..members.len()).map(|i| offsets_m[2 * i].hypot(offsets_m[2 * i + 1]));
        let farthest = distances.fold(0.0, f64::max);
        let unit_m = if farthest > 0.0 {
            farthest
        } else {
            model.sigma_o_m()
        };
        let energy = Self {
            observed: offsets_m / unit_m,
            ratio: (model.sigma_o_m() / model.sigma_t_m()).powi(2),
            scale: (unit_m / model.sigma_o_m()).powi(2),
            n_evaluations: Cell::new(0),
        };
        (energy, Frame { centre_m, unit_m })
    }

    /// y = u: every location at its detection.
    pub fn start(&self) -> Point {
        Point(self.observed.clone())
    }

    /// e(y).
    pub fn value(&self, point: &Point) -> f64 {
        let y = &point.0;
        let mut pairs = 0.0;
        for k in 0..y.len() {
            for l in (k % 2..k).step_by(2) {
                pairs += (y[k] - y[l]) * (y[k] - y[l]);
            }
        }
        (y - &self.observed).norm_squared() + self.ratio * pairs
    }

    /// ∇e(y).
    pub fn slope(&self, point: &Point) -> Point {
        let y = &point.0;
        Point(DVector::from_fn(y.len(), |k, _| {
            let others = (k % 2..y.len()).step_by(2);
            let pull: f64 = others.map(|l| y[k] - y[l]).sum();
            2.0 * (y[k] - self.observed[k]) + 2.0 * self.ratio * pull
        }))
    }

    /// ∇²e, the same at every y.
    pub fn second_derivative(&self) -> DMatrix<f64> {
        let n = self.observed.len();
        let mut hessian = DMatrix::identity(n, n) * 2.0;
        for k in 0..n {
            for l in (k % 2..n).step_by(2).filter(|&l| l != k) {
                hessian[(k, k)] += 2.0 * self.ratio;
                hessian[(k, l)] -= 2.0 * self.ratio;
            }
        }
        hessian
    }

    fn count(&self, value: f64) -> Result<(), Error> {
        self.n_evaluations.set(self.n_evaluations.get() + 1);
        if !value.is_finite() {
            return Err(Error::msg(format!("E is {value}")));
        }
        if self.n_evaluations.get() > MAX_EVALUATIONS {
            return Err(Error::msg("the search goes on and on"));
        }
        Ok(())
    }
}

impl CostFunction for SetEnergy {
    type Param = Point;
    type Output = f64;
    fn cost(&self, point: &Point) -> Result<f64, Error> {
        let value = self.value(point);
        self.count(value).map(|()| value)
    }
}

impl Gradient for SetEnergy {
    type Param = Point;
    type Gradient = Point;
    fn gradient(&self, point: &Point) -> Result<Point, Error> {
        let slope = self.slope(point);
        self.count(slope.0.sum()).map(|()| slope)
    }
}

impl Hessian for SetEnergy {
    type Param = Point;
    type Hessian = DMatrix<f64>;
    fn hessian(&self, _: &Point) -> Result<DMatrix<f64>, Error> {
        Ok(self.second_derivative())
    }
}

/// When a step t along d is short enough: d·∇e(y + td) ≤ −(1 − 2δ) d·∇e(y), the upper half of Hager and
/// Zhang's approximate Wolfe condition (SIAM J. Optim. 16(1), 2005, eq. 4.1).
///
/// For a quadratic it is Armijo's condition, but told by slopes: near the minimum two values differ by
/// less than their rounding, and a search that compares them stalls at the root of the precision. The lower half
/// is not needed, as e is strictly convex. (argmin's own search of Hager and Zhang divides 0 by 0 here, where the
/// first secant of a quadratic is exact.)
#[derive(Clone, Copy, Debug)]
pub struct SlopeCondition;

/// δ, as Hager and Zhang choose it.
const DELTA: f64 = 0.1;

impl LineSearchCondition<Point, Point, f64> for SlopeCondition {
    fn evaluate_condition(
        &self,
        _: f64,
        gradient: Option<&Point>,
        _: f64,
        initial_gradient: &Point,
        direction: &Point,
        _: f64,
    ) -> bool {
        let most = (2.0 * DELTA - 1.0) * initial_gradient.0.dot(&direction.0);
        gradient.is_some_and(|gradient| gradient.0.dot(&direction.0) <= most)
    }

    fn requires_current_gradient(&self) -> bool {
        true
    }
}

/// A vector for argmin: BFGS asks a vector for its outer product with another, which argmin-math does
/// not give for nalgebra's.
#[derive(Clone, Debug)]
pub struct Point(pub DVector<f64>);

impl ArgminSub<Point, Point> for Point {
    fn sub(&self, other: &Point) -> Point {
        Point(&self.0 - &other.0)
    }
}

impl ArgminMul<f64, Point> for Point {
    fn mul(&self, factor: &f64) -> Point {
        Point(&self.0 * *factor)
    }
}

// argmin-math makes its scaled sums of these two.
impl ArgminMul<Point, Point> for f64 {
    fn mul(&self, point: &Point) -> Point {
        Point(&point.0 * *self)
    }
}

impl ArgminAdd<Point, Point> for Point {
    fn add(&self, other: &Point) -> Point {
        Point(&self.0 + &other.0)
    }
}

impl ArgminL2Norm<f64> for Point {
    fn l2_norm(&self) -> f64 {
        self.0.norm()
    }
}

impl ArgminDot<Point, f64> for Point {
    fn dot(&self, other: &Point) -> f64 {
        self.0.dot(&other.0)
    }
}

/// The outer product.
impl ArgminDot<Point, DMatrix<f64>> for Point {
    fn dot(&self, other: &Point) -> DMatrix<f64> {
        &self.0 * other.0.transpose()
    }
}

impl ArgminDot<Point, Point> for DMatrix<f64> {
    fn dot(&self, point: &Point) -> Point {
        Point(self * &point.0)
    }
}
