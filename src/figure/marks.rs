//! Small shapes that several figures share: markers, crosses, hatching, legends, number labels.

use std::f64::consts::TAU;

use super::scene::{Label, Point, Rect, Scene};
use super::style::{Colour, INK, NO_DATA, PAPER, Style, category};
use super::text::{self, Face};

/// The shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// ●
    Circle,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// ▼
    TriangleDown,
}

/// A filled shape with an outline.
#[derive(Clone, Copy, Debug)]
pub struct Marker {
    /// Its shape.
    pub shape: Shape,
    /// Colour of the inside.
    pub fill: Colour,
    /// Colour of the outline.
    pub outline: Colour,
}

impl Marker {
    /// The marker of one of a few curves: each its own colour and shape.
    pub fn of_curve(curve: usize) -> Self {
        let shape = Self::of_set(curve * super::style::CATEGORIES.len(), false).shape;
        Self {
            shape,
            ..Self::of_set(curve, false)
        }
    }

    /// The marker of a set: eight colours, then the next shape, so 40 sets can be told apart. A
    /// set with a single member is hollow.
    pub fn of_set(set: usize, single: bool) -> Self {
        let shapes = [
            Shape::Circle,
            Shape::Square,
            Shape::Triangle,
            Shape::Diamond,
            Shape::TriangleDown,
        ];
        let colour = category(set);
        let (fill, outline) = if single {
            (PAPER, colour)
        } else {
            (colour, PAPER)
        };
        Self {
            shape: shapes[set / super::style::CATEGORIES.len() % shapes.len()],
            fill,
            outline,
        }
    }

    /// Draws it; all shapes of one `radius` have about the same area.
    pub fn draw(&self, scene: &mut Scene, at: Point, radius: f64, outline_px: f64) {
        let corners = |n: usize, turn: f64, reach: f64| -> Vec<Point> {
            let corner = |k: usize| {
                let angle = TAU * (k as f64 / n as f64 + turn);
                (
                    at.0 + reach * radius * angle.cos(),
                    at.1 + reach * radius * angle.sin(),
                )
            };
            (0..=n).map(|k| corner(k % n)).collect()
        };
        let outline = match self.shape {
            Shape::Circle => {
                scene.disc(at, radius, self.fill);
                scene.ring(at, radius, self.outline, outline_px);
                return;
            }
            Shape::Square => corners(4, 0.125, 1.25),
            Shape::Triangle => corners(3, -0.25, 1.5),
            Shape::Diamond => corners(4, 0.0, 1.3),
            Shape::TriangleDown => corners(3, 0.25, 1.5),
        };
        scene.polygon(outline.clone(), self.fill);
        scene.line(outline, self.outline, outline_px);
    }
}

/// An × of the given half width, on a white halo so that it shows on lines.
pub fn cross(scene: &mut Scene, at: Point, reach: f64, colour: Colour, width: f64) {
    for (colour, width, reach) in [(PAPER, width * 2.0, reach * 1.15), (colour, width, reach)] {
        for slope in [-1.0, 1.0] {
            let ends = vec![
                (at.0 - reach, at.1 - slope * reach),
                (at.0 + reach, at.1 + slope * reach),
            ];
            scene.line(ends, colour, width);
        }
    }
}

/// The node of a set whose detections have the given radius.
pub fn node(scene: &mut Scene, at: Point, radius: f64) {
    scene.disc(at, radius * 0.6, PAPER);
    scene.disc(at, radius * 0.42, INK);
}

/// A cell that holds no data: grey with diagonal hatching.
pub fn no_data(scene: &mut Scene, cell: Rect, style: &Style) {
    scene.block(cell, NO_DATA.0);
    let step = style.px(12.0);
    // Lines x + y = c; c runs over multiples of the step so that hatching continues across cells.
    let first = ((cell.x0 + cell.y0) / step).ceil() as i64;
    let last = ((cell.x1 + cell.y1) / step).floor() as i64;
    for c in (first..=last).map(|k| k as f64 * step) {
        let (xa, xb) = ((c - cell.y1).max(cell.x0), (c - cell.y0).min(cell.x1));
        scene.line(vec![(xa, c - xa), (xb, c - xb)], NO_DATA.1, style.px(1.5));
    }
}

