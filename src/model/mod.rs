//! The posterior over topologies: everything that equations 1 to 5 of the source report define.
//!
//! π(T) ∝ P(T) ∫ exp(−E(X;T) − Pen(X;T)) dX, with one location x_i per **detection** (not per
//! landmark). The normaliser of P(X|T), which depends on T, is left out, as in the report and in
//! Ranganathan & Dellaert (T-RO 22(1), 2006): π is the posterior under an unnormalised penalty.
//!
//! E is quadratic in X, so the optimum X\*, the covariance Σ of the report's eq. 4 and ∫exp(−E) are
//! closed forms ([`metric`]); only the expectation of exp(−Pen) is estimated, by importance
//! sampling from Q = N(X\*, Σ) ([`draws`]), and every importance weight of eq. 5 is
//! Π I₀ · exp(−Pen).

pub mod draws;
pub mod metric;
pub mod numeric;
pub mod penalty;
pub mod prior;
pub mod set_law;

pub use draws::Draws;
pub use metric::MetricModel;
pub use penalty::{Penalty, PenaltyShape};
pub use prior::Prior;
pub use set_law::SetLaw;
