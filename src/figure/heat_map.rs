//! A matrix of values as colours, over one factor per side or several nested ones.
//!
//! With several factors on a side this is "dimension stacking" (LeBlanc, Ward & Wittels 1990): the
//! whole grid of a sweep on one page, the first factor the outermost, wider gaps between the levels
//! of outer factors.

use super::axes::heading;
use super::marks;
use super::scene::{Hover, Label, Rect, Scene};
use super::style::{Colour, INK, PAPER, Palette, QUIET, Style, readable_on};
use super::text::{self, Face};

/// A factor and its levels in order.
#[derive(Clone, Debug)]
pub struct HeatFactor {
    /// Its name with unit.
    pub name: String,
    /// Its levels.
    pub levels: Vec<String>,
}

/// What the heat map shows.
#[derive(Clone, Debug, Default)]
pub struct HeatMap {
    /// Heading; may be empty.
    pub title: String,
    /// Factors of the rows, outer to inner.
    pub row_factors: Vec<HeatFactor>,
    /// Factors of the columns, outer to inner.
    pub column_factors: Vec<HeatFactor>,
    /// Cells row by row; the last factor of a side changes fastest. Missing cells are `None`.
    pub values: Vec<Option<f64>>,
    /// Text of the cells in the same order, or empty. Left out where it would be illegible.
    pub texts: Vec<String>,
    /// Name of the value with unit.
    pub value_name: String,
    /// Values at the two ends of the colour bar.
    pub range: (f64, f64),
    /// Whether values are shares, written in per cent.
    pub percent: bool,
    /// Whether colours go by the logarithm; both ends must then be above 0, and what is not is drawn
    /// as the low end.
    pub is_log: bool,
    /// The colours.
    pub palette: Palette,
    /// Where values are places in this list instead of numbers: the list, for the key.
    pub categories: Vec<HeatCategory>,
    /// With categories, how much of each cell is of each, cells in the same order; or empty.
    pub parts: Vec<Vec<f64>>,
    /// What each cell says under a pointer, cells in the same order; or empty.
    pub hovers: Vec<Option<Hover>>,
    /// A cell that is framed, by its place, and what the frame means.
    pub marked: Option<(usize, String)>,
}

/// A category of cells.
#[derive(Clone, Debug)]
pub struct HeatCategory {
    /// Its name.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
}

/// The places of rows or columns along one side.
struct Side<'a> {
    factors: &'a [HeatFactor],
    n: usize,
    gap_px: f64,
}

impl<'a> Side<'a> {
    fn new(factors: &'a [HeatFactor], style: &Style) -> Self {
        Self {
            factors,
            n: factors.iter().map(|factor| factor.levels.len()).product(),
            gap_px: style.px(9.0),
        }
    }

    /// Cells in one level of factor `depth`.
    fn run(&self, depth: usize) -> usize {
        self.factors[depth + 1..]
            .iter()
            .map(|factor| factor.levels.len())
            .product()
    }

    /// Gaps before cell `i`: one for each nesting level that changes there, inner levels but the innermost.
    fn gaps_before(&self, i: usize) -> f64 {
        let outer = 0..self.factors.len().saturating_sub(1);
        outer
            .map(|depth| (i / self.run(depth).max(1)) as f64)
            .sum::<f64>()
            * self.gap_px
    }

    /// Extent of a cell if it were to fill `room` pixels.
    fn cell_px(&self, room: f64) -> f64 {
        (room - self.gaps_before(self.n.saturating_sub(1))).max(1.0) / self.n.max(1) as f64
    }

    /// First and last pixel of cells `from..to`.
    fn span(&self, start: f64, cell_px: f64, from: usize, to: usize) -> (f64, f64) {
        let low = start + from as f64 * cell_px + self.gaps_before(from);
        let last = to.saturating_sub(1);
        (low, start + to as f64 * cell_px + self.gaps_before(last))
    }

    fn widest(&self, depth: usize, size: f64) -> f64 {
        let levels = self.factors[depth].levels.iter();
        levels
            .map(|level| text::width_px(level, size, Face::Regular))
            .fold(0.0, f64::max)
    }
}

