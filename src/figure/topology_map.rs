//! One topology over the world: detections coloured by set, sets joined to their node, and the
//! edges of the map between nodes.

use super::axes::{Panel, heading};
use super::marks::{self, Marker, Shape, Symbol};
use super::plan::{self, Bounds, Metres};
use super::scene::{Rect, Scene};
use super::style::{INK, PAPER, QUIET, Style, category, fade, percent};

/// An edge of the topological map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapEdge {
    /// One set.
    pub from_set: usize,
    /// The other set.
    pub to_set: usize,
    /// How often the mission passed between them.
    pub multiplicity: usize,
}

/// What the map shows.
#[derive(Clone, Debug, Default)]
pub struct TopologyMap {
    /// Heading, for example from [`topology_title`].
    pub title: String,
    /// Closed polygons; may be empty.
    pub walls_m: Vec<Vec<Metres>>,
    /// Detections in mission order.
    pub detections_m: Vec<Metres>,
    /// The set of each detection.
    pub labels: Vec<usize>,
    /// The node of each set.
    pub nodes_m: Vec<Metres>,
    /// Edges between sets; may be empty.
    pub edges: Vec<MapEdge>,
}

/// "#1 · 42.3 % · M = 8 · ✓ truth", leaving out what is not known.
pub fn topology_title(
    rank: usize,
    frequency: Option<f64>,
    n_sets: usize,
    is_truth: bool,
) -> String {
    let mut parts = vec![format!("#{rank}")];
    parts.extend(frequency.map(percent));
    parts.push(format!("M = {n_sets}"));
    if is_truth {
        parts.push("✓ truth".to_owned());
    }
    // No break inside "42.3 %", "M = 8" or "✓ truth".
    parts
        .iter()
        .map(|part| part.replace(' ', "\u{a0}"))
        .collect::<Vec<_>>()
        .join(" · ")
}

impl TopologyMap {
    /// Draws the map with axes in metres.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        let entries = self.legend(style);
        let panel = plan::with_legend(scene, area, self.bounds(), &entries, style);
        self.draw_topology(scene, &panel, style);
    }

    /// Draws the map small: no axes but a scale bar, two lines reserved for the heading.
    pub fn draw_small(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let size = style.small_px();
        heading(scene, area, &self.title, size, 2);
        let room = area.inset(0.0, size * 2.7, 0.0, 0.0);
        let panel = plan::with_scale_bar(scene, room, self.bounds(), style);
        self.draw_topology(scene, &panel, style);
    }

    /// The figure alone, of at most this size, cut to the proportions of the map.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::cut_page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn legend(&self, style: &Style) -> Vec<(Symbol, String)> {
        let round = |fill, outline| {
            Symbol::Marker(Marker {
                shape: Shape::Circle,
                fill,
                outline,
            })
        };
        let mut entries = vec![
            (
                round(category(0), PAPER),
                "detection, colour\nand shape by set".to_owned(),
            ),
            (round(PAPER, category(0)), "a set of one".to_owned()),
            (Symbol::Node, "node: mean of its set".to_owned()),
        ];
        if !self.edges.is_empty() {
            let edge = Symbol::Line(QUIET, style.px(5.0), false);
            entries.push((
                edge,
                "edge of the map, wider\nif passed more often".to_owned(),
            ));
        }
        if !self.walls_m.is_empty() {
            entries.push((Symbol::Line(INK, style.px(3.5), false), "wall".to_owned()));
        }
        entries
    }

    fn bounds(&self) -> Bounds {
        let shown = self
            .walls_m
            .iter()
            .flatten()
            .chain(&self.detections_m)
            .chain(&self.nodes_m);
        Bounds::of(shown.copied())
    }

    fn draw_topology(&self, scene: &mut Scene, panel: &Panel, style: &Style) {
        // Everything on a small map is a little smaller.
        let small =
            (panel.plot.width().min(panel.plot.height()) / style.px(700.0)).clamp(0.55, 1.0);
        let crowd = (80.0 / self.detections_m.len().max(1) as f64)
            .powf(0.4)
            .clamp(0.25, 1.0);
        let finite = |p: &&Metres| p.iter().all(|v| v.is_finite());
        let node = |set: usize| {
            self.nodes_m
                .get(set)
                .filter(finite)
                .map(|&[x, y]| panel.at(x, y))
        };
        for edge in &self.edges {
            if let (Some(from), Some(to)) = (node(edge.from_set), node(edge.to_set)) {
                let width = style.px(3.0 + 2.5 * (edge.multiplicity.clamp(1, 6) as f64 - 1.0))
                    * small
                    * crowd.sqrt();
                scene.line(vec![from, to], QUIET, width);
            }
        }
        plan::walls(scene, panel, &self.walls_m, style.px(3.5) * small);

        let mut members = vec![
            0usize;
            self.nodes_m
                .len()
                .max(self.labels.iter().map(|&set| set + 1).max().unwrap_or(0))
        ];
        for &set in &self.labels {
            members[set] += 1;
        }
        let radius = style.px(11.0) * small * crowd;
        let placed: Vec<_> = self
            .detections_m
            .iter()
            .zip(&self.labels)
            .filter(|(position, _)| finite(position))
            .map(|(&[x, y], &set)| (panel.at(x, y), set))
            .collect();
        for &(at, set) in placed.iter().filter(|(_, set)| members[*set] > 1) {
            if let Some(node) = node(set) {
                scene.line(
                    vec![at, node],
                    fade(category(set), 0.9),
                    style.px(3.0) * small * crowd.sqrt(),
                );
            }
        }
        for &(at, set) in &placed {
            let single = members[set] == 1;
            let outline_px = style.px(if single { 3.5 } else { 1.5 }) * small * crowd.sqrt();
            Marker::of_set(set, single).draw(scene, at, radius, outline_px);
        }
        for set in (0..self.nodes_m.len()).filter(|&set| members[set] > 1) {
            if let Some(at) = node(set) {
                marks::node(scene, at, radius);
            }
        }
    }
}
