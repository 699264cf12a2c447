//! A CSV with a header, read row by row by the names of its columns.
//!
//! Names are compared without regard to case and surrounding space. The separator is a comma, a
//! semicolon, a tab or `|`, whichever makes the header name the most known columns; where it is no
//! comma, numbers may have decimal commas. Other columns are left out. Both are told in a note.
//! Lines without any text between rows do not count; a first line `sep=;` sets the separator.

use super::error::{Content, InputError, Place};
use super::header::{header_name, separator_set};
use super::names;
use super::note::Note;
use super::record::Record;
use super::row::Row;
use super::source::{MAX_LINE_BYTES, Source};

/// A column of a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name in the header.
    pub name: &'static str,
    /// Whether it must be there.
    pub need: Need,
}

/// Whether a column must be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Always; with the unit for messages.
    Required(&'static str),
    /// It may be left out.
    Optional,
}

/// The columns of a kind of table. Rows are asked for cells by the places of columns in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// What a row is, in the plural.
    pub rows: &'static str,
    /// All columns.
    pub columns: &'static [Column],
    /// A table of more rows is refused.
    pub max_rows: usize,
}

impl Layout {
    /// The names of the columns that must be there.
    pub(super) fn required(&self) -> Vec<&'static str> {
        let required = self.columns.iter().filter(|column| column.is_required());
        required.map(|column| column.name).collect()
    }
}

impl Column {
    /// A column that must be there, with its unit.
    pub const fn required(name: &'static str, unit: &'static str) -> Self {
        let need = Need::Required(unit);
        Self { name, need }
    }

    /// A column that may be left out.
    pub const fn optional(name: &'static str) -> Self {
        let need = Need::Optional;
        Self { name, need }
    }

    fn is_required(&self) -> bool {
        matches!(self.need, Need::Required(_))
    }
}

/// Separators that are tried, the usual one first, with their names for messages.
const SEPARATORS: [(char, &str); 4] = [
    (',', "commas"),
    (';', "semicolons"),
    ('\t', "tabs"),
    ('|', "\"|\""),
];

/// A table that is being read.
pub struct Table<'a> {
    pub(super) source: Source<'a>,
    pub(super) layout: Layout,
    pub(super) separator: char,
    header_line: u64,
    pub(super) n_fields: usize,
    /// Parallel to the columns of the layout.
    pub(super) places: Vec<Option<usize>>,
    /// Columns that are not read, as notes name them.
    pub(super) left_out: Vec<String>,
    /// The first line with a decimal comma, and the first with a decimal point.
    pub(super) decimals: [Option<u64>; 2],
    pub(super) record: Record,
    bytes: Vec<u8>,
    line: u64,
    n_rows: usize,
}

impl<'a> Table<'a> {
    /// Reads the header.
    ///
    /// # Errors
    /// A file without a header, or with one that lacks a column or has it twice.
    pub fn new(source: Source<'a>, layout: Layout) -> Result<Self, InputError> {
        let mut table = Self {
            source,
            layout,
            separator: ',',
            header_line: 1,
            n_fields: 0,
            places: Vec::new(),
            left_out: Vec::new(),
            decimals: [None; 2],
            record: Record::default(),
            bytes: Vec::new(),
            line: 1,
            n_rows: 0,
        };
        let mut set = None;
        let header = loop {
            if !table.next_text()? {
                let expected = format!("a header with the columns {}", layout.required().join(","));
                let place = table.source.place(Some(1));
                return Err(content(place, "a blank file", &expected, "add one"));
            }
            let text = table.text()?.to_owned();
            match separator_set(&text) {
                Some(separator) => set = Some(separator),
                None => break text,
            }
        };
        table.header_line = table.line;
        let tried = SEPARATORS.iter().map(|(separator, _)| *separator);
        let score = |separator: &char| {
            let record = Record::of(&header, *separator);
            let known = layout.columns.iter().filter(|column| {
                let mut names = record.iter().enumerate();
                names.any(|(ix, name)| names::is_same(header_name(ix, name), column.name))
            });
            (known.count(), record.len())
        };
        // The last of equals is the greatest: the comma comes last.
        table.separator = set.unwrap_or(tried.rev().max_by_key(score).unwrap_or(','));
        let text = table.text()?.to_owned();
        table.begin_record(&text)?;
        table.read_header()?;
        Ok(table)
    }

    /// Refuses the header.
    pub fn bad_header(&self, got: String, expected: &str, change: &str) -> InputError {
        let place = self.source.place(Some(self.header_line));
        content(place, &got, expected, change)
    }

    /// Whether the file has a column.
    pub fn has(&self, column: usize) -> bool {
        self.places[column].is_some()
    }

