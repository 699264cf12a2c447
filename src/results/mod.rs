//! What a sweep found: chain records gathered into cells and factors, by way of the diagnostics.
//!
//! Tables and reports are made from this and from nothing else.

mod cells;
pub mod effects;
pub mod exact;
pub mod sample;

pub use cells::{CellResult, cell_result};
pub use effects::{FactorEffect, PairEffect, factor_effects, pair_effect};

use crate::run::{ChainOutcome, ChainRecord, ChainStatus, Plan};
use crate::sweep::Sweep;

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
    /// What became of it.
    pub status: ChainStatus,
}

impl ChainResult {
    /// The summary, if the chain ran to its end.
    pub fn outcome(&self) -> Option<&ChainOutcome> {
        match &self.status {
            ChainStatus::Done(outcome) => Some(outcome),
            ChainStatus::Failed { .. } => None,
        }
    }
}

/// Everything that a sweep found.
pub struct SweepResults {
    /// All chains that were run, by cell, world and chain.
    pub chains: Vec<ChainResult>,
    /// All cells, in their order.
    pub cells: Vec<CellResult>,
    /// The factors by falling effect on the recovery rate.
    pub effects: Vec<FactorEffect>,
    /// The two strongest factors together, if there are two.
    pub pair: Option<PairEffect>,
}

impl SweepResults {
    /// Gathers the records of a run; `records` is parallel to the plan's tasks.
    pub fn gather(sweep: &Sweep, plan: &Plan, records: &[Option<ChainRecord>]) -> Self {
        let chains: Vec<ChainResult> = plan
            .tasks
            .iter()
            .zip(records)
            .filter_map(|(task, record)| {
                Some(ChainResult {
                    cell: task.cell,
                    data: task.data,
                    replicate: task.replicate,
                    chain: task.chain,
                    key: task.key.clone(),
                    status: record.as_ref()?.status.clone(),
                })
            })
            .collect();
        let mut by_cell = vec![Vec::new(); sweep.cells.len()];
        for chain in &chains {
            by_cell[chain.cell].push(chain);
        }
        let cells: Vec<CellResult> = by_cell
            .iter()
            .enumerate()
            .map(|(cell, chains)| cell_result(sweep, cell, chains))
            .collect();
        let effects = factor_effects(sweep, &chains);
        let pair = match effects.as_slice() {
            [first, second, ..] => Some(pair_effect(sweep, &chains, first.factor, second.factor)),
            _ => None,
        };
        Self {
            chains,
            cells,
            effects,
            pair,
        }
    }

    /// Number of chains that failed.
    pub fn n_failed(&self) -> usize {
        self.chains
            .iter()
            .filter(|chain| chain.outcome().is_none())
            .count()
    }

    /// The chains of a cell.
    pub fn chains_of(&self, cell: usize) -> impl Iterator<Item = &ChainResult> {
        self.chains.iter().filter(move |chain| chain.cell == cell)
    }

    /// Cells from the most to the least successful: by recovery rate, then by mass on the truth,
    /// then by agreement with it, then in their order. Cells without a rate come last.
    pub fn ranking(&self) -> Vec<usize> {
        let score = |cell: &CellResult| {
            [
                cell.recovery.map(|rate| rate.rate),
                cell.truth_mass,
                cell.adjusted_rand_index,
            ]
            .map(|value| value.unwrap_or(-2.0))
        };
        let mut order: Vec<usize> = (0..self.cells.len()).collect();
        order.sort_by(|&a, &b| {
            let (a_score, b_score) = (score(&self.cells[a]), score(&self.cells[b]));
            b_score
                .partial_cmp(&a_score)
                .unwrap_or(std::cmp::Ordering::Equal)
                .then(a.cmp(&b))
        });
        order
    }
}
