//! Settings tried out: the model that they make of positions, and the MAP topology of one chain.

use super::rule::{ModelKind, Tuned};
use crate::chain::{self, Start, TraceRecorder};
use crate::detections::{Covariance, Detections};
use crate::model::{CovarianceError, CovarianceModel, MetricModel, Model, Penalty};
use crate::model::{PenaltyShape, Prior};
use crate::partition::Topology;
use crate::rng::Purpose;
use crate::sampler::{Arithmetic, Estimator, MoveMix, SamplerSettings, SplitRule};

const FEWEST_PROPOSALS: usize = 2000;
const PROPOSALS_PER_DETECTION: usize = 60;
/// Topologies that a chain remembers.
const MOST_TOPOLOGIES: usize = 1000;

/// Which model is tuned, and how its detections err relative to each other.
#[derive(Clone, Debug)]
pub struct Errors {
    kind: ModelKind,
    /// C_i: the stated covariances, m², or the unit matrix for the metric model.
    shapes: Vec<Covariance>,
}

/// Detections that the covariance model cannot be made of.
#[derive(Debug, thiserror::Error)]
pub enum ErrorsError {
    /// No covariances.
    #[error(
        "got detections without covariances, expected the columns cov_xx,cov_xy,cov_yy for --model covariance; add \
         them, or leave --model out"
    )]
    None,
    /// A covariance that is none.
    #[error(transparent)]
    Bad(#[from] CovarianceError),
}

impl Errors {
    /// Of detections, for a model.
    ///
    /// # Errors
    /// The covariance model without good covariances.
    pub fn of(detections: &Detections, kind: ModelKind) -> Result<Self, ErrorsError> {
        let shapes = match kind {
            ModelKind::Metric => vec![ROUND; detections.len()],
            ModelKind::Covariance => detections.covariances_m2().ok_or(ErrorsError::None)?,
        };
        if kind == ModelKind::Covariance {
            let nothing = Penalty {
                shape: PenaltyShape::Quadratic,
                radius_m: 1.0,
                height: 0.0,
            };
            CovarianceModel::new(&detections.positions_m(), &shapes, 1.0, 1.0, nothing)?;
        }
        Ok(Self { kind, shapes })
    }

    /// Which model.
    pub fn kind(&self) -> ModelKind {
        self.kind
    }

    /// C_i.
    pub fn shapes(&self) -> &[Covariance] {
        &self.shapes
    }

    /// The length of one unit of the noise for the median detection, m: 1 for the metric model.
    pub fn unit_m(&self) -> f64 {
        let length = |c: &Covariance| libm::sqrt(libm::sqrt(c.determinant()));
        let mut lengths: Vec<f64> = self.shapes.iter().map(length).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied().unwrap_or(1.0)
    }

    /// How far detections i and j lie apart, given the way between them, m: √(wᵀ C̄⁻¹ w), C̄ = (C_i + C_j)/2.
    pub fn distance(&self, i: usize, j: usize, [x, y]: [f64; 2]) -> f64 {
        let (a, b) = (self.shapes[i], self.shapes[j]);
        let [xx, xy, yy] = [a.xx + b.xx, a.xy + b.xy, a.yy + b.yy].map(|v| v / 2.0);
        libm::sqrt((yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy))
    }

    /// The model of detections at these positions, m.
    pub fn model(&self, positions_m: &[[f64; 2]], settings: &Tuned) -> Model {
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: settings.penalty_radius,
            height: settings.penalty_height,
        };
        let (o, t) = (settings.sigma_o, settings.sigma_t);
        match self.kind {
            ModelKind::Metric => MetricModel::new(positions_m, o, t, penalty).into(),
            ModelKind::Covariance => CovarianceModel::new(positions_m, &self.shapes, o, t, penalty)
                .expect("covariances were looked at before")
                .into(),
        }
    }
}

const ROUND: Covariance = Covariance {
    xx: 1.0,
    xy: 0.0,
    yy: 1.0,
};

/// Proposals of a trial on so many detections.
pub fn n_proposals(n: usize) -> usize {
    (PROPOSALS_PER_DETECTION * n).max(FEWEST_PROPOSALS)
}

/// The sampler of a trial: the one that the figures of `docs/tune.md` were measured with.
fn sampler() -> SamplerSettings {
    SamplerSettings {
        moves: MoveMix::default_of(Estimator::Common),
        estimator: Estimator::Common,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 30,
        candidates: 1,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

/// The topology that a chain sampled most, without its first third.
pub fn map(model: &Model, start: &Start, purpose: &Purpose) -> Topology {
    let n_steps = n_proposals(model.n_detections()) as u64;
    let mut recorder = TraceRecorder::new(MOST_TOPOLOGIES);
    chain::run(
        model,
        Prior::Uniform,
        &sampler(),
        start,
        n_steps,
        purpose,
        &mut recorder,
    );
    let mut rows = recorder.finish().frequencies(n_steps / 3);
    rows.swap_remove(0).topology
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::Detection;

    #[test]
    fn distances_are_in_the_unit_of_the_model() {
        let at = |x: f64, xx: f64, yy: f64| Detection {
            covariance_m2: Some(Covariance { xx, xy: 0.0, yy }),
            ..Detection::at(x, 0.0)
        };
        let detections = vec![at(0.0, 1.0, 4.0), at(3.0, 3.0, 4.0)];
        let detections = Detections::new(detections).expect("good");
        let of = |kind| Errors::of(&detections, kind).expect("good covariances");
        let way = [3.0, 4.0];
        assert!((of(ModelKind::Metric).distance(0, 1, way) - 5.0).abs() < 1e-12);
        // 9/2 + 16/4
        let expected = 8.5_f64.sqrt();
        assert!((of(ModelKind::Covariance).distance(0, 1, way) - expected).abs() < 1e-12);
        assert_eq!(of(ModelKind::Metric).unit_m(), 1.0);
        assert!((of(ModelKind::Covariance).unit_m() - 12.0_f64.powf(0.25)).abs() < 1e-12);
    }
}
