//! What a sweep found: chain records gathered into cells and factors, by way of the diagnostics.
//!
//! Tables and reports are made from this and from nothing else.

pub mod agreement;
mod cells;
pub mod compare;
pub mod convergence;
mod distance;
pub mod draws;
pub mod effects;
mod estimates;
pub mod evaluation;
pub mod exact;
mod fault;
pub mod labels;
pub mod levels;
mod pool;
mod posterior;
mod recommend;
pub mod sample;
pub mod sensitivity;
mod starts;
pub mod timing;
pub mod told_apart;
mod verdict;
mod word;
mod worlds;

pub use cells::{CellResult, cell_result, outcomes_by_world};
pub use convergence::{Convergence, Diagnosis, Doubt, Judged, Probes, Quantity, diagnose};
pub use distance::CellDistance;
pub use effects::{FactorEffect, PairEffect, factor_effects, marginal, pair_effect};
pub use fault::{Fault, Faults, Sorted};
pub use levels::verdicts_by_level;
pub use posterior::{Answer, Posterior, Unanswered};
pub use recommend::{Neighbourhood, Recommended};
pub use sensitivity::Sensitivity;
pub use starts::Starts;
pub use verdict::{CellVerdict, ToSettle, Verdict, WorldsByVerdict};
pub use worlds::WorldResult;

use std::collections::{BTreeMap, HashSet};

use crate::diagnostics::estimate_noise::{EstimateNoise, SamplesVerdict};
use crate::run::{ChainOutcome, ChainRecord, ChainStatus, Plan, Stop, Task};
use crate::sweep::Sweep;
use worlds::world_results;

/// One chain with where it belongs.
#[derive(Clone, Debug)]
pub struct ChainResult {
    /// The cell, by its index.
    pub cell: usize,
    /// The world, by its index among the plan's data sets.
    pub data: usize,
    /// The world's number, from 0.
    pub replicate: u64,
    /// The chain's number, from 0.
    pub chain: u64,
    /// Its identity.
    pub key: String,
    /// Whether it is the same chain as an earlier one of its cell: replicates of a world without noise
    /// are one and the same data set. Rates and means count it once.
    pub is_repeat: bool,
    /// What became of it.
    pub status: ChainStatus,
    /// Whose fault its failure is; `None` if its posterior was not asked for, or no truth is known.
    pub sorted: Option<Sorted>,
}

impl ChainResult {
    /// The summary, if the chain ran to its end.
    pub fn outcome(&self) -> Option<&ChainOutcome> {
        match &self.status {
            ChainStatus::Done(outcome) => Some(outcome),
            ChainStatus::Failed { .. } => None,
        }
    }

    /// Whose fault its failure is, unless it repeats a chain that was counted.
    pub fn sorted_once(&self) -> Option<Sorted> {
        self.sorted.filter(|_| !self.is_repeat)
    }
}

/// Everything that a sweep found.
pub struct SweepResults {
    /// All chains that were run, by cell, world and chain.
    pub chains: Vec<ChainResult>,
    /// All worlds of all cells, in their order, less those that repeat another.
    pub worlds: Vec<WorldResult>,
    /// The posteriors that cells asked for, in the order of the plan.
    pub posteriors: Vec<Posterior>,
    /// All cells, in their order.
    pub cells: Vec<CellResult>,
    /// The factors by falling effect on the recovery rate.
    pub effects: Vec<FactorEffect>,
    /// The two strongest factors together, if there are two.
    pub pair: Option<PairEffect>,
    /// What each factor does to each response, how surely, and with which other.
    pub sensitivity: Sensitivity,
    /// Noise of the log estimate by the number of importance samples; none of a design over a range of them.
    pub noise_by_samples: Vec<NoiseBySamples>,
    ranking: Vec<usize>,
    around: Vec<Neighbourhood>,
    recommended: Option<Recommended>,
}

