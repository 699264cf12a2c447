//! Values of a sweep file: from TOML to checked settings, with messages that repeat what is written.

use super::error::SweepError;
use super::written::Written;
use crate::settings::{Key, Kind, SettingError, Value, numbers};

/// A sweep file as its values are read from it.
pub(super) struct Source<'a> {
    /// Its path, for messages.
    pub path: &'a str,
    /// Its numbers as they are written.
    pub written: &'a Written,
}

impl Source<'_> {
    /// The value of a setting in a section; `place` is where it stands in the file.
    pub fn checked(
        &self,
        key: &Key,
        value: &toml::Value,
        section: &str,
        place: &str,
    ) -> Result<Value, SweepError> {
        let checked = match value {
            toml::Value::Integer(_) | toml::Value::Float(_) => {
                let written = self.number(value, place);
                key.read(&readable(value, &written))
                    .map_err(|error| repeating(error, &written))
            }
            toml::Value::String(text) => key
                .check(&Value::Text(text.clone()))
                .map_err(|error| without_quotes(error, key, text)),
            other => return Err(self.no_value(other, key.name, section)),
        };
        checked.map_err(|error| SweepError::setting(self.path, section, error))
    }

    /// A text; a number is one too, as it is written.
    pub fn text(
        &self,
        value: &toml::Value,
        name: &str,
        section: &str,
        place: &str,
    ) -> Result<String, SweepError> {
        match value {
            toml::Value::Integer(_) | toml::Value::Float(_) => Ok(self.number(value, place)),
            toml::Value::String(text) => Ok(text.clone()),
            other => Err(self.no_value(other, name, section)),
        }
    }

    /// A whole number that is no setting.
    pub fn whole(&self, value: &toml::Value, name: &str, place: &str) -> Result<u64, String> {
        let written = self.number(value, place);
        numbers::whole(&readable(value, &written))
            .filter(|_| value.is_integer() || value.is_float())
            .ok_or_else(|| format!("{name}: got {written}, expected a whole number"))
    }

    /// A value as it is written.
    pub fn number(&self, value: &toml::Value, place: &str) -> String {
        self.written
            .number(place)
            .map_or_else(|| value.to_string(), str::to_owned)
    }

    fn no_value(&self, value: &toml::Value, name: &str, section: &str) -> SweepError {
        SweepError::Setting {
            path: self.path.to_owned(),
            section: section.to_owned(),
            what: format!(
                "{name}: got {} {value}, expected a number or a text",
                value.type_str()
            ),
        }
    }
}

/// A TOML number as a flag would have it: TOML also knows `1_000` and `0xff`.
fn readable(value: &toml::Value, written: &str) -> String {
    match value {
        toml::Value::Integer(integer) => integer.to_string(),
        _ => written.replace('_', ""),
    }
}

fn repeating(error: SettingError, written: &str) -> SettingError {
    match error {
        SettingError::Bad { name, expected, .. } => SettingError::Bad {
            name,
            got: written.to_owned(),
            expected,
        },
        unknown @ SettingError::Unknown { .. } => unknown,
    }
}

fn without_quotes(error: SettingError, key: &Key, text: &str) -> SettingError {
    match error {
        SettingError::Bad {
            name,
            got,
            expected,
        } if !matches!(key.kind, Kind::Text(_)) && key.read(text).is_ok() => SettingError::Bad {
            name,
            got,
            expected: format!("{expected}; write {text} without quotes"),
        },
        other => other,
    }
}
