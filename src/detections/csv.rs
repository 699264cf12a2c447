//! The detections CSV: a header, then one row per detection in mission order.
//!
//! `x,y` (m) are required; `cov_xx,cov_xy,cov_yy` (m²) come all three or not at all; `first_seen`,
//! `last_seen` (s), `corner` (open or closed) and `landmark` (a whole number or a name) are
//! optional, and empty where unknown. A negative landmark is unknown too, as is the word nan, none,
//! null or na in an optional cell. [`crate::input::Table`] says how files may differ; columns that
//! are not named here are left out, which a note tells. Numbers are written with the fewest digits
//! that read back to the same bits.

use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;

use super::{Corner, Covariance, Detection, Detections, DetectionsError};
use crate::input::{Column, Identities, InputError, Layout, Note, Row, Source, Table, quoted};

/// Columns of a detections file, in the order in which they are written.
pub const COLUMNS: [&str; 9] = [
    "x",
    "y",
    "cov_xx",
    "cov_xy",
    "cov_yy",
    "first_seen",
    "last_seen",
    "corner",
    "landmark",
];

/// The same for the reader.
const LAYOUT: Layout = Layout {
    rows: "detections",
    columns: &[
        Column::required(COLUMNS[X], "m"),
        Column::required(COLUMNS[Y], "m"),
        Column::optional(COLUMNS[COV_XX]),
        Column::optional(COLUMNS[COV_XY]),
        Column::optional(COLUMNS[COV_YY]),
        Column::optional(COLUMNS[FIRST_SEEN]),
        Column::optional(COLUMNS[LAST_SEEN]),
        Column::optional(COLUMNS[CORNER]),
        Column::optional(COLUMNS[LANDMARK]),
    ],
    max_rows: MAX_DETECTIONS,
};

/// A file may hold so many detections: twenty times what a chain takes in reasonable time.
pub const MAX_DETECTIONS: usize = 200_000;

const X: usize = 0;
const Y: usize = 1;
const COV_XX: usize = 2;
const COV_XY: usize = 3;
const COV_YY: usize = 4;
const FIRST_SEEN: usize = 5;
const LAST_SEEN: usize = 6;
const CORNER: usize = 7;
const LANDMARK: usize = 8;