impl SweepResults {
    /// Gathers the records of a run; `records` is parallel to the plan's tasks.
    pub fn gather(sweep: &Sweep, plan: &Plan, records: Vec<Option<ChainRecord>>) -> Self {
        let known = |task: &Task| records[task.index].as_ref().map(|record| &record.status);
        let amounts: Vec<(u64, Option<Stop>)> = (0..sweep.cells.len())
            .map(|cell| (plan.replicates[cell], plan.stop(sweep, cell, known)))
            .collect();
        let mut seen = HashSet::new();
        let (of_cells, of_posteriors) = posterior::by_owner(plan, records);
        let of_cells = plan.tasks_of_cells().zip(of_cells);
        let mut chains: Vec<ChainResult> = of_cells
            .filter_map(|((cell, task), record)| {
                Some(ChainResult {
                    cell,
                    data: task.data,
                    replicate: task.replicate,
                    chain: task.chain,
                    key: task.key.clone(),
                    is_repeat: !seen.insert((cell, task.key.as_str())),
                    status: record?.status,
                    sorted: None,
                })
            })
            .collect();
        let posteriors = posterior::posteriors(plan, &chains, of_posteriors);
        posterior::sort_failures(plan, &posteriors, &mut chains);
        let mut by_cell = vec![Vec::new(); sweep.cells.len()];
        for chain in chains.iter().filter(|chain| !chain.is_repeat) {
            by_cell[chain.cell].push(chain);
        }
        let mut worlds = world_results(sweep, plan, &chains, &posteriors);
        starts::add_starts(sweep, &chains, &mut worlds);
        let of_cell =
            |cell: usize| -> Vec<&WorldResult> { own_worlds(&worlds, cell).iter().collect() };
        let cells: Vec<CellResult> = by_cell
            .iter()
            .enumerate()
            .map(|(cell, chains)| cell_result(sweep, cell, chains, &of_cell(cell), amounts[cell]))
            .collect();
        let effects = factor_effects(sweep, &chains);
        let pair = match effects.as_slice() {
            [first, second, ..] => Some(pair_effect(sweep, &chains, first.factor, second.factor)),
            _ => None,
        };
        let around = recommend::neighbourhoods(sweep, &cells);
        let ranking = recommend::rank(&cells, &around);
        Self {
            recommended: recommend::recommended(sweep, &cells, &around, &ranking),
            ranking,
            sensitivity: Sensitivity::new(sweep, &chains, &worlds),
            noise_by_samples: noise_by_samples(sweep, &cells),
            chains,
            worlds,
            posteriors,
            cells,
            effects,
            pair,
            around,
        }
    }

    /// Number of chains that did not run to their end, those of posteriors too.
    pub fn n_failed(&self) -> usize {
        let own = self.chains.iter().filter(|chain| chain.outcome().is_none());
        let of_posteriors = self.posteriors.iter().map(|own| own.n_failed);
        own.count() + of_posteriors.sum::<usize>()
    }

    /// Chains by whose fault they failed; `None` if nothing was sorted.
    pub fn faults(&self) -> Option<Faults> {
        Faults::of(self.chains.iter().filter_map(ChainResult::sorted_once))
    }

    /// The chains of a cell.
    pub fn chains_of(&self, cell: usize) -> impl Iterator<Item = &ChainResult> {
        let first = self.chains.partition_point(|chain| chain.cell < cell);
        let end = self.chains.partition_point(|chain| chain.cell <= cell);
        self.chains[first..end].iter()
    }

    /// The worlds of a cell.
    pub fn worlds_of(&self, cell: usize) -> impl Iterator<Item = &WorldResult> {
        own_worlds(&self.worlds, cell).iter()
    }

    /// Cells from the most to the least successful: by the share of their worlds on which converged
    /// chains found the truth, so that luck never comes first; then by recovery rate, then by the
    /// share that converged; among equals by their neighbourhoods ([`Neighbourhood`]), then by mass
    /// on the truth, then in their order. Cells without a rate come last.
    pub fn ranking(&self) -> &[usize] {
        &self.ranking
    }

    /// What surrounds a cell.
    pub fn around(&self, cell: usize) -> &Neighbourhood {
        &self.around[cell]
    }

    /// The cell to use, of those that are computed correctly; `None` without any outcome.
    pub fn recommended(&self) -> Option<&Recommended> {
        self.recommended.as_ref()
    }
}

/// Worlds are in the order of their cells.
fn own_worlds(worlds: &[WorldResult], cell: usize) -> &[WorldResult] {
    let first = worlds.partition_point(|world| world.cell < cell);
    let end = worlds.partition_point(|world| world.cell <= cell);
    &worlds[first..end]
}

/// The noise of the log estimate in the cells of one number of importance samples.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseBySamples {
    /// R.
    pub n_samples: u64,
    /// Median over cells of its standard deviation, nats: a mean would be that of the most extreme settings.
    pub median_sd: f64,
    /// Cells.
    pub n_cells: usize,
    /// Of them, those in which R is too small.
    pub n_too_few: usize,
    /// Of them, those in which it could be smaller.
    pub n_more_than_needed: usize,
}

/// Numbers of importance samples that a sentence can hold.
const MOST_NUMBERS: usize = 6;

fn noise_by_samples(sweep: &Sweep, cells: &[CellResult]) -> Vec<NoiseBySamples> {
    let mut by_number: BTreeMap<u64, Vec<EstimateNoise>> = BTreeMap::new();
    for cell in cells {
        let settings = &sweep.cells[cell.cell].settings;
        if let Some(noise) = cell.noise {
            let number = settings.count("importance_samples");
            by_number.entry(number).or_default().push(noise);
        }
    }
    if by_number.len() > MOST_NUMBERS {
        return Vec::new();
    }
    let of = |(n_samples, mut own): (u64, Vec<EstimateNoise>)| {
        own.sort_by(|a, b| a.sd.total_cmp(&b.sd));
        let count = |verdict| {
            own.iter()
                .filter(|noise| noise.verdict() == verdict)
                .count()
        };
        NoiseBySamples {
            n_samples,
            median_sd: own[own.len() / 2].sd,
            n_cells: own.len(),
            n_too_few: count(SamplesVerdict::TooFew),
            n_more_than_needed: count(SamplesVerdict::MoreThanNeeded),
        }
    };
    by_number.into_iter().map(of).collect()
}

#[cfg(test)]
mod gather_tests;
