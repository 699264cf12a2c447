//! Points with intervals over two axes: Morris' plane of μ* and σ, or the cells of a sampled design.
//!
//! A hollow point is one that the test does not uphold. Names stand beside their points where there
//! is room; what has no room still has its words under a pointer.

use super::axes::{Axis, Panel};
use super::effects::Interval;
use super::marks::{Marker, Shape};
use super::scene::{Hover, Label, Point, Rect, Scene};
use super::style::{Colour, MUTED, PAPER, Style, fade};
use super::text::{self, Face};

const RADIUS_PX: f64 = 9.0;

/// One point.
#[derive(Clone, Debug)]
pub struct PlanePoint {
    /// Written beside it; empty for no name.
    pub name: String,
    /// Along, with its interval.
    pub x: Interval,
    /// Up, with its interval.
    pub y: Interval,
    /// Its colour.
    pub colour: Colour,
    /// Whether only its outline is drawn.
    pub is_hollow: bool,
    /// What it says under a pointer.
    pub hover: Option<Hover>,
}

/// A line of the key.
#[derive(Clone, Debug)]
pub struct PlaneKey {
    /// The colour of its sign.
    pub colour: Colour,
    /// Whether the sign is hollow.
    pub is_hollow: bool,
    /// What the sign means.
    pub words: String,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct Plane {
    /// The axes.
    pub axes: (Axis, Axis),
    /// The points.
    pub points: Vec<PlanePoint>,
    /// What the signs mean.
    pub key: Vec<PlaneKey>,
    /// What the dashed line of equal x and y means; `None` for no such line.
    pub diagonal: Option<String>,
}

impl Plane {
    /// Draws key, axes and points into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = self.draw_key(scene, area, style);
        let panel = Panel::new(scene, area, &self.axes.0, &self.axes.1, style);
        let plot = panel.plot;
        if self.diagonal.is_some() {
            let (x, y) = (self.axes.0.range(), self.axes.1.range());
            let ends = (x.0.max(y.0), x.1.min(y.1));
            let line = [panel.at(ends.0, ends.0), panel.at(ends.1, ends.1)];
            scene.dashed(&line, MUTED, style.thin_px(), DASH);
        }
        for point in &self.points {
            let whisker = fade(point.colour, 0.45);
            let (x, y) = (point.x.estimate, point.y.estimate);
            let at = |x: f64, y: f64| {
                let (x, y) = panel.at(x, y);
                (x.clamp(plot.x0, plot.x1), y.clamp(plot.y0, plot.y1))
            };
            let ends = [
                (at(point.x.low, y), at(point.x.high, y)),
                (at(x, point.y.low), at(x, point.y.high)),
            ];
            for (from, to) in ends.into_iter().filter(|(from, to)| from != to) {
                scene.rule(from, to, whisker, style.thin_px());
            }
        }
        for point in &self.points {
            let at = panel.at(point.x.estimate, point.y.estimate);
            marker(point.colour, point.is_hollow).draw(
                scene,
                at,
                style.px(RADIUS_PX),
                style.line_px(),
            );
            if let Some(hover) = &point.hover {
                let reach = style.px(RADIUS_PX * 1.5);
                let rect = Rect::new(at.0 - reach, at.1 - reach, at.0 + reach, at.1 + reach);
                scene.hover(rect, hover.clone());
            }
        }
        self.draw_names(scene, &panel, style);
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    /// Names where they cover neither a point nor another name.
    fn draw_names(&self, scene: &mut Scene, panel: &Panel, style: &Style) {
        let (plot, size, reach) = (panel.plot, style.small_px(), style.px(RADIUS_PX * 1.6));
        let at = |point: &PlanePoint| panel.at(point.x.estimate, point.y.estimate);
        let boxed = |(x, y): Point| {
            Rect::new(
                x - reach * 0.7,
                y - reach * 0.7,
                x + reach * 0.7,
                y + reach * 0.7,
            )
        };
        let mut taken: Vec<Rect> = self.points.iter().map(|point| boxed(at(point))).collect();
        for point in self.points.iter().filter(|point| !point.name.is_empty()) {
            let (x, y) = at(point);
            let plain = |at: Point| Label::new(point.name.as_str(), at, size).colour(point.colour);
            let spots = [
                plain((x + reach, y)).middle(),
                plain((x - reach, y)).middle().ending(),
                plain((x, y - reach)).centred().above(),
                plain((x, y + reach)).centred(),
                plain((x + reach, y - reach)).above(),
                plain((x + reach, y + reach)),
                plain((x - reach, y - reach)).ending().above(),
                plain((x - reach, y + reach)).ending(),
            ];
            let is_free = |label: &Label| {
                let own = label.bounds();
                let inside = own.x0 >= plot.x0
                    && own.x1 <= plot.x1
                    && own.y0 >= plot.y0
                    && own.y1 <= plot.y1;
                inside && !taken.iter().any(|other| other.overlaps(&own))
            };
            if let Some(label) = spots.into_iter().find(is_free) {
                taken.push(label.bounds());
                scene.label(label);
            }
        }
    }

    fn draw_key(&self, scene: &mut Scene, area: Rect, style: &Style) -> Rect {
        let small = style.small_px();
        let (mut x, mut y) = (area.x0, area.y0);
        let mut entry = |scene: &mut Scene, words: &str, sign: Option<&PlaneKey>| {
            let words = text::shorten(words, area.width() - style.px(60.0), small, Face::Regular);
            let width = style.px(50.0) + text::width_px(&words, small, Face::Regular);
            if x > area.x0 && x + width > area.x1 {
                (x, y) = (area.x0, y + small * 1.5);
            }
            let middle = (x + style.px(14.0), y + small * KEY_MIDDLE_EM);
            match sign {
                Some(sign) => {
                    let radius = style.px(RADIUS_PX);
                    marker(sign.colour, sign.is_hollow).draw(
                        scene,
                        middle,
                        radius,
                        style.line_px(),
                    );
                }
                None => {
                    let ends = [(x, middle.1), (x + style.px(28.0), middle.1)];
                    scene.dashed(&ends, MUTED, style.thin_px(), DASH);
                }
            }
            scene.label(Label::new(words, (x + style.px(36.0), y), small));
            x += width + style.px(16.0);
        };
        for sign in &self.key {
            entry(scene, &sign.words, Some(sign));
        }
        if let Some(words) = &self.diagonal {
            entry(scene, words, None);
        }
        area.inset(0.0, y - area.y0 + small * 2.0, 0.0, 0.0)
    }
}

const DASH: (f64, f64) = (10.0, 7.0);
/// From the top of a line of the key to the middle of its capitals.
const KEY_MIDDLE_EM: f64 = text::ASCENT_EM - text::HALF_CAPITAL_EM;

fn marker(colour: Colour, is_hollow: bool) -> Marker {
    Marker {
        shape: Shape::Circle,
        fill: if is_hollow { PAPER } else { colour },
        outline: colour,
    }
}