/// What a legend shows beside its words.
#[derive(Clone, Copy, Debug)]
pub enum Symbol {
    /// A line, dashed if asked.
    Line(Colour, f64, bool),
    /// A marker.
    Marker(Marker),
    /// An ellipse outline.
    Ellipse(Colour),
    /// An ×.
    Cross(Colour),
    /// A filled block.
    Block(Colour),
    /// The node of a set.
    Node,
    /// A hatched cell.
    NoData,
}

/// Room a legend of these words needs.
pub fn legend_width_px<'a>(words: impl IntoIterator<Item = &'a str>, style: &Style) -> f64 {
    let size = style.small_px();
    let widest = words
        .into_iter()
        .flat_map(str::lines)
        .map(|line| text::width_px(line, size, Face::Regular));
    style.px(62.0) + widest.fold(0.0, f64::max)
}

/// Draws a legend into the top of `room`, one entry under the other, and returns the room under it.
pub fn legend(scene: &mut Scene, room: Rect, entries: &[(Symbol, String)], style: &Style) -> Rect {
    let size = style.small_px();
    let mut y = room.y0;
    for (symbol, words) in entries {
        let lines = text::wrap(words, room.width() - style.px(60.0), size, Face::Regular, 4);
        if y + size * text::LEADING_EM * lines.len() as f64 > room.y1 {
            break;
        }
        let middle = y + size * (text::ASCENT_EM - text::HALF_CAPITAL_EM);
        symbol.draw(scene, (room.x0 + style.px(24.0), middle), style);
        for line in lines {
            scene.label(Label::new(line, (room.x0 + style.px(60.0), y), size));
            y += size * text::LEADING_EM;
        }
        y += size * 0.4;
    }
    Rect::new(room.x0, y, room.x1, room.y1)
}

impl Symbol {
    fn draw(self, scene: &mut Scene, (x, y): Point, style: &Style) {
        let half = style.px(22.0);
        match self {
            Self::Line(colour, width, false) => {
                scene.line(vec![(x - half, y), (x + half, y)], colour, width)
            }
            Self::Line(colour, width, true) => {
                let dash = (style.px(11.0), style.px(5.5));
                scene.dashed(&[(x - half, y), (x + half, y)], colour, width, dash);
            }
            Self::Marker(marker) => marker.draw(scene, (x, y), style.px(9.0), style.thin_px()),
            Self::Ellipse(colour) => {
                let points = ellipse(
                    (x, y),
                    [[half * half, 0.0], [0.0, half * half * 0.2]],
                    1.0,
                    32,
                );
                scene.polygon(points.clone(), super::style::fade(colour, 0.12));
                scene.line(points, colour, style.thin_px());
            }
            Self::Cross(colour) => cross(scene, (x, y), style.px(10.0), colour, style.px(4.0)),
            Self::Block(colour) => scene.block(
                Rect::new(x - half, y - half / 2.0, x + half, y + half / 2.0),
                colour,
            ),
            Self::Node => node(scene, (x, y), style.px(11.0)),
            Self::NoData => no_data(
                scene,
                Rect::new(x - half, y - half / 2.0, x + half, y + half / 2.0),
                style,
            ),
        }
    }
}

