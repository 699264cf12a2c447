//! `ptm compare`: two or more sweeps on the same worlds, each against the first.

use std::path::{Path, PathBuf};

use crate::report::{Compared, compare_page};
use crate::results::compare::{CellComparison, Comparison, Difference, Measure, compare};
use crate::table;
use clap::Args;

use super::numbers::{count, number};
use super::{Arguments, Exit, Failure, check_outputs, write_json, write_output};

/// Arguments of `ptm compare`.
#[derive(Debug, Args)]
pub struct CompareCommand {
    /// Folders of the sweeps, as in reports/before reports/after. Each is compared with the first
    /// (A) on the cells that both have; differences are B less A.
    #[arg(value_name = "DIR", required = true, num_args = 2..)]
    folders: Vec<PathBuf>,
    /// Write a page with the map of differences and the paired effects.
    #[arg(long, value_name = "HTML")]
    page: Option<PathBuf>,
    /// Write the comparison as JSON; - for standard output, which then carries nothing else. Of more
    /// than two sweeps a list.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Probability of finding a difference if there is none, at most.
    #[arg(long, value_name = "P", value_parser = number, default_value_t = 0.05)]
    level: f64,
    /// Cells listed at most.
    #[arg(long, value_name = "N", value_parser = count::<usize>(0, u64::MAX), default_value_t = 20)]
    top: usize,
}

/// Runs it.
pub fn run(command: &CompareCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    if !(command.level > 0.0 && command.level < 1.0) {
        return Err(Failure::usage(format!(
            "--level: got {}, expected a number between 0 and 1",
            command.level
        )));
    }
    let to_stdout = command.json.as_deref() == Some(Path::new("-"));
    if let Some(path) = command.json.as_ref().filter(|_| !to_stdout) {
        check_outputs(None, &[path])?;
    }
    if let Some(page) = &command.page {
        check_outputs(None, &[page])?;
    }
    let (first, others) = command
        .folders
        .split_first()
        .expect("the command line asks for two");
    let a = table::read_tables(first)?;
    let mut all = Vec::new();
    for other in others {
        let b = table::read_tables(other)?;
        let found = compare(&a, &b, command.level).map_err(|reason| {
            let (a, b) = (first.display(), other.display());
            Failure::usage(format!("{a} (A) and {b} (B) cannot be compared: {reason}"))
        })?;
        all.push((other, found));
    }
    match (&command.json, all.as_slice()) {
        (Some(path), [(_, found)]) => write_json(path, found)?,
        (Some(path), all) => {
            let all: Vec<&Comparison> = all.iter().map(|(_, found)| found).collect();
            write_json(path, &all)?;
        }
        (None, _) => {}
    }
    if let Some(page) = &command.page {
        let compared = all.iter().map(|(other, found)| Compared {
            a: first.display().to_string(),
            b: other.display().to_string(),
            found,
        });
        let text = compare_page(&compared.collect::<Vec<_>>());
        write_output(page, text.as_bytes())?;
    }
    if !to_stdout && !arguments.quiet {
        let texts = all
            .iter()
            .map(|(other, found)| summary(found, first, other, command.top));
        out!("{}", texts.collect::<Vec<_>>().join("\n"));
        if let Some(page) = &command.page {
            outln!("page        {}", page.display());
        }
    }
    Ok(if all.iter().any(|(_, found)| found.differs) {
        Exit::Differs
    } else {
        Exit::Done
    })
}

fn summary(found: &Comparison, a: &Path, b: &Path, top: usize) -> String {
    let mut lines = vec![
        format!("A           {}", a.display()),
        format!("B           {}", b.display()),
    ];
    for (name, [a, b]) in &found.settings_that_differ {
        lines.push(format!("setting     {name}: A {a}, B {b}"));
    }
    lines.push(format!(
        "cells       {} on {} worlds, {} of them the same in every chain",
        found.cells.len(),
        found.n_worlds,
        found.n_identical
    ));
    let [alone_a, alone_b] = found.n_alone;
    if alone_a + alone_b > 0 {
        lines.push(format!(
            "left out    {alone_a} cells only in A, {alone_b} only in B"
        ));
    }
    let [done_a, done_b] = found.n_chains;
    let [failed_a, failed_b] = found.n_failed;
    lines.push(format!(
        "chains      A {done_a} done, {failed_a} failed; B {done_b} done, {failed_b} failed"
    ));
    lines.push(format!(
        "mean over all cells, 95 % over {}; p by Student's law, adjusted by Holm",
        found.units
    ));
    lines.extend(found.overall.iter().map(|row| format!("  {}", words(row))));
    let mut single: Vec<(&CellComparison, &Difference)> = (found.cells.iter())
        .flat_map(|cell| cell.differences.iter().map(move |row| (cell, row)))
        .filter(|(_, row)| row.found)
        .collect();
    single.sort_by(|a, b| {
        let p = |row: &Difference| row.p_adjusted.unwrap_or(1.0);
        p(a.1).total_cmp(&p(b.1))
    });
    lines.push(format!(
        "single cells that differ: {} (recovery by an exact test over chains, p by Benjamini-Hochberg)",
        single.len()
    ));
    for (cell, row) in single.iter().take(top) {
        let own: Vec<String> = (cell.settings.iter())
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        lines.push(format!("  {}  {}", cell.a, words(row)));
        lines.push(format!(
            "        {}; converged A {}, B {} of {}",
            own.join(", "),
            cell.n_converged[0],
            cell.n_converged[1],
            cell.n_worlds
        ));
    }
    if single.len() > top {
        lines.push(format!(
            "  … and {} more; --json has them all",
            single.len() - top
        ));
    }
    lines.push(format!(
        "verdict     {} at level {}",
        if found.differs {
            "DIFFERENT"
        } else {
            "no difference found"
        },
        found.level
    ));
    lines.join("\n") + "\n"
}

/// "0.213", "1.3e-5": digits that matter.
fn p_words(p: f64) -> String {
    if p < 0.001 {
        format!("{p:.1e}")
    } else {
        format!("{p:.3}")
    }
}

/// "recovery    41 % → 43 %, +2.0 % [−0.4, 4.5], p 0.21".
fn words(row: &Difference) -> String {
    let is_share = matches!(row.measure, Measure::Recovery | Measure::Acceptance);
    let (scale, unit) = if is_share { (100.0, " %") } else { (1.0, "") };
    let digits = if is_share { 1 } else { 2 };
    let number = |x: f64| format!("{:.digits$}{unit}", scale * x);
    let interval = match row.interval {
        Some((low, high)) => format!("[{:+.digits$}, {:+.digits$}]", scale * low, scale * high),
        None if row.n_units == 1 => "[one unit]".to_owned(),
        None => "[all agree]".to_owned(),
    };
    let p = row.p_adjusted.map_or_else(|| "–".to_owned(), p_words);
    format!(
        "{:<10} {:>8} → {:>8}  {:+.digits$}{unit} {interval}  p {p}{}",
        row.measure.words(),
        number(row.a),
        number(row.b),
        scale * row.difference,
        if row.found { "  *" } else { "" }
    )
}
