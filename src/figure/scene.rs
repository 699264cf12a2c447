//! A figure as a list of marks in pixels, before any backend has seen it.
//!
//! Figures append marks to a [`Scene`] and place other figures inside rectangles of it; only
//! [`Scene::draw_on`] speaks to plotters, so the same marks go to the raster page or to any other
//! plotters backend. Positions are fractions of pixels, x to the right and y down.

use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text as TextElement};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, ShapeStyle};
use plotters_backend::DrawingBackend;

use super::backend::{Canvas, SUBPIXELS};
pub use super::geometry::{Point, Rect};
pub use super::label::Label;
use super::style::Colour;
use super::svg::SvgPage;
use super::text::Face;

enum Mark {
    Line {
        points: Vec<Point>,
        colour: Colour,
        width: f64,
    },
    Polygon {
        points: Vec<Point>,
        colour: Colour,
    },
    Block {
        rect: Rect,
        colour: Colour,
    },
    Disc {
        centre: Point,
        radius: f64,
        colour: Colour,
        outline: Option<f64>,
    },
    Label(Label),
}

/// What a place says when a pointer rests on it, and where a click leads. Only SVG has it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hover {
    /// The words.
    pub text: String,
    /// Where a click leads; `None` for nowhere.
    pub href: Option<String>,
}

/// The marks of one page, in drawing order.
pub struct Scene {
    width_px: u32,
    height_px: u32,
    marks: Vec<Mark>,
    hovers: Vec<(Rect, Hover)>,
}

