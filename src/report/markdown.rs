//! The report as Markdown, for a repository.

use std::fmt::Write;

use super::pages::{cell_file, choice_words};
use super::{Figure, Material, findings, words};

/// Rows of the table of cells; the rest are in `cells.csv`.
const N_ROWS: usize = 40;

pub(super) fn report(material: Material<'_>, figures: &[Figure], chosen: &[usize]) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let mut text = String::new();
    let mut line = |content: &str| {
        text.push_str(content);
        text.push('\n');
    };
    line(&format!("# {}\n", escape(&sweep.title)));
    if !sweep.description.is_empty() {
        line(&format!("{}\n", escape(&sweep.description)));
    }
    for sentence in findings::sentences(material) {
        line(&format!("- {}", escape(&sentence)));
    }
    line("");
    let comparisons = findings::comparisons(material);
    if !comparisons.is_empty() {
        line("## Which findings are the method's\n");
        line(
            "| setting | remark | as it should be | as the faulty program computes it | finding |",
        );
        line("|---|---|---|---|---|");
        for c in &comparisons {
            let cells =
                [&c.label, &c.note, &c.correct, &c.faulty, &c.verdict].map(|cell| escape(cell));
            line(&format!("| {} |", cells.join(" | ")));
        }
        line("");
    }
    line("## Figures\n");
    for figure in figures {
        line(&format!(
            "![{}]({})\n",
            escape(&figure.caption),
            figure.file
        ));
        line(&format!("*{}*\n", escape(&figure.caption)));
    }
    line("## Cells\n");
    line(&format!(
        "{}{}\n",
        choice_words(sweep.cells.len()),
        words::interval_kinds(&results.cells)
    ));
    let factors: Vec<&str> = sweep.factors.iter().map(|factor| factor.key.name).collect();
    line(&format!(
        "| cell | {} | verdict | recovery | worlds converged | chains without outcome | truth mass | ARI | M | acceptance | distance to exact | never settled |",
        factors.join(" | ")
    ));
    line(&format!("|---|{}", "---|".repeat(factors.len() + 10)));
    for &cell_ix in results.ranking().iter().take(N_ROWS) {
        let (cell, result) = (&sweep.cells[cell_ix], &results.cells[cell_ix]);
        let mut row = String::from("|");
        let title = escape(&cell.title());
        let name = if chosen.contains(&cell_ix) {
            format!("[{title}]({})", cell_file(material, cell_ix))
        } else {
            title
        };
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
            " {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            words::verdict(result),
            words::rate(result.recovery),
            words::gate(result),
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
    line("\n## Files\n");
    line(
        "`chains`, `cells`, `topologies` and `convergence` (`.parquet` and `.csv`): one row per chain, cell, topology and world of a cell; `detections/`: the data of every world; `sweep.toml`: the sweep as it was run.",
    );
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
