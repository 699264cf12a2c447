//! Diagnostics: slices in, an estimate with its uncertainty out. One per file.
//!
//! What is undefined is `None`, or a variant with a reason; never 0.

pub mod agreement;
pub mod beta;
pub mod burn_in;
pub mod chains;
pub mod co_clustering;
pub mod ess;
pub mod interval;
pub mod mcse;
pub mod moments;
pub mod normal;
pub mod pareto;
pub mod r_hat;
pub mod ranks;
pub mod rate;
pub mod recovery;
pub mod trace_bins;
pub mod undefined;

#[cfg(test)]
mod tests;
