//! What the colours of a heat map mean: a colour bar, or a list of categories.

use super::axes::nice_step;
use super::heat_map::HeatMap;
use super::marks;
use super::scene::{Label, Rect, Scene};
use super::style::{INK, MUTED, PAPER, Style, percent_short, tick_label};
use super::text::{self, Face};

impl HeatMap {
    /// Room for the key at the right of `area`.
    pub(super) fn key_px(&self, area: Rect, style: &Style) -> f64 {
        if self.categories.is_empty() {
            let mark = self.marked.as_ref().map_or(0.0, |(_, words)| {
                text::width_px(words, style.small_px(), Face::Regular) + style.px(80.0)
            });
            return style.px(185.0).max(mark).min(area.width() * 0.3);
        }
        let names = self
            .categories
            .iter()
            .map(|category| category.name.as_str());
        let marked = self.marked.iter().map(|(_, words)| words.as_str());
        let widest = names
            .chain(marked)
            .map(|name| text::width_px(name, style.small_px(), Face::Regular))
            .fold(0.0, f64::max);
        (widest + style.px(80.0)).min(area.width() * 0.4)
    }

    /// A cell of several categories, side by side in their order.
    pub(super) fn draw_parts(&self, scene: &mut Scene, cell: Rect, place: usize, style: &Style) {
        let Some(parts) = self
            .parts
            .get(place)
            .filter(|_| !self.categories.is_empty())
        else {
            return;
        };
        let total: f64 = parts.iter().sum();
        let mut x = cell.x0;
        for (share, category) in parts.iter().zip(&self.categories) {
            let x1 = x + cell.width() * share / total.max(f64::MIN_POSITIVE);
            if *share > 0.0 {
                scene.block(Rect::new(x, cell.y0, x1, cell.y1), category.colour);
            }
            x = x1;
        }
        scene.frame(cell, PAPER, style.px(2.0));
    }

    /// All categories, those without any cell too.
    pub(super) fn draw_categories(&self, scene: &mut Scene, room: Rect, style: &Style) {
        let size = style.small_px();
        let step = size * 1.7;
        let mut y = room.y0;
        for category in &self.categories {
            let swatch = Rect::new(room.x0, y, room.x0 + style.px(34.0), y + size * 1.2);
            scene.block(swatch, category.colour);
            scene.frame(swatch, MUTED, style.px(1.0));
            let at = (swatch.x1 + style.px(10.0), swatch.centre().1);
            let name = text::shorten(&category.name, room.x1 - at.0, size, Face::Regular);
            scene.label(Label::new(name, at, size).middle());
            y += step;
        }
        let foot = Rect::new(room.x0, y, room.x1, y + size * 1.6);
        self.draw_mark_key(scene, foot, style);
    }

    /// The colour bar, with a swatch for missing values where there are any.
    pub(super) fn draw_colour_bar(&self, scene: &mut Scene, room: Rect, style: &Style) {
        let size = style.small_px();
        let missing = self.values.iter().any(Option::is_none);
        self.draw_mark_key(scene, room, style);
        let foot = if missing { size * 2.9 } else { 0.0 } + self.mark_px(style);
        let bar = Rect::new(room.x0, room.y0, room.x0 + style.px(34.0), room.y1 - foot);
        let steps = (bar.height() as usize).clamp(2, 256);
        for k in 0..steps {
            let share = k as f64 / (steps - 1) as f64;
            let y = |k: usize| bar.y1 - bar.height() * k as f64 / steps as f64;
            scene.block(
                Rect::new(bar.x0, y(k + 1), bar.x1, y(k)),
                self.palette.at(share),
            );
        }
        scene.frame(bar, INK, style.px(1.0));
        let (low, high) = self.range;
        let step = if high > low {
            nice_step(high - low, 5)
        } else {
            1.0
        };
        let ticks: Vec<f64> = if self.is_log {
            decade_ticks(low, high)
        } else {
            ((low / step - 1e-9).ceil() as i64..=(high / step + 1e-9).floor() as i64)
                .map(|k| k as f64 * step)
                .collect()
        };
        let mut widest: f64 = 0.0;
        for value in ticks {
            let y = bar.y1 - self.share(value) * bar.height();
            let label = if self.is_log && self.percent {
                percent_short(value)
            } else if self.is_log {
                tick_label(value, value)
            } else if self.percent {
                format!("{} %", tick_label(value * 100.0, step * 100.0))
            } else {
                tick_label(value, step)
            };
            widest = widest.max(text::width_px(&label, size, Face::Regular));
            scene.rule(
                (bar.x1, y),
                (bar.x1 + style.px(6.0), y),
                INK,
                style.thin_px(),
            );
            // The end labels stay beside the bar rather than half beyond it.
            let y = y.max(bar.y0 + size * 0.4).min(bar.y1 - size * 0.2);
            scene.label(Label::new(label, (bar.x1 + style.px(10.0), y), size).middle());
        }
        let name = text::shorten(
            &self.value_name,
            bar.height(),
            style.text_px(),
            Face::Regular,
        );
        let x = (bar.x1 + style.px(16.0) + widest).min(room.x1 - style.text_px() * 1.1);
        scene.label(
            Label::new(name, (x, bar.centre().1), style.text_px())
                .centred()
                .upward(),
        );
        if missing {
            let y = bar.y1 + size * 1.2;
            let swatch = Rect::new(bar.x0, y, bar.x1, y + style.px(28.0));
            marks::no_data(scene, swatch, style);
            scene.label(
                Label::new(
                    "no data",
                    (bar.x1 + style.px(10.0), swatch.centre().1),
                    size,
                )
                .middle(),
            );
        }
    }
}

/// 1, 2 and 5 times the powers of ten within a range above 0.
fn decade_ticks(low: f64, high: f64) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let within = |value: &f64| *value >= low * (1.0 - 1e-9) && *value <= high * (1.0 + 1e-9);
    decades
        .flat_map(|k| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(k)))
        .filter(within)
        .collect()
}
