//! A normalised likelihood of detections, sampled.
//!
//! π(T) of the model leaves out the normaliser of P(X|T), so neither π nor its maximum over σ_o, σ_t, D
//! and H says which setting fits: with H = 0 every merge lowers π, and σ_o → ∞ raises it. In its place,
//! with M landmarks at x_m and detection i of landmark m:
//!
//! - z_i ~ N(x_m, s²·C_i), x_m uniform on the box of the detections, of area A. For the metric model C_i = I and
//!   s is in metres; for the covariance model C_i is what detection i states, and s is the factor between what is
//!   stated and what is so. Integrated over x_m, a set of n with Λ = Σ C_i⁻¹, z̄ = Λ⁻¹ Σ C_i⁻¹ z_i and
//!   W = Σ (z_i−z̄)ᵀ C_i⁻¹ (z_i−z̄) has p(z_S) = (1/A) (2πs²)^{−(n−1)} (det Λ · Π det C_i)^{−½} exp(−W/(2s²)); for C_i = I
//!   the bracket is n². It is a density of z_S, so topologies with many and with few sets, and all s, compare fairly.
//! - T of the prior in `prior.rs`: a mixture of finite mixtures in which two things seen at once are two.
//! - ln s is uniform between the sensor's own noise and a quarter of the box's diagonal (over the median of
//!   (det C_i)^{¼} where C_i is stated).
//!
//! Gibbs sampling: one detection after the other, then s² given T. Landmarks that keep apart are left out.
//!
//! With shared drift ([`drift`](super::drift)) z̃_i ~ N(x_m + B_i·u, s²·R_i), s between a quarter and four: u is integrated out while detections move, by
//! a Kalman update for each that comes and one that is taken back for each that goes, then drawn to give s². A
//! chain then starts from the best of some passes that put detections, in mission order, to those before: a path that
//! turned wrong early may be out of reach of single moves.

use std::f64::consts::TAU;

use nalgebra::{DVector, Matrix2, Matrix2xX, Vector2};
use rand::{Rng, RngExt};

use super::drift::{Linear, covariance, matrix};
use super::factors::{Factors, Information, Shift};
use super::prior::Prior;
use crate::detections::{Covariance, Detection, Detections};

/// Values of ln s².
const N_GRID: usize = 240;
/// What detections with drift state of their own errors is off by these factors at most.
const LEAST_FACTOR: f64 = 0.25;
pub(super) const MOST_FACTOR: f64 = 4.0;
/// Passes of which a chain with drift starts from the best.
const N_PASSES: usize = 8;
/// A set whose mean is farther off than this many squared standard deviations is no candidate.
const MOST_SQUARED: f64 = 80.0;

/// One draw of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// s: in the unit of the C_i, m where these are 1 and a factor where they are stated.
    pub noise: f64,
    /// |T|.
    pub n_sets: usize,
    /// The set of each detection; numbers mean nothing.
    pub labels: Vec<u32>,
    /// u; empty without shared drift.
    pub factors: Vec<f64>,
}

/// The data as the likelihood sees them.
#[derive(Clone, Debug)]
pub struct Mixture {
    pub(super) positions_m: Vec<[f64; 2]>,
    /// C_i, or R_i beside drift, in units of s².
    pub(super) shapes: Vec<Covariance>,
    /// B_i, if there is drift.
    loadings_m: Option<Vec<Matrix2xX<f64>>>,
    pub(super) prior: Prior,
    pub(super) ln_area: f64,
    pub(super) ln_variances: Vec<f64>,
}

struct Set {
    members: Vec<usize>,
    /// z̄, m.
    mean_m: Vector2<f64>,
    /// B̄, the same mean of the loadings, m; of no columns without drift.
    loading_m: Matrix2xX<f64>,
    /// What B̄·u comes to.
    drift: Shift,
    /// Λ⁻¹, in units of s².
    shape: Covariance,
    ln_prior: f64,
}

/// Where a chain is.
struct State {
    labels: Vec<Option<usize>>,
    sets: Vec<Option<Set>>,
    /// s².
    variance: f64,
    /// What the sets say of u.
    factors: Factors,
}

impl State {
    /// After a difference between detections of one landmark was seen, see [`Factors::observe`].
    fn observe(&mut self, loading: &Matrix2xX<f64>, difference: Vector2<f64>, noise: Matrix2<f64>) {
        let Some(step) = self.factors.observe(loading, difference, noise) else {
            return;
        };
        for set in self.sets.iter_mut().flatten() {
            step.change(&set.loading_m, &mut set.drift);
        }
    }
}

fn inverse(c: Covariance) -> Covariance {
    let determinant = c.determinant();
    Covariance {
        xx: c.yy / determinant,
        xy: -c.xy / determinant,
        yy: c.xx / determinant,
    }
}

