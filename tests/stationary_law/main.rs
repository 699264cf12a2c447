//! Chains against the law that enumeration gives them.
//!
//! Every threshold comes from the null distribution at the chain's effective sample size
//! ([`statistic::threshold`]); seeds are fixed, and nothing is tried again.

mod explicit;
mod invariance;
mod matrix;
mod options;
mod statistic;
