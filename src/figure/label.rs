//! One line of text and where it is anchored.

use super::geometry::{Point, Rect};
use super::style::{Colour, INK};
use super::text::{self, Face};

/// One line of text with its anchor.
#[derive(Clone, Debug)]
pub struct Label {
    pub(super) text: String,
    pub(super) at: Point,
    pub(super) size_px: f64,
    pub(super) face: Face,
    pub(super) colour: Colour,
    // Share of the width to the left of the anchor, and of the height above it: 0, ½ or 1.
    pub(super) along: f64,
    pub(super) down: f64,
    pub(super) upward: bool,
}

impl Label {
    /// A label whose upper left corner is at `at`.
    pub fn new(text: impl Into<String>, at: Point, size_px: f64) -> Self {
        let (along, down) = (0.0, 0.0);
        Self {
            text: text.into(),
            at,
            size_px,
            face: Face::Regular,
            colour: INK,
            along,
            down,
            upward: false,
        }
    }

    /// In bold.
    #[must_use]
    pub fn bold(self) -> Self {
        Self {
            face: Face::Bold,
            ..self
        }
    }

    /// In another colour.
    #[must_use]
    pub fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// Horizontally centred on the anchor (along the line, if turned).
    #[must_use]
    pub fn centred(self) -> Self {
        Self { along: 0.5, ..self }
    }

    /// Ending at the anchor.
    #[must_use]
    pub fn ending(self) -> Self {
        Self { along: 1.0, ..self }
    }

    /// Vertically centred on the anchor.
    #[must_use]
    pub fn middle(self) -> Self {
        Self { down: 0.5, ..self }
    }

    /// Standing on the anchor.
    #[must_use]
    pub fn above(self) -> Self {
        Self { down: 1.0, ..self }
    }

    /// Read from bottom to top.
    #[must_use]
    pub fn upward(self) -> Self {
        Self {
            upward: true,
            ..self
        }
    }

    /// The box of the text on the page.
    pub fn bounds(&self) -> Rect {
        let width = text::width_px(&self.text, self.size_px, self.face);
        let height = self.size_px * text::HEIGHT_EM;
        let (x, y) = self.at;
        let left = -self.along * width;
        let top = match self.down {
            0.5 => self.size_px * (text::HALF_CAPITAL_EM - text::ASCENT_EM),
            down => -down * height,
        };
        if self.upward {
            Rect::new(x + top, y - left - width, x + top + height, y - left)
        } else {
            Rect::new(x + left, y + top, x + left + width, y + top + height)
        }
    }

    /// The characters.
    pub fn text(&self) -> &str {
        &self.text
    }
}
