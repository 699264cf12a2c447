//! Which knob matters: one small panel per factor, the rate at each of its levels with its interval.

use super::axes::{Axis, Panel, Scale, heading};
use super::grid;
use super::marks::{Marker, Shape};
use super::scene::{Label, Rect, Scene};
use super::style::{Colour, MUTED, PAPER, SERIES, STATUS, Style};
use super::text::{self, Face};

/// The second share has the colour of the verdict that it counts, and stands beside the first.
const GATED: Colour = STATUS[0];
const GATED_SHIFT_PX: f64 = 16.0;
const GATED_MARKER: Marker = Marker {
    shape: Shape::Square,
    fill: PAPER,
    outline: GATED,
};

/// One level of a factor.
#[derive(Clone, Debug)]
pub struct LevelEffect {
    /// The level as written under its point.
    pub label: String,
    /// The rate and the interval about it; `None` where there are no data.
    pub rate: Option<Interval>,
    /// A second share beside it, drawn hollow; `None` where there is none.
    pub gated: Option<f64>,
}

/// An estimate with the interval its caller chose (name it in the title).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// The estimate.
    pub estimate: f64,
    /// Upper end.
    pub high: f64,
}

/// One factor.
#[derive(Clone, Debug)]
pub struct FactorEffect {
    /// Its name with unit.
    pub name: String,
    /// A note beside the name, for example "range 0.62"; may be empty.
    pub note: String,
    /// Its levels in order.
    pub levels: Vec<LevelEffect>,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct Effects {
    /// Heading; may be empty.
    pub title: String,
    /// Panels in the order to show them.
    pub factors: Vec<FactorEffect>,
    /// Name of the shared axis with unit.
    pub value_name: String,
    /// Names of the rate and of the second share, for the key; without a second share none is drawn.
    pub key: Option<(String, String)>,
    /// Range of the shared axis.
    pub range: (f64, f64),
    /// Whether values are shares, written in per cent.
    pub percent: bool,
}

impl Effects {
    /// Draws all panels into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let mut area = heading(scene, area, &self.title, style.title_px(), 2);
        if let Some((rate, gated)) = &self.key {
            area = draw_key(scene, area, (rate, gated), style);
        }
        let n = self.factors.len();
        let columns = grid::columns_in(n, area.width(), style);
        // One or two panels as wide as the page would be hard to read along.
        area.x1 = area.x1.min(area.x0 + columns as f64 * area.height() * 1.3);
        let notes = self.factors.iter().any(|factor| !factor.note.is_empty());
        let head_px = style.text_px() * 1.5 + if notes { style.small_px() * 1.3 } else { 0.0 };
        let rows = n.div_ceil(columns).max(1) as f64;
        let most_ticks = if area.height() / rows > style.px(330.0) {
            5
        } else {
            2
        };
        let axes = |i: usize| {
            let (x, mut y) = self.axes(&self.factors[i]);
            y.most_ticks = Some(most_ticks);
            (x, y)
        };
        for (i, (room, first)) in grid::place(area, n, columns, head_px, axes, style)
            .into_iter()
            .enumerate()
        {
            let (x, mut y) = axes(i);
            y.written = first;
            let panel = Panel::new(scene, room, &x, &y, style);
            self.draw_factor(scene, &panel, room.y0 - head_px, &self.factors[i], style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn axes(&self, factor: &FactorEffect) -> (Axis, Axis) {
        let (low, high) = self.range;
        let scale = if self.percent {
            Scale::Share(low, high)
        } else {
            Scale::Continuous(low, high)
        };
        let levels = factor
            .levels
            .iter()
            .map(|level| level.label.clone())
            .collect();
        (
            Axis::new(Scale::Categories(levels), ""),
            Axis::new(scale, self.value_name.as_str()),
        )
    }

    fn draw_factor(
        &self,
        scene: &mut Scene,
        panel: &Panel,
        top: f64,
        factor: &FactorEffect,
        style: &Style,
    ) {
        let plot = panel.plot;
        let (size, small) = (style.text_px(), style.small_px());
        let name = text::shorten(&factor.name, plot.width(), size, Face::Bold);
        scene.label(Label::new(name, (plot.x0, top), size).bold());
        let note = text::shorten(&factor.note, plot.width(), small, Face::Regular);
        scene.label(Label::new(note, (plot.x0, top + size * 1.3), small).colour(MUTED));

        let shown = |v: f64| v.clamp(self.range.0, self.range.1);
        let at = |(i, level): (usize, &LevelEffect)| {
            level.rate.map(|rate| {
                let height = |v: f64| panel.at(i as f64, shown(v));
                (height(rate.low), height(rate.estimate), height(rate.high))
            })
        };
        let points: Vec<_> = factor.levels.iter().enumerate().map(at).collect();
        for pair in points.windows(2) {
            if let [Some((_, from, _)), Some((_, to, _))] = *pair {
                scene.line(vec![from, to], SERIES, style.thin_px());
            }
        }
        let gated = |(i, level): (usize, &LevelEffect)| {
            level.gated.map(|share| {
                let (x, y) = panel.at(i as f64, shown(share));
                (x + style.px(GATED_SHIFT_PX), y)
            })
        };
        let gated: Vec<_> = factor.levels.iter().enumerate().map(gated).collect();
        for pair in gated.windows(2) {
            if let [Some(from), Some(to)] = *pair {
                let dash = (style.px(9.0), style.px(7.0));
                scene.dashed(&[from, to], GATED, style.thin_px(), dash);
            }
        }
        for at in gated.into_iter().flatten() {
            GATED_MARKER.draw(scene, at, style.px(7.0), style.line_px());
        }
        let cap = (plot.width() / factor.levels.len().max(1) as f64 * 0.16).min(style.px(10.0));
        for (low, estimate, high) in points.into_iter().flatten() {
            scene.rule(low, high, SERIES, style.line_px());
            for end in [low, high] {
                scene.rule(
                    (end.0 - cap, end.1),
                    (end.0 + cap, end.1),
                    SERIES,
                    style.line_px(),
                );
            }
            scene.disc(estimate, style.px(8.0), SERIES);
        }
        for (i, _) in factor
            .levels
            .iter()
            .enumerate()
            .filter(|(_, level)| level.rate.is_none())
        {
            let middle = (self.range.0 + self.range.1) / 2.0;
            scene.label(
                Label::new("no data", panel.at(i as f64, middle), small)
                    .centred()
                    .upward()
                    .colour(MUTED),
            );
        }
    }
}

/// What the two kinds of points are, in one line.
fn draw_key(scene: &mut Scene, area: Rect, names: (&str, &str), style: &Style) -> Rect {
    let small = style.small_px();
    let middle = area.y0 + small * (text::ASCENT_EM - text::HALF_CAPITAL_EM);
    let mut x = area.x0 + style.px(10.0);
    scene.disc((x, middle), style.px(8.0), SERIES);
    x += style.px(20.0);
    scene.label(Label::new(names.0, (x, area.y0), small));
    x += text::width_px(names.0, small, Face::Regular) + style.px(50.0);
    GATED_MARKER.draw(scene, (x, middle), style.px(7.0), style.line_px());
    x += style.px(20.0);
    let gated = text::shorten(names.1, area.x1 - x, small, Face::Regular);
    scene.label(Label::new(gated, (x, area.y0), small));
    area.inset(0.0, small * 1.8, 0.0, 0.0)
}
