//! How worth a try it is that a detection leaves its set: a score of a detection and its set, of z
//! alone.
//!
//! v(i, S) = 1 for a set of one, else I₀(S∖i)·P(T')/(I₀(S)·P(T)) · p̂(d, n) within [10⁻⁴, 1]: about
//! the odds of the topology in which i is by itself. With n members left at their mean z̄, d = |z_i
//! − z̄|, p̂ is the chance E[exp(−n·f(r − s))] that the location of i gets out of their penalty, r
//! = |x − z̄| for x ~ N(z_i, (1 + 1/n)/(2a)) (so r has a Rice law) and s = 0.7·√(2 ln n)/√(2b_n)
//! for the spread of the members. The numbers are from trials; they cost speed, never exactness.

use super::{Model, Penalty};

/// Members left, at most, for which a score is computed.
pub const MOST_SCORED: usize = 32;
/// The score of every member of a larger set.
pub const SCORE_IN_LARGE: f64 = 0.003;

/// No score is lower.
const LEAST: f64 = 1e-4;
/// Share of the members' largest deviation that they are taken to reach towards x.
const SPREAD: f64 = 0.7;
/// Intervals of d from 0 to 2D.
const N_DISTANCES: usize = 48;
/// Nodes of the integral over r, within eight standard deviations.
const N_NODES: u32 = 64;
const SDS: f64 = 8.0;

/// ln p̂ by the number of members left and d.
#[derive(Clone, Debug)]
pub struct LeavingScores {
    ln_chance: Vec<f64>,
    per_m: f64,
}

impl LeavingScores {
    /// Of a model: in the covariance model of distances in Mahalanobis units, as if all covariances
    /// were one.
    pub fn new(model: &Model) -> Self {
        let most = MOST_SCORED.min(model.n_detections().saturating_sub(1));
        let radius_m = model.penalty().radius_m;
        let mut ln_chance = vec![0.0; (most + 1) * (N_DISTANCES + 1)];
        for n in 1..=most {
            for k in 0..=N_DISTANCES {
                let d = 2.0 * radius_m * k as f64 / N_DISTANCES as f64;
                ln_chance[n * (N_DISTANCES + 1) + k] = ln_chance_out(model, n, d);
            }
        }
        Self {
            ln_chance,
            per_m: N_DISTANCES as f64 / (2.0 * radius_m),
        }
    }

    /// The score, from ln of the odds without p̂, the number of members left (at most
    /// [`MOST_SCORED`]), and d.
    #[inline]
    pub fn score(&self, ln_odds: f64, n_left: usize, d_m: f64) -> f64 {
        let place = d_m * self.per_m;
        let ln_chance = if place < N_DISTANCES as f64 {
            let k = place as usize;
            let row = &self.ln_chance[n_left * (N_DISTANCES + 1) + k..][..2];
            row[0] + (place - k as f64) * (row[1] - row[0])
        } else {
            0.0
        };
        let ln_score = ln_odds + ln_chance;
        if ln_score > 0.0 {
            1.0
        } else {
            libm::exp(ln_score).max(LEAST)
        }
    }
}

fn ln_chance_out(model: &Model, n: usize, d: f64) -> f64 {
    let Penalty {
        shape,
        radius_m,
        height,
    } = *model.penalty();
    let (a, g) = model.precisions();
    let n_left = n as f64;
    let variance = (1.0 + 1.0 / n_left) / (2.0 * a);
    let spread = SPREAD * (libm::log(n_left) / (a + g * n_left)).sqrt();
    let sd = variance.sqrt();
    let low = (d - SDS * sd).max(0.0);
    let step = (d + SDS * sd - low) / f64::from(N_NODES);
    let mut chance = 0.0;
    for k in 0..N_NODES {
        let r = low + step * (f64::from(k) + 0.5);
        let u = (r - spread).max(0.0) / radius_m;
        let pays = if r >= radius_m {
            0.0
        } else {
            n_left * height * Penalty::share(shape, u * u)
        };
        let exponent = -(r - d) * (r - d) / (2.0 * variance) - pays;
        chance += step * r / variance * libm::exp(exponent) * scaled_bessel(r * d / variance);
    }
    libm::log(chance.max(1e-60)).min(0.0)
}

/// e^{−q}·I₀(q), q ≥ 0 (Abramowitz & Stegun 9.8.1, 9.8.2; 2·10⁻⁷).
fn scaled_bessel(q: f64) -> f64 {
    let polynomial = |t: f64, terms: &[f64]| terms.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if q < 3.75 {
        let t = (q / 3.75) * (q / 3.75);
        let terms = [
            1.0,
            3.515_622_9,
            3.089_942_4,
            1.206_749_2,
            0.265_973_2,
            0.036_076_8,
            0.004_581_3,
        ];
        libm::exp(-q) * polynomial(t, &terms)
    } else {
        let terms = [
            0.398_942_28,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        polynomial(3.75 / q, &terms) / q.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, PenaltyShape};
    use crate::rng::Purpose;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_chance_is_that_of_draws() {
        let penalty = Penalty {
            shape: PenaltyShape::Cubic,
            radius_m: 1.5,
            height: 3.0,
        };
        let model = Model::from(MetricModel::new(&[[0.0, 0.0]; 6], 0.8, 0.7, penalty));
        let mut rng = Purpose::new("leaving test", 1).generator();
        for (n, d) in [(1, 0.0), (1, 0.9), (4, 0.4), (5, 2.0)] {
            let (a, g) = model.precisions();
            let sd = ((1.0 + 1.0 / f64::from(n)) / (2.0 * a)).sqrt();
            let spread =
                0.7 * (2.0 * f64::from(n).ln()).sqrt() / (2.0 * (a + g * f64::from(n))).sqrt();
            let n_draws = 200_000;
            let mut mean = 0.0;
            for _ in 0..n_draws {
                let [x, y]: [f64; 2] = [
                    StandardNormal.sample(&mut rng),
                    StandardNormal.sample(&mut rng),
                ];
                let r = (d + sd * x).hypot(sd * y);
                let u = (r - spread).max(0.0) / 1.5;
                let f = if r >= 1.5 {
                    0.0
                } else {
                    3.0 * Penalty::share(PenaltyShape::Cubic, u * u)
                };
                mean += (-f64::from(n) * f).exp() / f64::from(n_draws);
            }
            let got = ln_chance_out(&model, n as usize, d).exp();
            // Five standard errors of a mean of numbers between 0 and 1 at most, and a hundredth for
            // the few nodes across the jump at D.
            let error = 0.01 + 5.0 * 0.5 / f64::from(n_draws).sqrt();
            assert!((got - mean).abs() < error, "{n} {d}: {got} {mean}");
        }
        // A table between its nodes, and its ends.
        let scores = LeavingScores::new(&model);
        let exact = ln_chance_out(&model, 3, 0.77).exp();
        assert!((scores.score(0.0, 3, 0.77) - exact).abs() < 0.02 * exact);
        assert_eq!(scores.score(0.0, 3, 3.1), 1.0);
        assert_eq!(scores.score(-50.0, 3, 3.1), 1e-4);
        assert_eq!(scores.score(50.0, 3, 3.1), 1.0);
    }
}
