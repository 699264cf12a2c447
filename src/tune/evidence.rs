//! What the detections themselves say of noise and revisits: a normalised likelihood, sampled.
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
//! - M of p(M) ∝ 1/M, up to N; every landmark is seen with a weight of its own, and those weights are uniform on the
//!   simplex (a Dirichlet of parameter 1), so that a set of n comes with n! (mixtures of finite mixtures: Miller & Harrison,
//!   JASA 113, 2018; unlike a Chinese restaurant, they do not add landmarks as detections go on). But two things seen
//!   at once are two landmarks: where the intervals of two members overlap, P(T) has a factor 1/100, as a
//!   tracker may see double. So of v_i earlier detections that are in view with detection i, about a share v_i/M of
//!   the landmarks is not to be had, and P(T|M) has to be normalised for it, or few landmarks would pay more than
//!   many: P(T|M) = M!/(M−t)! · Γ(M)/Γ(M+N) · Π_S n_S! · Π_i 1/(1 − 0.99·v_i/M) · 100^{−overlaps}, t = |T|. The product
//!   over i is exact for equal weights and one overlap each, and about right otherwise. Without times v_i = 0.
//! - ln s is uniform between the sensor's own noise and a quarter of the box's diagonal (over the median of
//!   (det C_i)^{¼} where C_i is stated).
//!
//! Gibbs sampling: one detection after the other, then s² given T. What is left out: drift that
//! neighbouring detections share, landmarks that keep apart.

use rand::{Rng, RngExt};

use super::trial::Errors;
use crate::detections::{Covariance, Detections};

/// What an overlap of two members costs: a factor.
const OVERLAP: f64 = 0.01;
/// Its logarithm.
const LN_OVERLAP: f64 = -4.605_170_185_988_091;
/// Values of ln s².
const N_GRID: usize = 240;
/// A set whose mean is farther off than this many squared standard deviations is no candidate.
const MOST_SQUARED: f64 = 80.0;

/// One draw of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// s: in metres, or a factor where covariances are stated.
    pub noise: f64,
    /// M.
    pub n_sets: usize,
    /// The set of each detection; numbers mean nothing.
    pub labels: Vec<u32>,
}

/// The data as the likelihood sees them.
#[derive(Clone, Debug)]
pub struct Mixture {
    positions_m: Vec<[f64; 2]>,
    /// C_i, in units of s².
    shapes: Vec<Covariance>,
    /// N×N, row by row.
    overlaps: Vec<bool>,
    /// ln of V(t + 1)/V(t), t from 0, where P(T) = V(|T|) · Π_S n_S! · 100^{−overlaps}.
    ln_new: Vec<f64>,
    ln_area: f64,
    ln_variances: Vec<f64>,
}

struct Set {
    members: Vec<usize>,
    /// z̄, m.
    mean_m: [f64; 2],
    /// Λ⁻¹, in units of s².
    shape: Covariance,
    ln_prior: f64,
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
fn quadratic(c: Covariance, [x, y]: [f64; 2]) -> f64 {
    c.xx * x * x + 2.0 * c.xy * x * y + c.yy * y * y
}

fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

impl Mixture {
    /// Of at least two detections at different places that err as said; `least_noise` bounds s from below.
    pub fn new(detections: &Detections, errors: &Errors, least_noise: f64) -> Self {
        let shapes = errors.shapes().to_vec();
        let positions_m = detections.positions_m();
        let n = positions_m.len();
        let interval = |i: usize| {
            let row = detections.iter().nth(i)?;
            Some((row.first_seen_s?, row.last_seen_s?))
        };
        let intervals: Vec<_> = (0..n).map(interval).collect();
        let mut overlaps = vec![false; n * n];
        for i in 0..n {
            for j in 0..n {
                if let (Some(a), Some(b)) = (intervals[i], intervals[j]) {
                    overlaps[i * n + j] = i != j && a.0 <= b.1 && b.0 <= a.1;
                }
            }
        }
        let in_view: Vec<usize> = (0..n)
            .map(|i| (0..i).filter(|j| overlaps[i * n + j]).count())
            .collect();
        let [width, height] = [0, 1].map(|axis| {
            let values = positions_m.iter().map(|z| z[axis]);
            let high = values.clone().fold(f64::NEG_INFINITY, f64::max);
            // The range of n uniform values is (n − 1)/(n + 1) of the whole on average.
            (high - values.fold(f64::INFINITY, f64::min)) * (n + 1) as f64 / (n - 1) as f64
        });
        let diagonal = libm::hypot(width, height);
        // A straight row of detections still has a width.
        let area = width.max(0.05 * diagonal) * height.max(0.05 * diagonal);
        let most = 2.0 * libm::log(diagonal / 4.0 / errors.unit_m());
        let least = (2.0 * libm::log(least_noise)).clamp(most - 20.0, most - 2.0);
        let step = (most - least) / (N_GRID - 1) as f64;
        Self {
            overlaps,
            ln_new: ln_new(&in_view),
            ln_area: libm::log(area),
            ln_variances: (0..N_GRID).map(|k| least + step * k as f64).collect(),
            positions_m,
            shapes,
        }
    }

