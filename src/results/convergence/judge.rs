//! The rule by which chains have converged. Its error rates are in `docs/verdicts.md`.
//!
//! 1. At least two chains, with at least [`LEAST_DRAWS`] draws each after burn-in.
//! 2. Where the exact posterior is known, it decides: every topology of mass .05 or more and every
//!    pair must be within max(.05, 2.5 √(p(1−p)/(100 C))) of its probability p, C chains. That is 2.5
//!    standard errors at the least ESS that step 3 asks for.
//! 3. If anything is material ([`material`](super::material)), the chains **mix** if each material
//!    quantity has R-hat at most 1.01, at least 100 effective draws a chain and at least ten changes,
//!    and the topologies of two chains are not further apart than chance explains. That is asked only
//!    where some topology is material: of draws that hardly repeat a topology the distance is near 1
//!    by any law.
//! 4. Else they are **at rest** if one topology holds [`REST_SHARE`] of every chain, and since the last
//!    chain came there they made [`LEAST_REST`] proposals, and [`LEAST_HOLDS`] times as many as any
//!    other topology ever held a chain.
//! 5. Every probe must have come to where its chain went. Without probes the chains must have
//!    started at two topologies or more.

use super::doubt::{Convergence, Doubt};
use super::{Diagnosis, Judged, MIN_P_VALUE, Quantity};
use crate::diagnostics::ess::MIN_ESS_PER_CHAIN;
use crate::diagnostics::r_hat::MAX_R_HAT;
use crate::diagnostics::undefined::Undefined;
use crate::run::{ChainOutcome, ExactComparison, ExactQuantity};

/// Draws of each chain that a verdict needs, repetitions included.
pub const LEAST_DRAWS: u64 = 100;
/// Chains that each spend this share of their draws at one and the same topology are at rest there.
pub const REST_SHARE: f64 = 0.9;
/// How many times the longest hold elsewhere chains must have been at rest.
pub const LEAST_HOLDS: u64 = 20;
/// How many proposals chains must have been at rest. Of 150 verdicts from 300 proposals, 4 % were false,
/// all by modes of less than a tenth that no chain had entered yet; of 421 from 1,000 none was.
pub const LEAST_REST: u64 = 500;
/// How far a probability may be off where the exact posterior decides, at the least.
const LEAST_OFF: f64 = 0.05;
/// And in standard errors.
const Z_OFF: f64 = 2.5;

pub(super) fn judge(diagnosis: &Diagnosis, chains: &[&ChainOutcome]) -> Convergence {
    if chains.len() < 2 {
        return Convergence::Not(vec![Doubt::OneChain]);
    }
    if diagnosis.n_steps < LEAST_DRAWS {
        return Convergence::Not(vec![Doubt::TooShort {
            n_draws: diagnosis.n_steps,
            least: LEAST_DRAWS,
        }]);
    }
    against_exact(chains).unwrap_or_else(|| judge_by_rule(diagnosis, chains))
}

/// Steps 3 to 5, whether or not the exact posterior is known.
pub(super) fn judge_by_rule(diagnosis: &Diagnosis, chains: &[&ChainOutcome]) -> Convergence {
    let (shown, mut doubts) = if diagnosis.judged.is_empty() {
        (Convergence::AtRest, at_rest(diagnosis, chains))
    } else {
        (Convergence::Mixes, mixes(diagnosis))
    };
    let probes = diagnosis.probes;
    if probes.n == 0 && diagnosis.n_initial_topologies < 2 && chains[0].n_detections > 1 {
        doubts.push(Doubt::OneStart);
    }
    if probes.n_came < probes.n {
        doubts.push(Doubt::Probes {
            n_lost: probes.n - probes.n_came,
            n: probes.n,
        });
    }
    if doubts.is_empty() {
        shown
    } else {
        Convergence::Not(doubts)
    }
}

