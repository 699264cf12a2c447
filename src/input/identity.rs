//! Identities of landmarks as tables have them: whole numbers, or names.

use std::collections::HashMap;

/// What a cell of identities says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Identity {
    /// Nothing: the cell is empty, says so in a word, or holds a negative number, as −1 for
    /// clutter.
    Unknown,
    /// A whole number from 0 on.
    Number(i64),
    /// Anything else that is no number.
    Name,
}

/// Whether a cell says that nothing is known: empty, or what programs write instead of nothing.
pub(super) fn is_missing(cell: &str) -> bool {
    const WORDS: [&str; 7] = ["nan", "none", "null", "na", "n/a", "<na>", "nat"];
    cell.is_empty() || WORDS.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Reads a cell; `None` for a number that is not whole.
pub fn identity(cell: &str) -> Option<Identity> {
    if is_missing(cell) {
        return Some(Identity::Unknown);
    }
    match whole(cell) {
        Some(number) if number < 0 => Some(Identity::Unknown),
        Some(number) => Some(Identity::Number(number)),
        None if cell.parse::<f64>().is_ok() => None,
        None => Some(Identity::Name),
    }
}

/// Table programs turn integer columns with gaps into floating point: `3.0` is the number 3.
fn whole(cell: &str) -> Option<i64> {
    if let Ok(value) = cell.parse::<i64>() {
        return Some(value);
    }
    let value = cell.parse::<f64>().ok()?;
    // Above 2⁵³ a float no longer says which whole number is meant.
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}

/// The identities of a column, gathered row by row.
///
/// If all are whole numbers they stay what they are. If one is a name, all are names, and are
/// numbered from 0 in the order in which they first appear.
#[derive(Clone, Debug, Default)]
pub struct Identities {
    key_of: HashMap<String, usize>,
    /// In order of first appearance: the text, and its number if it is one.
    seen: Vec<(String, Option<i64>)>,
}

/// What the keys of [`Identities::key`] stand for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbered {
    /// The number of each key.
    pub numbers: Vec<i64>,
    /// The name of each number from 0 on; empty if the column holds numbers.
    pub names: Vec<String>,
}

impl Identities {
    /// A key for what a cell says, the same for the same identity; `None` for an unknown one.
    ///
    /// # Errors
    /// A number that is not whole: `Err(())` says no more, as only the caller knows where it
    /// stands.
    #[expect(clippy::result_unit_err, reason = "the caller knows the place")]
    pub fn key(&mut self, cell: &str) -> Result<Option<usize>, ()> {
        let number = match identity(cell).ok_or(())? {
            Identity::Unknown => return Ok(None),
            Identity::Number(number) => Some(number),
            Identity::Name => None,
        };
        let text = number.map_or_else(|| cell.to_owned(), |number| number.to_string());
        if let Some(key) = self.key_of.get(&text) {
            return Ok(Some(*key));
        }
        let key = self.seen.len();
        self.key_of.insert(text.clone(), key);
        self.seen.push((text, number));
        Ok(Some(key))
    }

    /// What the keys stand for, once all rows are in.
    pub fn finish(self) -> Numbered {
        let numbers: Option<Vec<i64>> = self.seen.iter().map(|(_, number)| *number).collect();
        match numbers {
            Some(numbers) => Numbered {
                numbers,
                names: Vec::new(),
            },
            None => Numbered {
                numbers: (0..self.seen.len() as i64).collect(),
                names: self.seen.into_iter().map(|(text, _)| text).collect(),
            },
        }
    }
}

/// A name as a cell of a CSV.
pub fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