fn sum(a: Covariance, b: Covariance) -> Covariance {
    Covariance {
        xx: a.xx + b.xx,
        xy: a.xy + b.xy,
        yy: a.yy + b.yy,
    }
}

/// vᵀ C v.
fn quadratic(c: Covariance, v: Vector2<f64>) -> f64 {
    c.xx * v.x * v.x + 2.0 * c.xy * v.x * v.y + c.yy * v.y * v.y
}

fn times(c: Covariance, v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(c.xx * v.x + c.xy * v.y, c.xy * v.x + c.yy * v.y)
}

impl Mixture {
    /// Of at least two detections at different places that err by s²·`shapes`, of which one unit of s is `unit_m`
    /// long; `least_noise` bounds s from below.
    pub fn new(
        detections: &Detections,
        shapes: &[Covariance],
        unit_m: f64,
        least_noise: f64,
    ) -> Self {
        let positions_m = detections.positions_m();
        let n = positions_m.len();
        let [width, height] = [0, 1].map(|axis| {
            let values = positions_m.iter().map(|z| z[axis]);
            let high = values.clone().fold(f64::NEG_INFINITY, f64::max);
            // The range of n uniform values is (n − 1)/(n + 1) of the whole on average.
            (high - values.fold(f64::INFINITY, f64::min)) * (n + 1) as f64 / (n - 1) as f64
        });
        let diagonal = libm::hypot(width, height);
        // A straight row of detections still has a width.
        let area = width.max(0.05 * diagonal) * height.max(0.05 * diagonal);
        let most = 2.0 * libm::log(diagonal / 4.0 / unit_m);
        let least = (2.0 * libm::log(least_noise)).clamp(most - 20.0, most - 2.0);
        let step = (most - least) / (N_GRID - 1) as f64;
        Self {
            prior: Prior::new(detections),
            ln_area: libm::log(area),
            ln_variances: (0..N_GRID).map(|k| least + step * k as f64).collect(),
            positions_m,
            shapes: shapes.to_vec(),
            loadings_m: None,
        }
    }

    /// Of detections that drift together, and err by themselves by s times what they state; linear about a value of u.
    pub fn with_drift(detections: &Detections, about: Linear) -> Self {
        let places = detections.iter().zip(&about.places_m);
        let places = places.map(|(row, place)| Detection {
            position_m: (*place).into(),
            ..row.clone()
        });
        let places = Detections::new(places.collect()).expect("finite shifts of good detections");
        let step = 2.0 * libm::log(MOST_FACTOR / LEAST_FACTOR) / (N_GRID - 1) as f64;
        let of = |k: usize| 2.0 * libm::log(LEAST_FACTOR) + step * k as f64;
        Self {
            positions_m: about.positions_m.iter().map(|z| (*z).into()).collect(),
            loadings_m: Some(about.loadings_m).filter(|loadings| loadings[0].ncols() > 0),
            ln_variances: (0..N_GRID).map(of).collect(),
            ..Self::new(&places, &about.own_m2, 1.0, LEAST_FACTOR)
        }
    }

    /// Whether two detections were in view at once.
    pub fn overlap(&self, i: usize, j: usize) -> bool {
        self.prior.overlap(i, j)
    }

    /// Where detection i would be without a drift of u.
    pub(super) fn undrifted_m(&self, i: usize, factors: &DVector<f64>) -> Vector2<f64> {
        let z = Vector2::from(self.positions_m[i]);
        match &self.loadings_m {
            Some(loadings) => z - &loadings[i] * factors,
            None => z,
        }
    }

    /// s² at a share of its range, from 0 to 1.
    pub fn variance_at(&self, share: f64) -> f64 {
        let at = ((N_GRID - 1) as f64 * share) as usize;
        libm::exp(self.ln_variances[at])
    }

    /// Runs one chain with s² started as given; gives the draws after `n_left_out` sweeps.
    pub fn sample(
        &self,
        n_left_out: usize,
        n_kept: usize,
        variance: f64,
        rng: &mut impl Rng,
    ) -> Vec<Draw> {
        let draws = self.sample_until((n_left_out, n_kept), variance, rng, &|| false);
        draws.expect("nobody stops it")
    }

