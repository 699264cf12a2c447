//! A sweep: its chains run in a folder, its tables and its report.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::provenance;
use super::timing::write_timings;
use super::{Interrupt, JobError};
use crate::report::{self, Material, Pages};
use crate::results::SweepResults;
use crate::results::sample::judgement;
use crate::run::{
    self, Claimant, FolderError, Journal, Plan, Progress, RunFile, RunFolder, RunOptions,
};
use crate::sweep::Sweep;
use crate::table;

/// A sweep and the folder of its report.
///
/// ```no_run
/// use std::path::Path;
/// use std::sync::atomic::AtomicBool;
/// use std::time::Duration;
///
/// use topometric::job::{Interrupt, SweepEnd, SweepJob};
/// use topometric::report::Pages;
/// use topometric::run::{RunOptions, Silent};
/// use topometric::sweep::Sweep;
///
/// let sweep = Sweep::read(Path::new("sweeps/smoke.toml"), None)?;
/// let job = SweepJob {
///     sweep: &sweep,
///     folder: Path::new("reports/smoke"),
///     force: false,
///     options: RunOptions::default(),
///     checkpoints_every: Duration::from_secs(5),
/// };
/// let stop = AtomicBool::new(false);
/// let interrupt = Interrupt { flag: &stop, by: &|| "nobody".to_owned() };
/// let ended = job.begin(|_plan| ())?.run(&Pages::Chosen, &|_| (), &Silent, interrupt)?;
/// if let SweepEnd::Reported { results, index } = ended {
///     assert!(results.cells.len() == 4 && index.is_file());
/// }
/// # Ok::<(), topometric::job::JobError>(())
/// ```
pub struct SweepJob<'a> {
    /// The sweep.
    pub sweep: &'a Sweep,
    /// Where the report goes; what the folder holds of the sweep is not run again.
    pub folder: &'a Path,
    /// Whether what another sweep left in the folder may be replaced.
    pub force: bool,
    /// What chains may take; with a shard, the part of the sweep that is run.
    pub options: RunOptions,
    /// Time between two checkpoints of a chain.
    pub checkpoints_every: Duration,
}

/// A sweep whose folder is claimed: its lock is held as long as this lives.
pub struct Begun<'a> {
    /// The sweep.
    pub sweep: &'a Sweep,
    /// Its chains.
    pub plan: Plan,
    /// Its folder.
    pub folder: RunFolder,
    /// How its chains are run.
    pub options: RunOptions,
    run_file: RunFile,
}

/// How a sweep ended.
pub enum SweepEnd {
    /// All chains have a record, and the report is written.
    Reported {
        /// What was found.
        results: Box<SweepResults>,
        /// The page that opens the report.
        index: PathBuf,
    },
    /// It was stopped; what is finished is kept, and the same sweep in the same folder goes on.
    Stopped {
        /// Chains with a record.
        n_done: usize,
        /// Chains of the sweep.
        n_chains: usize,
    },
}

impl<'a> SweepJob<'a> {
    /// Finds everything that can be wrong with the input, then claims the folder. `note` hears what
    /// readers of the data put up with.
    ///
    /// # Errors
    /// Data that cannot be had, or a folder that cannot be used or belongs to another sweep.
    pub fn begin(self, note: impl FnOnce(&Plan)) -> Result<Begun<'a>, JobError> {
        let Self { sweep, folder, .. } = self;
        let plan = Plan::new(sweep)?;
        note(&plan);
        let mut run_file = RunFile::new(sweep, &plan);
        let claimant = match self.options.shard {
            Some(_) => Claimant::Shard,
            None => Claimant::Writer,
        };
        let claimed = RunFolder::claim(folder, &run_file, self.force, claimant);
        let claimed = claimed.map_err(|error| with_what_is_kept(error, &plan, folder));
        let (folder, earlier) = claimed?;
        if let Some(earlier) = earlier {
            run_file.starts = earlier.starts;
            run_file.chains_done = earlier.chains_done;
        }
        let checkpoints = Some((folder.checkpoints(), self.checkpoints_every));
        Ok(Begun {
            sweep,
            plan,
            folder,
            options: RunOptions {
                checkpoints,
                ..self.options
            },
            run_file,
        })
    }
}

