//! A sweep file, checked once and expanded into cells. Nothing is run here.
//!
//! The order of cells, factors and levels does not depend on the order in which the file names
//! them, so that reordering a sweep file changes no output.

mod design;
mod error;
mod factors;
mod file;
mod sampled;
mod schema;
mod sobol;
mod space;
mod stopping;
mod values;
mod written;

pub use design::{Cell, Design, Factor};
pub use error::SweepError;
pub use sampled::{SampledDesign, Sampling};
pub use schema::schema;
pub use space::{Axis, Spread};
pub use stopping::Stopping;

use std::io::ErrorKind;
use std::path::Path;

use crate::files::{read_text_at_most, text_of};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::{Key, Section, Settings, Value};

/// More bytes than this are no sweep file.
pub const MAX_SWEEP_FILE: u64 = 16_000_000;

/// More chains than this are refused: their records would not fit into memory.
const MAX_CHAINS: u64 = 10_000_000;

/// What a description begins with if its worlds were replaced by `--data`.
const REPLACED: &str =
    "On detections from a CSV, not on the worlds that the sweep file describes. The file says:";

/// A checked sweep.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Name of the sweep: the stem of its file.
    pub name: String,
    /// The path of its file, for messages.
    pub path: String,
    /// One line that says what it is about.
    pub title: String,
    /// A paragraph for the report.
    pub description: String,
    /// The file as it was read.
    pub text: String,
    /// The settings that the design varies round.
    pub base: Settings,
    /// How cells are laid out.
    pub design: Design,
    /// The settings that differ between cells, each with its levels.
    pub factors: Vec<Factor>,
    /// The cells.
    pub cells: Vec<Cell>,
    /// Whether the detections are given beside the file.
    pub data_are_given: bool,
    /// Factors of the file that were left out because the data come from a CSV.
    pub dropped_factors: Vec<&'static str>,
}

impl Sweep {
    /// Reads, checks and expands a sweep file. `data` replaces the file's `[data]` by a detections
    /// CSV: factors of the world are then left out.
    ///
    /// # Errors
    /// A file that cannot be read, is no TOML, names an unknown key or a bad value, or asks for too
    /// many cells.
    pub fn read(path: &Path, data: Option<&Path>) -> Result<Self, SweepError> {
        let text = read_text_at_most(path, MAX_SWEEP_FILE).map_err(|source| {
            let path = path.display().to_string();
            // What is wrong is the content, not the file's place or rights.
            let what = match source.kind() {
                ErrorKind::InvalidData => {
                    "got bytes that are not UTF-8, expected a text; save it as UTF-8".to_owned()
                }
                ErrorKind::FileTooLarge => format!(
                    "got more than {mb} MB, expected a sweep file of at most {mb} MB; give \
                     the path of a sweep file",
                    mb = MAX_SWEEP_FILE / 1_000_000
                ),
                _ => return SweepError::Read { path, source },
            };
            let place = String::new();
            SweepError::Syntax { path, place, what }
        })?;
        let name = path
            .file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Self::parse(&text, &path.display().to_string(), &name, data)
    }

