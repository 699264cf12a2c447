//! A cell grid over the boxes of draws: who can come near whom, in time that does not grow with N.

use serde::{Deserialize, Serialize};

use super::locations::Box2;

const NOBODY: u32 = u32::MAX;

/// Detections by the cell that holds the centre of their box: a doubly linked list for each cell, so
/// that moving one allocates nothing.
///
/// Centres outside the grid count to its border cells. That never loses a partner, because clamping
/// brings no two cells further apart.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Grid {
    origin_m: [f64; 2],
    inverse_side: f64,
    n_cells: [usize; 2],
    head: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    cell_of: Vec<u32>,
    /// No box reaches further from its centre than this, m.
    half_m: f64,
}

impl Grid {
    /// Over the area of `positions_m`, where boxes will be sooner or later, for boxes that interact up to
    /// `reach_m` apart; all of them are entered.
    pub(super) fn new<'a>(
        positions_m: &[[f64; 2]],
        reach_m: f64,
        box_of: impl Fn(usize) -> &'a Box2,
    ) -> Self {
        let n_detections = positions_m.len();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut half_m = 0.0_f64;
        for (i, position) in positions_m.iter().enumerate() {
            for axis in [0, 1] {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
            half_m = half_m.max(half(box_of(i)));
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        // A cell as wide as partners can lie apart, or as leaves about one cell for each detection.
        let even = (extent[0] * extent[1] / n_detections as f64).sqrt();
        let thin = extent[0].max(extent[1]) / (4.0 * n_detections as f64);
        let side = (reach_m + 2.0 * half_m).max(even).max(thin);
        let count = |axis: usize| (extent[axis] / side) as usize + 1;
        let n_cells = [count(0), count(1)];
        let mut grid = Self {
            origin_m: low,
            inverse_side: 1.0 / side,
            n_cells,
            head: vec![NOBODY; n_cells[0] * n_cells[1]],
            next: vec![NOBODY; n_detections],
            previous: vec![NOBODY; n_detections],
            cell_of: vec![0; n_detections],
            half_m,
        };
        for i in 0..n_detections {
            grid.insert(i as u32, box_of(i));
        }
        grid
    }

    /// Row or column of a coordinate.
    fn place(&self, value_m: f64, axis: usize) -> usize {
        // A conversion to an integer saturates, so far-away values end in the border cells.
        let place = ((value_m - self.origin_m[axis]) * self.inverse_side) as usize;
        place.min(self.n_cells[axis] - 1)
    }

    fn insert(&mut self, i: u32, bounds: &Box2) {
        let [x, y] = centre(bounds);
        let cell = self.place(y, 1) * self.n_cells[0] + self.place(x, 0);
        let first = self.head[cell];
        self.next[i as usize] = first;
        self.previous[i as usize] = NOBODY;
        if first != NOBODY {
            self.previous[first as usize] = i;
        }
        self.head[cell] = i;
        self.cell_of[i as usize] = cell as u32;
        self.half_m = self.half_m.max(half(bounds));
    }

    /// Enters the new box of a detection in place of the old one.
    pub(super) fn relocate(&mut self, i: u32, bounds: &Box2) {
        let (next, previous) = (self.next[i as usize], self.previous[i as usize]);
        if previous == NOBODY {
            self.head[self.cell_of[i as usize] as usize] = next;
        } else {
            self.next[previous as usize] = next;
        }
        if next != NOBODY {
            self.previous[next as usize] = previous;
        }
        self.insert(i, bounds);
    }

    /// Calls `visit` with every detection whose box may come within `reach_m` of this one, and with some
    /// others.
    pub(super) fn near(&self, bounds: &Box2, reach_m: f64, mut visit: impl FnMut(u32)) {
        let margin = reach_m + self.half_m;
        let columns = self.place(bounds[0] - margin, 0)..=self.place(bounds[1] + margin, 0);
        let rows = self.place(bounds[2] - margin, 1)..=self.place(bounds[3] + margin, 1);
        for row in rows {
            for column in columns.clone() {
                let mut i = self.head[row * self.n_cells[0] + column];
                while i != NOBODY {
                    visit(i);
                    i = self.next[i as usize];
                }
            }
        }
    }
}

fn centre(bounds: &Box2) -> [f64; 2] {
    [0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[2] + bounds[3])]
}

/// How far a box reaches from its centre, with a margin for the rounding of the centre.
fn half(bounds: &Box2) -> f64 {
    let half = (bounds[1] - bounds[0]).max(bounds[3] - bounds[2]) * 0.5;
    let size = bounds.iter().fold(0.0_f64, |size, b| size.max(b.abs()));
    half + size * 1e-12
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    /// Against all pairs, while boxes wander, also out of the grid.
    #[test]
    fn no_partner_is_missed() {
        let mut rng = Purpose::new("grid test", 1).generator();
        let n = 200;
        for (extent, reach) in [(50.0, 3.0), (1.0, 100.0), (1000.0, 0.5)] {
            let mut draw = |spread: f64| -> Box2 {
                let [x, y, w, h] = [spread, spread, 2.0, 3.0].map(|s| s * rng.random::<f64>());
                [x, x + w, y, y + h]
            };
            let mut boxes: Vec<Box2> = (0..n).map(|_| draw(extent)).collect();
            let centres: Vec<[f64; 2]> = boxes.iter().map(centre).collect();
            let mut grid = Grid::new(&centres, reach, |i| &boxes[i]);
            for step in 0..400 {
                let i = step * 7 % n;
                boxes[i] = draw(if step % 5 == 0 { 3.0 * extent } else { extent });
                grid.relocate(i as u32, &boxes[i]);
                let mut near = vec![0; n];
                grid.near(&boxes[i], reach, |j| near[j as usize] += 1);
                assert!(near.iter().all(|&times| times <= 1));
                for j in 0..n {
                    let gap = |low: usize| {
                        (boxes[j][low] - boxes[i][low + 1])
                            .max(boxes[i][low] - boxes[j][low + 1])
                            .max(0.0)
                    };
                    if gap(0).hypot(gap(2)) < reach {
                        assert_eq!(near[j], 1, "{i} {j}");
                    }
                }
            }
        }
    }
}
