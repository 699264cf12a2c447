//! Recordings in public formats into raw sightings, which the tracker turns into detections.
//!
//! One file per format. Identities in a recording are carried through as truth and decide nothing.

mod error;
mod range_bearing;

pub use error::ImportError;
pub use range_bearing::{SensorNoise, read_range_bearing};
