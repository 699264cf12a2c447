//! The tables of an earlier run, read again: what two runs are compared by, whatever versions made them.

use std::collections::{BTreeMap, HashMap};
use std::io::ErrorKind;
use std::path::Path;

use crate::files::read_text_at_most;
use crate::results::compare::{ChainRow, ObservedCell, ObservedWorld, SweepTables};
use crate::settings::KEYS;

/// More bytes than the table of any sweep has whose records fit into memory.
const MAX_BYTES: u64 = 2_000_000_000;

/// A table that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It is not there.
    #[error("{path}: cannot be read ({source}); give the folder of a finished sweep")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{path}: {what}")]
    Content {
        /// The file.
        path: String,
        /// What was got, what was expected, what to do.
        what: String,
    },
}

/// A CSV by columns.
struct Csv {
    path: String,
    column_of: HashMap<String, usize>,
    rows: Vec<csv::StringRecord>,
}

impl Csv {
    fn read(folder: &Path, name: &str) -> Result<Self, ReadError> {
        let file = folder.join(name);
        let path = file.display().to_string();
        let text = read_text_at_most(&file, MAX_BYTES).map_err(|source| match source.kind() {
            ErrorKind::InvalidData | ErrorKind::FileTooLarge => ReadError::Content {
                path: path.clone(),
                what: format!("got a damaged table ({source}); write it again with ptm report"),
            },
            _ => ReadError::Read {
                path: path.clone(),
                source,
            },
        })?;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let damaged = |error: csv::Error| ReadError::Content {
            path: path.clone(),
            what: format!("got a damaged table ({error}); write it again with ptm report"),
        };
        let header = reader.headers().map_err(damaged)?.clone();
        let rows = reader
            .records()
            .collect::<Result<_, _>>()
            .map_err(damaged)?;
        let places = header.iter().enumerate();
        let column_of = places
            .map(|(place, name)| (name.to_owned(), place))
            .collect();
        Ok(Self {
            path,
            column_of,
            rows,
        })
    }

    fn column(&self, name: &str) -> Result<usize, ReadError> {
        self.column_of.get(name).copied().ok_or_else(|| {
            self.wrong(format!(
                "got no column {name}, expected one; write the table again with ptm report"
            ))
        })
    }

    fn wrong(&self, what: String) -> ReadError {
        ReadError::Content {
            path: self.path.clone(),
            what,
        }
    }

    /// The value in a row, if it is not empty.
    fn value<T: std::str::FromStr>(
        &self,
        row: &csv::StringRecord,
        column: usize,
    ) -> Result<Option<T>, ReadError> {
        let text = row.get(column).unwrap_or_default();
        if text.is_empty() {
            return Ok(None);
        }
        let line = row.position().map_or(0, csv::Position::line);
        text.parse().map(Some).map_err(|_| {
            self.wrong(format!(
                "line {line}: got {text:?}, expected a value of its column; write the table again with ptm report"
            ))
        })
    }
}

/// What a sweep's folder holds in `cells.csv`, `chains.csv`, `convergence.csv` and `detections/`.
///
/// # Errors
/// A table that is missing or damaged.
pub fn read_tables(folder: &Path) -> Result<SweepTables, ReadError> {
    let cells = Csv::read(folder, "cells.csv")?;
    let id = cells.column("cell")?;
    let mut found = SweepTables::default();
    let mut place_of: HashMap<String, usize> = HashMap::new();
    for row in &cells.rows {
        let name = row.get(id).unwrap_or_default().to_owned();
        let settings = KEYS.iter().filter_map(|key| {
            let value = row.get(*cells.column_of.get(key.name)?)?;
            Some((key.name.to_owned(), value.to_owned()))
        });
        place_of.insert(name.clone(), found.cells.len());
        found.cells.push(ObservedCell {
            id: name,
            settings: settings.collect(),
            worlds: BTreeMap::new(),
        });
    }
    add_chains(folder, &place_of, &mut found)?;
    add_worlds(folder, &place_of, &mut found)?;
    Ok(found)
}

/// The cell and world that a row of a table is of.
fn world_of<'a>(
    table: &Csv,
    row: &csv::StringRecord,
    place_of: &HashMap<String, usize>,
    found: &'a mut SweepTables,
) -> Result<&'a mut ObservedWorld, ReadError> {
    let name = row.get(table.column("cell")?).unwrap_or_default();
    let world: Option<u64> = table.value(row, table.column("world")?)?;
    match (place_of.get(name), world) {
        (Some(&cell), Some(world)) => Ok(found.cells[cell].worlds.entry(world).or_default()),
        _ => Err(table.wrong(format!(
            "got a row of cell {name:?}, expected one of cells.csv; write the tables again with ptm report"
        ))),
    }
}

fn add_chains(
    folder: &Path,
    place_of: &HashMap<String, usize>,
    found: &mut SweepTables,
) -> Result<(), ReadError> {
    let table = Csv::read(folder, "chains.csv")?;
    let names = [
        "data",
        "chain",
        "key",
        "status",
        "recovered",
        "acceptance_rate",
        "mean_n_sets",
    ];
    let mut columns = [0; 7];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = table.column(name)?;
    }
    let [data, chain, key, status, recovered, acceptance, n_sets] = columns;
    let mut content_of: HashMap<u64, String> = HashMap::new();
    let mut seen = std::collections::HashSet::new();
    for row in &table.rows {
        // Replicates of a world without noise are one and the same.
        let cell = row.get(table.column("cell")?).unwrap_or_default();
        if !seen.insert((cell.to_owned(), row.get(key).unwrap_or_default().to_owned())) {
            continue;
        }
        let number = table.value(row, data)?.unwrap_or(0);
        let content = match content_of.get(&number) {
            Some(content) => content.clone(),
            None => {
                let content = detections(folder, number);
                content_of.insert(number, content.clone());
                content
            }
        };
        let own = ChainRow {
            chain: table.value(row, chain)?.unwrap_or(0),
            recovered: table.value(row, recovered)?,
            acceptance: table.value(row, acceptance)?,
            n_sets: table.value(row, n_sets)?,
        };
        let is_done = row.get(status) == Some("done");
        let world = world_of(&table, row, place_of, found)?;
        world.data = content;
        if is_done {
            world.chains.push(own);
        } else {
            world.n_failed += 1;
        }
    }
    Ok(())
}

/// The detections of a data set; nothing for a world that could not be simulated.
fn detections(folder: &Path, number: u64) -> String {
    let file = folder.join(format!("detections/d{number:03}.csv"));
    read_text_at_most(&file, MAX_BYTES).unwrap_or_default()
}

fn add_worlds(
    folder: &Path,
    place_of: &HashMap<String, usize>,
    found: &mut SweepTables,
) -> Result<(), ReadError> {
    let table = Csv::read(folder, "convergence.csv")?;
    let (ess, state) = (
        table.column("ess_topologies")?,
        table.column("convergence")?,
    );
    for row in &table.rows {
        let value = table.value(row, ess)?;
        let converged = matches!(row.get(state), Some("mixes" | "at-rest"));
        let world = world_of(&table, row, place_of, found)?;
        (world.ess, world.converged) = (value, converged);
    }
    Ok(())
}
