//! What detections themselves say: a normalised likelihood of noise, revisits and drift, sampled.
//!
//! π(T) of the models leaves out the normaliser of P(X|T), so its value compares no settings. [`mixture`] has a
//! likelihood that does; [`drift`] what detections of one mission have in common, which it can take into account;
//! [`align()`] moves detections to where they would be without.

pub mod align;
pub mod drift;
mod factors;
pub mod mixture;
mod prior;
#[cfg(test)]
mod tests;

pub use align::{AlignError, Alignment, align};
pub use drift::{DriftError, SharedDrift};
pub use mixture::{Draw, Mixture};
