//! What a reader left out or put up with, for the user to know.

use std::fmt;

/// One thing to know about a file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// How many, where it can be counted.
    pub count: Option<usize>,
    /// Of what, and what became of it.
    pub what: String,
}

impl Note {
    /// A note that counts nothing.
    pub fn plain(what: impl Into<String>) -> Self {
        Self {
            count: None,
            what: what.into(),
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.count {
            None => f.write_str(&self.what),
            Some(count) => write!(f, "{count} {}", self.what),
        }
    }
}
