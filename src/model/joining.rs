//! The law of one location given who shares its set, in the covariance model, with a Gaussian above
//! it that needs no optimiser ([`location_law`](super::location_law)).
//!
//! With d = x − z_i and d_j = z_j − z_i, the energy of x in a set with others j is
//!
//! E_i(x) = (d − x_q)ᵀA(d − x_q) + k + C(x),
//! A = C_i⁻¹/σ_o² + Σ_j C_j⁻¹/σ_t², x_q = A⁻¹ Σ_j C_j⁻¹ d_j/σ_t²,
//! k = Σ_j (d_jᵀC_j⁻¹d_j + b_ij²)/σ_t² − x_qᵀA x_q, C(x) = Σ_j 2b_ij/σ_t² · |M_j (x − z_j)|.
//!
//! With the tangent s = ∇C(x₀), the mean of the Gaussian is x_q − A⁻¹s/2. x₀ comes from x_q by
//! Weiszfeld's steps: the cone c·r, r = |M_j (x − z_j)|, lies below c·(r² + r₀²)/(2r₀), r₀ its value
//! at the last point, so each step minimises a quadratic function above E_i and lowers E_i.

use super::CovarianceModel;
use super::location_law::{Cone, LocationLaw, whitened};
use super::moments::square_distance;

/// Steps from x_q towards the optimum. More hardly bring the bound nearer to that at the optimum.
const N_STEPS: usize = 3;
/// Distances below count as this much: a cone has no gradient at its tip.
const LEAST_DISTANCE: f64 = 1e-9;

/// A symmetric matrix: xx, xy, yy.
type Symmetric = [f64; 3];

fn solve([xx, xy, yy]: Symmetric, v: [f64; 2]) -> [f64; 2] {
    let det = xx * yy - xy * xy;
    [(yy * v[0] - xy * v[1]) / det, (xx * v[1] - xy * v[0]) / det]
}

fn dot(u: [f64; 2], v: [f64; 2]) -> f64 {
    u[0] * v[0] + u[1] * v[1]
}

/// MᵀM·v.
fn normal(m: [f64; 3], v: [f64; 2]) -> [f64; 2] {
    let [x, y] = whitened(m, [0.0; 2], v);
    [m[0] * x, m[1] * x + m[2] * y]
}

/// A quadratic function of d: matrix, and half of what its gradient lacks at 0.
#[derive(Clone, Copy)]
struct Quadratic {
    matrix: Symmetric,
    pull: [f64; 2],
}

impl Quadratic {
    /// Adds w·|M(d − e)|².
    #[inline(always)]
    fn add(&mut self, weight: f64, m: [f64; 3], e: [f64; 2]) {
        let inverse = [m[0] * m[0], m[0] * m[1], m[1] * m[1] + m[2] * m[2]];
        for (sum, value) in self.matrix.iter_mut().zip(inverse) {
            *sum += weight * value;
        }
        let pull = normal(m, e);
        self.pull[0] += weight * pull[0];
        self.pull[1] += weight * pull[1];
    }
}

impl CovarianceModel {
    /// ln of ∫exp(−E) of a detection alone: ln(π·σ_o²·√det C).
    pub fn ln_alone(&self, i: u32) -> f64 {
        let (a, _) = self.precisions();
        libm::log(std::f64::consts::PI / a) + self.ln_root_determinant(i)
    }

    /// C̄⁻¹ of a pair: the penalty sees dᵀC̄⁻¹d.
    #[inline(always)]
    pub fn pair_inverse(&self, i: u32, j: u32) -> Symmetric {
        let (a, b) = (self.covariance_m2(i), self.covariance_m2(j));
        let (xx, xy, yy) = (a.xx + b.xx, a.xy + b.xy, a.yy + b.yy);
        let scale = 2.0 / (xx * yy - xy * xy);
        [yy * scale, -xy * scale, xx * scale]
    }

    /// What the presence of i in its set costs a member j at x_j: (m(x_j; z_i, C_i) + b_ij)²/σ_t².
    pub fn cost_of(&self, i: u32, j: u32, x_m: [f64; 2]) -> f64 {
        let (_, g) = self.precisions();
        let from = whitened(self.whitening(i), self.positions_m()[i as usize], x_m);
        let m = square_distance(from, [0.0; 2]).sqrt();
        g * (m + self.bhattacharyya(i, j)).powi(2)
    }

