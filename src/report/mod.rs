//! The report of a sweep: `reports/<sweep>/` with figures, a Markdown page and offline HTML pages.
//!
//! The answer opens the page; then come the parts of `sections.rs`, each the same in HTML and Markdown. A page for
//! each factor and each cell lies beside it.
//!
//! No statistics are computed here: what is drawn and written comes ready from [`crate::results`].

mod advice;
mod answer;
mod compare;
mod comparisons;
mod factors;
mod faults;
mod figures;
mod html;
mod knob;
mod markdown;
mod notes;
mod pages;
mod rerun;
mod section;
mod sections;
mod sensitivity;
mod summary;
mod timing;
mod words;

pub use compare::{Compared, compare_page};
pub use figures::{
    labels_figure, map_figure, mission_figure, reliability_figure, sample_figure, simulation_figure,
};
pub use html::{labels_page, mission_page};
pub use pages::Pages;
pub use summary::{fit_words, labels_summary, noise_words, sample_summary};
pub use timing::write_timing;

use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::figure::scene::Scene;
use crate::files::{read_text_at_most, write_whole};
use crate::results::{FactorEffect, SweepResults};
use crate::run::Plan;
use crate::sweep::Sweep;
use section::Section;

/// Bytes of an earlier report's Markdown that are looked through for its figures.
const MOST_BEFORE: u64 = 1 << 28;

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

/// How far a sweep that runs has come.
#[derive(Clone, Copy, Debug)]
pub struct Live {
    /// Chains that have ended.
    pub n_done: usize,
    /// Chains that are planned.
    pub n_chains: usize,
    /// Seconds after which the page reads itself again.
    pub seconds: u64,
}

/// The page of a sweep that runs, `live.html`, as text.
pub fn live(material: Material<'_>, live: Live) -> String {
    let mut answer = answer::answer(material);
    let status = figures::run_status(material);
    let mut shown = vec![status];
    if answer.leading.figure.file != shown[0].file {
        let own = Scene::new(1, 1);
        let figure = &mut answer.leading.figure;
        shown.insert(
            0,
            Figure {
                file: figure.file.clone(),
                caption: figure.caption.clone(),
                scene: std::mem::replace(&mut figure.scene, own),
            },
        );
    }
    for figure in &mut shown {
        figure.scene.unlink();
    }
    html::live_page(material, live, &answer, &shown)
}

/// A report that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot be written ({source}); check the folder's rights and free space")]
pub struct ReportError {
    path: String,
    /// Why.
    pub source: std::io::Error,
}

/// A figure of the report: its file, what it shows, and its marks.
struct Figure {
    /// Its path relative to the report's folder, without its ending.
    file: String,
    caption: String,
    scene: Scene,
}

/// The figure of an answer.
struct Leading {
    figure: Figure,
    /// The same for pages as narrow as a phone; `None` if the figure has but one layout.
    narrow: Option<Scene>,
}

impl From<Figure> for Leading {
    fn from(figure: Figure) -> Self {
        Self {
            figure,
            narrow: None,
        }
    }
}

impl Figure {
    fn png_file(&self) -> String {
        format!("{}.png", self.file)
    }

    fn svg_file(&self) -> String {
        format!("{}.svg", self.file)
    }

    fn svg(&self) -> String {
        self.scene.svg(&self.caption)
    }

    /// Writes it as PNG and SVG.
    fn write(&self, folder: &Path) -> Result<(), ReportError> {
        put(&folder.join(self.png_file()), &self.scene.png())?;
        put(&folder.join(self.svg_file()), self.svg().as_bytes())
    }
}

/// Writes figures and pages into `folder`; returns the path of `index.html`.
///
/// # Errors
/// A folder that cannot be written.
pub fn write(folder: &Path, material: Material<'_>, pages: &Pages) -> Result<PathBuf, ReportError> {
    for sub in ["figures/cells", "figures/factors", "cells", "factors"] {
        let path = folder.join(sub);
        std::fs::create_dir_all(&path).map_err(|source| ReportError {
            path: path.display().to_string(),
            source,
        })?;
    }
    let drawn = drawn_cells(folder, material, pages);
    let cells = 0..material.sweep.cells.len();
    let write_cell = |cell: usize| write_cell(folder, material, cell, drawn.contains(&cell));
    let write_factor = |effect| write_factor(folder, material, effect);
    let effects = &material.results.effects;
    let (cells, (factors, index)) = rayon::join(
        || cells.into_par_iter().try_for_each(write_cell),
        || {
            rayon::join(
                || effects.par_iter().try_for_each(write_factor),
                || write_index(folder, material),
            )
        },
    );
    cells.and(factors)?;
    index
}

