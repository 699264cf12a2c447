//! What speaks against convergence, and the verdict.

use std::fmt;

use super::quantity::Quantity;
use crate::diagnostics::r_hat::MAX_R_HAT;
use crate::diagnostics::undefined::Undefined;

/// One thing that speaks against convergence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// A single chain has nothing to be compared with.
    OneChain,
    /// All chains started at one topology, and no probe started elsewhere.
    OneStart,
    /// Too few draws are left after burn-in.
    TooShort {
        /// Draws of each chain.
        n_draws: u64,
        /// How many there should be.
        least: u64,
    },
    /// R-hat above [`MAX_R_HAT`].
    RHat {
        /// Of what.
        of: Quantity,
        /// How large.
        value: f64,
    },
    /// Fewer effective draws than are needed.
    Ess {
        /// Of what.
        of: Quantity,
        /// How many, in all chains.
        value: f64,
        /// How many there should be.
        least: f64,
    },
    /// What it would be judged by is undefined.
    Undefined {
        /// Of what.
        of: Quantity,
        /// Why.
        reason: Undefined,
    },
    /// Topologies further apart than chance explains.
    Topologies {
        /// The largest total variation between two chains.
        distance: f64,
        /// 95 % quantile of the null.
        null_95: f64,
    },
    /// Nothing material changes, but the chains are not at rest at one topology either.
    Unsettled {
        /// The smallest share of a chain's draws at the topology visited most by all chains.
        share: f64,
        /// How large it should be.
        least: f64,
    },
    /// The chains rest, but came there too late to tell that they stay.
    Late {
        /// Proposals since the last chain came.
        n_steps: u64,
        /// The longest stay of any chain elsewhere, proposals.
        hold: u64,
        /// Proposals that there should be.
        least: u64,
    },
    /// Probes that did not come to where the chains are.
    Probes {
        /// Those that did not come.
        n_lost: usize,
        /// All of them.
        n: usize,
    },
    /// Frequencies further from the exact posterior than their error explains.
    Exact {
        /// The probability that is off, by the exact posterior.
        exact: f64,
        /// Its share in the draws of all chains.
        sampled: f64,
        /// How far apart they may be.
        most: f64,
    },
    /// Chains from other starts that have converged by themselves as well are elsewhere.
    Starts {
        /// In what; `None` is the MAP topology of chains at rest.
        of: Option<Quantity>,
        /// Nested R-hat; `None` where all stand still.
        value: Option<f64>,
        /// What it stays below if the starts are forgotten.
        most: f64,
    },
}

impl Doubt {
    /// One word, for tables.
    pub fn word(&self) -> String {
        match self {
            Self::OneChain => "one-chain".to_owned(),
            Self::OneStart => "one-start".to_owned(),
            Self::TooShort { .. } => "too-short".to_owned(),
            Self::RHat { of, .. } => format!("r-hat of {}", of.word()),
            Self::Ess { of, .. } => format!("ess of {}", of.word()),
            Self::Undefined { of, reason } => format!("{} {}", reason.name(), of.word()),
            Self::Topologies { .. } => "topologies".to_owned(),
            Self::Unsettled { .. } => "unsettled".to_owned(),
            Self::Late { .. } => "late".to_owned(),
            Self::Probes { .. } => "probes".to_owned(),
            Self::Exact { .. } => "far-from-exact".to_owned(),
            Self::Starts { of, .. } => {
                format!("starts of {}", of.map_or("MAP topology", Quantity::word))
            }
        }
    }
}

impl Doubt {
    /// In a sentence, of chains that another program ran: it has no settings of ours, and its steps
    /// are draws.
    pub fn of_others(&self) -> String {
        match self {
            Self::OneStart => "all chains begin with the same topology; start them at topologies \
                               that differ, or give the draws before they met"
                .to_owned(),
            Self::Late { .. } => self.to_string().replace(" proposals ", " draws "),
            _ => self.to_string(),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneChain => write!(f, "one chain has nothing to be compared with"),
            Self::OneStart => write!(
                f,
                "all chains started at one topology and no probe started elsewhere; \
                 use init apart, or probes"
            ),
            Self::TooShort { n_draws, least } => {
                write!(
                    f,
                    "{n_draws} draws are left of each chain (at least {least})"
                )
            }
            Self::RHat { of, value } => {
                // So many digits that it is not the limit itself.
                let digits = if *value < MAX_R_HAT + 0.0005 { 5 } else { 3 };
                write!(f, "R-hat of {of} is {value:.digits$} (at most {MAX_R_HAT})")
            }
            Self::Ess { of, value, least } => {
                write!(f, "ESS of {of} is {value:.0} (at least {least:.0})")
            }
            Self::Undefined { of, reason } => write!(f, "{of} is {reason}"),
            Self::Topologies { distance, null_95 } => write!(
                f,
                "topologies of two chains are {distance:.2} apart (by chance up to {null_95:.2})"
            ),
            Self::Unsettled { share, least } => write!(
                f,
                "a chain spends {:.0} % of its draws at the first topology (at least {:.0} %)",
                100.0 * share,
                100.0 * least
            ),
            Self::Late {
                n_steps,
                hold,
                least,
            } => write!(
                f,
                "the last chain came to the first topology {n_steps} proposals before the end (at \
                 least {least}, as another topology held a chain for {hold})"
            ),
            Self::Probes { n_lost, n } => write!(
                f,
                "{n_lost} of {n} probes from random starts did not come to where the chains are"
            ),
            Self::Exact {
                exact,
                sampled,
                most,
            } => write!(
                f,
                "a probability is {sampled:.3} in the draws and {exact:.3} by the exact posterior \
                 (at most {most:.3} apart)"
            ),
            Self::Starts {
                of,
                value: Some(value),
                most,
            } => {
                let name = of.map_or("the MAP topology".to_owned(), |of| of.to_string());
                write!(
                    f,
                    "chains from another start converged elsewhere: nested R-hat of {name} is \
                     {value:.3} (at most {most:.3})"
                )
            }
            Self::Starts {
                of, value: None, ..
            } => {
                let name = of.map_or("MAP topology".to_owned(), |of| of.to_string());
                write!(
                    f,
                    "chains from another start came to rest at another {name}"
                )
            }
        }
    }
}

/// Whether chains have converged.
#[derive(Clone, Debug, PartialEq)]
pub enum Convergence {
    /// They mix, and agree.
    Mixes,
    /// They came to one and the same topology, and hardly leave it.
    AtRest,
    /// Their frequencies are those of the exact posterior.
    Exact {
        /// The largest difference between a probability and its share in the draws.
        largest: f64,
    },
    /// It is not shown.
    Not(Vec<Doubt>),
}

impl Convergence {
    /// Whether they have.
    pub fn is_shown(&self) -> bool {
        self.doubts().is_empty()
    }

    /// What speaks against it; nothing if it is shown.
    pub fn doubts(&self) -> &[Doubt] {
        match self {
            Self::Not(doubts) => doubts,
            Self::Mixes | Self::AtRest | Self::Exact { .. } => &[],
        }
    }

    /// `mixes`, `at-rest`, `exact` or `not-shown`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Mixes => "mixes",
            Self::AtRest => "at-rest",
            Self::Exact { .. } => "exact",
            Self::Not(_) => "not-shown",
        }
    }
}
