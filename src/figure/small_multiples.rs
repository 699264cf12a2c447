//! Small multiples: a rate with its interval over the levels of one factor, a line for each level of a
//! second, a panel for each setting of the rest. All panels have the same axes.

use super::axes::{Axis, Panel, Scale, heading};
use super::effects::Interval;
use super::grid;
use super::marks::{Marker, Shape};
use super::scene::{Label, Rect, Scene};
use super::style::{Style, category};
use super::text::{self, Face};

/// One line of a panel.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its level.
    pub name: String,
    /// By level of the first factor; `None` where there are no data.
    pub rates: Vec<Option<Interval>>,
}

/// One panel.
#[derive(Clone, Debug)]
pub struct MultiplePanel {
    /// What it is of.
    pub title: String,
    /// Name of the factor of its lines.
    pub series_name: String,
    /// Its lines.
    pub series: Vec<Series>,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct SmallMultiples {
    /// Heading; may be empty.
    pub title: String,
    /// Name of the first factor with unit.
    pub x_name: String,
    /// Its levels.
    pub levels: Vec<String>,
    /// The panels.
    pub panels: Vec<MultiplePanel>,
    /// Columns of panels; 0 chooses.
    pub n_columns: usize,
    /// Name of the shared axis.
    pub value_name: String,
}

impl SmallMultiples {
    /// Draws all panels into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let n = self.panels.len();
        let columns = match self.n_columns {
            0 => grid::columns_for(n),
            columns => columns,
        };
        let (size, small) = (style.text_px(), style.small_px());
        let head_px = size * 1.3 + small * 1.5;
        let axes = |_: usize| {
            let x = Axis::new(Scale::Categories(self.levels.clone()), self.x_name.as_str());
            let mut y = Axis::new(Scale::Share(0.0, 1.0), self.value_name.as_str());
            y.most_ticks = Some(5);
            (x, y)
        };
        let places = grid::place(area, n, columns, head_px, axes, style);
        for (k, (panel, (room, first))) in self.panels.iter().zip(places).enumerate() {
            let (x, mut y) = axes(k);
            y.written = first;
            let frame = Panel::new(scene, room, &x, &y, style);
            let (left, width) = (frame.plot.x0, frame.plot.width());
            let top = room.y0 - head_px;
            let title = text::shorten(&panel.title, width, size, Face::Bold);
            scene.label(Label::new(title, (left, top), size).bold());
            key(scene, panel, (left, top + size * 1.3), width, style);
            draw_panel(scene, &frame, panel, style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}

/// The marker of a line: its shape tells what its colour does.
fn marker(series: usize) -> Marker {
    let shapes = [
        Shape::Circle,
        Shape::Square,
        Shape::Triangle,
        Shape::Diamond,
        Shape::TriangleDown,
    ];
    let colour = category(series);
    Marker {
        shape: shapes[series % shapes.len()],
        fill: colour,
        outline: colour,
    }
}

/// The names of the lines with their markers, in one line.
fn key(scene: &mut Scene, panel: &MultiplePanel, at: (f64, f64), room_px: f64, style: &Style) {
    let small = style.small_px();
    let mut x = at.0;
    let width = |words: &str, face| text::width_px(words, small, face);
    let label = format!("{}:", panel.series_name);
    let label = text::shorten(&label, room_px * 0.5, small, Face::Regular);
    scene.label(Label::new(label.as_str(), (x, at.1), small));
    x += width(&label, Face::Regular) + style.px(12.0);
    let middle = at.1 + small * (text::ASCENT_EM - text::HALF_CAPITAL_EM);
    for (k, series) in panel.series.iter().enumerate() {
        let wide = width(&series.name, Face::Regular);
        if x + style.px(24.0) + wide > at.0 + room_px {
            break;
        }
        marker(k).draw(
            scene,
            (x + style.px(8.0), middle),
            style.px(7.0),
            style.px(1.0),
        );
        x += style.px(22.0);
        scene.label(Label::new(series.name.as_str(), (x, at.1), small));
        x += wide + style.px(20.0);
    }
}

fn draw_panel(scene: &mut Scene, frame: &Panel, panel: &MultiplePanel, style: &Style) {
    let n = panel.series.len().max(1) as f64;
    let longest = panel.series.iter().map(|series| series.rates.len()).max();
    let slot = frame.plot.width() / longest.unwrap_or(1).max(1) as f64;
    // Lines stand beside one another, or their intervals would hide each other.
    let apart = (slot * 0.6 / n).min(style.px(26.0));
    for (k, series) in panel.series.iter().enumerate() {
        let colour = category(k);
        let shift = (k as f64 - (n - 1.0) / 2.0) * apart;
        let at = |(level, rate): (usize, &Option<Interval>)| {
            rate.map(|rate| {
                let height = |value: f64| {
                    let (x, y) = frame.at(level as f64, value.clamp(0.0, 1.0));
                    (x + shift, y)
                };
                (height(rate.low), height(rate.estimate), height(rate.high))
            })
        };
        let points: Vec<_> = series.rates.iter().enumerate().map(at).collect();
        for pair in points.windows(2) {
            if let [Some((_, from, _)), Some((_, to, _))] = *pair {
                scene.line(vec![from, to], colour, style.thin_px());
            }
        }
        for (low, estimate, high) in points.into_iter().flatten() {
            scene.rule(low, high, colour, style.line_px());
            marker(k).draw(scene, estimate, style.px(7.0), style.px(1.0));
        }
    }
}
