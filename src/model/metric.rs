//! The metric model (source report, eq. 3) in closed form.
//!
//! E(X;T) = Σ_i |x_i − z_i|²/σ_o² + Σ_{S∈T} Σ_{i<j∈S} |x_i − x_j|²/σ_t², unordered pairs.
//!
//! With a = 1/σ_o², g = 1/σ_t², n = |S|, b_n = a + g·n, z̄ the mean of the set and
//! W_S = Σ_{i∈S} |z_i − z̄|²:
//!
//! - ln I₀(S) = −(n−1)·ln(b_n/a) − (a·g·n/b_n)·W_S, the log of ∫exp(−E) over the members of S,
//!   without n·ln(π/a), which is the same for every topology in sum;
//! - X\*: x_i\* = z̄ + (a/b_n)(z_i − z̄);
//! - a draw from Q = N(X\*, Σ) of eq. 4: x_i = x_i\* + (ε_i − ε̄)/√(2b_n) + ε̄/√(2a) with ε_i ~ N(0, I₂)
//!   and ε̄ their mean within the set. Σ is the inverse Hessian of E, so Q is exact.
//!
//! The report finds X\* by BFGS because its notation hid that E is quadratic; [`optimum`](super::optimum) does as the
//! report does, as a check.

use nalgebra::DMatrix;

use super::{Appearance, OptimumMethod, Penalty, SetLaw};

/// The metric model of one data set.
#[derive(Clone, Debug)]
pub struct MetricModel {
    /// z, m, relative to their mean: differences of far-away coordinates would lose digits.
    positions_m: Vec<[f64; 2]>,
    sigma_o_m: f64,
    sigma_t_m: f64,
    /// (n−1)·ln(b_n/a) by n.
    ln_shrinkage: Vec<f64>,
    observation_precision: f64,
    topology_precision: f64,
    penalty: Penalty,
    optimum_method: OptimumMethod,
    appearance: Appearance,
}

/// How a set scales deviations, by its size: see [`MetricModel::shrinkage`].
#[derive(Clone, Copy, Debug)]
pub struct Shrinkage {
    /// a/b_n: what is left of a member's deviation from the mean of its set at X\*.
    pub deviation: f64,
    /// 1/√(2b_n), m: spread of the members round their mean.
    pub within_m: f64,
    /// 1/√(2a), m: spread per unit of ε̄.
    pub mean_m: f64,
}

impl MetricModel {
    /// For N ≥ 1 positions (m) and the scales σ_o, σ_t > 0 (m).
    pub fn new(positions_m: &[[f64; 2]], sigma_o_m: f64, sigma_t_m: f64, penalty: Penalty) -> Self {
        let n = positions_m.len() as f64;
        let centre = [0, 1].map(|axis| positions_m.iter().map(|z| z[axis] / n).sum::<f64>());
        // b/a as 1 + n(σ_o/σ_t)²: exact also where a or g is extreme.
        let ratio = (sigma_o_m / sigma_t_m) * (sigma_o_m / sigma_t_m);
        let ln_shrinkage = |n: usize| (n as f64 - 1.0) * libm::log1p(n as f64 * ratio);
        Self {
            ln_shrinkage: (0..=positions_m.len()).map(ln_shrinkage).collect(),
            positions_m: positions_m
                .iter()
                .map(|z| [z[0] - centre[0], z[1] - centre[1]])
                .collect(),
            sigma_o_m,
            sigma_t_m,
            observation_precision: 1.0 / (sigma_o_m * sigma_o_m),
            topology_precision: 1.0 / (sigma_t_m * sigma_t_m),
            penalty,
            optimum_method: OptimumMethod::ClosedForm,
            appearance: Appearance::default(),
        }
    }

    /// The same model of some of its detections, in this order, where they are.
    #[must_use]
    pub(super) fn part(&self, chosen: &[u32]) -> Self {
        let positions_m = chosen.iter().map(|&i| self.positions_m[i as usize]);
        Self {
            positions_m: positions_m.collect(),
            ln_shrinkage: self.ln_shrinkage[..=chosen.len()].to_vec(),
            appearance: self.appearance.part(chosen),
            penalty: self.penalty,
            ..*self
        }
    }