    /// Whether two detections were in view at once.
    pub fn overlap(&self, i: usize, j: usize) -> bool {
        self.overlaps[i * self.positions_m.len() + j]
    }

    /// ln of n! and of what the set's overlaps cost, members in rising order.
    fn ln_prior(&self, members: &[usize]) -> f64 {
        let of = |k: usize| {
            let overlaps = |&&j: &&usize| self.overlap(members[k], j);
            let n_overlaps = members[..k].iter().filter(overlaps).count();
            libm::log((k + 1) as f64) + LN_OVERLAP * n_overlaps as f64
        };
        (1..members.len()).map(of).sum()
    }

    /// Runs one chain from all detections apart, with s started at a share of the grid; gives the
    /// draws after `n_left_out` sweeps.
    pub fn sample(
        &self,
        n_left_out: usize,
        n_kept: usize,
        start: f64,
        rng: &mut impl Rng,
    ) -> Vec<Draw> {
        let n = self.positions_m.len();
        let mut labels: Vec<usize> = (0..n).collect();
        let mut sets: Vec<Option<Set>> = (0..n).map(|i| Some(self.alone(i))).collect();
        let at = ((N_GRID - 1) as f64 * start) as usize;
        let mut variance = libm::exp(self.ln_variances[at]);
        let mut draws = Vec::with_capacity(n_kept);
        for sweep in 0..n_left_out + n_kept {
            for i in 0..n {
                self.move_one(i, &mut labels, &mut sets, variance, rng);
            }
            let (mut n_sets, mut scatter) = (0, 0.0);
            for set in sets.iter().flatten() {
                n_sets += 1;
                scatter += self.scatter(set);
            }
            let old = (n - n_sets) as f64;
            let ln_weight = |&ln_v: &f64| -old * ln_v - scatter / (2.0 * libm::exp(ln_v));
            let weights: Vec<f64> = self.ln_variances.iter().map(ln_weight).collect();
            variance = libm::exp(self.ln_variances[choose(&weights, rng)]);
            if sweep >= n_left_out {
                draws.push(Draw {
                    noise: variance.sqrt(),
                    n_sets,
                    labels: labels.iter().map(|&label| label as u32).collect(),
                });
            }
        }
        draws
    }

    fn alone(&self, i: usize) -> Set {
        self.set_of(vec![i], 0.0)
    }

    /// Of at least one member. Made anew for every change: nothing adds up that rounding could spoil.
    fn set_of(&self, members: Vec<usize>, ln_prior: f64) -> Set {
        let mut precision = Covariance {
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
        };
        let mut weighted = [0.0; 2];
        for &i in &members {
            let (p, [x, y]) = (inverse(self.shapes[i]), self.positions_m[i]);
            precision = sum(precision, p);
            weighted[0] += p.xx * x + p.xy * y;
            weighted[1] += p.xy * x + p.yy * y;
        }
        let shape = inverse(precision);
        let [x, y] = weighted;
        Set {
            members,
            mean_m: [shape.xx * x + shape.xy * y, shape.xy * x + shape.yy * y],
            shape,
            ln_prior,
        }
    }

