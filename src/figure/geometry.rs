//! Positions and rectangles on a page, in pixels: x to the right, y down.

/// A position in pixels.
pub type Point = (f64, f64);

/// A rectangle in pixels, `x0 ≤ x1` and `y0 ≤ y1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub x0: f64,
    /// Upper edge.
    pub y0: f64,
    /// Right edge.
    pub x1: f64,
    /// Lower edge.
    pub y1: f64,
}

impl Rect {
    /// A rectangle from its edges; a negative extent becomes zero.
    pub fn new(x0: f64, y0: f64, x1: f64, y1: f64) -> Self {
        Self {
            x0,
            y0,
            x1: x1.max(x0),
            y1: y1.max(y0),
        }
    }

    /// Horizontal extent.
    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    /// Vertical extent.
    pub fn height(&self) -> f64 {
        self.y1 - self.y0
    }

    /// The middle.
    pub fn centre(&self) -> Point {
        ((self.x0 + self.x1) / 2.0, (self.y0 + self.y1) / 2.0)
    }

    /// The rectangle without a margin on each side: left, top, right, bottom.
    pub fn inset(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(
            self.x0 + left,
            self.y0 + top,
            self.x1 - right,
            self.y1 - bottom,
        )
    }

    /// Cell (`column`, `row`) of a grid over the rectangle with `gap` between the cells.
    pub fn cell(
        &self,
        (column, columns): (usize, usize),
        (row, rows): (usize, usize),
        gap: f64,
    ) -> Self {
        let width = (self.width() - gap * (columns.max(1) - 1) as f64) / columns.max(1) as f64;
        let height = (self.height() - gap * (rows.max(1) - 1) as f64) / rows.max(1) as f64;
        let x0 = self.x0 + column as f64 * (width + gap);
        let y0 = self.y0 + row as f64 * (height + gap);
        Self::new(x0, y0, x0 + width, y0 + height)
    }

    /// Whether the line from `a` to `b` passes through (Liang & Barsky 1984).
    pub fn meets(&self, a: Point, b: Point) -> bool {
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (from, to, low, high) in [(a.0, b.0, self.x0, self.x1), (a.1, b.1, self.y0, self.y1)] {
            let step = to - from;
            if step == 0.0 {
                if from < low || from > high {
                    return false;
                }
                continue;
            }
            let (first, second) = ((low - from) / step, (high - from) / step);
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        enter <= leave
    }

    /// Whether the interiors meet.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }
}
