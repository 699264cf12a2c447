//! The plan view that maps share: walls and data in metres with equal scales on both axes.

use super::axes::{Axis, Panel, Scale, nice_step};
use super::marks::{self, Symbol};
use super::scene::{Label, Point, Rect, Scene};
use super::style::{GRID, INK, MUTED, Style, tick_label};
use super::text;

/// A position in metres.
pub type Metres = [f64; 2];

/// The range of both coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest and largest x, metres.
    pub x_m: (f64, f64),
    /// Smallest and largest y, metres.
    pub y_m: (f64, f64),
}

impl Bounds {
    /// The bounds of points with some air round them; a single place gets a metre, none a unit square.
    /// Positions that are not finite are ignored.
    pub fn of(points: impl IntoIterator<Item = Metres>) -> Self {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let grow = |(low, high): (f64, f64), v: f64| (low.min(v), high.max(v));
        let (mut x, mut y) = (none, none);
        for [px, py] in points
            .into_iter()
            .filter(|p| p.iter().all(|v| v.is_finite()))
        {
            x = grow(x, px);
            y = grow(y, py);
        }
        if x.0 > x.1 {
            (x, y) = ((0.0, 1.0), (0.0, 1.0));
        }
        let largest = (x.1 - x.0).max(y.1 - y.0);
        let pad = if largest > 0.0 { largest * 0.05 } else { 0.5 };
        // A corridor is shown in a box of at most 1 : 2.5, or its height could not be read.
        let least = (largest + 2.0 * pad) * 0.4;
        let widen = |(low, high): (f64, f64)| {
            let short = (least - (high - low + 2.0 * pad)).max(0.0) / 2.0;
            (low - pad - short, high + pad + short)
        };
        Self {
            x_m: widen(x),
            y_m: widen(y),
        }
    }

    fn size(&self) -> (f64, f64) {
        (self.x_m.1 - self.x_m.0, self.y_m.1 - self.y_m.0)
    }
}

/// Axes in metres with equal scales, as large as fits into `outer`, in its upper left corner.
pub fn with_axes(scene: &mut Scene, outer: Rect, bounds: Bounds, style: &Style) -> Panel {
    let axes = |b: Bounds| {
        let axis = |(low, high), name: &str| Axis::new(Scale::Continuous(low, high), name);
        (axis(b.x_m, "x (m)"), axis(b.y_m, "y (m)"))
    };
    // First on a page that is thrown away, to learn how much room the labels leave.
    let trial = |room: Rect, bounds: Bounds| {
        let (x, y) = axes(bounds);
        Panel::new(&mut Scene::new(1, 1), room, &x, &y, style).plot
    };
    let free = trial(outer, bounds);
    let (dx, dy) = bounds.size();
    let scale = (free.width() / dx).min(free.height() / dy);
    let room = outer.inset(
        0.0,
        0.0,
        free.width() - scale * dx,
        free.height() - scale * dy,
    );
    // Labels may have changed with the room: what is left over goes to the ranges, not the scale.
    let mut exact = bounds;
    for _ in 0..3 {
        exact = fitted(bounds, trial(room, exact));
    }
    let (x, y) = axes(exact);
    Panel::new(scene, room, &x, &y, style)
}

/// The same with a legend to the right of it.
pub fn with_legend(
    scene: &mut Scene,
    area: Rect,
    bounds: Bounds,
    entries: &[(Symbol, String)],
    style: &Style,
) -> Panel {
    let wide = marks::legend_width_px(entries.iter().map(|(_, words)| words.as_str()), style);
    let gap = style.px(30.0);
    let room = area.inset(0.0, 0.0, wide + gap, 0.0);
    let panel = with_axes(scene, room, bounds, style);
    let x0 = panel.plot.x1 + gap;
    let room = Rect::new(x0, panel.plot.y0, x0 + wide, area.y1);
    marks::legend(scene, room, entries, style);
    panel
}

/// A bare frame with equal scales that fills `outer`, and a scale bar under it.
pub fn with_scale_bar(scene: &mut Scene, outer: Rect, bounds: Bounds, style: &Style) -> Panel {
    let size = style.small_px();
    let bar_room = size * 1.5;
    let (dx, dy) = bounds.size();
    let free = outer.inset(style.px(1.0), style.px(1.0), style.px(1.0), bar_room);
    let scale = (free.width() / dx).min(free.height() / dy);
    let room = free.inset(
        0.0,
        0.0,
        free.width() - scale * dx,
        free.height() - scale * dy,
    );
    let fit = fitted(bounds, room);
    let mute = |range: (f64, f64)| Axis {
        scale: Scale::Continuous(range.0, range.1),
        name: String::new(),
        written: false,
        most_ticks: None,
    };
    let panel = Panel::bare(room, &mute(fit.x_m), &mute(fit.y_m));
    scene.frame(panel.plot, GRID, style.thin_px());
    let step_m = nice_step(dx, 4);
    let bar_px = panel.at(step_m, 0.0).0 - panel.at(0.0, 0.0).0;
    let (x, y) = (panel.plot.x0, panel.plot.y1 + bar_room * 0.6);
    scene.rule((x, y), (x + bar_px, y), INK, style.px(3.0));
    for end in [x, x + bar_px] {
        scene.rule(
            (end, y - style.px(5.0)),
            (end, y + style.px(5.0)),
            INK,
            style.thin_px(),
        );
    }
    let words = format!("{} m", tick_label(step_m, step_m));
    let fits = text::width_px(&words, size, text::Face::Regular) + bar_px < outer.width();
    if fits {
        scene.label(
            Label::new(words, (x + bar_px + style.px(10.0), y), size)
                .middle()
                .colour(MUTED),
        );
    }
    panel
}

fn fitted(bounds: Bounds, plot: Rect) -> Bounds {
    let (dx, dy) = bounds.size();
    let m_per_px = (dx / plot.width().max(1.0)).max(dy / plot.height().max(1.0));
    let grow = |(low, high): (f64, f64), px: f64| {
        let more = ((m_per_px * px.max(1.0)) - (high - low)) / 2.0;
        (low - more, high + more)
    };
    Bounds {
        x_m: grow(bounds.x_m, plot.width()),
        y_m: grow(bounds.y_m, plot.height()),
    }
}

/// Draws closed walls.
pub fn walls(scene: &mut Scene, panel: &Panel, walls_m: &[Vec<Metres>], width_px: f64) {
    for wall in walls_m {
        let points = wall_pixels(panel, wall);
        scene.line(points, INK, width_px);
    }
}

/// The pixels of a closed wall.
pub fn wall_pixels(panel: &Panel, wall_m: &[Metres]) -> Vec<Point> {
    let mut points = pixels(panel, wall_m);
    points.extend(points.first().copied());
    points
}

/// The pixels of a path; positions that are not finite are left out, as are steps below a quarter
/// of a pixel, which would only make the image slower to draw.
pub fn pixels(panel: &Panel, path_m: &[Metres]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for &[x, y] in path_m.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
        let at = panel.at(x, y);
        if kept
            .last()
            .is_none_or(|&(px, py)| (px - at.0).hypot(py - at.1) >= 0.25)
        {
            kept.push(at);
        }
    }
    kept
}
