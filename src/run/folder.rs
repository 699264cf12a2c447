//! The folder of a sweep's run: whose it is, and what lies in it.

use std::path::{Path, PathBuf};

use super::plan::Plan;
use super::run_file::RunFile;
use crate::detections::DetectionsError;
use crate::excerpt::message;
use crate::files::{TEMPORARY, write_durable, write_whole};
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
    /// It is a file.
    #[error("{path}: got a file, expected a folder; choose another with --out")]
    NotAFolder {
        /// The file.
        path: String,
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
    /// The folder, made if it is missing. It may be empty, or hold an earlier run of the same sweep
    /// on the same data, which is continued; another run is refused, or with `force` replaced, but for
    /// its journals: a chain that both have is the same chain. Files that are no run's are never
    /// replaced: they may be all that somebody has.
    ///
    /// Returns the `run.json` that was there, if it is of the same sweep.
    ///
    /// # Errors
    /// A folder that holds something else, or cannot be made.
    pub fn claim(
        path: &Path,
        run: &RunFile,
        force: bool,
    ) -> Result<(Self, Option<RunFile>), FolderError> {
        let folder = Self {
            path: path.to_owned(),
        };
        let path_text = || path.display().to_string();
        if path.is_file() {
            return Err(FolderError::NotAFolder { path: path_text() });
        }
        std::fs::create_dir_all(path).map_err(|source| folder.io(path, "written", source))?;
        let earlier = match folder.read_run_file() {
            Ok(earlier) if earlier.key == run.key => Some(earlier),
            Ok(_) if force => {
                folder.clear()?;
                None
            }
            Ok(earlier) => {
                return Err(FolderError::Taken {
                    path: path_text(),
                    what: earlier.what_it_is(run),
                    kept: String::new(),
                });
            }
            Err(_) if folder.is_empty()? => None,
            Err(_) => match folder.read_run_file() {
                // Another shard has written it in between.
                Ok(earlier) if earlier.key == run.key => Some(earlier),
                _ => return Err(FolderError::Foreign { path: path_text() }),
            },
        };
        Ok((folder, earlier))
    }

    /// Whether nothing is in it but what is still being written.
    fn is_empty(&self) -> Result<bool, FolderError> {
        let entries =
            std::fs::read_dir(&self.path).map_err(|source| self.io(&self.path, "read", source))?;
        for entry in entries {
            let entry = entry.map_err(|source| self.io(&self.path, "read", source))?;
            if !entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Removes what earlier runs were killed over: files that never came to their place. For whoever has
    /// the folder's journal alone.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn clear_temporary(&self) -> Result<(), FolderError> {
        for sub in [
            "",
            "detections",
            "figures",
            "figures/cells",
            "cells",
            "shards",
            "checkpoints",
        ] {
            let Ok(entries) = std::fs::read_dir(self.path.join(sub)) else {
                continue;
            };
            for entry in entries.flatten() {
                if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
                    let path = entry.path();
                    std::fs::remove_file(&path)
                        .map_err(|source| self.io(&path, "written", source))?;
                }
            }
        }
        Ok(())
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
        serde_json::from_str(&text).map_err(|error| no_run(message(&error.to_string())))
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write_run_file(&self, run: &RunFile) -> Result<(), FolderError> {
        let path = self.path.join("run.json");
        write_durable(&path, run.to_json().as_bytes())
            .map_err(|source| self.io(&path, "written", source))
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
