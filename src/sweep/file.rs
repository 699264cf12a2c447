//! The sweep file as it is written: TOML, unknown keys refused.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::design::{Design, Factor, ListedCell};
use super::error::SweepError;
use super::factors::{axis, levels};
use super::sampled::{SampledDesign, Sampling};
use super::space::Axis;
use super::values::Source;
use super::written::Written;
use crate::excerpt::message;
use crate::settings::{KEYS, Key, Section, Settings, suggestion};

type Table = BTreeMap<String, toml::Value>;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepFile {
    pub title: Option<String>,
    pub description: Option<String>,
    /// Where to get the recorded detections that the sweep is for; it then runs with `--data` only.
    pub needs_data: Option<String>,
    pub only_cells: Option<Vec<String>>,
    #[serde(default)]
    data: Table,
    #[serde(default)]
    model: Table,
    #[serde(default)]
    sampler: Table,
    #[serde(default)]
    run: Table,
    design: RawDesign,
    #[serde(skip)]
    written: Written,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDesign {
    kind: String,
    points: Option<toml::Value>,
    trajectories: Option<toml::Value>,
    #[serde(default)]
    factors: Table,
    #[serde(default)]
    cells: Vec<Table>,
}

impl SweepFile {
    pub fn parse(text: &str, path: &str) -> Result<Self, SweepError> {
        // Places in messages are counted in the text after the byte order mark.
        let text = text.trim_start_matches('\u{feff}');
        let parsed: Result<Self, _> = toml::from_str(text);
        let with_numbers = |file: Self| Self {
            written: Written::of(text),
            ..file
        };
        parsed.map(with_numbers).map_err(|error| {
            let place = error.span().map_or_else(String::new, |span| {
                let before = &text[..span.start.min(text.len())];
                let line = before.matches('\n').count() + 1;
                let column = before
                    .rsplit('\n')
                    .next()
                    .map_or(0, |tail| tail.chars().count())
                    + 1;
                format!(":{line}:{column}")
            });
            let what = message(error.message());
            SweepError::Syntax {
                path: path.to_owned(),
                place,
                what,
            }
        })
    }

    fn source<'a>(&'a self, path: &'a str) -> Source<'a> {
        Source {
            path,
            written: &self.written,
        }
    }

    /// The defaults with what the four sections set.
    pub fn base(&self, path: &str) -> Result<Settings, SweepError> {
        let source = self.source(path);
        let mut settings = Settings::default();
        let tables = [&self.data, &self.model, &self.sampler, &self.run];
        for (section, table) in Section::ALL.into_iter().zip(tables) {
            for (name, value) in table {
                if let Some(key) = KEYS.iter().find(|key| key.name == *name)
                    && key.section != section
                {
                    return Err(SweepError::Setting {
                        path: path.to_owned(),
                        section: section.name().to_owned(),
                        what: format!(
                            "{name}: belongs into [{}]; move it there",
                            key.section.name()
                        ),
                    });
                }
                let key = Key::named(name)
                    .map_err(|error| SweepError::setting(path, section.name(), error))?;
                let place = format!("{}.{name}", section.name());
                let value = source.checked(key, value, section.name(), &place)?;
                settings
                    .set(name, &value)
                    .map_err(|error| SweepError::setting(path, section.name(), error))?;
            }
        }
        Ok(settings)
    }

    /// The design, without settings of simulated worlds if the data come from a CSV; those are
    /// returned beside it.
    pub fn design(
        &self,
        path: &str,
        from_csv: bool,
        seed: u64,
    ) -> Result<(Design, Vec<&'static str>), SweepError> {
        let error = |what: String| SweepError::Design {
            path: path.to_owned(),
            what,
        };
        let mut dropped = Vec::new();
        let mut keep = |key: &'static Key| {
            let keeps = !(from_csv && super::decides_the_world(key));
            if !keeps {
                dropped.push(key.name);
            }
            keeps
        };
        let raw = &self.design;
        let sampling = Sampling::ALL.into_iter().find(|s| s.name() == raw.kind);
        let listed = raw.kind == "list";
        let by_factors =
            sampling.is_some() || matches!(raw.kind.as_str(), "grid" | "one-at-a-time");
        if !listed && !by_factors {
            let sampled = Sampling::ALL.map(Sampling::name);
            let known = ["grid", "one-at-a-time", "list"].into_iter().chain(sampled);
            let suggestion = suggestion(&raw.kind, known);
            return Err(error(format!(
                "kind: got {:?}, expected grid, one-at-a-time, list, {}{suggestion}",
                raw.kind,
                sampled.join(", ")
            )));
        }
        if by_factors && !raw.cells.is_empty() {
            return Err(error(format!(
                "cells: a {} takes [design.factors], not a list",
                raw.kind
            )));
        }
        if listed && !raw.factors.is_empty() {
            return Err(error(
                "factors: a list takes [[design.cells]], not factors".to_owned(),
            ));
        }
        let source = self.source(path);
        let amount = self.amount(sampling, &source).map_err(error)?;
        if listed {
            let mut cells = Vec::new();
            for (number, table) in raw.cells.iter().enumerate() {
                cells.push(listed_cell(table, &source, number, &mut keep)?);
            }
            if cells.is_empty() {
                return Err(error(
                    "cells: got none, expected at least one [[design.cells]]".to_owned(),
                ));
            }
            return Ok((Design::List(cells), dropped));
        }
        let (mut factors, mut axes) = (Vec::new(), Vec::new());
        for (name, level) in &raw.factors {
            let key = factor_key(name, path, "design.factors")?;
            if sampling.is_some() {
                let axis = axis(key, level, &source)?;
                if keep(key) {
                    axes.push(axis);
                }
                continue;
            }
            let checked = levels(key, level, &source)?;
            if keep(key) {
                factors.push(Factor::new(key, checked));
            }
        }
        let place = |key: &Key| KEYS.iter().position(|other| other.name == key.name);
        factors.sort_by_key(|factor: &Factor| place(factor.key));
        axes.sort_by_key(|axis: &Axis| place(axis.key));
        if let (Some(sampling), Some(amount)) = (sampling, amount) {
            let sampled = SampledDesign {
                sampling,
                axes,
                amount,
                seed,
            };
            return match sampled.refusal() {
                Some(refusal) => Err(error(refusal)),
                None => Ok((Design::Sampled(sampled), dropped)),
            };
        }
        let design = if raw.kind == "grid" {
            Design::Grid(factors)
        } else {
            Design::OneAtATime(factors)
        };
        Ok((design, dropped))
    }

    /// How many points or trajectories; `None` for designs that take neither.
    fn amount(
        &self,
        sampling: Option<Sampling>,
        source: &Source<'_>,
    ) -> Result<Option<u64>, String> {
        let wanted = sampling.map(Sampling::amount_name);
        let given = [
            ("points", &self.design.points),
            ("trajectories", &self.design.trajectories),
        ];
        let kind = &self.design.kind;
        for (name, _) in given.iter().filter(|(_, value)| value.is_some()) {
            if wanted != Some(name) {
                let takes = wanted.map_or_else(
                    || "neither points nor trajectories".to_owned(),
                    |wanted| format!("{wanted}, not {name}"),
                );
                return Err(format!("{name}: a {kind} design takes {takes}"));
            }
        }
        let amount = given
            .into_iter()
            .find_map(|(name, value)| Some((name, value.as_ref()?)))
            .map(|(name, value)| source.whole(value, name, &format!("design.{name}")))
            .transpose()?;
        match (wanted, amount) {
            (Some(name), None) => Err(format!(
                "{name}: a {kind} design needs it; say how many, as in {name} = 16"
            )),
            (Some(name), Some(n)) if n < 2 => Err(format!("{name}: got {n}, expected at least 2")),
            _ => Ok(amount),
        }
    }
}

