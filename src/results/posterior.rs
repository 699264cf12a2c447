//! What a posterior prefers: the truth, or another map?
//!
//! The exact posterior answers where it stands (`exact_up_to`), else the reference chains, if they
//! have converged by the rule of all chains. Either has an error, so that two topologies of about
//! the same probability are a **tie**: no answer. The probabilities p and q of two topologies differ
//! if they are further apart than twice the total variation that the exact table may be off, or than
//! 2.5 standard errors √((p + q − (p − q)²)/ESS) of the reference chains. Their ESS is that of their
//! topologies, and at least what the rule asks for: 100 for each chain.

use rand::Rng;
use rayon::prelude::*;

use super::convergence::{Diagnosis, diagnose, pooled_topologies};
use super::{ChainResult, Sorted};
use crate::diagnostics::ess::MIN_ESS_PER_CHAIN;
use crate::run::{
    AskedPosterior, ChainOutcome, ChainRecord, ChainStatus, ExactComparison, Owner, Plan,
    PosteriorTopology,
};

/// Standard errors that two probabilities must differ by.
const Z_APART: f64 = 2.5;

/// What the posterior prefers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Its MAP topology is the truth.
    Truth,
    /// Another topology is more probable than the truth.
    OtherMap,
    /// It cannot be told.
    Undecided(Unanswered),
}

/// Why a posterior gives no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unanswered {
    /// The reference sampler does not have this model, and the exact posterior is too expensive.
    NoSampler,
    /// No reference chain ran to its end.
    NoChain,
    /// The reference chains have not converged.
    NotConverged,
    /// The truth and another topology are about as probable.
    Tie,
}

impl Unanswered {
    /// One word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoSampler => "no-sampler",
            Self::NoChain => "no-chain",
            Self::NotConverged => "not-converged",
            Self::Tie => "tie",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::NoSampler => "the reference sampler does not have this model",
            Self::NoChain => "no reference chain ran to its end",
            Self::NotConverged => "the reference chains have not converged",
            Self::Tie => "the truth and another map are about as probable",
        }
    }
}

/// The records of reference chains, each with the index of its posterior.
type PosteriorRecords = Vec<(usize, Option<ChainRecord>)>;

/// A posterior that cells asked for.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Whether the exact posterior answers, and not the reference chains.
    pub is_exact: bool,
    /// The likeliest topologies; none if nothing is known.
    pub topologies: Vec<PosteriorTopology>,
    /// What it prefers; `None` if no truth is known.
    pub answer: Option<Answer>,
    /// Reference chains planned.
    pub n_planned: usize,
    /// Reference chains that failed.
    pub n_failed: usize,
    /// Reference chains that have not been run yet.
    pub n_missing: usize,
    /// Why the first of those that failed did.
    pub failure: Option<String>,
    /// Those that ran to their end.
    pub chains: Vec<ChainOutcome>,
    /// Their diagnostics; `None` without any.
    pub diagnosis: Option<Diagnosis>,
}

/// All posteriors of a plan, in its order. `records` are those of their chains, parallel to the
/// plan's tasks of them.
pub(super) fn posteriors(
    plan: &Plan,
    chains: &[ChainResult],
    records: PosteriorRecords,
) -> Vec<Posterior> {
    let n = plan.posteriors().len();
    let mut gathered: Vec<Gathered> = (0..n).map(|_| Gathered::default()).collect();
    for (index, record) in records {
        let own = &mut gathered[index];
        own.n_planned += 1;
        match record.map(|record| record.status) {
            Some(ChainStatus::Done(outcome)) => own.chains.push(*outcome),
            Some(ChainStatus::Failed { reason, .. }) => {
                own.n_failed += 1;
                own.failure.get_or_insert(reason);
            }
            None => own.n_missing += 1,
        }
    }
    // All chains on one data set under one model carry the same exact posterior.
    for chain in chains {
        if let (Some(index), Some(outcome)) = (
            plan.posterior_of(chain.cell, chain.replicate),
            chain.outcome(),
        ) && gathered[index].exact.is_none()
        {
            gathered[index].exact = exact_of(outcome);
        }
    }
    let of = |(asked, own): (&AskedPosterior, Gathered)| {
        let mut rng = asked.purpose.clone().text("use", "null").generator();
        answered(own, asked.is_sampled(), &mut rng)
    };
    let all = plan.posteriors().par_iter().zip(gathered);
    all.map(of).collect()
}

/// The exact posterior's likeliest topologies, and how far the table may be off.
type Exact = (Vec<PosteriorTopology>, f64);

#[derive(Default)]
struct Gathered {
    chains: Vec<ChainOutcome>,
    exact: Option<Exact>,
    n_planned: usize,
    n_failed: usize,
    n_missing: usize,
    failure: Option<String>,
}

