//! The report as HTML pages that need no network and no server. Everything is escaped by `maud`.

mod cell;
mod cells_table;
mod factor;
mod index;
mod labels;
mod live;
mod mission;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::section::{Block, Section, Table};
use super::{Figure, Leading, figures};
use crate::results::{CellVerdict, Verdict};

pub(super) use cell::cell_page;
pub(super) use factor::factor_page;
pub(super) use index::index;
pub use labels::labels_page;
pub(super) use live::live_page;
pub use mission::mission_page;

const STYLE: &str = include_str!("style.css");
const FIGURES_SCRIPT: &str = include_str!("figures.js");

/// A page of parts in the report's folder, with a way back.
pub(super) fn part_page(title: &str, home: &str, parts: &[Section]) -> String {
    let body = html! {
        p { a href="index.html" { "← " (home) } }
        h1 { (title) }
        @for part in parts { (section(part, "")) }
    };
    page(&format!("{title} · {home}"), &body)
}

/// A page of parts that is one file.
pub(super) fn compared_page(title: &str, parts: &[Section]) -> String {
    let alone = |figure: &Figure| inline_alone(figure, &figure.svg());
    let body = html! {
        h1 { (title) }
        @for part in parts { (section_with(part, "", alone)) }
    };
    page(title, &body)
}

fn page(title: &str, body: &Markup) -> String {
    page_with(title, &html! {}, body)
}

/// A page without a script.
fn still_page(title: &str, body: &Markup) -> String {
    page_of(title, &html! {}, body)
}

/// A page with more in its head, and with what its figures say under a pointer.
fn page_with(title: &str, head: &Markup, body: &Markup) -> String {
    let body = html! { (body) script { (PreEscaped(FIGURES_SCRIPT)) } };
    page_of(title, head, &body)
}

fn page_of(title: &str, head: &Markup, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
                (head)
            }
            body { (body) }
        }
    }
    .into_string()
}

/// Bytes of SVG above which a page links to the picture in pixels.
const MOST_SVG: usize = 1_500_000;

/// A picture that lies beside the page. As SVG it is light or dark as the page is.
fn picture(figure: &Figure, to_root: &str) -> Markup {
    let (png, svg) = (figure.png_file(), figure.svg_file());
    let (width, height) = figure.scene.size_px();
    let shown = if figure.svg().len() <= MOST_SVG {
        &svg
    } else {
        &png
    };
    html! {
        figure {
            div.scroll tabindex="0" {
                a href=(format!("{to_root}{svg}")) {
                    img src=(format!("{to_root}{shown}")) width=(width) height=(height) alt=(figure.caption) loading="lazy" style=(least(figure));
                }
            }
            (caption(figure, to_root, false))
        }
    }
}

/// The least width at which the text of a figure can be read: half of what it is drawn for.
fn least(figure: &Figure) -> String {
    let (width, _) = figure.scene.size_px();
    format!("min-width:{}px", width / 2)
}

fn caption(figure: &Figure, to_root: &str, can_zoom: bool) -> Markup {
    html! {
        figcaption {
            (figure.caption) " "
            a href=(format!("{to_root}{}", figure.png_file())) { "PNG" } " · "
            a href=(format!("{to_root}{}", figure.svg_file())) { "SVG" }
            @if can_zoom { " · " button.zoom type="button" hidden { "full size" } }
        }
    }
}

/// A picture of a page that is one file without a script.
fn still(figure: &Figure) -> Markup {
    html! {
        figure {
            div.embedded tabindex="0" style=(sizes(figure)) { (PreEscaped(figure.svg())) }
            figcaption { (figure.caption) }
        }
    }
}

fn inline(figure: &Figure, svg: &str) -> Markup {
    html! {
        figure {
            div.embedded tabindex="0" style=(sizes(figure)) { (PreEscaped(svg)) }
            (caption(figure, "", true))
        }
    }
}

/// The same without links to files beside the page.
fn inline_alone(figure: &Figure, svg: &str) -> Markup {
    html! {
        figure {
            div.embedded tabindex="0" style=(sizes(figure)) { (PreEscaped(svg)) }
            figcaption { (figure.caption) " " button.zoom type="button" hidden { "full size" } }
        }
    }
}

fn sizes(figure: &Figure) -> String {
    let (width, _) = figure.scene.size_px();
    format!("--least:{}px;--full:{width}px", width / 2)
}

/// What a page may still embed, in bytes; pictures beyond lie beside the page.
struct Budget {
    left: usize,
}

impl Budget {
    /// A page of 324 cells stays below a megabyte with its table; tiles with words cost more where
    /// there are more of them.
    fn of_cells(n_cells: usize) -> Self {
        Self {
            left: 500_000 + 700 * n_cells.saturating_sub(324),
        }
    }

    fn picture(&mut self, figure: &Figure) -> Markup {
        let svg = figure.svg();
        match self.left.checked_sub(svg.len()) {
            Some(left) => {
                self.left = left;
                inline(figure, &svg)
            }
            None => picture(figure, ""),
        }
    }
}

/// The figure of an answer; its second layout takes its place on narrow pages.
fn leading(shown: &Leading) -> Markup {
    let figure = &shown.figure;
    html! {
        figure {
            div.embedded.(if shown.narrow.is_some() { "broad" } else { "only" }) tabindex="0" style=(sizes(figure)) { (PreEscaped(figure.svg())) }
            @if let Some(narrow) = &shown.narrow {
                div.embedded.narrow { (PreEscaped(narrow.svg(&figure.caption))) }
            }
            (caption(figure, "", true))
        }
    }
}

fn section(section: &Section, to_root: &str) -> Markup {
    section_with(section, to_root, |figure| picture(figure, to_root))
}

fn section_with(
    section: &Section,
    to_root: &str,
    mut picture: impl FnMut(&Figure) -> Markup,
) -> Markup {
    html! {
        section id=(section.id) {
            h2 { (section.title) }
            @for block in &section.blocks {
                @match block {
                    Block::Text(text) => p { (text) },
                    Block::Figure(figure) => (picture(figure)),
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
    let mark = format!("--mark:{}", css_colour(verdict));
    html! { span.verdict style=(mark) { (words) } }
}

/// The colour of a verdict; ink and tint follow the page as they do in figures.
fn css_colour(verdict: impl Into<CellVerdict>) -> String {
    match verdict.into() {
        CellVerdict::Of(Verdict::Failed) => "var(--ink)".to_owned(),
        CellVerdict::Of(Verdict::Missing) => "var(--tint)".to_owned(),
        verdict => {
            let colour = figures::verdict_colour(verdict);
            format!("rgb({},{},{})", colour.0, colour.1, colour.2)
        }
    }
}
