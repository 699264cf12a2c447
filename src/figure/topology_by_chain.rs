//! How often each chain sampled each of the topologies that all chains together sampled most.

use super::axes::{Axis, Panel, Scale, heading};
use super::scene::{Rect, Scene};
use super::style::{Style, category};

/// One topology, or all others.
#[derive(Clone, Debug)]
pub struct TopologyGroup {
    /// Its name under the bars, as in "#1".
    pub label: String,
    /// Whether it is the truth.
    pub is_truth: bool,
    /// Its share in each chain.
    pub shares: Vec<f64>,
}

/// What the bars show.
#[derive(Clone, Debug, Default)]
pub struct TopologyByChain {
    /// Heading.
    pub title: String,
    /// The topologies.
    pub groups: Vec<TopologyGroup>,
}

impl TopologyByChain {
    /// Draws the bars into `area`, a colour for each chain.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        let names = self.groups.iter().map(|group| {
            let truth = if group.is_truth { "\ntruth" } else { "" };
            format!("{}{truth}", group.label)
        });
        let x = Axis::new(Scale::Categories(names.collect()), "");
        let tallest = (self.groups.iter().flat_map(|group| &group.shares))
            .copied()
            .fold(0.0, f64::max);
        let y = Axis::new(
            Scale::Share(0.0, (tallest * 1.08).clamp(1e-6, 1.0)),
            "share of the chain’s draws",
        );
        let panel = Panel::new(scene, area, &x, &y, style);
        for (i, group) in self.groups.iter().enumerate() {
            let n = group.shares.len().max(1) as f64;
            for (k, &share) in group.shares.iter().enumerate() {
                let left = i as f64 - 0.4 + 0.8 * k as f64 / n;
                let (x0, y0) = panel.at(left, share);
                let (x1, y1) = panel.at(left + 0.8 / n, 0.0);
                // A share of nothing is drawn too, as a line on the axis.
                let y0 = y0.min(y1 - style.px(2.0));
                scene.block(Rect::new(x0, y0, x1, y1), category(k));
            }
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
