//! The page of a sweep that runs: what is known so far, read again every few seconds by itself.
//!
//! It is one file without links to others, since the pages of settings and cells are written when
//! the sweep has ended.

use maud::html;

use super::super::answer::Answer;
use super::super::{Figure, Live, Material, words};
use super::cells_table::cells_table;
use super::index::answered;
use super::{inline_alone, page_with};

/// The page, with the figures of the answer and of all cells.
pub(in crate::report) fn live_page(
    material: Material<'_>,
    live: Live,
    answer: &Answer,
    figures: &[Figure],
) -> String {
    let title = &material.sweep.title;
    let is_over = live.n_done == live.n_chains;
    let (n_done, n_chains) = (
        words::thousands(live.n_done),
        words::thousands(live.n_chains),
    );
    let head = html! {
        @if !is_over { meta http-equiv="refresh" content=(live.seconds); }
    };
    let body = html! {
        header {
            h1 { (title) }
            p.live role="status" {
                @if is_over {
                    "All " (n_chains) " chains have ended. The report is in " a href="index.html" { "index.html" } "."
                } @else {
                    "The sweep is running: " (n_done) " of " (n_chains) " chains have ended ("
                    (words::percent(Some(live.n_done as f64 / live.n_chains.max(1) as f64)))
                    "). What follows is what they say so far, and may change. The page reads itself \
                     again every " (words::counted(live.seconds as usize, "second")) "."
                }
            }
            p.question { (answer.question) }
        }
        main {
            (answered(material, answer, false))
            @for figure in figures {
                @let svg = figure.scene.svg(&figure.caption);
                (inline_alone(figure, &svg))
            }
            (cells_table(material, false))
        }
    };
    page_with(title, &head, &body)
}
