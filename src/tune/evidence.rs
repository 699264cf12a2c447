//! What the detections themselves say of noise and revisits: a normalised likelihood, sampled.
//!
//! π(T) of the model leaves out the normaliser of P(X|T), so neither π nor its maximum over σ_o, σ_t, D
//! and H says which setting fits: with H = 0 every merge lowers π, and σ_o → ∞ raises it. In its place,
//! with M landmarks at x_m and detection i of landmark m:
//!
//! - z_i ~ N(x_m, s²·I), x_m uniform on the box of the detections, of area A. Integrated over x_m, a set of
//!   n with scatter W has p(z_S) = (1/A) (2πs²)^{−(n−1)} n^{−1} exp(−W/(2s²)). It is a density of z_S, so
//!   topologies with many and with few sets, and all s, compare fairly.
//! - Detection i is a revisit with probability ρ, and then of a landmark as likely as it was seen before,
//!   of the Q_i earlier detections whose interval does not overlap its own: two things seen at once are
//!   two landmarks. P(T|ρ) ∝ ρ^{N−M} (1−ρ)^{R−N+M} Π_S Π_{k≥2} c_k/Q_k, c_k the earlier members of S that do
//!   not overlap the k-th, R the number of detections with Q_i > 0. Without times Q_i = i, and the product is
//!   that of a Chinese restaurant. An overlap inside a set costs a factor 1/100: a tracker may see double.
//! - ln s is uniform between the sensor's own noise and a quarter of the box's diagonal, ρ on (0, 1).
//!
//! Gibbs sampling: one detection after the other, then s² and ρ given T. What is left out: drift that
//! neighbouring detections share, covariances, landmarks that keep apart.

use rand::{Rng, RngExt};
use rand_distr::{Beta, Distribution};

use crate::detections::Detections;

/// ln of what an overlap of two members costs.
const LN_OVERLAP: f64 = -4.605_170_185_988_091;
/// Values of ln s².
const N_GRID: usize = 240;
/// A set whose mean is farther off than this many squared standard deviations is no candidate.
const MOST_SQUARED: f64 = 80.0;

/// One draw of the posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// s, m.
    pub noise_m: f64,
    /// M.
    pub n_sets: usize,
    /// The set of each detection; numbers mean nothing.
    pub labels: Vec<u32>,
}

/// The data as the likelihood sees them.
#[derive(Clone, Debug)]
pub struct Mixture {
    positions_m: Vec<[f64; 2]>,
    /// N×N, row by row.
    overlaps: Vec<bool>,
    ln_q: Vec<f64>,
    n_may_revisit: usize,
    ln_area: f64,
    ln_variances: Vec<f64>,
}

struct Set {
    members: Vec<usize>,
    sum: [f64; 2],
    ln_prior: f64,
}

impl Mixture {
    /// Of at least two detections at different places; `least_noise_m` bounds s from below.
    pub fn new(detections: &Detections, least_noise_m: f64) -> Self {
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
        let q = (0..n).map(|i| (0..i).filter(|j| !overlaps[i * n + j]).count());
        let q: Vec<usize> = q.collect();
        let [width, height] = [0, 1].map(|axis| {
            let values = positions_m.iter().map(|z| z[axis]);
            let high = values.clone().fold(f64::NEG_INFINITY, f64::max);
            // The range of n uniform values is (n − 1)/(n + 1) of the whole on average.
            (high - values.fold(f64::INFINITY, f64::min)) * (n + 1) as f64 / (n - 1) as f64
        });
        let diagonal = libm::hypot(width, height);
        // A straight row of detections still has a width.
        let area = width.max(0.05 * diagonal) * height.max(0.05 * diagonal);
        let most = 2.0 * libm::log(diagonal / 4.0);
        let least = (2.0 * libm::log(least_noise_m)).clamp(most - 20.0, most - 2.0);
        let step = (most - least) / (N_GRID - 1) as f64;
        Self {
            overlaps,
            n_may_revisit: q.iter().filter(|q| **q > 0).count(),
            ln_q: q.iter().map(|&q| libm::log(q.max(1) as f64)).collect(),
            ln_area: libm::log(area),
            ln_variances: (0..N_GRID).map(|k| least + step * k as f64).collect(),
            positions_m,
        }
    }

    /// Whether two detections were in view at once.
    pub fn overlap(&self, i: usize, j: usize) -> bool {
        self.overlaps[i * self.positions_m.len() + j]
    }

