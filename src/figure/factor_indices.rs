//! How much each factor matters: Sobol's indices or Morris' elementary effects, a row for each factor.
//!
//! Two marks a row: the first order within the total, or the mean size of effects with their spread.
//! A shaded band is what noise alone would show.

use super::axes::{Axis, Panel, Scale, heading, note};
use super::effects::Interval;
use super::marks::Marker;
use super::scene::{Label, Rect, Scene};
use super::style::{MUTED, QUIET, Style, fade};
use super::text::{self, Face};

/// One factor.
#[derive(Clone, Debug)]
pub struct IndexRow {
    /// Its name with unit.
    pub name: String,
    /// A value for each mark of the key; `None` where it is undefined.
    pub marks: Vec<Option<Interval>>,
    /// What noise alone would give; `None` where that is 0 or unknown.
    pub noise: Option<f64>,
}

/// One response.
#[derive(Clone, Debug)]
pub struct IndexPanel {
    /// Its name.
    pub name: String,
    /// What there is to say of it: why it has no indices, or how much noise there is; may be empty.
    pub remark: String,
    /// The factors, in the order to show them; the same in every panel.
    pub rows: Vec<IndexRow>,
    /// Range of the axis.
    pub range: (f64, f64),
}

/// What the figure shows.
#[derive(Clone, Debug)]
pub struct FactorIndices {
    /// Heading; may be empty.
    pub title: String,
    /// The names of the marks.
    pub marks: Vec<String>,
    /// Panels, side by side.
    pub panels: Vec<IndexPanel>,
    /// Name of the axis.
    pub value_name: String,
    /// Whether values are shares, written in per cent.
    pub percent: bool,
}

impl FactorIndices {
    /// Draws all panels into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let mut area = self.draw_key(scene, area, style);
        let (size, small) = (style.text_px(), style.small_px());
        let names = || self.panels.iter().flat_map(|panel| &panel.rows);
        let widest = names().map(|row| text::width_px(&row.name, small, Face::Regular));
        let names_px = widest.fold(0.0, f64::max).min(area.width() * 0.3) + style.px(24.0);
        let foot_px = small * 1.3 + style.px(14.0) + size * 1.3;
        let n = self.panels.len().max(1);
        let rows_x0 = area.x0;
        area.x0 += names_px;
        for (place, own) in self.panels.iter().enumerate() {
            let room = area.cell((place, n), (0, 1), style.px(40.0));
            let name = text::shorten(&own.name, room.width(), size, Face::Bold);
            scene.label(Label::new(name, (room.x0, room.y0), size).bold());
            let head = room.inset(0.0, size * 1.35, 0.0, 0.0);
            note(scene, head, &own.remark, small, 2);
            let plot = room.inset(0.0, size * 1.35 + small * 2.8, style.px(20.0), foot_px);
            self.draw_panel(scene, plot, own, style);
            if place == 0 {
                let step = plot.height() / own.rows.len().max(1) as f64;
                for (k, row) in own.rows.iter().enumerate() {
                    let y = plot.y0 + (k as f64 + 0.5) * step;
                    let words =
                        text::shorten(&row.name, names_px - style.px(24.0), small, Face::Regular);
                    let at = (rows_x0 + names_px - style.px(20.0), y);
                    scene.label(Label::new(words, at, small).ending().middle());
                }
            }
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn draw_key(&self, scene: &mut Scene, area: Rect, style: &Style) -> Rect {
        let small = style.small_px();
        let (mut x, mut y) = (area.x0, area.y0);
        let has_noise = self
            .panels
            .iter()
            .flat_map(|panel| &panel.rows)
            .any(|row| row.noise.is_some());
        let half = small * (text::ASCENT_EM - text::HALF_CAPITAL_EM);
        for (place, words) in self.marks.iter().enumerate() {
            let width = style.px(28.0) + text::width_px(words, small, Face::Regular);
            if x > area.x0 && x + width > area.x1 {
                (x, y) = (area.x0, y + small * 1.5);
            }
            let middle = y + half;
            Marker::of_curve(place).draw(
                scene,
                (x + style.px(10.0), middle),
                style.px(9.0),
                style.thin_px(),
            );
            x += style.px(28.0);
            scene.label(Label::new(words.as_str(), (x, y), small));
            x += text::width_px(words, small, Face::Regular) + style.px(28.0);
        }
        if has_noise {
            let words = "what noise alone would give";
            let width = style.px(34.0) + text::width_px(words, small, Face::Regular);
            if x > area.x0 && x + width > area.x1 {
                (x, y) = (area.x0, y + small * 1.5);
            }
            let middle = y + half;
            let block = Rect::new(
                x,
                middle - style.px(8.0),
                x + style.px(24.0),
                middle + style.px(8.0),
            );
            scene.block(block, fade(QUIET, 0.6));
            scene.label(Label::new(words, (x + style.px(34.0), y), small));
        }
        area.inset(0.0, y - area.y0 + small * 1.8, 0.0, 0.0)
    }

    fn draw_panel(&self, scene: &mut Scene, plot: Rect, own: &IndexPanel, style: &Style) {
        let n_rows = own.rows.len().max(1) as f64;
        let (low, high) = own.range;
        let scale = if self.percent {
            Scale::Share(low, high)
        } else {
            Scale::Continuous(low, high)
        };
        let x = Axis::new(scale, self.value_name.as_str());
        let mut y = Axis::new(Scale::Continuous(0.0, n_rows), "");
        y.written = false;
        y.most_ticks = Some(1);
        let small = style.small_px();
        let foot = small * 1.3 + style.px(14.0) + style.text_px() * 1.3;
        let outer = Rect::new(plot.x0, plot.y0 - small * 0.45, plot.x1, plot.y1 + foot);
        let panel = Panel::new(scene, outer, &x, &y, style);
        let at = |value: f64, row: usize, mark: usize| {
            let aside = (mark as f64 + 0.5) / self.marks.len().max(1) as f64;
            let (x, _) = panel.at(value.clamp(low, high), 0.0);
            let step = plot.height() / n_rows;
            (x, plot.y0 + (row as f64 + 0.25 + 0.5 * aside) * step)
        };
        let zero = at(0.0, 0, 0).0;
        let ends = (panel.plot.y0, panel.plot.y1);
        scene.rule((zero, ends.0), (zero, ends.1), MUTED, style.thin_px());
        for (k, row) in own.rows.iter().enumerate() {
            let step = plot.height() / n_rows;
            let top = plot.y0 + k as f64 * step;
            if let Some(noise) = row.noise {
                let right = panel.at(noise.clamp(low, high), 0.0).0;
                let block = Rect::new(zero, top + step * 0.12, right, top + step * 0.88);
                scene.block(block, fade(QUIET, 0.6));
            }
            for (place, mark) in row.marks.iter().enumerate() {
                let Some(value) = mark else { continue };
                let marker = Marker::of_curve(place);
                scene.rule(
                    at(value.low, k, place),
                    at(value.high, k, place),
                    marker.fill,
                    style.line_px(),
                );
                marker.draw(
                    scene,
                    at(value.estimate, k, place),
                    style.px(9.0),
                    style.thin_px(),
                );
            }
            if row.marks.iter().all(Option::is_none) {
                let middle = (plot.x0 + style.px(16.0), top + step / 2.0);
                scene.label(
                    Label::new("undefined", middle, small)
                        .middle()
                        .colour(MUTED),
                );
            }
        }
    }
}
