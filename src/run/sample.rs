//! The chains of one data set, side by side, as `ptm sample` and `ptm evaluate` run them.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::chain_purpose;
use crate::chain::{self, Observer, Trace, TraceRecorder};
use crate::dataset::{DataError, DataSet};
use crate::settings::Settings;

struct StopFlag<'a>(&'a AtomicBool);
impl Observer for StopFlag<'_> {
    fn wants_stop(&mut self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs as many chains as the settings say; what comes out does not depend on the number of threads.
/// Once `stop` is set the chains end where they are.
///
/// # Errors
/// A model or a start that these data do not allow.
pub fn sample_chains(
    data: &DataSet,
    settings: &Settings,
    stop: &AtomicBool,
) -> Result<Vec<Trace>, DataError> {
    let start = data.start(&settings.init())?;
    let model = data.model(settings)?;
    let (prior, sampler) = (settings.prior(), settings.sampler());
    let run_chain = |number: u64| {
        let recorder = TraceRecorder::new(settings.count("max_topologies") as usize);
        let mut observer = (recorder, StopFlag(stop));
        let purpose = chain_purpose(settings, data, number);
        let n_steps = settings.count("samples");
        chain::run(
            &model,
            prior,
            &sampler,
            &start,
            n_steps,
            &purpose,
            &mut observer,
        );
        observer.0.finish()
    };
    let numbers = 0..settings.count("chains");
    Ok(numbers.into_par_iter().map(run_chain).collect())
}
