//! The folder of a sweep's run: whose it is, and what lies in it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::JournalError;
use super::lock::Lock;
use super::plan::Plan;
use super::run_file::{MAX_RUN_FILE, RunFile};
use crate::detections::DetectionsError;
use crate::excerpt::message;
use crate::files::{read_text_at_most, write_durable, write_whole};
use crate::sweep::Sweep;

/// A folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It holds something else.
    #[error(
        "{path}: the folder holds {what}; choose another with --out, or take it over with --force{kept}"
    )]
    Taken {
        /// The folder.
        path: String,
        /// What it holds.
        what: String,
        /// What of it --force would keep, in words; empty if that is not known.
        kept: String,
    },
    /// It holds what no sweep wrote.
    #[error("{path}: the folder holds files that are no sweep's; choose another with --out")]
    Foreign {
        /// The folder.
        path: String,
    },
    /// It cannot be read or written.
    #[error("{path}: cannot be {verb} ({source}); check the folder's rights and free space")]
    Io {
        /// The file.
        path: String,
        /// read or written.
        verb: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// There is no `run.json`.
    #[error("{path}: got {what}, expected the run.json of a sweep; give the folder of a report")]
    NoRun {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
    /// `run.json` is not as it was written.
    #[error(
        "{path}: got a damaged file ({what}), expected the run.json of a sweep; restore it, or run \
         the sweep again with --force, which keeps its journal"
    )]
    Damaged {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
    /// It is no folder.
    #[error("{path} is a file, not a folder; give the path of a folder")]
    NotAFolder {
        /// What is in the way.
        path: String,
    },
    /// Another process writes there.
    #[error(
        "{path}: another ptm is at work in this folder, and nothing was changed; wait for its end, \
         or choose another folder"
    )]
    InUse {
        /// The folder.
        path: String,
    },
    /// Its journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A copy of the detections cannot be written.
    #[error(transparent)]
    Detections(#[from] DetectionsError),
}

impl FolderError {
    pub(super) fn io(path: &Path, verb: &'static str, source: std::io::Error) -> Self {
        Self::Io {
            path: path.display().to_string(),
            verb,
            source,
        }
    }

    pub(super) fn in_use(folder: &Path) -> Self {
        let path = folder.display().to_string();
        Self::InUse { path }
    }
}

/// The folder of one run.
#[derive(Clone, Debug)]
pub struct RunFolder {
    pub(super) path: PathBuf,
    /// The right to write into it, for as long as this or a copy of it lives.
    pub(super) lock: Option<Arc<Lock>>,
}

/// What a run leaves in its folder besides its journals, and `--force` removes: nothing else is touched.
/// `run.json`, the mark that the rest is ours, stays until it is replaced.
const OURS: &[&str] = &[
    "figures",
    "cells",
    "factors",
    "detections",
    "chains.parquet",
    "chains.csv",
    "cells.parquet",
    "cells.csv",
    "topologies.parquet",
    "topologies.csv",
    "convergence.parquet",
    "convergence.csv",
    "effects.parquet",
    "effects.csv",
    "contrasts.parquet",
    "contrasts.csv",
    "interactions.parquet",
    "interactions.csv",
    "indices.parquet",
    "indices.csv",
    "timings.parquet",
    "timings.csv",
    "report.md",
    "timing.html",
    "index.html",
    "sweep.toml",
];

impl RunFolder {
    /// The folder of a run that was made earlier, to be read.
    pub fn existing(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            lock: None,
        }
    }

    /// Where chains say how far they are.
    pub fn checkpoints(&self) -> PathBuf {
        self.path.join("checkpoints")
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes a report, when another takes its place.
    pub(super) fn clear(&self) -> Result<(), FolderError> {
        OURS.iter()
            .try_for_each(|name| remove(&self.path.join(name)))
    }

    /// Removes the pages of cells, so that what an earlier or partial report left never stands beside a
    /// finished one.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn clear_pages(&self) -> Result<(), FolderError> {
        let pages = ["cells", "factors", "figures/cells", "figures/factors"];
        pages
            .iter()
            .try_for_each(|name| remove(&self.path.join(name)))
    }

    /// Reads `run.json`.
    ///
    /// # Errors
    /// A file that is missing or not ours.
    pub fn read_run_file(&self) -> Result<RunFile, FolderError> {
        let file = self.path.join("run.json");
        let path = file.display().to_string();
        let damaged = |what: String| FolderError::Damaged {
            path: path.clone(),
            what,
        };
        let text = read_text_at_most(&file, MAX_RUN_FILE).map_err(|error| match error.kind() {
            ErrorKind::NotFound => FolderError::NoRun {
                path: path.clone(),
                what: format!("no such file ({error})"),
            },
            ErrorKind::NotADirectory => FolderError::NotAFolder {
                path: self.path.display().to_string(),
            },
            ErrorKind::InvalidData | ErrorKind::FileTooLarge => damaged(error.to_string()),
            _ => FolderError::io(&file, "read", error),
        })?;
        serde_json::from_str(&text).map_err(|error| damaged(message(&error.to_string())))
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write_run_file(&self, run: &RunFile) -> Result<(), FolderError> {
        let path = self.path.join("run.json");
        write_durable(&path, run.to_json().as_bytes())
            .map_err(|source| FolderError::io(&path, "written", source))
    }

    /// Writes the sweep file and the detections of every world, so that a reader can sample any of
    /// them again.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write_inputs(
        &self,
        sweep: &Sweep,
        plan: &Plan,
        file: impl Fn(usize) -> String,
    ) -> Result<(), FolderError> {
        self.put("sweep.toml", sweep.text.as_bytes())?;
        let folder = self.path.join("detections");
        std::fs::create_dir_all(&folder)
            .map_err(|source| FolderError::io(&folder, "written", source))?;
        for (index, data) in plan.data_sets.iter().enumerate() {
            if let Ok(data) = data {
                self.put(&file(index), data.detections.to_csv_string().as_bytes())?;
            }
        }
        Ok(())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let path = self.path.join(name);
        write_whole(&path, bytes).map_err(|source| FolderError::io(&path, "written", source))
    }
}

/// Removes a file or a folder with all that it holds, if it is there.
pub(super) fn remove(path: &Path) -> Result<(), FolderError> {
    let removed = if path.is_dir() {
        std::fs::remove_dir_all(path)
    } else {
        std::fs::remove_file(path)
    };
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(FolderError::io(path, "written", error))
        }
        _ => Ok(()),
    }
}
