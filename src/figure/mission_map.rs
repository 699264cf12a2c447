//! A solved mission: the way that was driven and the one that odometry tells, landmarks by how sure
//! they are, and what is in doubt.

use super::axes::heading;
use super::marks::{self, Symbol};
use super::plan::{self, Bounds, Metres};
use super::posterior_map::{colour_of, node_marker};
use super::scene::{Rect, Scene};
use super::style::{CATEGORIES, Colour, MUTED, Style, fade};

/// A landmark.
#[derive(Clone, Copy, Debug)]
pub struct MissionLandmark {
    /// Where it is, m.
    pub position_m: Metres,
    /// Of the place, m².
    pub covariance_m2: [[f64; 2]; 2],
    /// From 0 to 1.
    pub probability: f64,
}

/// What the figure shows.
#[derive(Clone, Debug, Default)]
pub struct MissionMap {
    /// Heading.
    pub title: String,
    /// The way by odometry alone, m.
    pub reckoned_m: Vec<Metres>,
    /// The way that was found, m.
    pub driven_m: Vec<Metres>,
    /// The landmarks.
    pub landmarks: Vec<MissionLandmark>,
    /// Sightings whose landmark is in doubt: where each lies, and its landmark, m.
    pub doubtful_m: Vec<[Metres; 2]>,
    /// Where a residual is larger than the noise explains, m.
    pub misfits_m: Vec<Metres>,
}

/// Ellipses at this many standard deviations.
const ELLIPSE_SIGMAS: f64 = 2.0;
/// Probabilities in the legend.
const SHOWN: [f64; 3] = [1.0, 0.5, 0.0];
const DRIVEN: Colour = CATEGORIES[0];
const DOUBTFUL: Colour = CATEGORIES[5];
const MISFIT: Colour = CATEGORIES[3];

impl MissionMap {
    /// Draws the map with axes in metres, as large as the way that was found and the landmarks.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.text_px(), 3);
        let entries = self.legend(style);
        let corners = self.landmarks.iter().flat_map(|one| {
            let [x, y] = one.position_m;
            let reach = [0, 1].map(|k| ELLIPSE_SIGMAS * one.covariance_m2[k][k].sqrt());
            [[x - reach[0], y - reach[1]], [x + reach[0], y + reach[1]]]
        });
        let bounds = Bounds::of(self.driven_m.iter().copied().chain(corners));
        let panel = plan::with_legend(scene, area, bounds, &entries, style);
        let at = |[x, y]: Metres| panel.at(x, y);
        let is_inside = |place: &&Metres| {
            let (x, y) = at(**place);
            let plot = panel.plot;
            (plot.x0..=plot.x1).contains(&x) && (plot.y0..=plot.y1).contains(&y)
        };
        // Where the odometry leaves the map its way is left out.
        for stretch in self
            .reckoned_m
            .chunk_by(|a, b| is_inside(&a) && is_inside(&b))
        {
            let dash = (style.px(9.0), style.px(7.0));
            let pixels = plan::pixels(&panel, stretch);
            if stretch.iter().all(|place| is_inside(&place)) {
                scene.dashed(&pixels, fade(MUTED, 0.8), style.px(2.0), dash);
            }
        }
        let driven = plan::pixels(&panel, &self.driven_m);
        scene.line(driven, fade(DRIVEN, 0.8), style.px(2.5));
        let crowd = (40.0 / self.landmarks.len().max(1) as f64)
            .powf(0.4)
            .clamp(0.3, 1.0);
        for landmark in &self.landmarks {
            let [x, y] = landmark.position_m;
            let outline = marks::ellipse((x, y), landmark.covariance_m2, ELLIPSE_SIGMAS, 60);
            let outline: Vec<_> = outline.into_iter().map(|(x, y)| panel.at(x, y)).collect();
            scene.line(outline, colour_of(landmark.probability), style.thin_px());
        }
        for [seen, landmark] in &self.doubtful_m {
            if is_inside(&seen) {
                let line = vec![at(*seen), at(*landmark)];
                scene.line(line, DOUBTFUL, style.px(2.0));
                scene.disc(at(*seen), style.px(4.0), DOUBTFUL);
            }
        }
        for landmark in &self.landmarks {
            let marker = node_marker(landmark.probability);
            let radius = style.px(11.0) * crowd;
            marker.draw(scene, at(landmark.position_m), radius, style.px(2.0));
        }
        for place in self.misfits_m.iter().filter(is_inside) {
            marks::cross(scene, at(*place), style.px(9.0), MISFIT, style.px(3.0));
        }
    }

    fn legend(&self, style: &Style) -> Vec<(Symbol, String)> {
        let line = |colour, dashed| Symbol::Line(colour, style.px(3.0), dashed);
        let mut entries = vec![
            (line(DRIVEN, false), "way that was found".to_owned()),
            (line(MUTED, true), "by odometry alone".to_owned()),
        ];
        for p in SHOWN {
            let words = format!("landmark, {:.0} % sure", 100.0 * p);
            entries.push((Symbol::Marker(node_marker(p)), words));
        }
        let sigmas = format!("{ELLIPSE_SIGMAS}σ ellipse of\nits place");
        entries.push((Symbol::Ellipse(colour_of(1.0)), sigmas));
        if !self.doubtful_m.is_empty() {
            let words = "sighting whose\nlandmark is in doubt";
            entries.push((line(DOUBTFUL, false), words.to_owned()));
        }
        if !self.misfits_m.is_empty() {
            let words = "× residual that the\nnoise does not explain";
            entries.push((line(MISFIT, false), words.to_owned()));
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