    /// The next row; `None` at the end.
    ///
    /// # Errors
    /// A row with more or fewer cells than the header, that is no text, or beyond the limits.
    pub fn next_row(&mut self) -> Result<Option<Row<'_, 'a>>, InputError> {
        if !self.next_text()? {
            return Ok(None);
        }
        self.n_rows += 1;
        if self.n_rows > self.layout.max_rows {
            let Layout { rows, max_rows, .. } = self.layout;
            let got = format!("more than {max_rows} {rows}");
            let change = "check that it is the right file, or cut it into parts";
            return Err(self.source.fault(got, "at most that", change));
        }
        let bytes = std::mem::take(&mut self.bytes);
        let text = String::from_utf8(bytes).map_err(|_| self.not_utf8(self.line))?;
        let line = self.line;
        self.begin_record(&text)?;
        self.bytes = text.into_bytes();
        if self.record.len() != self.n_fields {
            let got = format!("{} fields", self.record.len());
            let expected = format!("{} as in the header", self.n_fields);
            let change = match self.separator {
                ',' => "write one field per column, separated by commas, with a decimal point",
                _ => "write one field per column, each followed by the separator of the header",
            };
            return Err(content(
                self.source.place(Some(line)),
                &got,
                &expected,
                change,
            ));
        }
        Ok(Some(Row { table: self, line }))
    }

    /// What was left out or put up with so far.
    pub fn notes(&self) -> Vec<Note> {
        let mut notes = Vec::new();
        if !self.left_out.is_empty() {
            let (n, most) = (self.left_out.len(), 10);
            let mut list = self.left_out[..n.min(most)].join(", ");
            if n > most {
                list += &format!(" and {} more", n - most);
            }
            let columns = if n == 1 { "column" } else { "columns" };
            notes.push(Note {
                count: Some(n),
                what: format!("{columns} left out: {list}"),
            });
        }
        if self.separator != ',' {
            let decimals = match self.decimals {
                [Some(_), _] => ", decimals with commas",
                _ => "",
            };
            let name = self.separator_name();
            notes.push(Note::plain(format!("fields separated by {name}{decimals}")));
        }
        notes
    }

    /// What errors call the file.
    pub fn path(&self) -> &std::path::Path {
        self.source.path()
    }

    /// Refuses a file that has no rows.
    pub fn no_rows(&self) -> InputError {
        let rows = self.layout.rows;
        let got = format!("no {rows}");
        self.source.fault(
            got,
            "at least one row below the header",
            "add a row for each",
        )
    }

    fn separator_name(&self) -> &'static str {
        let known = SEPARATORS.iter().find(|(c, _)| *c == self.separator);
        known.map_or("another character", |(_, name)| name)
    }

    /// Moves to the next line that holds anything; false at the end.
    fn next_text(&mut self) -> Result<bool, InputError> {
        loop {
            self.bytes.clear();
            let Some(line) = self.source.next_line(&mut self.bytes)? else {
                return Ok(false);
            };
            if !self.bytes.trim_ascii().is_empty() {
                self.line = line;
                return Ok(true);
            }
        }
    }

    /// The line as text.
    fn text(&self) -> Result<&str, InputError> {
        std::str::from_utf8(&self.bytes).map_err(|_| self.not_utf8(self.line))
    }

    fn not_utf8(&self, line: u64) -> InputError {
        let place = self.source.place(Some(line));
        let got = "bytes that are not UTF-8";
        content(place, got, "UTF-8 text", "save the file as UTF-8")
    }

    /// Splits a row that begins on this line, and takes in more lines while a quote is open.
    fn begin_record(&mut self, text: &str) -> Result<(), InputError> {
        self.record.clear();
        let mut is_whole = self.record.push_line(text, self.separator);
        let mut more = Vec::new();
        while !is_whole {
            more.clear();
            let next = self.source.next_line(&mut more)?;
            let Some(line) = next.filter(|_| self.record.n_bytes() <= MAX_LINE_BYTES) else {
                let place = self.source.place(Some(self.line));
                let got = "a quote that is not closed";
                return Err(content(
                    place,
                    got,
                    "both quotes of a field",
                    "close it or remove it",
                ));
            };
            let text = std::str::from_utf8(&more).map_err(|_| self.not_utf8(line))?;
            is_whole = self.record.push_line(text, self.separator);
        }
        self.record.close();
        Ok(())
    }
}

pub(super) fn content(place: Place, got: &str, expected: &str, change: &str) -> InputError {
    Content {
        place,
        got: got.to_owned(),
        expected: expected.to_owned(),
        change: change.to_owned(),
    }
    .into()
}
