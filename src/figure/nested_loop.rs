//! The nested-loop plot (Rücker & Schwarzer 2014): a rate for every cell of a grid along one axis, the
//! cells in the order of nested loops over the factors, with a staircase for each factor under it.
//!
//! Where the rate follows a staircase, that factor matters; the outermost has the longest steps.

use super::axes::{Axis, Panel, Scale, heading};
use super::scene::{Label, Point, Rect, Scene};
use super::style::{Colour, GRID, INK, MUTED, SERIES, Style, fade};
use super::text::{self, Face};

/// One factor with the place of its level in every cell.
#[derive(Clone, Debug)]
pub struct LoopFactor {
    /// Its name with unit.
    pub name: String,
    /// Its levels in order.
    pub levels: Vec<String>,
    /// The level of each cell, cells in order.
    pub level_of: Vec<usize>,
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct NestedLoop {
    /// Heading; may be empty.
    pub title: String,
    /// Low end, rate and high end of every cell; the ends are the rate where there is no interval.
    pub rates: Vec<Option<(f64, f64, f64)>>,
    /// A second share of every cell.
    pub gated: Vec<Option<f64>>,
    /// Names of the rate, its interval and the second share.
    pub names: [String; 3],
    /// Factors from the outermost loop to the innermost.
    pub factors: Vec<LoopFactor>,
    /// Colour of the second share.
    pub gated_colour: Colour,
}

impl NestedLoop {
    /// Draws the plot into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let small = style.small_px();
        let stair_px = small * 2.7;
        let stairs_px = stair_px * self.factors.len() as f64;
        let key_px = small * 1.7;
        let upper = area.inset(0.0, key_px, 0.0, stairs_px + style.px(10.0));
        let n = self.rates.len();
        // A cell is no category of its own: the axis has neither ticks nor labels, its stairs have.
        let mut x = Axis::new(Scale::Categories(Vec::new()), "");
        x.written = false;
        let mut y = Axis::new(Scale::Share(0.0, 1.0), self.names[0].as_str());
        y.most_ticks = Some(5);
        // The names of factors stand left of their stairs, under the axis of the rate.
        let widest = (self.factors.iter())
            .map(|factor| text::width_px(&factor.name, small, Face::Regular))
            .fold(0.0, f64::max);
        let trial = Panel::new(&mut Scene::new(1, 1), upper, &x, &y, style).plot;
        let extra = widest + style.px(24.0) - (trial.x0 - upper.x0);
        let extra = extra.clamp(0.0, area.width() * 0.2);
        let panel = Panel::new(scene, upper.inset(extra, 0.0, 0.0, 0.0), &x, &y, style);
        let at = |cell: usize, value: f64| panel.at(cell as f64 / n.max(1) as f64 - 0.5, value);
        for edge in self.edges() {
            let px = at(edge, 0.0).0;
            scene.rule(
                (px, panel.plot.y0),
                (px, panel.plot.y1),
                GRID,
                style.px(1.0),
            );
        }
        let width = panel.plot.width() / n.max(1) as f64;
        for (cell, rate) in self.rates.iter().enumerate() {
            if let Some((low, _, high)) = rate.filter(|(low, _, high)| high > low) {
                let (x0, y0) = at(cell, high);
                let y1 = at(cell, low).1;
                let band = Rect::new(x0, y0, x0 + width, y1);
                scene.block(band, fade(SERIES, 0.18));
            }
        }
        let estimates: Vec<Option<f64>> = self.rates.iter().map(|r| Some((*r)?.1)).collect();
        steps(scene, &at, &self.gated, self.gated_colour, style.px(2.5));
        steps(scene, &at, &estimates, SERIES, style.px(2.5));
        self.draw_key(scene, area, panel.plot.x0, style);
        for (k, factor) in self.factors.iter().enumerate() {
            let y0 = area.y1 - stairs_px + stair_px * k as f64 + small * 0.25;
            let room = Rect::new(
                panel.plot.x0,
                y0,
                panel.plot.x1,
                y0 + stair_px - small * 0.5,
            );
            stairs(scene, factor, room, area.x0, style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    /// Cells at which the outermost factor changes.
    fn edges(&self) -> Vec<usize> {
        let Some(outer) = self.factors.first() else {
            return Vec::new();
        };
        let changes = outer.level_of.windows(2).enumerate();
        let changes = changes.filter(|(_, pair)| pair[0] != pair[1]);
        changes.map(|(cell, _)| cell + 1).collect()
    }

    fn draw_key(&self, scene: &mut Scene, area: Rect, left: f64, style: &Style) {
        let small = style.small_px();
        let mut x = left;
        let entries = [
            (SERIES, &self.names[0]),
            (fade(SERIES, 0.18), &self.names[1]),
            (self.gated_colour, &self.names[2]),
        ];
        for (place, (colour, name)) in entries.into_iter().enumerate() {
            let middle = area.y0 + small * (text::ASCENT_EM - text::HALF_CAPITAL_EM);
            let half = if place == 1 {
                small * 0.4
            } else {
                style.px(2.0)
            };
            let swatch = Rect::new(x, middle - half, x + style.px(44.0), middle + half);
            scene.block(swatch, colour);
            x = swatch.x1 + style.px(12.0);
            scene.label(Label::new(name.as_str(), (x, area.y0), small));
            x += text::width_px(name, small, Face::Regular) + style.px(36.0);
        }
    }
}

/// A line that stands at each cell's value for the width of the cell.
fn steps(
    scene: &mut Scene,
    at: &impl Fn(usize, f64) -> Point,
    values: &[Option<f64>],
    colour: Colour,
    width: f64,
) {
    let mut line: Vec<Point> = Vec::new();
    for (cell, value) in values.iter().enumerate() {
        match value {
            Some(value) => {
                line.push(at(cell, *value));
                line.push(at(cell + 1, *value));
            }
            None => scene.line(std::mem::take(&mut line), colour, width),
        }
    }
    scene.line(line, colour, width);
}

/// A factor's levels over the cells, as stairs with the levels written where there is room.
fn stairs(scene: &mut Scene, factor: &LoopFactor, room: Rect, left: f64, style: &Style) {
    let small = style.small_px();
    let n = factor.level_of.len().max(1) as f64;
    let top = factor.levels.len().saturating_sub(1).max(1) as f64;
    let at = |cell: usize, level: usize| {
        let x = room.x0 + room.width() * cell as f64 / n;
        (x, room.y1 - room.height() * level as f64 / top)
    };
    let mut line = Vec::new();
    let mut start = 0;
    let size = small * 0.82;
    for cell in 1..=factor.level_of.len() {
        let level = factor.level_of[start];
        if factor.level_of.get(cell) == Some(&level) {
            continue;
        }
        let (from, to) = (at(start, level), at(cell, level));
        line.extend([from, to]);
        let name = &factor.levels[level];
        let wide = text::width_px(name, size, Face::Regular);
        if to.0 - from.0 > wide + style.px(8.0) {
            // Below the step where there is room below it, else above.
            let label = Label::new(name.as_str(), ((from.0 + to.0) / 2.0, from.1), size).centred();
            let label = if from.1 + size * 1.1 < room.y1 + small * 0.3 {
                label
            } else {
                label.above()
            };
            scene.label(label.colour(MUTED));
        }
        start = cell;
    }
    scene.line(line, INK, style.px(1.5));
    let name = text::shorten(
        &factor.name,
        room.x0 - left - style.px(12.0),
        small,
        Face::Regular,
    );
    let place = (room.x0 - style.px(12.0), room.centre().1);
    scene.label(Label::new(name, place, small).ending().middle());
}
