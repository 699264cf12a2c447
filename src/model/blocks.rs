//! What eq. 3 and eq. 6 come to for a set, about, from sums over its members alone: what surrogate scores and
//! the scores of leaving are made of.
//!
//! With n members and scatter W about their mean, ln I₀ is the closed form in the metric model,
//!
//! −(n−1)·ln(b_n/a) − (a·g·n/b_n)·W.
//!
//! In the covariance model it is what eq. 6 comes to for n detections of one covariance, W in Mahalanobis
//! units, with G = g(n−1) and the mean of b over the pairs, b̄ = W/(4(n−1)):
//!
//! −n·ln(1 + G/a) − W·[aG/(a+G)·n²/(n−1)² + g·n(n−2)/(n−1)] − g·n(n−1)·b̄·(b̄ + 2·√(2W/(n−1))·a/(a+G)).

use serde::{Deserialize, Serialize};

use super::Model;
use super::location_law::{whitened, whitening};

/// Sufficient statistics of a set: a function of who is in it, whatever the order in which they came.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Block {
    n: u32,
    /// Mean of z, m.
    mean_m: [f64; 2],
    /// Σ (z − z̄)(z − z̄)ᵀ: xx, xy, yy, m².
    scatter_m2: [f64; 3],
    /// Sum of C: xx, xy, yy, m²; 0 in the metric model.
    covariance_m2: [f64; 3],
    /// ln I₀.
    ln_gaussian: f64,
}

impl Block {
    /// Whether it has no member.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// ln I₀ without constants, about, nats; 0 for one member.
    pub fn ln_gaussian(&self) -> f64 {
        self.ln_gaussian
    }
}

/// The blocks of one model.
#[derive(Clone, Debug)]
pub struct Blocks<'a> {
    model: &'a Model,
    observation_precision: f64,
    topology_precision: f64,
}

impl<'a> Blocks<'a> {
    /// Of a model's detections.
    pub fn of(model: &'a Model) -> Self {
        let (observation_precision, topology_precision) = model.precisions();
        Self {
            model,
            observation_precision,
            topology_precision,
        }
    }

    /// The statistics of a set.
    pub fn block(&self, members: impl Iterator<Item = u32>) -> Block {
        let mut block = Block::default();
        for i in members {
            block = self.with(&block, i);
        }
        block
    }

    /// A block with detection i.
    pub fn with(&self, block: &Block, i: u32) -> Block {
        let n = f64::from(block.n);
        let z = self.model.positions_m()[i as usize];
        let d = [z[0] - block.mean_m[0], z[1] - block.mean_m[1]];
        let mut with = Block {
            n: block.n + 1,
            mean_m: [0, 1].map(|axis| block.mean_m[axis] + d[axis] / (n + 1.0)),
            ..*block
        };
        add_square(&mut with.scatter_m2, d, n / (n + 1.0));
        self.add_covariance(&mut with, i, 1.0);
        with.ln_gaussian = self.ln_gaussian(n + 1.0, self.scatter(&with));
        with
    }

    /// A block without its member i.
    pub fn without(&self, block: &Block, i: u32) -> Block {
        if block.n == 1 {
            return Block::default();
        }
        let n = f64::from(block.n - 1);
        let z = self.model.positions_m()[i as usize];
        // z − the mean of the others.
        let d = [0, 1].map(|axis| (z[axis] - block.mean_m[axis]) * (n + 1.0) / n);
        let mut without = Block {
            n: block.n - 1,
            mean_m: [z[0] - d[0], z[1] - d[1]],
            ..*block
        };
        add_square(&mut without.scatter_m2, d, -n / (n + 1.0));
        self.add_covariance(&mut without, i, -1.0);
        without.ln_gaussian = self.ln_gaussian(n, self.scatter(&without));
        without
    }

    /// The distance of detection i from the mean of a block, as the penalty sees a pair of i and a member with the
    /// block's mean covariance.
    pub fn distance(&self, block: &Block, i: u32) -> f64 {
        let z_m = self.model.positions_m()[i as usize];
        let whiten = match self.model {
            Model::Metric(_) => [1.0, 0.0, 1.0],
            Model::Covariance(model) => {
                let (own, n) = (model.covariance_m2(i), f64::from(block.n));
                let [xx, xy, yy] = block.covariance_m2;
                whitening([
                    0.5 * (own.xx + xx / n),
                    0.5 * (own.xy + xy / n),
                    0.5 * (own.yy + yy / n),
                ])
            }
        };
        let [x, y] = whitened(whiten, block.mean_m, z_m);
        x.hypot(y)
    }

