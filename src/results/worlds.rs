//! The worlds of each cell: the diagnosis of the chains on it, and the verdict.

use rayon::prelude::*;

use super::convergence::{Diagnosis, diagnose};
use super::verdict::Verdict;
use super::{Answer, ChainResult, Posterior, Starts};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::run::{ChainOutcome, Plan};
use crate::sweep::{Stopping, Sweep};

/// The chains of one cell on one world.
#[derive(Clone, Debug)]
pub struct WorldResult {
    /// The cell, by its index.
    pub cell: usize,
    /// The world's number, from 0.
    pub replicate: u64,
    /// Chains planned.
    pub n_planned: usize,
    /// Chains that failed.
    pub n_failed: usize,
    /// Chains that have not been run yet.
    pub n_missing: usize,
    /// Diagnostics of those that ran to their end; `None` without any.
    pub diagnosis: Option<Diagnosis>,
    /// Whether chains from other starts agree with those of this cell.
    pub starts: Starts,
    /// What to make of it.
    pub verdict: Verdict,
    /// The posterior, by its index among those asked for; `None` if it was not.
    pub posterior: Option<usize>,
    /// What that prefers; `None` if no truth is known either.
    pub answer: Option<Answer>,
}

impl WorldResult {
    /// Whether the chains on it are shown to have converged.
    pub fn has_converged(&self) -> bool {
        let diagnosis = self.diagnosis.as_ref();
        diagnosis.is_some_and(|diagnosis| diagnosis.convergence.is_shown())
    }
}

/// All worlds of all cells, in their order. A replicate that repeats an earlier one of its cell, as in
/// a world without noise, is left out. Worlds are judged in parallel, each with random numbers of its
/// own settings, so neither threads nor the order of cells change a digit.
pub(super) fn world_results(
    sweep: &Sweep,
    plan: &Plan,
    chains: &[ChainResult],
    posteriors: &[Posterior],
) -> Vec<WorldResult> {
    let mut planned: Vec<(usize, u64, usize)> = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for cell in 0..sweep.cells.len() {
        for task in plan.tasks_of(cell) {
            if !seen.insert((cell, task.key.as_str())) {
                continue;
            }
            match planned.last_mut() {
                Some((of, replicate, n)) if (*of, *replicate) == (cell, task.replicate) => *n += 1,
                _ => planned.push((cell, task.replicate, 1)),
            }
        }
    }
    let first_of = |cell, replicate| {
        let place = |chain: &ChainResult| (chain.cell, chain.replicate) < (cell, replicate);
        chains.partition_point(place)
    };
    let world = |&(cell, replicate, n_planned): &(usize, u64, usize)| {
        let own: Vec<&ChainResult> = chains[first_of(cell, replicate)..]
            .iter()
            .take_while(|chain| (chain.cell, chain.replicate) == (cell, replicate))
            .filter(|chain| !chain.is_repeat)
            .collect();
        let done: Vec<&ChainOutcome> = own.iter().filter_map(|chain| chain.outcome()).collect();
        let settings = &sweep.cells[cell].settings;
        let mut rng = Purpose::new(SAMPLER_SEMANTICS, sweep.seed())
            .text(
                "null of a world",
                &settings
                    .canonical_text(|key| key.name != "detections" && !Stopping::is_of_rule(key)),
            )
            .number("replicate", replicate)
            .generator();
        let diagnosis = diagnose(&done, &mut rng);
        let any_recovered = done.iter().any(|outcome| outcome.recovered == Some(true));
        let n_failed = own.len() - done.len();
        let posterior = plan.posterior_of(cell, replicate);
        WorldResult {
            cell,
            replicate,
            n_planned,
            n_failed,
            n_missing: n_planned - own.len(),
            starts: Starts::default(),
            verdict: Verdict::of_world(diagnosis.as_ref(), any_recovered, n_failed),
            diagnosis,
            answer: posterior.and_then(|index| posteriors[index].answer),
            posterior,
        }
    };
    planned.par_iter().map(world).collect()
}
