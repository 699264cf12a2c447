//! Figures: ready numbers in, an image out; the only room that knows plotters.
//!
//! Each figure is a plain struct of the numbers to show with two methods: `draw` adds it to a
//! rectangle of a [`scene::Scene`], so that figures compose into pages, and `page` puts it on one of its own,
//! which becomes a PNG or an SVG.
//! No statistics are computed and no files are read here. [`style`] holds sizes and colours,
//! [`axes`] the frames, [`backend`] the raster page, [`svg`] the vector page.

pub mod axes;
pub mod backend;
pub mod chains_page;
pub mod diagnosis;
pub mod dimensionality_trace;
pub mod effects;
pub mod factor_indices;
pub mod figure7;
pub mod geometry;
pub mod grid;
mod heat_key;
pub mod heat_map;
pub mod label;
pub mod marks;
pub mod mission_map;
pub mod nested_loop;
pub mod pair_matrix;
pub mod plan;
pub mod plane;
pub mod posterior_map;
pub mod rank_ecdf;
pub mod reliability;
pub mod response_curves;
pub mod scaling;
pub mod scatter;
pub mod scene;
pub mod small_multiples;
pub mod style;
pub mod svg;
pub mod text;
pub mod topology_bars;
pub mod topology_by_chain;
pub mod topology_map;
pub mod traces_by_init;
pub mod world_map;

#[cfg(test)]
mod tests;

use scene::{Rect, Scene};
use style::Style;

const MARGIN_PX: f64 = 24.0;

/// A page of at most the given size, cut to its content: maps keep the proportions of the world.
fn cut_page(width_px: u32, height_px: u32, draw: impl FnOnce(&mut Scene, Rect, &Style)) -> Scene {
    let mut scene = page(width_px, height_px, draw);
    scene.trim(MARGIN_PX);
    scene
}

/// A page of the given size with one figure inside a margin.
fn page(width_px: u32, height_px: u32, draw: impl FnOnce(&mut Scene, Rect, &Style)) -> Scene {
    let mut scene = Scene::new(width_px, height_px);
    let style = Style::default();
    let area = scene
        .area()
        .inset(MARGIN_PX, MARGIN_PX, MARGIN_PX, MARGIN_PX);
    draw(&mut scene, area, &style);
    scene
}
