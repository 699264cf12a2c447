//! How often pairs said to be of one landmark with probability p are: share against p.
//!
//! On the diagonal the probabilities are right. The bar about each point's p is where its share lies
//! if they are, by a bootstrap over windows; a point outside is filled in the colour of a warning, one of too few
//! windows for a bar is hollow.

use super::axes::{Axis, Panel, Scale, heading, note};
use super::marks::{Marker, Shape};
use super::scene::{Label, Rect, Scene};
use super::style::{ACCENT, GRID, MUTED, PAPER, SERIES, Style, fade};

/// Pairs of about the same probability.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReliabilityPoint {
    /// Mean probability.
    pub probability: f64,
    /// Share that is of one landmark.
    pub share: f64,
    /// Where the share lies 95 times in 100 if the probabilities are right.
    pub band: Option<(f64, f64)>,
    /// Pairs.
    pub n_pairs: usize,
}

/// One set of probabilities.
#[derive(Clone, Debug, Default)]
pub struct ReliabilityPanel {
    /// Heading.
    pub title: String,
    /// A line under it.
    pub note: String,
    /// By rising probability.
    pub points: Vec<ReliabilityPoint>,
}

/// Panels side by side.
#[derive(Clone, Debug, Default)]
pub struct ReliabilityPlot {
    /// One or two.
    pub panels: Vec<ReliabilityPanel>,
}

impl ReliabilityPlot {
    /// Draws the panels into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let gap = style.px(50.0);
        let n = self.panels.len().max(1) as f64;
        let wide = (area.width() - gap * (n - 1.0)) / n;
        for (k, panel) in self.panels.iter().enumerate() {
            let x0 = area.x0 + k as f64 * (wide + gap);
            panel.draw(scene, Rect::new(x0, area.y0, x0 + wide, area.y1), style);
        }
    }

    /// The figure alone, on a page of this size.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}

impl ReliabilityPanel {
    fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        let area = note(scene, area, &self.note, style.small_px(), 3);
        let axis = |name: &str| Axis::new(Scale::Share(0.0, 1.0), name);
        let x = axis("probability that a pair is of one landmark");
        let y = axis("share that is");
        let panel = Panel::new(scene, area, &x, &y, style);
        scene.line(
            vec![panel.at(0.0, 0.0), panel.at(1.0, 1.0)],
            MUTED,
            style.px(2.0),
        );
        let half = style.px(13.0);
        for point in &self.points {
            if let Some((low, high)) = point.band {
                let (x, y0) = panel.at(point.probability, high);
                let (_, y1) = panel.at(point.probability, low);
                let bar = Rect::new(x - half, y0.min(y1 - 1.0), x + half, y1);
                scene.block(bar, fade(GRID, 1.0));
            }
        }
        for point in &self.points {
            let is_inside = point
                .band
                .map(|(low, high)| (low..=high).contains(&point.share));
            let (fill, outline) = match is_inside {
                Some(true) => (SERIES, PAPER),
                Some(false) => (ACCENT, PAPER),
                None => (PAPER, SERIES),
            };
            let shape = Shape::Circle;
            let at = panel.at(point.probability, point.share);
            let marker = Marker {
                shape,
                fill,
                outline,
            };
            marker.draw(scene, at, style.px(9.0), style.px(2.0));
            let size = style.small_px();
            // Below the point in the upper half, above it in the lower: never off the plot.
            let down = if point.share > 0.5 { 1.9 } else { -1.1 };
            let label = Label::new(point.n_pairs.to_string(), (at.0, at.1 + down * size), size);
            scene.label(label.centred().middle().colour(MUTED));
        }
    }
}
