//! Chains of label vectors that another program drew: files → traces.
//!
//! A draw gives each of N items a label; items with one label share a set. Labels are whole numbers
//! or names, and need not be canonical. Files are read from front to back, and of a draw only what
//! a [trace](crate::chain::Trace) keeps of it stays in memory.

mod collector;
mod columns;
mod csv;
mod json;
#[cfg(test)]
mod tests;

pub use collector::{Collector, LabelChain, LabelChains, Refused};
pub use columns::{Columns, Items, MAX_WEIGHT, weight_of};
pub use csv::labels_of;

use crate::input::{InputError, Source};

/// Reads the chains of a CSV or JSON file into a collector.
///
/// CSV: a header, then one row for each draw ([`Columns`]). JSON: an array chain × draw × item, or
/// draw × item; or an object that has such an array as `labels`, or as `labels` in `posterior`, as
/// ArviZ writes it.
///
/// # Errors
/// A file that cannot be read, or whose content will not do.
pub fn read(mut source: Source<'_>, collector: &mut Collector) -> Result<(), InputError> {
    let path = source.path().display().to_string();
    collector.begin_file(&path);
    let start = source.start()?.trim_ascii_start();
    if start.starts_with(b"[") || start.starts_with(b"{") {
        json::read(source, collector)
    } else {
        csv::read(source, collector)
    }
}
