//! Numbers of a sweep file as they are written there: what is read is the text, so that `1e4` is a
//! whole number and a message repeats what the user wrote.

use std::collections::HashMap;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The numbers of a file, by their place, as in `design.factors.sigma_o.0`.
#[derive(Debug, Default)]
pub(super) struct Written(HashMap<String, String>);

impl Written {
    /// Of a text that is TOML; of another there are none.
    pub fn of(text: &str) -> Self {
        let mut written = Self::default();
        if let Ok(table) = DeTable::parse(text) {
            written.visit_table(text, "", table.get_ref());
        }
        written
    }

    /// The number at a place.
    pub fn number(&self, place: &str) -> Option<&str> {
        self.0.get(place).map(String::as_str)
    }

    fn visit_table(&mut self, text: &str, place: &str, table: &DeTable<'_>) {
        for (name, value) in table {
            let place = match place {
                "" => name.get_ref().to_string(),
                _ => format!("{place}.{}", name.get_ref()),
            };
            self.visit(text, place, value);
        }
    }

    fn visit(&mut self, text: &str, place: String, value: &Spanned<DeValue<'_>>) {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => {
                let number = text.get(value.span()).unwrap_or_default();
                self.0.insert(place, number.to_owned());
            }
            DeValue::Array(array) => {
                for (index, value) in array.iter().enumerate() {
                    self.visit(text, format!("{place}.{index}"), value);
                }
            }
            DeValue::Table(table) => self.visit_table(text, &place, table),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_their_place() {
        let text = "a = 1e4\n[b.c]\nd = [2.50, 'x', 0xff, { low = +3 }]\n[[e]]\n[[e]]\nf = 1_000\n";
        let written = Written::of(text);
        for (place, number) in [
            ("a", "1e4"),
            ("b.c.d.0", "2.50"),
            ("b.c.d.2", "0xff"),
            ("b.c.d.3.low", "+3"),
            ("e.1.f", "1_000"),
        ] {
            assert_eq!(written.number(place), Some(number), "{place}");
        }
        assert_eq!(written.number("b.c.d.1"), None);
        assert_eq!(Written::of("a = ").number("a"), None);
    }
}
