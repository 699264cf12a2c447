//! How something grows: lines over logarithmic axes, as cost over the number of detections.

use super::axes::{Axis, Panel, Scale, heading};
use super::scene::{Label, Rect, Scene};
use super::style::{Style, category};
use super::text::{self, Face};

/// One line.
#[derive(Clone, Debug)]
pub struct ScalingLine {
    /// What it is; written at its end.
    pub name: String,
    /// Points (x, y), both above 0, by rising x.
    pub points: Vec<(f64, f64)>,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct Scaling {
    /// Heading; may be empty.
    pub title: String,
    /// Name of the horizontal axis with unit.
    pub x_name: String,
    /// Name of the vertical axis with unit.
    pub y_name: String,
    /// Its lines.
    pub lines: Vec<ScalingLine>,
}

impl Scaling {
    /// Draws axes, lines and their names into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let names_px = area.width() * 0.26;
        let decades = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            if low > high {
                (0.0, 1.0)
            } else {
                (low.log10().floor(), high.log10().ceil())
            }
        };
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let (x_low, x_high) = decades(&mut points().map(|(x, _)| *x));
        let (y_low, y_high) = decades(&mut points().map(|(_, y)| *y));
        let x = Axis::new(Scale::Decades(x_low, x_high), self.x_name.as_str());
        let y = Axis::new(Scale::Decades(y_low, y_high), self.y_name.as_str());
        let room = Rect::new(area.x0, area.y0, area.x1 - names_px, area.y1);
        let panel = Panel::new(scene, room, &x, &y, style);
        let size = style.small_px();
        // Names keep a line's height apart, from the top.
        let mut ends: Vec<(usize, f64, f64)> = Vec::new();
        for (ix, line) in self.lines.iter().enumerate() {
            let at = |&(x, y): &(f64, f64)| panel.at(x.log10(), y.log10());
            let pixels: Vec<_> = line.points.iter().map(at).collect();
            for &point in &pixels {
                scene.disc(point, style.px(6.0), category(ix));
            }
            if let Some(&(end_x, end_y)) = pixels.last() {
                ends.push((ix, end_x, end_y));
            }
            scene.line(pixels, category(ix), style.line_px());
        }
        ends.sort_by(|a, b| a.2.total_cmp(&b.2));
        let mut free = f64::NEG_INFINITY;
        for (ix, end_x, end_y) in ends {
            let y = end_y.max(free);
            free = y + size * 1.25;
            let x = panel.plot.x1 + style.px(14.0);
            scene.rule((end_x, end_y), (x, y), category(ix), style.px(1.0));
            let at = (x + style.px(6.0), y);
            let name = text::shorten(&self.lines[ix].name, area.x1 - at.0, size, Face::Regular);
            scene.label(Label::new(name, at, size).middle().colour(category(ix)));
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
