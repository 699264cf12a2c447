//! A convex sum of norms in the plane, and its minimiser: what the covariance model's optimum comes down to.
//!
//! F(ε) = |ε|²/2 + Σ_j c_j |K_j ε + v_j|
//!
//! has its minimum either at one of its kinks, where v_j + K_j ε = 0, or where it is smooth; a kink is found by its
//! optimality condition, a smooth minimum by argmin's trust region and polished by Newton steps.

use std::f64::consts::PI;

use argmin::core::{CostFunction, Error, Executor, Gradient, Hessian, State};
use argmin::solver::trustregion::{Steihaug, TrustRegion};
use nalgebra::{Matrix2, Vector2};

/// Iterations of the trust region, and of Newton's method behind it. Both converge quadratically;
/// some ten are typical.
const TRUST_REGION_ITERATIONS: u64 = 12;
const NEWTON_ITERATIONS: usize = 300;

/// A term c |Kε + v|.
#[derive(Clone, Copy, Debug)]
pub struct Norm {
    /// c ≥ 0.
    pub weight: f64,
    /// K.
    pub slope: Matrix2<f64>,
    /// v.
    pub offset: Vector2<f64>,
}

impl Norm {
    /// Kε + v.
    pub fn at(&self, epsilon: &Vector2<f64>) -> Vector2<f64> {
        self.slope * epsilon + self.offset
    }
}

/// F, and its minimisation.
#[derive(Clone, Debug)]
pub struct SumOfNorms {
    /// The terms.
    pub norms: Vec<Norm>,
}

impl SumOfNorms {
    fn value(&self, epsilon: &Vector2<f64>) -> f64 {
        let norms = self.norms.iter();
        0.5 * epsilon.norm_squared()
            + norms
                .map(|norm| norm.weight * norm.at(epsilon).norm())
                .sum::<f64>()
    }

    /// Gradient and Hessian; a term at its own kink is left out.
    fn derivatives(&self, epsilon: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (mut gradient, mut hessian) = (*epsilon, Matrix2::identity());
        for norm in &self.norms {
            let r = norm.at(epsilon);
            let length = r.norm();
            if length > 0.0 {
                let down = norm.slope.transpose() * r / length;
                gradient += down * norm.weight;
                let square = norm.slope.transpose() * norm.slope;
                hessian += (square - down * down.transpose()) * (norm.weight / length);
            }
        }
        (gradient, hessian)
    }

    /// Whether the kink of term k is the minimum: no direction leads down from it.
    fn kink(&self, k: usize) -> Option<Vector2<f64>> {
        let epsilon = -(self.norms[k].slope.try_inverse()? * self.norms[k].offset);
        let (mut gradient, mut cones) = (epsilon, Vec::new());
        for norm in &self.norms {
            let r = norm.at(&epsilon);
            if r.norm() <= 1e-9 * (1.0 + norm.offset.norm()) {
                cones.push(norm);
            } else {
                gradient += norm.slope.transpose() * r * (norm.weight / r.norm());
            }
        }
        let is_minimum = if let [cone] = cones[..] {
            (cone.slope.transpose().try_inverse()? * gradient).norm() <= cone.weight
        } else {
            (0..512).all(|step| {
                let (sin, cos) = libm::sincos(PI * f64::from(step) / 256.0);
                let u = Vector2::new(cos, sin);
                let rise = cones
                    .iter()
                    .map(|cone| cone.weight * (cone.slope * u).norm());
                gradient.dot(&u) + rise.sum::<f64>() >= 0.0
            })
        };
        is_minimum.then_some(epsilon)
    }

    /// The minimiser of F.
    pub fn minimise(&self) -> Vector2<f64> {
        if self.norms.is_empty() {
            return Vector2::zeros();
        }
        if let Some(kink) = (0..self.norms.len()).find_map(|k| self.kink(k)) {
            return kink;
        }
        // Away from a kink that may lie just at the start.
        let start = Vector2::new(1e-3, 7e-4);
        self.newton(self.trust_region(start).unwrap_or(start))
    }

    /// argmin's trust region with Steihaug's subproblem: second order, and safe far from the optimum.
    fn trust_region(&self, start: Vector2<f64>) -> Option<Vector2<f64>> {
        let solver = TrustRegion::new(Steihaug::new().with_max_iters(4));
        let result = Executor::new(self.clone(), solver)
            .configure(|state| state.param(start).max_iters(TRUST_REGION_ITERATIONS))
            .ctrlc(false)
            .timer(false)
            .run()
            .ok()?;
        let best = result.state().get_best_param()?;
        // The status says only that the iterations are used up: what counts is a finite point that is
        // not above the start. Newton's steps then decide on convergence.
        let good = best.iter().all(|v| v.is_finite()) && self.value(best) <= self.value(&start);
        good.then_some(*best)
    }

    /// Newton steps with halving, until the gradient is nothing.
    fn newton(&self, mut epsilon: Vector2<f64>) -> Vector2<f64> {
        let size = 1.0
            + self
                .norms
                .iter()
                .map(|n| n.weight * n.slope.norm())
                .sum::<f64>();
        for _ in 0..NEWTON_ITERATIONS {
            let (gradient, hessian) = self.derivatives(&epsilon);
            if gradient.norm() <= 1e-12 * size {
                break;
            }
            let Some(inverse) = hessian.try_inverse() else {
                break;
            };
            let step = -(inverse * gradient);
            let (now, slope) = (self.value(&epsilon), gradient.dot(&step));
            let mut t = 1.0;
            while self.value(&(epsilon + step * t)) > now + 1e-4 * t * slope {
                t *= 0.5;
                if t < 1e-12 {
                    return epsilon;
                }
            }
            epsilon += step * t;
        }
        epsilon
    }
}

impl CostFunction for SumOfNorms {
    type Param = Vector2<f64>;
    type Output = f64;
    fn cost(&self, epsilon: &Vector2<f64>) -> Result<f64, Error> {
        Ok(self.value(epsilon))
    }
}

impl Gradient for SumOfNorms {
    type Param = Vector2<f64>;
    type Gradient = Vector2<f64>;
    fn gradient(&self, epsilon: &Vector2<f64>) -> Result<Vector2<f64>, Error> {
        Ok(self.derivatives(epsilon).0)
    }
}

impl Hessian for SumOfNorms {
    type Param = Vector2<f64>;
    type Hessian = Matrix2<f64>;
    fn hessian(&self, epsilon: &Vector2<f64>) -> Result<Matrix2<f64>, Error> {
        Ok(self.derivatives(epsilon).1)
    }
}
