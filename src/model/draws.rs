//! Importance draws of X, and the estimate of E[exp(−Pen)] from them (source report, eq. 5).
//!
//! Here every estimate has draws of its own: the estimator `fresh`, and the integrals of the room
//! `exact`.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::locations::{Locations, Normals, Placer, Reach, add_shares};
use super::numeric::ln_mean_exp;
use super::{Model, SetLaw};

/// R draws of N locations, and the working space of their penalty.
#[derive(Clone, Debug)]
pub struct Draws {
    n_draws: usize,
    normals: Normals,
    locations: Locations,
    placer: Placer,
    /// Set of each detection while a topology is evaluated.
    set_of: Vec<u32>,
    /// The detections that are evaluated, by the left edge of their box.
    by_left_edge: Vec<u32>,
    /// Partners of a detection.
    near: Vec<u32>,
    /// Pen_r / H.
    shares: Vec<f64>,
    /// h_r, summed over the locations: 0 in the metric model.
    excess: Vec<f64>,
    /// h_r − Pen_r.
    ln_weights: Vec<f64>,
}

impl Draws {
    /// Space for R ≥ 1 draws of N locations.
    pub fn new(n_detections: usize, n_draws: usize) -> Self {
        Self {
            n_draws,
            normals: Normals::zeros(n_detections * n_draws),
            locations: Locations::new(n_detections, n_draws, n_draws),
            placer: Placer::new(n_draws),
            set_of: vec![0; n_detections],
            by_left_edge: (0..n_detections as u32).collect(),
            near: Vec::new(),
            shares: vec![0.0; n_draws],
            excess: vec![0.0; n_draws],
            ln_weights: vec![0.0; n_draws],
        }
    }

    /// Number of draws R.
    pub fn n_draws(&self) -> usize {
        self.n_draws
    }

    /// As [`Placer::ln_bound`].
    pub fn ln_bound(&mut self, model: &Model, members: &[u32]) -> f64 {
        self.placer.ln_bound(model, members)
    }

    /// ln of the mean over R fresh draws of exp(h − Pen(X; T)), ≤ 0, for the topology whose sets are
    /// given; together they hold every detection once. ln Ẑ(T) is this and the bounds of the sets.
    pub fn ln_mean_exp<'a>(
        &mut self,
        model: &Model,
        sets: impl Iterator<Item = &'a [u32]>,
        rng: &mut impl Rng,
    ) -> f64 {
        let Normals { x, y } = &mut self.normals;
        let rows = x.chunks_exact_mut(self.n_draws);
        for (x, y) in rows.zip(y.chunks_exact_mut(self.n_draws)) {
            x.fill_with(|| StandardNormal.sample(rng));
            y.fill_with(|| StandardNormal.sample(rng));
        }
        if self.by_left_edge.len() != self.set_of.len() {
            self.by_left_edge = (0..self.set_of.len() as u32).collect();
        }
        let row = |i: u32| i as usize;
        for (set_ix, members) in sets.enumerate() {
            for &i in members {
                self.set_of[i as usize] = set_ix as u32;
            }
            let (from, to) = ((&self.normals, row), (&mut self.locations, row));
            self.placer.place(model, members, from, to);
        }
        self.excess.fill(0.0);
        if let Model::Covariance(_) = model {
            for row in self.locations.excess.chunks_exact(self.n_draws) {
                for (sum, excess) in self.excess.iter_mut().zip(row) {
                    *sum += excess;
                }
            }
        }
        self.weigh(model);
        ln_mean_exp(&self.ln_weights)
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
        let row = |i: u32| i as usize;
        for (set_ix, (members, law)) in sets.iter().enumerate() {
            for (k, &i) in members.iter().enumerate() {
                self.set_of[i as usize] = set_ix as u32;
                self.by_left_edge.push(i);
                let start = i as usize * self.n_draws;
                if let Some(site) = law.sites.get(k) {
                    for r in 0..self.n_draws {
                        let ([x, y], ln_weight) = site.draw(rng);
                        self.locations.x_m[start + r] = x;
                        self.locations.y_m[start + r] = y;
                        self.excess[r] += ln_weight;
                    }
                } else {
                    let range = start..start + self.n_draws;
                    self.normals.x[range.clone()].fill_with(|| StandardNormal.sample(rng));
                    self.normals.y[range].fill_with(|| StandardNormal.sample(rng));
                }
            }
            if let Model::Metric(_) = model {
                let (from, to) = ((&self.normals, row), (&mut self.locations, row));
                self.placer.place(model, members, from, to);
            }
        }
        self.weigh(model);
        &self.ln_weights
    }

    /// h − Pen of every draw of the topology evaluated last.
    pub fn ln_weights(&self) -> &[f64] {
        &self.ln_weights
    }

    /// Draws in place → h_r − Pen_r.
    fn weigh(&mut self, model: &Model) {
        self.sum_shares(model);
        let height = model.penalty().height;
        let sums = self.shares.iter().zip(&self.excess);
        for (ln_weight, (share, excess)) in self.ln_weights.iter_mut().zip(sums) {
            *ln_weight = excess - height * share;
        }
    }

    /// Pen_r/H of every draw. Pairs that no draw brings within the radius are skipped by a sweep over
    /// the boxes; their terms are exactly 0.
    fn sum_shares(&mut self, model: &Model) {
        for &i in &self.by_left_edge {
            self.locations.bound_row(i as usize);
        }
        let (reach, locations) = (Reach::of(model), &self.locations);
        let box_of = |i: u32| locations.box_m(i as usize);
        self.by_left_edge.sort_unstable_by(|&i, &j| {
            let left = |i: u32| box_of(i)[0];
            left(i).total_cmp(&left(j)).then(i.cmp(&j))
        });
        self.shares.fill(0.0);
        for (place, &i) in self.by_left_edge.iter().enumerate() {
            let own = box_of(i);
            self.near.clear();
            for &j in &self.by_left_edge[place + 1..] {
                let other = box_of(j);
                if other[0] - own[1] >= reach.most_m {
                    break;
                }
                let apart = self.set_of[i as usize] != self.set_of[j as usize];
                if apart && reach.holds(model, i, j, own, other) {
                    self.near.push(j);
                }
            }
            let first = (i, locations.row(i as usize));
            let others = (self.near.as_slice(), self.near.as_slice());
            add_shares(model, first, others, locations, &mut self.shares);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, Penalty, PenaltyShape};
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
                            let dx = draws.locations.x_m[at(i)] - draws.locations.x_m[at(j)];
                            let dy = draws.locations.y_m[at(i)] - draws.locations.y_m[at(j)];
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
            let x = &draws.locations.x_m[i * n_draws..(i + 1) * n_draws];
            let mean = x.iter().sum::<f64>() / n_draws as f64;
            let optimum = centre[0] + scales.deviation * (metric.positions_m()[i][0] - centre[0]);
            // Five standard errors of a mean and of a variance of normal draws.
            assert!((mean - optimum).abs() < 5.0 * (variance / n_draws as f64).sqrt());
            let spread = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n_draws as f64;
            assert!((spread / variance - 1.0).abs() < 5.0 * (2.0 / n_draws as f64).sqrt());
        }
    }
}
