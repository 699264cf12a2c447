//! `ptm`: parameter sweeps and diagnostics for Probabilistic Topological Maps.

use std::process::ExitCode;

use topometric::cli::{self, Counting};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() -> ExitCode {
    ExitCode::from(cli::run(std::env::args_os()))
}
