//! Every setting: its name, section, unit, default, check and help, in one table.
//!
//! Sweep files, command-line flags, the `settings` recorded in every output, the columns of the
//! tables and the identity of a chain all read this table, so that a setting has one name and one
//! meaning everywhere. A [`Settings`] is checked once, when a value is set; what reads it later
//! need not check again.

mod engine;
mod keys;
pub mod numbers;
mod reference;
mod typed;

pub use keys::{KEYS, Key, Kind, Section, keys_table};
pub use typed::{BurnInRule, Init, Until};

use std::fmt;

/// The value of a setting.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A whole number.
    Count(u64),
    /// A real number; finite.
    Number(f64),
    /// A text, in canonical spelling.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl Value {
    /// An order over values: numbers by size, then texts by the alphabet.
    pub fn compare(&self, other: &Self) -> std::cmp::Ordering {
        let number = |value: &Self| match value {
            Self::Count(count) => Some(*count as f64),
            Self::Number(number) => Some(*number),
            Self::Text(_) => None,
        };
        match (number(self), number(other)) {
            (Some(a), Some(b)) => a.total_cmp(&b),
            (Some(_), None) => std::cmp::Ordering::Less,
            (None, Some(_)) => std::cmp::Ordering::Greater,
            (None, None) => self.to_string().cmp(&other.to_string()),
        }
    }
}

/// A setting that cannot be: one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// No setting has this name.
    #[error("{name}: no such setting{suggestion}")]
    Unknown {
        /// What was given.
        name: String,
        /// "; did you mean sigma_o?" or nothing.
        suggestion: String,
    },
    /// The value is not of the setting's kind.
    #[error("{name}: got {got}, expected {expected}")]
    Bad {
        /// The setting.
        name: String,
        /// What was given.
        got: String,
        /// What would do.
        expected: String,
    },
}

/// "; did you mean …?" for the candidate nearest to a misspelt name, or nothing if none is near.
pub fn suggestion<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> String {
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        .filter(|(distance, candidate)| *distance <= 1 + candidate.len() / 3)
        .min()
        .map_or_else(String::new, |(_, nearest)| {
            format!("; did you mean {nearest}?")
        })
}

/// A checked value for every key of [`KEYS`].
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    values: Vec<Value>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            values: KEYS.iter().map(|key| (key.default)()).collect(),
        }
    }
}

impl Settings {
    /// Sets one value.
    ///
    /// # Errors
    /// An unknown name, or a value that is not of the setting's kind.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), SettingError> {
        let key_ix = keys::index_of(name)?;
        self.values[key_ix] = KEYS[key_ix].check(value)?;
        Ok(())
    }

    /// Sets one value from a text, as a flag gives it.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn set_text(&mut self, name: &str, text: &str) -> Result<(), SettingError> {
        let key_ix = keys::index_of(name)?;
        self.values[key_ix] = KEYS[key_ix].read(text)?;
        Ok(())
    }

    /// The value of a setting. Panics if there is no such setting: names in the code are ours.
    pub fn get(&self, name: &str) -> &Value {
        match keys::index_of(name) {
            Ok(key_ix) => &self.values[key_ix],
            Err(error) => panic!("a name in the code: {error}"),
        }
    }

    /// All settings with their keys, in the order of [`KEYS`].
    pub fn iter(&self) -> impl Iterator<Item = (&'static Key, &Value)> {
        KEYS.iter().zip(&self.values)
    }

    /// `key=value` lines of the settings that are chosen: their canonical text.
    pub fn canonical_text(&self, chosen: impl Fn(&Key) -> bool) -> String {
        let mut text = String::new();
        for (key, value) in self.iter().filter(|(key, _)| chosen(key)) {
            text.push_str(&format!("{}={value}\n", key.name));
        }
        text
    }

    /// As [`canonical_text`](Self::canonical_text), without options that are off and with the moves that `auto` stands
    /// for: what chains are named by. So an option that comes to be changes no chain that does not use it.
    pub fn identity_text(&self, chosen: impl Fn(&Key) -> bool) -> String {
        let mut named = self.clone();
        named.name_auto_moves();
        named.canonical_text(|key| {
            let is_silent = named.is_idle(key.name);
            chosen(key)
                && !is_silent
                && !(OPTIONS.contains(&key.name) && *self.get(key.name) == (key.default)())
        })
    }
}

