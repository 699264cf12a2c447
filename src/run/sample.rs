//! The chains of one data set, side by side, as `ptm sample` and `ptm evaluate` run them.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::chain_purpose;
use super::exact::ExactTables;
use super::finish::Finished;
use super::outcome::ChainOutcome;
use crate::chain::{self, Observer, Trace, TraceRecorder};
use crate::dataset::{DataError, DataSet};
use crate::settings::Settings;

struct StopFlag<'a>(&'a AtomicBool);
impl Observer for StopFlag<'_> {
    fn wants_stop(&mut self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A chain that ran to its end.
pub struct SampledChain {
    /// What it did, step by step.
    pub trace: Trace,
    /// Its summary.
    pub outcome: ChainOutcome,
}

/// Runs as many chains as the settings say; what comes out does not depend on the number of threads.
/// `tables` has the exact posterior, if these detections are few
/// ([`tables_of_one`](super::tables_of_one)). `None` if `stop` was set before all chains and their probes were done.
///
/// # Errors
/// A model or a start that these data do not allow.
pub fn sample_chains(
    data: &DataSet,
    settings: &Settings,
    tables: &ExactTables,
    stop: &AtomicBool,
) -> Result<Option<Vec<SampledChain>>, DataError> {
    let model = data.model(settings)?;
    let (prior, sampler) = (settings.prior(), settings.sampler());
    let is_stopped = || stop.load(Ordering::Relaxed);
    let run_chain = |number: u64| {
        let start = data.start(&settings.init(), number)?;
        let recorder = TraceRecorder::new(settings.count("max_topologies") as usize);
        let mut observer = (recorder, StopFlag(stop));
        let purpose = chain_purpose(settings, data, number);
        let n_steps = settings.count("samples");
        let done = chain::run(
            &model,
            prior,
            &sampler,
            &start,
            n_steps,
            &purpose,
            &mut observer,
        );
        if done < n_steps {
            return Ok(None);
        }
        let trace = observer.0.finish();
        let finished = Finished {
            trace: &trace,
            start: &start,
            model: &model,
            data,
            settings,
            purpose: &purpose,
            tables,
        };
        let outcome = finished.outcome(&is_stopped);
        Ok(outcome.map(|outcome| SampledChain { trace, outcome }))
    };
    let numbers = 0..settings.count("chains");
    let chains: Vec<Option<SampledChain>> = numbers
        .into_par_iter()
        .map(run_chain)
        .collect::<Result<_, DataError>>()?;
    Ok(chains.into_iter().collect())
}
