//! A law for partners of a detection that favours those nearby at every scale, and looks at z alone.
//!
//! Squares of side 3s about detection i (its cell in a grid of side s and the eight around it), for
//! s = s₀, 2s₀, 4s₀, … until everyone is inside; a partner is drawn from a uniform one of these levels, uniformly. So
//! a detection of the same landmark, of the next one and of any other each have a fair chance, whatever the
//! density of the data.

use super::Model;
use super::locations::Reach;

/// Grids over the detections, coarser and coarser.
#[derive(Clone, Debug)]
pub struct Nearby {
    n_detections: usize,
    levels: Vec<Level>,
}

/// One grid: detections ordered by cell, rows of cells contiguous.
#[derive(Clone, Debug)]
struct Level {
    n_columns: usize,
    n_rows: usize,
    /// Column and row of each detection.
    cell_of: Vec<[u32; 2]>,
    /// First place of each cell in `members`.
    start: Vec<u32>,
    members: Vec<u32>,
    /// Where each detection stands in `members`.
    place_of: Vec<u32>,
}

impl Level {
    fn new(z: &[[f64; 2]], low_m: [f64; 2], extent_m: [f64; 2], side_m: f64) -> Self {
        let count = |axis: usize| (extent_m[axis] / side_m) as usize + 1;
        let (n_columns, n_rows) = (count(0), count(1));
        let cell_of: Vec<[u32; 2]> = z
            .iter()
            .map(|z| [0, 1].map(|axis| ((z[axis] - low_m[axis]) / side_m) as u32))
            .collect();
        let mut start = vec![0; n_columns * n_rows + 1];
        let place = |[column, row]: [u32; 2]| row as usize * n_columns + column as usize;
        for &cell in &cell_of {
            start[place(cell) + 1] += 1;
        }
        for cell in 1..start.len() {
            start[cell] += start[cell - 1];
        }
        let mut next = start.clone();
        let mut members = vec![0; z.len()];
        let mut place_of = vec![0; z.len()];
        for (i, &cell) in cell_of.iter().enumerate() {
            let slot = &mut next[place(cell)];
            members[*slot as usize] = i as u32;
            place_of[i] = *slot;
            *slot += 1;
        }
        Self {
            n_columns,
            n_rows,
            cell_of,
            start,
            members,
            place_of,
        }
    }

    /// Where the three runs of `members` in the square about detection i stand.
    fn runs(&self, i: u32) -> [std::ops::Range<u32>; 3] {
        let [column, row] = self.cell_of[i as usize];
        let first = column.saturating_sub(1) as usize;
        let last = (column as usize + 1).min(self.n_columns - 1);
        [-1, 0, 1].map(|step| match row.checked_add_signed(step) {
            Some(row) if (row as usize) < self.n_rows => {
                let cells = row as usize * self.n_columns;
                self.start[cells + first]..self.start[cells + last + 1]
            }
            _ => 0..0,
        })
    }

    fn holds(&self, i: u32, j: u32) -> bool {
        let (a, b) = (self.cell_of[i as usize], self.cell_of[j as usize]);
        a[0].abs_diff(b[0]) <= 1 && a[1].abs_diff(b[1]) <= 1
    }
}

impl Nearby {
    /// Of a model's detections. s₀ is the penalty's radius in m, or as many cells as detections allow.
    pub fn of(model: &Model) -> Self {
        let z = model.positions_m();
        let n = z.len();
        let bound = |pick: fn(f64, f64) -> f64, start: f64| {
            [0, 1].map(|axis| z.iter().map(|z| z[axis]).fold(start, pick))
        };
        let (low_m, high_m) = (
            bound(f64::min, f64::INFINITY),
            bound(f64::max, f64::NEG_INFINITY),
        );
        let extent_m = [high_m[0] - low_m[0], high_m[1] - low_m[1]];
        let longest = extent_m[0].max(extent_m[1]);
        let even = (extent_m[0] * extent_m[1] / n as f64).sqrt();
        let mut side_m = Reach::of(model)
            .most_m
            .max(even)
            .max(longest / (4 * n) as f64);
        let mut levels = Vec::new();
        loop {
            levels.push(Level::new(z, low_m, extent_m, side_m));
            if side_m >= longest {
                break;
            }
            side_m *= 2.0;
        }
        Self {
            n_detections: n,
            levels,
        }
    }

