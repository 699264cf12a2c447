//! Diagnostics: slices in, an estimate with its uncertainty out. One per file.
//!
//! What is undefined is `None`, or a variant with a reason; never 0.

pub mod agreement;
mod autocovariance;
pub mod beta;
pub mod burn_in;
pub mod calibration;
pub mod chains;
pub mod co_clustering;
pub mod consistency;
pub mod contingency;
pub mod coupling;
pub mod credible_ball;
pub mod ess;
pub mod estimate_noise;
pub mod exact_distance;
pub mod geweke;
pub mod information;
pub mod interval;
pub mod longest_hold;
pub mod loss;
pub mod mass;
pub mod mcse;
pub mod moments;
pub mod morris;
pub mod multiplicity;
pub mod normal;
pub mod pair_counts;
pub mod pareto;
pub mod point_estimate;
pub mod r_hat;
pub mod rank_ecdf;
pub mod ranks;
pub mod rate;
pub mod rate_difference;
pub mod recovery;
pub mod representatives;
pub mod sobol_indices;
pub mod stratified;
pub mod student;
pub mod topology_distance;
pub mod topology_ess;
pub mod trace_bins;
pub mod undefined;
pub mod unseen_mass;
pub mod weights;

#[cfg(test)]
mod tests;