    /// W.
    fn scatter(&self, set: &Set) -> f64 {
        let squared = |&i: &usize| {
            let from_mean = difference(self.positions_m[i], set.mean_m);
            quadratic(inverse(self.shapes[i]), from_mean)
        };
        set.members.iter().map(squared).sum()
    }

    fn move_one(
        &self,
        i: usize,
        labels: &mut [usize],
        sets: &mut [Option<Set>],
        variance: f64,
        rng: &mut impl Rng,
    ) {
        let z = self.positions_m[i];
        let from = labels[i];
        if let Some(mut set) = sets[from].take() {
            set.members.retain(|&member| member != i);
            if !set.members.is_empty() {
                let ln_prior = self.ln_prior(&set.members);
                sets[from] = Some(self.set_of(set.members, ln_prior));
            }
        }
        let n_others = sets.iter().flatten().count();
        let (mut places, mut weights) = (Vec::new(), Vec::new());
        for (label, set) in sets.iter().enumerate() {
            let Some(set) = set else { continue };
            // N(z; z̄, s²(C + Λ⁻¹)): the set's density with this one over that without it.
            let spread = sum(set.shape, self.shapes[i]);
            let squared = quadratic(inverse(spread), difference(z, set.mean_m)) / variance;
            if squared > MOST_SQUARED {
                continue;
            }
            let ln_prior = self.ln_prior(&with(&set.members, i));
            let area = std::f64::consts::TAU * variance * spread.determinant().sqrt();
            let ln_density = -libm::log(area) - squared / 2.0;
            places.push((label, ln_prior));
            weights.push(ln_prior - set.ln_prior + ln_density);
        }
        weights.push(self.ln_new[n_others] - self.ln_area);
        let chosen = choose(&weights, rng);
        labels[i] = match places.get(chosen) {
            Some(&(label, ln_prior)) => {
                if let Some(set) = sets[label].take() {
                    sets[label] = Some(self.set_of(with(&set.members, i), ln_prior));
                }
                label
            }
            None => {
                let free = sets.iter().position(Option::is_none);
                let label = free.expect("N places for at most N sets");
                sets[label] = Some(self.alone(i));
                label
            }
        };
    }
}

/// ln of V(t + 1)/V(t), t from 0 to N − 1, given how many earlier detections are in view with each.
fn ln_new(in_view: &[usize]) -> Vec<f64> {
    let n = in_view.len();
    let ln_of_landmarks = |m: usize| {
        let landmarks = m as f64;
        // More in view than there are landmarks takes seeing double: the factor of one overlap.
        let free = |&v: &usize| (1.0 - (1.0 - OVERLAP) * v as f64 / landmarks).max(OVERLAP);
        let in_view: f64 = in_view.iter().map(|v| libm::log(free(v))).sum();
        // M!·Γ(M)/Γ(M+N)/M
        libm::lgamma(landmarks + 1.0) + libm::lgamma(landmarks)
            - libm::lgamma(landmarks + n as f64)
            - libm::log(landmarks)
            - in_view
    };
    let ln_of_landmarks: Vec<f64> = (1..=n).map(ln_of_landmarks).collect();
    let ln_v = |t: usize| {
        let terms =
            (t.max(1)..=n).map(|m| ln_of_landmarks[m - 1] - libm::lgamma((m - t + 1) as f64));
        let terms: Vec<f64> = terms.collect();
        let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest + libm::log(terms.iter().map(|v| libm::exp(v - largest)).sum())
    };
    let ln_v: Vec<f64> = (0..=n).map(ln_v).collect();
    ln_v.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn with(members: &[usize], i: usize) -> Vec<usize> {
    let mut all = members.to_vec();
    all.insert(members.partition_point(|&member| member < i), i);
    all
}

/// An index with probability proportional to exp of its weight.
fn choose(ln_weights: &[f64], rng: &mut impl Rng) -> usize {
    let largest = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = ln_weights.iter().map(|w| libm::exp(w - largest)).collect();
    let mut left = weights.iter().sum::<f64>() * rng.random_range(0.0..1.0);
    for (k, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 {
            return k;
        }
    }
    weights.len() - 1
}

#[cfg(test)]
#[path = "evidence_tests.rs"]
mod tests;
