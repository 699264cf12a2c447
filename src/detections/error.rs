//! What can be wrong with detections, one line each: what, where, got, expected, what to change.

use std::path::PathBuf;

/// A fault in a set of detections or in its CSV.
#[derive(Debug, thiserror::Error)]
pub enum DetectionsError {
    /// The file cannot be read.
    #[error("cannot read detections from {}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("cannot write detections to {}: {source}; check that the folder exists and is writable", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Some bytes are not text.
    #[error("{}, line {line}: got bytes that are not UTF-8, expected UTF-8 text; save the file as UTF-8", path.display())]
    NotUtf8 {
        /// The file.
        path: PathBuf,
        /// Line of the first such byte, from 1.
        line: u64,
    },
    /// The file holds no header.
    #[error("{}, line 1: got a blank file, expected a header with the columns x,y; add one", path.display())]
    Blank {
        /// The file.
        path: PathBuf,
    },
    /// There is nothing to sample over.
    #[error("{place}: got no detections, expected at least one; add a row for each detection")]
    Empty {
        /// The file, or "detections" for a set made in memory.
        place: String,
    },
    /// The header does not give the columns of a detections file.
    #[error("{}, line {line}: got {got} in the header, expected {expected}; {change}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Line of the header, from 1.
        line: u64,
        /// What the header says.
        got: String,
        /// What it should say.
        expected: String,
        /// What to change.
        change: String,
    },
    /// A row has too many or too few fields.
    #[error("{}, line {line}: got {got} fields, expected {expected} as in the header; {change}", path.display())]
    FieldCount {
        /// The file.
        path: PathBuf,
        /// Line of the row, from 1.
        line: u64,
        /// Fields in the row.
        got: usize,
        /// Fields in the header.
        expected: usize,
        /// What to change.
        change: &'static str,
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
