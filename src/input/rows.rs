//! A CSV whose columns are not known beforehand: the header as it is, and row by row.
//!
//! The separator is a comma, a semicolon, a tab or `|`, whichever cuts the header into the most
//! fields. Lines without any text between rows do not count.

use super::error::{Content, InputError};
use super::record::Record;
use super::source::Source;

const SEPARATORS: [char; 4] = ['|', '\t', ';', ','];

/// A table that is being read.
pub struct Rows<'a> {
    source: Source<'a>,
    separator: char,
    header: Vec<String>,
    record: Record,
    bytes: Vec<u8>,
    line: u64,
}

impl<'a> Rows<'a> {
    /// Reads the header.
    ///
    /// # Errors
    /// A file without one.
    pub fn new(source: Source<'a>) -> Result<Self, InputError> {
        let mut rows = Self {
            source,
            separator: ',',
            header: Vec::new(),
            record: Record::default(),
            bytes: Vec::new(),
            line: 1,
        };
        if !rows.next_text()? {
            return Err(rows.refuse("a blank file", "a header and rows", "write both"));
        }
        let header = String::from_utf8_lossy(&rows.bytes).into_owned();
        let n_fields = |separator: &char| Record::of(&header, *separator).len();
        // The last of equals is the greatest: the comma comes last.
        rows.separator = SEPARATORS.into_iter().max_by_key(n_fields).unwrap_or(',');
        let record = Record::of(&header, rows.separator);
        rows.header = record.iter().map(str::to_owned).collect();
        Ok(rows)
    }

    /// The names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Goes to the next row; false at the end.
    ///
    /// # Errors
    /// A row with more or fewer cells than the header, that is no text, or beyond the limits.
    pub fn next_row(&mut self) -> Result<bool, InputError> {
        if !self.next_text()? {
            return Ok(false);
        }
        let text = String::from_utf8_lossy(&self.bytes);
        self.record.clear();
        self.record.push_line(&text, self.separator);
        self.record.close();
        if self.record.len() != self.header.len() {
            let got = format!("{} fields", self.record.len());
            let expected = format!("{} as in the header", self.header.len());
            return Err(self.refuse(&got, &expected, "write one field per column"));
        }
        Ok(true)
    }

    /// A cell of the present row.
    pub fn cell(&self, column: usize) -> &str {
        self.record.get(column)
    }

    /// Refuses the present line.
    pub fn refuse(&self, got: &str, expected: &str, change: &str) -> InputError {
        Content {
            place: self.source.place(Some(self.line)),
            got: got.to_owned(),
            expected: expected.to_owned(),
            change: change.to_owned(),
        }
        .into()
    }

    fn next_text(&mut self) -> Result<bool, InputError> {
        loop {
            self.bytes.clear();
            let Some(line) = self.source.next_line(&mut self.bytes)? else {
                return Ok(false);
            };
            self.line = line;
            if !self.bytes.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }
}
