//! A vector page for plotters: SVG that any browser or editor shows as the raster page does.
//!
//! The unit is the backend's, 1/[`SUBPIXELS`] of a pixel, so that every number is an integer and the
//! bytes depend on the marks alone. Text stays text: it is escaped, and `textLength` gives each line the width
//! that it was laid out for, so that the layout holds where DejaVu Sans is not installed.
//! Filled rectangles snap to whole pixels, as on the raster page, and are drawn without
//! anti-aliasing. A style sheet gives the page's own colours, such as ink and paper, their dark
//! counterparts where the reader prefers dark pages; places with words are links above the marks.
//! Neighbouring opaque shapes of one style share a path, which keeps files small.

use std::convert::Infallible;
use std::fmt::Write;

use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform, text_anchor::HPos, text_anchor::VPos,
};

use super::backend::{SUBPIXELS, face_of};
use super::scene::Hover;
use super::style::{Colour, DARK};
use super::text::{self, Face};

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// Opens the document; what a browser without DejaVu Sans falls back to is as wide.
const FONTS: &str = "'DejaVu Sans',Verdana,sans-serif";

/// A page that plotters can draw on and that becomes an SVG document.
pub struct SvgPage {
    size_px: (u32, u32),
    body: String,
    hovers: String,
    /// Style and path data of the shapes that share an element so far.
    open: Option<(String, String)>,
}

impl SvgPage {
    /// A white page.
    pub fn new(width_px: u32, height_px: u32) -> Self {
        Self {
            size_px: (width_px.max(1), height_px.max(1)),
            body: String::new(),
            hovers: String::new(),
            open: None,
        }
    }

    /// What plotters draws with; the page stays ours.
    pub fn pen(&mut self) -> SvgPen<'_> {
        SvgPen(self)
    }

    /// The document, with a title for those who do not see it.
    pub fn into_document(mut self, title: &str) -> String {
        self.close();
        let (width, height) = self.size_px;
        let (w, h) = (width * SUBPIXELS, height * SUBPIXELS);
        let (role, hovers) = match self.hovers.is_empty() {
            true => ("img", String::new()),
            // The links of an image are out of reach for those who do not see it.
            false => (
                "group",
                format!("<g class=\"hot\" fill-opacity=\"0\">{}</g>", self.hovers),
            ),
        };
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"{role}\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {w} {h}\"><title>{}</title>{}<path fill=\"#ffffff\" d=\"M0 0h{w}v{h}h-{w}z\"/>\
             <g font-family=\"{FONTS}\" stroke-linejoin=\"round\" style=\"white-space:pre\">{}</g>{hovers}</svg>\n",
            escape(title),
            style_sheet(),
            self.body
        )
    }

    /// A rectangle, by two corners, that says something and may lead somewhere.
    pub fn hover(&mut self, [a, b]: [BackendCoord; 2], hover: &Hover) {
        let (w, h) = (b.0 - a.0, b.1 - a.1);
        let path = format!(
            "<path d=\"M{} {}h{w}v{h}h-{w}z\"><title>{}</title></path>",
            a.0,
            a.1,
            escape(&hover.text)
        );
        match &hover.href {
            Some(href) => {
                let _ = write!(self.hovers, "<a href=\"{}\">{path}</a>", escape(href));
            }
            None => self.hovers.push_str(&path),
        }
    }

    fn shape(&mut self, style: String, path: &str, is_opaque: bool) {
        match &mut self.open {
            // What is see-through must be laid over its neighbours, not united with them.
            Some((open, paths)) if *open == style && is_opaque => paths.push_str(path),
            _ => {
                self.close();
                self.open = Some((style, path.to_owned()));
            }
        }
    }

    fn close(&mut self) {
        if let Some((style, path)) = self.open.take() {
            let _ = write!(self.body, "<path {style} d=\"{path}\"/>");
        }
    }
}

/// The plotters backend: draws on a borrowed [`SvgPage`].
pub struct SvgPen<'a>(&'a mut SvgPage);

impl SvgPen<'_> {
    fn fill(&mut self, style: &impl BackendStyle, path: &str, crisp: bool) {
        let crisp = if crisp {
            " shape-rendering=\"crispEdges\""
        } else {
            ""
        };
        let fill = format!("{}{crisp}", paint("fill", style.color()));
        self.0.shape(fill, path, style.color().alpha >= 1.0);
    }

    fn stroke(&mut self, style: &impl BackendStyle, path: &str) {
        let stroke = format!(
            "fill=\"none\" {} stroke-width=\"{}\"",
            paint("stroke", style.color()),
            style.stroke_width()
        );
        self.0.shape(stroke, path, style.color().alpha >= 1.0);
    }
}

/// What a browser makes of the page where the reader prefers dark ones, and under a pointer.
fn style_sheet() -> String {
    let hex = |c: Colour| format!("#{:02x}{:02x}{:02x}", c.0, c.1, c.2);
    let swap = |(light, dark): &(Colour, Colour)| {
        let (light, dark) = (hex(*light), hex(*dark));
        format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}")
    };
    format!(
        "<style>.hot path:hover,.hot a:focus path{{fill-opacity:.25}}\
         @media (prefers-color-scheme:dark){{{}}}</style>",
        DARK.iter().map(swap).collect::<String>()
    )
}

