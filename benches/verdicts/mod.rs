//! Verdicts on chains whose posterior is known: the parts that the bench and a test share.

pub mod proximity;
pub mod rates;
pub mod study;
pub mod target;
pub mod truth;
