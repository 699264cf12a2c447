//! A sweep into a folder.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use pyo3::prelude::*;
use topometric::job::{Interrupt, SweepEnd, SweepJob};
use topometric::report::Pages;
use topometric::run::{ChainStatus, Limits, Plan, Progress, Round, RunOptions};
use topometric::sweep::Sweep;

use super::error;
use super::watched::watched;

/// Time between two checkpoints of a chain.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(5);

/// How far a sweep is: counts that another thread looks at, and notes that it takes.
#[derive(Default)]
struct Counts {
    n_chains: AtomicUsize,
    n_done: AtomicUsize,
    n_failed: AtomicUsize,
    notes: Mutex<Vec<String>>,
}

impl Counts {
    fn add_note(&self, what: &str) {
        if let Ok(mut notes) = self.notes.lock() {
            notes.push(what.to_owned());
        }
    }
}

impl Progress for Counts {
    fn start(&self, n_chains: usize, _n_steps: u64, _n_already_done: usize) {
        self.n_chains.fetch_add(n_chains, Ordering::Relaxed);
    }

    fn note(&self, what: &str) {
        self.add_note(what);
    }

    fn chain_done(&self, _n_steps: u64, status: &ChainStatus) {
        if let ChainStatus::Failed { .. } = status {
            self.n_failed.fetch_add(1, Ordering::Relaxed);
        }
        self.n_done.fetch_add(1, Ordering::Relaxed);
    }

    fn round(&self, round: Round) {
        self.add_note(&format!(
            "{} cells go on, up to {} worlds",
            round.n_cells, round.n_worlds
        ));
    }
}

/// Runs a sweep file, or what its folder lacks of it, and writes the report. `progress` is called
/// with the numbers of chains done, to do and failed, and with a note or None. Returns the path of
/// the page that opens the report, and the number of chains that failed.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn sweep(
    py: Python<'_>,
    file: PathBuf,
    data: Option<PathBuf>,
    folder: Option<PathBuf>,
    force: bool,
    all_cells: bool,
    max_seconds: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(PathBuf, usize)> {
    let counts = Counts::default();
    let mut told = (usize::MAX, 0, 0);
    let tell = |py: Python<'_>| -> PyResult<()> {
        let Some(progress) = &progress else {
            return Ok(());
        };
        let number = |count: &AtomicUsize| count.load(Ordering::Relaxed);
        let now = (
            number(&counts.n_done),
            number(&counts.n_chains),
            number(&counts.n_failed),
        );
        let notes = counts
            .notes
            .lock()
            .map(|mut notes| std::mem::take(&mut *notes));
        for note in notes.unwrap_or_default() {
            progress.call1(py, (now.0, now.1, now.2, note))?;
        }
        if now != told && now.1 > 0 {
            told = now;
            progress.call1(py, (now.0, now.1, now.2, py.None()))?;
        }
        Ok(())
    };
    let run = |stop: &std::sync::atomic::AtomicBool| {
        let sweep = Sweep::read(&file, data.as_deref())?;
        let folder = folder.unwrap_or_else(|| PathBuf::from("reports").join(&sweep.name));
        let job = SweepJob {
            sweep: &sweep,
            folder: &folder,
            force,
            options: RunOptions {
                limits: Limits {
                    max_seconds,
                    ..Limits::default()
                },
                ..RunOptions::default()
            },
            checkpoints_every: CHECKPOINT_INTERVAL,
        };
        let noted = |plan: &Plan| {
            let data_sets = plan.data_sets.iter().flatten();
            let notes = data_sets
                .flat_map(|data| &data.notes)
                .map(ToString::to_string);
            let notes: BTreeSet<String> = notes.collect();
            notes.iter().for_each(|note| counts.add_note(note));
        };
        let begun = job.begin(noted)?;
        let pages = if all_cells { Pages::All } else { Pages::Chosen };
        let interrupt = Interrupt {
            flag: stop,
            by: &|| "Python".to_owned(),
        };
        begun.run(&pages, &|_| (), &counts, interrupt)
    };
    match watched(py, run, tell)?.map_err(error)? {
        SweepEnd::Reported { results, index } => Ok((index, results.n_failed())),
        SweepEnd::Stopped { n_done, n_chains } => Err(error(format!(
            "stopped: {n_done} of {n_chains} chains are kept; sweep again to continue"
        ))),
    }
}
