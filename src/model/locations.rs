//! Draws of the locations of many detections, and which of them can come near each other.
//!
//! The R draws of one detection are contiguous, so that the pair kernels run over them in vector
//! registers: row i holds x_{i,0}, …, x_{i,R−1}, then padding up to the stride. In the covariance model a
//! row has h_{i,r} beside it, the log of its weight below the bound; in the metric model h = 0.

use serde::{Deserialize, Serialize};

use super::covariance::SiteMemory;
use super::optimum::OptimumMemory;
use super::{CovarianceModel, MetricModel, Model};

/// Standard normals ε, row by row.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Normals {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
}

impl Normals {
    pub(super) fn zeros(n_values: usize) -> Self {
        Self {
            x: vec![0.0; n_values],
            y: vec![0.0; n_values],
        }
    }
}

/// Rows of locations with the smallest box that holds each row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Locations {
    n_draws: usize,
    stride: usize,
    pub(super) x_m: Vec<f64>,
    pub(super) y_m: Vec<f64>,
    /// h, rows as above; empty as long as the metric model is all that was placed.
    pub(super) excess: Vec<f64>,
    boxes_m: Vec<Box2>,
}

/// An axis-parallel box: [left, right, bottom, top], m.
pub(super) type Box2 = [f64; 4];

impl Locations {
    pub(super) fn new(n_rows: usize, n_draws: usize, stride: usize) -> Self {
        let n_values = n_rows * stride;
        Self {
            n_draws,
            stride,
            x_m: vec![0.0; n_values],
            y_m: vec![0.0; n_values],
            excess: Vec::new(),
            boxes_m: vec![[0.0; 4]; n_rows],
        }
    }

    /// Makes room for at least so many rows.
    pub(super) fn reserve_rows(&mut self, n_rows: usize) {
        if n_rows > self.boxes_m.len() {
            let n_values = n_rows * self.stride;
            self.x_m.resize(n_values, 0.0);
            self.y_m.resize(n_values, 0.0);
            if !self.excess.is_empty() {
                self.excess.resize(n_values, 0.0);
            }
            self.boxes_m.resize(n_rows, [0.0; 4]);
        }
    }

    pub(super) fn row(&self, row: usize) -> [&[f64]; 2] {
        let range = row * self.stride..(row + 1) * self.stride;
        [&self.x_m[range.clone()], &self.y_m[range]]
    }

    pub(super) fn excess_row(&self, row: usize) -> &[f64] {
        &self.excess[row * self.stride..(row + 1) * self.stride]
    }

    pub(super) fn box_m(&self, row: usize) -> &Box2 {
        &self.boxes_m[row]
    }

    /// Copies a row, its box and its h from elsewhere.
    pub(super) fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        let (to, start) = (row * self.stride, from_row * self.stride);
        let range = start..start + self.stride;
        self.x_m[to..to + self.stride].copy_from_slice(&from.x_m[range.clone()]);
        self.y_m[to..to + self.stride].copy_from_slice(&from.y_m[range.clone()]);
        if !self.excess.is_empty() {
            self.excess[to..to + self.stride].copy_from_slice(&from.excess[range]);
        }
        self.boxes_m[row] = from.boxes_m[from_row];
    }

    /// The box of a row, anew. Padding is left out: nothing depends on it.
    pub(super) fn bound_row(&mut self, row: usize) {
        let start = row * self.stride;
        let range = start..start + self.n_draws;
        let (left, right) = extent(&self.x_m[range.clone()]);
        let (bottom, top) = extent(&self.y_m[range]);
        self.boxes_m[row] = [left, right, bottom, top];
    }
}

fn extent(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (
                if v < low { v } else { low },
                if v > high { v } else { high },
            )
        })
}

/// The smallest |x_i − x_j|² that two boxes allow, m².
pub(super) fn gap2(a: &Box2, b: &Box2) -> f64 {
    let gap_x = (b[0] - a[1]).max(a[0] - b[1]).max(0.0);
    let gap_y = (b[2] - a[3]).max(a[2] - b[3]).max(0.0);
    gap_x * gap_x + gap_y * gap_y
}

