//! The report of a sweep: `reports/<sweep>/` with figures, a Markdown page and offline HTML pages.
//!
//! No statistics are computed here: what is drawn and written comes ready from [`crate::results`].

mod figures;
mod findings;
mod html;
mod markdown;
mod pages;
mod words;

pub use figures::{map_figure, reliability_figure, sample_figure, simulation_figure};
pub use pages::Pages;

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::files::write_whole;
use crate::results::SweepResults;
use crate::run::{Plan, Task};
use crate::sweep::{Cell, Sweep};

/// Everything a report is made of.
#[derive(Clone, Copy)]
pub struct Material<'a> {
    /// The sweep.
    pub sweep: &'a Sweep,
    /// Its data sets.
    pub plan: &'a Plan,
    /// What it found.
    pub results: &'a SweepResults,
}

/// A report that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot be written ({source}); check the folder's rights and free space")]
pub struct ReportError {
    path: String,
    source: std::io::Error,
}

/// A figure of the report: its file, what it shows, and its bytes.
struct Figure {
    file: String,
    caption: String,
    png: Vec<u8>,
}

/// Writes figures and pages into `folder`; returns the path of `index.html`.
///
/// # Errors
/// A folder that cannot be written.
pub fn write(folder: &Path, material: Material<'_>, pages: &Pages) -> Result<PathBuf, ReportError> {
    let mut chosen = pages.choose(material);
    if matches!(pages, Pages::Also(_)) {
        // Pages that an earlier report made on demand are written again with the others.
        let has_page = |cell: &usize| folder.join(pages::cell_file(material, *cell)).exists();
        chosen.extend((0..material.sweep.cells.len()).filter(has_page));
        chosen.sort_unstable();
        chosen.dedup();
    }
    for sub in ["figures/cells", "cells"] {
        let path = folder.join(sub);
        std::fs::create_dir_all(&path).map_err(|source| ReportError {
            path: path.display().to_string(),
            source,
        })?;
    }
    let summary = figures::summary(material);
    summary
        .par_iter()
        .try_for_each(|figure| put(&folder.join(&figure.file), &figure.png))?;
    chosen.par_iter().try_for_each(|&cell| {
        // A cell without a finished chain has no picture; its page says why.
        let figure = figures::cell(material, cell);
        if let Some(figure) = &figure {
            put(&folder.join(&figure.file), &figure.png)?;
        }
        let chains = figures::chains(material, cell);
        if let Some(figure) = &chains {
            put(&folder.join(&figure.file), &figure.png)?;
        }
        let shown: Vec<&Figure> = figure.iter().chain(&chains).collect();
        let page = html::cell_page(material, cell, &shown);
        put(
            &folder.join(pages::cell_file(material, cell)),
            page.as_bytes(),
        )
    })?;
    let index = html::index(material, &summary, &chosen);
    put(&folder.join("index.html"), index.as_bytes())?;
    let markdown = markdown::report(material, &summary, &chosen);
    put(&folder.join("report.md"), markdown.as_bytes())?;
    Ok(folder.join("index.html"))
}

/// The CSV of a cell's first world, relative to the report's folder; `None` if that world could not
/// be simulated.
fn detections_file(material: Material<'_>, cell: &Cell) -> Option<String> {
    let is_of = |task: &&Task| std::ptr::eq(&material.sweep.cells[task.cell], cell);
    let task = material.plan.tasks.iter().find(is_of)?;
    material.plan.data(task).ok()?;
    Some(data_file(task.data))
}

/// The CSV of a data set, relative to the report's folder.
pub fn data_file(data: usize) -> String {
    format!("detections/d{:03}.csv", data + 1)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    write_whole(path, bytes).map_err(|source| ReportError {
        path: path.display().to_string(),
        source,
    })
}
