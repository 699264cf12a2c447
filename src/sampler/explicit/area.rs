//! A rectangle of the plane.

/// The rectangle, m, without its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) low_m: [f64; 2],
    pub(super) high_m: [f64; 2],
}

impl Area {
    /// The whole plane.
    pub(super) const EVERYWHERE: Self = Self {
        low_m: [f64::NEG_INFINITY; 2],
        high_m: [f64::INFINITY; 2],
    };

    /// Whether a point lies in it.
    #[inline(always)]
    pub(super) fn holds(&self, x_m: [f64; 2]) -> bool {
        let (low, high) = (self.low_m, self.high_m);
        (x_m[0] > low[0]) & (x_m[0] < high[0]) & (x_m[1] > low[1]) & (x_m[1] < high[1])
    }

    /// The same with its edges so far inside, or outside where that is negative.
    pub(super) fn inset(&self, by_m: f64) -> Self {
        Self {
            low_m: self.low_m.map(|low| low + by_m),
            high_m: self.high_m.map(|high| high - by_m),
        }
    }
}
