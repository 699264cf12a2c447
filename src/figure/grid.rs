//! Small multiples: panels of equal plots in rows and columns that share their y axis.

use super::axes::{Axis, Panel};
use super::scene::{Rect, Scene};
use super::style::Style;

/// Columns that `n` panels look well in on a landscape page.
pub fn columns_for(n: usize) -> usize {
    match n {
        0..=4 => n.max(1),
        5 | 6 | 9 => 3,
        _ => 4,
    }
}

/// The same on a page of this width: one under the other on one made for a phone.
pub fn columns_in(n: usize, width_px: f64, style: &Style) -> usize {
    if width_px < style.px(NARROW_PX) {
        1
    } else {
        columns_for(n)
    }
}

/// Below this width panels stand one under the other.
const NARROW_PX: f64 = 1000.0;

/// Where each panel goes so that all plots are equally large, though only those of the first column
/// carry labels on their y axis. `head_px` is left free above each panel; `axes` gives panel i's axes.
pub fn place(
    area: Rect,
    n: usize,
    columns: usize,
    head_px: f64,
    axes: impl Fn(usize) -> (Axis, Axis),
    style: &Style,
) -> Vec<(Rect, bool)> {
    let rows = n.div_ceil(columns);
    let gap = style.px(22.0);
    let margins = |room: Rect, i: usize, written: bool| {
        let (x, mut y) = axes(i);
        y.written = written;
        let plot = Panel::new(&mut Scene::new(1, 1), room, &x, &y, style).plot;
        (plot.x0 - room.x0, room.y1 - plot.y1)
    };
    let even = |i: usize| {
        area.cell((i % columns, columns), (i / columns, rows), gap)
            .inset(0.0, head_px, 0.0, 0.0)
    };
    let first_left = (0..n)
        .step_by(columns)
        .map(|i| margins(even(i), i, true).0)
        .fold(0.0, f64::max);
    let other_left = if n > 0 {
        margins(even(0), 0, false).0
    } else {
        0.0
    };
    let extra = first_left - other_left;
    let rest = Rect::new(area.x0 + extra, area.y0, area.x1, area.y1);

    let place_one = |i: usize| {
        let (column, row) = (i % columns, i / columns);
        let cell = rest
            .cell((column, columns), (row, rows), gap)
            .inset(0.0, head_px, 0.0, 0.0);
        // A first column of narrower labels than the widest still starts its plot at the same x.
        let own = if column == 0 {
            margins(cell, i, true).0 - other_left
        } else {
            0.0
        };
        (
            Rect::new(cell.x0 - own, cell.y0, cell.x1, cell.y1),
            column == 0,
        )
    };
    let mut placed: Vec<(Rect, bool)> = (0..n).map(place_one).collect();
    // Level the feet of the plots within each row: labels under them may be of different depth.
    for (row, panels) in placed.chunks_mut(columns).enumerate() {
        let depth =
            |k: usize, &(room, first): &(Rect, bool)| margins(room, row * columns + k, first).1;
        let depths: Vec<f64> = panels
            .iter()
            .enumerate()
            .map(|(k, panel)| depth(k, panel))
            .collect();
        let deepest = depths.iter().copied().fold(0.0, f64::max);
        for ((room, _), own) in panels.iter_mut().zip(depths) {
            room.y1 -= deepest - own;
        }
    }
    placed
}
