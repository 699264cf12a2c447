//! Why a job cannot be done: one line each.

use crate::dataset::DataError;
use crate::input::InputError;
#[cfg(feature = "reports")]
use crate::report::ReportError;
use crate::run::{FolderError, JournalError, RunError};
use crate::settings::SettingError;
use crate::sweep::SweepError;
#[cfg(feature = "reports")]
use crate::table::{ReadError, TableError};

/// A job that cannot be done. The message says what, where, got, expected and what to change.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// Settings that do not go together.
    #[error(transparent)]
    Settings(#[from] SettingError),
    /// A sweep file.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// Detections, a world or a model.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Data that are well formed and will not do.
    #[error("{0}")]
    Refused(String),
    /// A file that is read as text.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A table.
    #[cfg(feature = "reports")]
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The folder of a sweep.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The run of a sweep.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A table that cannot be written.
    #[cfg(feature = "reports")]
    #[error(transparent)]
    Table(#[from] TableError),
    /// A report that cannot be written.
    #[cfg(feature = "reports")]
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl From<JournalError> for JobError {
    fn from(error: JournalError) -> Self {
        Self::Run(error.into())
    }
}
