//! The folder of a sweep's run: whose it is, and what lies in it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::plan::Plan;
use crate::detections::DetectionsError;
use crate::files::write_whole;
use crate::rng::{SAMPLER_SEMANTICS, WORLD_SEMANTICS};
use crate::sweep::Sweep;

/// `run.json`: which sweep the folder is of, and by whom and when it was run. Host, threads and dates
/// stand here and nowhere else.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunFile {
    /// Name of the sweep.
    pub sweep: String,
    /// Its identity.
    pub key: String,
    /// The detections CSV that was given, if the data are not simulated.
    pub data: Option<String>,
    /// Version of the program.
    pub version: String,
    /// Semantics of worlds and chains.
    pub semantics: [String; 2],
    /// Seconds since 1970 at the last start.
    pub started_unix_s: u64,
    /// Seconds since 1970 at the end; null while it runs or if it was stopped.
    pub ended_unix_s: Option<u64>,
    /// Worker threads.
    pub threads: usize,
    /// Instruction set of the kernels.
    pub cpu_path: String,
    /// Chains with a record, out of all.
    pub chains_done: usize,
    /// All chains.
    pub chains: usize,
}

/// A folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It holds something else.
    #[error(
        "{path}: the folder holds {what}; choose another with --out, or replace it with --force"
    )]
    Taken {
        /// The folder.
        path: String,
        /// What it holds.
        what: String,
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
    /// `run.json` is not ours.
    #[error("{path}: got {what}, expected the run.json of a sweep; give the folder of a report")]
    NoRun {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
    /// A copy of the detections cannot be written.
    #[error(transparent)]
    Detections(#[from] DetectionsError),
}

/// The folder of one run.
#[derive(Clone, Debug)]
pub struct RunFolder {
    path: PathBuf,
}

/// What a run leaves in its folder, and `--force` removes: nothing else is touched. `run.json` is
/// the mark that the rest is ours, so it is written first and removed last.
const OURS: [&str; 28] = [
    "figures",
    "cells",
    "factors",
    "detections",
    "journal.jsonl",
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
    "run.json",
];

impl RunFolder {
    /// The folder, made if it is missing. It may be empty, or hold an earlier run of the same sweep
    /// on the same data, which is continued; another run is refused, or with `force` replaced. Files
    /// that are no run's are never replaced: they may be all that somebody has.
    ///
    /// # Errors
    /// A folder that holds something else, or cannot be made.
    pub fn claim(path: &Path, run: &RunFile, force: bool) -> Result<Self, FolderError> {
        let folder = Self {
            path: path.to_owned(),
        };
        let path_text = || path.display().to_string();
        std::fs::create_dir_all(path).map_err(|source| folder.io(path, "written", source))?;
        let entries = std::fs::read_dir(path).map_err(|source| folder.io(path, "read", source))?;
        let is_empty = entries.count() == 0;
        match folder.read_run_file() {
            Ok(earlier) if earlier.key == run.key => {}
            Ok(_) if force => folder.clear()?,
            Ok(earlier) => {
                return Err(FolderError::Taken {
                    path: path_text(),
                    what: earlier.what_it_is(run),
                });
            }
            Err(_) if is_empty => {}
            Err(_) => return Err(FolderError::Foreign { path: path_text() }),
        }
        folder.write_run_file(run)?;
        Ok(folder)
    }

    /// The folder of a run that was made earlier.
    pub fn existing(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal's file.
    pub fn journal(&self) -> PathBuf {
        self.path.join("journal.jsonl")
    }

    fn clear(&self) -> Result<(), FolderError> {
        for name in OURS {
            let path = self.path.join(name);
            let removed = if path.is_dir() {
                std::fs::remove_dir_all(&path)
            } else {
                std::fs::remove_file(&path)
            };
            match removed {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(self.io(&path, "written", error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Removes the pages of cells, so that what an earlier or partial report left never stands beside a
    /// finished one.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn clear_pages(&self) -> Result<(), FolderError> {
        for name in ["cells", "factors", "figures/cells", "figures/factors"] {
            let path = self.path.join(name);
            match std::fs::remove_dir_all(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(self.io(&path, "written", error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads `run.json`.
    ///
    /// # Errors
    /// A file that is missing or not ours.
    pub fn read_run_file(&self) -> Result<RunFile, FolderError> {
        let path = self.path.join("run.json");
        let no_run = |what: String| FolderError::NoRun {
            path: path.display().to_string(),
            what,
        };
        let text = std::fs::read_to_string(&path)
            .map_err(|error| no_run(format!("no such file ({error})")))?;
        serde_json::from_str(&text).map_err(|error| no_run(error.to_string()))
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write_run_file(&self, run: &RunFile) -> Result<(), FolderError> {
        let mut text = serde_json::to_string_pretty(run).expect("texts and numbers make JSON");
        text.push('\n');
        self.put("run.json", text.as_bytes())
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
        std::fs::create_dir_all(&folder).map_err(|source| self.io(&folder, "written", source))?;
        for (index, data) in plan.data_sets.iter().enumerate() {
            if let Ok(data) = data {
                self.put(&file(index), data.detections.to_csv_string().as_bytes())?;
            }
        }
        Ok(())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let path = self.path.join(name);
        write_whole(&path, bytes).map_err(|source| self.io(&path, "written", source))
    }

    fn io(&self, path: &Path, verb: &'static str, source: std::io::Error) -> FolderError {
        FolderError::Io {
            path: path.display().to_string(),
            verb,
            source,
        }
    }
}

impl RunFile {
    /// For a run that starts now.
    pub fn starting(sweep: &Sweep, plan: &Plan, threads: usize) -> Self {
        let csv = sweep.base.text("detections");
        Self {
            sweep: sweep.name.clone(),
            key: plan.key(sweep),
            data: (!csv.is_empty()).then(|| csv.to_owned()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            semantics: [WORLD_SEMANTICS.to_owned(), SAMPLER_SEMANTICS.to_owned()],
            started_unix_s: unix_s(),
            ended_unix_s: None,
            threads,
            cpu_path: crate::model::penalty::cpu_path().to_owned(),
            chains_done: 0,
            chains: plan.tasks.len(),
        }
    }

    /// How this run differs from `other`, in words.
    fn what_it_is(&self, other: &Self) -> String {
        if self.sweep == other.sweep && self.data != other.data {
            let data = self.data.as_deref().unwrap_or("simulated worlds");
            format!("another run of this sweep, on {data}")
        } else {
            format!("another sweep or other data ({})", self.sweep)
        }
    }

    /// The same run, at its end.
    #[must_use]
    pub fn ended(mut self, chains_done: usize) -> Self {
        self.chains_done = chains_done;
        self.ended_unix_s = (chains_done == self.chains).then(unix_s);
        self
    }
}

fn unix_s() -> u64 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    now.map_or(0, |since| since.as_secs())
}
