//! `ptm`: parameter sweeps and diagnostics for Probabilistic Topological Maps.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::quiet_panics();
    cli::survive_size_limit();
    let outcome = std::panic::catch_unwind(|| {
        let arguments = cli::parse(std::env::args_os())?;
        cli::set_threads(&arguments)?;
        match arguments.command {
            None => cli::version::print(arguments.verbose),
            Some(cli::Command::Sweep(ref command)) => cli::sweep::run(command, &arguments),
            Some(cli::Command::Report(ref command)) => cli::report::run(command, &arguments),
            Some(cli::Command::Compare(ref command)) => cli::compare::run(command, &arguments),
            Some(cli::Command::Merge(ref command)) => cli::merge::run(command, &arguments),
            Some(cli::Command::Submit(ref command)) => cli::submit::run(command, &arguments),
            Some(cli::Command::Export(ref command)) => cli::export::run(command, &arguments),
            Some(cli::Command::Sample(ref command)) => cli::sample::run(command, &arguments),
            Some(cli::Command::Tune(ref command)) => cli::tune::run(command, &arguments),
            Some(cli::Command::Diagnose(ref command)) => cli::diagnose::run(command, &arguments),
            Some(cli::Command::Evaluate(ref command)) => cli::evaluate::run(command, &arguments),
            Some(cli::Command::Exact(ref command)) => cli::exact::run(command, &arguments),
            Some(cli::Command::Simulate(ref command)) => cli::simulate::run(command, &arguments),
            Some(cli::Command::Import(ref command)) => cli::import::run(command, &arguments),
            Some(cli::Command::Solve(ref command)) => cli::solve::run(command, &arguments),
            Some(cli::Command::Plan(ref command)) => cli::plan::run(command, &arguments),
            Some(cli::Command::Completions { shell }) => cli::completions(shell),
        }
    });
    cli::exit::code(outcome)
}
