//! Weights for sets that plain draws cannot integrate: annealed importance sampling.
//!
//! Where landmarks must keep apart, exp(−Pen) of a draw from exp(−E) is next to nothing but for the few
//! that happen to lie apart. Two remedies, one on top of the other.
//!
//! **A Gaussian that knows of the penalty.** The Gaussian bound of [`bounds`](super::bounds) pushes sets
//! apart: with C its integral, q its law and U = Pen − h − θHn_p + s Σ d² ≥ 0,
//! exp(−E−Pen)/∫exp(−E) = C q e^{−U}, so that draws from q have weights of at most C.
//!
//! **Annealing** (Neal, Statistics and Computing 11, 2001). With X = X(ε) of law q for ε ~ N(0, I), a ladder
//! 0 = β₀ < … < β_K = 1, and
//!
//! ln w = ln C − Σ_k (β_k − β_{k−1}) U(ε_{k−1}),  ε_k from ε_{k−1} by a step that leaves N(ε) e^{−β_k U} as it is,
//!
//! E\[w\] = E\[exp(−Pen)\] whatever the ladder; K = 1 is q alone. The step is the preconditioned
//! Crank–Nicolson one, ε' = √(1−ρ²) ε + ρξ, accepted with min(1, e^{−β(U' − U)}) (Cotter, Roberts, Stuart &
//! White, Statistical Science 28, 2013).
//!
//! The ladder is fitted on draws of its own, with resampling, and then fixed: weights stay unbiased and
//! independent of each other, so that their mean has the standard error of any other.

use nalgebra::DMatrix;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::bounds::{FINE, Tilt, tilt};
use crate::model::{Model, SetLaw};

/// Each rung keeps this share of the draws' effective number.
const KEPT_SHARE: f64 = 0.8;
/// Steps on each rung: what is had by walking further is tails of the weights that are less heavy.
pub(super) const STEPS_PER_RUNG: usize = 4;
/// Rungs at most; above that the ladder ends in one jump, and the weights will say so.
const MAX_RUNGS: usize = 400;
/// ρ is raised and lowered so that about this share of steps is accepted.
const ACCEPTANCE: [f64; 2] = [0.2, 0.4];

/// One rung: β, and ρ of the step made there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rung {
    beta: f64,
    rho: f64,
}

/// R draws of the locations of some sets, on their way.
pub(super) struct Walkers<'a> {
    model: &'a Model,
    sets: &'a [(&'a [u32], &'a SetLaw)],
    n_draws: usize,
    /// Members (by their place) in different sets, with the whitening of the pair.
    pairs: Vec<(usize, usize, [f64; 3])>,
    tilt: Tilt,
    /// L⁻ᵀ/√2 of P' = LLᵀ, an upper triangle.
    spread_m: DMatrix<f64>,
    here: Points,
    there: Points,
}

/// ε and X of every member, place by place, and U of every draw.
#[derive(Clone)]
struct Points {
    epsilon: [Vec<f64>; 2],
    x_m: [Vec<f64>; 2],
    energy: Vec<f64>,
}

