//! Diagnostics: slices in, an estimate with its uncertainty out. One per file.
//!
//! What is undefined is `None`, or a variant with a reason; never 0.

pub mod agreement;
pub mod beta;
pub mod burn_in;
pub mod chains;
pub mod co_clustering;
pub mod contingency;
pub mod ess;
pub mod information;
pub mod interval;
pub mod mass;
pub mod mcse;
pub mod moments;
pub mod normal;
pub mod pair_counts;
pub mod pareto;
pub mod r_hat;
pub mod ranks;
pub mod rate;
pub mod recovery;
pub mod trace_bins;
pub mod undefined;
pub mod unseen_mass;

#[cfg(test)]
mod tests;
