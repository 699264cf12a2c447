//! Importance draws of X, and the estimate of E[exp(−Pen)] from them (source report, eq. 5).
//!
//! R draws of all N locations are held detection by detection, the draws of one detection
//! contiguous, so that the pair kernels run over them in vector registers:
//! `x_m[i*R + r]`, `y_m[i*R + r]`.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::covariance::SiteMemory;
use super::numeric::ln_mean_exp;
use super::optimum::OptimumMemory;
use super::{CovarianceModel, MetricModel, Model, SetLaw};

/// R draws of N locations, and the working space of their penalty.
#[derive(Clone, Debug)]
pub struct Draws {
    n_draws: usize,
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    /// Set of each detection while a topology is evaluated.
    set_of: Vec<u32>,
    /// Smallest box that holds all draws of a detection: [x low, x high, y low, y high], m.
    boxes_m: Vec<[f64; 4]>,
    /// The detections that are evaluated, by the left edge of their box.
    by_left_edge: Vec<u32>,
    /// Mean of ε over a set, one per draw.
    mean_x: Vec<f64>,
    mean_y: Vec<f64>,
    /// Pen_r / H, then h_r − Pen_r.
    sums: Vec<f64>,
    /// h_r, summed over the locations: 0 in the metric model.
    excess: Vec<f64>,
    /// Optima of the covariance model.
    memory: SiteMemory,
    /// Optima of the metric model where it does not use its closed form.
    optima: OptimumMemory,
}

impl Draws {
    /// Space for R ≥ 1 draws of N locations.
    pub fn new(n_detections: usize, n_draws: usize) -> Self {
        let n_values = n_detections * n_draws;
        Self {
            n_draws,
            x_m: vec![0.0; n_values],
            y_m: vec![0.0; n_values],
            set_of: vec![0; n_detections],
            boxes_m: vec![[0.0; 4]; n_detections],
            by_left_edge: (0..n_detections as u32).collect(),
            mean_x: vec![0.0; n_draws],
            mean_y: vec![0.0; n_draws],
            sums: vec![0.0; n_draws],
            excess: vec![0.0; n_draws],
            memory: SiteMemory::default(),
            optima: OptimumMemory::default(),
        }
    }

    /// Number of draws R.
    pub fn n_draws(&self) -> usize {
        self.n_draws
    }

    /// ln of the largest weight that a set can have: ln I₀(S) in the metric model, whose weights have
    /// no other factor than exp(−Pen), and Σ_i [ln(π/√det A_i) − E_i\*] in the covariance model;
    /// with what the appearance of the set adds.
    pub fn ln_bound(&mut self, model: &Model, members: &[u32]) -> f64 {
        let of_locations = match model {
            Model::Metric(model) => self.optima.ln_gaussian(model, members),
            Model::Covariance(model) => self.memory.get(model, members).ln_bound,
        };
        of_locations + model.appearance().ln_likelihood(members)
    }

