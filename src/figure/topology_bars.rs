//! How often the most sampled topologies were sampled, and all others together.

use super::axes::{Axis, Panel, Scale, heading};
use super::scene::{Label, Rect, Scene};
use super::style::{MUTED, QUIET, SERIES, Style, TRUTH, percent, percent_short};
use super::text::{self, Face};

/// One topology.
#[derive(Clone, Debug)]
pub struct TopologyBar {
    /// Its name under the bar, for example "#1".
    pub label: String,
    /// Its share of the samples.
    pub frequency: f64,
    /// Whether it is the truth.
    pub is_truth: bool,
}

/// What the histogram shows.
#[derive(Clone, Debug, Default)]
pub struct TopologyBars {
    /// Heading; may be empty.
    pub title: String,
    /// The most sampled topologies, by falling frequency.
    pub bars: Vec<TopologyBar>,
    /// The share of all other topologies; `None` leaves the bar out.
    pub all_others: Option<f64>,
    /// Top of the axis; `None` fits it to the highest bar. Give 1 to compare histograms.
    pub highest: Option<f64>,
}

impl TopologyBars {
    /// Draws the histogram into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 2);
        self.draw_bars(scene, area, true, style);
    }

    /// Draws the histogram small: the values over the bars stand for the axis.
    pub fn draw_small(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let size = style.small_px();
        let name = Label::new("share of samples", (area.x0, area.y0), size);
        scene.label(name.colour(MUTED));
        self.draw_bars(scene, area.inset(0.0, size * 1.5, 0.0, 0.0), false, style);
    }

    fn draw_bars(&self, scene: &mut Scene, area: Rect, with_axis: bool, style: &Style) {
        let mut bars: Vec<(String, f64, _)> = Vec::new();
        for bar in &self.bars {
            let truth = if bar.is_truth { "\ntruth" } else { "" };
            bars.push((
                format!("{}{truth}", bar.label),
                bar.frequency,
                if bar.is_truth { TRUTH } else { SERIES },
            ));
        }
        bars.extend(
            self.all_others
                .map(|share| ("all others".to_owned(), share, QUIET)),
        );

        let tallest = bars.iter().map(|&(_, share, _)| share).fold(0.0, f64::max);
        let top = self.highest.unwrap_or(tallest).max(1e-6);
        // Room above the tallest bar for its value.
        let mut y = Axis::new(Scale::Share(0.0, top * 1.12), "share of samples");
        let x = Axis::new(
            Scale::Categories(bars.iter().map(|(label, ..)| label.clone()).collect()),
            "",
        );
        y.written = with_axis;
        if !with_axis {
            // Ticks without numbers would say nothing.
            y.most_ticks = Some(1);
        }
        let panel = Panel::new(scene, area, &x, &y, style);
        let slot = panel.plot.width() / bars.len().max(1) as f64;
        for (i, (_, share, colour)) in bars.iter().enumerate() {
            let (x0, y0) = panel.at(i as f64 - 0.36, *share);
            let (x1, y1) = panel.at(i as f64 + 0.36, 0.0);
            scene.block(Rect::new(x0, y0, x1, y1), *colour);
            let value = if with_axis {
                percent(*share)
            } else {
                percent_short(*share)
            };
            // A value wider than its slot would run into its neighbour.
            let size = style.small_px();
            let size = size
                .min(size * (slot - style.px(4.0)) / text::width_px(&value, size, Face::Regular));
            scene.label(
                Label::new(value, ((x0 + x1) / 2.0, y0 - style.px(3.0)), size)
                    .centred()
                    .above(),
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
