//! Does the start matter: one panel of overlaid dimensionality traces per initial topology.

use super::axes::heading;
use super::dimensionality_trace::{ChainTrace, DimensionalityTrace};
use super::grid;
use super::scene::{Label, Rect, Scene};
use super::style::{CATEGORIES, Colour, MUTED, SERIES, Style, category, fade, tick_label};
use super::text::{self, Face};

/// The chains that began at one topology.
#[derive(Clone, Debug, Default)]
pub struct InitTraces {
    /// Name of the initial topology.
    pub name: String,
    /// Its chains.
    pub chains: Vec<ChainTrace>,
    /// Number of proposals taken as burn-in; `None` if some chain never settled.
    pub burn_in: Option<u64>,
}

/// What the figure shows.
#[derive(Clone, Debug, Default)]
pub struct TracesByInit {
    /// Heading; may be empty.
    pub title: String,
    /// One panel each.
    pub inits: Vec<InitTraces>,
    /// The true number of sets.
    pub truth: Option<u32>,
}

impl TracesByInit {
    /// Draws all panels with the same axes into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let all = DimensionalityTrace {
            chains: self
                .inits
                .iter()
                .flat_map(|init| init.chains.clone())
                .collect(),
            truth: self.truth,
            ..DimensionalityTrace::default()
        };
        let m_range = Some(all.m_extent());
        // Every panel takes the longest chain's axis; an empty panel too.
        let (x, y) = all.axes(("proposal number", "number of sets M"));
        let n = self.inits.len();
        let head_px = style.text_px() * 1.5;
        let axes = |_: usize| (x.clone(), y.clone());
        for (init, (room, first)) in self.inits.iter().zip(grid::place(
            area,
            n,
            grid::columns_for(n),
            head_px,
            axes,
            style,
        )) {
            let trace = DimensionalityTrace {
                title: String::new(),
                chains: init.chains.clone(),
                burn_in: init.burn_in,
                truth: self.truth,
                m_range,
            };
            let n_chains = init.chains.len();
            let opacity = (2.0 / n_chains.max(1) as f64).sqrt().clamp(0.15, 0.9);
            // Few chains can be told apart by colour; of many only the crowd is seen.
            let colours: Vec<Colour> = if n_chains <= CATEGORIES.len() {
                (0..n_chains).map(|k| fade(category(k), 0.9)).collect()
            } else {
                vec![fade(SERIES, opacity); n_chains]
            };
            let mut y = y.clone();
            y.written = first;
            let plot = trace.draw_on_axes(scene, room, &colours, &x, &y, style);
            let count = tick_label(init.chains.len() as f64, 1.0);
            let words = if init.chains.len() == 1 {
                "1 chain".to_owned()
            } else {
                format!("{count} chains")
            };
            let (size, small) = (style.text_px(), style.small_px());
            let at = room.y0 - head_px;
            let count_px = text::width_px(&words, small, Face::Regular);
            let left = plot.x0;
            let name = text::shorten(
                &init.name,
                room.x1 - left - count_px - size,
                size,
                Face::Bold,
            );
            let count_x = left + text::width_px(&name, size, Face::Bold) + style.px(14.0);
            scene.label(Label::new(name, (left, at), size).bold());
            scene.label(
                Label::new(
                    words,
                    (count_x, at + (size - small) * text::ASCENT_EM),
                    small,
                )
                .colour(MUTED),
            );
        }
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }
}