impl Begun<'_> {
    /// Runs the chains that the folder does not hold, and writes tables and report. Of a whole sweep:
    /// a shard writes neither, and [`run::execute`] runs it. `stage` hears
    /// what is computed after the chains.
    ///
    /// # Errors
    /// A folder that cannot be written, or data that have changed for the worse.
    pub fn run(
        mut self,
        pages: &Pages,
        stage: &dyn Fn(&str),
        progress: &dyn Progress,
        interrupt: Interrupt<'_>,
    ) -> Result<SweepEnd, JobError> {
        assert!(self.options.shard.is_none(), "a shard writes no report");
        let start = provenance::start_now(&self.options.limits, None);
        self.run_file.starts.push(start);
        let Self {
            sweep,
            plan,
            folder,
            options,
            run_file,
        } = &mut self;
        folder.write_run_file(run_file)?;
        let journal = Journal::open(folder.path())?;
        for note in journal.notes() {
            progress.note(note);
        }
        let mut so_far = plan.clone();
        so_far.replay(sweep, &journal)?;
        if let Some(what) = what_was_lost(&so_far, &journal, run_file, folder.path()) {
            progress.note(&what);
        }
        drop(so_far);
        folder.clear_temporary()?;
        folder.write_inputs(sweep, plan, report::data_file)?;

        let watching = (&judgement as _, progress);
        let result = run::execute(sweep, plan, &journal, options, watching, interrupt.flag)?;
        let (n_done, n_chains) = (result.n_done(), plan.tasks.len());
        run_file.chains = n_chains;
        run_file.chains_done = n_done;
        if let Some(start) = run_file.starts.last_mut() {
            provenance::ended(start, interrupt, &result);
        }
        folder.write_run_file(run_file)?;
        if interrupt.came() {
            return Ok(SweepEnd::Stopped { n_done, n_chains });
        }
        if sweep.stopping().is_some() {
            // The worlds of later rounds.
            folder.write_inputs(sweep, plan, report::data_file)?;
        }
        let seconds = write_timings(folder, plan, &result)?;
        // The journal has done its work, and would hold every record a second time.
        drop(journal);
        stage("after the chains: diagnostics of worlds, cells and factors");
        let results = SweepResults::gather(sweep, plan, result.records);
        stage("after the chains: tables");
        write_tables(folder, (sweep, plan), &results)?;
        stage("after the chains: figures and pages");
        folder.clear_pages()?;
        let material = Material {
            sweep,
            plan,
            results: &results,
        };
        let index = report::write(folder.path(), material, pages)?;
        report::write_timing(folder.path(), material, &seconds)?;
        Ok(SweepEnd::Reported {
            results: Box::new(results),
            index,
        })
    }
}

/// A refusal of a folder with what --force would keep of it: a chain that both sweeps have is the
/// same.
fn with_what_is_kept(error: FolderError, plan: &Plan, out: &Path) -> FolderError {
    let FolderError::Taken { path, what, .. } = error else {
        return error;
    };
    let kept = Journal::read_only(out).map_or_else(
        |_| String::new(),
        |journal| {
            let chains = plan.chains(None);
            let n_kept = chains
                .iter()
                .filter(|task| journal.get(&task.key).is_some());
            let n_kept = n_kept.count();
            let n_gone = journal.n_records().saturating_sub(n_kept);
            let (n_chains, one) = (chains.len(), if n_gone == 1 { "chain" } else { "chains" });
            format!(
                ", which keeps {n_kept} of the {n_chains} chains of this sweep and leaves {n_gone} \
                 other {one} out of the tables"
            )
        },
    );
    FolderError::Taken { path, what, kept }
}

/// A journal cut at the end of a line looks like one that was never longer, but for what `run.json`
/// says.
fn what_was_lost(plan: &Plan, journal: &Journal, run_file: &RunFile, out: &Path) -> Option<String> {
    let held = plan.tasks.iter();
    let held = held.filter(|task| journal.get(&task.key).is_some());
    let (n_held, n_done) = (held.count(), run_file.chains_done);
    (n_held < n_done).then(|| {
        format!(
            "{}: run.json says that {n_done} chains were done, and the journal holds {n_held}: \
             records were lost, and their chains are run again",
            out.display()
        )
    })
}

/// Writes the tables of what was found.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_tables(
    folder: &RunFolder,
    (sweep, plan): (&Sweep, &Plan),
    results: &SweepResults,
) -> Result<(), JobError> {
    let path = folder.path();
    table::chains_table(sweep, results).write(path, "chains")?;
    table::cells_table(sweep, results).write(path, "cells")?;
    table::topologies_table(sweep, results).write(path, "topologies")?;
    table::convergence_table(sweep, results).write(path, "convergence")?;
    if let Some(table) = table::posteriors_table(sweep, plan, results) {
        table.write(path, "posteriors")?;
    }
    // A list of cells has no factors whose effects could be told.
    for (name, table) in table::sensitivity_tables(&results.sensitivity) {
        table.write(path, name)?;
    }
    Ok(())
}
