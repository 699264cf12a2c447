//! A raster page for plotters: tiny-skia for shapes, ab_glyph and DejaVu for text, `png` for the file.
//!
//! plotters addresses pixels by integers, which makes small circles and shallow lines visibly
//! uneven. Here one unit of the backend is 1/[`SUBPIXELS`] of a pixel, so the scene keeps its
//! fractions and strokes may be 1.5 px wide. Filled axis-aligned rectangles are the exception:
//! they snap to whole pixels and are not anti-aliased, so that adjacent cells of a heat map share
//! an edge without a seam. The bytes of the PNG depend on the marks alone: no time, no host.

use std::convert::Infallible;

use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle, FontTransform, text_anchor::HPos, text_anchor::VPos,
};
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform,
};

use super::text::{self, Face};

/// Units of the backend in one pixel of the image.
pub const SUBPIXELS: u32 = 16;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// A white page that plotters can draw on and that becomes a PNG.
pub struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// A white page. A side of zero pixels is taken as one.
    pub fn new(width_px: u32, height_px: u32) -> Self {
        let mut pixmap = Pixmap::new(width_px.max(1), height_px.max(1))
            .expect("a page of at least one pixel and far below 2^31 bytes can be allocated");
        pixmap.fill(Color::WHITE);
        Self { pixmap }
    }

    /// The colour of a pixel, for tests.
    pub fn pixel(&self, x: u32, y: u32) -> Option<(u8, u8, u8)> {
        let pixel = self.pixmap.pixel(x, y)?;
        Some((pixel.red(), pixel.green(), pixel.blue()))
    }

    /// The page as an RGB PNG.
    pub fn into_png(self) -> Vec<u8> {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        // The page began opaque, so colours are not premultiplied by anything but one.
        let rgb: Vec<u8> = self
            .pixmap
            .data()
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder
            .write_header()
            .expect("writing to memory cannot fail");
        writer
            .write_image_data(&rgb)
            .expect("the buffer has exactly width x height RGB pixels");
        writer.finish().expect("writing to memory cannot fail");
        bytes
    }

    /// What plotters draws with; the page stays ours.
    pub fn pen(&mut self) -> Pen<'_> {
        Pen {
            pixmap: &mut self.pixmap,
        }
    }
}

/// The plotters backend: draws on a borrowed [`Canvas`].
pub struct Pen<'a> {
    pixmap: &'a mut Pixmap,
}

impl Pen<'_> {
    fn stroke(&mut self, path: Option<Path>, style: &impl BackendStyle) {
        let stroke = Stroke {
            width: style.stroke_width() as f32 / SUBPIXELS as f32,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        if let Some(path) = path {
            self.pixmap
                .stroke_path(&path, &paint(style), &stroke, Transform::identity(), None);
        }
    }

    fn fill(&mut self, path: Option<Path>, style: &impl BackendStyle) {
        if let Some(path) = path {
            self.pixmap.fill_path(
                &path,
                &paint(style),
                FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
    }

    /// Blends a colour into one pixel; a position outside the page is ignored.
    fn blend(&mut self, x: i32, y: i32, color: BackendColor, coverage: f32) {
        let (width, height) = (self.pixmap.width() as i32, self.pixmap.height() as i32);
        if x < 0 || y < 0 || x >= width || y >= height {
            return;
        }
        let alpha = color.alpha as f32 * coverage.clamp(0.0, 1.0);
        let (r, g, b) = color.rgb;
        let at = (y as usize * width as usize + x as usize) * 4;
        for (byte, ink) in self.pixmap.data_mut()[at..at + 3].iter_mut().zip([r, g, b]) {
            *byte = (f32::from(ink) * alpha + f32::from(*byte) * (1.0 - alpha)).round() as u8;
        }
    }
}

fn px(unit: i32) -> f32 {
    unit as f32 / SUBPIXELS as f32
}

fn paint(style: &impl BackendStyle) -> Paint<'static> {
    let BackendColor {
        alpha,
        rgb: (r, g, b),
    } = style.color();
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color_rgba8(r, g, b, (alpha * 255.0).round() as u8);
    paint
}

fn polyline(points: impl IntoIterator<Item = BackendCoord>, close: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let mut points = points.into_iter();
    let (x, y) = points.next()?;
    builder.move_to(px(x), px(y));
    for (x, y) in points {
        builder.line_to(px(x), px(y));
    }
    if close {
        builder.close();
    }
    builder.finish()
}

impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (
            self.pixmap.width() * SUBPIXELS,
            self.pixmap.height() * SUBPIXELS,
        )
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        self.blend(px(x) as i32, px(y) as i32, color, 1.0);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.stroke(polyline([from, to], false), style);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        let closed = points.len() > 2 && points.first() == points.last();
        self.stroke(polyline(points, closed), style);
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
            self.stroke(polyline([a, (b.0, a.1), b, (a.0, b.1)], true), style);
            return Ok(());
        }
        let [x0, y0, x1, y1] =
            [a.0.min(b.0), a.1.min(b.1), a.0.max(b.0), a.1.max(b.1)].map(|v| px(v).round());
        let mut paint = paint(style);
        paint.anti_alias = false;
        // None is a rectangle narrower than half a pixel: nothing to fill.
        if let Some(rect) = Rect::from_ltrb(x0, y0, x1, y1) {
            self.pixmap
                .fill_rect(rect, &paint, Transform::identity(), None);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        at: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let path = PathBuilder::from_circle(px(at.0), px(at.1), radius as f32 / SUBPIXELS as f32);
        if fill {
            self.fill(path, style)
        } else {
            self.stroke(path, style)
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vert: I,
        style: &S,
    ) -> Drawn {
        self.fill(polyline(vert, true), style);
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, line: &str, style: &T, at: BackendCoord) -> Drawn {
        let face = face_of(style);
        let size_px = style.size() / f64::from(SUBPIXELS);
        let anchor = style.anchor();
        let along = match anchor.h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * text::width_px(line, size_px, face),
            HPos::Right => -text::width_px(line, size_px, face),
        };
        let down = size_px
            * match anchor.v_pos {
                VPos::Top => text::ASCENT_EM,
                VPos::Center => text::HALF_CAPITAL_EM,
                VPos::Bottom => -text::DESCENT_EM,
            };
        // The text is laid out unrotated around the anchor; each of its pixels is then turned.
        let (x, y) = (px(at.0), px(at.1));
        let turn = style.transform();
        let (upright_x, upright_y) = match turn {
            FontTransform::None => (x, y),
            FontTransform::Rotate90 => (y, -x),
            FontTransform::Rotate180 => (-x, -y),
            FontTransform::Rotate270 => (-y, x),
        };
        let color = style.color();
        let origin = (upright_x + along as f32, upright_y + down as f32);
        text::for_each_pixel(line, size_px, face, origin, |col, row, coverage| {
            let (x, y) = match turn {
                FontTransform::None => (col, row),
                FontTransform::Rotate90 => (-1 - row, col),
                FontTransform::Rotate180 => (-1 - col, -1 - row),
                FontTransform::Rotate270 => (row, -1 - col),
            };
            self.blend(x, y, color, coverage);
        });
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

pub(super) fn face_of(style: &impl BackendTextStyle) -> Face {
    match style.style() {
        FontStyle::Bold => Face::Bold,
        _ => Face::Regular,
    }
}
