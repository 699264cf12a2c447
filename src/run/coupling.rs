//! The pair of coupled chains that a chain sends out: when they met.

use serde::{Deserialize, Serialize};

use crate::chain::{Meeting, Pair, Start};
use crate::model::Model;
use crate::rng::Purpose;
use crate::settings::Settings;

/// A pair may go so many times as far as its chain.
const PAIR_PER_CHAIN: u64 = 10;

/// What became of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CouplingOutcome {
    /// Proposals that one chain is ahead.
    pub lag: u64,
    /// Proposals of the chain ahead until they met, or until they were given up.
    pub n_steps: u64,
    /// Whether they met.
    pub met: bool,
}

/// Sends out the pair of a chain of so many steps, if the settings ask for one; `None` if it was
/// told to stop.
pub(super) fn send(
    (model, settings): (&Model, &Settings),
    (start, n_steps): (&Start, u64),
    purpose: &Purpose,
    stop: &dyn Fn() -> bool,
) -> Option<Option<CouplingOutcome>> {
    let lag = settings.count("coupling_lag");
    if lag == 0 {
        return Some(None);
    }
    let sampler = settings.sampler(model.n_detections());
    let pair = Pair {
        model,
        prior: settings.prior(),
        settings: &sampler,
        start,
        lag,
    };
    let most = PAIR_PER_CHAIN.saturating_mul(n_steps);
    let (n_steps, met) = match pair.meet(most, purpose, stop) {
        Meeting::Met(step) => (step, true),
        Meeting::Apart(step) => (step, false),
        Meeting::Stopped => return None,
    };
    Some(Some(CouplingOutcome { lag, n_steps, met }))
}
