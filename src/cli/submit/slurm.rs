//! Slurm: an array of shards, and a job that merges them when all have ended.
//!
//! Numbers in an array must stay below `MaxArraySize`, so more shards than that are several arrays, each
//! with an offset. Only shards that miss a chain are submitted. A shard that loses its node is requeued by
//! Slurm and goes on where its records end; one that is about to reach its time limit gets SIGTERM and
//! ends with everything kept, for the next `ptm submit` to continue.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{RunFile, RunFolder, Shard};

use super::SubmitCommand;
use crate::cli::Failure;

/// Seconds before a time limit at which a shard is told to end.
const NOTICE_S: u32 = 60;

/// Writes the scripts, and submits them unless it is to be dry.
pub fn submit(
    command: &SubmitCommand,
    folder: &RunFolder,
    run: &RunFile,
    gaps: &[Shard],
) -> Result<(), Failure> {
    let scripts = absolute(folder.path())?.join("slurm");
    std::fs::create_dir_all(&scripts).map_err(|error| unwritable(&scripts, &error))?;
    let (shard, merge) = (scripts.join("shard.sh"), scripts.join("merge.sh"));
    write(&shard, &shard_script(command, folder, run)?)?;
    write(&merge, &merge_script(folder)?)?;
    let most = max_array_size(command.dry_run)?;
    let mut jobs = Vec::new();
    for (offset, list) in arrays(gaps, most) {
        let mut options = vec![
            format!("--job-name=ptm-{}", run.sweep),
            format!("--array={list}"),
            format!("--output={}", log(&scripts, "%A_%a.log")),
            "--open-mode=append".to_owned(),
            "--requeue".to_owned(),
            format!("--signal=B:TERM@{NOTICE_S}"),
            format!("--cpus-per-task={}", command.cores),
        ];
        options.extend(command.sbatch.iter().cloned());
        jobs.push(sbatch(command, options, &shard, Some(offset), &jobs)?);
        outln!(
            "array {list} from shard {} on: job {}",
            offset + 1,
            jobs[jobs.len() - 1]
        );
    }
    let mut options = vec![
        format!("--job-name=ptm-{}-merge", run.sweep),
        format!("--dependency=afterany:{}", jobs.join(":")),
        format!("--output={}", log(&scripts, "%j-merge.log")),
        "--open-mode=append".to_owned(),
    ];
    options.extend(command.sbatch.iter().cloned());
    let job = sbatch(command, options, &merge, None, &jobs)?;
    outln!("merge when all have ended: job {job}");
    Ok(())
}

/// Arrays of numbers from 0, with the offset of each: the shard of number k is k + offset + 1.
fn arrays(gaps: &[Shard], max_array_size: u64) -> Vec<(u64, String)> {
    let mut arrays: Vec<(u64, Vec<u64>)> = Vec::new();
    for shard in gaps {
        let offset = shard.index() / max_array_size * max_array_size;
        let number = shard.index() - offset;
        match arrays.last_mut() {
            Some((last, numbers)) if *last == offset => numbers.push(number),
            _ => arrays.push((offset, vec![number])),
        }
    }
    let listed = arrays.into_iter();
    listed
        .map(|(offset, numbers)| (offset, ranges(&numbers)))
        .collect()
}

/// Rising numbers, as in 0-3,7.
fn ranges(numbers: &[u64]) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for &number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let text = |(first, last): (u64, u64)| {
        if first == last {
            first.to_string()
        } else {
            format!("{first}-{last}")
        }
    };
    ranges.into_iter().map(text).collect::<Vec<_>>().join(",")
}

/// The script of every shard. It runs what lies in the folder, so that an edit of the sweep file in the
/// meantime changes nothing.
fn shard_script(
    command: &SubmitCommand,
    folder: &RunFolder,
    run: &RunFile,
) -> Result<String, Failure> {
    let path = absolute(folder.path())?;
    let mut words = vec![
        quoted(&program()?),
        "sweep".to_owned(),
        quoted(&path.join("sweep.toml")),
    ];
    if run.data.is_some() {
        let data = path.join(crate::report::data_file(0));
        words.extend(["--data".to_owned(), quoted(&data)]);
    }
    words.extend(["--out".to_owned(), quoted(&path)]);
    let n = command.shards;
    let cores = command.cores;
    Ok(format!(
        "#!/bin/sh\n# One shard of the array; $1 is the offset of the array. Written by ptm submit.\n\
         exec {} \\\n    --shard \"$((SLURM_ARRAY_TASK_ID + $1 + 1))/{n}\" --threads {cores} --quiet\n",
        words.join(" ")
    ))
}

fn merge_script(folder: &RunFolder) -> Result<String, Failure> {
    Ok(format!(
        "#!/bin/sh\n# Puts the shards together. Written by ptm submit.\nexec {} merge {}\n",
        quoted(&program()?),
        quoted(&absolute(folder.path())?)
    ))
}