fn exact_of(outcome: &ChainOutcome) -> Option<Exact> {
    match &outcome.exact {
        ExactComparison::Compared(found) => Some((found.top.clone(), found.table_error)),
        ExactComparison::Not { .. } => None,
    }
}

/// `is_sampled`: whether the reference sampler has the model. `rng` makes the null of the
/// diagnosis.
fn answered(own: Gathered, is_sampled: bool, rng: &mut impl Rng) -> Posterior {
    let chains: Vec<&ChainOutcome> = own.chains.iter().collect();
    let diagnosis = diagnose(&chains, rng);
    let exact = own
        .exact
        .or_else(|| chains.first().and_then(|o| exact_of(o)));
    let is_exact = exact.is_some();
    let (topologies, answer) = match (exact, &diagnosis) {
        (Some((topologies, error)), _) => {
            let unlisted = topologies.last().map_or(0.0, |last| last.probability);
            let answer = preferred(&topologies, unlisted, |_, _| 2.0 * error);
            (topologies, answer)
        }
        (None, Some(found)) => {
            let topologies = pooled_topologies(&chains);
            let least = MIN_ESS_PER_CHAIN * found.n_chains as f64;
            let ess = found.ess_topologies.max(least);
            let unlisted = chains.iter().map(|own| unlisted_at_most(own)).sum::<f64>();
            let unlisted = unlisted / found.n_chains as f64;
            let answer = preferred(&topologies, unlisted, |p, q| {
                Z_APART * ((p + q - (p - q) * (p - q)) / ess).sqrt()
            });
            let shown = found.convergence.is_shown();
            let not = Answer::Undecided(Unanswered::NotConverged);
            (
                topologies,
                answer.map(|answer| if shown { answer } else { not }),
            )
        }
        (None, None) if is_sampled => (Vec::new(), Some(Answer::Undecided(Unanswered::NoChain))),
        (None, None) => (Vec::new(), Some(Answer::Undecided(Unanswered::NoSampler))),
    };
    Posterior {
        is_exact,
        topologies,
        answer,
        n_planned: own.n_planned,
        n_failed: own.n_failed,
        n_missing: own.n_missing,
        failure: own.failure,
        diagnosis,
        chains: own.chains,
    }
}

/// Whether the likeliest topology that is the truth or the likeliest other one is more probable, by
/// more than `error` of the two; `None` if no truth is known. Topologies come by falling
/// probability; others have at most `unlisted`.
fn preferred(
    topologies: &[PosteriorTopology],
    unlisted: f64,
    error: impl Fn(f64, f64) -> f64,
) -> Option<Answer> {
    topologies.first()?.is_truth?;
    let likeliest = |is_truth: bool| {
        let mut own = topologies.iter();
        let own = own.find(|own| own.is_truth == Some(is_truth));
        own.map_or(unlisted, |own| own.probability)
    };
    let (truth, other) = (likeliest(true), likeliest(false));
    let error = error(truth, other);
    Some(if truth - other > error {
        Answer::Truth
    } else if other - truth > error {
        Answer::OtherMap
    } else {
        Answer::Undecided(Unanswered::Tie)
    })
}

/// The most draws, as a share, that a chain can have at a topology that its record does not list.
fn unlisted_at_most(chain: &ChainOutcome) -> f64 {
    let last = chain.top.last().map_or(0.0, |top| top.frequency);
    if chain.n_topologies > chain.top.len() as u64 {
        last
    } else {
        0.0
    }
}

/// Sorts the failures of all chains whose posterior was asked for.
pub(super) fn sort_failures(plan: &Plan, posteriors: &[Posterior], chains: &mut [ChainResult]) {
    for chain in chains {
        let index = plan.posterior_of(chain.cell, chain.replicate);
        let answer = index.and_then(|index| posteriors[index].answer);
        chain.sorted = answer
            .zip(chain.outcome())
            .and_then(|(answer, outcome)| Sorted::of_chain(outcome, answer));
    }
}

/// Records by owner: those of cells in their order, and those of posteriors with their index.
pub(super) fn by_owner(
    plan: &Plan,
    records: Vec<Option<ChainRecord>>,
) -> (Vec<Option<ChainRecord>>, PosteriorRecords) {
    let (mut of_cells, mut of_posteriors) = (Vec::new(), Vec::new());
    for (task, record) in plan.tasks.iter().zip(records) {
        match task.owner {
            Owner::Cell(_) => of_cells.push(record),
            Owner::Posterior(index) => of_posteriors.push((index, record)),
        }
    }
    (of_cells, of_posteriors)
}

#[cfg(test)]
#[path = "posterior_tests.rs"]
mod tests;
