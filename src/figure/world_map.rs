//! The world and what the robot saw of it: walls, paths, detections and their covariances
//! (the report's Figures 2 and 4).

use super::axes::heading;
use super::marks::{self, Marker, Shape, Symbol};
use super::plan::{self, Bounds, Metres};
use super::scene::{Rect, Scene};
use super::style::{ACCENT, Colour, INK, MUTED, PAPER, PATH, SERIES, Style, fade};

/// What the map shows; any part may be empty.
#[derive(Clone, Debug, Default)]
pub struct WorldMap {
    /// Heading; may be empty.
    pub title: String,
    /// Closed polygons.
    pub walls_m: Vec<Vec<Metres>>,
    /// The path the robot believes it drove, in order.
    pub believed_path_m: Vec<Metres>,
    /// The path it drove.
    pub true_path_m: Vec<Metres>,
    /// Detections in mission order.
    pub detections_m: Vec<Metres>,
    /// Covariances of the detections, or empty.
    pub covariances_m2: Vec<[[f64; 2]; 2]>,
    /// Size of the ellipses in standard deviations (Mahalanobis radius), usually 1 or 2.
    pub ellipse_sigmas: f64,
}

/// Above this many detections numbers would only cover the map.
const MOST_NUMBERED: usize = 40;

const DETECTION: Colour = ACCENT;

impl WorldMap {
    /// Draws the map and its legend into `area`.
    pub fn draw(&self, scene: &mut Scene, area: Rect, style: &Style) {
        let area = heading(scene, area, &self.title, style.title_px(), 2);
        let entries = self.legend();
        let legend_px =
            marks::legend_width_px(entries.iter().map(|(_, words)| words.as_str()), style);
        let legend_px = legend_px.min(area.width() * 0.35);
        let panel = plan::with_axes(
            scene,
            area.inset(0.0, 0.0, legend_px + style.px(30.0), 0.0),
            self.bounds(),
            style,
        );

        plan::walls(scene, &panel, &self.walls_m, style.px(4.0));
        let true_path = plan::pixels(&panel, &self.true_path_m);
        scene.dashed(
            &true_path,
            MUTED,
            style.line_px(),
            (style.px(11.0), style.px(7.0)),
        );
        let believed = plan::pixels(&panel, &self.believed_path_m);
        scene.line(believed.clone(), PATH, style.line_px());

        // A crowd is drawn smaller and more transparent, so that its density shows.
        let crowd = (60.0 / self.detections_m.len().max(1) as f64)
            .sqrt()
            .clamp(0.12, 1.0);
        let corners = if crowd < 0.3 { 20 } else { 120 };
        for (&[x, y], &covariance) in self.detections_m.iter().zip(&self.covariances_m2) {
            let outline = marks::ellipse((x, y), covariance, self.ellipse_sigmas, corners);
            let outline: Vec<_> = outline.into_iter().map(|(x, y)| panel.at(x, y)).collect();
            if outline.iter().all(|(x, y)| x.is_finite() && y.is_finite()) {
                scene.polygon(outline.clone(), fade(SERIES, 0.12 * crowd));
                scene.line(
                    outline,
                    fade(SERIES, 0.8 * crowd),
                    style.thin_px() * crowd.max(0.4),
                );
            }
        }
        let radius = style.px(8.0) * crowd.max(0.3);
        let points: Vec<_> = self
            .detections_m
            .iter()
            .map(|&[x, y]| panel.at(x, y))
            .collect();
        for &at in points
            .iter()
            .filter(|(x, y)| x.is_finite() && y.is_finite())
        {
            if crowd < 0.4 {
                scene.disc(at, radius, fade(DETECTION, 0.6));
            } else {
                detection_marker().draw(scene, at, radius, style.px(1.5));
            }
        }
        for (path, colour) in [(&true_path, MUTED), (&believed, PATH)] {
            if let (Some(&start), Some(&end)) = (path.first(), path.last()) {
                start_marker(colour).draw(scene, start, style.px(11.0), style.thin_px());
                marks::cross(scene, end, style.px(11.0), colour, style.px(4.5));
            }
        }
        if points.len() <= MOST_NUMBERED {
            let mut lines = vec![believed, true_path];
            lines.extend(
                self.walls_m
                    .iter()
                    .map(|wall| plan::wall_pixels(&panel, wall)),
            );
            let clear_px = radius + style.px(3.0);
            marks::number_points(scene, &points, &lines, clear_px, panel.plot, style);
        }
        let x0 = panel.plot.x1 + style.px(30.0);
        marks::legend(
            scene,
            Rect::new(x0, panel.plot.y0, area.x1.min(x0 + legend_px), area.y1),
            &entries,
            style,
        );
    }

