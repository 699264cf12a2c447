//! `ptm --version`.

use crate::model::penalty::cpu_path;
use crate::rng::{SAMPLER_SEMANTICS, WORLD_SEMANTICS};

use super::{Exit, Failure};

/// Prints the version; with `-v` what decides speed and identity too.
pub fn print(verbose: u8) -> Result<Exit, Failure> {
    outln!("ptm {}", env!("CARGO_PKG_VERSION"));
    if verbose > 0 {
        outln!(
            "commit: {}",
            crate::job::provenance::COMMIT.unwrap_or("unknown")
        );
        outln!("cpu path: {}", cpu_path());
        outln!("threads: {}", rayon::current_num_threads());
        outln!("semantics: {WORLD_SEMANTICS}, {SAMPLER_SEMANTICS}");
    }
    Ok(Exit::Done)
}
