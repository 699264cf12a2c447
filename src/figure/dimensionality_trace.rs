//! The number of sets M against the proposal number, for one or many chains.
//!
//! A long chain has more steps than the page has pixels, so it comes in bins. A bin shows the range
//! from its least to its greatest M as a band and its mean as a line: nothing the chain visited
//! disappears, as it would by thinning. With one step per bin the line is the trace itself.

use super::axes::{Axis, Panel, Scale, heading};
use super::marks::{self, Symbol};
use super::scene::{Label, Point, Rect, Scene};
use super::style::{
    CATEGORIES, Colour, GRID, INK, MUTED, SERIES, Style, category, fade, tick_label,
};
use super::text::{self, Face};

/// M over consecutive proposals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceBin {
    /// Number of the first proposal of the bin; the bin ends where the next begins.
    pub first_step: u64,
    /// Least M in the bin.
    pub min: u32,
    /// Greatest M in the bin.
    pub max: u32,
    /// Mean M in the bin.
    pub mean: f64,
}

/// One chain.
#[derive(Clone, Debug, Default)]
pub struct ChainTrace {
    /// Its name in the legend.
    pub name: String,
    /// Its bins by rising first step.
    pub bins: Vec<TraceBin>,
    /// The step after its last.
    pub end_step: u64,
}

/// What the trace plot shows.
#[derive(Clone, Debug, Default)]
pub struct DimensionalityTrace {
    /// Heading; may be empty.
    pub title: String,
    /// The chains.
    pub chains: Vec<ChainTrace>,
    /// Number of proposals taken as burn-in.
    pub burn_in: Option<u64>,
    /// The true number of sets.
    pub truth: Option<u32>,
    /// Range of the M axis; `None` fits it to the data. Give one to compare plots.
    pub m_range: Option<(u32, u32)>,
}

