//! Draws that a chain keeps: the estimator `common`.
//!
//! The normals ε (N×R×2) are part of the state, whose law is P(T) · p(ε) · Ẑ(T, ε). A move of the
//! partition keeps ε, and there is no Jacobian; its marginal over T is the posterior for every R ≥ 1
//! (random numbers in common, as Deligiannidis, Doucet & Pitt 2018 correlate theirs). A *refresh*
//! draws the rows of one set anew; without it the chain would sample π(T | ε).
//!
//! So a proposal differs from the current state by the locations of the detections in the sets that it
//! touches, and by the pairs that those are in; the cost of a step does not grow with N. Of each draw
//! the state keeps Pen_r/H and h_r, and a proposal takes out what the changed detections had and puts in
//! what they get. Rounding that this piles up is cleared by [`CommonDraws::rebuild`] every fixed number of
//! steps.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::grid::Grid;
use super::locations::{Locations, Normals, Reach, add_shares};
use super::numeric::ln_mean_exp;
use super::{Model, Workspace};

/// Draws are padded to a multiple of this, the widest vector register.
const LANES: usize = 8;

/// The normals of a chain, the locations they give under its topology, and their penalty.
#[derive(Clone, Debug)]
pub struct CommonDraws {
    n_draws: usize,
    pub(super) normals: Normals,
    pub(super) locations: Locations,
    pub(super) grid: Grid,
    /// Pen_r/H.
    pub(super) shares: Vec<f64>,
    /// Σ_i h_{i,r}; 0 in the metric model.
    pub(super) excess: Vec<f64>,
}

impl CommonDraws {
    /// R ≥ 1 draws from p(ε), under the topology whose sets are given: together they hold every detection
    /// once, and `set_of` numbers them.
    pub fn new(
        model: &Model,
        n_draws: usize,
        (sets, set_of): (&[Vec<u32>], &[u32]),
        work: &mut Workspace,
        rng: &mut impl Rng,
    ) -> Self {
        let n = model.n_detections();
        let stride = stride(n_draws);
        let mut normals = Normals::zeros(n * stride);
        fill(&mut normals, 0..n, n_draws, stride, rng);
        let mut locations = Locations::new(n, n_draws, stride);
        let row = |i: u32| i as usize;
        for members in sets {
            let (from, to) = ((&normals, row), (&mut locations, row));
            work.placer.place(model, members, from, to);
        }
        for i in 0..n {
            locations.bound_row(i);
        }
        let grid = Grid::new(model.positions_m(), Reach::of(model).most_m, |i| {
            locations.box_m(i)
        });
        let mut draws = Self {
            n_draws,
            normals,
            locations,
            grid,
            shares: vec![0.0; stride],
            excess: vec![0.0; stride],
        };
        draws.rebuild(model, set_of, work);
        draws
    }

    /// ln of the mean over the draws of exp(h − Pen), ≤ 0, for any model that differs from theirs in the height
    /// of its penalty at most.
    pub fn ln_mean(&self, model: &Model, scratch: &mut Vec<f64>) -> f64 {
        let height = model.penalty().height;
        let sums = self.shares.iter().zip(&self.excess).take(self.n_draws);
        scratch.clear();
        scratch.extend(sums.map(|(share, h)| h - height * share));
        ln_mean_exp(scratch)
    }

    /// The sums of every draw from scratch: what they were but for rounding, which a debug build checks
    /// against 1e-9 of the largest.
    pub fn rebuild(&mut self, model: &Model, set_of: &[u32], work: &mut Workspace) {
        let n = set_of.len();
        let reach = Reach::of(model);
        self.grid = Grid::new(model.positions_m(), reach.most_m, |i| {
            self.locations.box_m(i)
        });
        self.shares.fill(0.0);
        for i in 0..n as u32 {
            let own = self.locations.box_m(i as usize);
            work.near.clear();
            self.grid.near(own, reach.most_m, |j| {
                let apart = j > i && set_of[i as usize] != set_of[j as usize];
                if apart && reach.holds(model, i, j, own, self.locations.box_m(j as usize)) {
                    work.near.push(j);
                }
            });
            let first = (i, self.locations.row(i as usize));
            let others = (work.near.as_slice(), work.near.as_slice());
            add_shares(model, first, others, &self.locations, &mut self.shares);
        }
        self.excess.fill(0.0);
        if let Model::Covariance(_) = model {
            for i in 0..n {
                add(self.locations.excess_row(i), &mut self.excess);
            }
        }
    }

    /// How far the sums that were kept up to date are from those from scratch, over the largest.
    pub fn drift(&self, model: &Model, set_of: &[u32], work: &mut Workspace) -> f64 {
        let mut anew = self.clone();
        anew.rebuild(model, set_of, work);
        let apart = |a: &[f64], b: &[f64]| {
            let pairs = a.iter().zip(b).take(self.n_draws);
            pairs.fold((0.0_f64, 1.0_f64), |(apart, size), (a, b)| {
                (apart.max((a - b).abs()), size.max(b.abs()))
            })
        };
        let relative = |(apart, size): (f64, f64)| apart / size;
        relative(apart(&self.shares, &anew.shares)).max(relative(apart(&self.excess, &anew.excess)))
    }
}

/// Length of a row: whole vector registers, unless there is one draw.
pub(super) fn stride(n_draws: usize) -> usize {
    if n_draws == 1 {
        1
    } else {
        n_draws.next_multiple_of(LANES)
    }
}

/// Draws normals into rows; the padding stays 0.
pub(super) fn fill(
    normals: &mut Normals,
    rows: std::ops::Range<usize>,
    n_draws: usize,
    stride: usize,
    rng: &mut impl Rng,
) {
    for row in rows {
        let range = row * stride..row * stride + n_draws;
        normals.x[range.clone()].fill_with(|| StandardNormal.sample(rng));
        normals.y[range].fill_with(|| StandardNormal.sample(rng));
    }
}

pub(super) fn add(row: &[f64], sums: &mut [f64]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += value;
    }
}
