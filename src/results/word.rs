//! Words of a closed set that a result holds, read back from where it was written.

use serde::Deserialize;
use serde::de::{Deserializer, Error};

/// One of them. A name of its own, since what is written as a reference is read back as a loan.
pub(super) type Word = &'static str;

/// Verdicts, estimates and losses, and the states of what is measured.
const WORDS: [&str; 17] = [
    "mixes",
    "at-rest",
    "exact",
    "not-shown",
    "map",
    "binder",
    "vi",
    "defined",
    "constant",
    "stuck-disagree",
    "too-rare",
    "too-short",
    "too-few",
    "not-finite",
    "different-maps",
    "not-judged",
    "atom",
];

pub(super) fn word<'de, D: Deserializer<'de>>(from: D) -> Result<Word, D::Error> {
    let text = String::deserialize(from)?;
    let known = WORDS.into_iter().find(|word| *word == text);
    known.ok_or_else(|| D::Error::custom(format!("no such word: {text}")))
}