/// Of each kind of doubt the worst.
fn mixes(diagnosis: &Diagnosis) -> Vec<Doubt> {
    let least = MIN_ESS_PER_CHAIN * diagnosis.n_chains as f64;
    let judged = &diagnosis.judged;
    let mut doubts = Vec::new();
    let undefined = |own: &Judged| {
        let reason = own.r_hat.and(own.ess).err()?;
        Some(Doubt::Undefined {
            of: own.quantity,
            reason,
        })
    };
    // A chain that stands apart says more than a value that changes seldom.
    let is_apart = |own: &&Judged| own.r_hat.is_err_and(|reason| reason.is_disagreement());
    let first = judged.iter().find(is_apart).or_else(|| {
        judged
            .iter()
            .find(|own| own.r_hat.is_err() || own.ess.is_err())
    });
    doubts.extend(first.and_then(undefined));
    let by = |value: fn(&Judged) -> Result<f64, Undefined>| {
        judged
            .iter()
            .filter_map(move |own| Some((own.quantity, value(own).ok()?)))
    };
    let r_hat = by(|own| own.r_hat).max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((of, value)) = r_hat.filter(|(_, value)| *value > MAX_R_HAT) {
        doubts.push(Doubt::RHat { of, value });
    }
    let ess = by(|own| own.ess).min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((of, value)) = ess.filter(|(_, value)| *value < least) {
        doubts.push(Doubt::Ess { of, value, least });
    }
    let repeats = judged
        .iter()
        .any(|own| matches!(own.quantity, Quantity::Topology(_)));
    if let Ok(found) = &diagnosis.topologies
        && repeats
        && found.total_variation.p_value < MIN_P_VALUE
    {
        doubts.push(Doubt::Topologies {
            distance: found.total_variation.largest,
            null_95: found.total_variation.null_95,
        });
    }
    doubts
}

fn at_rest(diagnosis: &Diagnosis, chains: &[&ChainOutcome]) -> Vec<Doubt> {
    let share = |chain: &&ChainOutcome| {
        let map = chain
            .top
            .first()
            .filter(|top| top.labels == diagnosis.map_labels);
        map.map_or(0.0, |map| map.frequency)
    };
    let share = chains.iter().map(share).fold(1.0, f64::min);
    if share < REST_SHARE {
        return vec![Doubt::Unsettled {
            share,
            least: REST_SHARE,
        }];
    }
    let arrival = chains
        .iter()
        .map(|chain| chain.journey.arrival)
        .max()
        .unwrap_or(0);
    let holds = chains
        .iter()
        .map(|chain| chain.journey.longest_hold_elsewhere);
    let hold = holds.max().unwrap_or(0);
    let n_steps = chains.iter().map(|chain| chain.n_steps).min().unwrap_or(0) - arrival;
    let least = LEAST_REST.max(LEAST_HOLDS * hold);
    if n_steps < least {
        return vec![Doubt::Late {
            n_steps,
            hold,
            least,
        }];
    }
    Vec::new()
}

/// By the probability that is furthest from the exact posterior, in units of how far it may be;
/// `None` if the posterior is not known of every chain.
fn against_exact(chains: &[&ChainOutcome]) -> Option<Convergence> {
    let quantities: Vec<&[ExactQuantity]> = chains
        .iter()
        .map(|chain| match &chain.exact {
            ExactComparison::Compared(found) => Some(found.quantities.as_slice()),
            ExactComparison::Not { .. } => None,
        })
        .collect::<Option<_>>()?;
    let (first, _) = quantities.split_first()?;
    if quantities.iter().any(|own| own.len() != first.len()) {
        return None;
    }
    let n_chains = chains.len() as f64;
    // As pooled results have it: every counted draw weighs the same.
    let counted = |chain: &&ChainOutcome| (chain.n_steps - chain.series.first_step) as f64;
    let n_counted: f64 = chains.iter().map(counted).sum();
    let pooled = |k: usize| {
        let weighted = chains.iter().zip(&quantities);
        let sum = weighted.map(|(chain, own)| counted(chain) * own[k].sampled);
        sum.sum::<f64>() / n_counted
    };
    let (mut largest, mut worst) = (0.0_f64, None);
    for (k, ExactQuantity { exact, .. }) in first.iter().copied().enumerate() {
        let sampled = pooled(k);
        let variance = exact * (1.0 - exact) / (MIN_ESS_PER_CHAIN * n_chains);
        let most = LEAST_OFF.max(Z_OFF * variance.max(0.0).sqrt());
        let off = (sampled - exact).abs();
        largest = largest.max(off);
        if off > most && worst.is_none_or(|(ratio, _)| off / most > ratio) {
            let doubt = Doubt::Exact {
                exact,
                sampled,
                most,
            };
            worst = Some((off / most, doubt));
        }
    }
    Some(worst.map_or(Convergence::Exact { largest }, |(_, doubt)| {
        Convergence::Not(vec![doubt])
    }))
}
