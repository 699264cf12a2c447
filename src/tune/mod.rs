//! Settings from data without truth.
//!
//! So far this room holds the scales that any choice of settings starts from ([`scales`]).

pub mod scales;
