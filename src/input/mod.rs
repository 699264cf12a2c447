//! Files that a user gives, as text: unpacked, bounded, decoded, and read as lines or as a table.
//!
//! [`Source`] reads any file once, from front to back, and holds no more of it than a line.
//! [`Table`] reads a CSV by the names of its columns. Detections, recordings and their truth all
//! come through these two, so that each accepts and refuses the same things.

mod error;
mod header;
mod identity;
mod kind;
mod names;
mod note;
mod record;
mod row;
mod rows;
mod source;
mod table;
#[cfg(test)]
mod tests;
mod utf16;

pub use error::{Content, InputError, Place};
pub use identity::{Identities, Identity, Numbered, identity, quoted};
pub use note::Note;
pub use row::Row;
pub use rows::Rows;
pub use source::{MAX_BYTES, MAX_LINE_BYTES, MAX_LINES, ReadSoFar, Source};
pub use table::{Column, Layout, Need, Table};
