//! `ptm --version`.

use topometric::model::penalty::cpu_path;
use topometric::rng::{SAMPLER_SEMANTICS, WORLD_SEMANTICS};

use super::{Exit, Failure};

/// Prints the version; with `-v` what decides speed and identity too.
pub fn print(verbose: u8) -> Result<Exit, Failure> {
    println!("ptm {}", env!("CARGO_PKG_VERSION"));
    if verbose > 0 {
        println!("commit: {}", super::provenance::COMMIT.unwrap_or("unknown"));
        println!("cpu path: {}", cpu_path());
        println!("threads: {}", rayon::current_num_threads());
        println!("semantics: {WORLD_SEMANTICS}, {SAMPLER_SEMANTICS}");
    }
    Ok(Exit::Done)
}
