//! Parameter sweeps and diagnostics for Probabilistic Topological Maps.

pub mod detections;
pub mod rng;
pub mod sighting;
pub mod tracker;
pub mod world;