    /// The figure alone, of at most this size, cut to the proportions of the map.
    pub fn page(&self, width_px: u32, height_px: u32) -> Scene {
        super::cut_page(width_px, height_px, |scene, area, style| {
            self.draw(scene, area, style)
        })
    }

    fn bounds(&self) -> Bounds {
        let paths = self
            .walls_m
            .iter()
            .flatten()
            .chain(&self.believed_path_m)
            .chain(&self.true_path_m);
        let reach =
            |c: &[[f64; 2]; 2], axis: usize| c[axis][axis].max(0.0).sqrt() * self.ellipse_sigmas;
        let ellipses = self.detections_m.iter().zip(&self.covariances_m2);
        let corners = ellipses.flat_map(|(&[x, y], c)| {
            let (rx, ry) = (reach(c, 0), reach(c, 1));
            [[x - rx, y - ry], [x + rx, y + ry]]
        });
        Bounds::of(paths.chain(&self.detections_m).copied().chain(corners))
    }

    fn legend(&self) -> Vec<(Symbol, String)> {
        let mut entries = Vec::new();
        let mut add = |shown: bool, symbol: Symbol, words: String| {
            if shown {
                entries.push((symbol, words));
            }
        };
        let moving = !self.believed_path_m.is_empty() || !self.true_path_m.is_empty();
        add(
            !self.walls_m.is_empty(),
            Symbol::Line(INK, 4.0, false),
            "wall".to_owned(),
        );
        add(
            !self.believed_path_m.is_empty(),
            Symbol::Line(PATH, 3.0, false),
            "believed path".to_owned(),
        );
        add(
            !self.true_path_m.is_empty(),
            Symbol::Line(MUTED, 3.0, true),
            "true path".to_owned(),
        );
        add(
            moving,
            Symbol::Marker(start_marker(PATH)),
            "start of path".to_owned(),
        );
        add(moving, Symbol::Cross(PATH), "end of path".to_owned());
        let n = self.detections_m.len();
        let numbered = if n <= MOST_NUMBERED {
            "numbered in mission order from 0"
        } else {
            "not numbered"
        };
        let words = match n {
            1 => "1 detection".to_owned(),
            _ => format!(
                "{} detections,\n{numbered}",
                super::style::tick_label(n as f64, 1.0)
            ),
        };
        add(n > 0, Symbol::Marker(detection_marker()), words);
        let k = self.ellipse_sigmas;
        // In the plane a Mahalanobis radius k holds 1 − exp(−k²/2) of a Gaussian.
        let mass = 100.0 * (1.0 - (-k * k / 2.0).exp());
        let words = format!("{k}σ covariance ellipse\n({mass:.0} % of its mass)");
        add(
            !self.covariances_m2.is_empty() && n > 0,
            Symbol::Ellipse(SERIES),
            words,
        );
        entries
    }
}

fn detection_marker() -> Marker {
    Marker {
        shape: Shape::Circle,
        fill: DETECTION,
        outline: PAPER,
    }
}

fn start_marker(colour: Colour) -> Marker {
    Marker {
        shape: Shape::Square,
        fill: PAPER,
        outline: colour,
    }
}