impl Scene {
    /// An empty page.
    pub fn new(width_px: u32, height_px: u32) -> Self {
        Self {
            width_px,
            height_px,
            marks: Vec::new(),
            hovers: Vec::new(),
        }
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.width_px, self.height_px)
    }

    /// The whole page.
    pub fn area(&self) -> Rect {
        Rect::new(
            0.0,
            0.0,
            f64::from(self.width_px),
            f64::from(self.height_px),
        )
    }

    /// A polyline; closed if its last point is its first.
    pub fn line(&mut self, points: Vec<Point>, colour: Colour, width: f64) {
        if points.len() > 1 {
            self.marks.push(Mark::Line {
                points,
                colour,
                width,
            });
        }
    }

    /// A horizontal or vertical line, moved to whole pixels so that it is crisp.
    pub fn rule(&mut self, from: Point, to: Point, colour: Colour, width: f64) {
        let width = width.round().max(1.0);
        let shift = (width % 2.0) / 2.0;
        let snap = |v: f64| (v - shift).round() + shift;
        let points = vec![(snap(from.0), snap(from.1)), (snap(to.0), snap(to.1))];
        self.line(points, colour, width);
    }

    /// A crisp rectangular outline.
    pub fn frame(&mut self, rect: Rect, colour: Colour, width: f64) {
        let half = width.round().max(1.0) / 2.0;
        let Rect { x0, y0, x1, y1 } = rect;
        self.rule((x0 - half, y0), (x1 + half, y0), colour, width);
        self.rule((x0 - half, y1), (x1 + half, y1), colour, width);
        self.rule((x0, y0), (x0, y1), colour, width);
        self.rule((x1, y0), (x1, y1), colour, width);
    }

    /// A polyline of dashes that keep their rhythm round corners.
    pub fn dashed(
        &mut self,
        points: &[Point],
        colour: Colour,
        width: f64,
        (dash, gap): (f64, f64),
    ) {
        let mut inked = true;
        let mut left = dash;
        let mut current: Vec<Point> = points.first().copied().into_iter().collect();
        for pair in points.windows(2) {
            let (mut from, to) = (pair[0], pair[1]);
            let mut rest = (to.0 - from.0).hypot(to.1 - from.1);
            while rest > left {
                let share = left / rest;
                from = (
                    from.0 + (to.0 - from.0) * share,
                    from.1 + (to.1 - from.1) * share,
                );
                rest -= left;
                current.push(from);
                if inked {
                    self.line(std::mem::take(&mut current), colour, width);
                }
                current = vec![from];
                inked = !inked;
                left = if inked { dash } else { gap };
            }
            left -= rest;
            current.push(to);
        }
        if inked {
            self.line(current, colour, width);
        }
    }

    /// A filled polygon.
    pub fn polygon(&mut self, points: Vec<Point>, colour: Colour) {
        if points.len() > 2 {
            self.marks.push(Mark::Polygon { points, colour });
        }
    }

    /// A filled rectangle, its edges on whole pixels.
    pub fn block(&mut self, rect: Rect, colour: Colour) {
        self.marks.push(Mark::Block { rect, colour });
    }

    /// A filled circle.
    pub fn disc(&mut self, centre: Point, radius: f64, colour: Colour) {
        self.marks.push(Mark::Disc {
            centre,
            radius,
            colour,
            outline: None,
        });
    }

    /// A circular outline.
    pub fn ring(&mut self, centre: Point, radius: f64, colour: Colour, width: f64) {
        self.marks.push(Mark::Disc {
            centre,
            radius,
            colour,
            outline: Some(width),
        });
    }

    /// One line of text.
    pub fn label(&mut self, label: Label) {
        if !label.text.is_empty() {
            self.marks.push(Mark::Label(label));
        }
    }

    /// Words and a link for a rectangle of the page.
    pub fn hover(&mut self, rect: Rect, hover: Hover) {
        self.hovers.push((rect, hover));
    }

    /// Takes the links away; the words stay.
    pub fn unlink(&mut self) {
        for (_, hover) in &mut self.hovers {
            hover.href = None;
        }
    }

    /// All the text of the page, for tests of its layout.
    pub fn labels(&self) -> impl Iterator<Item = &Label> {
        self.marks.iter().filter_map(|mark| match mark {
            Mark::Label(label) => Some(label),
            _ => None,
        })
    }

    /// Cuts what is empty below and to the right of the marks, but for a margin.
    pub fn trim(&mut self, margin_px: f64) {
        let (mut x1, mut y1) = (0.0f64, 0.0f64);
        let mut reach = |(x, y): Point| (x1, y1) = (x1.max(x), y1.max(y));
        for mark in &self.marks {
            match mark {
                Mark::Line { points, width, .. } => {
                    points
                        .iter()
                        .for_each(|&(x, y)| reach((x + width / 2.0, y + width / 2.0)));
                }
                Mark::Polygon { points, .. } => points.iter().for_each(|&point| reach(point)),
                Mark::Block { rect, .. } => reach((rect.x1, rect.y1)),
                Mark::Disc { centre, radius, .. } => reach((centre.0 + radius, centre.1 + radius)),
                Mark::Label(label) => reach((label.bounds().x1, label.bounds().y1)),
            }
        }
        self.width_px = self.width_px.min((x1 + margin_px).ceil() as u32);
        self.height_px = self.height_px.min((y1 + margin_px).ceil() as u32);
    }

    /// Draws on a plotters backend whose unit is 1/[`SUBPIXELS`] of a pixel of this scene.
    pub fn draw_on<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let all = |points: &[Point]| points.iter().map(|&p| to_units(p)).collect::<Vec<_>>();
        for mark in &self.marks {
            match mark {
                Mark::Line {
                    points,
                    colour,
                    width,
                } => {
                    area.draw(&PathElement::new(all(points), stroke(*colour, *width)))?;
                }
                Mark::Polygon { points, colour } => {
                    area.draw(&Polygon::new(all(points), colour.filled()))?
                }
                Mark::Block { rect, colour } => {
                    let corners = [to_units((rect.x0, rect.y0)), to_units((rect.x1, rect.y1))];
                    area.draw(&Rectangle::new(corners, colour.filled()))?;
                }
                Mark::Disc {
                    centre,
                    radius,
                    colour,
                    outline,
                } => {
                    let style =
                        outline.map_or_else(|| colour.filled(), |width| stroke(*colour, width));
                    area.draw(&Circle::new(to_units(*centre), units(*radius), style))?;
                }
                Mark::Label(label) => draw_label(area, label)?,
            }
        }
        Ok(())
    }

    /// The page as pixels.
    pub fn render(&self) -> Canvas {
        let mut canvas = Canvas::new(self.width_px, self.height_px);
        self.draw_on(&canvas.pen().into_drawing_area())
            .expect("drawing on pixels in memory cannot fail");
        canvas
    }

    /// The page as a PNG.
    pub fn png(&self) -> Vec<u8> {
        self.render().into_png()
    }

    /// The page as an SVG document, with a title for those who do not see it.
    pub fn svg(&self, title: &str) -> String {
        let mut page = SvgPage::new(self.width_px, self.height_px);
        self.draw_on(&page.pen().into_drawing_area())
            .expect("drawing on a text in memory cannot fail");
        for (rect, hover) in &self.hovers {
            let (a, b) = (to_units((rect.x0, rect.y0)), to_units((rect.x1, rect.y1)));
            page.hover([a, b], hover);
        }
        page.into_document(title)
    }
}

fn units(length_px: f64) -> i32 {
    (length_px * f64::from(SUBPIXELS)).round() as i32
}

fn to_units((x, y): Point) -> (i32, i32) {
    (units(x), units(y))
}

fn stroke(colour: Colour, width_px: f64) -> ShapeStyle {
    ShapeStyle {
        color: colour,
        filled: false,
        stroke_width: units(width_px).max(1) as u32,
    }
}

fn draw_label<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    label: &Label,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let style = if label.face == Face::Bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    let turn = if label.upward {
        FontTransform::Rotate270
    } else {
        FontTransform::None
    };
    let along = [HPos::Left, HPos::Center, HPos::Right][(label.along * 2.0) as usize];
    let down = [VPos::Top, VPos::Center, VPos::Bottom][(label.down * 2.0) as usize];
    let font = FontDesc::new(
        FontFamily::SansSerif,
        label.size_px * f64::from(SUBPIXELS),
        style,
    )
    .transform(turn);
    let style = font.color(&label.colour);
    let style = plotters::style::TextStyle {
        pos: Pos::new(along, down),
        ..style
    };
    area.draw(&TextElement::new(
        label.text.as_str(),
        to_units(label.at),
        style,
    ))
}
