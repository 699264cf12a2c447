//! Integrals that plain draws cannot see: sequential Monte Carlo from the law without penalty to the
//! law with it.
//!
//! Where landmarks must keep apart, exp(−Pen) of a draw from exp(−E) is next to nothing but for the few
//! that happen to lie apart. Three remedies, one on top of the other.
//!
//! **A Gaussian that knows of the penalty.** The Gaussian bound of [`bounds`](super::bounds) pushes sets
//! apart: with C its integral, q its law and U = Pen − h − θHn_p + s Σ d² ≥ 0,
//! exp(−E−Pen)/∫exp(−E) = C q e^{−U}, so that draws from q have weights of at most C. Where no bound is
//! below 1, q is exp(−E) itself (or its Gaussian) and U = Pen − h.
//!
//! **A ladder** 0 = β₀ < … < β_K = 1 of laws q e^{−β_k U} (Del Moral, Doucet & Jasra, JRSS B 68, 2006). R
//! draws from q are weighted with e^{−(β_k − β_{k−1}) U}, resampled and moved, rung by rung, and
//!
//! Ẑ = C Π_k (1/R) Σ_r e^{−(β_k − β_{k−1}) U_r},  E\[Ẑ\] = E\[exp(−Pen)\],
//!
//! whatever the ladder and the moves. The ladder is fitted on draws of its own and then fixed, so runs
//! down it are independent and unbiased, and the spread of their Ẑ is the standard error.
//!
//! **Moves of one location at a time.** Given the others of its set, a location has a Gaussian law under
//! q; the proposal is x' = μ + √(1−ρ²)(x − μ) + ρξ with ξ of that law's covariance, which leaves q as it
//! is, accepted with min(1, e^{−β(U' − U)}). ρ = 1 jumps to the other side of a landmark, small ρ settles.

use nalgebra::DMatrix;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::bounds::{FINE, Tilt, tilt};
use crate::model::{ExactSite, Model, SetLaw};

/// Each rung keeps this share of the draws' effective number.
const KEPT_SHARE: f64 = 0.7;
/// ρ of the sweeps over all locations that are made on each rung.
const SWEEPS: [f64; 3] = [1.0, 0.6, 0.3];
/// Rungs at most; above that the ladder ends in one jump, and the spread will say so.
const MAX_RUNGS: usize = 400;
/// Evaluations of the penalty that a sweep is worth: every pair twice, before and after.
const EVALUATIONS_PER_SWEEP: usize = 4;
/// Draws that go down a ladder together.
pub(super) const N_WALKERS: usize = 128;
/// Runs down a ladder before their spread is believed.
pub(super) const LEAST_RUNS: usize = 10;

/// Evaluations of the penalty in one run down a ladder.
pub(super) fn n_evaluations(n_rungs: usize) -> usize {
    N_WALKERS * (1 + EVALUATIONS_PER_SWEEP * SWEEPS.len() * (n_rungs - 1))
}

/// R draws of the locations of some sets, on their way.
pub(super) struct Walkers<'a> {
    model: &'a Model,
    /// The members, by their place.
    places: Vec<Place<'a>>,
    tilt: Tilt,
    /// L⁻ᵀ/√2 of P' = LLᵀ, an upper triangle.
    spread_m: DMatrix<f64>,
    /// X of every member, place by place, and U of every draw.
    here: Points,
    there: Points,
    scratch: Scratch,
}

/// One location, and what it depends on.
struct Place<'a> {
    /// Of the covariance model: h of this location.
    site: Option<&'a ExactSite>,
    /// −P'_kk⁻¹ P'_kj for every other place j that has an influence.
    pulls: Vec<(usize, [[f64; 2]; 2])>,
    /// A lower triangle S with SSᵀ = P'_kk⁻¹/2.
    spread_m: [f64; 3],
    /// The places in other sets, with the whitening of the pair.
    others: Vec<(usize, [f64; 3])>,
}

#[derive(Clone)]
struct Points {
    x_m: [Vec<f64>; 2],
    energy: Vec<f64>,
}

