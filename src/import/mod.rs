//! Recordings in public formats into raw sightings, which the tracker turns into detections.
//!
//! One file per format; each gives one [`Recording`], a stream of stops with odometry in between.
//! Dead reckoning turns it into sightings that keep account of how unsure their frame is. Identities
//! and true places in a recording are carried through as truth and decide nothing.

mod dead_reckoning;
mod error;
mod format;
mod g2o;
mod g2o_chain;
mod g2o_measure;
mod g2o_tags;
mod lines;
mod mrclam;
mod opened;
mod range_bearing;
mod recording;
#[cfg(test)]
mod tests;
mod truth;
mod units;

pub use dead_reckoning::{DriftNoise, Noise, SensorNoise, dead_reckon};
pub use error::ImportError;
pub use format::{FORMATS, Format, PRESET_KEYS};
pub use g2o::read_g2o;
pub use mrclam::read_mrclam;
pub use opened::{Choices, Opened};
pub use range_bearing::{RowIdentity, range_bearing_csv, read_range_bearing};
pub use recording::{Increment, Recording, Seen, Stop};
pub use truth::{Truth, read_truth};
pub use units::{Stated, information_doubt};
