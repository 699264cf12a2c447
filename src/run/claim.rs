//! Whose a folder is: a run claims it, is refused, or with `--force` replaces what another sweep
//! left.
//!
//! A refusal changes nothing in the folder; everything is looked at again once the lock is held.

use std::path::Path;
use std::sync::Arc;

use super::folder::remove;
use super::lock::{LOCK, Lock, NoShards};
use super::shard_files::SHARDS;
use super::{FolderError, Journal, RunFile, RunFolder};
use crate::files::{TEMPORARY, write_new};

/// Who claims a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claimant {
    /// The one process that writes the journal and the report.
    Writer,
    /// One of several shards, or what prepares the folder for them.
    Shard,
}

/// What a folder holds, for somebody who wants to run a sweep there.
enum Held {
    Nothing,
    Same(RunFile),
    /// Another sweep's run, or one that cannot be told, which `--force` replaces: why it is refused
    /// without.
    Another(FolderError),
}

/// Folders of a report that only the holder of its lock writes into.
const OF_THE_WRITER: [&str; 5] = [
    "figures",
    "figures/cells",
    "figures/factors",
    "cells",
    "factors",
];
/// Those that shards write into too.
const OF_ALL: [&str; 5] = ["", "detections", SHARDS, "checkpoints", "slurm"];

impl RunFolder {
    /// The folder, made if it is missing, and locked. It may be empty, or hold an earlier run of
    /// the same sweep on the same data, which is continued; another run is refused, or with `force`
    /// replaced, but for its journals: a chain that both have is the same chain. Files that are no
    /// run's are never replaced: they may be all that somebody has.
    ///
    /// Returns the `run.json` that was there, if it is of the same sweep. What is refused is left
    /// as it was.
    ///
    /// # Errors
    /// A folder that holds something else, or cannot be made, or where another process is at work.
    pub fn claim(
        path: &Path,
        run: &RunFile,
        force: bool,
        claimant: Claimant,
    ) -> Result<(Self, Option<RunFile>), FolderError> {
        let mut folder = Self::existing(path);
        if let Some(file) = path.ancestors().find(|part| part.exists())
            && !file.is_dir()
        {
            let path = file.display().to_string();
            return Err(FolderError::NotAFolder { path });
        }
        let written = |source| FolderError::io(path, "written", source);
        std::fs::create_dir_all(path).map_err(written)?;
        // Looked at before anything is locked, so that not even a lock is left in a folder that is
        // refused.
        let is_another = match folder.held(run)? {
            Held::Another(refusal) if !force => return Err(refusal),
            Held::Another(_) => true,
            Held::Nothing | Held::Same(_) => false,
        };
        let lock = if claimant == Claimant::Writer || is_another {
            let lock = Lock::of_writer(path)?;
            folder.replace_another(run, force)?;
            Some(lock)
        } else {
            None
        };
        folder.lock = Some(Arc::new(match (claimant, lock) {
            (Claimant::Writer, Some(lock)) => lock,
            (_, lock) => {
                drop(lock);
                Lock::of_shard(path)?
            }
        }));
        let run_file = path.join("run.json");
        match folder.held(run)? {
            Held::Same(earlier) => Ok((folder, Some(earlier))),
            Held::Another(refusal) => Err(refusal),
            Held::Nothing => {
                let made = write_new(&run_file, run.to_json().as_bytes());
                made.map_err(|source| FolderError::io(&run_file, "written", source))?;
                // Another shard may have been first, of this sweep or of another.
                match folder.held(run)? {
                    Held::Another(refusal) => Err(refusal),
                    _ => Ok((folder, None)),
                }
            }
        }
    }

    /// With the writer's lock held: another run gives way to this one, all at once or not at all.
    fn replace_another(&self, run: &RunFile, force: bool) -> Result<(), FolderError> {
        let Held::Another(refusal) = self.held(run)? else {
            return Ok(());
        };
        if !force {
            return Err(refusal);
        }
        // A journal that cannot be read would refuse the run when the old report is gone.
        Journal::read_only(&self.path)?;
        let alone = NoShards::take(&self.path)
            .map_err(|source| FolderError::io(&self.path, "written", source))?;
        let Some(_alone) = alone else {
            return Err(FolderError::in_use(&self.path));
        };
        self.clear()?;
        self.write_run_file(run)
    }

