//! Whole missions: which sightings are of one landmark, with poses and landmarks integrated out.
//!
//! Sightings s are seen from poses p_k in the plane, odometry u_k of covariance Q_k joins the
//! poses, and landmarks l_m are points. A partition T of the sightings, in which no two of one scan
//! are of one landmark, has the posterior
//!
//!   p(T | y, u) ∝ P(T) ∫∫ Π_k N(p_{k+1} ⊖ p_k; u_k, Q_k) Π_s N(y_s; h(p_{k(s)}, l_{T(s)}), R_s)
//!                     Π_m 1/A dl dp,
//!
//! A the explored area and P(T) a prior that knows what was in view (`view`). It is normalised, so
//! partitions compare without a penalty and the noise of the sensor is the only setting.
//!
//! At a linearisation point the poses are eliminated once for all partitions (`linear`, `poses`).
//! What is left is a joint Gaussian of the landmarks (`joint`) in which joining two landmarks, or
//! taking a block of sightings out of one, is an update of rank two (`state`, `placing`). On it
//! stand two front ends (`front`, `scan`, `closure`), a search that only goes up (`search`,
//! `joining`, `finish`), and sweeps at temperature 1 that draw from the posterior (`sweeps`).
//! Partitions found at different linearisation points are compared at their own optimum
//! (`optimum`). [`solve`] goes the whole way; [`Online`] goes with the robot, by the same front end.
//!
//! Compare Dellaert & Kaess, IJRR 25(12), 2006, for the elimination of poses, and Neira & Tardós,
//! IEEE T-RA 17(6), 2001, for joint compatibility, which the beam of `scan` replaces by
//! probabilities.

mod calibration;
mod candidates;
mod closure;
mod duplicates;
mod error;
mod finish;
mod fit;
mod front;
mod graph;
mod joining;
mod joint;
mod kernels;
mod linear;
mod noise;
mod online;
mod open;
mod optimum;
mod placing;
mod poses;
mod scan;
mod search;
mod solution;
mod solve;
mod state;
mod sweeps;
#[cfg(test)]
mod tests;
mod view;
mod write;

pub use error::MissionError;
pub use fit::{Fit, Misfit, fit};
pub use graph::{Graph, Observation, Odometry};
pub use noise::NoiseFactors;
pub use online::Online;
pub use optimum::Optimum;
pub use solution::{Solution, SolveSettings, SolvedLandmark, SolvedMap, Stage};
pub use solve::{optimum_of, solve};
pub use write::{g2o, sightings_csv, tum};
