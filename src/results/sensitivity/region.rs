//! The best region of a sampled design: where the truth is recovered most, as a range of each
//! setting that matters.
//!
//! Of every factor whose effect on recovery the test upholds, the region takes the bin with the
//! highest mean and the bins next to it that lie above the middle between its best and its worst.
//! If fewer than [`FEWEST_CELLS`] points lie in it, the range of the weakest factor is given up,
//! and so on. The region is chosen by the data that its rate is computed from, so the rate flatters
//! it a little; the difference to the rest is tested by the contrasts of its factors.

use super::estimate::{Groups, within};
use super::responses::{Response, ResponseValues};
use super::{Sensitivity, UnitMean};
use crate::diagnostics::interval::Interval;

/// Points that a region needs.
const FEWEST_CELLS: usize = 4;

/// The range of one factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The factor, by its index.
    pub factor: usize,
    /// The first bin.
    pub first: usize,
    /// The last bin.
    pub last: usize,
}

/// A region, and what is recovered in it.
#[derive(Clone, Debug)]
pub struct Region {
    /// Its sides, the factor that matters most first.
    pub sides: Vec<Side>,
    /// Its cells.
    pub cells: Vec<usize>,
    /// The recovery rate in it.
    pub inside: UnitMean,
    /// The recovery rate of all other cells.
    pub outside: Option<UnitMean>,
}

/// The region; `None` where no effect on recovery is upheld.
pub(super) fn region(found: &Sensitivity, values: &ResponseValues) -> Option<Region> {
    let upheld = found.upheld(Response::Recovery).into_iter();
    let mut sides: Vec<Side> = upheld
        .filter_map(|row| best_range(found, row.factor))
        .collect();
    while !sides.is_empty() {
        let is_inside = |cell: usize| {
            sides.iter().all(|side| {
                let level = found.factors[side.factor].of_cell[cell];
                level.is_some_and(|level| (side.first..=side.last).contains(&level))
            })
        };
        let cells: Vec<usize> = (0..values.by_cell.len())
            .filter(|c| is_inside(*c))
            .collect();
        if cells.len() >= FEWEST_CELLS {
            let groups = Groups::new(values, 2, |cell| Some(usize::from(!is_inside(cell))));
            let share = Interval {
                low: 0.0,
                high: 1.0,
            };
            let rate = |group: usize| Some(within(groups.combine(&[(group, 1.0)], true)?, share));
            let (inside, outside) = (rate(0)?, rate(1));
            return Some(Region {
                sides,
                cells,
                inside,
                outside,
            });
        }
        sides.pop();
    }
    None
}

/// The bins about the best one that lie in the upper half; `None` if that is all of them.
fn best_range(found: &Sensitivity, factor: usize) -> Option<Side> {
    let curve = found.curve(Response::Recovery, factor);
    let means: Vec<Option<f64>> = curve.iter().map(|row| Some(row.estimate?.mean)).collect();
    let known = || means.iter().flatten().copied();
    let (low, high) = (
        known().fold(f64::INFINITY, f64::min),
        known().fold(f64::NEG_INFINITY, f64::max),
    );
    let best = means.iter().position(|mean| *mean == Some(high))?;
    let is_high = |bin: &usize| means[*bin].is_some_and(|mean| mean >= f64::midpoint(low, high));
    let first = (0..best).rev().take_while(is_high).last().unwrap_or(best);
    let last = (best + 1..means.len()).take_while(is_high).last();
    let last = last.unwrap_or(best);
    (last + 1 - first < means.len()).then_some(Side {
        factor,
        first,
        last,
    })
}
