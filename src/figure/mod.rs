//! Figures: ready numbers in, an image out; the only room that knows plotters.
//!
//! Each figure is a plain struct of the numbers to show with two methods: `draw` adds it to a
//! rectangle of a [`scene::Scene`], so that figures compose into pages, and `png` renders it alone.
//! No statistics are computed and no files are read here. [`style`] holds sizes and colours,
//! [`axes`] the frames, [`backend`] the raster page.

pub mod axes;
pub mod backend;
pub mod dimensionality_trace;
pub mod effects;
pub mod figure7;
pub mod grid;
pub mod heat_map;
pub mod marks;
pub mod plan;
pub mod scene;
pub mod style;
pub mod text;
pub mod topology_bars;
pub mod topology_map;
pub mod traces_by_init;
pub mod world_map;

#[cfg(test)]
mod tests;

use scene::{Rect, Scene};
use style::Style;

/// A page of the given size with one figure inside a margin.
fn page(width_px: u32, height_px: u32, draw: impl FnOnce(&mut Scene, Rect, &Style)) -> Scene {
    let mut scene = Scene::new(width_px, height_px);
    let style = Style::default();
    let margin = style.px(24.0);
    let area = scene.area().inset(margin, margin, margin, margin);
    draw(&mut scene, area, &style);
    scene
}