    /// As [`sample`](Self::sample), with the sweeps left out and those kept; `None` if `stop` said so
    /// before a sweep.
    pub fn sample_until(
        &self,
        (n_left_out, n_kept): (usize, usize),
        variance: f64,
        rng: &mut impl Rng,
        stop: &dyn Fn() -> bool,
    ) -> Option<Vec<Draw>> {
        let n = self.positions_m.len();
        let mut state = match self.loadings_m {
            Some(_) => self.passes(variance, rng),
            None => self.state((0..n).map(Some).collect(), variance),
        };
        let mut draws = Vec::with_capacity(n_kept);
        for sweep in 0..n_left_out + n_kept {
            if stop() {
                return None;
            }
            for i in 0..n {
                self.take_out(i, &mut state);
                self.place(i, &mut state, rng);
            }
            let factors = self.draw_scales(&mut state, rng);
            if sweep >= n_left_out {
                let label = |label: &Option<usize>| label.map_or(0, |label| label as u32);
                draws.push(Draw {
                    noise: state.variance.sqrt(),
                    n_sets: state.sets.iter().flatten().count(),
                    labels: state.labels.iter().map(label).collect(),
                    factors: factors.iter().copied().collect(),
                });
            }
        }
        Some(draws)
    }

    /// The most probable of some passes over the detections in which each is put to those before it.
    fn passes(&self, variance: f64, rng: &mut impl Rng) -> State {
        let mut pass = || {
            let mut state = self.state(vec![None; self.positions_m.len()], variance);
            let places = 0..self.positions_m.len();
            let ln_joint: f64 = places.map(|i| self.place(i, &mut state, rng)).sum();
            (ln_joint, state)
        };
        let mut best = pass();
        for _ in 1..N_PASSES {
            let next = pass();
            if next.0 > best.0 {
                best = next;
            }
        }
        best.1
    }

    /// What these sets say of u if s is known.
    pub(super) fn factors_given(&self, labels: &[u32], noise: f64) -> Factors {
        let labels = labels.iter().map(|&label| Some(label as usize)).collect();
        self.state(labels, noise * noise).factors
    }

    /// With the sets of these labels, all below N.
    fn state(&self, labels: Vec<Option<usize>>, variance: f64) -> State {
        let n = labels.len();
        let nothing = Factors::unknown(self.n_factors());
        let of = |label: usize| {
            let members: Vec<usize> = (0..n).filter(|&i| labels[i] == Some(label)).collect();
            let ln_prior = self.prior.ln_of_set(&members);
            (!members.is_empty()).then(|| self.set_of(members, ln_prior, &nothing))
        };
        let mut state = State {
            sets: (0..n).map(of).collect(),
            labels,
            variance,
            factors: nothing.clone(),
        };
        if let Some(information) = self.information(&state.sets) {
            self.learn(&information, &mut state);
        }
        state
    }

    /// Takes what is known of u from all sets at once.
    fn learn(&self, information: &Information, state: &mut State) {
        state.factors = information.factors(state.variance);
        for set in state.sets.iter_mut().flatten() {
            set.drift = state.factors.predict(&set.loading_m);
        }
    }

    fn n_factors(&self) -> usize {
        let loadings = self.loadings_m.as_ref();
        loadings.map_or(0, |loadings| loadings[0].ncols())
    }

    /// Of at least one member. Made anew for every change: nothing adds up that rounding could spoil.
    fn set_of(&self, members: Vec<usize>, ln_prior: f64, factors: &Factors) -> Set {
        let mut precision = Covariance {
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
        };
        let mut weighted = Vector2::zeros();
        let mut loading = Matrix2xX::zeros(self.n_factors());
        for &i in &members {
            let p = inverse(self.shapes[i]);
            precision = sum(precision, p);
            weighted += times(p, self.positions_m[i].into());
            if let Some(loadings) = &self.loadings_m {
                loading += matrix(p) * &loadings[i];
            }
        }
        let shape = inverse(precision);
        let loading_m = matrix(shape) * loading;
        Set {
            members,
            mean_m: times(shape, weighted),
            drift: factors.predict(&loading_m),
            loading_m,
            shape,
            ln_prior,
        }
    }

    /// Detection i, which is or will be one of a set without it, is seen with it, or is no more.
    fn observe(&self, i: usize, label: usize, sign: f64, state: &mut State) {
        if let (Some(loadings), Some(set)) = (&self.loadings_m, &state.sets[label]) {
            let loading = &loadings[i] - &set.loading_m;
            let difference = Vector2::from(self.positions_m[i]) - set.mean_m;
            let noise = matrix(sum(set.shape, self.shapes[i])) * state.variance;
            state.observe(&loading, difference, noise * sign);
        }
    }

    fn take_out(&self, i: usize, state: &mut State) {
        let Some(from) = state.labels[i].take() else {
            return;
        };
        let Some(mut set) = state.sets[from].take() else {
            return;
        };
        set.members.retain(|&member| member != i);
        if set.members.is_empty() {
            return;
        }
        let ln_prior = self.prior.ln_of_set(&set.members);
        state.sets[from] = Some(self.set_of(set.members, ln_prior, &state.factors));
        self.observe(i, from, -1.0, state);
    }

