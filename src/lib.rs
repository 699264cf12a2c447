//! Parameter sweeps and diagnostics for Probabilistic Topological Maps.

pub mod detections;
pub mod figure;
pub mod rng;