/// Corners of the ellipse {x : (x−c)ᵀ C⁻¹ (x−c) = k²}, closed. A covariance with a negative
/// eigenvalue (rounding) is taken as flat in that direction.
pub fn ellipse(
    centre: Point,
    covariance: [[f64; 2]; 2],
    sigmas: f64,
    corners: usize,
) -> Vec<Point> {
    let [[a, b], [_, d]] = covariance;
    let (mean, half_gap) = ((a + d) / 2.0, ((a - d) / 2.0).hypot(b));
    let major = (mean + half_gap).max(0.0).sqrt() * sigmas;
    let minor = (mean - half_gap).max(0.0).sqrt() * sigmas;
    let turn = 0.5 * (2.0 * b).atan2(a - d);
    let (sin, cos) = turn.sin_cos();
    let corner = |k: usize| {
        let angle = TAU * (k % corners) as f64 / corners as f64;
        let (u, v) = (major * angle.cos(), minor * angle.sin());
        (centre.0 + u * cos - v * sin, centre.1 + u * sin + v * cos)
    };
    (0..=corners).map(corner).collect()
}

/// Writes numbers beside points so that labels cover neither points nor each other nor `lines`
/// where that is possible. Points at the same place share a label: "3, 11".
pub fn number_points(
    scene: &mut Scene,
    points: &[Point],
    lines: &[Vec<Point>],
    clear_px: f64,
    room: Rect,
    style: &Style,
) {
    let size = style.small_px();
    let mut places: Vec<(Point, Vec<String>)> = Vec::new();
    for (i, &at) in points.iter().enumerate() {
        let near = |(place, _): &&mut (Point, Vec<String>)| {
            (place.0 - at.0).hypot(place.1 - at.1) < clear_px * 0.5
        };
        match places.iter_mut().find(near) {
            Some((_, numbers)) => numbers.push(i.to_string()),
            None => places.push((at, vec![i.to_string()])),
        }
    }
    let boxed = |(x, y): Point| Rect::new(x - clear_px, y - clear_px, x + clear_px, y + clear_px);
    let mut taken: Vec<Rect> = places.iter().map(|&(at, _)| boxed(at)).collect();
    for (at, mut numbers) in places {
        if numbers.len() > 4 {
            numbers.splice(2..numbers.len() - 1, ["…".to_owned()]);
        }
        let words = numbers.join(", ");
        let (w, h) = (text::width_px(&words, size, Face::Regular), size * 0.8);
        let spots = [
            (1.0, -1.0),
            (-1.0, -1.0),
            (1.0, 1.0),
            (-1.0, 1.0),
            (1.0, 0.0),
            (-1.0, 0.0),
            (0.0, -1.0),
            (0.0, 1.0),
        ];
        let spots = [1.0, 2.2]
            .iter()
            .flat_map(|far| spots.map(|(sx, sy)| (sx, sy, *far)));
        let spots = spots.map(|(sx, sy, far)| {
            let reach = clear_px * far;
            let centre = (
                at.0 + sx * (reach + w / 2.0),
                at.1 + sy * (reach * 0.8 + h / 2.0),
            );
            Rect::new(
                centre.0 - w / 2.0,
                centre.1 - h / 2.0,
                centre.0 + w / 2.0,
                centre.1 + h / 2.0,
            )
        });
        let cost = |spot: &Rect| {
            let outside =
                spot.x0 < room.x0 || spot.x1 > room.x1 || spot.y0 < room.y0 || spot.y1 > room.y1;
            let covered = taken.iter().filter(|other| other.overlaps(spot)).count();
            let crossed = lines
                .iter()
                .flat_map(|line| line.windows(2))
                .filter(|leg| spot.meets(leg[0], leg[1]));
            // Text over text is unreadable, text over a line only ugly.
            4 * covered + crossed.count().min(3) + if outside { 1000 } else { 0 }
        };
        let best = spots.min_by_key(cost).expect("there are sixteen spots");
        taken.push(best);
        scene.block(
            best.inset(-2.0, -1.0, -2.0, -1.0),
            super::style::fade(PAPER, 0.75),
        );
        scene.label(
            Label::new(words, best.centre(), size)
                .centred()
                .middle()
                .colour(INK),
        );
    }
}
