//! `ptm diagnose`: the verdict on chains of label vectors that another program drew.

use std::path::{Path, PathBuf};

use crate::job;
use crate::report;
use crate::settings::BurnInRule;
use clap::Args;

use super::numbers::count;
use super::progress::Stages;
use super::{Arguments, Exit, Failure, check_outputs, say, terminal, write_json, write_output};

/// Arguments of `ptm diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "\
A draw gives each item a label; items of one label share a set. A table has a row for each draw and a column \
for each item, or one column labels such as 0,0,1; and, if need be, chain, weight (steps that a draw stands \
for) and ln_target. JSON is an array chain x draw x item. Without chain each file is one chain. The Parquet \
of ptm sample --trace will do. docs/diagnose.md has examples.")]
pub struct DiagnoseCommand {
    /// The draws: CSV, Parquet or JSON, several files or one.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Write the result as JSON; - for standard output, which then carries nothing else.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Draw a picture: M draw by draw, the topologies drawn most, and the pairs that share a set.
    #[arg(long, value_name = "PNG|SVG")]
    figure: Option<PathBuf>,
    /// Write a page with all of it, one HTML file that needs no network.
    #[arg(long, value_name = "HTML")]
    page: Option<PathBuf>,
    /// Draws left out at the start of each chain, or auto: as many as MSER finds.
    #[arg(long, value_name = "N", default_value = "auto", value_parser = burn_in)]
    burn_in: BurnInRule,
    /// Topologies in the JSON at most.
    #[arg(long, value_name = "K", default_value = "1000", value_parser = count::<usize>(0, u64::MAX))]
    top: usize,
    /// Distinct topologies held of each chain.
    #[arg(long, value_name = "N", default_value = "100000", value_parser = count::<usize>(1, u64::MAX))]
    max_topologies: usize,
}

fn burn_in(text: &str) -> Result<BurnInRule, String> {
    let expected = "auto or a whole number of draws";
    text.parse().map_err(|_| expected.to_owned())
}

/// Runs it.
pub fn run(command: &DiagnoseCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let to_stdout = command.json.as_deref() == Some(Path::new("-"));
    let json_file = command.json.as_ref().filter(|_| !to_stdout);
    let outputs: Vec<&PathBuf> = json_file
        .into_iter()
        .chain(&command.figure)
        .chain(&command.page)
        .collect();
    for file in &command.files {
        check_outputs(Some(file), &outputs)?;
    }
    let stages = Stages::new(arguments.quiet);
    let stage = |what: &str| stages.say(what);
    let found = job::read_labels(&command.files, command.max_topologies, &stage)?;
    if found.n_left_out > 0 {
        let what = format!(
            "noted: chains are cut to the shortest: {} draws at the ends of others are left out",
            found.n_left_out
        );
        say(arguments, &what);
    }
    let mut result = job::diagnose(found.chains, command.burn_in, &stage)?;
    if let Some(path) = &command.figure {
        stage("the picture");
        let title = title(&command.files);
        let scene = report::labels_figure(&result, title.clone());
        let bytes = match path.extension() {
            Some(ending) if ending == "svg" => scene.svg(&title).into_bytes(),
            _ => scene.png(),
        };
        write_output(path, &bytes)?;
    }
    if let Some(path) = &command.page {
        stage("the page");
        let page = report::labels_page(&result, &title(&command.files));
        write_output(path, page.as_bytes())?;
    }
    drop(stages);
    if !arguments.quiet && !to_stdout {
        out!("{}", report::labels_summary(&result, terminal::width()));
        if let Some(path) = &command.figure {
            outln!("picture     {}", path.display());
        }
        if let Some(path) = &command.page {
            outln!("page        {}", path.display());
        }
    }
    if let Some(path) = &command.json {
        result.topologies.truncate(command.top);
        write_json(path, &result)?;
    }
    Ok(Exit::Done)
}

/// The first file's name, and how many others there are.
fn title(files: &[PathBuf]) -> String {
    let first = files.first().and_then(|file| file.file_name());
    let first = first.unwrap_or_default().to_string_lossy();
    match files.len() {
        0 | 1 => first.into_owned(),
        n => format!("{first} and {} more", n - 1),
    }
}
