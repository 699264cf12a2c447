//! The law of one location without the penalty, as the moves of explicit locations draw from it.
//!
//! A location x of a detection has the density, up to a constant that is the same everywhere,
//!
//! exp(−E(x)) = e^{ln B} · N(x; m, L Lᵀ) · e^{h(x)},  h ≤ 0,
//!
//! E the terms of the energy that depend on x. In the metric model E is quadratic, h = 0 and B the
//! integral. In the covariance model E has the cones c_j·|M_j (x − z_j)| besides, c_j = 2b_ij/σ_t²:
//! a convex sum C(x), which lies above its tangent at any x₀. So
//!
//! h(x) = −(C(x) − C(x₀) − ∇C(x₀)·(x − x₀)) ≤ 0,
//!
//! and the tangent only moves the Gaussian of the quadratic part, whose covariance stays A⁻¹/2.
//! Weights e^h are bounded for every x₀, so nothing has to be optimised. A good x₀ makes them
//! nearly 1: [`joining`](super::CovarianceModel::joining) takes a few steps towards the optimum.

use std::ops::Range;

use super::moments::square_distance;

/// A term c·|M(x − z)|.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// c ≥ 0.
    pub weight: f64,
    /// M, an upper triangle, m⁻¹.
    pub whiten: [f64; 3],
    /// z, m.
    pub tip_m: [f64; 2],
}

impl Cone {
    /// M(x − z).
    #[inline(always)]
    pub fn at(&self, x_m: [f64; 2]) -> [f64; 2] {
        whitened(self.whiten, self.tip_m, x_m)
    }

    /// c·|M(x − z)|.
    #[inline(always)]
    pub fn height(&self, x_m: [f64; 2]) -> f64 {
        self.weight * square_distance(self.at(x_m), [0.0; 2]).sqrt()
    }
}

/// M(x − z), M an upper triangle.
#[inline(always)]
pub fn whitened(m: [f64; 3], z: [f64; 2], x: [f64; 2]) -> [f64; 2] {
    let d = [x[0] - z[0], x[1] - z[1]];
    [m[0] * d[0] + m[1] * d[1], m[2] * d[1]]
}

/// M with C⁻¹ = MᵀM, an upper triangle [[m₀, m₁], [0, m₂]], of C by xx, xy, yy.
pub fn whitening([xx, xy, yy]: [f64; 3]) -> [f64; 3] {
    let (det, root) = (xx * yy - xy * xy, yy.sqrt());
    [root / det.sqrt(), -xy / (det.sqrt() * root), 1.0 / root]
}

/// The law; its cones lie in a list of many laws' cones.
#[derive(Clone, Debug)]
pub struct LocationLaw {
    /// ln B, nats.
    pub ln_bound: f64,
    /// m, m.
    pub mean_m: [f64; 2],
    /// L: l₁₁, l₂₁, l₂₂, m.
    pub factor_m: [f64; 3],
    /// Where its cones are.
    pub cones: Range<usize>,
    /// ∇C(x₀), m⁻¹.
    pub slope: [f64; 2],
    /// The tangent at m: C(x₀) + ∇C(x₀)·(m − x₀).
    pub height: f64,
}

impl LocationLaw {
    /// A normal law alone, with one spread along both axes.
    #[inline(always)]
    pub fn round(ln_bound: f64, mean_m: [f64; 2], sd_m: f64) -> Self {
        Self {
            ln_bound,
            mean_m,
            factor_m: [sd_m, 0.0, sd_m],
            cones: 0..0,
            slope: [0.0; 2],
            height: 0.0,
        }
    }

    /// The location for two standard normal numbers.
    #[inline(always)]
    pub fn place(&self, normals: [f64; 2]) -> [f64; 2] {
        let l = &self.factor_m;
        [
            self.mean_m[0] + l[0] * normals[0],
            self.mean_m[1] + (l[1] * normals[0] + l[2] * normals[1]),
        ]
    }

    /// h(x) ≤ 0; `cones` is the list. What rounding leaves above is cut.
    #[inline]
    pub fn ln_excess(&self, cones: &[Cone], x_m: [f64; 2]) -> f64 {
        let cones = &cones[self.cones.clone()];
        if cones.is_empty() {
            return 0.0;
        }
        let sum: f64 = cones.iter().map(|cone| cone.height(x_m)).sum();
        let d = [0, 1].map(|axis| x_m[axis] - self.mean_m[axis]);
        let tangent = self.height + (self.slope[0] * d[0] + self.slope[1] * d[1]);
        -(sum - tangent).max(0.0)
    }
}

/// A normal law by its density.
#[derive(Clone, Copy, Debug)]
pub struct Normal {
    /// m, m.
    pub mean_m: [f64; 2],
    /// M, an upper triangle.
    pub whiten: [f64; 3],
    /// p: the density falls as exp(−p·|M(x − m)|²).
    pub precision: f64,
    ln_peak: f64,
}

impl Normal {
    /// The law of this form.
    pub fn new(mean_m: [f64; 2], whiten: [f64; 3], precision: f64) -> Self {
        let determinant = whiten[0] * whiten[2];
        Self {
            mean_m,
            whiten,
            precision,
            ln_peak: libm::log(precision / std::f64::consts::PI * determinant),
        }
    }

    /// ln of the density.
    #[inline]
    pub fn ln_density(&self, x_m: [f64; 2]) -> f64 {
        let e = whitened(self.whiten, self.mean_m, x_m);
        self.ln_peak - self.precision * square_distance(e, [0.0; 2])
    }

    /// V⁻¹d, V the covariance.
    pub fn pull(&self, d: [f64; 2]) -> [f64; 2] {
        let (m, scale) = (self.whiten, 2.0 * self.precision);
        let [x, y] = whitened(m, [0.0; 2], d);
        [scale * (m[0] * x), scale * (m[1] * x + m[2] * y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pull of a normal law is minus the slope of ln of its density.
    #[test]
    fn the_pull_is_the_slope_of_the_density() {
        let normal = Normal::new([0.3, -1.0], [0.8, -0.4, 1.7], 0.6);
        let d = [0.5, 0.7];
        let at = |d: [f64; 2]| normal.ln_density([0.3 + d[0], d[1] - 1.0]);
        let step = 1e-5;
        for (axis, pulled) in normal.pull(d).into_iter().enumerate() {
            let (mut up, mut down) = (d, d);
            up[axis] += step;
            down[axis] -= step;
            let slope = (at(up) - at(down)) / (2.0 * step);
            assert!((pulled + slope).abs() < 1e-8, "{pulled} {slope}");
        }
    }
}
