//! Diagnostics: slices in, an estimate with its uncertainty out. One per file.
//!
//! What is undefined is `None`, or a variant with a reason; never 0.

pub mod agreement;
pub mod burn_in;
pub mod co_clustering;
pub mod exact_distance;
pub mod interval;
pub mod moments;
pub mod pareto;
pub mod rate;
pub mod recovery;
pub mod trace_bins;
