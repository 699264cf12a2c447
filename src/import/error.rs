//! What can be wrong with a recording: one line each.

use crate::input::InputError;

/// A recording that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file cannot be read, or is no text or table as it should be.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The user must choose, or chose what is not there.
    #[error("{flag}: got {got}, expected {expected}; give another")]
    Choice {
        /// The flag.
        flag: &'static str,
        /// What was given.
        got: String,
        /// What there is.
        expected: String,
    },
    /// A line of another number of fields.
    #[error("{path}, line {line}: got {got} fields, expected {expected}; correct the line")]
    Fields {
        /// The file.
        path: String,
        /// The line, from 1.
        line: u64,
        /// How many it has.
        got: usize,
        /// What they should be.
        expected: &'static str,
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
    /// Numbers that must be in another unit.
    #[error("{place}: got {got}, expected {expected}; is it in {guess}")]
    Unit {
        /// The file, the line and the column.
        place: String,
        /// What is there.
        got: String,
        /// The unit that should be.
        expected: &'static str,
        /// The unit that it may be in, and what to do then.
        guess: &'static str,
    },
    /// Two lines, or two files, that do not agree.
    #[error("{place}: got {got}, expected {expected}; {change}")]
    Disagrees {
        /// The file, and the line where there is one.
        place: String,
        /// What is there.
        got: String,
        /// What should be.
        expected: String,
        /// What to do.
        change: &'static str,
    },
    /// There is nothing in it.
    #[error("{path}: got no sightings{instead}, expected at least one; check the file")]
    Empty {
        /// The file.
        path: String,
        /// What there was, after a comma; may be nothing.
        instead: String,
    },
}
