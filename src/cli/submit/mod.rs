//! `ptm submit`: a sweep as an array of shards on somebody else's scheduler.

mod kubernetes;
mod slurm;

use std::path::PathBuf;

use crate::report;
use crate::run::{Claimant, Journal, Plan, RunFile, RunFolder, Shard, gaps};
use crate::sweep::Sweep;
use clap::{ArgGroup, Args};

use super::sweep::folder_of;
use super::{Arguments, Exit, Failure, say};

/// Arguments of `ptm submit`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("scheduler").required(true).args(["slurm", "kubernetes"]))]
pub struct SubmitCommand {
    /// The sweep file.
    file: PathBuf,
    /// Submit to Slurm: an array of shards, and a job that merges them when all have ended.
    #[arg(long)]
    slurm: bool,
    /// Print the manifest of a Kubernetes Indexed Job, for kubectl apply -f -.
    #[arg(long, requires = "image", requires = "claim")]
    kubernetes: bool,
    /// Number of shards.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    shards: u64,
    /// Detections CSV to run the sweep on, instead of what the file names.
    #[arg(long, value_name = "CSV")]
    data: Option<PathBuf>,
    /// Folder of the report, on a file system that all nodes see [default: reports/ and the name of
    /// the sweep file].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Cores of each shard.
    #[arg(long, value_name = "C", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    cores: u32,
    /// An option for sbatch, as in --sbatch=--partition=long; may be repeated.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Write the scripts and say what would be submitted, but submit nothing.
    #[arg(long)]
    dry_run: bool,
    /// Container image with ptm in it.
    #[arg(long, value_name = "IMAGE")]
    image: Option<String>,
    /// Persistent volume claim that all pods mount at /work, where the sweep file lies.
    #[arg(long, value_name = "CLAIM")]
    claim: Option<String>,
}

/// Runs it.
pub fn run(command: &SubmitCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let given = [
        Some(&command.file),
        command.data.as_ref(),
        command.out.as_ref(),
    ];
    if let Some(path) = given
        .into_iter()
        .flatten()
        .find(|path| path.to_str().is_none())
    {
        return Err(Failure::usage(format!(
            "{}: got a path that is not UTF-8, expected one that a script or a manifest can \
             hold; rename it",
            path.display()
        )));
    }
    if let (Some(image), Some(claim)) = (&command.image, &command.claim)
        && command.kubernetes
    {
        let manifest = kubernetes::manifest(command, image, claim);
        let text = serde_json::to_string_pretty(&manifest).expect("texts and numbers make JSON");
        outln!("{text}");
        return Ok(Exit::Done);
    }
    let sweep = Sweep::read(&command.file, command.data.as_deref())?;
    let mut plan = Plan::new(&sweep)?;
    let out = folder_of(command.out.as_deref(), &sweep);
    let run_file = RunFile::new(&sweep, &plan);
    let (folder, _) = RunFolder::claim(&out, &run_file, false, Claimant::Shard)?;
    folder.write_inputs(&sweep, &plan, report::data_file)?;
    let journal = Journal::read_only(folder.path())?;
    for note in journal.notes() {
        say(arguments, note);
    }
    plan.replay(&sweep, &journal)?;
    let gaps: Vec<Shard> = gaps(&plan, &journal, command.shards).into_keys().collect();
    if gaps.is_empty() {
        outln!("every chain has a record: ptm merge {}", out.display());
        return Ok(Exit::Done);
    }
    slurm::submit(command, &folder, &run_file, &gaps)?;
    Ok(Exit::Done)
}
