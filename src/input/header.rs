//! The header of a table: which column stands where, and what is wrong with one that will not do.

use super::error::InputError;
use super::names;
use super::table::{Need, Table};
use crate::excerpt::{OF_A_VALUE, excerpt};

impl Table<'_> {
    /// Finds the known columns, and keeps the names of the others for a note.
    pub(super) fn read_header(&mut self) -> Result<(), InputError> {
        let found: Vec<String> = self
            .record
            .iter()
            .enumerate()
            .map(|(ix, name)| header_name(ix, name).to_owned())
            .collect();
        self.n_fields = found.len();
        self.places = vec![None; self.layout.columns.len()];
        let mut unknown: Vec<&str> = Vec::new();
        for (ix, name) in found.iter().enumerate() {
            let columns = self.layout.columns.iter();
            let Some(known) = columns.clone().position(|c| names::is_same(name, c.name)) else {
                unknown.push(name);
                continue;
            };
            if self.places[known].replace(ix).is_some() {
                let name = self.layout.columns[known].name;
                let change = format!("keep one column {name}");
                let got = format!("{name} twice in the header");
                return Err(self.bad_header(got, "each column once", &change));
            }
        }
        let columns = self.layout.columns.iter().zip(&self.places);
        let absent: Vec<&str> = columns
            .filter(|(_, place)| place.is_none())
            .map(|(column, _)| column.name)
            .collect();
        let required = self.layout.required();
        if let Some(missing) = required.iter().find(|name| absent.contains(name)) {
            return Err(self.lacks(missing, &found, &unknown, &absent));
        }
        self.left_out = unknown
            .iter()
            .map(|name| match names::meant(name, &absent) {
                _ if name.is_empty() => "one without a name".to_owned(),
                Some(meant) => format!("{} (rename it to {meant} if that is meant)", shown(name)),
                None => shown(name),
            })
            .collect();
        Ok(())
    }

    /// Why a header without this column will not do.
    fn lacks(
        &self,
        missing: &str,
        found: &[String],
        unknown: &[&str],
        absent: &[&str],
    ) -> InputError {
        let columns = self.layout.required().join(",");
        let expected = format!("the columns {columns}");
        let list = excerpt(
            &found.join(",").replace(char::is_control, " "),
            2 * OF_A_VALUE,
        );
        let got = format!("{list} in the header");
        let wants_place = ["x", "y"].contains(&missing) || missing.starts_with("robot_");
        if wants_place && unknown.iter().any(|name| names::is_degrees_of_earth(name)) {
            let got = format!("{list} in the header, which are degrees of latitude and longitude");
            let expected = format!("the columns {columns} in metres");
            let change = "project the positions to metres first, for example to UTM";
            return self.bad_header(got, &expected, change);
        }
        if let Some(number) = found.iter().find(|name| name.parse::<f64>().is_ok()) {
            let got = format!("the number {} in the header", excerpt(number, OF_A_VALUE));
            let change = format!("put the header {columns} above the first row");
            return self.bad_header(got, "names of columns", &change);
        }
        let spaced: Vec<&str> = found[0].split_whitespace().collect();
        let is_spaced = |name: &&&str| spaced.iter().any(|word| names::is_same(word, name));
        if found.len() == 1 && spaced.len() > 1 && absent.iter().any(|name| is_spaced(&name)) {
            let got = format!("{list} in the header, separated by spaces");
            let change = "separate the fields by commas";
            return self.bad_header(got, &expected, change);
        }
        let unit = self.layout.columns.iter().find(|c| c.name == missing);
        let unit = unit.map_or("", |column| match column.need {
            Need::Required(unit) => unit,
            Need::Optional => "",
        });
        let missing_now = [missing];
        let meant = unknown
            .iter()
            .find(|name| names::meant(name, &missing_now).is_some());
        let change = match meant {
            Some(name) => format!("rename {} to {missing}", shown(name)),
            None => format!("add the column {missing} ({unit})"),
        };
        self.bad_header(got, &expected, &change)
    }
}

/// A name as a message repeats it: on one line, and not too long.
fn shown(name: &str) -> String {
    excerpt(&name.replace(char::is_control, " "), OF_A_VALUE)
}

/// The name in a header: `numpy.savetxt` writes `# x,y`.
pub(super) fn header_name(ix: usize, name: &str) -> &str {
    let name = name.trim();
    if ix == 0 {
        name.trim_start_matches('#').trim()
    } else {
        name
    }
}

/// What a line `sep=;` sets, as Excel writes and reads it.
pub(super) fn separator_set(line: &str) -> Option<char> {
    let line = line.trim_start().trim_matches('"');
    let (key, value) = line.split_once('=')?;
    let mut value = value.chars();
    let separator = value.next()?;
    (key.eq_ignore_ascii_case("sep") && value.next().is_none()).then_some(separator)
}
