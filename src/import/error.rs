//! What can be wrong with a recording: one line each.

/// A recording that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file cannot be read.
    #[error("{path}: cannot be read ({source}); check the path and its permissions")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The header lacks a column.
    #[error("{path}, line 1: got the columns {got}, expected {expected}; add what is missing")]
    Header {
        /// The file.
        path: String,
        /// The columns that there are.
        got: String,
        /// Those that there should be.
        expected: String,
    },
    /// A value will not do.
    #[error(
        "{path}, line {line}, column {column}: got {got:?}, expected {expected}; correct the row"
    )]
    Value {
        /// The file.
        path: String,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// What it holds.
        got: String,
        /// What it may hold.
        expected: &'static str,
    },
    /// The file is no CSV, or no text.
    #[error("{path}: {what}; give a comma-separated text file, plain or compressed with gzip")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
    /// There is nothing in it.
    #[error("{path}: got no sightings, expected at least one row below the header; check the file")]
    Empty {
        /// The file.
        path: String,
    },
}
