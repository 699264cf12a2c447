//! Square tiles over the plane; those at the border have no outer edge.

use crate::sampler::explicit::area::Area;

/// The tiles, row by row.
pub(super) struct Grid {
    /// The lower left corner of the first tile, m.
    origin_m: [f64; 2],
    side_m: f64,
    /// Columns and rows.
    n: [usize; 2],
}

impl Grid {
    /// One tile.
    pub(super) const WHOLE: Self = Self {
        origin_m: [0.0; 2],
        side_m: f64::INFINITY,
        n: [1; 2],
    };

    /// Over an area, whose lower left corner lies `shift_m` (up to a side) inside the first tile.
    pub(super) fn new(low_m: [f64; 2], extent_m: [f64; 2], side_m: f64, shift_m: [f64; 2]) -> Self {
        Self {
            origin_m: [0, 1].map(|axis| low_m[axis] - shift_m[axis]),
            side_m,
            n: [0, 1].map(|axis| ((extent_m[axis] + shift_m[axis]) / side_m) as usize + 1),
        }
    }

    pub(super) fn n_tiles(&self) -> usize {
        self.n[0] * self.n[1]
    }

    /// The column (axis 0) or row (axis 1) of a coordinate.
    fn line(&self, axis: usize, x_m: f64) -> usize {
        // A conversion to an integer saturates; a NaN of one tile without a side is 0.
        let line = ((x_m - self.origin_m[axis]) / self.side_m) as usize;
        line.min(self.n[axis] - 1)
    }

    /// The tile of a point.
    pub(super) fn tile(&self, x_m: [f64; 2]) -> usize {
        self.line(1, x_m[1]) * self.n[0] + self.line(0, x_m[0])
    }

    /// A tile without its edges.
    pub(super) fn area(&self, ix: usize) -> Area {
        let at = [ix % self.n[0], ix / self.n[0]];
        let edge = |axis: usize, line: usize| {
            if line == 0 {
                f64::NEG_INFINITY
            } else if line == self.n[axis] {
                f64::INFINITY
            } else {
                self.origin_m[axis] + self.side_m * line as f64
            }
        };
        Area {
            low_m: [0, 1].map(|axis| edge(axis, at[axis])),
            high_m: [0, 1].map(|axis| edge(axis, at[axis] + 1)),
        }
    }

    /// Calls with every tile that a point lies in, or at most so far outside of.
    pub(super) fn tiles_near(&self, x_m: [f64; 2], by_m: f64, mut call: impl FnMut(usize)) {
        let lines = |axis: usize| {
            let at = |by_m: f64| self.line(axis, x_m[axis] + by_m);
            at(-by_m)..=at(by_m)
        };
        for row in lines(1) {
            for column in lines(0) {
                call(row * self.n[0] + column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_lies_in_its_tile_and_beside_its_neighbours() {
        let grid = Grid::new([-3.0, 1.0], [10.0, 4.0], 2.5, [1.0, 2.4]);
        assert_eq!(grid.n_tiles(), 5 * 3);
        for k in 0..400_u32 {
            // Also outside of the area.
            let x_m = [
                f64::from(k % 20) * 1.01 - 8.0,
                f64::from(k / 20) * 0.73 - 4.0,
            ];
            let own = grid.tile(x_m);
            let mut near = Vec::new();
            grid.tiles_near(x_m, 0.4, |ix| near.push(ix));
            for ix in 0..grid.n_tiles() {
                assert_eq!(grid.area(ix).holds(x_m), ix == own, "{x_m:?} {ix}");
                let is_near = grid.area(ix).inset(-0.4).holds(x_m);
                assert_eq!(near.contains(&ix), is_near, "{x_m:?} {ix}");
            }
        }
        assert_eq!(Grid::WHOLE.tile([7.0, -3.0]), 0);
        assert!(Grid::WHOLE.area(0).inset(5.0) == Area::EVERYWHERE);
    }
}
