//! The detections CSV: a header, then one row per detection in mission order.
//!
//! `x,y` (m) are required; `cov_xx,cov_xy,cov_yy` (m²) come all three or not at all; `first_seen`,
//! `last_seen` (s), `corner` (open or closed) and `landmark` (integer) are optional, and empty where
//! unknown. An unknown column is refused, not ignored: a misspelt `landmrak` would otherwise
//! silently turn every score of a run into "truth unknown". Numbers are written with the fewest
//! digits that read back to the same bits.

use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;

use super::{Corner, Covariance, Detection, Detections, DetectionsError};
use crate::excerpt::{OF_A_VALUE, excerpt};

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

const COVARIANCE: [&str; 3] = ["cov_xx", "cov_xy", "cov_yy"];

impl Detections {
    /// Reads a detections file.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, DetectionsError> {
        let path = path.as_ref();
        let file = std::fs::File::open(path).map_err(|source| DetectionsError::Read {
            path: path.into(),
            source,
        })?;
        Self::from_csv_reader(file, path)
    }

    /// Reads detections from anything readable; `path_for_messages` is what errors call it.
    pub fn from_csv_reader(
        mut reader: impl Read,
        path_for_messages: impl AsRef<Path>,
    ) -> Result<Self, DetectionsError> {
        let path = path_for_messages.as_ref();
        let mut bytes = Vec::new();
        reader
            .read_to_end(&mut bytes)
            .map_err(|source| DetectionsError::Read {
                path: path.into(),
                source,
            })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| DetectionsError::NotUtf8 {
            path: path.into(),
            line: line_of(&bytes, error.valid_up_to()),
        })?;
        parse(text.strip_prefix('\u{feff}').unwrap_or(text), path)
    }

    /// Writes a detections file that reads back equal.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), DetectionsError> {
        let path = path.as_ref();
        std::fs::write(path, self.to_csv_string()).map_err(|source| DetectionsError::Write {
            path: path.into(),
            source,
        })
    }

    /// The text of a detections file; columns of which nothing is known are left out.
    pub fn to_csv_string(&self) -> String {
        let columns: Vec<&str> = COLUMNS
            .into_iter()
            .filter(|column| {
                ["x", "y"].contains(column) || self.iter().any(|d| !cell(d, column).is_empty())
            })
            .collect();
        let mut text = columns.join(",");
        text.push('\n');
        for detection in self.iter() {
            for (ix, column) in columns.iter().enumerate() {
                let comma = if ix == 0 { "" } else { "," };
                write!(text, "{comma}{}", cell(detection, column))
                    .expect("a String takes any text");
            }
            text.push('\n');
        }
        text
    }
}

/// One cell as written; empty where unknown.
fn cell(detection: &Detection, column: &str) -> String {
    let covariance =
        |pick: fn(Covariance) -> f64| detection.covariance_m2.map(pick).map(|v| v.to_string());
    match column {
        "x" => Some(detection.position_m[0].to_string()),
        "y" => Some(detection.position_m[1].to_string()),
        "cov_xx" => covariance(|c| c.xx),
        "cov_xy" => covariance(|c| c.xy),
        "cov_yy" => covariance(|c| c.yy),
        "first_seen" => detection.first_seen_s.map(|v| v.to_string()),
        "last_seen" => detection.last_seen_s.map(|v| v.to_string()),
        "corner" => detection.corner.map(|v| v.to_string()),
        "landmark" => detection.landmark.map(|v| v.to_string()),
        _ => unreachable!("every name in COLUMNS is listed here"),
    }
    .unwrap_or_default()
}

