//! Draws in a CSV.

use super::columns::{Columns, Items, MAX_WEIGHT, weight_of};
use super::{Collector, Refused};
use crate::input::{InputError, Rows, Source};
use crate::partition::Topology;

pub(super) fn read(source: Source<'_>, collector: &mut Collector) -> Result<(), InputError> {
    let mut rows = Rows::new(source)?;
    let names = || rows.header().iter().map(String::as_str);
    let Some(columns) = Columns::of(names()) else {
        let got = names().collect::<Vec<_>>().join(",");
        let change = "add the column labels, or one column for each item";
        return Err(rows.refuse(&got, "columns with labels", change));
    };
    while rows.next_row()? {
        let draw = draw(&rows, &columns);
        let added = draw.and_then(|(topology, weight, ln_target)| {
            let chain = columns.chain.map_or("", |ix| rows.cell(ix));
            collector.push(chain, &topology, (weight, ln_target))
        });
        if let Err(Refused {
            got,
            expected,
            change,
        }) = added
        {
            return Err(rows.refuse(&got, &expected, change));
        }
    }
    Ok(())
}

fn draw(rows: &Rows<'_>, columns: &Columns) -> Result<(Topology, u64, f64), Refused> {
    let refused = |got: &str, expected: &str, change| Refused {
        got: format!("{got:?}"),
        expected: expected.to_owned(),
        change,
    };
    let weight = match columns.weight.map(|ix| rows.cell(ix)) {
        None => 1,
        Some(text) => weight_of(text).ok_or_else(|| {
            let expected = format!("a weight, a whole number from 1 to {MAX_WEIGHT}");
            refused(text, &expected, "write how many steps the draw stands for")
        })?,
    };
    let ln_target = match columns.ln_target.map(|ix| rows.cell(ix)) {
        None | Some("") => 0.0,
        Some(text) => text
            .parse()
            .ok()
            .filter(|x: &f64| !x.is_nan())
            .ok_or_else(|| refused(text, "a number as ln_target", "leave the column out"))?,
    };
    let labels: Vec<&str> = match &columns.items {
        Items::Together(ix) => labels_of(rows.cell(*ix)).collect(),
        Items::Apart(places) => places.iter().map(|ix| label(rows.cell(*ix))).collect(),
    };
    if labels.contains(&"") {
        let change = "give every item a label in every draw";
        return Err(refused("", "a label", change));
    }
    Ok((Topology::canonical(&labels), weight, ln_target))
}

/// The labels in a text such as `0,0,1` or `[0 0 1]`.
pub fn labels_of(text: &str) -> impl Iterator<Item = &str> {
    let between = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '[' | ']');
    text.split(between)
        .filter(|part| !part.is_empty())
        .map(label)
}

/// Whole numbers are written with a decimal point by programs that know no others.
fn label(cell: &str) -> &str {
    cell.strip_suffix(".0").unwrap_or(cell)
}
