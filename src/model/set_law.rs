//! The law of the locations of one set under exp(−E), and a Gaussian that lies above it.
//!
//! With n members, x their 2n coordinates and P symmetric positive definite,
//!
//! exp(−E_S(x)) / ∫exp(−E_S) ≤ Π_i e^{k_i} · N(x; m, P⁻¹/2),
//!
//! with equality and k = 0 for the metric model. What the room `exact` bounds, it bounds by this:
//! the probability that two sets come within the radius, and E[exp(−Pen)] from above.

use nalgebra::DMatrix;

use super::exact_site::ExactSite;

/// The law of the locations of one set, its members in the order in which they were given.
#[derive(Clone, Debug)]
pub struct SetLaw {
    /// ln ∫exp(−E_S), less the constants that the model leaves out; from [`Model`](super::Model) with ln P(O_S).
    pub ln_integral: f64,
    /// k_i ≥ 0 of each member.
    pub ln_envelope: Vec<f64>,
    /// m of each member, m.
    pub mean_m: Vec<[f64; 2]>,
    /// Covariance of each member under the Gaussian: xx, xy, yy, m².
    pub covariance_m2: Vec<[f64; 3]>,
    /// P, m⁻², coordinates x₀, y₀, x₁, y₁, …
    pub precision: DMatrix<f64>,
    /// Where draws come from in the covariance model; empty for the metric one.
    pub sites: Vec<ExactSite>,
}
