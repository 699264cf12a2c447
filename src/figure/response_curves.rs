//! What a response does along each factor, and whether that depends on another: one panel per factor, one curve
//! for each level of its partner.
//!
//! Curves of one panel that are not parallel are an interaction. Shapes tell curves apart without colour.
//! Levels of the region that does best are shaded.

use super::axes::{Axis, Panel, Scale, heading};
use super::effects::Interval;
use super::grid;
use super::marks::Marker;
use super::scene::{Label, Rect, Scene};
use super::style::{INK, MUTED, RECOVERED, Style, fade};
use super::text::{self, Face};

/// One curve of a panel.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The partner's level; empty for the mean over all.
    pub name: String,
    /// By the panel's levels; `None` without data.
    pub points: Vec<Option<Interval>>,
}

/// One factor.
#[derive(Clone, Debug)]
pub struct CurvePanel {
    /// Its name with unit.
    pub name: String,
    /// Its levels in order.
    pub levels: Vec<String>,
    /// The partner's name with unit; empty without one.
    pub by: String,
    /// The curves: the mean, or one for each of the partner's levels.
    pub curves: Vec<Curve>,
    /// The first and the last level of the best region; `None` where it takes all of them.
    pub best: Option<(usize, usize)>,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct ResponseCurves {
    /// Heading; may be empty.
    pub title: String,
    /// Panels in the order to show them.
    pub panels: Vec<CurvePanel>,
    /// Name of the shared axis with unit.
    pub value_name: String,
    /// Range of the shared axis.
    pub range: (f64, f64),
    /// Whether values are shares, written in per cent.
    pub percent: bool,
}

impl ResponseCurves {
    /// Draws all panels into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let mut area = heading(scene, area, &self.title, style.title_px(), 2);
        if self.panels.iter().any(|panel| panel.best.is_some()) {
            area = draw_best_key(scene, area, style);
        }
        let n = self.panels.len();
        let columns = grid::columns_in(n, area.width(), style);
        area.x1 = area.x1.min(area.x0 + columns as f64 * area.height() * 1.3);
        let (size, small) = (style.text_px(), style.small_px());
        let width = area.width() / columns as f64 - style.px(60.0);
        let key_lines = |panel: &CurvePanel| self.key(panel, width, style).len();
        let most_lines = self.panels.iter().map(key_lines).max().unwrap_or(0);
        let head_px = size * 1.5 + small * 1.3 * most_lines as f64;
        let axes = |i: usize| {
            let (low, high) = self.range;
            let scale = if self.percent {
                Scale::Share(low, high)
            } else {
                Scale::Continuous(low, high)
            };
            let mut y = Axis::new(scale, self.value_name.as_str());
            y.most_ticks = Some(4);
            (
                Axis::new(Scale::Categories(self.panels[i].levels.clone()), ""),
                y,
            )
        };
        let places = grid::place(area, n, columns, head_px, axes, style);
        for (i, (room, first)) in places.into_iter().enumerate() {
            let (x, mut y) = axes(i);
            y.written = first;
            let panel = Panel::new(scene, room, &x, &y, style);
            let (own, top) = (&self.panels[i], room.y0 - head_px);
            if let Some((first, last)) = own.best {
                shade(scene, &panel, (first, last), style);
            }
            let left = panel.plot.x0;
            let name = text::shorten(&own.name, panel.plot.width(), size, Face::Bold);
            scene.label(Label::new(name, (left, top), size).bold());
            self.draw_key(scene, own, (left, top + size * 1.35), width, style);
            self.draw_curves(scene, &panel, own, style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    /// Entries of a panel's key by line: the partner's name without a mark, then a mark for each level.
    fn key(
        &self,
        panel: &CurvePanel,
        room_px: f64,
        style: &Style,
    ) -> Vec<Vec<(Option<usize>, String)>> {
        if panel.by.is_empty() {
            return Vec::new();
        }
        let small = style.small_px();
        let entry_px = |words: &str| text::width_px(words, small, Face::Regular) + style.px(48.0);
        let name = text::shorten(&panel.by, room_px, small, Face::Regular);
        let mut used = entry_px(&name);
        let mut lines = vec![vec![(None, name)]];
        for (place, curve) in panel.curves.iter().enumerate() {
            let words = text::shorten(&curve.name, room_px * 0.8, small, Face::Regular);
            let width = entry_px(&words);
            if used + width > room_px {
                lines.push(Vec::new());
                used = 0.0;
            }
            used += width;
            if let Some(line) = lines.last_mut() {
                line.push((Some(place), words));
            }
        }
        lines
    }

    fn draw_key(
        &self,
        scene: &mut Scene,
        panel: &CurvePanel,
        at: (f64, f64),
        room_px: f64,
        style: &Style,
    ) {
        let small = style.small_px();
        for (row, line) in self.key(panel, room_px, style).into_iter().enumerate() {
            let (mut x, y) = (at.0, at.1 + row as f64 * small * 1.3);
            for (place, words) in line {
                if let Some(place) = place {
                    let middle = (
                        x + style.px(10.0),
                        y + small * (text::ASCENT_EM - text::HALF_CAPITAL_EM),
                    );
                    Marker::of_curve(place).draw(scene, middle, style.px(8.0), style.thin_px());
                    x += style.px(26.0);
                }
                let width = text::width_px(&words, small, Face::Regular);
                scene.label(Label::new(words, (x, y), small).colour(MUTED));
                x += width + style.px(18.0);
            }
        }
    }

    fn draw_curves(&self, scene: &mut Scene, panel: &Panel, own: &CurvePanel, style: &Style) {
        let n_curves = own.curves.len().max(1) as f64;
        let slot = panel.plot.width() / own.levels.len().max(1) as f64;
        // Side by side within their level, so that intervals do not cover each other.
        let spread = if own.curves.len() > 1 { 0.5 } else { 0.0 };
        let shown = |v: f64| v.clamp(self.range.0, self.range.1);
        for (place, curve) in own.curves.iter().enumerate() {
            let marker = Marker::of_curve(place);
            let colour = marker.fill;
            let aside = ((place as f64 + 0.5) / n_curves - 0.5) * spread * slot;
            let at = |level: usize, value: f64| {
                let (x, y) = panel.at(level as f64, shown(value));
                (x + aside, y)
            };
            let known: Vec<(usize, Interval)> = (curve.points.iter().enumerate())
                .filter_map(|(level, point)| Some((level, (*point)?)))
                .collect();
            for pair in known.windows(2) {
                if pair[1].0 == pair[0].0 + 1 {
                    let ends = [pair[0], pair[1]].map(|(level, point)| at(level, point.estimate));
                    scene.line(ends.to_vec(), colour, style.thin_px());
                }
            }
            for (level, point) in known {
                scene.rule(
                    at(level, point.low),
                    at(level, point.high),
                    fade(colour, 0.75),
                    style.line_px(),
                );
                marker.draw(
                    scene,
                    at(level, point.estimate),
                    style.px(8.0),
                    style.thin_px(),
                );
            }
        }
        for level in 0..own.levels.len() {
            let is_known = |curve: &Curve| curve.points.get(level).is_some_and(Option::is_some);
            if !own.curves.iter().any(is_known) {
                let middle = f64::midpoint(self.range.0, self.range.1);
                let label = Label::new("no data", panel.at(level as f64, middle), style.small_px());
                scene.label(label.centred().upward().colour(INK));
            }
        }
    }
}

/// A band behind the levels of the best region.
fn shade(scene: &mut Scene, panel: &Panel, (first, last): (usize, usize), style: &Style) {
    let plot = panel.plot;
    let edge = |level: f64| panel.at(level, 0.0).0.clamp(plot.x0, plot.x1);
    let (x0, x1) = (edge(first as f64 - 0.5), edge(last as f64 + 0.5));
    let px = style.px(2.0);
    scene.block(
        Rect::new(x0 + px, plot.y0 + px, x1 - px, plot.y1 - px),
        fade(RECOVERED, 0.16),
    );
}

fn draw_best_key(scene: &mut Scene, area: Rect, style: &Style) -> Rect {
    let small = style.small_px();
    let swatch = Rect::new(
        area.x0 + style.px(10.0),
        area.y0,
        area.x0 + style.px(44.0),
        area.y0 + small * 1.1,
    );
    scene.block(swatch, fade(RECOVERED, 0.16));
    scene.frame(swatch, MUTED, style.px(1.0));
    let at = (swatch.x1 + style.px(10.0), swatch.centre().1);
    scene.label(Label::new("best region", at, small).middle());
    area.inset(0.0, small * 2.0, 0.0, 0.0)
}
