//! Frames with ticks and names round a data region, sized from the text they hold.
//!
//! [`Panel::new`] measures the tick labels first and gives the rest of its rectangle to the data,
//! so that nothing is clipped whatever the labels; ticks thin out until their labels fit.

use super::scene::{Label, Point, Rect, Scene};
use super::style::{GRID, INK, MUTED, Style, tick_label};
use super::text::{self, Face};

/// What an axis shows.
#[derive(Clone, Debug)]
pub enum Scale {
    /// A continuous quantity over a range; ticks at 1, 2 or 5 times a power of ten.
    Continuous(f64, f64),
    /// The same with ticks at integers only.
    Integer(f64, f64),
    /// A share from the first to the second value, ticks in per cent.
    Share(f64, f64),
    /// Powers of ten, from 10 to the first to 10 to the second value; data are given as logarithms.
    Decades(f64, f64),
    /// Categories at 0, 1, 2, …
    Categories(Vec<String>),
}

/// An axis: its scale, its name with unit, and whether its labels are written.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The scale.
    pub scale: Scale,
    /// The name with its unit; may be empty.
    pub name: String,
    /// Whether tick labels and the name are written (small multiples share them).
    pub written: bool,
    /// The most steps between ticks; `None` goes by the room. Small multiples must agree.
    pub most_ticks: Option<usize>,
}

impl Axis {
    /// A written axis.
    pub fn new(scale: Scale, name: impl Into<String>) -> Self {
        Self {
            scale,
            name: name.into(),
            written: true,
            most_ticks: None,
        }
    }

    /// The range of the axis, never empty.
    pub fn range(&self) -> (f64, f64) {
        match &self.scale {
            Scale::Categories(names) => (-0.5, names.len().max(1) as f64 - 0.5),
            Scale::Continuous(a, b)
            | Scale::Integer(a, b)
            | Scale::Share(a, b)
            | Scale::Decades(a, b) => {
                if b > a {
                    (*a, *b)
                } else {
                    (a - 0.5, a + 0.5)
                }
            }
        }
    }

    /// Ticks with their labels, about `at_most` of them.
    fn ticks(&self, at_most: usize) -> Vec<(f64, String)> {
        let (low, high) = self.range();
        let step = match &self.scale {
            Scale::Categories(names) => {
                return names
                    .iter()
                    .enumerate()
                    .map(|(i, name)| (i as f64, name.clone()))
                    .collect();
            }
            Scale::Integer(..) | Scale::Decades(..) => nice_step(high - low, at_most).max(1.0),
            Scale::Continuous(..) | Scale::Share(..) => nice_step(high - low, at_most),
        };
        // The small slack keeps a tick that rounding put just outside the range.
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let label = |value: f64| match &self.scale {
            Scale::Share(..) => format!("{} %", tick_label(value * 100.0, step * 100.0)),
            Scale::Decades(..) => power_of_ten(value),
            _ => tick_label(value, step),
        };
        (first..=last)
            .map(|k| (k as f64 * step, label(k as f64 * step)))
            .collect()
    }
}

/// 10 to a whole power, in words a reader knows: 1,000 rather than 10³ as long as that is short.
fn power_of_ten(exponent: f64) -> String {
    if (-3.0..=5.0).contains(&exponent) {
        let value = 10f64.powf(exponent);
        return tick_label(value, value.min(1.0));
    }
    let exponent = format!("{exponent:.0}");
    let digits = exponent.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    });
    format!("10{}", digits.collect::<String>())
}

/// The smallest of 1, 2, 5 × 10ᵏ that divides `span` into at most `at_most` steps.
pub fn nice_step(span: f64, at_most: usize) -> f64 {
    let raw = span / at_most.max(1) as f64;
    let magnitude = 10f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|f| f * magnitude >= raw * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * magnitude
}

/// A data region with its axes drawn.
pub struct Panel {
    /// The data region in pixels.
    pub plot: Rect,
    x: (f64, f64),
    y: (f64, f64),
}

/// Lines of the labels under a categorical axis, and whether they are turned upward.
struct CategoryLabels {
    lines: Vec<Vec<String>>,
    turned: bool,
    depth_px: f64,
}

