//! The law of one location given the others of its set, in the metric model (source report, eq. 3).
//!
//! Detection i at z, with n other locations x_j in its set, their mean x̄ and scatter W_x = Σ|x_j −
//! x̄|². With a = 1/σ_o², g = 1/σ_t² and b_n = a + g·n,
//!
//! ∫ exp(−a|x−z|² − g Σ_j|x−x_j|²) dx · a/π = exp(ln Z),
//! ln Z = −ln(b_n/a) − (a·g·n/b_n)·|z − x̄|² − g·W_x,
//!
//! and the location has the law N((a·z + g·n·x̄)/b_n, 1/(2b_n)) per axis. With n = 0 that is N(z,
//! 1/(2a)) and ln Z = 0.

use super::MetricModel;
use super::location_law::LocationLaw;
use super::moments::{Moments, square_distance};

/// What depends on the number of others alone.
#[derive(Clone, Copy, Debug)]
struct Terms {
    /// ln(b_n/a).
    ln_ratio: f64,
    /// a·g·n/b_n, m⁻².
    pull: f64,
    /// g·n/b_n.
    share_of_others: f64,
    /// 1/√(2b_n), m.
    sd_m: f64,
}

/// The laws of a data set's locations.
#[derive(Clone, Debug)]
pub struct Conditionals {
    by_others: Vec<Terms>,
    topology_precision: f64,
}

impl Conditionals {
    /// Of a model.
    pub fn new(model: &MetricModel) -> Self {
        let (a, g) = model.precisions();
        let ratio = (model.sigma_o_m() / model.sigma_t_m()).powi(2);
        let terms = |n: usize| {
            let n = n as f64;
            let b = a + g * n;
            Terms {
                ln_ratio: libm::log1p(n * ratio),
                pull: a * (g * n / b),
                share_of_others: g * n / b,
                sd_m: (0.5 / b).sqrt(),
            }
        };
        Self {
            by_others: (0..=model.n_detections()).map(terms).collect(),
            topology_precision: g,
        }
    }

    /// Of a detection at z, given the locations of the others of its set.
    #[inline]
    pub fn given(&self, z_m: [f64; 2], others: &Moments) -> LocationLaw {
        let terms = &self.by_others[others.n];
        let centre = others.mean_m;
        let towards = |axis: usize| z_m[axis] + terms.share_of_others * (centre[axis] - z_m[axis]);
        let ln_integral = -terms.ln_ratio
            - terms.pull * square_distance(z_m, centre)
            - self.topology_precision * others.scatter_m2;
        LocationLaw::round(ln_integral, [towards(0), towards(1)], terms.sd_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Penalty, PenaltyShape};

    /// Against the sums over a grid, for 0 to 3 others.
    #[test]
    fn integral_and_mean_are_those_of_the_definition() {
        let z = [[0.2, -0.1], [0.9, 0.4], [-0.3, 0.8], [0.5, 0.5]];
        let penalty = Penalty {
            shape: PenaltyShape::Cubic,
            radius_m: 1.0,
            height: 1.0,
        };
        let model = MetricModel::new(&z, 0.6, 0.8, penalty);
        let (a, g) = model.precisions();
        let z = model.positions_m();
        let others = [[0.7, 0.1], [-0.2, 0.3], [0.1, 0.9]];
        for n in 0..=3 {
            let moments = Moments::of(others[..n].iter().copied());
            let law = Conditionals::new(&model).given(z[0], &moments);
            let (mut sum, mut first, mut second, side) = (0.0, 0.0, 0.0, 0.01);
            for p in -400..400 {
                for q in -400..400 {
                    let x = [f64::from(p) * side, f64::from(q) * side];
                    let mut e = a * square_distance(x, z[0]);
                    for other in &others[..n] {
                        e += g * square_distance(x, *other);
                    }
                    let value = (-e).exp() * side * side;
                    sum += value;
                    first += value * x[0];
                    second += value * x[0] * x[0];
                }
            }
            let ln_sum = (sum * a / std::f64::consts::PI).ln();
            assert!((ln_sum - law.ln_bound).abs() < 1e-9, "{n}");
            let mean = first / sum;
            assert!((mean - law.mean_m[0]).abs() < 1e-9, "{n}");
            let variance = second / sum - mean * mean;
            assert!((variance - law.factor_m[0].powi(2)).abs() < 1e-9, "{n}");
        }
    }
}