impl DimensionalityTrace {
    /// Draws the plot into `area`, with a legend if there is room for one.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let mut area = heading(scene, area, &self.title, style.text_px(), 2);
        // Beyond the colours there are, a legend would name two chains alike.
        let named = self.chains.len() <= CATEGORIES.len();
        let colour = |i| {
            if named {
                category(i)
            } else {
                fade(SERIES, 0.35)
            }
        };
        let colours: Vec<Colour> = (0..self.chains.len()).map(colour).collect();
        let entry = |(chain, &colour): (&ChainTrace, &Colour)| {
            (
                Symbol::Line(colour, style.line_px(), false),
                chain.name.clone(),
            )
        };
        let mut entries: Vec<_> = self.chains.iter().zip(&colours).map(entry).collect();
        if !named {
            let words = format!("{} chains", tick_label(self.chains.len() as f64, 1.0));
            entries = vec![(Symbol::Line(SERIES, style.line_px(), false), words)];
        }
        if self.chains.len() > 1 && area.width() > style.px(800.0) {
            let wide = marks::legend_width_px(entries.iter().map(|(_, name)| name.as_str()), style);
            let wide = wide.min(area.width() * 0.3);
            marks::legend(
                scene,
                Rect::new(area.x1 - wide, area.y0 + style.px(34.0), area.x1, area.y1),
                &entries,
                style,
            );
            area = area.inset(0.0, 0.0, wide + style.px(24.0), 0.0);
        }
        let y_name = if area.height() > style.px(420.0) {
            "number of sets M"
        } else {
            "sets M"
        };
        self.draw_panel(scene, area, &colours, ("proposal number", y_name), style);
    }

    /// The figure alone.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    /// Least and greatest M of everything shown.
    pub(super) fn m_extent(&self) -> (u32, u32) {
        let bins = self.chains.iter().flat_map(|chain| &chain.bins);
        let values = bins.flat_map(|bin| [bin.min, bin.max]).chain(self.truth);
        let (low, high) = values.fold((u32::MAX, 0), |(low, high), m| (low.min(m), high.max(m)));
        if low > high { (1, 2) } else { (low, high) }
    }

    /// The axes, without chains; used for measuring as well.
    pub(super) fn axes(&self, (x_name, y_name): (&str, &str)) -> (Axis, Axis) {
        let (low, high) = self.m_range.unwrap_or_else(|| self.m_extent());
        let end = self
            .chains
            .iter()
            .map(|chain| chain.end_step)
            .max()
            .unwrap_or(0)
            .max(1);
        let x = Axis::new(Scale::Integer(0.0, end as f64), x_name);
        let y = Axis::new(
            Scale::Integer(f64::from(low) - 0.5, f64::from(high.max(low + 1)) + 0.5),
            y_name,
        );
        (x, y)
    }

    pub(super) fn draw_panel(
        &self,
        scene: &mut Scene,
        area: Rect,
        colours: &[Colour],
        names: (&str, &str),
        style: &Style,
    ) {
        let (x, y) = self.axes(names);
        self.draw_on_axes(scene, area, colours, &x, &y, style);
    }

    pub(super) fn draw_on_axes(
        &self,
        scene: &mut Scene,
        area: Rect,
        colours: &[Colour],
        x: &Axis,
        y: &Axis,
        style: &Style,
    ) -> Rect {
        let size = style.small_px();
        let truth_px = text::width_px("truth", size, Face::Regular) + style.px(12.0);
        let right = if self.truth.is_some() { truth_px } else { 0.0 };
        let top = if self.burn_in.is_some() {
            size * 1.15
        } else {
            0.0
        };
        let panel = Panel::new(scene, area.inset(0.0, top, right, 0.0), x, y, style);
        let plot = panel.plot;

        let burn_in_x = self
            .burn_in
            .map(|step| panel.at(step as f64, 0.0).0.clamp(plot.x0, plot.x1));
        if let Some(px) = burn_in_x {
            scene.block(Rect::new(plot.x0, plot.y0, px, plot.y1), fade(GRID, 0.55));
        }
        for (chain, &colour) in self.chains.iter().zip(colours) {
            draw_chain(scene, &panel, chain, colour, self.chains.len(), style);
        }
        if let Some(px) = burn_in_x {
            scene.rule((px, plot.y0), (px, plot.y1), MUTED, style.thin_px());
            let words = "burn-in";
            let width = text::width_px(words, size, Face::Regular);
            let x = (px - width).clamp(plot.x0, (plot.x1 - width).max(plot.x0));
            scene.label(
                Label::new(words, (x, plot.y0 - style.px(2.0)), size)
                    .above()
                    .colour(MUTED),
            );
        }
        if let Some(truth) = self.truth {
            let (_, py) = panel.at(0.0, f64::from(truth));
            if (plot.y0..=plot.y1).contains(&py) {
                let dash = (style.px(12.0), style.px(8.0));
                scene.dashed(&[(plot.x0, py), (plot.x1, py)], INK, style.px(2.5), dash);
                scene.label(
                    Label::new("truth", (plot.x1 + style.px(8.0), py), size)
                        .middle()
                        .colour(INK),
                );
            }
        }
        plot
    }
}

fn draw_chain(
    scene: &mut Scene,
    panel: &Panel,
    chain: &ChainTrace,
    colour: Colour,
    n_chains: usize,
    style: &Style,
) {
    let (mut lower, mut upper, mut mean) = (Vec::new(), Vec::new(), Vec::new());
    let ends = chain
        .bins
        .iter()
        .skip(1)
        .map(|bin| bin.first_step)
        .chain([chain.end_step]);
    for (bin, end) in chain.bins.iter().zip(ends) {
        for step in [bin.first_step, end.max(bin.first_step)] {
            let at = |m: f64| -> Point { panel.at(step as f64, m) };
            lower.push(at(f64::from(bin.min)));
            upper.push(at(f64::from(bin.max)));
            mean.push(at(bin.mean));
        }
    }
    if chain.bins.iter().any(|bin| bin.max > bin.min) {
        lower.extend(upper.into_iter().rev());
        let opacity = (0.5 / (n_chains as f64).sqrt()).clamp(0.06, 0.3);
        scene.polygon(lower, fade(colour, opacity));
    }
    let width = if n_chains > 1 {
        style.px(2.0)
    } else {
        style.px(2.5)
    };
    scene.line(mean, colour, width);
}