    /// Draws a set for detection i; gives ln of its weight.
    fn place(&self, i: usize, state: &mut State, rng: &mut impl Rng) -> f64 {
        let n_others = state.sets.iter().flatten().count();
        let loadings = self.loadings_m.as_ref();
        let drift = loadings.map(|loadings| state.factors.of_one(&loadings[i]));
        let (mut places, mut weights) = (Vec::new(), Vec::new());
        for (label, set) in state.sets.iter().enumerate() {
            let Some(set) = set else { continue };
            // N(z; z̄, s²(C + Λ⁻¹)): the set's density with this one over that without it.
            let spread = sum(set.shape, self.shapes[i]);
            let difference = Vector2::from(self.positions_m[i]) - set.mean_m;
            let (squared, area) = match &drift {
                None => (
                    quadratic(inverse(spread), difference) / state.variance,
                    TAU * state.variance * spread.determinant().sqrt(),
                ),
                Some(drift) => {
                    let Shift { mean_m, spread_m2 } = drift.from(&set.loading_m, &set.drift);
                    let spread = covariance(matrix(spread) * state.variance + spread_m2);
                    let squared = quadratic(inverse(spread), difference - mean_m);
                    (squared, TAU * spread.determinant().sqrt())
                }
            };
            if squared > MOST_SQUARED {
                continue;
            }
            let ln_prior = self.prior.ln_of_set(&with(&set.members, i));
            let ln_density = -libm::log(area) - squared / 2.0;
            places.push((label, ln_prior));
            weights.push(ln_prior - set.ln_prior + ln_density);
        }
        weights.push(self.prior.ln_new(n_others) - self.ln_area);
        let chosen = choose(&weights, rng);
        let (label, members, ln_prior) = match places.get(chosen) {
            Some(&(label, ln_prior)) => {
                self.observe(i, label, 1.0, state);
                let set = state.sets[label].take();
                let others = set.map(|set| set.members).unwrap_or_default();
                (label, with(&others, i), ln_prior)
            }
            None => {
                let free = state.sets.iter().position(Option::is_none);
                (free.expect("N places for at most N sets"), vec![i], 0.0)
            }
        };
        state.sets[label] = Some(self.set_of(members, ln_prior, &state.factors));
        state.labels[i] = Some(label);
        weights[chosen]
    }

    /// u given T and s², s² given T and u; what T says of u is made anew on the way. Gives u.
    fn draw_scales(&self, state: &mut State, rng: &mut impl Rng) -> DVector<f64> {
        let information = self.information(&state.sets);
        let factors = match &information {
            None => DVector::zeros(0),
            Some(information) => information.draw(state.variance, rng),
        };
        let (mut n_sets, mut scatter) = (0, 0.0);
        for set in state.sets.iter().flatten() {
            n_sets += 1;
            let mean = set.mean_m - &set.loading_m * &factors;
            let squared = |&i: &usize| {
                let from_mean = self.undrifted_m(i, &factors) - mean;
                quadratic(inverse(self.shapes[i]), from_mean)
            };
            scatter += set.members.iter().map(squared).sum::<f64>();
        }
        let old = (self.positions_m.len() - n_sets) as f64;
        let ln_weight = |&ln_v: &f64| -old * ln_v - scatter / (2.0 * libm::exp(ln_v));
        let weights: Vec<f64> = self.ln_variances.iter().map(ln_weight).collect();
        state.variance = libm::exp(self.ln_variances[choose(&weights, rng)]);
        if let Some(information) = information {
            self.learn(&information, state);
        }
        factors
    }

    /// `None` without drift.
    fn information(&self, sets: &[Option<Set>]) -> Option<Information> {
        let loadings = self.loadings_m.as_ref()?;
        let mut found = Information::none(self.n_factors());
        let several = sets.iter().flatten().filter(|set| set.members.len() > 1);
        for set in several {
            for &i in &set.members {
                let weight = matrix(inverse(self.shapes[i]));
                let from_mean = Vector2::from(self.positions_m[i]) - set.mean_m;
                found.add(&weight, &(&loadings[i] - &set.loading_m), &from_mean);
            }
        }
        Some(found)
    }
}

fn with(members: &[usize], i: usize) -> Vec<usize> {
    let mut all = members.to_vec();
    all.insert(members.partition_point(|&member| member < i), i);
    all
}

/// An index with probability proportional to exp of its weight.
fn choose(ln_weights: &[f64], rng: &mut impl Rng) -> usize {
    let largest = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // What is no number is not chosen.
    let weight = |ln_weight: &f64| libm::exp(ln_weight - largest).max(0.0);
    let weights: Vec<f64> = ln_weights.iter().map(weight).collect();
    let mut left = weights.iter().sum::<f64>() * rng.random_range(0.0..1.0);
    for (k, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 {
            return k;
        }
    }
    weights.len() - 1
}
