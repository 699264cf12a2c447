//! Parameter sweeps and diagnostics for Probabilistic Topological Maps.

pub mod chain;
pub mod dataset;
pub mod detections;
pub mod diagnostics;
pub mod exact;
pub mod figure;
pub mod import;
pub mod map;
pub mod model;
pub mod partition;
pub mod report;
pub mod results;
pub mod rng;
pub mod run;
pub mod sampler;
pub mod settings;
pub mod sighting;
pub mod sweep;
pub mod table;
pub mod tracker;
pub mod tune;
pub mod world;
