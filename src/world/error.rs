//! What can be wrong with a world, one line each.

use std::path::PathBuf;

/// A fault in a world, its file or its name.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The file cannot be read.
    #[error("cannot read the world from {}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file has more bytes than the file of a world may have.
    #[error(
        "{}: got more than {most_mb} MB, expected a world file of at most {most_mb} MB; \
         give the path of a world file",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// How many it may have, MB.
        most_mb: u64,
    },
    /// The file is not the TOML of a world.
    #[error("{}, line {line}, column {column}: {problem}; {change}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Line of the fault, from 1.
        line: usize,
        /// Column of the fault, from 1.
        column: usize,
        /// What the reader said.
        problem: String,
        /// What to change.
        change: String,
    },
    /// There is no built-in world of that name.
    #[error("world: got {got:?}, expected {expected}; {change}")]
    Name {
        /// The name asked for.
        got: String,
        /// What it may be.
        expected: &'static str,
        /// What to change.
        change: String,
    },
    /// Walls or route are impossible.
    #[error("{world}, {place}: got {got}, expected {expected}; {change}")]
    Geometry {
        /// The file or the name of the world.
        world: String,
        /// Which polygon, vertex or waypoint, from 1.
        place: String,
        /// What was found there.
        got: String,
        /// What may stand there.
        expected: &'static str,
        /// What to change.
        change: &'static str,
    },
}
