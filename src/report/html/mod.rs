//! The report as HTML pages that need no network and no server. Everything is escaped by `maud`.

mod cell;
mod cells_table;
mod factor;
mod index;
mod labels;
mod mission;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::section::{Block, Section, Table};
use super::{Figure, figures};
use crate::results::CellVerdict;

pub(super) use cell::cell_page;
pub(super) use factor::factor_page;
pub(super) use index::index;
pub use labels::labels_page;
pub use mission::mission_page;

const STYLE: &str = include_str!("style.css");

/// A page of parts in the report's folder, with a way back.
pub(super) fn part_page(title: &str, home: &str, parts: &[Section]) -> String {
    let body = html! {
        p { a href="index.html" { "← " (home) } }
        h1 { (title) }
        @for part in parts { (section(part, "")) }
    };
    page(&format!("{title} · {home}"), &body)
}

fn page(title: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    }
    .into_string()
}

/// A picture that lies beside the page.
fn picture(figure: &Figure, to_root: &str) -> Markup {
    let (png, svg) = (figure.png_file(), figure.svg_file());
    let (width, height) = figure.scene.size_px();
    html! {
        figure {
            a href=(format!("{to_root}{png}")) {
                img src=(format!("{to_root}{png}")) width=(width) height=(height) alt=(figure.caption) loading="lazy";
            }
            figcaption {
                (figure.caption) " "
                a href=(format!("{to_root}{png}")) { "PNG" } " · " a href=(format!("{to_root}{svg}")) { "SVG" }
            }
        }
    }
}

/// A picture that is part of the page, so that it is there even when the page is alone.
fn embedded(figure: &Figure) -> Markup {
    html! {
        figure {
            div.embedded tabindex="0" { (PreEscaped(figure.svg())) }
            figcaption { (figure.caption) }
        }
    }
}

fn section(section: &Section, to_root: &str) -> Markup {
    html! {
        section id=(section.id) {
            h2 { (section.title) }
            @for block in &section.blocks {
                @match block {
                    Block::Text(text) => p { (text) },
                    Block::Figure(figure) => (picture(figure, to_root)),
                    Block::Table(content) => (table(content, to_root)),
                }
            }
        }
    }
}

fn table(table: &Table, to_root: &str) -> Markup {
    html! {
        div.wide tabindex="0" { table {
            thead { tr { @for name in &table.head { th { (name) } } } }
            tbody { @for row in &table.rows { tr { @for entry in row { td {
                @match &entry.href {
                    // A place on the index itself is reached from everywhere.
                    Some(href) if href.starts_with('#') && !to_root.is_empty() =>
                        a href=(format!("{to_root}index.html{href}")) { (entry.text) },
                    Some(href) if href.starts_with('#') => a href=(href) { (entry.text) },
                    Some(href) => a href=(format!("{to_root}{href}")) { (entry.text) },
                    None if entry.is_strong => b { (entry.text) },
                    None => (entry.text),
                }
            } } } } }
        } }
    }
}

/// A verdict with the colour that it has in the figures.
fn badge(verdict: impl Into<CellVerdict>, words: &str) -> Markup {
    let colour = figures::verdict_colour(verdict);
    let mark = format!("--mark:rgb({},{},{})", colour.0, colour.1, colour.2);
    html! { span.verdict style=(mark) { (words) } }
}
