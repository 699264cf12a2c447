//! The cells of a row of a table, typed.

use super::error::{InputError, Place};
use super::identity::{Identities, is_missing};
use super::table::{Table, content};
use crate::excerpt::{OF_A_VALUE, excerpt};

/// A row of a table.
pub struct Row<'t, 'a> {
    pub(super) table: &'t mut Table<'a>,
    pub(super) line: u64,
}

impl Row<'_, '_> {
    /// The line on which it begins, from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The text of a cell; empty where the file has no such column.
    pub fn text(&self, column: usize) -> &str {
        let place = self.table.places[column];
        place.map_or("", |place| self.table.record.get(place))
    }

    /// Whether a cell is empty or says that nothing is known (nan, none, null, na).
    pub fn is_missing(&self, column: usize) -> bool {
        is_missing(self.text(column))
    }

    /// A finite number.
    ///
    /// # Errors
    /// Anything else.
    pub fn number(&mut self, column: usize) -> Result<f64, InputError> {
        if self.text(column).contains(',') {
            return self.number_with_comma(column);
        }
        let text = self.text(column);
        let value = text.parse::<f64>();
        if self.table.separator != ',' && text.contains('.') {
            self.note_decimal(column, 1)?;
        }
        match value {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(self.fault(column, "a finite number")),
            Err(_) => Err(self.fault(column, "a number")),
        }
    }

    /// A finite number, or `None` where the cell is missing.
    ///
    /// # Errors
    /// Anything else.
    pub fn optional_number(&mut self, column: usize) -> Result<Option<f64>, InputError> {
        if self.is_missing(column) {
            return Ok(None);
        }
        self.number(column).map(Some)
    }

    /// The key of an identity; `None` for an unknown one.
    ///
    /// # Errors
    /// A number that is not whole.
    pub fn identity(
        &self,
        column: usize,
        identities: &mut Identities,
    ) -> Result<Option<usize>, InputError> {
        let expected = "a whole number, a name, or nothing (or -1) for an unknown landmark";
        let key = identities.key(self.text(column));
        key.map_err(|()| self.fault(column, expected))
    }

    /// Refuses a cell.
    pub fn fault(&self, column: usize, expected: &str) -> InputError {
        let text = self.text(column);
        let got = if text.is_empty() {
            "nothing".to_owned()
        } else {
            format!("{:?}", excerpt(text, OF_A_VALUE))
        };
        self.refuse(
            column,
            &got,
            expected,
            "correct the value or remove the row",
        )
    }

    /// Refuses a cell with words of one's own.
    pub fn refuse(&self, column: usize, got: &str, expected: &str, change: &str) -> InputError {
        content(self.place(Some(column)), got, expected, change)
    }

    /// Where the row stands, or one of its cells.
    pub fn place(&self, column: Option<usize>) -> Place {
        Place {
            column: column.map(|column| self.table.layout.columns[column].name),
            ..self.table.source.place(Some(self.line))
        }
    }

    fn number_with_comma(&mut self, column: usize) -> Result<f64, InputError> {
        let text = self.text(column).to_owned();
        let is_one = text.matches(',').count() == 1 && !text.contains('.');
        if self.table.separator == ',' || !is_one {
            return Err(self.fault(column, "a number without separators of thousands"));
        }
        let Ok(value) = text.replacen(',', ".", 1).parse::<f64>() else {
            return Err(self.fault(column, "a number"));
        };
        self.note_decimal(column, 0)?;
        Ok(value)
    }

    /// Keeps in mind that numbers have decimal commas (0) or points (1), and refuses both in one
    /// file: `1,234` may then be either.
    fn note_decimal(&mut self, column: usize, which: usize) -> Result<(), InputError> {
        self.table.decimals[which].get_or_insert(self.line);
        let Some(other) = self.table.decimals[1 - which] else {
            return Ok(());
        };
        let got = format!("{:?}", excerpt(self.text(column), OF_A_VALUE));
        let mark = ["comma", "point"][1 - which];
        let expected = format!("a decimal {mark} as on line {other}");
        let change = "write all numbers with a decimal point and without separators of thousands";
        Err(self.refuse(column, &got, &expected, change))
    }
}
