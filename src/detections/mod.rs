//! The data set: landmark detections in mission order, and their CSV.

mod csv;
mod error;

use std::fmt;

/// What a corner looks like from where it was seen (source report, section 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Corner {
    /// One wall and a gap.
    Open,
    /// Both walls.
    Closed,
}

impl Corner {
    /// The name used in the CSV.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
        }
    }
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A symmetric 2×2 covariance, m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance {
    /// Variance of x, m².
    pub xx: f64,
    /// Covariance of x and y, m².
    pub xy: f64,
    /// Variance of y, m².
    pub yy: f64,
}

/// One detection: a coherent group of sightings of what the robot took for one landmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Position z, m, in the frame of the believed path.
    pub position_m: [f64; 2],
    /// Covariance C of the position, m².
    pub covariance_m2: Option<Covariance>,
    /// Time of the first sighting, s.
    pub first_seen_s: Option<f64>,
    /// Time of the last sighting, s.
    pub last_seen_s: Option<f64>,
    /// What the corner looked like in most sightings.
    pub corner: Option<Corner>,
    /// The landmark of more than half of the sightings; never read by a sampler.
    pub landmark: Option<i64>,
}

impl Detection {
    /// A detection of which only the position is known.
    pub fn at(x_m: f64, y_m: f64) -> Self {
        Self {
            position_m: [x_m, y_m],
            covariance_m2: None,
            first_seen_s: None,
            last_seen_s: None,
            corner: None,
            landmark: None,
        }
    }
}

/// Detections in mission order. At least one; positions finite; covariances all or none.
#[derive(Clone, Debug, PartialEq)]
pub struct Detections {
    rows: Vec<Detection>,
}