    /// The same model with X\* and Σ found in another way, for σ_o/σ_t within
    /// [`MOST_SCALE_RATIO`](super::optimum::MOST_SCALE_RATIO).
    #[must_use]
    pub fn with_optimum(mut self, method: OptimumMethod) -> Self {
        self.optimum_method = method;
        self
    }

    /// How X\* and Σ are found. The functions of this type are the closed form in any case.
    pub fn optimum_method(&self) -> OptimumMethod {
        self.optimum_method
    }

    /// The same model with evidence of what detections look like.
    #[must_use]
    pub fn with_appearance(mut self, appearance: Appearance) -> Self {
        self.appearance = appearance;
        self
    }

    /// What detections look like. The functions of this type are about locations alone.
    pub fn appearance(&self) -> &Appearance {
        &self.appearance
    }

    /// σ_o, m.
    pub fn sigma_o_m(&self) -> f64 {
        self.sigma_o_m
    }

    /// σ_t, m.
    pub fn sigma_t_m(&self) -> f64 {
        self.sigma_t_m
    }

    /// Number of detections N.
    pub fn n_detections(&self) -> usize {
        self.positions_m.len()
    }

    /// z relative to the mean of all, m.
    pub fn positions_m(&self) -> &[[f64; 2]] {
        &self.positions_m
    }

    /// a = 1/σ_o² and g = 1/σ_t², m⁻².
    pub fn precisions(&self) -> (f64, f64) {
        (self.observation_precision, self.topology_precision)
    }

    /// f of eq. 2.
    pub fn penalty(&self) -> &Penalty {
        &self.penalty
    }

    pub(super) fn penalty_mut(&mut self) -> &mut Penalty {
        &mut self.penalty
    }

    /// N·ln(π/a), the constant that `ln I₀` leaves out.
    pub fn ln_constant(&self) -> f64 {
        let variance_m2 = self.sigma_o_m * self.sigma_o_m;
        self.n_detections() as f64 * libm::log(std::f64::consts::PI * variance_m2)
    }

    /// Mean of the members' positions, m.
    pub fn mean_m(&self, members: &[u32]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for &i in members {
            let z = self.positions_m[i as usize];
            sum[0] += z[0];
            sum[1] += z[1];
        }
        sum.map(|total| total / members.len() as f64)
    }

    /// ln I₀(S) without constants, nats; always ≤ 0, and 0 for a singleton.
    pub fn ln_gaussian(&self, members: &[u32]) -> f64 {
        if members.len() == 1 {
            return 0.0;
        }
        let mean = self.mean_m(members);
        // Two passes: the scatter of a tight set far from the origin keeps its digits.
        let scatter_m2: f64 = members
            .iter()
            .map(|&i| {
                let z = self.positions_m[i as usize];
                (z[0] - mean[0]) * (z[0] - mean[0]) + (z[1] - mean[1]) * (z[1] - mean[1])
            })
            .sum();
        self.ln_gaussian_of(members.len(), scatter_m2)
    }

    /// ln I₀ of n members with the scatter W, m².
    pub fn ln_gaussian_of(&self, n: usize, scatter_m2: f64) -> f64 {
        let (a, g) = (self.observation_precision, self.topology_precision);
        let n_members = n as f64;
        let b = a + g * n_members;
        -self.ln_shrinkage[n] - (a * (g * n_members / b)) * scatter_m2
    }

    /// The law of the locations of a set under exp(−E).
    pub fn set_law(&self, members: &[u32]) -> SetLaw {
        let n = members.len();
        let (a, g) = (self.observation_precision, self.topology_precision);
        let (scales, centre) = (self.shrinkage(n), self.mean_m(members));
        let mut precision = DMatrix::zeros(2 * n, 2 * n);
        for k in 0..2 * n {
            for l in (k % 2..2 * n).step_by(2) {
                precision[(k, l)] = if k == l { a + g * (n as f64 - 1.0) } else { -g };
            }
        }
        let (within, mean) = (scales.within_m.powi(2), scales.mean_m.powi(2));
        let variance_m2 = within - (within - mean) / n as f64;
        let optimum = |&i: &u32| {
            let z = self.positions_m[i as usize];
            [0, 1].map(|axis| centre[axis] + scales.deviation * (z[axis] - centre[axis]))
        };
        SetLaw {
            ln_integral: self.ln_gaussian(members),
            ln_envelope: vec![0.0; n],
            mean_m: members.iter().map(optimum).collect(),
            covariance_m2: vec![[variance_m2, 0.0, variance_m2]; n],
            precision,
            sites: Vec::new(),
        }
    }