fn category_labels(
    names: &[String],
    slot_px: f64,
    deepest_px: f64,
    size_px: f64,
) -> CategoryLabels {
    let width = |line: &str| text::width_px(line, size_px, Face::Regular);
    let room = slot_px - size_px * 0.4;
    let wrapped: Vec<Vec<String>> = names
        .iter()
        .map(|n| text::wrap(n, room, size_px, Face::Regular, 3))
        .collect();
    let cut = wrapped.iter().flatten().any(|line| line.contains('…'));
    if !cut {
        let lines = wrapped.iter().map(Vec::len).max().unwrap_or(1);
        let depth_px = size_px * (text::HEIGHT_EM + text::LEADING_EM * (lines.max(1) - 1) as f64);
        return CategoryLabels {
            lines: wrapped,
            turned: false,
            depth_px,
        };
    }
    let short: Vec<String> = names
        .iter()
        .map(|n| text::shorten(&n.replace('\n', " "), deepest_px, size_px, Face::Regular))
        .collect();
    let depth_px = short.iter().map(|n| width(n)).fold(0.0, f64::max);
    CategoryLabels {
        lines: short.into_iter().map(|n| vec![n]).collect(),
        turned: true,
        depth_px,
    }
}

impl Panel {
    /// Draws frame, ticks and names inside `outer` and leaves the rest to the data.
    pub fn new(scene: &mut Scene, outer: Rect, x: &Axis, y: &Axis, style: &Style) -> Self {
        let size = style.small_px();
        let tick = style.px(7.0);
        let name_px = style.text_px();
        let line = |axis: &Axis| {
            if axis.written && !axis.name.is_empty() {
                name_px * 1.25
            } else {
                0.0
            }
        };

        let by_room = ((outer.height() / (size * 2.6)) as usize).clamp(1, 8);
        let y_ticks = y.ticks(y.most_ticks.unwrap_or(by_room));
        let widest = |ticks: &[(f64, String)]| {
            ticks
                .iter()
                .map(|(_, label)| text::width_px(label, size, Face::Regular))
                .fold(0.0, f64::max)
        };
        let most_px = outer.width() * 0.4;
        let left = tick
            + line(y)
            + if y.written {
                widest(&y_ticks).min(most_px) + style.px(6.0)
            } else {
                0.0
            };

        let (x_low, x_high) = x.range();
        let mut right = style.px(4.0);
        let mut x_ticks = x.ticks(1);
        let mut below = size * text::HEIGHT_EM;
        let mut categories = None;
        if let Scale::Categories(names) = &x.scale {
            let slot = (outer.width() - left - right) / names.len().max(1) as f64;
            let labels = category_labels(names, slot, outer.height() * 0.42, size);
            below = labels.depth_px;
            categories = Some(labels);
        } else {
            for at_most in (1..=8).rev() {
                x_ticks = x.ticks(at_most);
                // The last label may stick out to the right of the data.
                let overhang = x_ticks.last().map_or(0.0, |(value, label)| {
                    let beyond = (x_high - value) / (x_high - x_low) * (outer.width() - left);
                    text::width_px(label, size, Face::Regular) / 2.0 - beyond
                });
                right = overhang.max(style.px(4.0));
                let plot_px = outer.width() - left - right;
                let spacing = match x_ticks.as_slice() {
                    [(a, _), (b, _), ..] => (b - a) / (x_high - x_low) * plot_px,
                    _ => f64::INFINITY,
                };
                if widest(&x_ticks) + size <= spacing {
                    break;
                }
            }
        }
        let bottom = tick
            + line(x)
            + if x.written {
                below + style.px(4.0)
            } else {
                0.0
            };
        // Half a tick label may stick out above the data.
        let plot = outer.inset(left, size * 0.45, right, bottom);
        let panel = Self {
            plot,
            x: (x_low, x_high),
            y: y.range(),
        };

        for (value, label) in &y_ticks {
            let py = panel.at(0.0, *value).1;
            scene.rule((plot.x0, py), (plot.x1, py), GRID, style.px(1.0));
            scene.rule((plot.x0 - tick, py), (plot.x0, py), INK, style.thin_px());
            if y.written {
                let label = text::shorten(label, most_px, size, Face::Regular);
                scene.label(
                    Label::new(label, (plot.x0 - tick - style.px(6.0), py), size)
                        .ending()
                        .middle(),
                );
            }
        }
        let label_y = plot.y1 + tick + style.px(4.0);
        for (i, (value, label)) in x_ticks.iter().enumerate() {
            let px = panel.at(*value, 0.0).0;
            scene.rule((px, plot.y1), (px, plot.y1 + tick), INK, style.thin_px());
            if !x.written {
                continue;
            }
            match &categories {
                Some(labels) if labels.turned => {
                    let label = labels.lines[i].concat();
                    scene.label(
                        Label::new(label, (px, label_y), size)
                            .ending()
                            .middle()
                            .upward(),
                    );
                }
                Some(labels) => {
                    for (row, line) in labels.lines[i].iter().enumerate() {
                        let at = (px, label_y + row as f64 * size * text::LEADING_EM);
                        scene.label(Label::new(line.as_str(), at, size).centred());
                    }
                }
                None => scene.label(Label::new(label.as_str(), (px, label_y), size).centred()),
            }
        }
        scene.rule((plot.x0, plot.y0), (plot.x0, plot.y1), INK, style.thin_px());
        scene.rule((plot.x0, plot.y1), (plot.x1, plot.y1), INK, style.thin_px());
        if x.written {
            let name = text::shorten(&x.name, outer.width(), name_px, Face::Regular);
            // A name wider than the data is centred on the panel instead, to stay inside it.
            let half = text::width_px(&name, name_px, Face::Regular) / 2.0;
            let middle = plot.centre().0.min(outer.x1 - half).max(outer.x0 + half);
            scene.label(
                Label::new(name, (middle, outer.y1), name_px)
                    .centred()
                    .above(),
            );
        }
        if y.written {
            let name = text::shorten(&y.name, outer.height(), name_px, Face::Regular);
            let half = text::width_px(&name, name_px, Face::Regular) / 2.0;
            let middle = plot.centre().1.min(outer.y1 - half).max(outer.y0 + half);
            scene.label(
                Label::new(name, (outer.x0, middle), name_px)
                    .centred()
                    .upward(),
            );
        }
        panel
    }

