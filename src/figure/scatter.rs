//! Points of categories over two logarithmic axes; points without a height stand in a strip under the plot.

use super::axes::{Axis, Panel, Scale, heading};
use super::marks::{self, Marker, Shape, Symbol};
use super::scene::{Label, Rect, Scene};
use super::style::{Colour, GRID, INK, MUTED, Style, fade};
use super::text::{self, Face};

/// One point; both numbers are above 0.
#[derive(Clone, Copy, Debug)]
pub struct ScatterPoint {
    /// Along.
    pub x: f64,
    /// Up; `None` stands in the strip.
    pub y: Option<f64>,
    /// Its category, by its place.
    pub category: usize,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Heading; may be empty.
    pub title: String,
    /// Names of the axes with unit.
    pub names: (String, String),
    /// The points.
    pub points: Vec<ScatterPoint>,
    /// Name and colour of each category.
    pub categories: Vec<(String, Colour)>,
    /// What the strip is called.
    pub strip_name: String,
}

impl Scatter {
    /// Draws the plot with its legend into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let entry = |(k, (name, _)): (usize, &(String, Colour))| {
            (Symbol::Marker(self.marker(k)), name.clone())
        };
        let entries: Vec<_> = self.categories.iter().enumerate().map(entry).collect();
        let names = self.categories.iter().map(|(name, _)| name.as_str());
        let wide = marks::legend_width_px(names, style).min(area.width() * 0.4);
        let legend = Rect::new(area.x1 - wide, area.y0, area.x1, area.y1);
        marks::legend(scene, legend, &entries, style);
        let small = style.small_px();
        let strip_px = small * 2.0;
        let room = area.inset(0.0, 0.0, wide + style.px(30.0), strip_px);
        let extent = |values: &mut dyn Iterator<Item = f64>| {
            let none = (f64::INFINITY, f64::NEG_INFINITY);
            let (low, high) = values.fold(none, |(low, high), v| (low.min(v), high.max(v)));
            if low <= high {
                // Whole decades, or there might be no tick at all.
                let (low, high) = ((low / 1.1).log10().floor(), (high * 1.1).log10().ceil());
                (low, high.max(low + 1.0))
            } else {
                (0.0, 1.0)
            }
        };
        let (x0, x1) = extent(&mut self.points.iter().map(|point| point.x));
        let (y0, y1) = extent(&mut self.points.iter().filter_map(|point| point.y));
        let x = Axis::new(Scale::Decades(x0, x1), self.names.0.as_str());
        let y = Axis::new(Scale::Decades(y0, y1), self.names.1.as_str());
        let panel = Panel::new(scene, room, &x, &y, style);
        let strip = Rect::new(
            panel.plot.x0,
            area.y1 - strip_px * 0.8,
            panel.plot.x1,
            area.y1 - strip_px * 0.1,
        );
        scene.block(strip, fade(GRID, 0.5));
        let name = text::shorten(
            &self.strip_name,
            panel.plot.x0 - area.x0,
            small,
            Face::Regular,
        );
        scene.label(
            Label::new(name, (strip.x0 - style.px(8.0), strip.centre().1), small)
                .ending()
                .middle()
                .colour(MUTED),
        );
        for point in &self.points {
            let (px, _) = panel.at(point.x.log10(), 0.0);
            let py = point
                .y
                .map_or(strip.centre().1, |y| panel.at(0.0, y.log10()).1);
            self.marker(point.category)
                .draw(scene, (px, py), style.px(6.5), style.px(1.0));
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn marker(&self, category: usize) -> Marker {
        let shapes = [
            Shape::Circle,
            Shape::Square,
            Shape::Triangle,
            Shape::Diamond,
            Shape::TriangleDown,
        ];
        Marker {
            shape: shapes[category % shapes.len()],
            fill: self.categories[category].1,
            outline: INK,
        }
    }
}
