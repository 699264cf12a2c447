//! The exact posterior where it is cheap: what callers use that have a chain to compare with, and no
//! time to wait.

use super::{Ended, ExactSettings, MAX_DETECTIONS, Posterior, posterior};
use crate::model::{Model, Prior};
use crate::partition::count;
use crate::rng::Purpose;

/// What an exact posterior may cost, in draws and not in seconds, so that a machine under load decides as
/// an idle one does.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Total variation to which the whole table is wanted.
    pub tolerance: f64,
    /// Draws of locations at most: about ten million a second on one core.
    pub max_draws: f64,
    /// Detections at most.
    pub max_detections: usize,
}

impl Default for Budget {
    /// About two seconds of one core: a table to a total variation of 0.01, of up to eight detections.
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            max_draws: 2e7,
            max_detections: 8,
        }
    }
}

/// Why there is no exact posterior for this budget.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TooExpensive {
    /// The detections are too many to enumerate their partitions.
    #[error("{n} detections are more than the {most} whose partitions are enumerated")]
    Detections {
        /// Detections.
        n: usize,
        /// The most.
        most: usize,
    },
    /// The draws do not do.
    #[error(
        "the exact posterior is known to a total variation of {total_variation:.2} after {n_draws:.0e} draws and \
         needs about {n_draws_needed:.0e}"
    )]
    Draws {
        /// Estimated total variation between the table and the posterior.
        total_variation: f64,
        /// Draws that were made.
        n_draws: f64,
        /// Draws that it takes in all, as far as these can tell.
        n_draws_needed: f64,
    },
}

/// The exact posterior, if it can be had for this budget: its table with an error below the tolerance.
/// A function of its arguments; neither the clock nor the number of threads has a say.
///
/// # Errors
/// The detections or the draws that it takes are too many.
pub fn affordable(
    model: &Model,
    prior: Prior,
    budget: &Budget,
    purpose: &Purpose,
) -> Result<Posterior, TooExpensive> {
    let n = model.n_detections();
    let most = budget.max_detections.min(MAX_DETECTIONS);
    if n > most {
        return Err(TooExpensive::Detections { n, most });
    }
    // Every partition is worth one draw at least.
    let n_partitions = count::bell(n).map_or(f64::INFINITY, |bell| bell as f64);
    if n_partitions > budget.max_draws {
        return Err(TooExpensive::Draws {
            total_variation: 1.0,
            n_draws: 0.0,
            n_draws_needed: n_partitions,
        });
    }
    let settings = ExactSettings {
        tolerance: budget.tolerance,
        max_draws: budget.max_draws,
    };
    let found = posterior(model, prior, &settings, purpose);
    match found.ended {
        Ended::Reached => Ok(found),
        Ended::OutOfDraws { n_draws_needed } | Ended::OutOfReach { n_draws_needed } => {
            Err(TooExpensive::Draws {
                total_variation: found.error.total(),
                n_draws: found.n_draws,
                n_draws_needed,
            })
        }
    }
}