    /// A data region without frame or labels.
    pub fn bare(plot: Rect, x: &Axis, y: &Axis) -> Self {
        Self {
            plot,
            x: x.range(),
            y: y.range(),
        }
    }

    /// The pixel of a data point.
    pub fn at(&self, x: f64, y: f64) -> Point {
        let across = (x - self.x.0) / (self.x.1 - self.x.0);
        let up = (y - self.y.0) / (self.y.1 - self.y.0);
        (
            self.plot.x0 + across * self.plot.width(),
            self.plot.y1 - up * self.plot.height(),
        )
    }
}

/// Writes a heading into the top of `outer`, wrapped, and returns the room under it.
pub fn heading(
    scene: &mut Scene,
    outer: Rect,
    words: &str,
    size_px: f64,
    max_lines: usize,
) -> Rect {
    write_lines(scene, outer, words, size_px, Face::Bold, max_lines)
}

/// Writes a note into the top of `outer`, wrapped, and returns the room under it.
pub fn note(scene: &mut Scene, outer: Rect, words: &str, size_px: f64, max_lines: usize) -> Rect {
    write_lines(scene, outer, words, size_px, Face::Regular, max_lines)
}

fn write_lines(
    scene: &mut Scene,
    outer: Rect,
    words: &str,
    size_px: f64,
    face: Face,
    max_lines: usize,
) -> Rect {
    if words.is_empty() {
        return outer;
    }
    let lines = text::wrap(words, outer.width(), size_px, face, max_lines);
    for (row, line) in lines.iter().enumerate() {
        let label = Label::new(
            line.as_str(),
            (outer.x0, outer.y0 + row as f64 * size_px * text::LEADING_EM),
            size_px,
        );
        scene.label(if face == Face::Bold {
            label.bold()
        } else {
            label.colour(MUTED)
        });
    }
    outer.inset(
        0.0,
        lines.len() as f64 * size_px * text::LEADING_EM + size_px * 0.25,
        0.0,
        0.0,
    )
}