/// Options that leave no trace while they are at their default.
const OPTIONS: [&str; 5] = [
    "optimum",
    "corner_kinds",
    "temperatures",
    "swap_interval",
    "tiles",
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The defaults with some values changed.
    pub(super) fn settings(changes: &[(&str, &str)]) -> Settings {
        let mut settings = Settings::default();
        for (name, text) in changes {
            assert_eq!(settings.set_text(name, text), Ok(()));
        }
        settings
    }

    #[test]
    fn every_default_passes_its_own_check_and_reads_back() {
        for (key, value) in Settings::default().iter() {
            assert_eq!(key.check(value), Ok(value.clone()), "{}", key.name);
            assert_eq!(
                key.read(&value.to_string()),
                Ok(value.clone()),
                "{}",
                key.name
            );
        }
        let mut names: Vec<_> = KEYS.iter().map(|key| key.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), KEYS.len(), "names are unique");
    }

    #[test]
    fn counts_may_be_written_in_scientific_notation() {
        let mut settings = Settings::default();
        for key in KEYS {
            let (least, most) = match key.kind {
                Kind::Count(least) => (least, u64::MAX),
                Kind::CountUpTo(least, most) => (least, most),
                _ => continue,
            };
            let text = if (least..=most).contains(&100) {
                ("1e2", 100)
            } else {
                ("0.8e1", 8)
            };
            assert_eq!(settings.set_text(key.name, text.0), Ok(()), "{}", key.name);
            assert_eq!(settings.count(key.name), text.1);
        }
        assert_eq!(settings.set_text("burn_in", "1e3"), Ok(()));
        assert_eq!(settings.burn_in(), BurnInRule::Fixed(1000));
    }

    #[test]
    fn an_option_that_is_off_names_no_chain() {
        let mut settings = Settings::default();
        let text = |settings: &Settings| settings.identity_text(|_| true);
        let off = text(&settings);
        for (option, on) in OPTIONS
            .into_iter()
            .zip(["bfgs", "confusion:0.1", "4", "7", "on"])
        {
            assert!(!off.contains(option));
            assert_eq!(settings.set_text(option, on), Ok(()));
            assert!(text(&settings).contains(&format!("{option}={on}\n")));
        }
        assert!(off.contains("sigma_o=1\n"));
    }

    #[test]
    fn a_chain_is_named_by_the_moves_that_auto_stands_for() {
        let text = |changes: &[(&str, &str)]| settings(changes).identity_text(|_| true);
        let explicit = ("estimator", "explicit");
        let common = ("estimator", "common");
        assert!(text(&[common]).contains("moves=split-merge=0.1,reassign=0.2,"));
        assert!(text(&[explicit]).contains("moves=site=0.35,flip=0.25,"));
        let spelt = ("moves", crate::sampler::mix::DEFAULT_EXPLICIT_MOVES);
        assert_eq!(text(&[explicit]), text(&[explicit, spelt]));
    }

    #[test]
    fn errors_say_what_was_got_and_what_would_do() {
        let mut settings = Settings::default();
        let mut message = |name: &str, text: &str| match settings.set_text(name, text) {
            Ok(()) => String::new(),
            Err(error) => error.to_string(),
        };
        assert_eq!(
            message("sigma_o", "0"),
            "sigma_o: got 0, expected a number > 0 (m)"
        );
        assert_eq!(
            message("sigma_o", "nan"),
            "sigma_o: got nan, expected a number > 0 (m); it has to be finite"
        );
        assert_eq!(
            message("sigma_0", "1"),
            "sigma_0: no such setting; did you mean sigma_o?"
        );
        assert_eq!(message("zzz", "1"), "zzz: no such setting");
        assert_eq!(
            message("importance_samples", "2.5"),
            "importance_samples: got 2.5, expected a whole number from 1 to 1000000"
        );
        assert_eq!(
            message("samples", "1e4.5"),
            "samples: got 1e4.5, expected a whole number from 1 to 1000000000000"
        );
        assert_eq!(
            message("sigma_o", "1,5"),
            "sigma_o: got 1,5, expected a number > 0 (m); write 1.5 with a decimal point"
        );
        assert_eq!(
            message("sigma_o", "1e80"),
            "sigma_o: got 1e80, expected a number > 0 (m), at most 1e75"
        );
        assert_eq!(
            message("burn_in", "1_000"),
            "burn_in: got \"1_000\", expected auto or a whole number of proposals; write 1000"
        );
        assert!(
            message("moves", "gibbs").starts_with("moves: got \"gibbs\", expected moves out of")
        );
        assert_eq!(message("sigma_o", "2"), "");
    }
}