/// R values each, for one location that moves.
struct Scratch {
    proposed_m: [Vec<f64>; 2],
    change: Vec<f64>,
    shares: [Vec<f64>; 2],
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
        let precision = &tilt.factor * tilt.factor.transpose();
        let members: Vec<(usize, u32)> = sets
            .iter()
            .enumerate()
            .flat_map(|(set, (members, _))| members.iter().map(move |&i| (set, i)))
            .collect();
        let sites: Vec<&ExactSite> = sets.iter().flat_map(|(_, law)| &law.sites).collect();
        let place = |k: usize| {
            let (set, i) = members[k];
            let block = |j: usize| precision.fixed_view::<2, 2>(2 * k, 2 * j).into_owned();
            let inverse = block(k).try_inverse()?;
            let lower = (inverse * 0.5).cholesky()?.l();
            let others = members.iter().enumerate();
            let pulls = (0..members.len()).filter(|&j| j != k).map(|j| {
                let pull = -(inverse * block(j));
                (
                    j,
                    [[pull[(0, 0)], pull[(0, 1)]], [pull[(1, 0)], pull[(1, 1)]]],
                )
            });
            Some(Place {
                site: sites.get(k).copied(),
                pulls: pulls
                    .filter(|(_, pull)| pull.iter().flatten().any(|p| *p != 0.0))
                    .collect(),
                spread_m: [lower[(0, 0)], lower[(1, 0)], lower[(1, 1)]],
                others: others
                    .filter(|(_, (other, _))| *other != set)
                    .map(|(j, &(_, other))| (j, model.pair_whitening(i, other)))
                    .collect(),
            })
        };
        let places: Option<Vec<Place<'a>>> = (0..members.len()).map(place).collect();
        let places = places?;
        let values = || vec![0.0; places.len() * n_draws];
        let here = Points {
            x_m: [values(), values()],
            energy: vec![0.0; n_draws],
        };
        let row = || vec![0.0; n_draws];
        Some(Self {
            model,
            places,
            tilt,
            spread_m,
            there: here.clone(),
            here,
            scratch: Scratch {
                proposed_m: [row(), row()],
                change: row(),
                shares: [row(), row()],
            },
        })
    }

    fn n_draws(&self) -> usize {
        self.here.energy.len()
    }

    /// A ladder for these sets: β of every rung.
    pub fn ladder(&mut self, rng: &mut impl Rng) -> Vec<f64> {
        let (mut rungs, mut beta) = (Vec::new(), 0.0);
        self.start(rng);
        while beta < 1.0 {
            let next = if rungs.len() + 1 < MAX_RUNGS {
                self.next_beta(beta)
            } else {
                1.0
            };
            rungs.push(next);
            if next < 1.0 {
                self.resample(next - beta, rng);
                self.sweep(next, rng);
            }
            beta = next;
        }
        rungs
    }

    /// ln of an unbiased estimate of E[exp(−Pen)].
    pub fn ln_estimate(&mut self, ladder: &[f64], rng: &mut impl Rng) -> f64 {
        self.start(rng);
        let (mut ln_estimate, mut beta) = (self.tilt.ln_scale, 0.0);
        for &next in ladder {
            ln_estimate += self.ln_mean_weight(next - beta);
            if next < 1.0 {
                self.resample(next - beta, rng);
                self.sweep(next, rng);
            }
            beta = next;
        }
        ln_estimate
    }

    /// ln of the mean of exp(−step · U).
    fn ln_mean_weight(&self, step: f64) -> f64 {
        let least = (self.here.energy.iter().copied()).fold(f64::INFINITY, f64::min);
        let sum: f64 = (self.here.energy.iter())
            .map(|energy| libm::exp(-step * (energy - least)))
            .sum();
        -step * least + libm::log(sum / self.n_draws() as f64)
    }

    /// Draws from q.
    fn start(&mut self, rng: &mut impl Rng) {
        let n = self.n_draws();
        let size = self.tilt.mean_m.len();
        // x = m + L⁻ᵀε/√2 with P' = LLᵀ, coordinate by coordinate.
        for coordinate in 0..size {
            let (place, axis) = (coordinate / 2, coordinate % 2);
            self.here.x_m[axis][place * n..(place + 1) * n].fill(self.tilt.mean_m[coordinate]);
        }
        for source in 0..size {
            let epsilon = &mut self.scratch.change;
            epsilon.fill_with(|| StandardNormal.sample(rng));
            for coordinate in 0..=source {
                let weight = self.spread_m[(coordinate, source)];
                let (place, axis) = (coordinate / 2, coordinate % 2);
                let values = &mut self.here.x_m[axis][place * n..(place + 1) * n];
                for (value, epsilon) in values.iter_mut().zip(epsilon.iter()) {
                    *value += weight * epsilon;
                }
            }
        }
        let mut energy = std::mem::take(&mut self.here.energy);
        energy.fill(-self.tilt.level);
        for k in 0..self.places.len() {
            let at = [0, 1].map(|axis| &self.here.x_m[axis][k * n..(k + 1) * n]);
            self.add_site(k, at, 1.0, &mut energy);
            let shares = &mut self.scratch.shares[0];
            shares.fill(0.0);
            // Every pair once.
            let places = &self.places;
            let (model, push, x_m) = (self.model, self.tilt.push, &self.here.x_m);
            for &(j, whiten) in places[k].others.iter().filter(|(j, _)| *j > k) {
                let other = [0, 1].map(|axis| &x_m[axis][j * n..(j + 1) * n]);
                add_pair(model, push, whiten, (at, other), (shares, &mut energy, 1.0));
            }
            for (energy, share) in energy.iter_mut().zip(shares.iter()) {
                *energy += self.model.penalty().height * share;
            }
        }
        self.here.energy = energy;
    }

    /// Adds a multiple of −h of a location.
    fn add_site(&self, k: usize, at: [&[f64]; 2], times: f64, energy: &mut [f64]) {
        let Some(ExactSite { site, .. }) = self.places[k].site else {
            return;
        };
        for (r, energy) in energy.iter_mut().enumerate() {
            *energy -= times * site.ln_excess(site.epsilon_of([at[0][r], at[1][r]]));
        }
    }

    /// Moves every location of every draw, at β, as often as there are [`SWEEPS`].
    fn sweep(&mut self, beta: f64, rng: &mut impl Rng) {
        for rho in SWEEPS {
            for k in 0..self.places.len() {
                self.step(k, beta, rho, rng);
            }
        }
    }

    /// A step of one location in every draw.
    fn step(&mut self, k: usize, beta: f64, rho: f64, rng: &mut impl Rng) {
        let n = self.n_draws();
        let stay = (1.0 - rho * rho).sqrt();
        let place = &self.places[k];
        let mut scratch = std::mem::replace(
            &mut self.scratch,
            Scratch {
                proposed_m: [Vec::new(), Vec::new()],
                change: Vec::new(),
                shares: [Vec::new(), Vec::new()],
            },
        );
        // The mean given the others.
        for axis in 0..2 {
            let mean = &mut scratch.proposed_m[axis];
            mean.fill(self.tilt.mean_m[2 * k + axis]);
            for &(j, pull) in &place.pulls {
                for other in 0..2 {
                    let (pull, m) = (pull[axis][other], self.tilt.mean_m[2 * j + other]);
                    let x = &self.here.x_m[other][j * n..(j + 1) * n];
                    for (mean, x) in mean.iter_mut().zip(x) {
                        *mean += pull * (x - m);
                    }
                }
            }
        }
        let here = [0, 1].map(|axis| &self.here.x_m[axis][k * n..(k + 1) * n]);
        let [s_xx, s_yx, s_yy] = place.spread_m;
        for r in 0..n {
            let [e1, e2]: [f64; 2] = [StandardNormal.sample(rng), StandardNormal.sample(rng)];
            let noise = [s_xx * e1, s_yx * e1 + s_yy * e2];
            let axes = scratch.proposed_m.iter_mut().zip(&here).zip(noise);
            for ((proposed, here), noise) in axes {
                let mean = proposed[r];
                proposed[r] = mean + stay * (here[r] - mean) + rho * noise;
            }
        }
        let [proposed_x, proposed_y] = &scratch.proposed_m;
        let there: [&[f64]; 2] = [proposed_x, proposed_y];
        scratch.change.fill(0.0);
        self.add_site(k, there, 1.0, &mut scratch.change);
        self.add_site(k, here, -1.0, &mut scratch.change);
        for shares in &mut scratch.shares {
            shares.fill(0.0);
        }
        let [before, after] = &mut scratch.shares;
        for &(j, whiten) in &place.others {
            let other = [0, 1].map(|axis| &self.here.x_m[axis][j * n..(j + 1) * n]);
            let (model, push, change) = (self.model, self.tilt.push, &mut scratch.change);
            add_pair(model, push, whiten, (there, other), (after, change, 1.0));
            add_pair(model, push, whiten, (here, other), (before, change, -1.0));
        }
        let height = self.model.penalty().height;
        for r in 0..n {
            let change = scratch.change[r] + height * (after[r] - before[r]);
            let ln_u = libm::log(1.0 - rng.random::<f64>());
            if ln_u < -beta * change {
                self.here.energy[r] += change;
                for axis in 0..2 {
                    self.here.x_m[axis][k * n + r] = scratch.proposed_m[axis][r];
                }
            }
        }
        self.scratch = scratch;
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
            sum * sum / (squares * self.n_draws() as f64)
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

    /// Draws in proportion to their weights, systematically.
    fn resample(&mut self, step: f64, rng: &mut impl Rng) {
        let n = self.n_draws();
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
                for k in 0..self.places.len() {
                    self.there.x_m[axis][k * n + r] = self.here.x_m[axis][k * n + from];
                }
            }
        }
        std::mem::swap(&mut self.here, &mut self.there);
    }
}

/// Adds a pair's share of the penalty to `shares`, and a multiple of s d² to `energy`.
fn add_pair(
    model: &Model,
    push: f64,
    whiten: [f64; 3],
    (first, second): ([&[f64]; 2], [&[f64]; 2]),
    (shares, energy, times): (&mut [f64], &mut [f64], f64),
) {
    if push > 0.0 {
        let ([x1, y1], [x2, y2]) = (first, second);
        for (r, energy) in energy.iter_mut().enumerate() {
            let (dx, dy) = (x1[r] - x2[r], y1[r] - y2[r]);
            let (u, v) = (whiten[0] * dx + whiten[1] * dy, whiten[2] * dy);
            *energy += times * push * (u * u + v * v);
        }
    }
    let penalty = model.penalty();
    match model {
        Model::Metric(_) => penalty.add_pair(first, second, shares),
        Model::Covariance(_) => penalty.add_whitened_pair(whiten, first, second, shares),
    }
}