    /// As [`read`](Self::read), from a text; `path` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(
        text: &str,
        path: &str,
        name: &str,
        data: Option<&Path>,
    ) -> Result<Self, SweepError> {
        let file = file::SweepFile::parse(text, path)?;
        let mut base = file.base(path)?;
        // The file describes the worlds it names, not the detections that replace them.
        let replaced =
            data.is_some() && base.text("detections").is_empty() && file.needs_data.is_none();
        if let Some(csv) = data {
            let csv = Value::Text(text_of(csv));
            base.set("detections", &csv)
                .map_err(|error| SweepError::setting(path, "data", error))?;
        }
        let from_csv = !base.text("detections").is_empty();
        if let Some(how) = file.needs_data.as_ref().filter(|_| !from_csv) {
            return Err(SweepError::NeedsData {
                path: path.to_owned(),
                how: how.clone(),
            });
        }
        let (design, mut dropped_factors) = file.design(path, from_csv, base.count("seed"))?;
        if data.is_none() && !dropped_factors.is_empty() {
            return Err(SweepError::Design {
                path: path.to_owned(),
                what: format!(
                    "{}: a setting of simulated worlds, but [data] detections names a CSV; \
                     leave the factor out or simulate a world",
                    dropped_factors.join(", ")
                ),
            });
        }
        dropped_factors.sort_unstable();
        dropped_factors.dedup();
        let is_stopping = Stopping::of(&base).is_some();
        Stopping::check(&base, from_csv && data.is_none())
            .map_err(|e| SweepError::setting(path, "data", e))?;
        if from_csv {
            // One data set: there is nothing to replicate.
            let amounts = [
                ("replicates", Value::Count(1)),
                ("rate_error", Value::Number(0.0)),
                ("max_replicates", Value::Count(0)),
            ];
            for (name, value) in amounts {
                base.set(name, &value)
                    .map_err(|e| SweepError::setting(path, "data", e))?;
            }
            if is_stopping {
                dropped_factors.push("rate_error");
            }
        }
        let mut cells = design.cells(&base, path)?;
        if let Some(ids) = &file.only_cells {
            cells = only(cells, ids, path)?;
        }
        let (replicates, amount) = match Stopping::of(&base) {
            Some(stopping) => (stopping.most, "max_replicates"),
            None => (base.count("replicates"), "replicates"),
        };
        let n_chains = cells.len() as u64 * replicates * base.count("chains");
        if n_chains > MAX_CHAINS {
            return Err(SweepError::Design {
                path: path.to_owned(),
                what: format!(
                    "got {n_chains} chains (cells x {amount} x chains), expected at most \
                     {MAX_CHAINS}; ask for fewer"
                ),
            });
        }
        let factors = design::factors_of(&cells);
        refuse_idle(&factors, &cells, path)?;
        Ok(Self {
            name: name.to_owned(),
            path: path.to_owned(),
            title: file.title.unwrap_or_else(|| name.to_owned()),
            description: match (replaced, file.description) {
                (true, Some(text)) => format!("{REPLACED} {text}"),
                (true, None) => REPLACED.to_owned(),
                (false, text) => text.unwrap_or_default(),
            },
            text: text.to_owned(),
            base,
            design,
            factors,
            cells,
            data_are_given: data.is_some(),
            dropped_factors,
        })
    }

    /// The same sweep of these cells alone: they keep their names, worlds and chains. Its text says so too, and gives
    /// the same sweep when it is read again.
    ///
    /// # Errors
    /// A cell that there is not.
    pub fn only(&self, ids: &[String], path: &str) -> Result<Self, SweepError> {
        let cells = only(self.cells.clone(), ids, path)?;
        let names: Vec<String> = cells.iter().map(|cell| format!("{:?}", cell.id)).collect();
        let text = match self.text.split_once('\n') {
            Some((first, rest)) if first.starts_with(ONLY_CELLS) => rest,
            _ => &self.text,
        };
        Ok(Self {
            text: format!("{ONLY_CELLS} = [{}]\n{text}", names.join(", ")),
            factors: design::factors_of(&cells),
            cells,
            ..self.clone()
        })
    }

    /// Where its file sets a key, for messages: "noisy.toml: [design.factors] world". `None` for the
    /// detections if they are given beside the file.
    pub fn place_of(&self, name: &'static str) -> Option<String> {
        let key = Key::named(name).ok()?;
        let is_factor = match &self.design {
            Design::Grid(factors) | Design::OneAtATime(factors) => {
                factors.iter().any(|factor| factor.key.name == name)
            }
            Design::Sampled(sampled) => sampled.axes.iter().any(|axis| axis.key.name == name),
            Design::List(cells) => {
                let mut overrides = cells.iter().flat_map(|cell| &cell.overrides);
                overrides.any(|(key, _)| key.name == name)
            }
        };
        let section = match &self.design {
            _ if name == "detections" && self.data_are_given => return None,
            Design::List(_) if is_factor => "design.cells",
            _ if is_factor => "design.factors",
            _ => key.section.name(),
        };
        Some(format!("{}: [{section}] {name}", self.path))
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.base.count("seed")
    }

    /// Independent worlds that every cell has; under a stopping rule those of the first round.
    pub fn n_replicates(&self) -> u64 {
        self.base.count("replicates")
    }

    /// The rule by which cells are given more worlds, if there is one.
    pub fn stopping(&self) -> Option<Stopping> {
        Stopping::of(&self.base)
    }

    /// Worlds that a cell may come to have.
    pub fn max_replicates(&self) -> u64 {
        self.stopping()
            .map_or(self.n_replicates(), |stopping| stopping.most)
    }

    /// Independent chains per world.
    pub fn n_chains(&self) -> u64 {
        self.base.count("chains")
    }

    /// Whether the data are simulated, so that replicates are worlds.
    pub fn is_simulated(&self) -> bool {
        self.base.text("detections").is_empty()
    }

    /// Whether rates are over worlds. With a single data set, simulated or not, they are over chains
    /// and say nothing of other data.
    pub fn has_many_worlds(&self) -> bool {
        self.is_simulated() && self.max_replicates() > 1
    }

    /// What identifies the sweep: its seed, cells and amounts, without title, comments and order.
    pub fn key(&self) -> String {
        let mut purpose = Purpose::new(SAMPLER_SEMANTICS, self.seed());
        // Without a stopping rule a sweep is named as it was before there were any.
        let names = |key: &Key| {
            !is_location(key) && (self.stopping().is_some() || !Stopping::is_of_rule(key))
        };
        purpose = purpose.text("base", &self.base.canonical_text(names));
        for cell in &self.cells {
            purpose = purpose.text("cell", &cell.settings.canonical_text(names));
        }
        hex(&purpose.key()[..16])
    }
}

