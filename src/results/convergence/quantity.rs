//! Diagnostics of one number along the chains.

use std::fmt;

use crate::diagnostics::chains::Chains;
use crate::diagnostics::ess::{Ess, TailEss, ess_bulk, ess_quantile};
use crate::diagnostics::mcse;
use crate::diagnostics::r_hat::{MAX_R_HAT, r_hat};
use crate::diagnostics::ranks::Ordered;
use crate::diagnostics::undefined::Undefined;

/// What a verdict looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The number of sets M.
    NSets,
    /// Whether a chain stands at the topology of this rank among those sampled most, from 1.
    Topology(usize),
    /// Whether these two detections share a set.
    Pair(u32, u32),
}

impl Quantity {
    /// One word, for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::NSets => "M",
            Self::Topology(_) => "topology",
            Self::Pair(..) => "pair",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NSets => write!(f, "M"),
            Self::Topology(rank) => write!(f, "the share of topology {rank}"),
            Self::Pair(i, j) => write!(f, "the pair {i} and {j}"),
        }
    }
}

/// A tail of less than half of its nominal share, or of more than twice, is none.
const TAIL: f64 = 0.05;

/// ESS in both tails, [`Undefined::Atom`] for a quantile amid so many equal draws that it marks no tail.
fn tails(chains: &Chains) -> TailEss {
    let of = |nominal: f64, is_tail: fn(f64) -> bool| -> Result<Ess, Undefined> {
        let quantile = Ordered::new(chains).quantile(nominal);
        let share = chains.map(|x| f64::from(u8::from(x <= quantile))).mean();
        if chains.standstill().is_none() && !is_tail(share) {
            return Err(Undefined::Atom { share, nominal });
        }
        ess_quantile(chains, nominal)
    };
    TailEss {
        low: of(TAIL, |share| share <= 2.0 * TAIL),
        high: of(1.0 - TAIL, |share| 1.0 - share >= TAIL / 2.0),
    }
}

/// Diagnostics of one number that changes along the chains.
#[derive(Clone, Copy, Debug)]
pub struct QuantityDiagnosis {
    /// Rank-normalised split R-hat, the larger of location and spread.
    pub r_hat: Result<f64, Undefined>,
    /// Effective draws for the bulk, of all chains together.
    pub ess_bulk: Result<f64, Undefined>,
    /// Effective draws for the 5 % and 95 % tails, the smaller.
    pub ess_tail: Result<f64, Undefined>,
    /// Draws that are worth an independent one: those of all chains over `ess_bulk`.
    pub autocorrelation_time: Result<f64, Undefined>,
    /// The mean of all draws, defined for constants too.
    pub mean: Result<f64, Undefined>,
    /// The Monte Carlo standard error of the mean.
    pub mcse: Result<f64, Undefined>,
}

impl QuantityDiagnosis {
    pub(super) fn new(chains: &Result<Chains, Undefined>) -> Self {
        let chains = chains.as_ref().map_err(|reason| *reason);
        let of = |value: &dyn Fn(&Chains) -> Result<f64, Undefined>| chains.and_then(value);
        let bulk = chains.and_then(ess_bulk);
        Self {
            r_hat: of(&|chains| Ok(r_hat(chains)?.value())),
            ess_bulk: bulk.map(|bulk| bulk.ess),
            ess_tail: of(&|chains| Ok(tails(chains).value()?.ess)),
            autocorrelation_time: bulk.map(|bulk| bulk.autocorrelation_time()),
            mean: of(&|chains| Ok(chains.mean())),
            mcse: of(&|chains| Ok(mcse::mean(chains)?.mcse)),
        }
    }

    /// Leaves out what a verdict does not rest on and what would read as speaking against it.
    pub(super) fn set_aside(&mut self, least_ess: f64) {
        let is_above = |value: Result<f64, Undefined>, most: f64| {
            value.map_or_else(|reason| reason.is_disagreement(), |value| value > most)
        };
        if is_above(self.r_hat, MAX_R_HAT) {
            self.r_hat = Err(Undefined::NotJudged);
        }
        for ess in [&mut self.ess_bulk, &mut self.ess_tail] {
            if ess.map_or_else(|reason| reason.is_disagreement(), |value| value < least_ess) {
                *ess = Err(Undefined::NotJudged);
            }
        }
        if self.ess_bulk == Err(Undefined::NotJudged) {
            self.autocorrelation_time = Err(Undefined::NotJudged);
            self.mcse = Err(Undefined::NotJudged);
        }
    }
}
