//! Designs: how a sweep's factors are laid out into cells.

use super::error::SweepError;
use super::sampled::SampledDesign;
use crate::settings::{KEYS, Key, Settings, Value};

/// More cells than this are refused: nobody reads a million rows, and a slip of a digit in a level
/// list must not fill a disk.
const MAX_CELLS: u128 = 1_000_000;

/// A setting that differs between cells, with its levels in order.
#[derive(Clone)]
pub struct Factor {
    /// The setting.
    pub key: &'static Key,
    /// Its levels, by size or by the alphabet.
    pub levels: Vec<Value>,
}

impl std::fmt::Debug for Factor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {:?}", self.key.name, self.levels)
    }
}

impl Factor {
    pub(super) fn new(key: &'static Key, mut levels: Vec<Value>) -> Self {
        levels.sort_by(Value::compare);
        Self { key, levels }
    }
}

/// A cell as a list names it.
#[derive(Clone, Default)]
pub struct ListedCell {
    /// A short name, as "a".
    pub label: String,
    /// Which of several computations of the same setting; they are laid side by side.
    pub variant: String,
    /// A remark for the report.
    pub note: String,
    /// What differs from the base.
    pub overrides: Vec<(&'static Key, Value)>,
}

impl std::fmt::Debug for ListedCell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.label, self.variant)
    }
}

/// How factors become cells.
#[derive(Clone, Debug)]
pub enum Design {
    /// Every combination of levels.
    Grid(Vec<Factor>),
    /// The base, and every level of every factor by itself.
    OneAtATime(Vec<Factor>),
    /// Just these.
    List(Vec<ListedCell>),
    /// Points of the space that the factors' ranges span.
    Sampled(SampledDesign),
}

impl Design {
    /// Its name in a sweep file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Grid(_) => "grid",
            Self::OneAtATime(_) => "one-at-a-time",
            Self::List(_) => "list",
            Self::Sampled(design) => design.sampling.name(),
        }
    }

    pub(super) fn cells(&self, base: &Settings, path: &str) -> Result<Vec<Cell>, SweepError> {
        let count = self.n_cells();
        if count > MAX_CELLS {
            return Err(SweepError::Design {
                path: path.to_owned(),
                what: format!(
                    "got {count} cells, expected at most {MAX_CELLS}; name fewer levels or points"
                ),
            });
        }
        let mut listed = match self {
            Self::Grid(factors) => grid(factors),
            Self::OneAtATime(factors) => one_at_a_time(factors, base),
            Self::List(cells) => cells.clone(),
            Self::Sampled(design) => sampled(design),
        };
        if let Self::List(_) = self {
            listed.sort_by(|a, b| (&a.label, &a.variant).cmp(&(&b.label, &b.variant)));
        }
        let digits = listed.len().to_string().len().max(3);
        let mut cells: Vec<Cell> = Vec::with_capacity(listed.len());
        for cell in listed {
            let mut settings = base.clone();
            for (key, value) in &cell.overrides {
                settings
                    .set(key.name, value)
                    .map_err(|e| SweepError::setting(path, "design", e))?;
            }
            settings
                .check_together()
                .map_err(|e| SweepError::setting(path, "design", e))?;
            let number = cells.len() + 1;
            cells.push(Cell {
                id: format!("c{number:0digits$}"),
                label: cell.label,
                variant: cell.variant,
                note: cell.note,
                settings,
            });
        }
        if let Self::List(_) = self {
            refuse_twins(&cells, path)?;
        }
        Ok(cells)
    }

    fn n_cells(&self) -> u128 {
        let n_levels = |factor: &Factor| factor.levels.len() as u128;
        match self {
            Self::Grid(factors) => factors.iter().fold(1, |product: u128, factor| {
                product.saturating_mul(n_levels(factor))
            }),
            Self::OneAtATime(factors) => 1 + factors.iter().map(n_levels).sum::<u128>(),
            Self::List(cells) => cells.len() as u128,
            Self::Sampled(design) => design.n_cells(),
        }
    }
}

fn refuse_twins(cells: &[Cell], path: &str) -> Result<(), SweepError> {
    let mut by_text = std::collections::HashMap::new();
    for cell in cells {
        if let Some(first) = by_text.insert(cell.settings.canonical_text(|_| true), cell) {
            return Err(SweepError::Design {
                path: path.to_owned(),
                what: format!(
                    "cells {:?} and {:?} have the same settings; leave one out",
                    first.title(),
                    cell.title()
                ),
            });
        }
    }
    Ok(())
}

fn grid(factors: &[Factor]) -> Vec<ListedCell> {
    let mut cells = vec![ListedCell::default()];
    for factor in factors {
        let extended = cells.iter().flat_map(|cell| {
            factor.levels.iter().map(|level| {
                let mut cell = cell.clone();
                cell.overrides.push((factor.key, level.clone()));
                cell
            })
        });
        cells = extended.collect();
    }
    cells
}

fn one_at_a_time(factors: &[Factor], base: &Settings) -> Vec<ListedCell> {
    let mut cells = vec![ListedCell {
        label: "baseline".to_owned(),
        ..ListedCell::default()
    }];
    for factor in factors {
        for level in &factor.levels {
            if level != base.get(factor.key.name) {
                cells.push(ListedCell {
                    label: format!("{} = {level}", factor.key.label()),
                    overrides: vec![(factor.key, level.clone())],
                    ..ListedCell::default()
                });
            }
        }
    }
    cells
}

fn sampled(design: &SampledDesign) -> Vec<ListedCell> {
    let cell = |(place, point): (usize, Vec<f64>)| {
        let values = design.axes.iter().zip(point);
        ListedCell {
            label: design.label(place),
            overrides: values.map(|(axis, u)| (axis.key, axis.at(u))).collect(),
            ..ListedCell::default()
        }
    };
    design.points().into_iter().enumerate().map(cell).collect()
}

/// The settings that differ between cells, with the levels that occur.
pub(super) fn factors_of(cells: &[Cell]) -> Vec<Factor> {
    let mut factors = Vec::new();
    for key in KEYS {
        let mut levels: Vec<Value> = (cells.iter())
            .map(|cell| cell.settings.get(key.name).clone())
            .collect();
        levels.sort_by(Value::compare);
        levels.dedup();
        if levels.len() > 1 {
            factors.push(Factor::new(key, levels));
        }
    }
    factors
}

/// One combination of settings.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Its number in the sweep, as "c017".
    pub id: String,
    /// Its name in a list, or nothing.
    pub label: String,
    /// Its variant in a list, or nothing.
    pub variant: String,
    /// A remark for the report, or nothing.
    pub note: String,
    /// Its settings.
    pub settings: Settings,
}

impl Cell {
    /// Its name for people: label and variant, or its number.
    pub fn title(&self) -> String {
        match (self.label.is_empty(), self.variant.is_empty()) {
            (true, _) => self.id.clone(),
            (false, true) => self.label.clone(),
            (false, false) => format!("{} ({})", self.label, self.variant),
        }
    }
}
