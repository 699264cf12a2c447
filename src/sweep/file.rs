//! The sweep file as it is written: TOML, unknown keys refused.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::design::{Design, Factor, ListedCell};
use super::error::SweepError;
use crate::settings::{KEYS, Key, Section, Settings, Value, suggestion};

type Table = BTreeMap<String, toml::Value>;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepFile {
    pub title: Option<String>,
    pub description: Option<String>,
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
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDesign {
    kind: String,
    #[serde(default)]
    factors: BTreeMap<String, Vec<toml::Value>>,
    #[serde(default)]
    cells: Vec<Table>,
}

impl SweepFile {
    pub fn parse(text: &str, path: &str) -> Result<Self, SweepError> {
        // Places in messages are counted in the text after the byte order mark.
        let text = text.trim_start_matches('\u{feff}');
        toml::from_str(text).map_err(|error| {
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
            let what = error.message().replace('\n', " ");
            SweepError::Syntax {
                path: path.to_owned(),
                place,
                what,
            }
        })
    }

    /// The defaults with what the four sections set.
    pub fn base(&self, path: &str) -> Result<Settings, SweepError> {
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
                let value = value_of(value, path, section.name(), name)?;
                settings
                    .set(name, &value)
                    .map_err(|e| SweepError::setting(path, section.name(), e))?;
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
        let listed = raw.kind == "list";
        match raw.kind.as_str() {
            "grid" | "one-at-a-time" if raw.cells.is_empty() => {}
            "list" if raw.factors.is_empty() => {}
            "grid" | "one-at-a-time" => {
                return Err(error(format!(
                    "cells: a {} takes [design.factors], not a list",
                    raw.kind
                )));
            }
            "list" => {
                return Err(error(
                    "factors: a list takes [[design.cells]], not factors".to_owned(),
                ));
            }
            other => {
                let known = ["grid", "one-at-a-time", "list"];
                let suggestion = suggestion(other, known.into_iter());
                return Err(error(format!(
                    "kind: got {other:?}, expected grid, one-at-a-time or list{suggestion}"
                )));
            }
        }
        if listed {
            let mut cells = Vec::new();
            for (number, table) in raw.cells.iter().enumerate() {
                let section = format!("design.cells] cell {}", number + 1);
                cells.push(listed_cell(table, path, &section, &mut keep)?);
            }
            if cells.is_empty() {
                return Err(error(
                    "cells: got none, expected at least one [[design.cells]]".to_owned(),
                ));
            }
            return Ok((Design::List(cells), dropped));
        }
        let mut factors = Vec::new();
        for (name, levels) in &raw.factors {
            let key = factor_key(name, path, "design.factors")?;
            if levels.is_empty() {
                return Err(error(format!(
                    "{name}: got no level, expected a list of at least one"
                )));
            }
            let mut checked = Vec::new();
            for level in levels {
                let value = value_of(level, path, "design.factors", name)?;
                let value = key
                    .check(&value)
                    .map_err(|e| SweepError::setting(path, "design.factors", e))?;
                if checked.contains(&value) {
                    return Err(error(format!(
                        "{name}: got the level {value} twice; name each once"
                    )));
                }
                checked.push(value);
            }
            if keep(key) {
                factors.push(Factor::new(key, checked));
            }
        }
        factors.sort_by_key(|factor| KEYS.iter().position(|key| key.name == factor.key.name));
        let design = if raw.kind == "grid" {
            Design::Grid(factors)
        } else {
            Design::OneAtATime(factors)
        };
        Ok((design, dropped))
    }
}

fn listed_cell(
    table: &Table,
    path: &str,
    section: &str,
    keep: &mut impl FnMut(&'static Key) -> bool,
) -> Result<ListedCell, SweepError> {
    let mut cell = ListedCell::default();
    for (name, value) in table {
        let words = match name.as_str() {
            "label" => Some(&mut cell.label),
            "variant" => Some(&mut cell.variant),
            "note" => Some(&mut cell.note),
            _ => None,
        };
        let value = value_of(value, path, section, name)?;
        if let Some(words) = words {
            *words = value.to_string();
            continue;
        }
        let key = factor_key(name, path, section)?;
        let value = key
            .check(&value)
            .map_err(|e| SweepError::setting(path, section, e))?;
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

fn value_of(
    value: &toml::Value,
    path: &str,
    section: &str,
    name: &str,
) -> Result<Value, SweepError> {
    match value {
        toml::Value::Integer(integer) => match u64::try_from(*integer) {
            Ok(count) => Ok(Value::Count(count)),
            Err(_) => Ok(Value::Number(*integer as f64)),
        },
        toml::Value::Float(number) => Ok(Value::Number(*number)),
        toml::Value::String(text) => Ok(Value::Text(text.clone())),
        other => Err(SweepError::Setting {
            path: path.to_owned(),
            section: section.to_owned(),
            what: format!(
                "{name}: got {} {other}, expected a number or a text",
                other.type_str()
            ),
        }),
    }
}