impl Detections {
    /// Reads a detections file, plain or compressed with gzip.
    ///
    /// # Errors
    /// A file that cannot be read, or whose content will not do.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, DetectionsError> {
        let source = Source::open(path.as_ref())?;
        Self::from_source(source).map(|(detections, _)| detections)
    }

    /// Reads detections from anything readable; `path_for_messages` is what errors call it.
    ///
    /// # Errors
    /// As [`Detections::read_csv`].
    pub fn from_csv_reader(
        reader: impl Read,
        path_for_messages: impl AsRef<Path>,
    ) -> Result<Self, DetectionsError> {
        let source = Source::from_reader(reader, path_for_messages.as_ref())?;
        Self::from_source(source).map(|(detections, _)| detections)
    }

    /// Reads a detections file, and says what was left out or put up with.
    ///
    /// # Errors
    /// As [`Detections::read_csv`].
    pub fn from_source(source: Source<'_>) -> Result<(Self, Vec<Note>), DetectionsError> {
        let mut table = Table::new(source, LAYOUT)?;
        check_covariance_columns(&table)?;
        let has_covariance = table.has(COV_XX);
        let mut identities = Identities::default();
        let (mut rows, mut keys) = (Vec::new(), Vec::new());
        while let Some(mut row) = table.next_row()? {
            let detection = detection(&mut row, has_covariance)?;
            super::check(&detection, || row.place(None).to_string())?;
            keys.push(row.identity(LANDMARK, &mut identities)?);
            rows.push(detection);
        }
        if rows.is_empty() {
            return Err(table.no_rows().into());
        }
        let numbered = identities.finish();
        for (row, key) in rows.iter_mut().zip(keys) {
            row.landmark = key.map(|key: usize| numbered.numbers[key]);
        }
        let detections = Self::new(rows)?.with_landmark_names(&numbered.names)?;
        Ok((detections, table.notes()))
    }

    /// Writes a detections file that reads back equal.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), DetectionsError> {
        let path = path.as_ref();
        std::fs::write(path, self.to_csv_string()).map_err(|source| DetectionsError::Write {
            path: path.into(),
            source,
        })
    }

    /// The text of a detections file; columns of which nothing is known are left out.
    pub fn to_csv_string(&self) -> String {
        let columns: Vec<usize> = (0..COLUMNS.len())
            .filter(|&column| {
                [X, Y].contains(&column) || self.iter().any(|d| !self.cell(d, column).is_empty())
            })
            .collect();
        let names: Vec<&str> = columns.iter().map(|&column| COLUMNS[column]).collect();
        let mut text = names.join(",");
        text.push('\n');
        for detection in self.iter() {
            for (ix, &column) in columns.iter().enumerate() {
                let comma = if ix == 0 { "" } else { "," };
                write!(text, "{comma}{}", self.cell(detection, column))
                    .expect("a String takes any text");
            }
            text.push('\n');
        }
        text
    }

    /// One cell as written; empty where unknown.
    fn cell(&self, detection: &Detection, column: usize) -> String {
        let covariance =
            |pick: fn(Covariance) -> f64| detection.covariance_m2.map(pick).map(|v| v.to_string());
        match column {
            X => Some(detection.position_m[0].to_string()),
            Y => Some(detection.position_m[1].to_string()),
            COV_XX => covariance(|c| c.xx),
            COV_XY => covariance(|c| c.xy),
            COV_YY => covariance(|c| c.yy),
            FIRST_SEEN => detection.first_seen_s.map(|v| v.to_string()),
            LAST_SEEN => detection.last_seen_s.map(|v| v.to_string()),
            CORNER => detection.corner.map(|v| v.to_string()),
            LANDMARK => detection.landmark.map(|v| quoted(&self.landmark_name(v))),
            _ => unreachable!("every place in COLUMNS is listed here"),
        }
        .unwrap_or_default()
    }
}

/// The covariance has three numbers, or is not there.
fn check_covariance_columns(table: &Table<'_>) -> Result<(), InputError> {
    let (present, absent): (Vec<usize>, Vec<usize>) = [COV_XX, COV_XY, COV_YY]
        .iter()
        .partition(|&&column| table.has(column));
    if present.is_empty() || absent.is_empty() {
        return Ok(());
    }
    let list = |columns: &[usize]| {
        let names: Vec<&str> = columns.iter().map(|&column| COLUMNS[column]).collect();
        names.join(",")
    };
    let (present, absent) = (list(&present), list(&absent));
    Err(table.bad_header(
        format!("{present} without {absent} in the header"),
        "cov_xx,cov_xy,cov_yy all three or none",
        &format!("add {absent} or remove {present}"),
    ))
}

/// The row without its landmark.
fn detection(row: &mut Row<'_, '_>, has_covariance: bool) -> Result<Detection, InputError> {
    let covariance_m2 = if has_covariance {
        Some(Covariance {
            xx: row.number(COV_XX)?,
            xy: row.number(COV_XY)?,
            yy: row.number(COV_YY)?,
        })
    } else {
        None
    };
    let corner = if row.is_missing(CORNER) {
        None
    } else {
        let kind = Corner::from_name(&row.text(CORNER).to_ascii_lowercase());
        Some(kind.ok_or_else(|| row.fault(CORNER, "open, closed or nothing"))?)
    };
    Ok(Detection {
        position_m: [row.number(X)?, row.number(Y)?],
        covariance_m2,
        first_seen_s: row.optional_number(FIRST_SEEN)?,
        last_seen_s: row.optional_number(LAST_SEEN)?,
        corner,
        landmark: None,
    })
}
