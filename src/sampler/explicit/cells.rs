//! The plane in cells, each with the locations in it: who pays for being near a point.
//!
//! Cells are at least as wide as the reach of the penalty in the plane, so that whoever pays for being near a
//! point is in its cell or in the eight around it. Locations outside the area of the detections
//! count to the border cells; clamping brings no two cells further apart.

use serde::{Deserialize, Serialize};

/// The set of a detection that stands still: one that nobody can join.
pub(super) const STANDING: u32 = u32::MAX - 1;

/// A location in its cell.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) x_m: [f64; 2],
    pub(super) set_ix: u32,
    pub(super) detection: u32,
}

/// The cells.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Cells {
    origin_m: [f64; 2],
    inverse_side: f64,
    n: [usize; 2],
    cells: Vec<Vec<Entry>>,
    /// Cell and place within it of each detection.
    at: Vec<[u32; 2]>,
}

/// Column and row of a cell.
pub(super) type Place = [usize; 2];

impl Cells {
    /// Over the area of the positions and twice the reach of the penalty around it; empty.
    pub(super) fn new(positions_m: &[[f64; 2]], reach_m: f64) -> Self {
        let margin_m = 2.0 * reach_m;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for position in positions_m {
            for axis in [0, 1] {
                low[axis] = low[axis].min(position[axis] - margin_m);
                high[axis] = high[axis].max(position[axis] + margin_m);
            }
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let n = positions_m.len() as f64;
        // As wide as the reach, with a margin for rounding, or so wide that there are about four
        // cells for each detection.
        let even = (extent[0] * extent[1] / n).sqrt() / 2.0;
        let thin = extent[0].max(extent[1]) / (4.0 * n);
        let side = (reach_m * (1.0 + 1e-9)).max(even).max(thin);
        let n = extent.map(|extent| (extent / side) as usize + 1);
        Self {
            origin_m: low,
            inverse_side: 1.0 / side,
            n,
            cells: vec![Vec::new(); n[0] * n[1]],
            at: vec![[u32::MAX; 2]; positions_m.len()],
        }
    }

    /// The cell of a point.
    #[inline]
    pub(super) fn place(&self, x_m: [f64; 2]) -> Place {
        // A conversion to an integer saturates, so what lies outside ends in the border cells.
        [0, 1].map(|axis| {
            let place = ((x_m[axis] - self.origin_m[axis]) * self.inverse_side) as usize;
            place.min(self.n[axis] - 1)
        })
    }

    fn index(&self, [column, row]: Place) -> usize {
        row * self.n[0] + column
    }

    /// The cells up to so many columns and rows from this one, row by row.
    #[inline]
    pub(super) fn around(&self, place: Place, reach: usize) -> impl Iterator<Item = &Vec<Entry>> {
        let range = |axis: usize| {
            place[axis].saturating_sub(reach)..(place[axis] + reach + 1).min(self.n[axis])
        };
        let columns = range(0);
        range(1).flat_map(move |row| {
            let start = row * self.n[0];
            self.cells[start + columns.start..start + columns.end].iter()
        })
    }

    /// Σ share(u²) over the locations near x that are not skipped, u the distance over D.
    #[inline]
    pub(super) fn sum_near(
        &self,
        x_m: [f64; 2],
        square: impl Fn(&Entry) -> f64,
        share: impl Fn(f64) -> f64,
        skips: impl Fn(&Entry) -> bool,
    ) -> f64 {
        let mut sum = 0.0;
        for cell in self.around(self.place(x_m), 1) {
            for entry in cell {
                let u2 = square(entry);
                if u2 < 1.0 && !skips(entry) {
                    sum += share(u2);
                }
            }
        }
        sum
    }

    /// Enters a location.
    pub(super) fn insert(&mut self, entry: Entry) {
        let ix = self.index(self.place(entry.x_m));
        self.at[entry.detection as usize] = [ix as u32, self.cells[ix].len() as u32];
        self.cells[ix].push(entry);
    }

    /// Moves a detection's location.
    pub(super) fn relocate(&mut self, detection: u32, x_m: [f64; 2]) {
        let [cell, place] = self.at[detection as usize].map(|ix| ix as usize);
        if self.index(self.place(x_m)) == cell {
            self.cells[cell][place].x_m = x_m;
            return;
        }
        let entry = self.cells[cell].swap_remove(place);
        if let Some(moved) = self.cells[cell].get(place) {
            self.at[moved.detection as usize][1] = place as u32;
        }
        self.insert(Entry { x_m, ..entry });
    }

    /// Says which set a detection is in.
    pub(super) fn relabel(&mut self, detection: u32, set_ix: u32) {
        let [cell, place] = self.at[detection as usize].map(|ix| ix as usize);
        self.cells[cell][place].set_ix = set_ix;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::moments::square_distance;
    use crate::model::{Penalty, PenaltyShape};
    use crate::rng::Purpose;
    use rand::RngExt;

    /// Against all pairs, while locations wander, also out of the area.
    #[test]
    fn nobody_near_is_missed() {
        let mut rng = Purpose::new("cells test", 1).generator();
        for (extent, radius_m) in [(30.0, 2.0), (1.0, 50.0), (900.0, 0.5)] {
            let mut draw = |spread: f64| [0, 1].map(|_| spread * (rng.random::<f64>() - 0.3));
            let mut x: Vec<[f64; 2]> = (0..120).map(|_| draw(extent)).collect();
            let mut cells = Cells::new(&x, radius_m);
            assert!(cells.cells.len() < 3000, "{}", cells.cells.len());
            for (i, &x_m) in x.iter().enumerate() {
                let (set_ix, detection) = (0, i as u32);
                cells.insert(Entry {
                    x_m,
                    set_ix,
                    detection,
                });
            }
            for step in 0..600_usize {
                let i = step * 7 % x.len();
                x[i] = draw(if step % 5 == 0 { 3.0 * extent } else { extent });
                cells.relocate(i as u32, x[i]);
                cells.relabel(i as u32, (step % 4) as u32);
                let inverse = 1.0 / (radius_m * radius_m);
                let share = |u2| Penalty::share(PenaltyShape::Quadratic, u2);
                let square = |entry: &Entry| square_distance(x[i], entry.x_m) * inverse;
                let got = cells.sum_near(x[i], square, share, |entry| entry.detection == i as u32);
                let others = x.iter().enumerate().filter(|(j, _)| *j != i);
                let expected: f64 = others
                    .map(|(_, x_m)| share(square_distance(x[i], *x_m) * inverse))
                    .sum();
                assert!((got - expected).abs() < 1e-9, "{got} {expected}");
                let [cell, place] = cells.at[i].map(|ix| ix as usize);
                assert_eq!(cells.cells[cell][place].set_ix, (step % 4) as u32);
            }
        }
    }
}
