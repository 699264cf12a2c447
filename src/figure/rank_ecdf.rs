//! Where each chain's draws lie among those of all chains: differences of ECDFs against the rank.
//!
//! Each chain is a line about 0; the band, where one is known, holds 95 % of sets of converged chains
//! wholly. Lines that leave it belong to chains that disagree with the others.

use super::axes::{Axis, Panel, Scale, heading};
use super::scene::{Label, Rect, Scene};
use super::style::{GRID, INK, MUTED, Style, category, fade};

/// One chain.
#[derive(Clone, Debug, Default)]
pub struct RankLine {
    /// Normalised rank and difference.
    pub points: Vec<(f64, f64)>,
    /// Half the height of its band.
    pub band: Option<f64>,
}

/// What the plot shows.
#[derive(Clone, Debug, Default)]
pub struct RankEcdfPlot {
    /// Heading.
    pub title: String,
    /// The chains; none where nothing can be ranked.
    pub chains: Vec<RankLine>,
    /// A note under the heading: what is missing and why.
    pub note: String,
}

impl RankEcdfPlot {
    /// Draws the plot into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        let area = super::axes::note(scene, area, &self.note, style.small_px(), 2);
        let reach = |chain: &RankLine| {
            let largest = chain
                .points
                .iter()
                .map(|(_, y)| y.abs())
                .fold(0.0, f64::max);
            largest.max(chain.band.unwrap_or(0.0))
        };
        let highest = self.chains.iter().map(reach).fold(0.02, f64::max) * 1.08;
        let x = Axis::new(Scale::Share(0.0, 1.0), "rank among the draws of all chains");
        let y = Axis::new(
            Scale::Continuous(-highest, highest),
            "ECDF of the chain − of all",
        );
        let panel = Panel::new(scene, area, &x, &y, style);
        // The widest band, of the chain with the fewest effective draws, over which none is judged.
        let bands = self.chains.iter().filter_map(|chain| chain.band);
        if let Some(band) = bands.reduce(f64::max) {
            let (x0, y0) = panel.at(0.0, band);
            let (x1, y1) = panel.at(1.0, -band);
            scene.block(Rect::new(x0, y0, x1, y1), fade(GRID, 0.6));
            for y in [y0, y1] {
                scene.rule((x0, y), (x1, y), MUTED, style.px(1.0));
            }
        }
        scene.rule(panel.at(0.0, 0.0), panel.at(1.0, 0.0), INK, style.px(1.0));
        for (k, chain) in self.chains.iter().enumerate() {
            let points = chain.points.iter().map(|&(x, y)| panel.at(x, y)).collect();
            scene.line(points, category(k), style.px(2.5));
        }
        if self.chains.is_empty() {
            // Clear of the line of no difference, which runs through the middle.
            let (x, y) = panel.plot.centre();
            let place = (x, y - 0.5 * style.small_px());
            let label = Label::new("nothing to rank", place, style.small_px());
            scene.label(label.centred().above().colour(MUTED));
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
