//! Text files as lines of numbers, and the one way in which they are refused.

use super::error::ImportError;
use crate::input::{InputError, Source};

/// A whole number; some programs write it as 14.000.
pub(super) fn whole(text: &str) -> Option<i64> {
    if let Ok(value) = text.parse::<i64>() {
        return Some(value);
    }
    let value = text.parse::<f64>().ok()?;
    // Above 2⁵³ a float no longer says which whole number is meant.
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}

/// One line of fields between white space.
#[derive(Clone, Debug)]
pub(super) struct Line<'a> {
    path: &'a str,
    /// From 1.
    pub number: u64,
    pub fields: Vec<&'a str>,
}

/// A text that is read line by line: no more of it is held at a time.
pub(super) struct TextLines<'a> {
    source: Source<'a>,
    bytes: Vec<u8>,
    text: String,
    number: u64,
}

impl<'a> TextLines<'a> {
    pub fn new(source: Source<'a>) -> Self {
        Self {
            source,
            bytes: Vec::new(),
            text: String::new(),
            number: 0,
        }
    }

    /// Moves to the next line; false at the end. Bytes that are no text can only stand in
    /// comments: elsewhere they are no numbers.
    pub fn advance(&mut self) -> Result<bool, InputError> {
        self.bytes.clear();
        let Some(number) = self.source.next_line(&mut self.bytes)? else {
            return Ok(false);
        };
        self.number = number;
        self.text.clear();
        self.text.push_str(&String::from_utf8_lossy(&self.bytes));
        Ok(true)
    }

    /// The line, if it holds something.
    pub fn line<'b>(&'b self, path: &'b str) -> Option<Line<'b>> {
        fields(&self.text, self.number, path)
    }
}

fn fields<'a>(line: &'a str, number: u64, path: &'a str) -> Option<Line<'a>> {
    let line = line.split(['#', '%']).next().unwrap_or_default();
    let fields: Vec<&str> = line.split_whitespace().collect();
    (!fields.is_empty()).then_some(Line {
        path,
        number,
        fields,
    })
}

/// The lines that hold something, comments (`#` or `%` to the end of the line) taken off.
pub(super) fn lines<'a>(text: &'a str, path: &'a str) -> impl Iterator<Item = Line<'a>> {
    let numbered = text.lines().enumerate();
    numbered.filter_map(move |(ix, line)| fields(line, ix as u64 + 1, path))
}

impl Line<'_> {
    /// Refuses a line of another number of fields.
    pub fn expect_fields(&self, counts: &[usize], names: &'static str) -> Result<(), ImportError> {
        if counts.contains(&self.fields.len()) {
            return Ok(());
        }
        Err(ImportError::Fields {
            path: self.path.to_owned(),
            line: self.number,
            got: self.fields.len(),
            expected: names,
        })
    }

    /// Refuses the field of this place.
    pub fn bad(&self, place: usize, column: &'static str, expected: &'static str) -> ImportError {
        let got = self.fields.get(place).copied().unwrap_or_default();
        ImportError::Value {
            path: self.path.to_owned(),
            line: self.number,
            column,
            got: got.chars().take(40).collect(),
            expected,
        }
    }

    /// Refuses some fields from a place on together: all numbers of a matrix.
    pub fn bad_span(
        &self,
        place: usize,
        n_fields: usize,
        column: &'static str,
        expected: &'static str,
    ) -> ImportError {
        let fields = self.fields.iter().skip(place).take(n_fields);
        let fields: Vec<String> = fields.map(|f| f.chars().take(40).collect()).collect();
        ImportError::Value {
            path: self.path.to_owned(),
            line: self.number,
            column,
            got: fields.join(" "),
            expected,
        }
    }

    /// N finite numbers from a place on.
    pub fn numbers<const N: usize>(&self, first: usize) -> Result<[f64; N], ImportError> {
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.number(first + k, "values")?;
        }
        Ok(values)
    }

    /// A finite number.
    pub fn number(&self, place: usize, column: &'static str) -> Result<f64, ImportError> {
        let field = self.fields.get(place).copied().unwrap_or_default();
        match field.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.bad(place, column, "a finite number")),
        }
    }

    /// A whole number.
    pub fn whole(&self, place: usize, column: &'static str) -> Result<i64, ImportError> {
        let field = self.fields.get(place).copied().unwrap_or_default();
        whole(field).ok_or_else(|| self.bad(place, column, "a whole number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_tabs_and_blank_lines_are_no_fields() {
        let text = "# a\r\n 1 \t 2.50 \r\n\r\n% b\n3\t4 # five\n";
        let found: Vec<_> = lines(text, "a.dat").map(|l| (l.number, l.fields)).collect();
        assert_eq!(found, [(2, vec!["1", "2.50"]), (5, vec!["3", "4"])]);
    }

    #[test]
    fn whole_numbers_may_wear_a_fraction_of_nothing() {
        let whole = |text: &'static str| {
            let line = lines(text, "a").next().expect("a line");
            line.whole(0, "id").map_err(|error| error.to_string())
        };
        assert_eq!(whole("14"), Ok(14));
        assert_eq!(whole("14.000"), Ok(14));
        assert_eq!(whole("-9223372036854775808"), Ok(i64::MIN));
        for bad in ["14.5", "1e300", "nan", "inf", "x"] {
            let expected = format!(
                "a, line 1, column id: got {bad:?}, expected a whole number; correct the row"
            );
            assert_eq!(whole(bad), Err(expected));
        }
    }
}
