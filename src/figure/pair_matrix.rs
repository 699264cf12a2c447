//! How probable it is that two items share a set: a square matrix, its items in the order of the
//! sets of one partition, which are framed.

use super::axes::heading;
use super::heat_map::HeatMap;
use super::scene::{Label, Rect, Scene};
use super::style::{ACCENT, INK, MUTED, Palette, Style};

/// Rows and columns that are drawn at most; of more items a square shows the mean of its pairs.
const MOST: usize = 120;
/// Colours told apart: so neighbours that look alike are one mark.
const STEPS: f64 = 64.0;

/// What the matrix shows.
#[derive(Clone, Debug, Default)]
pub struct PairMatrix {
    /// Heading; may be empty.
    pub title: String,
    /// N×N, items in the order of the sets.
    pub probabilities: Vec<Vec<f64>>,
    /// Sizes of the sets, in the same order.
    pub set_sizes: Vec<usize>,
}

impl PairMatrix {
    /// Draws the matrix, as large a square as fits, and its key into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        let foot_px = style.small_px() * 2.2;
        let key_px = style.px(190.0);
        let side = (area.width() - key_px).min(area.height() - foot_px);
        let plot = Rect::new(area.x0, area.y0, area.x0 + side, area.y0 + side);
        let n = self.probabilities.len();
        let shown = n.min(MOST);
        for row in 0..shown {
            self.draw_row(scene, plot, (row, shown), n);
        }
        self.draw_sets(scene, plot, n, style);
        scene.frame(plot, INK, style.thin_px());
        let words = format!("{n} items, in the order of the framed sets (VI estimate)");
        let at = (plot.x0, plot.y1 + style.small_px() * 0.6);
        scene.label(Label::new(words, at, style.small_px()).colour(MUTED));
        let bar = Rect::new(plot.x1 + style.px(28.0), plot.y0, area.x1, plot.y1);
        key().draw_colour_bar(scene, bar, style);
    }

    /// One row, neighbours of one colour as one mark.
    fn draw_row(&self, scene: &mut Scene, plot: Rect, (row, shown): (usize, usize), n: usize) {
        let step = plot.width() / shown as f64;
        let items = |k: usize| k * n / shown..(k + 1) * n / shown;
        let mean = |column: usize| {
            let rows = items(row).map(|i| self.probabilities[i][items(column)].iter().sum::<f64>());
            let count = items(row).len() * items(column).len();
            (rows.sum::<f64>() / count as f64 * STEPS).round()
        };
        let mut start = 0;
        for column in 1..=shown {
            let value = mean(start);
            if column == shown || mean(column) != value {
                let (x0, x1) = (
                    plot.x0 + start as f64 * step,
                    plot.x0 + column as f64 * step,
                );
                let y0 = plot.y0 + row as f64 * step;
                let cell = Rect::new(x0, y0, x1, y0 + step);
                scene.block(cell, Palette::Cividis.at(value / STEPS));
                start = column;
            }
        }
    }

    fn draw_sets(&self, scene: &mut Scene, plot: Rect, n: usize, style: &Style) {
        let scale = plot.width() / n.max(1) as f64;
        let mut first = 0;
        for &size in &self.set_sizes {
            let (low, high) = (first as f64 * scale, (first + size) as f64 * scale);
            // Smaller ones would be nothing but frame.
            if high - low > style.px(6.0) {
                let square =
                    Rect::new(plot.x0 + low, plot.y0 + low, plot.x0 + high, plot.y0 + high);
                scene.frame(square, ACCENT, style.px(2.5));
            }
            first += size;
        }
    }
}

/// What the colours mean.
fn key() -> HeatMap {
    HeatMap {
        title: String::new(),
        row_factors: Vec::new(),
        column_factors: Vec::new(),
        values: Vec::new(),
        texts: Vec::new(),
        value_name: "probability of one set".to_owned(),
        range: (0.0, 1.0),
        percent: true,
        is_log: false,
        palette: Palette::Cividis,
        categories: Vec::new(),
        parts: Vec::new(),
        ..HeatMap::default()
    }
}