fn parse(text: &str, path: &Path) -> Result<Detections, DetectionsError> {
    if text.trim().is_empty() {
        return Err(DetectionsError::Blank { path: path.into() });
    }
    let mut reader = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(::csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut header: Option<Header> = None;
    let mut rows = Vec::new();
    let (mut line, mut counted_to) = (1, 0);
    for record in reader.records() {
        // Flexible records of text that is known to be UTF-8, from memory: nothing can fail.
        let record = record.expect("reading records from a string");
        // The reader's own line is that of the first of any blank lines before the record.
        let position = record
            .position()
            .expect("records that were read have a position");
        let from = position.byte() as usize;
        let start = from
            + text[from..]
                .bytes()
                .take_while(|b| b"\r\n".contains(b))
                .count();
        line += line_of(&text.as_bytes()[counted_to..start], start - counted_to) - 1;
        counted_to = start;
        match &header {
            None => header = Some(Header::new(&record, path, line)?),
            Some(header) => {
                let row = header.row(&record, path, line)?;
                super::check(&row, || place(path, line))?;
                rows.push(row);
            }
        }
    }
    if rows.is_empty() {
        return Err(DetectionsError::Empty {
            place: path.display().to_string(),
        });
    }
    Detections::new(rows)
}

/// The place of each known column in the file at hand.
struct Header {
    n_fields: usize,
    /// Parallel to [`COLUMNS`].
    field_ix: [Option<usize>; COLUMNS.len()],
}

impl Header {
    fn new(record: &::csv::StringRecord, path: &Path, line: u64) -> Result<Self, DetectionsError> {
        let fault = |got: String, expected: &str, change: String| DetectionsError::Header {
            path: path.into(),
            line,
            got,
            expected: expected.into(),
            change,
        };
        let mut field_ix = [None; COLUMNS.len()];
        for (ix, name) in record.iter().enumerate() {
            let Some(known) = COLUMNS.iter().position(|column| *column == name) else {
                return Err(unknown_column(name, fault));
            };
            if field_ix[known].replace(ix).is_some() {
                let change = format!("keep one column {name}");
                return Err(fault(format!("{name} twice"), "each column once", change));
            }
        }
        let header = Self {
            n_fields: record.len(),
            field_ix,
        };
        let missing = |names: &[&'static str]| -> Vec<&str> {
            names
                .iter()
                .copied()
                .filter(|name| header.ix(name).is_none())
                .collect()
        };
        if let Some(name) = missing(&["x", "y"]).first() {
            let got = record.iter().collect::<Vec<_>>().join(",");
            return Err(fault(
                got,
                "the columns x and y",
                format!("add the column {name} (m)"),
            ));
        }
        let absent = missing(&COVARIANCE);
        if !absent.is_empty() && absent.len() < COVARIANCE.len() {
            let present: Vec<&str> = COVARIANCE
                .into_iter()
                .filter(|name| header.ix(name).is_some())
                .collect();
            return Err(fault(
                format!("{} without {}", present.join(","), absent.join(",")),
                "cov_xx,cov_xy,cov_yy all three or none",
                format!("add {} or remove {}", absent.join(","), present.join(",")),
            ));
        }
        Ok(header)
    }

    fn ix(&self, name: &str) -> Option<usize> {
        COLUMNS
            .iter()
            .position(|column| *column == name)
            .and_then(|known| self.field_ix[known])
    }

    fn row(
        &self,
        record: &::csv::StringRecord,
        path: &Path,
        line: u64,
    ) -> Result<Detection, DetectionsError> {
        if record.len() != self.n_fields {
            return Err(DetectionsError::FieldCount {
                path: path.into(),
                line,
                got: record.len(),
                expected: self.n_fields,
                change: "write one field per column, separated by commas, with a decimal point",
            });
        }
        let read = Row {
            header: self,
            record,
            path,
            line,
        };
        let covariance_m2 = match self.ix("cov_xx") {
            None => None,
            Some(_) => Some(Covariance {
                xx: read.required("cov_xx")?,
                xy: read.required("cov_xy")?,
                yy: read.required("cov_yy")?,
            }),
        };
        Ok(Detection {
            position_m: [read.required("x")?, read.required("y")?],
            covariance_m2,
            first_seen_s: read.optional("first_seen", "a number or nothing", number)?,
            last_seen_s: read.optional("last_seen", "a number or nothing", number)?,
            corner: read.optional("corner", "open, closed or nothing", Corner::from_name)?,
            landmark: read.optional("landmark", "an integer or nothing", integer)?,
        })
    }
}

/// One row, its header, and where it stands, for the sake of messages.
struct Row<'a> {
    header: &'a Header,
    record: &'a ::csv::StringRecord,
    path: &'a Path,
    line: u64,
}

impl Row<'_> {
    fn text(&self, column: &str) -> &str {
        self.header
            .ix(column)
            .and_then(|ix| self.record.get(ix))
            .unwrap_or_default()
    }

    fn required(&self, column: &'static str) -> Result<f64, DetectionsError> {
        let text = self.text(column);
        number(text).ok_or_else(|| self.fault(column, "a number"))
    }

    fn optional<T>(
        &self,
        column: &'static str,
        expected: &'static str,
        read: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<T>, DetectionsError> {
        match self.text(column) {
            "" => Ok(None),
            text => read(text)
                .map(Some)
                .ok_or_else(|| self.fault(column, expected)),
        }
    }

    fn fault(&self, column: &'static str, expected: &'static str) -> DetectionsError {
        let text = self.text(column);
        DetectionsError::Value {
            place: place(self.path, self.line),
            column,
            got: if text.is_empty() {
                "nothing".into()
            } else {
                format!("{:?}", excerpt(text, OF_A_VALUE))
            },
            expected,
            change: "correct the value or remove the row",
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok()
}

/// Table programs turn integer columns with gaps into floating point, so `3.0` is the landmark 3.
fn integer(text: &str) -> Option<i64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
    let is_whole = !fraction.is_empty() && fraction.bytes().all(|digit| digit == b'0');
    if is_whole { whole.parse().ok() } else { None }
}

fn place(path: &Path, line: u64) -> String {
    format!("{}, line {line}", path.display())
}

fn line_of(bytes: &[u8], offset: usize) -> u64 {
    1 + bytes[..offset]
        .iter()
        .filter(|byte| **byte == b'\n')
        .count() as u64
}

fn unknown_column(
    name: &str,
    fault: impl Fn(String, &str, String) -> DetectionsError,
) -> DetectionsError {
    let name = &excerpt(name, OF_A_VALUE);
    if number(name).is_some() {
        let change = "put the header x,y above the first row".to_string();
        return fault(format!("the number {name}"), "names of columns", change);
    }
    // Similarity counts the shared start more (`cov_x` is nearer to `cov_xx` than to `x`).
    let nearest = COLUMNS
        .into_iter()
        .max_by(|a, b| {
            let (a, b) = (strsim::jaro_winkler(name, a), strsim::jaro_winkler(name, b));
            a.total_cmp(&b)
        })
        .expect("COLUMNS is not empty");
    let change = format!("rename it to {nearest} if that is meant, else remove the column");
    fault(
        format!("the unknown column {name:?}"),
        &format!("only {}", COLUMNS.join(",")),
        change,
    )
}