/// ε → X, set by set.
#[derive(Clone, Debug)]
pub struct Placer {
    /// What the ε̄ of a draw moves every member by.
    shift_x: Vec<f64>,
    shift_y: Vec<f64>,
    /// Optima of the covariance model.
    memory: SiteMemory,
    /// Optima of the metric model where it does not use its closed form.
    optima: OptimumMemory,
}

impl Placer {
    pub(super) fn new(stride: usize) -> Self {
        Self {
            shift_x: vec![0.0; stride],
            shift_y: vec![0.0; stride],
            memory: SiteMemory::default(),
            optima: OptimumMemory::default(),
        }
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

    /// Places the members of one set. Their normals are the rows `from(i)` of `normals`, their locations
    /// the rows `to(i)` of `locations`, for detection i.
    pub(super) fn place(
        &mut self,
        model: &Model,
        members: &[u32],
        (normals, from): (&Normals, impl Fn(u32) -> usize),
        (locations, to): (&mut Locations, impl Fn(u32) -> usize),
    ) {
        match model {
            Model::Metric(model) => {
                self.place_round_mean(model, members, (normals, from), (locations, to));
            }
            Model::Covariance(model) => {
                self.place_at_sites(model, members, (normals, from), (locations, to));
            }
        }
    }

    /// x_i = x_i\* + (ε_i − ε̄)/√(2b_n) + ε̄/√(2a).
    fn place_round_mean(
        &mut self,
        model: &MetricModel,
        members: &[u32],
        (normals, from): (&Normals, impl Fn(u32) -> usize),
        (locations, to): (&mut Locations, impl Fn(u32) -> usize),
    ) {
        let stride = locations.stride;
        if let Some(optimum) = self.optima.get(model, members) {
            let out = [&mut locations.x_m[..], &mut locations.y_m[..]];
            let epsilon = [&normals.x[..], &normals.y[..]];
            return optimum.place(stride, (epsilon, from), (out, to));
        }
        let scales = model.shrinkage(members.len());
        let centre = model.mean_m(members);
        // What a draw's ε̄ moves every member by: ε̄/√(2a) − ε̄/√(2b_n).
        let common = (scales.mean_m - scales.within_m) / members.len() as f64;
        for (axis, (values, out, shift)) in [
            (&normals.x, &mut locations.x_m, &mut self.shift_x),
            (&normals.y, &mut locations.y_m, &mut self.shift_y),
        ]
        .into_iter()
        .enumerate()
        {
            shift.fill(0.0);
            for &i in members {
                let start = from(i) * stride;
                for (sum, epsilon) in shift.iter_mut().zip(&values[start..start + stride]) {
                    *sum += epsilon;
                }
            }
            for sum in shift.iter_mut() {
                *sum *= common;
            }
            for &i in members {
                let z = model.positions_m()[i as usize][axis];
                let optimum = centre[axis] + scales.deviation * (z - centre[axis]);
                let (start, end) = (from(i) * stride, to(i) * stride);
                let epsilon = &values[start..start + stride];
                let row = out[end..end + stride].iter_mut().zip(epsilon);
                for ((value, epsilon), shift) in row.zip(shift.iter()) {
                    *value = optimum + (scales.within_m * epsilon + shift);
                }
            }
        }
    }

    /// x_i = x_i\* + L_i ε_i, with h.
    fn place_at_sites(
        &mut self,
        model: &CovarianceModel,
        members: &[u32],
        (normals, from): (&Normals, impl Fn(u32) -> usize),
        (locations, to): (&mut Locations, impl Fn(u32) -> usize),
    ) {
        let set = self.memory.get(model, members);
        let stride = locations.stride;
        locations.excess.resize(locations.x_m.len(), 0.0);
        for (&i, site) in set.members.iter().zip(&set.sites) {
            let (start, end) = (from(i) * stride, to(i) * stride);
            for r in 0..stride {
                let epsilon = [normals.x[start + r], normals.y[start + r]];
                [locations.x_m[end + r], locations.y_m[end + r]] = site.location_m(epsilon);
                locations.excess[end + r] = site.ln_excess(epsilon);
            }
        }
    }
}

/// Which rows can pay a penalty together, by their boxes.
///
/// Rounding is monotone, so a gap of at least D between two boxes means that each of the pair's R
/// terms is exactly 0. In the covariance model d² ≥ |x_i − x_j|²/λ with λ the largest eigenvalue of
/// C̄_ij; a margin makes up for the rounding of d².
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    inverse_square_radius: f64,
    /// The distance from which no pair of boxes interacts, m.
    pub(super) most_m: f64,
}

