//! The posterior over topologies: everything that equations 1 to 5 of the source report define.
//!
//! π(T) ∝ P(T) ∫ exp(−E(X;T) − Pen(X;T)) dX, with one location x_i per **detection** (not per
//! landmark). The normaliser of P(X|T), which depends on T, is left out, as in the report and in
//! Ranganathan & Dellaert (T-RO 22(1), 2006): π is the posterior under an unnormalised penalty.
//!
//! In the metric model E is quadratic in X, so the optimum X\*, the covariance Σ of the report's eq. 4 and ∫exp(−E) are
//! closed forms ([`metric`]); only the expectation of exp(−Pen) is estimated, by importance
//! sampling from Q = N(X\*, Σ) ([`draws`]), and every importance weight of eq. 5 is
//! Π I₀ · exp(−Pen).
//!
//! The covariance model ([`covariance`]) has the same shape: every weight is a bound that a set has by
//! itself times exp(h − Pen) with h ≤ 0. [`Model`] is that seam: samplers see a bound for each set and
//! an average over draws that can only lower it, and know no model. What else a set has evidence of by itself,
//! as the kinds of its corners ([`appearance`]), is part of that bound.

pub mod appearance;
pub mod blocks;
pub mod common;
pub mod conditional;
pub mod covariance;
pub mod draws;
pub mod exact_site;
mod grid;
pub mod joining;
pub mod leaving;
pub mod location_law;
pub mod locations;
pub mod metric;
pub mod moments;
pub mod nearby;
pub mod neighbours;
pub mod numeric;
pub mod optimum;
pub mod penalty;
pub mod prior;
pub mod ring;
pub mod set_law;
pub mod site;
pub mod sum_of_norms;
pub mod surrogate;
pub mod tilt;
pub mod workspace;

pub use appearance::{Appearance, Confusion, CornerKinds};
pub use blocks::Block;
pub use common::CommonDraws;
pub use covariance::{CovarianceError, CovarianceModel};
pub use draws::Draws;
pub(crate) use exact_site::ExactSite;
pub use locations::Placer;
pub use metric::MetricModel;
pub use optimum::OptimumMethod;
pub use penalty::{Penalty, PenaltyShape};
pub use prior::Prior;
pub use set_law::SetLaw;
pub use surrogate::Surrogate;
pub use workspace::Workspace;

/// Either model of one data set.
#[derive(Clone, Debug)]
pub enum Model {
    /// Euclidean distances: eq. 3.
    Metric(MetricModel),
    /// Mahalanobis and Bhattacharyya distances: eq. 6.
    Covariance(CovarianceModel),
}

impl Model {
    /// Number of detections N.
    pub fn n_detections(&self) -> usize {
        match self {
            Self::Metric(model) => model.n_detections(),
            Self::Covariance(model) => model.n_detections(),
        }
    }

    /// z relative to the mean of all, m.
    pub fn positions_m(&self) -> &[[f64; 2]] {
        match self {
            Self::Metric(model) => model.positions_m(),
            Self::Covariance(model) => model.positions_m(),
        }
    }

    /// 1/σ_o² and 1/σ_t².
    pub fn precisions(&self) -> (f64, f64) {
        match self {
            Self::Metric(model) => model.precisions(),
            Self::Covariance(model) => model.precisions(),
        }
    }

    /// f of eq. 2.
    pub fn penalty(&self) -> &Penalty {
        match self {
            Self::Metric(model) => model.penalty(),
            Self::Covariance(model) => model.penalty(),
        }
    }

    /// The same model with the height of its penalty times β.
    #[must_use]
    pub fn with_penalty_scaled(&self, beta: f64) -> Self {
        let mut model = self.clone();
        match &mut model {
            Self::Metric(model) => model.penalty_mut().height *= beta,
            Self::Covariance(model) => model.penalty_mut().height *= beta,
        }
        model
    }

    /// The same model of some of its detections, in this order, where they are.
    #[must_use]
    pub fn part(&self, chosen: &[u32]) -> Self {
        match self {
            Self::Metric(model) => model.part(chosen).into(),
            Self::Covariance(model) => model.part(chosen).into(),
        }
    }

    /// What is left out of every log integral: N·ln(π/a) in the metric model, else nothing.
    pub fn ln_constant(&self) -> f64 {
        match self {
            Self::Metric(model) => model.ln_constant(),
            Self::Covariance(_) => 0.0,
        }
    }

    /// M of the distance |M(x_i − x_j)| that the penalty looks at, an upper triangle.
    pub fn pair_whitening(&self, i: u32, j: u32) -> [f64; 3] {
        match self {
            Self::Metric(_) => [1.0, 0.0, 1.0],
            Self::Covariance(model) => model.pair_whitening(i, j),
        }
    }

    /// The same model with evidence of what detections look like.
    #[must_use]
    pub fn with_appearance(self, appearance: Appearance) -> Self {
        match self {
            Self::Metric(model) => model.with_appearance(appearance).into(),
            Self::Covariance(model) => model.with_appearance(appearance).into(),
        }
    }

    /// What detections look like.
    pub fn appearance(&self) -> &Appearance {
        match self {
            Self::Metric(model) => model.appearance(),
            Self::Covariance(model) => model.appearance(),
        }
    }

    /// The law of the locations of a set under exp(−E), and its integral with the evidence of appearance;
    /// `members` in rising order.
    pub fn set_law(&self, members: &[u32]) -> SetLaw {
        let mut law = match self {
            Self::Metric(model) => optimum::set_law(model, members),
            Self::Covariance(model) => model.set_law(members),
        };
        law.ln_integral += self.appearance().ln_likelihood(members);
        law
    }
}

impl From<MetricModel> for Model {
    fn from(model: MetricModel) -> Self {
        Self::Metric(model)
    }
}

impl From<CovarianceModel> for Model {
    fn from(model: CovarianceModel) -> Self {
        Self::Covariance(model)
    }
}