fn paint(what: &str, color: BackendColor) -> String {
    let BackendColor {
        alpha,
        rgb: (r, g, b),
    } = color;
    let opacity = if alpha < 1.0 {
        format!(" {what}-opacity=\"{alpha:.3}\"")
    } else {
        String::new()
    };
    format!("{what}=\"#{r:02x}{g:02x}{b:02x}\"{opacity}")
}

/// A polyline in steps from point to point.
fn polyline(points: impl IntoIterator<Item = BackendCoord>, close: bool) -> String {
    let mut path = String::new();
    let mut points = points.into_iter();
    let Some((mut x, mut y)) = points.next() else {
        return path;
    };
    let _ = write!(path, "M{x} {y}");
    for (to_x, to_y) in points {
        let (dx, dy) = (to_x - x, to_y - y);
        (x, y) = (to_x, to_y);
        let sign = if dy < 0 { "" } else { " " };
        let _ = match (dx, dy) {
            (0, 0) => continue,
            (0, _) => write!(path, "v{dy}"),
            (_, 0) => write!(path, "h{dx}"),
            _ => write!(path, "l{dx}{sign}{dy}"),
        };
    }
    if close {
        path.push('z');
    }
    path
}

/// Text as it may stand in a document; what XML cannot hold at all becomes a sign of its own.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\t' | '\n' => escaped.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

impl DrawingBackend for SvgPen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let (width, height) = self.0.size_px;
        (width * SUBPIXELS, height * SUBPIXELS)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        let path = format!("M{x} {y}h{SUBPIXELS}v{SUBPIXELS}h-{SUBPIXELS}z");
        self.0.shape(paint("fill", color), &path, false);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.stroke(style, &polyline([from, to], false));
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        let closed = points.len() > 2 && points.first() == points.last();
        self.stroke(style, &polyline(points, closed));
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if !fill {
            self.stroke(style, &polyline([a, (b.0, a.1), b, (a.0, b.1)], true));
            return Ok(());
        }
        let unit = SUBPIXELS as i32;
        let snap = |v: i32| (v + unit / 2).div_euclid(unit) * unit;
        let [x0, y0, x1, y1] = [a.0.min(b.0), a.1.min(b.1), a.0.max(b.0), a.1.max(b.1)].map(snap);
        // Narrower than half a pixel: nothing to fill.
        if x1 > x0 && y1 > y0 {
            let (w, h) = (x1 - x0, y1 - y0);
            self.fill(style, &format!("M{x0} {y0}h{w}v{h}h-{w}z"), true);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (left, d) = (x - radius as i32, 2 * radius);
        let path =
            format!("M{left} {y}a{radius} {radius} 0 1 0 {d} 0a{radius} {radius} 0 1 0-{d} 0z");
        if fill {
            self.fill(style, &path, false);
        } else {
            self.stroke(style, &path);
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vert: I,
        style: &S,
    ) -> Drawn {
        // By itself: two polygons in one path would be one shape where they overlap.
        self.0.close();
        self.fill(style, &polyline(vert, true), false);
        self.0.close();
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, line: &str, style: &T, at: BackendCoord) -> Drawn {
        self.0.close();
        let (size, face) = (style.size(), face_of(style));
        let anchor = style.anchor();
        let along = match anchor.h_pos {
            HPos::Left => "",
            HPos::Center => " text-anchor=\"middle\"",
            HPos::Right => " text-anchor=\"end\"",
        };
        let down = size
            * match anchor.v_pos {
                VPos::Top => text::ASCENT_EM,
                VPos::Center => text::HALF_CAPITAL_EM,
                VPos::Bottom => -text::DESCENT_EM,
            };
        let (x, y, down) = (at.0, at.1, down.round() as i32);
        let place = match style.transform() {
            FontTransform::None => format!("x=\"{x}\" y=\"{}\"", y + down),
            FontTransform::Rotate90 => {
                format!("transform=\"translate({x} {y})rotate(90)\" y=\"{down}\"")
            }
            FontTransform::Rotate180 => {
                format!("transform=\"translate({x} {y})rotate(180)\" y=\"{down}\"")
            }
            FontTransform::Rotate270 => {
                format!("transform=\"translate({x} {y})rotate(270)\" y=\"{down}\"")
            }
        };
        let weight = if face == Face::Bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let _ = write!(
            self.0.body,
            "<text {place} font-size=\"{}\"{weight}{along} textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\" {}>{}</text>",
            size.round(),
            text::width_px(line, size, face).round(),
            paint("fill", style.color()),
            escape(line)
        );
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        line: &str,
        style: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let width = text::width_px(line, style.size(), face_of(style)).ceil() as u32;
        Ok((width, (style.size() * text::HEIGHT_EM).ceil() as u32))
    }
}
