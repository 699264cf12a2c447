//! Chains of one data set that are led on together until they are judged converged.
//!
//! They are looked at when they have made `samples` proposals each, then twice as many, and so on, at
//! `max_samples` for the last time. A look is a function of the chains as they stand, so the length
//! at which they end is one of the settings and the data, whatever the threads or the kills on the
//! way; and chains that end at a length are those that were asked for that length. Looking often and
//! stopping at a good moment costs some of the verdict's error rate: `docs/verdicts.md` says how much.

use rayon::prelude::*;

use super::attended::{Attended, Ended};
use super::exact::ExactTables;
use super::outcome::ChainOutcome;
use super::probes::ProbeOutcome;
use super::sample::SampledChain;
use crate::chain::Run;
use crate::dataset::DataSet;
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::r_hat::plain_r_hat;
use crate::settings::Settings;

/// What chains come to when they are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Whether the rule calls them converged.
    pub has_converged: bool,
    /// Largest R-hat of what is judged, where one is defined.
    pub r_hat: Option<f64>,
    /// Smallest ESS of what is judged, where one is defined.
    pub ess: Option<f64>,
}

/// Judges the chains of one data set.
pub type Judge<'a> =
    &'a (dyn Fn(&[&ChainOutcome], &DataSet, &Settings) -> Option<Judgement> + Sync);

/// Hears, at each look, of the proposals of each chain and of what was found.
pub type Looks<'a> = &'a (dyn Fn(u64, Judgement) + Sync);

/// Above this R-hat of M over the second half of the chains a look goes no further: the rule asks
/// for 1.01, and the rest of a look costs as much as a thousand detections do in 20,000 proposals.
const FAR_APART: f64 = 1.1;

/// R-hat of M over the second half of the chains, if they are far apart.
fn far_apart(chains: &[Attended<'_>]) -> Option<f64> {
    let n_sets = |(run, dwell): (&Run, u64)| -> Stretch { (f64::from(run.n_sets), dwell) };
    let halves: Vec<Vec<Stretch>> = chains
        .iter()
        .map(|chain| {
            let second_half = chain.n_steps() / 2;
            chain.trace().dwell_times(second_half).map(n_sets).collect()
        })
        .collect();
    let r_hat = plain_r_hat(&Chains::new(&halves).ok()?).ok()?;
    (r_hat > FAR_APART).then_some(r_hat)
}

/// Lengths at which chains are looked at: `first`, doubled until `most`.
fn next_length(length: u64, most: u64) -> u64 {
    length.saturating_mul(2).min(most)
}

/// Leads the chains on until they are judged converged, or have made `max_samples` proposals each.
pub(super) fn until_converged(
    mut chains: Vec<Attended<'_>>,
    (settings, data): (&Settings, &DataSet),
    tables: &ExactTables,
    (judge, looks): (Judge<'_>, Looks<'_>),
) -> Result<Vec<SampledChain>, Ended> {
    let most = settings.most_samples();
    let first = settings.count("samples").min(most);
    let mut length = first;
    // A chain went beyond a look only if that look did not end it.
    let passed = chains.iter().map(Attended::n_steps).max().unwrap_or(0);
    while length < passed {
        length = next_length(length, most);
    }
    loop {
        chains.par_iter_mut().try_for_each(|chain| {
            // A chain without a checkpoint beside some that have one: a ladder of temperatures is
            // tuned in a quarter of the first length.
            if chain.n_steps() < first {
                chain.go_to(first)?;
            }
            chain.go_to(length)
        })?;
        let is_last = length >= most;
        if let Some(r_hat) = far_apart(&chains).filter(|_| !is_last) {
            let found = Judgement {
                has_converged: false,
                r_hat: Some(r_hat),
                ess: None,
            };
            looks(length, found);
            length = next_length(length, most);
            continue;
        }
        let mut sampled: Vec<SampledChain> = chains
            .par_iter()
            .map(|chain| {
                let trace = chain.trace_so_far();
                let outcome = chain.finished(&trace, tables).without_probes();
                SampledChain { trace, outcome }
            })
            .collect();
        let judged = |sampled: &[SampledChain]| {
            let outcomes: Vec<&ChainOutcome> = sampled.iter().map(|own| &own.outcome).collect();
            judge(&outcomes, data, settings)
        };
        // Probes are sent only where nothing else stands against a verdict.
        let n_probes = settings.count("probes") as usize;
        for own in &mut sampled {
            own.outcome.probes = vec![ProbeOutcome::AWAITED; n_probes];
        }
        let mut found = judged(&sampled);
        if is_last || found.is_some_and(|found| found.has_converged) {
            sampled
                .par_iter_mut()
                .zip(&chains)
                .try_for_each(|(own, chain)| {
                    let SampledChain { trace, outcome } = own;
                    chain
                        .finished(trace, tables)
                        .complete(outcome, &|| chain.is_told_to_stop())
                        .ok_or(Ended::Stopped)
                })?;
            found = judged(&sampled);
        }
        if let Some(found) = found {
            looks(length, found);
        }
        if is_last || found.is_some_and(|found| found.has_converged) {
            return Ok(sampled);
        }
        length = next_length(length, most);
    }
}