    /// The law of the location of i in a set with these others; ln B is ln(π/√det A) − k less the
    /// tangent's part. Its cones are added to a list.
    pub fn joining(
        &self,
        i: u32,
        others: impl Iterator<Item = u32>,
        cones: &mut Vec<Cone>,
    ) -> LocationLaw {
        let (a, g) = self.precisions();
        let own = self.positions_m()[i as usize];
        let mut bowl = Quadratic {
            matrix: [0.0; 3],
            pull: [0.0; 2],
        };
        bowl.add(a, self.whitening(i), [0.0; 2]);
        let (first, mut constant) = (cones.len(), 0.0);
        for j in others {
            let (tip_m, whiten) = (self.positions_m()[j as usize], self.whitening(j));
            let d = [tip_m[0] - own[0], tip_m[1] - own[1]];
            bowl.add(g, whiten, d);
            let b = self.bhattacharyya(i, j);
            constant += g * (square_distance(whitened(whiten, [0.0; 2], d), [0.0; 2]) + b * b);
            cones.push(Cone {
                weight: 2.0 * g * b,
                whiten,
                tip_m,
            });
        }
        let [axx, axy, ayy] = bowl.matrix;
        let det = axx * ayy - axy * axy;
        let l11 = (ayy / (2.0 * det)).sqrt();
        let factor_m = [l11, -axy / (2.0 * det) / l11, (0.5 / ayy).sqrt()];
        let mut law = LocationLaw {
            ln_bound: libm::log(std::f64::consts::PI / det.sqrt()) - constant,
            mean_m: own,
            factor_m,
            cones: first..cones.len(),
            slope: [0.0; 2],
            height: 0.0,
        };
        let cones = &cones[first..];
        if cones.is_empty() {
            return law;
        }
        let at = |d: [f64; 2]| [own[0] + d[0], own[1] + d[1]];
        let middle = solve(bowl.matrix, bowl.pull);
        let mut near = middle;
        for _ in 0..N_STEPS {
            let mut above = bowl;
            for cone in cones {
                let r = square_distance(cone.at(at(near)), [0.0; 2]).sqrt();
                let weight = 0.5 * cone.weight / r.max(LEAST_DISTANCE);
                let tip = [cone.tip_m[0] - own[0], cone.tip_m[1] - own[1]];
                above.add(weight, cone.whiten, tip);
            }
            near = solve(above.matrix, above.pull);
        }
        let mut height = 0.0;
        for cone in cones {
            let up = cone.at(at(near));
            let r = square_distance(up, [0.0; 2]).sqrt();
            height += cone.weight * r;
            // Mᵀ·up over r; 0, which is as good, where the cone has no gradient.
            let scale = cone.weight / r.max(LEAST_DISTANCE);
            let m = cone.whiten;
            law.slope[0] += scale * (m[0] * up[0]);
            law.slope[1] += scale * (m[1] * up[0] + m[2] * up[1]);
        }
        let half = solve(bowl.matrix, law.slope);
        let mean = [0, 1].map(|axis| middle[axis] - 0.5 * half[axis]);
        let from_near = [0, 1].map(|axis| mean[axis] - near[axis]);
        law.height = height + dot(law.slope, from_near);
        // The least of the quadratic part and the tangent together, less `constant`: at the mean
        // (m − x_q)ᵀA(m − x_q) = sᵀA⁻¹s/4, and −x_qᵀA x_q of k.
        let least = 0.25 * dot(law.slope, half) - dot(bowl.pull, middle) + law.height;
        law.ln_bound -= least;
        law.mean_m = at(mean);
        law
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::model::site::tests::model;
    use crate::rng::Purpose;

    /// The bound, the normal law and h together are exp(−E) from its definition, and the bound is about
    /// as good as that at the optimum, also where that is at the tip of a cone, which the steps come to
    /// slowly.
    #[test]
    fn bound_and_excess_are_the_energy() {
        let mut rng = Purpose::new("joining test", 1).generator();
        let (mut n_checks, mut lost) = (0, 0.0);
        for seed in 0..40 {
            let (model, mut cones) = (model(seed), Vec::new());
            let (a, g) = model.precisions();
            for n in 1..=6_u32 {
                let members: Vec<u32> = (0..n).collect();
                let sites = model.sites(&members);
                for i in 0..n {
                    let others = members.iter().copied().filter(|&j| j != i);
                    let law = model.joining(i, others, &mut cones);
                    let tightest = sites.sites[i as usize].ln_bound;
                    assert!(law.ln_bound > tightest - 1e-9 * (1.0 + tightest.abs()));
                    lost += law.ln_bound - tightest;
                    for _ in 0..20 {
                        let e = [0; 2].map(|_| 2.0 * rng.sample::<f64, _>(StandardNormal));
                        let x = law.place(e);
                        let energy: f64 = members
                            .iter()
                            .map(|&j| {
                                let z = model.positions_m()[j as usize];
                                let [u, v] = whitened(model.whitening(j), z, x);
                                if j == i {
                                    a * (u * u + v * v)
                                } else {
                                    g * (u.hypot(v) + model.bhattacharyya(i, j)).powi(2)
                                }
                            })
                            .sum();
                        // (π/√det A)·N(x) = exp(−|ε|²/2).
                        let normal = -0.5 * dot(e, e);
                        let got =
                            law.ln_bound - (ln_volume(&law) - normal) + law.ln_excess(&cones, x);
                        assert!(
                            (got + energy).abs() < 1e-7 * (1.0 + energy),
                            "{seed} {n} {i}: {got} {energy}"
                        );
                        n_checks += 1;
                    }
                }
            }
        }
        assert!(n_checks == 40 * 21 * 20);
        let mean = lost / f64::from(40 * 21);
        assert!(mean < 0.3, "{mean}");
    }

    /// ln(π/√det A) = ln(2π det L).
    fn ln_volume(law: &LocationLaw) -> f64 {
        (std::f64::consts::TAU * law.factor_m[0] * law.factor_m[2]).ln()
    }

    #[test]
    fn a_detection_alone_has_its_own_covariance() {
        let model = model(3);
        for i in 0..6 {
            let law = model.joining(i, std::iter::empty(), &mut Vec::new());
            assert!((law.ln_bound - model.ln_alone(i)).abs() < 1e-12);
            assert_eq!(law.mean_m, model.positions_m()[i as usize]);
            let (c, l) = (model.covariance_m2(i), law.factor_m);
            let scale = 0.5 / model.precisions().0;
            for (got, expected) in [
                (l[0] * l[0], c.xx),
                (l[0] * l[1], c.xy),
                (l[1] * l[1] + l[2] * l[2], c.yy),
            ] {
                assert!((got - scale * expected).abs() < 1e-9 * c.xx.max(c.yy));
            }
        }
    }
}