    /// N.
    pub fn n_detections(&self) -> usize {
        self.n_detections
    }

    /// Number of levels; the last has everyone.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// How many others a level has about detection i.
    pub fn n_others(&self, level: usize, i: u32) -> usize {
        let runs = self.levels[level].runs(i);
        runs.iter().map(|run| run.len()).sum::<usize>() - 1
    }

    /// The k-th of them.
    pub fn other(&self, level: usize, i: u32, k: usize) -> u32 {
        let grid = &self.levels[level];
        let runs = grid.runs(i);
        // Detection i itself is in the middle run.
        let own = runs[0].len() + (grid.place_of[i as usize] - runs[1].start) as usize;
        let mut k = k + usize::from(k >= own);
        for run in runs {
            if k < run.len() {
                return grid.members[run.start as usize + k];
            }
            k -= run.len();
        }
        panic!("there are fewer others than that")
    }

    /// Probability that detection j ≠ i is drawn for detection i. A level with nobody else counts as one with
    /// everyone.
    pub fn probability(&self, i: u32, j: u32) -> f64 {
        let everyone = self.n_detections - 1;
        let of_level = |(level, grid): (usize, &Level)| match self.n_others(level, i) {
            0 => 1.0 / everyone as f64,
            _ if !grid.holds(i, j) => 0.0,
            n_others => 1.0 / n_others as f64,
        };
        let total: f64 = self.levels.iter().enumerate().map(of_level).sum();
        total / self.levels.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, Penalty, PenaltyShape};

    #[test]
    fn the_law_is_a_law_and_favours_the_near() {
        let positions_m: Vec<[f64; 2]> = (0..60)
            .map(|i| {
                [
                    7.0 * f64::from(i % 10),
                    9.0 * f64::from(i / 10) + 0.1 * f64::from(i),
                ]
            })
            .collect();
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 3.0,
            height: 8.0,
        };
        let model = Model::from(MetricModel::new(&positions_m, 1.0, 1.0, penalty));
        let nearby = Nearby::of(&model);
        assert!(nearby.n_levels() > 3);
        for i in 0..60 {
            let total: f64 = (0..60)
                .filter(|&j| j != i)
                .map(|j| nearby.probability(i, j))
                .sum();
            assert!((total - 1.0).abs() < 1e-12);
            for level in 0..nearby.n_levels() {
                let n = nearby.n_others(level, i);
                let drawn: Vec<u32> = (0..n).map(|k| nearby.other(level, i, k)).collect();
                assert!(!drawn.contains(&i));
                for j in (0..60).filter(|&j| j != i) {
                    let listed = drawn.iter().filter(|&&other| other == j).count();
                    assert_eq!(listed, usize::from(nearby.levels[level].holds(i, j)));
                }
            }
        }
        assert!(nearby.probability(0, 1) > 5.0 * nearby.probability(0, 59));
        assert!(nearby.probability(0, 59) > 0.0);
    }

    #[test]
    fn coincident_and_lone_detections() {
        for positions_m in [vec![[1.0, 1.0]; 4], vec![[2.0, 3.0]]] {
            let penalty = Penalty {
                shape: PenaltyShape::Quadratic,
                radius_m: 3.0,
                height: 8.0,
            };
            let model = Model::from(MetricModel::new(&positions_m, 1.0, 1.0, penalty));
            let nearby = Nearby::of(&model);
            assert_eq!(nearby.n_levels(), 1);
            assert_eq!(nearby.n_others(0, 0), positions_m.len() - 1);
        }
    }
}
