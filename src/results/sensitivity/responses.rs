//! The numbers that settings act on, by cell and independent unit.
//!
//! The unit is the simulated world, whose number is the same in every cell: cells share their worlds. On a
//! single data set the units are the chain numbers, and nothing is said of other data.

use std::collections::HashMap;

use crate::results::{Answer, ChainResult, Fault, Sorted, Verdict, WorldResult};
use crate::sweep::Sweep;

/// What is asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Response {
    /// Share of chains whose MAP topology is the truth.
    Recovery,
    /// Share of worlds that are recovered and on which the chains converged: recovery behind its gate.
    RecoveredConverged,
    /// Share of worlds on which the chains are shown to have converged.
    Converged,
    /// Accepted over proposed.
    Acceptance,
    /// log₁₀ of the effective independent topologies of a world's chains, one at least for each: it spans
    /// powers of ten, and a difference of 1 is a factor of ten.
    LogEss,
    /// M after burn-in.
    NSets,
    /// Share of posteriors whose MAP topology is the truth, of those that are known: what the best sampler would recover.
    PosteriorHasTruth,
    /// Share of chains that failed for this fault.
    FaultOf(Fault),
}

impl Response {
    /// All, in the order of tables.
    pub const ALL: [Self; 11] = [
        Self::Recovery,
        Self::RecoveredConverged,
        Self::Converged,
        Self::Acceptance,
        Self::LogEss,
        Self::NSets,
        Self::PosteriorHasTruth,
        Self::FaultOf(Fault::Model),
        Self::FaultOf(Fault::Sampler),
        Self::FaultOf(Fault::Arithmetic),
        Self::FaultOf(Fault::Undecided),
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recovery => "recovery",
            Self::RecoveredConverged => "recovered_and_converged",
            Self::Converged => "converged",
            Self::Acceptance => "acceptance",
            Self::LogEss => "log10_ess",
            Self::NSets => "n_sets",
            Self::PosteriorHasTruth => "posterior_has_truth",
            Self::FaultOf(Fault::Model) => "fault_of_model",
            Self::FaultOf(Fault::Sampler) => "fault_of_sampler",
            Self::FaultOf(Fault::Arithmetic) => "fault_of_arithmetic",
            Self::FaultOf(Fault::Undecided) => "fault_undecided",
        }
    }

    /// Its name in figures and sentences.
    pub fn words(self) -> &'static str {
        match self {
            Self::Recovery => "recovery rate",
            Self::RecoveredConverged => "recovered and converged",
            Self::Converged => "converged",
            Self::Acceptance => "acceptance rate",
            Self::LogEss => "log₁₀ ESS of topologies",
            Self::NSets => "M",
            Self::PosteriorHasTruth => "posterior has the truth",
            Self::FaultOf(Fault::Model) => "fault of the model",
            Self::FaultOf(Fault::Sampler) => "fault of the sampler",
            Self::FaultOf(Fault::Arithmetic) => "fault of arithmetic",
            Self::FaultOf(Fault::Undecided) => "fault undecided",
        }
    }

    /// Whether it lies between 0 and 1.
    pub fn is_share(self) -> bool {
        !matches!(self, Self::LogEss | Self::NSets)
    }

    /// Whether it is of all chains on a world together.
    fn is_of_world(self) -> bool {
        matches!(
            self,
            Self::RecoveredConverged | Self::Converged | Self::LogEss | Self::PosteriorHasTruth
        )
    }

    fn of_chain(self, chain: &ChainResult) -> Option<f64> {
        let outcome = chain.outcome()?;
        let flag = |is: bool| f64::from(u8::from(is));
        match self {
            Self::Recovery => outcome.recovered.map(flag),
            Self::FaultOf(fault) => Some(flag(chain.sorted? == Sorted::Failed(fault))),
            Self::Acceptance => Some(outcome.acceptance_rate),
            Self::NSets => Some(outcome.mean_n_sets),
            _ => None,
        }
    }

    fn of_world(self, world: &WorldResult, knows_truth: bool) -> Option<f64> {
        if self == Self::PosteriorHasTruth {
            return match world.answer? {
                Answer::Truth => Some(1.0),
                Answer::OtherMap => Some(0.0),
                Answer::Undecided(_) => None,
            };
        }
        let diagnosis = world.diagnosis.as_ref()?;
        let flag = |is: bool| f64::from(u8::from(is));
        match self {
            Self::RecoveredConverged => {
                knows_truth.then(|| flag(world.verdict == Verdict::Recovered))
            }
            Self::Converged => Some(flag(world.has_converged())),
            Self::LogEss => Some(libm::log10(diagnosis.ess_topologies.max(1.0))),
            _ => None,
        }
    }
}

/// A response in every cell, unit by unit; `None` where no chain has it.
#[derive(Clone, Debug)]
pub struct ResponseValues {
    /// Which.
    pub response: Response,
    /// By cell, then by unit.
    pub by_cell: Vec<Vec<Option<f64>>>,
    /// Units.
    pub n_units: usize,
}

/// All responses that have a value anywhere; faults that occur. `chains` and `worlds` are those of the sweep, in order.
pub(super) fn responses(
    sweep: &Sweep,
    chains: &[ChainResult],
    worlds: &[WorldResult],
) -> Vec<ResponseValues> {
    let by_world = sweep.has_many_worlds();
    let n_cells = sweep.cells.len();
    // Cells that were given more worlds than all others would tilt the means of those.
    let n_common = sweep.n_replicates() as usize;
    let mut known = vec![false; n_cells];
    for chain in chains {
        known[chain.cell] |= chain.outcome().is_some_and(|o| o.recovered.is_some());
    }
    let of = |response: Response| {
        let of_world = response.is_of_world();
        let n_units = match (by_world, of_world) {
            (true, _) => n_common,
            (false, true) => 1,
            (false, false) => sweep.n_chains() as usize,
        };
        let mut sums: HashMap<(usize, usize), (f64, usize)> = HashMap::new();
        let mut add = |cell: usize, unit: u64, value: Option<f64>| {
            if let Some(value) = value
                && (unit as usize) < n_units
            {
                let (sum, n) = sums.entry((cell, unit as usize)).or_insert((0.0, 0));
                *sum += value;
                *n += 1;
            }
        };
        if of_world {
            for world in worlds {
                let value = response.of_world(world, known[world.cell]);
                add(world.cell, world.replicate, value);
            }
        } else {
            for chain in chains.iter().filter(|chain| !chain.is_repeat) {
                let unit = if by_world {
                    chain.replicate
                } else {
                    chain.chain
                };
                let value = response.of_chain(chain);
                add(chain.cell, unit, value);
            }
        }
        let mean =
            |cell: usize, unit: usize| sums.get(&(cell, unit)).map(|(sum, n)| sum / *n as f64);
        let row = |cell: usize| (0..n_units).map(|unit| mean(cell, unit)).collect();
        ResponseValues {
            response,
            by_cell: (0..n_cells).map(row).collect(),
            n_units,
        }
    };
    let mut all: Vec<ResponseValues> = Response::ALL.into_iter().map(of).collect();
    all.retain(|own| {
        let mut values = own.by_cell.iter().flatten().flatten();
        match own.response {
            Response::FaultOf(_) => values.any(|share| *share > 0.0),
            _ => values.next().is_some(),
        }
    });
    all
}
