//! Tables on disk: typed columns to Parquet and CSV. The only room that names polars.

mod convergence;
mod draws;
mod evaluation;
mod labels;
mod posteriors;
mod read;
mod rows;
mod sensitivity;

pub use convergence::convergence_table;
pub use draws::{CellDraws, draws_table};
pub use evaluation::{reliability_table, scores_table};
pub use labels::{is_parquet, read_labels};
pub use posteriors::posteriors_table;
pub use read::{ReadError, read_tables};
pub use rows::{cells_table, chains_table, timings_table, topologies_table, trace_table};
pub use sensitivity::sensitivity_tables;

use std::io::Write;
use std::path::Path;

use crate::files::write_durable;

use polars::prelude::{Column, DataFrame, NamedFrom, PolarsError, Series};
use polars_io::SerWriter;
use polars_io::csv::write::CsvWriter;
use polars_io::parquet::write::{ParquetCompression, ParquetWriter};

/// A column of values, some of them missing.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// UTF-8 texts.
    Texts(Vec<Option<String>>),
    /// 64-bit floats.
    Numbers(Vec<Option<f64>>),
    /// Counts below 2⁶³, written as signed 64-bit integers: NumPy takes no unsigned ones to repeat by, and
    /// their differences wrap around.
    Counts(Vec<Option<u64>>),
    /// Truth values.
    Flags(Vec<Option<bool>>),
}

/// Named columns of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    columns: Vec<(String, Values)>,
}

/// A table that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file system says no.
    #[error("{path}: cannot be written ({source}); check the folder's rights and free space")]
    Io {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// polars says no.
    #[error("{path}: cannot be encoded ({source})")]
    Encode {
        /// The file.
        path: String,
        /// Why.
        source: PolarsError,
    },
}

impl Table {
    /// Adds a column.
    pub fn push(&mut self, name: &str, values: Values) {
        self.columns.push((name.to_owned(), values));
    }

    /// Rows.
    pub fn n_rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| match values {
            Values::Texts(values) => values.len(),
            Values::Numbers(values) => values.len(),
            Values::Counts(values) => values.len(),
            Values::Flags(values) => values.len(),
        })
    }

    /// The columns, in order.
    pub fn columns(&self) -> &[(String, Values)] {
        &self.columns
    }

    /// Writes `<folder>/<name>.parquet` and `<folder>/<name>.csv`, each whole or not at all.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write(&self, folder: &Path, name: &str) -> Result<(), TableError> {
        self.write_parquet(&folder.join(format!("{name}.parquet")))?;
        self.write_csv(&folder.join(format!("{name}.csv")))
    }

    /// Writes one CSV file, whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TableError> {
        replace(path, |file| {
            CsvWriter::new(file).n_threads(1).finish(&mut self.frame()?)
        })
    }

    /// Writes one Parquet file, whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_parquet(&self, path: &Path) -> Result<(), TableError> {
        replace(path, |file| {
            // One row group and no parallelism: the bytes depend on the rows alone.
            let mut frame = self.frame()?;
            let rows = frame.height().max(1);
            ParquetWriter::new(file)
                .with_compression(ParquetCompression::Snappy)
                .with_row_group_size(Some(rows))
                .set_parallel(false)
                .finish(&mut frame)
                .map(drop)
        })
    }

    fn frame(&self) -> Result<DataFrame, PolarsError> {
        let column = |(name, values): &(String, Values)| {
            let name = name.as_str().into();
            Column::from(match values {
                Values::Texts(values) => Series::new(name, values),
                Values::Numbers(values) => Series::new(name, values),
                Values::Counts(values) => Series::new(name, signed(values)),
                Values::Flags(values) => Series::new(name, values),
            })
        };
        DataFrame::new_infer_height(self.columns.iter().map(column).collect())
    }
}

fn signed(counts: &[Option<u64>]) -> Vec<Option<i64>> {
    let signed = |count: u64| i64::try_from(count).expect("no count reaches 2^63");
    counts.iter().map(|count| count.map(signed)).collect()
}

/// Writes beside the file and then renames, so that nobody ever reads half a table.
fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), PolarsError>,
) -> Result<(), TableError> {
    let io = |source| TableError::Io {
        path: path.display().to_string(),
        source,
    };
    let mut buffer = Vec::new();
    write(&mut buffer).map_err(|source| TableError::Encode {
        path: path.display().to_string(),
        source,
    })?;
    write_durable(path, &buffer).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_table_gives_the_same_bytes_and_missing_values_are_empty() {
        let mut table = Table::default();
        table.push("text", Values::Texts(vec![Some("a,b".into()), None]));
        table.push("number", Values::Numbers(vec![Some(0.1), None]));
        table.push("count", Values::Counts(vec![None, Some(7)]));
        table.push("flag", Values::Flags(vec![Some(true), None]));
        let folder = tempfile::tempdir().expect("a folder");
        let read = |name: &str| std::fs::read(folder.path().join(name)).expect("a file");
        table.write(folder.path(), "a").expect("written");
        table.write(folder.path(), "b").expect("written");
        assert_eq!(read("a.parquet"), read("b.parquet"));
        let frame = table.frame().expect("a frame");
        let of_counts = frame.column("count").expect("a column");
        assert_eq!(of_counts.dtype().to_string(), "i64");
        let csv = String::from_utf8(read("a.csv")).expect("a text");
        assert_eq!(csv, "text,number,count,flag\n\"a,b\",0.1,,true\n,,7,\n");
        Table::default()
            .write(folder.path(), "empty")
            .expect("written");
    }
}
