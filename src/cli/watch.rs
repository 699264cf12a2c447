//! `ptm report DIR --watch`: the page of a sweep that runs, written anew until the sweep has ended.
//!
//! The folder belongs to the sweep, so its lock is not asked for: the journal is only read, and the
//! one file written is `live.html`, replaced whole.

use std::path::Path;
use std::time::Duration;

use super::report::Finished;
use super::{Arguments, Exit, Failure, unwritable};
use crate::files::write_whole;
use crate::report::{self, Live, Material};
use crate::run::Journal;

/// Writes the page every few seconds; returns when all chains have ended.
pub fn run(folder: &Path, seconds: u64, arguments: &Arguments) -> Result<Exit, Failure> {
    let page = folder.join("live.html");
    let mut is_told = false;
    loop {
        let mut finished = Finished::read(folder)?;
        let journal = Journal::read_only(folder)?;
        finished.plan.replay(&finished.sweep, &journal)?;
        let tasks = &finished.plan.tasks;
        let n_chains = tasks.len();
        let done = tasks.iter().filter(|task| journal.get(&task.key).is_some());
        let live = Live {
            n_done: done.count(),
            n_chains,
            seconds,
        };
        let results = finished.gathered(journal);
        let material = Material {
            sweep: &finished.sweep,
            plan: &finished.plan,
            results: &results,
        };
        let text = report::live(material, live);
        write_whole(&page, text.as_bytes()).map_err(|error| unwritable(&page, &error))?;
        if !is_told && !arguments.quiet {
            outln!("watch: {}", page.display());
            is_told = true;
        }
        if live.n_done == n_chains {
            return Ok(Exit::Done);
        }
        std::thread::sleep(Duration::from_secs(seconds));
    }
}