    /// Π_{k≥2} c_k/Q_k in logs, members in rising order.
    fn ln_prior(&self, members: &[usize]) -> f64 {
        let of = |k: usize| {
            let i = members[k];
            let n_overlaps = members[..k].iter().filter(|&&j| self.overlap(i, j)).count();
            let c = k - n_overlaps;
            let ln_c = if c > 0 {
                libm::log(c as f64)
            } else {
                LN_OVERLAP
            };
            ln_c + LN_OVERLAP * n_overlaps as f64 - self.ln_q[i]
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
        let mut revisit: f64 = 0.5;
        let mut draws = Vec::with_capacity(n_kept);
        for sweep in 0..n_left_out + n_kept {
            for i in 0..n {
                self.move_one(i, &mut labels, &mut sets, variance, revisit, rng);
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
            let new = (self.n_may_revisit as f64 - old).max(0.0);
            let law = Beta::new(1.0 + old, 1.0 + new).expect("both are at least 1");
            revisit = law.sample(rng).clamp(1e-9, 1.0 - 1e-9);
            if sweep >= n_left_out {
                draws.push(Draw {
                    noise_m: variance.sqrt(),
                    n_sets,
                    labels: labels.iter().map(|&label| label as u32).collect(),
                });
            }
        }
        draws
    }

    fn alone(&self, i: usize) -> Set {
        Set {
            members: vec![i],
            sum: self.positions_m[i],
            ln_prior: 0.0,
        }
    }

    fn scatter(&self, set: &Set) -> f64 {
        let n = set.members.len() as f64;
        let mean = set.sum.map(|sum| sum / n);
        let squared = |&i: &usize| {
            let z = self.positions_m[i];
            (z[0] - mean[0]).powi(2) + (z[1] - mean[1]).powi(2)
        };
        set.members.iter().map(squared).sum()
    }

    fn move_one(
        &self,
        i: usize,
        labels: &mut [usize],
        sets: &mut [Option<Set>],
        variance: f64,
        revisit: f64,
        rng: &mut impl Rng,
    ) {
        let z = self.positions_m[i];
        let from = labels[i];
        if let Some(set) = &mut sets[from] {
            set.members.retain(|&member| member != i);
            set.sum = [set.sum[0] - z[0], set.sum[1] - z[1]];
            set.ln_prior = self.ln_prior(&set.members);
        }
        if sets[from]
            .as_ref()
            .is_some_and(|set| set.members.is_empty())
        {
            sets[from] = None;
        }
        let ln_odds = libm::log(revisit / (1.0 - revisit));
        let (mut places, mut weights) = (Vec::new(), Vec::new());
        for (label, set) in sets.iter().enumerate() {
            let Some(set) = set else { continue };
            let n = set.members.len() as f64;
            let mean = set.sum.map(|sum| sum / n);
            let spread = variance * (1.0 + 1.0 / n);
            let squared = (z[0] - mean[0]).powi(2) + (z[1] - mean[1]).powi(2);
            if squared > MOST_SQUARED * spread {
                continue;
            }
            let ln_prior = self.ln_prior(&with(&set.members, i));
            let ln_density = -libm::log(std::f64::consts::TAU * spread) - squared / (2.0 * spread);
            places.push((label, ln_prior));
            weights.push(ln_odds + ln_prior - set.ln_prior + ln_density);
        }
        weights.push(-self.ln_area);
        let chosen = choose(&weights, rng);
        labels[i] = match places.get(chosen) {
            Some(&(label, ln_prior)) => {
                if let Some(set) = &mut sets[label] {
                    set.members = with(&set.members, i);
                    set.sum = [set.sum[0] + z[0], set.sum[1] + z[1]];
                    set.ln_prior = ln_prior;
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
mod tests {
    use super::*;
    use crate::detections::Detection;
    use crate::rng::Purpose;

    fn at(x: f64, y: f64, seen: Option<(f64, f64)>) -> Detection {
        Detection {
            first_seen_s: seen.map(|s| s.0),
            last_seen_s: seen.map(|s| s.1),
            ..Detection::at(x, y)
        }
    }

    /// ln of the joint of T, s² on the grid and ρ integrated out, from the definition.
    fn ln_joint(mixture: &Mixture, labels: &[usize], ln_variance: f64) -> f64 {
        let n = labels.len();
        let variance = libm::exp(ln_variance);
        let mut n_sets = 0;
        let mut sum = 0.0;
        for label in 0..n {
            let members: Vec<usize> = (0..n).filter(|&i| labels[i] == label).collect();
            if members.is_empty() {
                continue;
            }
            n_sets += 1;
            let k = members.len() as f64;
            let mean = [0, 1].map(|a| {
                members
                    .iter()
                    .map(|&i| mixture.positions_m[i][a])
                    .sum::<f64>()
                    / k
            });
            let scatter: f64 = members
                .iter()
                .map(|&i| {
                    (0..2)
                        .map(|a| (mixture.positions_m[i][a] - mean[a]).powi(2))
                        .sum::<f64>()
                })
                .sum();
            sum += mixture.ln_prior(&members)
                - mixture.ln_area
                - (k - 1.0) * (std::f64::consts::TAU * variance).ln()
                - k.ln()
                - scatter / (2.0 * variance);
        }
        let old = n - n_sets;
        let new = mixture.n_may_revisit.saturating_sub(old);
        // B(1 + old, 1 + new) of whole numbers.
        let factorial = |k: usize| (1..=k).map(|v| (v as f64).ln()).sum::<f64>();
        sum + factorial(old) + factorial(new) - factorial(old + new + 1)
    }

    #[test]
    fn gibbs_draws_from_the_joint_as_it_is_defined() {
        // Four detections: 15 topologies × the grid of s, by enumeration.
        let rows = vec![
            at(0.0, 0.0, Some((0.0, 2.0))),
            at(1.0, 0.3, Some((1.0, 3.0))),
            at(0.4, 0.9, Some((5.0, 6.0))),
            at(6.0, 5.0, Some((7.0, 8.0))),
        ];
        let mixture = Mixture::new(&Detections::new(rows).expect("good"), 0.1);
        assert!(mixture.overlap(0, 1) && !mixture.overlap(1, 2) && !mixture.overlap(0, 0));
        let mut expected = std::collections::BTreeMap::new();
        let mut total = 0.0;
        for topology in crate::partition::Partitions::of(4) {
            let labels: Vec<usize> = topology.labels().iter().map(|&l| l as usize).collect();
            let mass: f64 = mixture
                .ln_variances
                .iter()
                .map(|&v| ln_joint(&mixture, &labels, v).exp())
                .sum();
            total += mass;
            expected.insert(topology, mass);
        }
        let mut rng = Purpose::new("test", 5).generator();
        let n_draws = 40_000;
        let draws = mixture.sample(100, n_draws, 0.3, &mut rng);
        let mut counts = std::collections::BTreeMap::new();
        for draw in &draws {
            *counts
                .entry(crate::partition::Topology::canonical(&draw.labels))
                .or_insert(0.0) += 1.0;
        }
        for (topology, mass) in &expected {
            let p = mass / total;
            let share = counts.get(topology).copied().unwrap_or(0.0) / n_draws as f64;
            // Successive sweeps are correlated: an effective tenth of the draws, four standard errors.
            let error = 4.0 * (p * (1.0 - p) / (n_draws as f64 / 10.0)).sqrt();
            assert!(
                (share - p).abs() < error.max(2e-3),
                "{topology}: {share} against {p}"
            );
        }
        let mean = draws.iter().map(|draw| draw.noise_m.ln()).sum::<f64>() / n_draws as f64;
        let mut by_enumeration = 0.0;
        for topology in expected.keys() {
            let labels: Vec<usize> = topology.labels().iter().map(|&l| l as usize).collect();
            for &v in &mixture.ln_variances {
                by_enumeration += ln_joint(&mixture, &labels, v).exp() / total * v / 2.0;
            }
        }
        assert!(
            (mean - by_enumeration).abs() < 0.1,
            "{mean} against {by_enumeration}"
        );
    }

    #[test]
    fn noise_and_landmarks_are_found_again() {
        // 12 landmarks on a grid of 40 m, each seen four times with s = 0.5 m, in rounds.
        let mut rng = Purpose::new("test", 6).generator();
        let mut rows = Vec::new();
        for round in 0..4 {
            for k in 0..12 {
                let mut normal = || rand_distr::StandardNormal.sample(&mut rng);
                let (dx, dy): (f64, f64) = (normal(), normal());
                let t = f64::from(round * 12 + k);
                rows.push(at(
                    40.0 * f64::from(k % 4) + 0.5 * dx,
                    40.0 * f64::from(k / 4) + 0.5 * dy,
                    Some((t, t + 0.5)),
                ));
            }
        }
        let mixture = Mixture::new(&Detections::new(rows).expect("good"), 0.01);
        let draws = mixture.sample(50, 200, 0.8, &mut rng);
        let mut noise: Vec<f64> = draws.iter().map(|draw| draw.noise_m).collect();
        noise.sort_by(f64::total_cmp);
        // 72 degrees of freedom: 0.5 is known to about 8 %.
        assert!((noise[100] - 0.5).abs() < 0.15, "{}", noise[100]);
        let n_sets = draws.iter().map(|draw| draw.n_sets as f64).sum::<f64>() / 200.0;
        assert!((11.5..13.5).contains(&n_sets), "{n_sets}");
    }
}
