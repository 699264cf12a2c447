//! Chains of partitions on one page: M draw by draw, the topologies drawn most, and which pairs of
//! items share a set.

use super::axes::{heading, note};
use super::dimensionality_trace::DimensionalityTrace;
use super::pair_matrix::PairMatrix;
use super::scene::{Rect, Scene};
use super::style::{CATEGORIES, Colour, SERIES, Style, category, fade};
use super::topology_bars::TopologyBars;

/// What the page shows.
#[derive(Clone, Debug, Default)]
pub struct DiagnosisPage {
    /// Heading.
    pub title: String,
    /// The verdict, in a sentence.
    pub verdict: String,
    /// M, draw by draw.
    pub trace: DimensionalityTrace,
    /// The topologies drawn most.
    pub bars: TopologyBars,
    /// Pairs; none where there are too many items.
    pub pairs: Option<PairMatrix>,
}

/// The share of the width that traces and bars take beside a matrix.
const LEFT: f64 = 0.56;

impl DiagnosisPage {
    /// Draws the page into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let room = heading(scene, area, &self.title, style.title_px(), 2);
        let mut room = note(scene, room, &self.verdict, style.text_px(), 3);
        room.y0 += style.gap_px();
        let left = match &self.pairs {
            Some(pairs) => {
                let x = room.x0 + LEFT * room.width();
                let right = Rect::new(x + style.gap_px(), room.y0, room.x1, room.y1);
                pairs.draw(scene, right, style);
                Rect::new(room.x0, room.y0, x - style.gap_px(), room.y1)
            }
            None => room,
        };
        let y = left.y0 + 0.55 * left.height();
        let top = Rect::new(left.x0, left.y0, left.x1, y - style.gap_px() / 2.0);
        let n_chains = self.trace.chains.len();
        let colour = |k: usize| {
            if n_chains <= CATEGORIES.len() {
                category(k)
            } else {
                fade(SERIES, 0.35)
            }
        };
        let colours: Vec<Colour> = (0..n_chains).map(colour).collect();
        let top = heading(scene, top, &self.trace.title, style.text_px(), 1);
        let names = ("draw number", "number of sets M");
        self.trace.draw_panel(scene, top, &colours, names, style);
        let bottom = Rect::new(left.x0, y + style.gap_px() / 2.0, left.x1, left.y1);
        self.bars.draw(scene, bottom, style);
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style);
        })
    }
}