    /// The folder of a run that was made earlier, locked for writing.
    ///
    /// # Errors
    /// A folder that holds no run, or where another process is at work.
    pub fn lock(path: &Path) -> Result<Self, FolderError> {
        let mut folder = Self::existing(path);
        folder.read_run_file()?;
        folder.lock = Some(Arc::new(Lock::of_writer(path)?));
        Ok(folder)
    }

    fn held(&self, run: &RunFile) -> Result<Held, FolderError> {
        let path = || self.path.display().to_string();
        let taken = |what: String| FolderError::Taken {
            path: path(),
            what,
            kept: String::new(),
        };
        match self.read_run_file() {
            Ok(earlier) if earlier.key == run.key => Ok(Held::Same(earlier)),
            Ok(earlier) => Ok(Held::Another(taken(earlier.what_it_is(run)))),
            Err(FolderError::NoRun { .. }) if self.is_empty()? => Ok(Held::Nothing),
            // Another shard has written it in between.
            Err(FolderError::NoRun { .. }) if self.path.join("run.json").exists() => self.held(run),
            Err(FolderError::NoRun { .. }) if self.is_a_sweeps() => Ok(Held::Another(taken(
                "a sweep without its run.json".to_owned(),
            ))),
            Err(damaged @ FolderError::Damaged { .. }) if self.is_a_sweeps() => {
                Ok(Held::Another(damaged))
            }
            Err(FolderError::NoRun { .. } | FolderError::Damaged { .. }) => {
                Err(FolderError::Foreign { path: path() })
            }
            Err(error) => Err(error),
        }
    }

    /// Whether a sweep has been here, whatever became of its `run.json`.
    fn is_a_sweeps(&self) -> bool {
        let has = |name: &str| self.path.join(name).exists();
        Journal::is_in(&self.path) || (has("sweep.toml") && has("detections") && has(LOCK))
    }

    /// Whether nothing is in it but locks and what is still being written.
    fn is_empty(&self) -> Result<bool, FolderError> {
        let holds_nothing_else = |folder: &Path, others: &[&str]| -> Result<bool, FolderError> {
            let read = |source| FolderError::io(folder, "read", source);
            for entry in std::fs::read_dir(folder).map_err(read)? {
                let name = entry.map_err(read)?.file_name();
                let name = name.to_string_lossy();
                if !name.starts_with(TEMPORARY) && !others.contains(&&*name) {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        let shards = self.path.join(SHARDS);
        Ok(holds_nothing_else(&self.path, &[LOCK, SHARDS])?
            && (!shards.is_dir() || holds_nothing_else(&shards, &[LOCK])?))
    }

    /// Removes what earlier runs were killed over: files that never came to their place. For
    /// whoever holds the folder's lock; what may be a shard's is left while a shard runs.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn clear_temporary(&self) -> Result<(), FolderError> {
        self.clear_temporary_in(&OF_THE_WRITER)?;
        let had_shards = self.path.join(SHARDS).exists();
        let alone = had_shards.then(|| NoShards::take(&self.path)).transpose();
        let alone = alone.map_err(|source| FolderError::io(&self.path, "written", source))?;
        match alone.flatten() {
            Some(alone) if alone.is_certain => self.clear_temporary_in(&OF_ALL),
            None if !had_shards => self.clear_temporary_in(&OF_ALL),
            _ => Ok(()),
        }
    }

    fn clear_temporary_in(&self, folders: &[&str]) -> Result<(), FolderError> {
        for folder in folders {
            let Ok(entries) = std::fs::read_dir(self.path.join(folder)) else {
                continue;
            };
            for entry in entries.flatten() {
                if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
                    remove(&entry.path())?;
                }
            }
        }
        Ok(())
    }
}
