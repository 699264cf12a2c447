//! Parameter sweeps and diagnostics for Probabilistic Topological Maps.

pub mod chain;
pub mod detections;
pub mod diagnostics;
pub mod exact;
pub mod model;
pub mod partition;
pub mod rng;
pub mod sampler;
pub mod settings;
pub mod sweep;
