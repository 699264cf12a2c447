//! A part of the report before it is HTML or Markdown: what both say is said once, here.
//!
//! A room that has something to add gives a [`Section`]; `sections.rs` lists them.

use std::borrow::Cow;

use super::Figure;

/// A part with a heading of its own.
pub(super) struct Section {
    /// Where links to it lead; letters and hyphens.
    pub id: Cow<'static, str>,
    /// Its heading.
    pub title: String,
    /// What stands in it.
    pub blocks: Vec<Block>,
}

/// One thing in a section.
pub(super) enum Block {
    /// A paragraph.
    Text(String),
    /// A picture, written beside the page as PNG and SVG.
    Figure(Box<Figure>),
    /// A table.
    Table(Table),
}

impl From<Figure> for Block {
    fn from(figure: Figure) -> Self {
        Self::Figure(Box::new(figure))
    }
}

/// A table of texts.
#[derive(Default)]
pub(super) struct Table {
    /// Headings of the columns.
    pub head: Vec<String>,
    /// Rows as long as the head.
    pub rows: Vec<Vec<Entry>>,
}

/// What stands in one place of a table.
#[derive(Default)]
pub(super) struct Entry {
    /// The words.
    pub text: String,
    /// Where a click leads, relative to the report's folder.
    pub href: Option<String>,
    /// Whether it stands out.
    pub is_strong: bool,
}

impl Table {
    /// With these headings.
    pub fn new(head: &[&str], rows: impl Iterator<Item = Vec<Entry>>) -> Self {
        Self {
            head: head.iter().map(|&name| name.to_owned()).collect(),
            rows: rows.collect(),
        }
    }
}

impl<T: Into<String>> From<T> for Entry {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            ..Self::default()
        }
    }
}

impl Entry {
    /// Words that lead somewhere.
    pub fn link(text: impl Into<String>, href: impl Into<String>) -> Self {
        Self {
            href: Some(href.into()),
            ..Self::from(text)
        }
    }

    /// Words that stand out.
    pub fn strong(text: impl Into<String>) -> Self {
        Self {
            is_strong: true,
            ..Self::from(text)
        }
    }
}

impl Section {
    /// A paragraph over a table; nothing if the table is empty.
    pub fn of_table(id: &'static str, title: &str, words: &str, table: Table) -> Option<Self> {
        (!table.rows.is_empty()).then(|| Self {
            id: id.into(),
            title: title.to_owned(),
            blocks: vec![Block::Text(words.to_owned()), Block::Table(table)],
        })
    }

    /// Its pictures.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.blocks.iter().filter_map(|block| match block {
            Block::Figure(figure) => Some(figure.as_ref()),
            _ => None,
        })
    }
}