    /// ln of the mean over R fresh draws of exp(h − Pen(X; T)), ≤ 0, for the topology whose sets are
    /// given; together they hold every detection once. ln Ẑ(T) is this and the bounds of the sets.
    pub fn ln_mean_exp<'a>(
        &mut self,
        model: &Model,
        sets: impl Iterator<Item = &'a [u32]>,
        rng: &mut impl Rng,
    ) -> f64 {
        self.excess.fill(0.0);
        for (x, y) in self
            .x_m
            .chunks_exact_mut(self.n_draws)
            .zip(self.y_m.chunks_exact_mut(self.n_draws))
        {
            x.fill_with(|| StandardNormal.sample(rng));
            y.fill_with(|| StandardNormal.sample(rng));
        }
        for (set_ix, members) in sets.enumerate() {
            for &i in members {
                self.set_of[i as usize] = set_ix as u32;
            }
            match model {
                Model::Metric(model) => self.place(model, members),
                Model::Covariance(model) => self.place_at_sites(model, members),
            }
        }
        if self.by_left_edge.len() != self.set_of.len() {
            self.by_left_edge = (0..self.set_of.len() as u32).collect();
        }
        self.weigh(model);
        ln_mean_exp(&self.sums)
    }

    /// ln of R weights whose mean estimates E[exp(−Pen)], of exact draws from exp(−E) of the members
    /// of these sets alone: of the pairs among them, and of no other. For sets that interact with no
    /// set outside, as the room `exact` integrates them.
    pub fn ln_weights_among(
        &mut self,
        model: &Model,
        sets: &[(&[u32], &SetLaw)],
        rng: &mut impl Rng,
    ) -> &[f64] {
        self.by_left_edge.clear();
        self.excess.fill(0.0);
        for (set_ix, (members, law)) in sets.iter().enumerate() {
            for (k, &i) in members.iter().enumerate() {
                self.set_of[i as usize] = set_ix as u32;
                self.by_left_edge.push(i);
                let start = i as usize * self.n_draws;
                if let Some(site) = law.sites.get(k) {
                    for r in 0..self.n_draws {
                        let ([x, y], ln_weight) = site.draw(rng);
                        (self.x_m[start + r], self.y_m[start + r]) = (x, y);
                        self.excess[r] += ln_weight;
                    }
                } else {
                    let range = start..start + self.n_draws;
                    self.x_m[range.clone()].fill_with(|| StandardNormal.sample(rng));
                    self.y_m[range].fill_with(|| StandardNormal.sample(rng));
                }
            }
            if let Model::Metric(model) = model {
                self.place(model, members);
            }
        }
        self.weigh(model);
        &self.sums
    }

    /// Draws in place → h_r − Pen_r.
    fn weigh(&mut self, model: &Model) {
        self.bound();
        self.sum_penalties(model);
        let height = model.penalty().height;
        for sum in &mut self.sums {
            *sum *= -height;
        }
        if let Model::Covariance(_) = model {
            for (sum, excess) in self.sums.iter_mut().zip(&self.excess) {
                *sum += excess;
            }
        }
    }

    /// ε → X for the members of one set of the covariance model, and h: x_i = x_i\* + L_i ε_i.
    fn place_at_sites(&mut self, model: &CovarianceModel, members: &[u32]) {
        let set = self.memory.get(model, members);
        for (&i, site) in set.members.iter().zip(&set.sites) {
            let range = i as usize * self.n_draws..(i as usize + 1) * self.n_draws;
            let (x, y) = (&mut self.x_m[range.clone()], &mut self.y_m[range]);
            for ((x, y), excess) in x.iter_mut().zip(y).zip(&mut self.excess) {
                let epsilon = [*x, *y];
                *excess += site.ln_excess(epsilon);
                [*x, *y] = site.location_m(epsilon);
            }
        }
    }

    /// h − Pen of every draw of the topology evaluated last.
    pub fn ln_weights(&self) -> &[f64] {
        &self.sums
    }

    /// ε → X for the members of one set: x_i = x_i\* + (ε_i − ε̄)/√(2b_n) + ε̄/√(2a).
    fn place(&mut self, model: &MetricModel, members: &[u32]) {
        if let Some(optimum) = self.optima.get(model, members) {
            return optimum.place(self.n_draws, [&mut self.x_m, &mut self.y_m]);
        }
        let scales = model.shrinkage(members.len());
        let centre = model.mean_m(members);
        for (axis, (values, mean)) in [
            (&mut self.x_m, &mut self.mean_x),
            (&mut self.y_m, &mut self.mean_y),
        ]
        .into_iter()
        .enumerate()
        {
            mean.fill(0.0);
            for &i in members {
                let start = i as usize * self.n_draws;
                for (sum, epsilon) in mean.iter_mut().zip(&values[start..start + self.n_draws]) {
                    *sum += epsilon;
                }
            }
            // What a draw's ε̄ moves every member by: ε̄/√(2a) − ε̄/√(2b_n).
            let common = (scales.mean_m - scales.within_m) / members.len() as f64;
            for sum in mean.iter_mut() {
                *sum *= common;
            }
            for &i in members {
                let z = model.positions_m()[i as usize][axis];
                let optimum = centre[axis] + scales.deviation * (z - centre[axis]);
                let start = i as usize * self.n_draws;
                for (value, shift) in values[start..start + self.n_draws]
                    .iter_mut()
                    .zip(mean.iter())
                {
                    *value = optimum + (scales.within_m * *value + shift);
                }
            }
        }
    }

    fn bound(&mut self) {
        let extent = |values: &[f64]| {
            values
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
                    (
                        if v < low { v } else { low },
                        if v > high { v } else { high },
                    )
                })
        };
        for &i in &self.by_left_edge {
            let i = i as usize;
            let range = i * self.n_draws..(i + 1) * self.n_draws;
            let (left, right) = extent(&self.x_m[range.clone()]);
            let (bottom, top) = extent(&self.y_m[range]);
            self.boxes_m[i] = [left, right, bottom, top];
        }
        let boxes_m = &self.boxes_m;
        self.by_left_edge.sort_unstable_by(|&i, &j| {
            boxes_m[i as usize][0]
                .total_cmp(&boxes_m[j as usize][0])
                .then(i.cmp(&j))
        });
    }

    /// Pen_r/H of every draw. Pairs that no draw brings within the radius are skipped by a sweep
    /// over the boxes: rounding is monotone, so a gap of at least D between the boxes means that
    /// each of the pair's R terms is exactly 0, and the sums are what they would be without.
    ///
    /// In the covariance model d² ≥ |x_i − x_j|² / λ with λ the largest eigenvalue of C̄_ij; a margin makes
    /// up for the rounding of d².
    fn sum_penalties(&mut self, model: &Model) {
        const MARGIN: f64 = 1.0 + 1e-9;
        let penalty = model.penalty();
        let inverse_square_radius = penalty.inverse_square_radius();
        let scale = match model {
            Model::Metric(_) => inverse_square_radius,
            Model::Covariance(model) => inverse_square_radius / (model.widest_m2() * MARGIN),
        };
        self.sums.fill(0.0);
        for (place, &i) in self.by_left_edge.iter().enumerate() {
            let i = i as usize;
            let [_, right, bottom, top] = self.boxes_m[i];
            for &j in &self.by_left_edge[place + 1..] {
                let j = j as usize;
                let [other_left, _, other_bottom, other_top] = self.boxes_m[j];
                let gap_x = (other_left - right).max(0.0);
                if gap_x * gap_x * scale >= 1.0 {
                    break;
                }
                if self.set_of[i] == self.set_of[j] {
                    continue;
                }
                let gap_y = (other_bottom - top).max(bottom - other_top).max(0.0);
                let gap2 = gap_x * gap_x + gap_y * gap_y;
                let range = |k: usize| k * self.n_draws..(k + 1) * self.n_draws;
                let at = |k: usize| [&self.x_m[range(k)], &self.y_m[range(k)]];
                match model {
                    Model::Metric(_) => {
                        if gap2 * scale < 1.0 {
                            penalty.add_pair(at(i), at(j), &mut self.sums);
                        }
                    }
                    Model::Covariance(model) => {
                        let widest_m2 = model.pair_widest_m2(i, j) * MARGIN;
                        if gap2 * inverse_square_radius < widest_m2 {
                            // The same bits whichever of the two comes first by its edge.
                            let (i, j) = (i.min(j), i.max(j));
                            let whiten = model.pair_whitening(i as u32, j as u32);
                            penalty.add_whitened_pair(whiten, at(i), at(j), &mut self.sums);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Penalty, PenaltyShape};
    use crate::rng::Purpose;

    fn metric(shape: PenaltyShape) -> MetricModel {
        let positions_m: Vec<[f64; 2]> = (0..12)
            .map(|i| [f64::from(i % 4) * 1.5, f64::from(i / 4) * 2.0])
            .collect();
        MetricModel::new(
            &positions_m,
            0.4,
            0.6,
            Penalty {
                shape,
                radius_m: 2.5,
                height: 4.0,
            },
        )
    }

    #[test]
    fn skipping_far_pairs_changes_no_bit_and_all_near_pairs_count() {
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            let model = Model::from(metric(shape));
            let sets: Vec<Vec<u32>> = vec![
                vec![0, 5, 7],
                vec![1],
                vec![2, 3, 4, 6],
                vec![8, 11],
                vec![9, 10],
            ];
            let mut draws = Draws::new(12, 33);
            let mut rng = Purpose::new("test", 3).generator();
            let estimate = draws.ln_mean_exp(&model, sets.iter().map(Vec::as_slice), &mut rng);
            let mut penalties = vec![0.0; 33];
            for (r, total) in penalties.iter_mut().enumerate() {
                for i in 0..12 {
                    for j in 0..i {
                        if draws.set_of[i] != draws.set_of[j] {
                            let at = |k: usize| k * 33 + r;
                            let dx = draws.x_m[at(i)] - draws.x_m[at(j)];
                            let dy = draws.y_m[at(i)] - draws.y_m[at(j)];
                            *total -= 4.0 * Penalty::share(shape, (dx * dx + dy * dy) / 6.25);
                        }
                    }
                }
            }
            for (fast, plain) in draws.ln_weights().iter().zip(&penalties) {
                assert!((fast - plain).abs() < 1e-12 * plain.abs().max(1.0));
            }
            assert!((estimate - ln_mean_exp(&penalties)).abs() < 1e-12);
        }
    }

    #[test]
    fn draws_have_the_mean_and_covariance_of_eq_4() {
        let metric = metric(PenaltyShape::Quadratic);
        let model = Model::from(metric.clone());
        let n_draws = 200_000;
        let mut draws = Draws::new(12, n_draws);
        let mut rng = Purpose::new("test", 4).generator();
        let everyone: Vec<u32> = (0..12).collect();
        draws.ln_mean_exp(&model, std::iter::once(everyone.as_slice()), &mut rng);
        let scales = metric.shrinkage(12);
        let (w2, m2) = (scales.within_m.powi(2), scales.mean_m.powi(2));
        let variance = w2 - w2 / 12.0 + m2 / 12.0;
        let centre = metric.mean_m(&everyone);
        for i in [0_usize, 7] {
            let x = &draws.x_m[i * n_draws..(i + 1) * n_draws];
            let mean = x.iter().sum::<f64>() / n_draws as f64;
            let optimum = centre[0] + scales.deviation * (metric.positions_m()[i][0] - centre[0]);
            // Five standard errors of a mean and of a variance of normal draws.
            assert!((mean - optimum).abs() < 5.0 * (variance / n_draws as f64).sqrt());
            let spread = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n_draws as f64;
            assert!((spread / variance - 1.0).abs() < 5.0 * (2.0 / n_draws as f64).sqrt());
        }
    }
}