impl HeatMap {
    /// Draws the heat map, its labels and its colour bar into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let (rows, columns) = (
            Side::new(&self.row_factors, style),
            Side::new(&self.column_factors, style),
        );
        let size = style.small_px();
        let name_px = style.text_px() * 1.45;
        let air = style.px(10.0);

        let bar_px = self.key_px(area, style);
        let widths: Vec<f64> = (0..rows.factors.len())
            .map(|d| rows.widest(d, size).min(area.width() * 0.2) + air)
            .collect();
        let left: f64 = widths.iter().sum::<f64>() + rows.factors.len() as f64 * name_px + air;
        let free_px = area.width() - left - bar_px;
        let cell_w = columns.cell_px(free_px);
        let slot = |depth: usize| cell_w * columns.run(depth) as f64;
        // Levels with room for some letters are cut rather than turned.
        let cramped = |d: usize| slot(d) < size * 6.0;
        let turned = |d: usize| cramped(d) && columns.widest(d, size) > slot(d) - size * 0.3;
        let depths: Vec<f64> = (0..columns.factors.len())
            .map(|d| {
                let across = columns.widest(d, size).min(area.height() * 0.2);
                air + if turned(d) {
                    across
                } else {
                    size * text::HEIGHT_EM
                }
            })
            .collect();
        let bottom: f64 = depths.iter().sum::<f64>() + columns.factors.len() as f64 * name_px + air;
        let plot = area.inset(left, style.px(4.0), bar_px, bottom);
        let cell_h = rows.cell_px(plot.height());

        for i in 0..rows.n {
            for j in 0..columns.n {
                let (x0, x1) = columns.span(plot.x0, cell_w, j, j + 1);
                let (y0, y1) = rows.span(plot.y0, cell_h, i, i + 1);
                let cell = Rect { x0, y0, x1, y1 };
                match self.values.get(i * columns.n + j).copied().flatten() {
                    Some(value) => {
                        scene.block(cell, self.colour(value));
                        self.draw_parts(scene, cell, i * columns.n + j, style);
                    }
                    None => marks::no_data(scene, cell, style),
                }
            }
        }
        self.draw_texts(scene, plot, (&rows, cell_h), (&columns, cell_w), style);
        let rect_of = |place: usize| {
            let (i, j) = (place / columns.n, place % columns.n);
            let (x0, x1) = columns.span(plot.x0, cell_w, j, j + 1);
            let (y0, y1) = rows.span(plot.y0, cell_h, i, i + 1);
            Rect { x0, y0, x1, y1 }
        };
        if let Some((place, _)) = &self.marked {
            mark(scene, rect_of(*place), style);
        }
        for (place, hover) in self.hovers.iter().enumerate() {
            if let Some(hover) = hover {
                scene.hover(rect_of(place), hover.clone());
            }
        }

        // Innermost labels lie next to the cells, outer ones further out with a bracket.
        let mut x = plot.x0;
        for depth in (0..rows.factors.len()).rev() {
            let factor = &rows.factors[depth];
            let run = rows.run(depth);
            let every = (size * 1.05 / (cell_h * run as f64)).ceil().max(1.0) as usize;
            for k in 0..rows.n.checked_div(run).unwrap_or(0) {
                let (y0, y1) = rows.span(plot.y0, cell_h, k * run, (k + 1) * run);
                if depth + 1 < rows.factors.len() {
                    scene.rule(
                        (x - air * 0.2, y0 + 2.0),
                        (x - air * 0.2, y1 - 2.0),
                        QUIET,
                        style.thin_px(),
                    );
                }
                if k % every == 0 {
                    let level = &factor.levels[k % factor.levels.len()];
                    let level = text::shorten(level, widths[depth] - air, size, Face::Regular);
                    scene.label(
                        Label::new(level, (x - air, (y0 + y1) / 2.0), size)
                            .ending()
                            .middle(),
                    );
                }
            }
            x -= widths[depth] + name_px;
            let name = text::shorten(
                &factor.name,
                plot.height() + bottom,
                style.text_px(),
                Face::Regular,
            );
            let half = text::width_px(&name, style.text_px(), Face::Regular) / 2.0;
            let y = plot.centre().1.max(area.y0 + half).min(area.y1 - half);
            scene.label(Label::new(name, (x, y), style.text_px()).centred().upward());
        }
        let mut y = plot.y1;
        for depth in (0..columns.factors.len()).rev() {
            let factor = &columns.factors[depth];
            let run = columns.run(depth);
            let turned = turned(depth);
            let every = if turned {
                (size * 1.05 / slot(depth)).ceil().max(1.0) as usize
            } else {
                1
            };
            for k in 0..columns.n.checked_div(run).unwrap_or(0) {
                let (x0, x1) = columns.span(plot.x0, cell_w, k * run, (k + 1) * run);
                if depth + 1 < columns.factors.len() {
                    scene.rule(
                        (x0 + 2.0, y + air * 0.3),
                        (x1 - 2.0, y + air * 0.3),
                        QUIET,
                        style.thin_px(),
                    );
                }
                let level = &factor.levels[k % factor.levels.len()];
                let at = ((x0 + x1) / 2.0, y + air);
                if turned && k % every == 0 {
                    let level = text::shorten(level, depths[depth] - air, size, Face::Regular);
                    scene.label(Label::new(level, at, size).ending().middle().upward());
                } else if !turned {
                    let level = text::shorten(level, x1 - x0, size, Face::Regular);
                    scene.label(Label::new(level, at, size).centred());
                }
            }
            y += depths[depth];
            let name = text::shorten(
                &factor.name,
                area.width() - bar_px,
                style.text_px(),
                Face::Regular,
            );
            let half = text::width_px(&name, style.text_px(), Face::Regular) / 2.0;
            let x = plot.centre().0.min(area.x1 - half).max(area.x0 + half);
            scene.label(Label::new(name, (x, y + style.px(6.0)), style.text_px()).centred());
            y += name_px;
        }
        let bar = Rect::new(plot.x1 + style.px(28.0), plot.y0, area.x1, plot.y1);
        if self.categories.is_empty() {
            self.draw_colour_bar(scene, bar, style);
        } else {
            self.draw_categories(scene, bar, style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn colour(&self, value: f64) -> Colour {
        if let Some(category) = self.categories.get(value as usize) {
            return category.colour;
        }
        self.palette.at(self.share(value))
    }

    /// Room under the key for what the frame means.
    pub(super) fn mark_px(&self, style: &Style) -> f64 {
        self.marked.as_ref().map_or(0.0, |_| style.small_px() * 2.4)
    }

    /// What the frame means, at the foot of the key.
    pub(super) fn draw_mark_key(&self, scene: &mut Scene, room: Rect, style: &Style) {
        let Some((_, words)) = &self.marked else {
            return;
        };
        let size = style.small_px();
        let swatch = Rect::new(
            room.x0,
            room.y1 - size * 1.4,
            room.x0 + style.px(34.0),
            room.y1 - size * 0.2,
        );
        mark(scene, swatch, style);
        let at = (swatch.x1 + style.px(10.0), swatch.centre().1);
        let words = text::shorten(words, room.x1 - at.0, size, Face::Regular);
        scene.label(Label::new(words, at, size).middle());
    }

    /// How far from the low to the high end of the colours a value is.
    pub(super) fn share(&self, value: f64) -> f64 {
        let (low, high) = self.range;
        if high <= low {
            0.5
        } else if self.is_log {
            (value.max(low) / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low)
        }
    }

    /// Writes all texts in the one size that fits every cell, or none if that would be illegible.
    fn draw_texts(
        &self,
        scene: &mut Scene,
        plot: Rect,
        rows: (&Side<'_>, f64),
        columns: (&Side<'_>, f64),
        style: &Style,
    ) {
        let ((rows, cell_h), (columns, cell_w)) = (rows, columns);
        let largest = style.small_px();
        let fit = |words: &String| {
            let wide = words
                .lines()
                .map(|line| text::width_px(line, largest, Face::Regular))
                .fold(0.0, f64::max);
            let high = words.lines().count().max(1) as f64 * largest * text::LEADING_EM;
            (cell_w * 0.92 / wide.max(1.0)).min(cell_h * 0.92 / high)
        };
        let shrink = self.texts.iter().map(fit).fold(1.0, f64::min);
        if shrink < 0.72 {
            return;
        }
        let size = largest * shrink;
        for (k, words) in self.texts.iter().enumerate().take(rows.n * columns.n) {
            let Some(value) = self.values.get(k).copied().flatten() else {
                continue;
            };
            let (x0, x1) = columns.span(plot.x0, cell_w, k % columns.n, k % columns.n + 1);
            let (y0, y1) = rows.span(plot.y0, cell_h, k / columns.n, k / columns.n + 1);
            let lines = words.lines().count() as f64;
            for (row, line) in words.lines().enumerate() {
                let y =
                    (y0 + y1) / 2.0 + (row as f64 - (lines - 1.0) / 2.0) * size * text::LEADING_EM;
                let label = Label::new(line, ((x0 + x1) / 2.0, y), size)
                    .centred()
                    .middle();
                scene.label(label.colour(readable_on(self.colour(value))));
            }
        }
    }
}

/// A frame that shows on any colour: ink within paper.
fn mark(scene: &mut Scene, rect: Rect, style: &Style) {
    let out = |px: f64| rect.inset(-px, -px, -px, -px);
    scene.frame(out(style.px(3.0)), PAPER, style.px(10.0));
    scene.frame(out(style.px(3.0)), INK, style.px(5.0));
}
