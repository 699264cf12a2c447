//! The report as Markdown, for a repository.

use std::fmt::Write;

use super::answer::Answer;
use super::pages::{cell_file, choice_words};
use super::section::{Block, Entry, Section, Table};
use super::{Figure, Material, advice, faults, notes, words};
use crate::results::CellVerdict;

/// Rows of the table of cells; the rest are in `cells.csv`.
const N_ROWS: usize = 40;

pub(super) fn report(material: Material<'_>, answer: &Answer, sections: &[Section]) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let mut text = String::new();
    let mut line = |content: &str| {
        text.push_str(content);
        text.push('\n');
    };
    line(&format!("# {}\n", escape(&sweep.title)));
    line(&format!("*{}*\n", escape(&answer.question)));
    for finding in &answer.findings {
        line(&format!(
            "- **{}**: {}",
            finding.lead,
            escape(&finding.text)
        ));
    }
    line("");
    line(&picture(&answer.leading.figure));
    let notes = notes::notes(material);
    if !notes.is_empty() {
        line("## What else to know\n");
        for note in notes {
            line(&format!("- {}", escape(&note)));
        }
        line("");
    }
    for section in sections {
        line(&format!("## {}\n", escape(&section.title)));
        for block in &section.blocks {
            match block {
                Block::Text(words) => line(&format!("{}\n", escape(words))),
                Block::Figure(figure) => line(&picture(figure)),
                Block::Table(content) => line(&table(content)),
            }
        }
    }
    line("## Cells\n");
    line(&format!(
        "{}{}\n",
        choice_words(sweep.cells.len()),
        words::interval_kinds(&results.cells)
    ));
    let factors: Vec<&str> = sweep.factors.iter().map(|factor| factor.key.name).collect();
    line(&format!(
        "| cell | {} | verdict | recovery | worlds converged | {} | chains without outcome | truth mass | ARI | M | acceptance | distance to exact | never settled |",
        factors.join(" | "),
        faults::SPLIT
    ));
    line(&format!("|---|{}", "---|".repeat(factors.len() + 11)));
    for &cell_ix in results.ranking().iter().take(N_ROWS) {
        let (cell, result) = (&sweep.cells[cell_ix], &results.cells[cell_ix]);
        let mut row = String::from("|");
        let name = format!(
            "[{}]({})",
            escape(&cell.title()),
            cell_file(material, cell_ix)
        );
        let _ = write!(row, " {name} |");
        for factor in &sweep.factors {
            let _ = write!(
                row,
                " {} |",
                escape(&cell.settings.get(factor.key.name).to_string())
            );
        }
        let _ = write!(
            row,
            " {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            result.verdict_words(),
            words::rate(result.recovery),
            words::gate(result),
            faults::split(result.faults),
            words::missingness(result.n_failed, result.n_missing),
            words::percent(result.truth_mass),
            words::number(result.adjusted_rand_index, 2),
            words::number(result.n_sets, 1),
            words::percent(result.acceptance_rate),
            words::distance(result.exact.largest, result.exact.high),
            result.n_never_settled
        );
        line(&row);
    }
    if sweep.cells.len() > N_ROWS {
        line(&format!(
            "\nThe {N_ROWS} most successful of {} cells; all are in `cells.csv`.",
            sweep.cells.len()
        ));
    }
    line("\n## My chain did not converge: what now?\n");
    line("| verdict | it means | try |\n|---|---|---|");
    for verdict in CellVerdict::ALL {
        let (meaning, now) = (advice::meaning(verdict), advice::what_now(verdict));
        line(&format!(
            "| {} | {meaning} | {} |",
            verdict.words(),
            escape(now)
        ));
    }
    if !sweep.description.is_empty() {
        line(&format!(
            "\n## About this sweep\n\n{}",
            escape(&sweep.description)
        ));
    }
    line("\n## Files\n");
    line(
        "`chains`, `cells`, `topologies` and `convergence` (`.parquet` and `.csv`): one row per chain, cell, topology and world of a cell; `posteriors`, if failures were sorted: one row per posterior; `detections/`: the data of every world; `sweep.toml`: the sweep as it was run.",
    );
    text
}

fn picture(figure: &Figure) -> String {
    let caption = escape(&figure.caption);
    format!("![{caption}]({})\n\n*{caption}*\n", figure.png_file())
}

fn table(table: &Table) -> String {
    let head: Vec<String> = table.head.iter().map(|name| escape(name)).collect();
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in &table.rows {
        let entry = |entry: &Entry| {
            let words = escape(&entry.text);
            match &entry.href {
                // A place on the HTML page is no place in this file.
                Some(href) if !href.starts_with('#') => format!("[{words}]({href})"),
                _ if entry.is_strong => format!("**{words}**"),
                _ => words,
            }
        };
        let entries: Vec<String> = row.iter().map(entry).collect();
        let _ = writeln!(text, "| {} |", entries.join(" | "));
    }
    text
}

/// What came from a file must not become markup.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '\r' => escaped.push(' '),
            '<' => escaped.push_str("&lt;"),
            '|' | '*' | '_' | '`' | '[' | ']' | '\\' | '#' => {
                escaped.push('\\');
                escaped.push(c);
            }
            _ => escaped.push(c),
        }
    }
    escaped
}
