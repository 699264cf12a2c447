//! The page that everything is reached from: question, answer, the picture that shows it, then the rest.

use maud::{Markup, html};

use super::super::answer::Answer;
use super::super::pages::cell_file;
use super::super::section::Section;
use super::super::{Material, advice, notes};
use super::cells_table::cells_table;
use super::{Budget, badge, leading, page, section_with};
use crate::results::CellVerdict;

/// `index.html`; readable even where it is all there is.
pub(in crate::report) fn index(
    material: Material<'_>,
    answer: &Answer,
    sections: &[Section],
) -> String {
    let sweep = material.sweep;
    let notes = notes::notes(material);
    let mut budget = Budget::of_cells(sweep.cells.len());
    let body = html! {
        header {
            h1 { (sweep.title) }
            p.question { (answer.question) }
        }
        main {
            (answered(material, answer, true))
            (leading(&answer.leading))
            nav aria-label="Parts of the report" {
                @for part in sections { a href=(format!("#{}", part.id)) { (part.title) } " " }
                a href="#cells" { "Cells" } " "
                a href="#what-now" { "What now?" } " "
                a href="#about" { "About this sweep" } " "
                a href="#files" { "Files" }
            }
            @if !notes.is_empty() {
                section id="notes" {
                    h2 { "What else to know" }
                    ul { @for note in &notes { li { (note) } } }
                }
            }
            @for part in sections { (section_with(part, "", |figure| budget.picture(figure))) }
            (cells_table(material, true))
            (what_now())
            section id="about" {
                h2 { "About this sweep" }
                @if !sweep.description.is_empty() { p { (sweep.description) } }
                p.soft {
                    "This page can be mailed by itself. The pages of settings and cells are files beside it: where they are \
                     missing, ask for the whole folder. Nothing is fetched from a network. "
                    a href="timing.html" { "What it cost" }
                    ": the wall-clock times, which differ from run to run as nothing else here does."
                }
            }
            (files(material, sections))
        }
    };
    page(&sweep.title, &body)
}

/// The sentences of an answer.
pub(super) fn answered(material: Material<'_>, answer: &Answer, has_pages: bool) -> Markup {
    html! {
        ul.answer { @for finding in &answer.findings { li {
            strong { (finding.lead) ": " }
            @match finding.cell.filter(|_| has_pages) {
                Some(cell) => (linked_cell(material, cell, &finding.text)),
                None => (&finding.text),
            }
        } } }
    }
}

/// A sentence whose cell, where it is named, leads to its page.
fn linked_cell(material: Material<'_>, cell: usize, text: &str) -> Markup {
    let title = material.sweep.cells[cell].title();
    match text.split_once(&title) {
        Some((before, after)) => html! {
            (before) a href=(cell_file(material, cell)) { (title) } (after)
        },
        None => html! { (text) },
    }
}

fn what_now() -> Markup {
    html! {
        section id="what-now" {
            h2 { "My chain did not converge: what now?" }
            p { "By the verdict of the cell; each cell’s page names the doubts of each world." }
            div.wide tabindex="0" { table {
                thead { tr { th { "verdict" } th { "it means" } th { "try" } } }
                tbody { @for verdict in CellVerdict::ALL { tr {
                    td { (badge(verdict, verdict.words())) }
                    td { (advice::meaning(verdict)) }
                    td { (advice::what_now(verdict)) }
                } } }
            } }
            details {
                summary { "By doubt" }
                div.wide tabindex="0" { table {
                    thead { tr { th { "doubt" } th { "it says" } th { "try" } } }
                    tbody { @for (kind, says, advice) in advice::DOUBTS { tr {
                        td { code { (kind) } } td { (says) } td { (advice) }
                    } } }
                } }
                p.soft { "At greater length: docs/convergence.md of topometric." }
            }
        }
    }
}

fn files(material: Material<'_>, sections: &[Section]) -> Markup {
    let mut tables = vec!["chains", "cells", "topologies", "convergence"];
    if !material.results.posteriors.is_empty() {
        tables.push("posteriors");
    }
    html! {
        section id="files" {
            h2 { "Files" }
            p {
                @for name in &tables {
                    (name) " (" a href=(format!("{name}.parquet")) { "Parquet" } ", "
                    a href=(format!("{name}.csv")) { "CSV" } ") · "
                }
                a href="report.md" { "report.md" } " · " a href="sweep.toml" { "sweep.toml" }
            }
            p.soft {
                "docs/tables.md of topometric describes every column. Figures, each as PNG and SVG: "
                @for figure in sections.iter().flat_map(Section::figures) {
                    a href=(figure.svg_file()) { (figure.file.trim_start_matches("figures/")) } " "
                }
            }
        }
    }
}
