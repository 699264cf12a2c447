//! Chains on one data set: run, pooled and judged.

use std::time::Instant;

use super::{JobError, Watch};
use crate::dataset::DataSet;
use crate::results::sample::{SampleResult, judgement, pool};
use crate::run::{ChainOutcome, ExactTables, SampledChain, sample_chains, tables_of_one};
use crate::settings::Settings;

/// Chains that ran to their end, and what they say together.
pub struct Sampled {
    /// The settings, with the estimator and the moves that `auto` stood for.
    pub settings: Settings,
    /// Chain by chain: trace and summary.
    pub chains: Vec<SampledChain>,
    /// All of them together: topologies, estimates, co-clustering, verdict.
    pub result: SampleResult,
}

impl Sampled {
    /// The summaries of the chains.
    pub fn outcomes(&self) -> Vec<&ChainOutcome> {
        self.chains.iter().map(|chain| &chain.outcome).collect()
    }
}

/// Samples the topologies of a data set with as many chains as the settings say. What comes out
/// does not depend on the number of threads. `None` if the watch stopped it.
///
/// # Errors
/// Settings that do not go together; a model or a start that these data do not allow.
///
/// The head of the [crate](crate) has an example.
pub fn sample(
    data: &DataSet,
    settings: &Settings,
    watch: &Watch<'_>,
) -> Result<Option<Sampled>, JobError> {
    settings.check_together()?;
    let settings = settings.naming_sampler(data.detections.len());
    (watch.stage)("the exact posterior of these few detections");
    let tables = tables_of_one(&settings, data);
    pooled(data, settings, &tables, watch)
}

/// As [`sample`], of settings that name their sampler, beside exact posteriors or none.
pub(super) fn pooled(
    data: &DataSet,
    settings: Settings,
    tables: &ExactTables,
    watch: &Watch<'_>,
) -> Result<Option<Sampled>, JobError> {
    (watch.stage)("the chains and their probes");
    let started = Instant::now();
    let judging = (&judgement as _, watch.looks);
    let chains = sample_chains(data, &settings, tables, judging, watch.stop)?;
    let seconds = started.elapsed().as_secs_f64();
    // What was stopped after the last chain was done is whole.
    let Some(chains) = chains else {
        return Ok(None);
    };
    let stage = |what: &str| (watch.stage)(&format!("after the chains: {what}"));
    let result = pool(&chains, data, &settings, seconds, &stage);
    Ok(Some(Sampled {
        settings,
        chains,
        result,
    }))
}