impl<'a> Walkers<'a> {
    /// Space for R draws; `None` if the law of a set is singular to rounding.
    pub fn new(
        model: &'a Model,
        sets: &'a [(&'a [u32], &'a SetLaw)],
        n_draws: usize,
    ) -> Option<Walkers<'a>> {
        let tilt = tilt(model, sets, FINE)?;
        let mut spread_m = tilt.factor.clone().transpose().try_inverse()?;
        spread_m /= std::f64::consts::SQRT_2;
        let places: Vec<(usize, u32)> = sets
            .iter()
            .enumerate()
            .flat_map(|(set, (members, _))| members.iter().map(move |&i| (set, i)))
            .collect();
        let mut pairs = Vec::new();
        for (a, &(set_a, i)) in places.iter().enumerate() {
            for (b, &(set_b, j)) in places.iter().enumerate().skip(a + 1) {
                if set_a != set_b {
                    pairs.push((a, b, model.pair_whitening(i, j)));
                }
            }
        }
        let values = || vec![0.0; places.len() * n_draws];
        let points = Points {
            epsilon: [values(), values()],
            x_m: [values(), values()],
            energy: vec![0.0; n_draws],
        };
        Some(Self {
            model,
            sets,
            n_draws,
            pairs,
            tilt,
            spread_m,
            there: points.clone(),
            here: points,
        })
    }

    /// A ladder for these sets.
    pub fn ladder(&mut self, rng: &mut impl Rng) -> Vec<Rung> {
        let (mut rungs, mut beta, mut rho) = (Vec::new(), 0.0, 1.0);
        self.start(rng);
        while beta < 1.0 {
            let next = if rungs.len() + 1 < MAX_RUNGS {
                self.next_beta(beta)
            } else {
                1.0
            };
            self.resample(next - beta, rng);
            beta = next;
            let mut accepted = 0.0;
            for _ in 0..STEPS_PER_RUNG {
                accepted += self.step(beta, rho, rng) / (STEPS_PER_RUNG * self.n_draws) as f64;
            }
            rungs.push(Rung { beta, rho });
            if accepted < ACCEPTANCE[0] {
                rho *= 0.7;
            } else if accepted > ACCEPTANCE[1] {
                rho = (rho * 1.2_f64).min(1.0);
            }
        }
        rungs
    }

    /// ln of R independent weights with the mean E[exp(−Pen)].
    pub fn ln_weights(&mut self, ladder: &[Rung], rng: &mut impl Rng) -> Vec<f64> {
        self.start(rng);
        let mut ln_weights = vec![self.tilt.ln_scale; self.n_draws];
        let mut beta = 0.0;
        for (k, rung) in ladder.iter().enumerate() {
            for (ln_weight, energy) in ln_weights.iter_mut().zip(&self.here.energy) {
                *ln_weight -= (rung.beta - beta) * energy;
            }
            beta = rung.beta;
            if k + 1 < ladder.len() {
                for _ in 0..STEPS_PER_RUNG {
                    self.step(beta, rung.rho, rng);
                }
            }
        }
        ln_weights
    }

    fn start(&mut self, rng: &mut impl Rng) {
        for values in &mut self.there.epsilon {
            values.fill_with(|| StandardNormal.sample(rng));
        }
        self.evaluate();
        std::mem::swap(&mut self.here, &mut self.there);
    }

    /// One step of every draw at β; how many were accepted.
    fn step(&mut self, beta: f64, rho: f64, rng: &mut impl Rng) -> f64 {
        let stay = (1.0 - rho * rho).sqrt();
        for (new, old) in self.there.epsilon.iter_mut().zip(&self.here.epsilon) {
            for (new, old) in new.iter_mut().zip(old) {
                let noise: f64 = StandardNormal.sample(rng);
                *new = stay * old + rho * noise;
            }
        }
        self.evaluate();
        let mut n_accepted = 0.0;
        for r in 0..self.n_draws {
            let ln_u = libm::log(1.0 - rng.random::<f64>());
            if ln_u >= -beta * (self.there.energy[r] - self.here.energy[r]) {
                continue;
            }
            n_accepted += 1.0;
            self.here.energy[r] = self.there.energy[r];
            for axis in 0..2 {
                let places = self.here.epsilon[axis].len() / self.n_draws;
                for place in 0..places {
                    let at = place * self.n_draws + r;
                    self.here.epsilon[axis][at] = self.there.epsilon[axis][at];
                }
            }
        }
        n_accepted
    }

    /// ε → X and U, of the points that are proposed.
    fn evaluate(&mut self) {
        let (n, points) = (self.n_draws, &mut self.there);
        // x = m + L⁻ᵀε/√2 with P' = LLᵀ, coordinate by coordinate.
        for coordinate in 0..self.tilt.mean_m.len() {
            let (place, axis) = (coordinate / 2, coordinate % 2);
            let values = &mut points.x_m[axis][place * n..(place + 1) * n];
            values.fill(self.tilt.mean_m[coordinate]);
            for other in coordinate..self.tilt.mean_m.len() {
                let weight = self.spread_m[(coordinate, other)];
                let source = &points.epsilon[other % 2][other / 2 * n..(other / 2 + 1) * n];
                for (value, epsilon) in values.iter_mut().zip(source) {
                    *value += weight * epsilon;
                }
            }
        }
        let [x, y] = &points.x_m;
        points.energy.fill(-self.tilt.level);
        let sites = self.sets.iter().flat_map(|(_, law)| &law.sites);
        for (place, site) in sites.enumerate() {
            for r in 0..n {
                let at = place * n + r;
                points.energy[r] -= site.site.ln_excess(site.site.epsilon_of([x[at], y[at]]));
            }
        }
        let penalty = self.model.penalty();
        let mut shares = vec![0.0; n];
        for &(a, b, whiten) in &self.pairs {
            let of = |place: usize| {
                let range = place * n..(place + 1) * n;
                [&x[range.clone()], &y[range]]
            };
            let ([x1, y1], [x2, y2]) = (of(a), of(b));
            for r in 0..n {
                let (dx, dy) = (x1[r] - x2[r], y1[r] - y2[r]);
                let (u, v) = (whiten[0] * dx + whiten[1] * dy, whiten[2] * dy);
                points.energy[r] += self.tilt.push * (u * u + v * v);
            }
            match self.model {
                Model::Metric(_) => penalty.add_pair([x1, y1], [x2, y2], &mut shares),
                Model::Covariance(_) => {
                    penalty.add_whitened_pair(whiten, [x1, y1], [x2, y2], &mut shares);
                }
            }
        }
        for (energy, share) in points.energy.iter_mut().zip(&shares) {
            *energy += penalty.height * share;
        }
    }

    /// β that keeps [`KEPT_SHARE`] of the effective number of draws, by bisection.
    fn next_beta(&self, beta: f64) -> f64 {
        let least = (self.here.energy.iter().copied()).fold(f64::INFINITY, f64::min);
        let kept = |step: f64| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for energy in &self.here.energy {
                let weight = libm::exp(-step * (energy - least));
                sum += weight;
                squares += weight * weight;
            }
            sum * sum / (squares * self.n_draws as f64)
        };
        if kept(1.0 - beta) >= KEPT_SHARE {
            return 1.0;
        }
        // In logarithms: heights of 1e6 start at steps of 1e-6.
        let (mut low, mut high) = (-80.0, libm::log(1.0 - beta));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if kept(libm::exp(middle)) >= KEPT_SHARE {
                low = middle;
            } else {
                high = middle;
            }
        }
        let next = beta + libm::exp(low);
        if next > beta { next } else { 1.0 }
    }

    /// Draws in proportion to their weights, systematically: for fitting the ladder only.
    fn resample(&mut self, step: f64, rng: &mut impl Rng) {
        let n = self.n_draws;
        let least = (self.here.energy.iter().copied()).fold(f64::INFINITY, f64::min);
        let weights: Vec<f64> = (self.here.energy.iter())
            .map(|energy| libm::exp(-step * (energy - least)))
            .collect();
        let spacing = weights.iter().sum::<f64>() / n as f64;
        let mut place = spacing * rng.random::<f64>();
        let (mut from, mut reached) = (0, weights[0]);
        for r in 0..n {
            while reached < place && from + 1 < n {
                from += 1;
                reached += weights[from];
            }
            place += spacing;
            self.there.energy[r] = self.here.energy[from];
            for axis in 0..2 {
                let places = self.here.epsilon[axis].len() / n;
                for k in 0..places {
                    self.there.epsilon[axis][k * n + r] = self.here.epsilon[axis][k * n + from];
                }
            }
        }
        std::mem::swap(&mut self.here, &mut self.there);
    }
}