/// The key that leaves all but some cells out; it stands first, before any table.
const ONLY_CELLS: &str = "only_cells";

/// Refuses a factor that no cell's estimator is sure to have a use for.
fn refuse_idle(factors: &[Factor], cells: &[Cell], path: &str) -> Result<(), SweepError> {
    let is_idle = |name: &str| cells.iter().all(|cell| cell.settings.may_be_idle(name));
    let Some(idle) = factors.iter().find(|factor| is_idle(factor.key.name)) else {
        return Ok(());
    };
    let name = idle.key.name;
    let having = match name {
        "candidates" => "explicit",
        _ => "common or fresh",
    };
    let got = cells[0].settings.get("estimator");
    Err(SweepError::Design {
        path: path.to_owned(),
        what: format!(
            "{name} varies: got [sampler] estimator {got}, expected {having}, which has a use for it"
        ),
    })
}

fn only(cells: Vec<Cell>, ids: &[String], path: &str) -> Result<Vec<Cell>, SweepError> {
    let is_of = |cell: &Cell, id: &String| cell.id == *id || cell.label == *id;
    let missing = |id: &&String| !cells.iter().any(|cell| is_of(cell, id));
    if let Some(id) = ids.iter().find(missing) {
        let known = match cells.as_slice() {
            [first, .., last] => format!("cells from {} to {}, or their labels", first.id, last.id),
            [one] => format!("{}, the only cell", one.id),
            [] => "no cells".to_owned(),
        };
        return Err(SweepError::Design {
            path: path.to_owned(),
            what: format!("cells: got {id:?}, expected {known}"),
        });
    }
    let is_kept = |cell: &Cell| ids.iter().any(|id| is_of(cell, id));
    Ok(cells.into_iter().filter(is_kept).collect())
}

/// Whether a setting says where the data are found and not what they are: identity is by content.
fn is_location(key: &Key) -> bool {
    key.name == "detections"
}

/// The settings that decide what a chain does, given its data, start and length.
pub fn decides_the_chain(key: &Key) -> bool {
    matches!(key.section, Section::Model | Section::Sampler) && key.name != "init"
}

/// The settings that decide what a world is, given its seed and replicate.
pub fn decides_the_world(key: &Key) -> bool {
    key.section == Section::Data
        && !matches!(key.name, "detections" | "replicates")
        && !Stopping::is_of_rule(key)
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests;