/// `MaxArraySize`, one more than the largest number in an array.
fn max_array_size(dry_run: bool) -> Result<u64, Failure> {
    let output = Command::new("scontrol").args(["show", "config"]).output();
    let found = |output: &std::process::Output| {
        let text = String::from_utf8_lossy(&output.stdout);
        parse_max_array_size(&text).filter(|_| output.status.success())
    };
    let output = match output {
        // What Slurm has by default, where there is none to ask.
        output if dry_run => return Ok(output.ok().as_ref().and_then(found).unwrap_or(1001)),
        Ok(output) => output,
        Err(error) => return Err(not_there("scontrol", &error)),
    };
    found(&output).ok_or_else(|| {
        Failure::try_again(format!(
            "scontrol show config: got no MaxArraySize ({}); check that Slurm is up",
            one_line(&output.stderr)
        ))
    })
}

fn parse_max_array_size(text: &str) -> Option<u64> {
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MaxArraySize"))?;
    let size = line.trim_start().strip_prefix('=')?.trim().parse().ok()?;
    (size > 0).then_some(size)
}

/// Submits a script and gives the number of the job; what was submitted before is named if it fails.
fn sbatch(
    command: &SubmitCommand,
    options: Vec<String>,
    script: &Path,
    offset: Option<u64>,
    before: &[String],
) -> Result<String, Failure> {
    let mut arguments = vec!["--parsable".to_owned()];
    arguments.extend(options);
    arguments.push(script.display().to_string());
    arguments.extend(offset.map(|offset| offset.to_string()));
    if command.dry_run {
        let mut line = "sbatch".to_owned();
        for argument in &arguments {
            let _ = write!(line, " {}", quoted(Path::new(argument)));
        }
        outln!("{line}");
        return Ok("JOB".to_owned());
    }
    let output = Command::new("sbatch").args(&arguments).output();
    let output = output.map_err(|error| not_there("sbatch", &error))?;
    let text = String::from_utf8_lossy(&output.stdout);
    // --parsable gives the number, and on a federation a semicolon and the cluster.
    let job = text.trim().split(';').next().unwrap_or_default().to_owned();
    if output.status.success() && !job.is_empty() && job.bytes().all(|b| b.is_ascii_digit()) {
        return Ok(job);
    }
    let before = if before.is_empty() {
        "nothing was submitted".to_owned()
    } else {
        format!("submitted before it: {}", before.join(", "))
    };
    Err(Failure::usage(format!(
        "sbatch {}: failed ({}); {before}",
        arguments.join(" "),
        one_line(&output.stderr)
    )))
}

fn not_there(program: &str, error: &std::io::Error) -> Failure {
    Failure::usage(format!(
        "{program}: cannot be run ({error}); submit on a machine of the cluster, or look with --dry-run"
    ))
}

fn one_line(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.is_empty() {
        "it said nothing".to_owned()
    } else {
        words.join(" ")
    }
}

/// Slurm replaces what follows a per cent sign in the names of logs.
fn log(folder: &Path, name: &str) -> String {
    format!("{}/{name}", folder.display().to_string().replace('%', "%%"))
}

fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

fn program() -> Result<PathBuf, Failure> {
    std::env::current_exe().map_err(|error| {
        Failure::usage(format!(
            "ptm: does not find itself ({error}); call it by its path"
        ))
    })
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|error| unwritable(path, &error))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    crate::files::write_whole(path, text.as_bytes()).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    crate::cli::unwritable(path, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_stay_below_the_largest_number() {
        let shards = |indices: &[u64]| -> Vec<Shard> {
            indices
                .iter()
                .filter_map(|&k| Shard::new(k, 5000))
                .collect()
        };
        assert_eq!(
            arrays(&shards(&[0, 1, 2, 7]), 1001),
            [(0, "0-2,7".to_owned())]
        );
        let all: Vec<u64> = (0..2500).collect();
        let lists = arrays(&shards(&all), 1001);
        assert_eq!(
            lists,
            [
                (0, "0-1000".to_owned()),
                (1001, "0-1000".to_owned()),
                (2002, "0-497".to_owned())
            ]
        );
        assert_eq!(
            arrays(&shards(&[1000, 1001, 4999]), 1001),
            [
                (0, "1000".to_owned()),
                (1001, "0".to_owned()),
                (4004, "995".to_owned())
            ]
        );
    }

    #[test]
    fn the_size_is_read_from_what_slurm_shows() {
        let text = "MailProg                = /usr/bin/mail\nMaxArraySize            = 1001\nMaxBatchRequeue         = 5\n";
        assert_eq!(parse_max_array_size(text), Some(1001));
        assert_eq!(parse_max_array_size("MaxArraySize = 0\n"), None);
        assert_eq!(parse_max_array_size(""), None);
    }

    #[test]
    fn paths_survive_the_shell() {
        let text = quoted(Path::new("/a b/it's $HOME"));
        let output = Command::new("sh")
            .args(["-c", &format!("printf %s {text}")])
            .output()
            .expect("a shell");
        assert_eq!(String::from_utf8_lossy(&output.stdout), "/a b/it's $HOME");
        assert_eq!(quoted(Path::new("/plain/path-1.sh")), "/plain/path-1.sh");
    }
}
