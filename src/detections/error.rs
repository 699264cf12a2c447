//! What can be wrong with detections, one line each: what, where, got, expected, what to change.

use std::path::PathBuf;

use crate::input::InputError;

/// A fault in a set of detections or in its CSV.
#[derive(Debug, thiserror::Error)]
pub enum DetectionsError {
    /// The file cannot be read, or is no table of detections.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The file cannot be written.
    #[error("cannot write detections to {}: {source}; check that the folder exists and is writable", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// There is nothing to sample over.
    #[error("{place}: got no detections, expected at least one; add a row for each detection")]
    Empty {
        /// The file, or "detections" for a set made in memory.
        place: String,
    },
    /// A value is of the wrong kind or outside its range.
    #[error("{place}, column {column}: got {got}, expected {expected}; {change}")]
    Value {
        /// File and line, or the number of the detection (from 1) for a set made in memory.
        place: String,
        /// Name of the column.
        column: &'static str,
        /// The value as found.
        got: String,
        /// What may stand there.
        expected: &'static str,
        /// What to change.
        change: &'static str,
    },
}
