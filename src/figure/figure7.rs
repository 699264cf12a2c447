//! The report's Figure 7: per setting the three most sampled topologies, their frequencies and the
//! dimensionality trace in one row, and rows of one or more variants side by side on a page.

use super::axes::{heading, note};
use super::dimensionality_trace::DimensionalityTrace;
use super::scene::{Label, Rect, Scene};
use super::style::{GRID, MUTED, QUIET, Style};
use super::text;
use super::topology_bars::TopologyBars;
use super::topology_map::TopologyMap;

/// One setting.
#[derive(Clone, Debug, Default)]
pub struct Figure7Row {
    /// Its name, in bold.
    pub title: String,
    /// Its settings in words.
    pub settings: String,
    /// The most sampled topologies, at most three; fewer leave their place empty.
    pub topologies: Vec<TopologyMap>,
    /// Their frequencies.
    pub bars: TopologyBars,
    /// The trace of the number of sets.
    pub trace: DimensionalityTrace,
}

/// A column of rows under a heading.
#[derive(Clone, Debug, Default)]
pub struct Figure7Column {
    /// Its heading; may be empty.
    pub heading: String,
    /// Its rows; `None` where the variant has no such row.
    pub rows: Vec<Option<Figure7Row>>,
}

/// A page of rows and columns.
#[derive(Clone, Debug, Default)]
pub struct Figure7Page {
    /// Heading of the page; may be empty.
    pub title: String,
    /// Variants side by side.
    pub columns: Vec<Figure7Column>,
}

/// Maps, histogram and trace by their share of a row's width.
const WIDTHS: [f64; 5] = [1.0, 1.0, 1.0, 1.3, 1.5];
const MAPS: usize = 3;

impl Figure7Row {
    /// Draws the row into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let room = heading(scene, area, &self.title, style.text_px(), 1);
        let mut room = note(scene, room, &self.settings, style.small_px(), 2);
        room.y0 += style.px(4.0);
        let gap = style.px(26.0);
        let unit = (room.width() - gap * (WIDTHS.len() - 1) as f64) / WIDTHS.iter().sum::<f64>();
        let mut x = room.x0;
        // Of a chain that met too many topologies to hold them all, some others were sampled.
        let others = self.bars.all_others.unwrap_or(0.0);
        let none_is = if others > 1e-9 { "held" } else { "sampled" };
        for (i, share) in WIDTHS.into_iter().enumerate() {
            let cell = Rect::new(x, room.y0, x + share * unit, room.y1);
            x = cell.x1 + gap;
            match i {
                _ if i < MAPS => match self.topologies.get(i) {
                    Some(map) => map.draw_small(scene, cell, style),
                    None => absent(scene, cell, style, none_is),
                },
                MAPS => self.bars.draw_small(scene, cell, style),
                _ => self.trace.draw(scene, cell, style),
            }
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    /// A height that suits the width: maps about square.
    pub fn natural_height_px(width_px: f64, style: &Style) -> f64 {
        width_px / WIDTHS.iter().sum::<f64>() * 0.97 + style.px(205.0)
    }
}

/// No other topology is sampled, or held.
fn absent(scene: &mut Scene, cell: Rect, style: &Style, none_is: &str) {
    let size = style.small_px();
    let room = cell.inset(1.0, size * 2.7 + 1.0, 1.0, size * 1.5);
    let side = room.width().min(room.height());
    let frame = Rect::new(room.x0, room.y0, room.x0 + side, room.y0 + side);
    scene.frame(frame, GRID, style.thin_px());
    for (row, words) in ["no other", "topology", none_is].into_iter().enumerate() {
        let (x, y) = frame.centre();
        let at = (x, y + (row as f64 - 1.0) * size * text::LEADING_EM);
        scene.label(Label::new(words, at, size).centred().middle().colour(MUTED));
    }
}

impl Figure7Page {
    /// Draws the page into `area`; the rows share its height evenly.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.px(36.0), 2);
        let gap = style.px(60.0);
        let n = self.columns.len();
        let head = |i: usize| area.cell((i, n), (0, 1), gap);
        // Headings of different length must not shift the rows against each other.
        let tops =
            self.columns.iter().enumerate().map(|(i, column)| {
                heading(scene, head(i), &column.heading, style.title_px(), 2).y0
            });
        let top = tops.fold(area.y0, f64::max) + style.px(8.0);
        let rows = self
            .columns
            .iter()
            .map(|column| column.rows.len())
            .max()
            .unwrap_or(0);
        let body = Rect::new(area.x0, top, area.x1, area.y1);
        for (c, column) in self.columns.iter().enumerate() {
            for (r, row) in column.rows.iter().enumerate() {
                let cell = body
                    .cell((c, n), (r, rows), style.px(28.0))
                    .inset(0.0, 0.0, 0.0, 0.0);
                let cell = Rect {
                    x0: head(c).x0,
                    x1: head(c).x1,
                    ..cell
                };
                scene.rule(
                    (cell.x0, cell.y0 - style.px(12.0)),
                    (cell.x1, cell.y0 - style.px(12.0)),
                    QUIET,
                    style.px(1.0),
                );
                if let Some(row) = row {
                    row.draw(scene, cell, style);
                }
            }
        }
    }

    /// The figure alone, as high as its rows need.
    pub fn page(&self, width_px: u32) -> Scene {
        super::page(
            width_px,
            self.natural_height_px(width_px),
            |scene, area, style| self.draw(scene, area, style),
        )
    }

    /// A height that suits the width.
    pub fn natural_height_px(&self, width_px: u32) -> u32 {
        let style = Style::default();
        let n = self.columns.len().max(1) as f64;
        let row_px = Figure7Row::natural_height_px(
            (f64::from(width_px) - 48.0) / n - style.px(60.0),
            &style,
        );
        let rows = self
            .columns
            .iter()
            .map(|column| column.rows.len())
            .max()
            .unwrap_or(0);
        (rows as f64 * (row_px + style.px(28.0)) + style.px(220.0)) as u32
    }
}
