//! Draws in Parquet: label chains of other programs, and the traces of `ptm sample`.

use std::fs::File;
use std::path::Path;

use polars::prelude::{DataFrame, DataType, Int64Chunked, PolarsError};
use polars_io::SerReader;
use polars_io::parquet::read::ParquetReader;
use rayon::prelude::*;

use crate::input::{Content, InputError, Place};
use crate::labels::{Collector, Columns, Items, Refused, labels_of, weight_of};
use crate::partition::Topology;

/// Rows that are held at once.
const BLOCK: usize = 20_000;

/// Whether a file begins as Parquet does.
pub fn is_parquet(path: &Path) -> bool {
    use std::io::Read;
    let mut magic = [0; 4];
    File::open(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok()) && magic == *b"PAR1"
}

/// Reads the chains of a Parquet file into a collector; the columns are those of a CSV.
///
/// # Errors
/// A file that cannot be read, or whose content will not do.
pub fn read_labels(path: &Path, collector: &mut Collector) -> Result<(), InputError> {
    collector.begin_file(&path.display().to_string());
    let refuse = |own: Refused| -> InputError {
        Content {
            place: Place {
                path: path.to_owned(),
                line: None,
                column: None,
            },
            got: own.got,
            expected: own.expected,
            change: own.change.to_owned(),
        }
        .into()
    };
    let damaged = |error: PolarsError| {
        refuse(Refused {
            got: format!("Parquet that cannot be read ({error})"),
            expected: "a whole file with columns of texts or of 32- or 64-bit numbers".to_owned(),
            change: "write labels as 64-bit whole numbers, as pandas does by default",
        })
    };
    let open = || {
        File::open(path).map_err(|source| InputError::Read {
            path: path.to_owned(),
            source,
        })
    };
    let n_rows = ParquetReader::new(open()?).num_rows().map_err(damaged)?;
    let mut first = 0;
    while first < n_rows {
        let reader = ParquetReader::new(open()?).with_slice(Some((first, BLOCK)));
        let block = reader.set_rechunk(true).finish().map_err(damaged)?;
        push_rows(&block, first, collector).map_err(refuse)?;
        first += BLOCK;
    }
    Ok(())
}

/// A column as it is read.
enum Cells {
    Numbers(Int64Chunked),
    Texts(Vec<Option<String>>),
}

impl Cells {
    fn of(block: &DataFrame, ix: usize) -> Result<Self, Refused> {
        let column = block.columns()[ix].as_materialized_series();
        let name = column.name().to_string();
        let no_labels = |what: &dyn std::fmt::Display| Refused {
            got: format!("the column {name} of {what}"),
            expected: "whole numbers or texts".to_owned(),
            change: "write labels as whole numbers or names",
        };
        if column.dtype() == &DataType::String {
            let texts = column.str().map_err(|error| no_labels(&error))?;
            return Ok(Self::Texts(
                texts.iter().map(|text| text.map(str::to_owned)).collect(),
            ));
        }
        if !column.dtype().is_primitive_numeric() {
            return Err(no_labels(column.dtype()));
        }
        let numbers = column.cast(&DataType::Int64);
        let numbers = numbers.map_err(|error| no_labels(&error))?;
        let numbers = numbers.i64().map_err(|error| no_labels(&error))?;
        Ok(Self::Numbers(numbers.clone()))
    }

    /// All cells, if they are numbers and none is missing.
    fn numbers(&self) -> Option<&[i64]> {
        match self {
            Self::Numbers(numbers) => numbers.cont_slice().ok(),
            Self::Texts(_) => None,
        }
    }

    /// A cell as text; `None` where it is missing.
    fn text(&self, row: usize) -> Option<String> {
        match self {
            Self::Numbers(numbers) => numbers.get(row).map(|number| number.to_string()),
            Self::Texts(texts) => texts[row].clone(),
        }
    }
}

fn push_rows(block: &DataFrame, first: usize, collector: &mut Collector) -> Result<(), Refused> {
    let names = block.get_column_names();
    let Some(columns) = Columns::of(names.iter().map(|name| name.as_str())) else {
        return Err(Refused {
            got: format!("{} columns without labels", names.len()),
            expected: "columns with labels".to_owned(),
            change: "add the column labels, or one column for each item",
        });
    };
    let cells = |ix: Option<usize>| ix.map(|ix| Cells::of(block, ix)).transpose();
    let (chain, weight) = (cells(columns.chain)?, cells(columns.weight)?);
    let ln_target: Option<Vec<Option<f64>>> =
        columns.ln_target.map(|ix| numbers(block, ix)).transpose()?;
    let items: Vec<Cells> = match &columns.items {
        Items::Together(ix) => vec![Cells::of(block, *ix)?],
        Items::Apart(places) => places
            .iter()
            .map(|ix| Cells::of(block, *ix))
            .collect::<Result<_, _>>()?,
    };
    let is_together = matches!(columns.items, Items::Together(_));
    let numbers: Option<Vec<&[i64]>> = items.iter().map(Cells::numbers).collect();
    let numbers = numbers.filter(|_| !is_together);
    let topology = |row: usize| match &numbers {
        Some(numbers) => {
            let labels: Vec<i64> = numbers.iter().map(|column| column[row]).collect();
            Some(Topology::of_numbers(&labels))
        }
        None if is_together => {
            let text = items[0].text(row)?;
            Some(Topology::canonical(&labels_of(&text).collect::<Vec<_>>()))
        }
        None => {
            let texts: Option<Vec<String>> = items.iter().map(|cells| cells.text(row)).collect();
            let texts = texts?;
            Some(Topology::canonical(
                &texts.iter().map(String::as_str).collect::<Vec<_>>(),
            ))
        }
    };
    let topologies: Vec<Option<Topology>> =
        (0..block.height()).into_par_iter().map(topology).collect();
    for (row, topology) in topologies.into_iter().enumerate() {
        let at = |own: Refused| Refused {
            got: format!("{} in row {}", own.got, first + row + 1),
            ..own
        };
        let missing = |what: &str, change| {
            at(Refused {
                got: format!("no {what}"),
                expected: "one".to_owned(),
                change,
            })
        };
        let no_label = || missing("label", "give every item a label in every draw");
        let topology = topology.ok_or_else(no_label)?;
        let n_steps = match &weight {
            None => 1,
            Some(cells) => cells
                .text(row)
                .and_then(|text| weight_of(&text))
                .ok_or_else(|| missing("weight", "write how many steps the draw stands for"))?,
        };
        let name = chain.as_ref().and_then(|cells| cells.text(row));
        let ln_target = ln_target.as_ref().and_then(|own| own[row]).unwrap_or(0.0);
        collector
            .push(&name.unwrap_or_default(), &topology, (n_steps, ln_target))
            .map_err(at)?;
    }
    Ok(())
}

fn numbers(block: &DataFrame, ix: usize) -> Result<Vec<Option<f64>>, Refused> {
    let no_number = |error: PolarsError| Refused {
        got: format!("a column ln_target without numbers ({error})"),
        expected: "numbers".to_owned(),
        change: "leave the column out",
    };
    let column = block.columns()[ix].as_materialized_series();
    let column = column.cast(&DataType::Float64).map_err(no_number)?;
    let numbers = column.f64().map_err(no_number)?;
    Ok(numbers.iter().collect())
}
