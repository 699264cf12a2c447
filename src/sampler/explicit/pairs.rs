//! Who pays for being near whom: sums of f/H over pairs of locations.

use super::cells::Entry;
use super::laws::{CovarianceLaw, Law, Laws};
use super::placement::Placement;
use crate::model::Penalty;
use crate::model::moments::square_distance;
use crate::model::penalty::{LANES, PADDING};
use crate::partition::Partition;

/// Detections within so many radii of the penalty make their set a candidate (covariance model; in
/// the metric model the cells do).
const NEAR: f64 = 2.5;

impl CovarianceLaw<'_> {
    /// C̄⁻¹/D² of a pair.
    #[inline(always)]
    fn form(&self, i: u32, j: u32) -> [f64; 3] {
        let inverse = self.model.pair_inverse(i, j);
        inverse.map(|value| value * self.inverse_square_radius)
    }
}

/// dᵀQd of d = x − y.
#[inline(always)]
fn square(form: [f64; 3], x: [f64; 2], y: [f64; 2]) -> f64 {
    let (dx, dy) = (x[0] - y[0], x[1] - y[1]);
    form[0] * (dx * dx) + 2.0 * form[1] * (dx * dy) + form[2] * (dy * dy)
}

/// Locations near a detection, without its own, as the penalty's kernels take them.
#[derive(Default)]
pub(super) struct Near {
    /// x, y and set; padded to whole lanes in the metric model.
    columns: [Vec<f64>; 3],
    /// C̄⁻¹/D² of each pair; none in the metric model.
    forms: Vec<[f64; 3]>,
}

impl Near {
    pub(super) fn clear(&mut self) {
        self.columns.iter_mut().for_each(Vec::clear);
        self.forms.clear();
    }

    /// Fills the last lanes.
    pub(super) fn pad(&mut self) {
        if self.forms.is_empty() {
            let padded = self.columns[0].len().next_multiple_of(LANES);
            for (column, padding) in self.columns.iter_mut().zip([PADDING, PADDING, -2.0]) {
                column.resize(padded, padding);
            }
        }
    }
}

impl Laws<'_> {
    /// f/H of a pair in different sets.
    #[inline(always)]
    fn share(&self) -> impl Fn(f64) -> f64 {
        let shape = self.penalty().shape;
        move |u2| Penalty::share(shape, u2)
    }

    /// Σ f/H between a detection at x and all locations but its own and those of some sets; infinite
    /// outside the area.
    pub(super) fn sum_near(
        &self,
        placement: &Placement,
        i: u32,
        x_m: [f64; 2],
        skips: impl Fn(u32) -> bool,
    ) -> f64 {
        if !self.area.holds(x_m) {
            return f64::INFINITY;
        }
        let skips = |entry: &Entry| entry.detection == i || skips(entry.set_ix);
        let cells = &placement.cells;
        match &self.law {
            Law::Metric(_) => {
                let inverse = self.penalty().inverse_square_radius();
                let u2 = |entry: &Entry| square_distance(x_m, entry.x_m) * inverse;
                cells.sum_near(x_m, u2, self.share(), skips)
            }
            Law::Covariance(law) => {
                let u2 = |entry: &Entry| square(law.form(i, entry.detection), x_m, entry.x_m);
                cells.sum_near(x_m, u2, self.share(), skips)
            }
        }
    }

    /// Σ f/H over all pairs in different sets.
    pub(super) fn sum_of_all(&self, partition: &Partition, placement: &Placement) -> f64 {
        let own = |i: u32| partition.set_of()[i as usize];
        let paid = |i: u32| {
            let x_m = placement.x_m[i as usize];
            self.sum_near(placement, i, x_m, |set| set == own(i))
        };
        // Each pair is met twice.
        (0..self.n_detections() as u32).map(paid).sum::<f64>() / 2.0
    }

    /// Σ f/H over the pairs between two sets with their locations.
    pub(super) fn sum_between(&self, members: [&[u32]; 2], x_m: [&[[f64; 2]]; 2]) -> f64 {
        let share = self.share();
        let inverse = self.penalty().inverse_square_radius();
        let mut sum = 0.0;
        for (&i, &one) in members[0].iter().zip(x_m[0]) {
            for (&j, &other) in members[1].iter().zip(x_m[1]) {
                sum += share(match &self.law {
                    Law::Metric(_) => square_distance(one, other) * inverse,
                    Law::Covariance(law) => square(law.form(i, j), one, other),
                });
            }
        }
        sum
    }

    /// Notes a location near detection i. Whether it makes its set a candidate: it always does in
    /// the metric model, whose cells are as wide as the reach of every pair.
    #[inline]
    pub(super) fn note(&self, i: u32, entry: &Entry, near: &mut Near) -> bool {
        near.columns[0].push(entry.x_m[0]);
        near.columns[1].push(entry.x_m[1]);
        near.columns[2].push(f64::from(entry.set_ix));
        match &self.law {
            Law::Metric(_) => true,
            Law::Covariance(law) => {
                let form = law.form(i, entry.detection);
                near.forms.push(form);
                square(form, self.z_m(i), entry.x_m) < NEAR * NEAR
            }
        }
    }

    /// Σ f/H between a place and the locations near, without those of one set; infinite outside the
    /// area.
    pub(super) fn sum_noted(&self, near: &Near, x_m: [f64; 2], set: f64) -> f64 {
        if !self.area.holds(x_m) {
            return f64::INFINITY;
        }
        let [xs, ys, sets] = &near.columns;
        match &self.law {
            Law::Metric(_) => self.penalty().sum_over_others(x_m, set, [xs, ys, sets]),
            Law::Covariance(_) => {
                let share = self.share();
                let mut sum = 0.0;
                for (((&x, &y), &other), &form) in xs.iter().zip(ys).zip(sets).zip(&near.forms) {
                    let u2 = square(form, x_m, [x, y]);
                    if u2 < 1.0 && other != set {
                        sum += share(u2);
                    }
                }
                sum
            }
        }
    }
}