    fn add_covariance(&self, block: &mut Block, i: u32, sign: f64) {
        if let Model::Covariance(model) = self.model {
            let c = model.covariance_m2(i);
            for (sum, value) in block.covariance_m2.iter_mut().zip([c.xx, c.xy, c.yy]) {
                *sum += sign * value;
            }
        }
    }

    /// W.
    fn scatter(&self, block: &Block) -> f64 {
        let [sxx, sxy, syy] = block.scatter_m2;
        let scatter = match self.model {
            Model::Metric(_) => sxx + syy,
            Model::Covariance(_) => {
                let [xx, xy, yy] = block.covariance_m2;
                let trace = yy * sxx - 2.0 * xy * sxy + xx * syy;
                f64::from(block.n) * trace / (xx * yy - xy * xy)
            }
        };
        scatter.max(0.0)
    }

    fn ln_gaussian(&self, n: f64, scatter: f64) -> f64 {
        if n < 2.0 {
            return 0.0;
        }
        let (a, g) = (self.observation_precision, self.topology_precision);
        match self.model {
            Model::Metric(model) => model.ln_gaussian_of(n as usize, scatter),
            Model::Covariance(_) => {
                let others = n - 1.0;
                let pull = g * others;
                let kept = a / (a + pull);
                let quadratic = kept * pull * (n / others).powi(2) + g * n * (n - 2.0) / others;
                let b = 0.25 * scatter / others;
                let cross = b + 2.0 * (2.0 * scatter / others).sqrt() * kept;
                -n * libm::log1p(pull / a) - scatter * quadratic - g * n * others * b * cross
            }
        }
    }
}

fn add_square(sum: &mut [f64; 3], d: [f64; 2], factor: f64) {
    sum[0] += factor * d[0] * d[0];
    sum[1] += factor * d[0] * d[1];
    sum[2] += factor * d[1] * d[1];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::Covariance;
    use crate::model::{CovarianceModel, Penalty, PenaltyShape};

    fn model(covariances_m2: [Covariance; 4], sigma_t: f64) -> CovarianceModel {
        let positions_m = [[0.0, 0.1], [0.6, 0.2], [0.3, -0.5], [-0.4, 0.3]];
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 2.0,
            height: 8.0,
        };
        CovarianceModel::new(&positions_m, &covariances_m2, 0.9, sigma_t, penalty)
            .expect("good covariances")
    }

    const ROUND: Covariance = Covariance {
        xx: 0.3,
        xy: 0.1,
        yy: 0.5,
    };

    /// From a block of one, the distance is that of the pair; from one of two, that by their mean
    /// covariance.
    #[test]
    fn the_distance_is_that_of_the_penalty() {
        let ellipse = |xx, xy, yy| Covariance { xx, xy, yy };
        let covariances_m2 = [
            ellipse(0.3, 0.1, 0.5),
            ellipse(0.8, -0.2, 0.4),
            ellipse(0.2, 0.05, 0.9),
            ellipse(0.6, 0.3, 0.3),
        ];
        let covariance = model(covariances_m2, 2.0);
        let model = Model::from(covariance.clone());
        let blocks = Blocks::of(&model);
        let z = model.positions_m();
        let one = blocks.distance(&blocks.block(std::iter::once(1)), 3);
        let [x, y] = whitened(covariance.pair_whitening(1, 3), z[1], z[3]);
        assert!((one - x.hypot(y)).abs() < 1e-14, "{one}");
        let two = blocks.distance(&blocks.block([1, 2].into_iter()), 3);
        // C̄ = ½ [C₃ + ½ (C₁ + C₂)]; dᵀC̄⁻¹d from its inverse.
        let mean = [0.55, 0.1125, 0.475];
        let d = [0, 1].map(|axis| z[3][axis] - 0.5 * (z[1][axis] + z[2][axis]));
        let determinant = mean[0] * mean[2] - mean[1] * mean[1];
        let square = (mean[2] * d[0] * d[0] - 2.0 * mean[1] * d[0] * d[1] + mean[0] * d[1] * d[1])
            / determinant;
        assert!((two * two - square).abs() < 1e-13, "{two} {square}");
    }

    /// With one covariance and a weak topology the closed form is that of eq. 6 to a few per cent.
    #[test]
    fn the_closed_form_is_about_the_integral() {
        let model = Model::from(model([ROUND; 4], 4.0));
        let blocks = Blocks::of(&model);
        let alone: f64 = model.set_law(&[0]).ln_integral;
        for members in [vec![0, 1], vec![0, 1, 2], vec![0, 1, 2, 3]] {
            let exact = model.set_law(&members).ln_integral - members.len() as f64 * alone;
            let about = blocks.block(members.iter().copied()).ln_gaussian();
            assert!((about / exact - 1.0).abs() < 0.1, "{exact} {about}");
        }
    }
}
