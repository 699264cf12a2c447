//! The chains of one data set, side by side, as `ptm sample` and `ptm evaluate` run them.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::attended::{Attendance, Attended, ChainOf, Ended, threads_of_chain};
use super::chain_purpose;
use super::exact::ExactTables;
use super::limits::Limits;
use super::outcome::ChainOutcome;
use super::together::{Judge, Looks, until_converged};
use crate::chain::Trace;
use crate::dataset::{DataError, DataSet};
use crate::settings::{Settings, Until};

/// A chain that ran to its end.
#[derive(Serialize, Deserialize)]
pub struct SampledChain {
    /// What it did, step by step.
    pub trace: Trace,
    /// Its summary.
    pub outcome: ChainOutcome,
}

/// Runs as many chains as the settings say; what comes out does not depend on the number of threads.
/// `tables` has the exact posterior, if these detections are few
/// ([`tables_of_one`](super::tables_of_one)). `None` if `stop` was set before all chains and their
/// probes were done. `judge` says when chains that run until they have converged may end, and `looks`
/// hears of each time that it was asked.
///
/// # Errors
/// A model or a start that these data do not allow.
pub fn sample_chains(
    data: &DataSet,
    settings: &Settings,
    tables: &ExactTables,
    (judge, looks): (Judge<'_>, Looks<'_>),
    stop: &AtomicBool,
) -> Result<Option<Vec<SampledChain>>, DataError> {
    data.model(settings)?;
    for number in 0..settings.count("chains") {
        data.start(&settings.init(), number)?;
    }
    let stops = [stop];
    let n_threads = threads_of_chain(settings.count("chains") as usize);
    let begin = |number| {
        let of = ChainOf {
            settings,
            data,
            number,
            purpose: chain_purpose(settings, data, number),
        };
        let how = Attendance {
            limits: Limits::default(),
            checkpoints: None,
            stops: &stops,
            note: &|_| (),
            n_threads,
        };
        Attended::new(of, how)
    };
    let numbers = (0..settings.count("chains")).into_par_iter();
    let sampled: Result<Vec<SampledChain>, Ended> = match settings.until() {
        Until::Samples => numbers
            .map(|number| begin(number)?.sampled(tables))
            .collect(),
        Until::Converged => numbers
            .map(begin)
            .collect::<Result<_, _>>()
            .and_then(|chains| until_converged(chains, (settings, data), tables, (judge, looks))),
    };
    match sampled {
        Ok(sampled) => Ok(Some(sampled)),
        Err(Ended::Stopped) => Ok(None),
        Err(Ended::Failed { what, .. }) => unreachable!("{what}: model and starts are good"),
    }
}
