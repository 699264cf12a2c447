//! One factor in words, and the file of its page.

use super::words;
use crate::results::FactorEffect;
use crate::sweep::Factor;

/// A factor's page, relative to the report's folder.
pub(super) fn file(factor: &Factor) -> String {
    format!("factors/{}.html", factor.key.name)
}

/// The largest or smallest rate of any level.
pub(super) fn extreme(effect: &FactorEffect, of: fn(f64, f64) -> f64) -> Option<f64> {
    let rates = effect.by_level.iter().flatten().map(|level| level.rate);
    rates.reduce(of)
}

/// "60 % at 10 m": a rate with the first level that has it.
pub(super) fn at(factor: &Factor, effect: &FactorEffect, rate: f64) -> String {
    let mut levels = factor.levels.iter().zip(&effect.by_level);
    let level = levels
        .find(|(_, found)| found.is_some_and(|found| found.rate == rate))
        .map(|(level, _)| words::with_unit_of(factor.key, &level.to_string()));
    format!(
        "{} at {}",
        words::percent(Some(rate)),
        level.unwrap_or_else(words::dash)
    )
}
