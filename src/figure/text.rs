//! The embedded DejaVu Sans: how wide a line of text is, where to break it, and its pixels.
//!
//! Sizes are the em in pixels, as in CSS and SVG. Text is measured with the font that draws it,
//! so that a figure can reserve exactly the room its labels need.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

/// The two weights figures use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// DejaVu Sans.
    Regular,
    /// DejaVu Sans Bold.
    Bold,
}

/// From the top of the box of a line down to its baseline, in em (room for accents and brackets).
pub const ASCENT_EM: f64 = 0.80;
/// From the baseline down to the bottom of the box, in em.
pub const DESCENT_EM: f64 = 0.24;
/// Height of the box of one line, in em.
pub const HEIGHT_EM: f64 = ASCENT_EM + DESCENT_EM;
/// Half the height of a capital or digit, in em: centred text is centred on its digits.
pub const HALF_CAPITAL_EM: f64 = 0.365;
/// Distance between baselines, in em.
pub const LEADING_EM: f64 = 1.22;

static REGULAR: LazyLock<FontRef<'static>> = LazyLock::new(|| load(dejavu::sans::regular()));
static BOLD: LazyLock<FontRef<'static>> = LazyLock::new(|| load(dejavu::sans::bold()));

fn load(bytes: &'static [u8]) -> FontRef<'static> {
    FontRef::try_from_slice(bytes).expect("the embedded DejaVu font is a valid TrueType font")
}

fn font(face: Face) -> &'static FontRef<'static> {
    match face {
        Face::Regular => &REGULAR,
        Face::Bold => &BOLD,
    }
}

/// ab_glyph scales by ascent + descent, we by the em.
fn scale(font: &FontRef<'_>, size_px: f64) -> PxScale {
    let em = font.units_per_em().expect("DejaVu states its units per em");
    PxScale::from(size_px as f32 * font.height_unscaled() / em)
}

/// Width of one line of text in pixels.
pub fn width_px(line: &str, size_px: f64, face: Face) -> f64 {
    let font = font(face);
    let scaled = font.as_scaled(scale(font, size_px));
    let mut width = 0.0;
    let mut previous = None;
    for glyph in line.chars().map(|c| scaled.glyph_id(c)) {
        width += scaled.h_advance(glyph) + previous.map_or(0.0, |p| scaled.kern(p, glyph));
        previous = Some(glyph);
    }
    f64::from(width)
}

/// Calls `put(column, row, coverage)` for every pixel of a line whose baseline starts at `origin`.
pub fn for_each_pixel(
    line: &str,
    size_px: f64,
    face: Face,
    origin: (f32, f32),
    mut put: impl FnMut(i32, i32, f32),
) {
    let font = font(face);
    let px_scale = scale(font, size_px);
    let scaled = font.as_scaled(px_scale);
    // A whole-pixel baseline keeps the feet of the letters sharp.
    let baseline = origin.1.round();
    let mut pen = origin.0;
    let mut previous = None;
    for id in line.chars().map(|c| scaled.glyph_id(c)) {
        pen += previous.map_or(0.0, |p| scaled.kern(p, id));
        let glyph = id.with_scale_and_position(px_scale, point(pen, baseline));
        if let Some(outline) = font.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, coverage| {
                put(
                    corner.x as i32 + x as i32,
                    corner.y as i32 + y as i32,
                    coverage,
                )
            });
        }
        pen += scaled.h_advance(id);
        previous = Some(id);
    }
}

/// The text cut to `room_px`, ending in an ellipsis if something was cut.
pub fn shorten(line: &str, room_px: f64, size_px: f64, face: Face) -> String {
    if width_px(line, size_px, face) <= room_px {
        return line.to_owned();
    }
    let mut kept: String = line.to_owned();
    while kept.pop().is_some() {
        let candidate = format!("{}…", kept.trim_end());
        if width_px(&candidate, size_px, face) <= room_px {
            return candidate;
        }
    }
    String::new()
}

/// The text in at most `max_lines` lines of `room_px`: broken at spaces and line ends, words that
/// are too long and what does not fit shortened with an ellipsis. A separator " ·" is dropped at
/// the end of a line, whose end separates enough.
pub fn wrap(text: &str, room_px: f64, size_px: f64, face: Face, max_lines: usize) -> Vec<String> {
    let fits = |line: &str| width_px(line, size_px, face) <= room_px;
    let mut lines: Vec<String> = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            let longer = if line.is_empty() {
                word.to_owned()
            } else {
                format!("{line} {word}")
            };
            if fits(&longer) || line.is_empty() {
                line = longer;
            } else {
                lines.push(std::mem::replace(&mut line, word.to_owned()));
            }
        }
        lines.push(line);
    }
    if lines.len() > max_lines.max(1) {
        let rest = lines.split_off(max_lines.max(1) - 1);
        lines.push(rest.join(" "));
    }
    lines
        .iter()
        .map(|line| shorten(line.trim_end_matches(" ·"), room_px, size_px, face))
        .collect()
}