    /// The scales of a set of n members.
    pub fn shrinkage(&self, n: usize) -> Shrinkage {
        let (a, g) = (self.observation_precision, self.topology_precision);
        let b = a + g * n as f64;
        Shrinkage {
            deviation: a / b,
            within_m: (0.5 / b).sqrt(),
            mean_m: (0.5 / a).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::PenaltyShape;
    use nalgebra::DVector;

    fn model(positions_m: &[[f64; 2]]) -> MetricModel {
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.0,
            height: 1.0,
        };
        MetricModel::new(positions_m, 0.7, 1.3, penalty)
    }

    /// Straight from the definition: E = ½XᵀAX − BᵀX + C per axis, A positive definite.
    #[test]
    fn closed_form_is_the_gaussian_integral() {
        let positions_m = [[0.3, -1.0], [1.1, 0.4], [-0.6, 0.2], [0.0, 0.9]];
        let model = model(&positions_m);
        let (a, g) = (1.0 / (0.7 * 0.7), 1.0 / (1.3 * 1.3));
        for n in 1..=4 {
            let hessian = DMatrix::from_fn(n, n, |i, j| {
                if i == j {
                    2.0 * (a + g * (n as f64 - 1.0))
                } else {
                    -2.0 * g
                }
            });
            let inverse = hessian.clone().try_inverse().expect("positive definite");
            let mut ln_integral = 0.0;
            for axis in 0..2 {
                let z = DVector::from_fn(n, |i, _| model.positions_m()[i][axis]);
                let linear = &z * (2.0 * a);
                let optimum = &inverse * &linear;
                let at_zero = a * z.dot(&z);
                ln_integral += 0.5 * linear.dot(&optimum) - at_zero;
                ln_integral += 0.5 * n as f64 * (2.0 * std::f64::consts::PI).ln();
                ln_integral -= 0.5 * hessian.determinant().ln();
                let members: Vec<u32> = (0..n as u32).collect();
                let mean = model.mean_m(&members)[axis];
                for i in 0..n {
                    let shrunk = mean + model.shrinkage(n).deviation * (z[i] - mean);
                    assert!((shrunk - optimum[i]).abs() < 1e-12);
                }
            }
            let members: Vec<u32> = (0..n as u32).collect();
            let constant = model.ln_constant() * n as f64 / 4.0;
            assert!(
                (model.ln_gaussian(&members) + constant - ln_integral).abs() < 1e-11,
                "n = {n}"
            );
            // Covariance of the draws: within/mean scales against the inverse Hessian.
            let scales = model.shrinkage(n);
            let (w2, m2) = (scales.within_m.powi(2), scales.mean_m.powi(2));
            for i in 0..n {
                for j in 0..n {
                    let same = if i == j { w2 } else { 0.0 };
                    let covariance = same - w2 / n as f64 + m2 / n as f64;
                    assert!((covariance - inverse[(i, j)]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn far_from_the_origin_nothing_is_lost() {
        let near = model(&[[0.0, 0.0], [0.5, 0.25], [3.0, 1.0]]);
        let far = model(&[
            [1e7, -1e7],
            [1e7 + 0.5, -1e7 + 0.25],
            [1e7 + 3.0, -1e7 + 1.0],
        ]);
        assert!((near.ln_gaussian(&[0, 1, 2]) - far.ln_gaussian(&[0, 1, 2])).abs() < 1e-7);
    }

    #[test]
    fn every_merge_lowers_the_gaussian_part() {
        let model = model(&[[0.0, 0.0], [0.0, 0.0], [0.1, 0.0]]);
        assert!(model.ln_gaussian(&[0, 1]) < 0.0);
        assert!(model.ln_gaussian(&[0, 1, 2]) < model.ln_gaussian(&[0, 1]));
    }
}
