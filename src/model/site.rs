//! One location under the covariance model: the optimum, the Gaussian around it, the integral.
//!
//! Given its set S, the location x of detection i has the convex energy
//!
//! E_i(x) = m_i²/σ_o² + Σ_{j∈S, j≠i} (m_j + b_ij)²/σ_t²,  m_j = |M_j (x − z_j)|,  C_j⁻¹ = M_jᵀM_j.
//!
//! Its quadratic part has the matrix A = C_i⁻¹/σ_o² + Σ C_j⁻¹/σ_t². With L Lᵀ = A⁻¹/2 and the minimiser
//! x_q of that part, x = x_q + Lε turns the rest into a sum of norms,
//!
//! F(ε) = |ε|²/2 + Σ_j c_j |K_j ε + v_j|,  c_j = 2 b_ij/σ_t², K_j = M_j L, v_j = M_j (x_q − z_j),
//!
//! whose minimum is either at one of its kinks, where v_j + K_j ε = 0, or smooth; a kink is found by its
//! optimality condition, a smooth minimum by argmin's trust region and polished by Newton steps. From the
//! optimum on, with ε ~ N(0, I),
//!
//! ln w = ln(π/√det A) − E\* + h,  h(ε) = −(g·ε + Σ_j c_j (|K_j ε + v_j| − |v_j|)) ≤ 0,
//!
//! g the gradient of the quadratic part at x\*: the weights of Q = N(x\*, A⁻¹/2) are bounded, because
//! the whole curvature of the norms is left out of A. ∫exp(−E) = (π/√det A) e^{−E\*} E[e^h].

use std::f64::consts::PI;