fn listed_cell(
    table: &Table,
    source: &Source<'_>,
    number: usize,
    keep: &mut impl FnMut(&'static Key) -> bool,
) -> Result<ListedCell, SweepError> {
    let section = format!("design.cells] cell {}", number + 1);
    let mut cell = ListedCell::default();
    for (name, value) in table {
        let words = match name.as_str() {
            "label" => Some(&mut cell.label),
            "variant" => Some(&mut cell.variant),
            "note" => Some(&mut cell.note),
            _ => None,
        };
        let place = format!("design.cells.{number}.{name}");
        if let Some(words) = words {
            *words = source.text(value, name, &section, &place)?;
            continue;
        }
        let key = factor_key(name, source.path, &section)?;
        let value = source.checked(key, value, &section, &place)?;
        if keep(key) {
            cell.overrides.push((key, value));
        }
    }
    Ok(cell)
}

fn factor_key(name: &str, path: &str, section: &str) -> Result<&'static Key, SweepError> {
    let error = |what: String| SweepError::Setting {
        path: path.to_owned(),
        section: section.to_owned(),
        what,
    };
    match KEYS.iter().find(|key| key.name == name) {
        Some(key) if key.is_factor => Ok(key),
        Some(key) => Err(error(format!(
            "{name}: cannot differ between cells; set it once, in [{}]",
            key.section.name()
        ))),
        None => {
            let candidates = KEYS.iter().filter(|key| key.is_factor).map(|key| key.name);
            Err(error(format!(
                "{name}: no such setting{}",
                suggestion(name, candidates)
            )))
        }
    }
}
