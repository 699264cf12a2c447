//! A topometric map with how sure it is: nodes filled by their probability, edges as dark as their
//! support and as wide as they were passed often, detections small beneath.

use super::axes::heading;
use super::marks::{self, Marker, Shape, Symbol};
use super::plan::{self, Bounds, Metres};
use super::scene::{Rect, Scene};
use super::style::{Colour, INK, MUTED, PAPER, Palette, Style, fade};

/// A node.
#[derive(Clone, Debug)]
pub struct MapNode {
    /// Where it is, m.
    pub position_m: Metres,
    /// Of the place, m².
    pub covariance_m2: [[f64; 2]; 2],
    /// From 0 to 1.
    pub probability: f64,
    /// Its detections, m.
    pub members_m: Vec<Metres>,
}

/// An edge.
#[derive(Clone, Copy, Debug)]
pub struct SupportedEdge {
    /// One node.
    pub first: usize,
    /// The other.
    pub second: usize,
    /// How often it was passed.
    pub weight: usize,
    /// From 0 to 1.
    pub support: f64,
}

/// What the figure shows.
#[derive(Clone, Debug, Default)]
pub struct PosteriorMapFigure {
    /// Heading.
    pub title: String,
    /// Closed polygons; may be empty.
    pub walls_m: Vec<Vec<Metres>>,
    /// Nodes.
    pub nodes: Vec<MapNode>,
    /// Edges between them.
    pub edges: Vec<SupportedEdge>,
}

/// Ellipses at this many standard deviations.
const ELLIPSE_SIGMAS: f64 = 2.0;
/// Probabilities in the legend.
const SHOWN: [f64; 4] = [1.0, 0.75, 0.5, 0.25];

/// Dark for sure.
pub(super) fn colour_of(probability: f64) -> Colour {
    Palette::Viridis.at(1.0 - probability.clamp(0.0, 1.0))
}

pub(super) fn node_marker(probability: f64) -> Marker {
    Marker {
        shape: Shape::Circle,
        fill: colour_of(probability),
        outline: PAPER,
    }
}

impl PosteriorMapFigure {
    /// Draws the map with axes in metres.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 3);
        let entries = self.legend(style);
        let members = self.nodes.iter().flat_map(|node| &node.members_m);
        let places = self.nodes.iter().map(|node| &node.position_m);
        let shown = self.walls_m.iter().flatten().chain(members).chain(places);
        let panel = plan::with_legend(scene, area, Bounds::of(shown.copied()), &entries, style);
        plan::walls(scene, &panel, &self.walls_m, style.px(3.5));
        let crowd = (40.0 / self.nodes.len().max(1) as f64)
            .powf(0.4)
            .clamp(0.3, 1.0);
        let at = |[x, y]: Metres| panel.at(x, y);
        for edge in &self.edges {
            let ends = [edge.first, edge.second].map(|id| at(self.nodes[id].position_m));
            let width = style.px(2.0 + 2.0 * edge.weight.min(6) as f64) * crowd;
            scene.line(ends.to_vec(), fade(INK, 0.08 + 0.5 * edge.support), width);
        }
        for node in &self.nodes {
            let [x, y] = node.position_m;
            for &member in &node.members_m {
                let line = vec![at(node.position_m), at(member)];
                scene.line(line, fade(MUTED, 0.7), style.px(1.5));
                scene.disc(at(member), style.px(4.5) * crowd.max(0.6), MUTED);
            }
            let outline = marks::ellipse((x, y), node.covariance_m2, ELLIPSE_SIGMAS, 60);
            let outline: Vec<_> = outline.into_iter().map(|(x, y)| panel.at(x, y)).collect();
            scene.line(outline, colour_of(node.probability), style.thin_px());
        }
        for node in &self.nodes {
            let marker = node_marker(node.probability);
            marker.draw(
                scene,
                at(node.position_m),
                style.px(11.0) * crowd,
                style.px(2.0),
            );
        }
    }

    fn legend(&self, style: &Style) -> Vec<(Symbol, String)> {
        let mut entries: Vec<(Symbol, String)> = SHOWN
            .iter()
            .map(|&p| {
                (
                    Symbol::Marker(node_marker(p)),
                    format!("node, {:.0} % sure", 100.0 * p),
                )
            })
            .collect();
        let sigmas = format!("{ELLIPSE_SIGMAS}σ ellipse of\nits place, given\nthe set");
        entries.push((Symbol::Ellipse(colour_of(1.0)), sigmas));
        let detection = Marker {
            shape: Shape::Circle,
            fill: MUTED,
            outline: MUTED,
        };
        entries.push((Symbol::Marker(detection), "detection".to_owned()));
        for (support, words) in [(1.0, "edge in all draws"), (0.25, "in a quarter of them")] {
            let line = Symbol::Line(fade(INK, 0.08 + 0.5 * support), style.px(4.0), false);
            entries.push((line, words.to_owned()));
        }
        if !self.walls_m.is_empty() {
            entries.push((Symbol::Line(INK, style.px(3.5), false), "wall".to_owned()));
        }
        entries
    }

    /// The figure alone, on a page of at most this size, cut to the proportions of the map.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::cut_page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
