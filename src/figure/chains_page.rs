//! Do the chains on one data set agree? Ranks, topologies and co-clustering on one page.

use super::heat_map::HeatMap;
use super::marks::{self, Symbol};
use super::rank_ecdf::RankEcdfPlot;
use super::scene::{Rect, Scene};
use super::style::{Style, category};
use super::topology_by_chain::TopologyByChain;

/// What the page shows.
#[derive(Clone, Debug)]
pub struct ChainsPage {
    /// Names of the chains, for the legend.
    pub chains: Vec<String>,
    /// Ranks of M and of ln target.
    pub ranks: Vec<RankEcdfPlot>,
    /// Topologies by chain.
    pub topologies: TopologyByChain,
    /// Co-clustering of all chains, and the largest difference between two.
    pub co_clustering: Vec<HeatMap>,
}

impl ChainsPage {
    /// Draws the page into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let entry = |(k, name): (usize, &String)| {
            let line = Symbol::Line(category(k), style.px(8.0), false);
            (line, name.clone())
        };
        let entries: Vec<_> = self.chains.iter().enumerate().map(entry).collect();
        let wide = marks::legend_width_px(self.chains.iter().map(String::as_str), style);
        let gap = style.px(48.0);
        let upper = Rect::new(
            area.x0,
            area.y0,
            area.x1 - wide - gap / 2.0,
            area.y0 + area.height() * 0.46,
        );
        let legend = Rect::new(
            upper.x1 + gap / 2.0,
            area.y0 + style.px(30.0),
            area.x1,
            upper.y1,
        );
        marks::legend(scene, legend, &entries, style);
        let n = self.ranks.len() + 1;
        for (k, ranks) in self.ranks.iter().enumerate() {
            ranks.draw(scene, upper.cell((k, n), (0, 1), gap), style);
        }
        let last = upper.cell((n - 1, n), (0, 1), gap);
        self.topologies.draw(scene, last, style);
        let lower = Rect::new(area.x0, upper.y1 + gap, area.x1, area.y1);
        let n = self.co_clustering.len();
        for (k, map) in self.co_clustering.iter().enumerate() {
            map.draw(scene, lower.cell((k, n), (0, 1), gap), style);
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
