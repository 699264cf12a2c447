//! What can be wrong with a file that a user gives, one line each.

use std::fmt;
use std::path::PathBuf;

/// Where in a file: as much of it as is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// The line, from 1.
    pub line: Option<u64>,
    /// The column of a table.
    pub column: Option<&'static str>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ", column {column}")?;
        }
        Ok(())
    }
}

/// A file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The system does not let us read it.
    #[error("{}: cannot be read ({source}); check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The content must change.
    #[error(transparent)]
    Content(Box<Content>),
}

/// What is wrong with the content of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: got {got}, expected {expected}; {change}")]
pub struct Content {
    /// Where.
    pub place: Place,
    /// What is there.
    pub got: String,
    /// What may be there.
    pub expected: String,
    /// What to change.
    pub change: String,
}

impl From<Content> for InputError {
    fn from(content: Content) -> Self {
        Self::Content(Box::new(content))
    }
}
