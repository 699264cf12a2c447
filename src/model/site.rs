//! One location under the covariance model: the optimum and the Gaussian around it.
//!
//! Given its set S, the location x of detection i has the convex energy
//!
//! E_i(x) = m_i²/σ_o² + Σ_{j∈S, j≠i} (m_j + b_ij)²/σ_t²,  m_j = |M_j (x − z_j)|,  C_j⁻¹ = M_jᵀM_j.
//!
//! Its quadratic part has the matrix A = C_i⁻¹/σ_o² + Σ C_j⁻¹/σ_t². With L Lᵀ = A⁻¹/2 and the minimiser
//! x_q of that part, x = x_q + Lε turns the rest into a sum of norms ([`sum_of_norms`](super::sum_of_norms)),
//!
//! F(ε) = |ε|²/2 + Σ_j c_j |K_j ε + v_j|,  c_j = 2 b_ij/σ_t², K_j = M_j L, v_j = M_j (x_q − z_j).
//!
//! From the optimum on, with ε ~ N(0, I),
//!
//! ln w = ln(π/√det A) − E\* + h,  h(ε) = −(g·ε + Σ_j c_j (|K_j ε + v_j| − |v_j|)) ≤ 0,
//!
//! g the gradient of the quadratic part at x\*: the weights of Q = N(x\*, A⁻¹/2) are bounded, because
//! the whole curvature of the norms is left out of A. The integral is in [`exact_site`](super::exact_site).

use nalgebra::Vector2;

use super::sum_of_norms::SumOfNorms;

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
    pub fn depth(&self, u: [f64; 2], r: f64) -> f64 {
        0.5 * r * r - self.ln_excess([r * u[0], r * u[1]])
    }

    /// Where φ reaches `nats` on a ray: φ is convex and at least r²/2.
    pub fn radius_at(&self, u: [f64; 2], nats: f64) -> f64 {
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

#[cfg(test)]
pub(super) mod tests {
    use std::f64::consts::PI;

    use rand::RngExt;
    use rand_distr::StandardNormal;

    use crate::detections::Covariance;
    use crate::model::{CovarianceModel, Penalty, PenaltyShape};
    use crate::rng::Purpose;

    /// |Mx|² ≥ |x|²/λ in every direction x, λ the bound of the largest eigenvalue of C̄; of
    /// detections with one covariance it is reached.
    #[test]
    fn no_pair_is_wider_than_its_bound() {
        let model = model(3);
        for (i, j) in [(0, 1), (1, 2), (3, 4), (0, 3), (2, 5)] {
            let widest_m2 = model.pair_widest_m2(i, j);
            assert!(widest_m2 <= model.widest_m2());
            let [a, b, c] = model.pair_whitening(i as u32, j as u32);
            let square = |k: i32| {
                let (sin, cos) = (f64::from(k) * PI / 180.0).sin_cos();
                (a * cos + b * sin).powi(2) + (c * sin).powi(2)
            };
            let least = (0..180).map(square).fold(f64::INFINITY, f64::min);
            assert!(least * widest_m2 >= 1.0 - 1e-12, "{i} {j}");
            let same = model.covariance_m2(i as u32) == model.covariance_m2(j as u32);
            assert!(!same || least * widest_m2 < 1.001, "{i} {j}");
        }
    }

    /// Random detections; some coincide, some share a covariance, some are thin.
    pub(in crate::model) fn model(seed: u64) -> CovarianceModel {
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
}