use argmin::core::{CostFunction, Error, Executor, Gradient, Hessian, State};
use argmin::solver::trustregion::{Steihaug, TrustRegion};
use nalgebra::{Matrix2, Vector2};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// Iterations of the trust region, and of Newton's method behind it. Both converge quadratically;
/// some ten are typical.
const TRUST_REGION_ITERATIONS: u64 = 12;
const NEWTON_ITERATIONS: usize = 300;
/// Rays and radial panels of the quadrature; doubling either changes ln J by less than 1e-6.
const N_RAYS: usize = 320;
const N_PANELS: usize = 6;
/// exp(−40) of the peak is where the quadrature ends.
const CUT_NATS: f64 = 40.0;
/// Below this acceptance draws are weighted instead of rejected.
const LEAST_ACCEPTANCE: f64 = 0.02;

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
    fn at(&self, epsilon: &Vector2<f64>) -> Vector2<f64> {
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

/// A location's optimum and the Gaussian around it.
#[derive(Clone, Debug)]
pub struct Site {
    /// x\*, m.
    pub optimum_m: [f64; 2],
    /// L: l₁₁, l₂₁, l₂₂, m.
    pub factor_m: [f64; 3],
    /// A: xx, xy, yy, m⁻².
    pub precision: [f64; 3],
    /// ln(π/√det A) − E\*: the log of the largest weight.
    pub ln_bound: f64,
    /// g.
    gradient: [f64; 2],
    norms: Vec<SiteNorm>,
}

/// A norm with its offset at x\*.
#[derive(Clone, Copy, Debug)]
struct SiteNorm {
    weight: f64,
    slope: [f64; 4],
    offset: [f64; 2],
    length: f64,
}

impl Site {
    /// From the optimum ε\* of F, given in coordinates from x_q.
    pub fn new(
        optimum_m: [f64; 2],
        factor_m: [f64; 3],
        precision: [f64; 3],
        ln_bound: f64,
        sum: &SumOfNorms,
        epsilon: &Vector2<f64>,
    ) -> Self {
        let norms = sum.norms.iter().map(|norm| {
            let r = norm.at(epsilon);
            let k = &norm.slope;
            SiteNorm {
                weight: norm.weight,
                slope: [k[(0, 0)], k[(0, 1)], k[(1, 0)], k[(1, 1)]],
                offset: [r.x, r.y],
                length: r.norm(),
            }
        });
        Self {
            optimum_m,
            factor_m,
            precision,
            ln_bound,
            gradient: [epsilon.x, epsilon.y],
            norms: norms.collect(),
        }
    }

    /// h(ε) ≤ 0. At the optimum the sum cannot be negative; what rounding leaves is cut, so that
    /// `ln_bound` bounds every weight in floating point too.
    #[inline]
    pub fn ln_excess(&self, e: [f64; 2]) -> f64 {
        let mut rise = self.gradient[0] * e[0] + self.gradient[1] * e[1];
        for norm in &self.norms {
            let k = &norm.slope;
            let u = k[0] * e[0] + k[1] * e[1] + norm.offset[0];
            let v = k[2] * e[0] + k[3] * e[1] + norm.offset[1];
            rise += norm.weight * ((u * u + v * v).sqrt() - norm.length);
        }
        -rise.max(0.0)
    }

    /// x\* + Lε, m.
    #[inline]
    pub fn location_m(&self, e: [f64; 2]) -> [f64; 2] {
        let l = &self.factor_m;
        [
            self.optimum_m[0] + l[0] * e[0],
            self.optimum_m[1] + (l[1] * e[0] + l[2] * e[1]),
        ]
    }

    /// ε of a location, m: the inverse of [`location_m`](Self::location_m).
    #[inline]
    pub fn epsilon_of(&self, x_m: [f64; 2]) -> [f64; 2] {
        let l = &self.factor_m;
        let first = (x_m[0] - self.optimum_m[0]) / l[0];
        [first, (x_m[1] - self.optimum_m[1] - l[1] * first) / l[2]]
    }

    /// φ = |ε|²/2 − h on the ray of direction u.
    fn depth(&self, u: [f64; 2], r: f64) -> f64 {
        0.5 * r * r - self.ln_excess([r * u[0], r * u[1]])
    }

    /// Where φ reaches `nats` on a ray: φ is convex and at least r²/2.
    fn radius_at(&self, u: [f64; 2], nats: f64) -> f64 {
        let (mut low, mut high) = (0.0, (2.0 * nats).sqrt());
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.depth(u, middle) < nats {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

/// A site whose integral is known, so that exact draws can be had.
#[derive(Clone, Debug)]
pub struct ExactSite {
    /// The site.
    pub site: Site,
    /// ln E[e^h] ≤ 0: the log of the acceptance of a draw from Q.
    pub ln_acceptance: f64,
    /// Rate c of the radial proposal c² r e^{−cr} where rejection would take too long.
    rate: Option<f64>,
}

impl ExactSite {
    /// By quadrature in polar coordinates about the optimum, rays by the trapezoidal rule and along
    /// each ray Gauss–Legendre panels up to e⁻⁴⁰ of the peak.
    pub fn new(site: Site) -> Self {
        Self::with_quadrature(site, N_RAYS, N_PANELS)
    }

    fn with_quadrature(site: Site, n_rays: usize, n_panels: usize) -> Self {
        // Nodes and weights of the eight-point rule on [−1, 1], positive half (Abramowitz & Stegun 25.4).
        const NODES: [(f64, f64); 4] = [
            (0.183_434_642_495_649_8, 0.362_683_783_378_362),
            (0.525_532_409_916_329, 0.313_706_645_877_887_3),
            (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
            (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
        ];
        let (mut total, mut widest) = (0.0, 0.0_f64);
        for ray in 0..n_rays {
            let (sin, cos) = libm::sincos(2.0 * PI * (ray as f64 + 0.5) / n_rays as f64);
            let u = [cos, sin];
            let half = 0.5 * site.radius_at(u, CUT_NATS) / n_panels as f64;
            widest = widest.max(site.radius_at(u, 2.0));
            for panel in 0..n_panels {
                let middle = half * (2 * panel + 1) as f64;
                for (node, weight) in NODES {
                    for r in [middle - half * node, middle + half * node] {
                        total += half * weight * r * libm::exp(-site.depth(u, r));
                    }
                }
            }
        }
        // (1/2π) ∫∫ r e^{−φ} dr dθ.
        let ln_acceptance = libm::log(total / n_rays as f64).min(0.0);
        let rate = (ln_acceptance < libm::log(LEAST_ACCEPTANCE)).then_some(2.0 / widest);
        Self {
            site,
            ln_acceptance,
            rate,
        }
    }

    /// A draw from exp(−E)/∫exp(−E) with the log of its weight: 0 if by rejection. Where less than one
    /// in fifty would be accepted the draw is from c²/(2π) e^{−c|ε|} and weighted; its weights are
    /// bounded too.
    pub fn draw(&self, rng: &mut impl Rng) -> ([f64; 2], f64) {
        let mut uniform = || 1.0 - rng.random::<f64>();
        if let Some(rate) = self.rate {
            let r = -libm::log(uniform() * uniform()) / rate;
            let (sin, cos) = libm::sincos(2.0 * PI * uniform());
            let u = [cos, sin];
            let ln_weight =
                rate * r - self.site.depth(u, r) - 2.0 * libm::log(rate) - self.ln_acceptance;
            return (self.site.location_m([r * cos, r * sin]), ln_weight);
        }
        loop {
            let e = [StandardNormal.sample(rng), StandardNormal.sample(rng)];
            let ln_excess = self.site.ln_excess(e);
            if ln_excess == 0.0 || libm::log(1.0 - rng.random::<f64>()) < ln_excess {
                return (self.site.location_m(e), 0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::Covariance;
    use crate::model::{CovarianceModel, Penalty, PenaltyShape};
    use crate::rng::Purpose;

    /// Random detections; some coincide, some share a covariance, some are thin.
    fn model(seed: u64) -> CovarianceModel {
        let mut rng = Purpose::new("site test", seed).generator();
        let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let (mut positions_m, mut covariances_m2) = (Vec::new(), Vec::new());
        for i in 0..6 {
            let (a, b, turn) = (uniform(0.2, 3.0), uniform(0.01, 1.0), uniform(0.0, PI));
            let (sin, cos) = turn.sin_cos();
            positions_m.push([uniform(-2.0, 2.0), uniform(-2.0, 2.0)]);
            covariances_m2.push(Covariance {
                xx: a * cos * cos + b * sin * sin,
                xy: (a - b) * sin * cos,
                yy: a * sin * sin + b * cos * cos,
            });
            if i == 2 || i == 3 {
                positions_m[i] = positions_m[0];
            }
            if i == 3 || i == 4 {
                covariances_m2[i] = covariances_m2[0];
            }
        }
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.0,
            height: 1.0,
        };
        CovarianceModel::new(
            &positions_m,
            &covariances_m2,
            0.8,
            uniform(0.3, 2.0),
            penalty,
        )
        .expect("good covariances")
    }

    #[test]
    fn no_point_lies_below_the_optimum_and_weights_are_bounded() {
        let mut rng = Purpose::new("site test", 0).generator();
        for seed in 0..40 {
            let model = model(seed);
            for members in [
                &[0, 1][..],
                &[0, 2],
                &[0, 3],
                &[0, 2, 3, 5],
                &[0, 1, 2, 3, 4, 5],
            ] {
                for site in model.sites(members).sites {
                    assert!(site.ln_bound.is_finite());
                    for k in 0..400 {
                        let scale = libm::exp2(f64::from(k % 40) - 38.0);
                        let mut normal = || scale * rng.sample::<f64, _>(StandardNormal);
                        let e = [normal(), normal()];
                        let mut rise = site.gradient[0] * e[0] + site.gradient[1] * e[1];
                        for norm in &site.norms {
                            let u = norm.slope[0] * e[0] + norm.slope[1] * e[1] + norm.offset[0];
                            let v = norm.slope[2] * e[0] + norm.slope[3] * e[1] + norm.offset[1];
                            rise += norm.weight * (u.hypot(v) - norm.length);
                        }
                        // h before it is cut at 0: positive by no more than rounding.
                        let size: f64 =
                            site.norms.iter().map(|n| n.weight * (n.length + 1.0)).sum();
                        assert!(rise > -1e-9 * (1.0 + size), "{seed} {members:?} {rise}");
                    }
                }
            }
        }
    }

    /// The integral against a finer rule, against the closed form for a detection by itself, and the
    /// draws against Q: E[h] of exact draws from rejection and from quadrature-weighted normals.
    #[test]
    fn the_quadrature_has_converged() {
        for seed in 0..10 {
            let model = model(seed);
            for site in model.sites(&[0, 1, 2, 5]).sites {
                let coarse = ExactSite::with_quadrature(site.clone(), N_RAYS, N_PANELS);
                let fine = ExactSite::with_quadrature(site, 4 * N_RAYS, 3 * N_PANELS);
                let apart = (coarse.ln_acceptance - fine.ln_acceptance).abs();
                assert!(apart < 1e-4, "{seed}: {apart}");
            }
            // One detection alone: π σ_o² √det C, and every draw is accepted.
            let law = model.set_law(&[1]);
            let whiten = model.pair_whitening(1, 1);
            let expected = (PI * 0.64 / (whiten[0] * whiten[2])).ln();
            assert!((law.ln_integral - expected).abs() < 1e-9);
        }
    }

    /// Both ways to draw have the same mean of |ε|: within five joint standard errors.
    #[test]
    fn weighted_draws_agree_with_rejection() {
        let site = model(3).sites(&[0, 1, 5]).sites.remove(0);
        let by_rejection = ExactSite::new(site);
        assert!(by_rejection.rate.is_none());
        let weighted = ExactSite {
            rate: Some(1.5),
            ..by_rejection.clone()
        };
        let mut rng = Purpose::new("site test", 9).generator();
        let n = 100_000;
        let mut moments = |site: &ExactSite| {
            let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
            for _ in 0..n {
                let (x, ln_weight) = site.draw(&mut rng);
                let value = ln_weight.exp() * (x[0] - site.site.optimum_m[0]).abs();
                (sum, squares) = (sum + value, squares + value * value);
                weights += ln_weight.exp();
            }
            let mean = sum / f64::from(n);
            (
                mean,
                squares / f64::from(n) - mean * mean,
                weights / f64::from(n),
            )
        };
        let (a, b) = (moments(&by_rejection), moments(&weighted));
        let joint = ((a.1 + b.1) / f64::from(n)).sqrt();
        assert!((a.0 - b.0).abs() < 5.0 * joint, "{} {} {joint}", a.0, b.0);
        assert!((b.2 - 1.0).abs() < 0.02);
    }
}