/// Cells whose pictures are drawn: those chosen, and those that an earlier report drew on demand.
fn drawn_cells(folder: &Path, material: Material<'_>, pages: &Pages) -> HashSet<usize> {
    let mut drawn: HashSet<usize> = pages.choose(material).into_iter().collect();
    if matches!(pages, Pages::Also(_)) {
        let was_drawn = |cell: &usize| {
            let id = &material.sweep.cells[*cell].id;
            folder.join(format!("figures/cells/{id}.png")).exists()
        };
        drawn.extend((0..material.sweep.cells.len()).filter(was_drawn));
    }
    drawn
}

fn write_cell(
    folder: &Path,
    material: Material<'_>,
    cell: usize,
    is_drawn: bool,
) -> Result<(), ReportError> {
    // A cell without a finished chain has no picture; its page says why.
    let (figure, chains) = if is_drawn {
        (
            figures::cell(material, cell),
            figures::chains(material, cell),
        )
    } else {
        (None, None)
    };
    let shown: Vec<&Figure> = figure.iter().chain(&chains).collect();
    shown
        .par_iter()
        .try_for_each(|figure| figure.write(folder))?;
    let map = figures::cell_map(material, cell);
    let page = html::cell_page(material, cell, map.as_ref(), &shown);
    put(
        &folder.join(pages::cell_file(material, cell)),
        page.as_bytes(),
    )
}

fn write_factor(
    folder: &Path,
    material: Material<'_>,
    effect: &FactorEffect,
) -> Result<(), ReportError> {
    let mut shown = vec![figures::effect(material, effect)];
    shown.extend(figures::interactions(material, effect.factor));
    shown
        .par_iter()
        .try_for_each(|figure| figure.write(folder))?;
    let page = html::factor_page(material, effect, &shown);
    let file = factors::file(&material.sweep.factors[effect.factor]);
    put(&folder.join(file), page.as_bytes())
}

fn write_index(folder: &Path, material: Material<'_>) -> Result<PathBuf, ReportError> {
    let answer = answer::answer(material);
    let shown = &answer.leading.figure;
    let parts = sections::all(material, shown);
    let figures: Vec<&Figure> = std::iter::once(shown)
        .chain(parts.iter().flat_map(Section::figures))
        .collect();
    figures
        .par_iter()
        .try_for_each(|figure| figure.write(folder))?;
    remove_old(folder, &figures)?;
    let markdown = markdown::report(material, &answer, &parts);
    put(&folder.join("report.md"), markdown.as_bytes())?;
    let page = html::index(material, &answer, &parts);
    let path = folder.join("index.html");
    put(&path, page.as_bytes())?;
    Ok(path)
}

/// Removes the figures that the report before has on its page and this one has not. The page itself
/// is written afterwards, so a kill in between leaves nothing behind for good.
fn remove_old(folder: &Path, figures: &[&Figure]) -> Result<(), ReportError> {
    let Ok(before) = read_text_at_most(&folder.join("report.md"), MOST_BEFORE) else {
        return Ok(());
    };
    for shown in before.split("](figures/").skip(1) {
        let Some((name, _)) = shown.split_once(".png)") else {
            continue;
        };
        let file = format!("figures/{name}");
        let is_ours = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
        if !is_ours || figures.iter().any(|figure| figure.file == file) {
            continue;
        }
        for ending in ["png", "svg"] {
            let path = folder.join(format!("{file}.{ending}"));
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != ErrorKind::NotFound => {
                    let path = path.display().to_string();
                    return Err(ReportError { path, source });
                }
                _ => {}
            }
        }
    }
    Ok(())
}

/// The CSV of a cell's first world, relative to the report's folder; `None` if that world could not
/// be simulated.
fn detections_file(material: Material<'_>, cell: usize) -> Option<String> {
    let task = material.plan.tasks_of(cell).first()?;
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