const MARGIN: f64 = 1.0 + 1e-9;

impl Reach {
    pub(super) fn of(model: &Model) -> Self {
        let penalty = model.penalty();
        let widest_m2 = match model {
            Model::Metric(_) => 1.0,
            Model::Covariance(model) => model.widest_m2(),
        };
        Self {
            inverse_square_radius: penalty.inverse_square_radius(),
            most_m: penalty.radius_m * (widest_m2 * MARGIN).sqrt() * MARGIN,
        }
    }

    /// Whether detections i and j can interact when their draws lie in these boxes.
    pub(super) fn holds(&self, model: &Model, i: u32, j: u32, a: &Box2, b: &Box2) -> bool {
        let u2 = gap2(a, b) * self.inverse_square_radius;
        match model {
            Model::Metric(_) => u2 < 1.0,
            Model::Covariance(model) => u2 < model.pair_widest_m2(i as usize, j as usize) * MARGIN,
        }
    }
}

/// Adds f/H of the pairs of one detection with others to every draw's sum: `other_rows[k]` of `others`
/// holds the locations of detection `detections[k]`.
pub(super) fn add_shares(
    model: &Model,
    (i, first): (u32, [&[f64]; 2]),
    (detections, other_rows): (&[u32], &[u32]),
    others: &Locations,
    sums: &mut [f64],
) {
    let penalty = model.penalty();
    match model {
        Model::Metric(_) => {
            penalty.add_pairs(first, other_rows, [&others.x_m, &others.y_m], sums);
        }
        Model::Covariance(model) => {
            for (&j, &row) in detections.iter().zip(other_rows) {
                let second = others.row(row as usize);
                // The same bits whichever of the two comes first.
                let whiten = model.pair_whitening(i.min(j), i.max(j));
                penalty.add_whitened_pair(whiten, first, second, sums);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::site::tests::model;

    /// Rows of normals and rows of locations each in an order of their own; padding is drawn too.
    #[test]
    fn a_set_of_the_covariance_model_is_placed_at_its_sites() {
        let covariance = model(2);
        let (members, stride) = ([1, 2, 5], 4);
        let mut normals = Normals::zeros(3 * stride);
        for (k, (x, y)) in normals.x.iter_mut().zip(&mut normals.y).enumerate() {
            (*x, *y) = (0.1 * k as f64 - 0.5, 0.3 - 0.07 * k as f64);
        }
        let row = |order: [u32; 3]| {
            move |i: u32| order.iter().position(|&own| own == i).expect("a member")
        };
        let (from, to) = (row([5, 1, 2]), row([2, 5, 1]));
        let mut locations = Locations::new(3, 3, stride);
        let mut placer = Placer::new(stride);
        let model = Model::from(covariance.clone());
        placer.place(&model, &members, (&normals, from), (&mut locations, to));
        let sites = placer.memory.get(&covariance, &members).clone();
        for (&i, site) in sites.members.iter().zip(&sites.sites) {
            for r in 0..stride {
                let start = from(i) * stride + r;
                let epsilon = [normals.x[start], normals.y[start]];
                let at = to(i) * stride + r;
                let placed = [locations.x_m[at], locations.y_m[at]];
                assert_eq!(placed, site.location_m(epsilon), "{i} {r}");
                assert_eq!(locations.excess[at], site.ln_excess(epsilon), "{i} {r}");
            }
        }
    }
}
