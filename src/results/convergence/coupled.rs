//! What the coupled chains of one data set say of how far chains are from the posterior.

use crate::diagnostics::coupling::{Bound, steps_until, total_variation};
use crate::run::{ChainOutcome, CouplingOutcome};

/// Total variation that counts as being at the posterior.
const NEAR: f64 = 0.01;
/// Pairs without which a mean over them says nothing of so small a distance.
const LEAST_PAIRS: usize = 100;

/// The pairs of coupled chains that the chains of one data set sent out.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupled {
    /// Proposals that one chain of a pair is ahead.
    pub lag: u64,
    /// Pairs.
    pub n_pairs: usize,
    /// Pairs that met.
    pub n_met: usize,
    /// Proposals of the chain ahead when the last pair met; `None` if none did.
    pub last_met: Option<u64>,
    /// Where all met: the estimated bound on the total variation to the posterior after the burn-in.
    pub after_burn_in: Option<Bound>,
    /// Where all of a hundred pairs or more met: proposals after which that is at most 0.01.
    pub until_near: Option<u64>,
}

/// Of chains that sent out pairs, `first_step` being the longest burn-in; `None` if none did.
pub(super) fn coupled(chains: &[&ChainOutcome], first_step: u64) -> Option<Coupled> {
    let pairs: Vec<CouplingOutcome> = chains.iter().filter_map(|own| own.coupling).collect();
    let lag = pairs.first()?.lag;
    let met: Vec<u64> = pairs
        .iter()
        .filter(|own| own.met)
        .map(|own| own.n_steps)
        .collect();
    let all_met = met.len() == pairs.len();
    Some(Coupled {
        lag,
        n_pairs: pairs.len(),
        n_met: met.len(),
        last_met: met.iter().max().copied(),
        after_burn_in: all_met.then(|| total_variation(&met, lag, first_step)),
        until_near: (all_met && met.len() >= LEAST_PAIRS).then(|| steps_until(&met, lag, NEAR)),
    })
}
