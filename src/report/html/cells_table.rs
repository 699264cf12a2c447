//! The table of all cells: sorted, filtered and paged by a script, its first rows there without one.
//!
//! A page of ten thousand rows takes seconds to lay out, so only the first [`N_STATIC`] are HTML; all of them
//! are data, which the script draws a hundred at a time.

use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::super::pages::{cell_file, choice_words};
use super::super::{Material, faults, words};
use super::{badge, css_colour};
use crate::results::{CellVerdict, Fault};
use crate::settings::Value as Setting;
use crate::sweep::Factor;

/// Rows that need no script, and rows that the script draws at a time.
const N_STATIC: usize = 100;
const SCRIPT: &str = include_str!("table.js");
/// Columns of shares, which conditions are asked of in per cent.
const PERCENT: [&str; 5] = [
    "recovery",
    "worlds converged",
    "truth mass",
    "acceptance",
    "chains agree",
];

/// One place of a row: what it is sorted by, if not by its words, and the words.
struct Field {
    key: Option<Value>,
    text: String,
}

pub(super) fn cells_table(material: Material<'_>, has_pages: bool) -> Markup {
    let (sweep, results) = (material.sweep, material.results);
    let headings = headings(material);
    let rows: Vec<(usize, Vec<Field>)> = results
        .ranking()
        .iter()
        .map(|&cell| (cell, fields(material, cell)))
        .collect();
    let n_with = |verdict: CellVerdict| {
        results
            .cells
            .iter()
            .filter(|c| c.verdict == verdict)
            .count()
    };
    html! {
        section id="cells" {
            h2 { "Cells" }
            p.soft {
                @if has_pages { (choice_words(sweep.cells.len())) }
                (words::interval_kinds(&results.cells))
                " From the most successful: worlds recovered with converged chains first. Click a heading to sort."
            }
            p.help.soft {
                "Filter by words and by conditions on columns, as in " code { (example(material)) } "."
            }
            div.tools {
                input #filter type="search" placeholder=(example(material)) aria-label="Filter the cells by words and conditions";
                " "
                select #verdict aria-label="Show cells with this verdict" {
                    option value="" { "every verdict" }
                    @for verdict in CellVerdict::ALL {
                        option value=(verdict.place()) { (verdict.words()) ": " (n_with(verdict)) }
                    }
                }
                " " span #shown.soft role="status" { }
            }
            div.wide tabindex="0" { table.sortable {
                thead { tr { @for name in &headings { th scope="col" { button type="button" { (name) } } } } }
                tbody { @for (cell, fields) in rows.iter().take(N_STATIC) { (static_row(material, *cell, fields, has_pages)) } }
            } }
            button #more type="button" hidden { "Show more cells" }
            noscript { p.soft { "The first " (N_STATIC) " cells at most; all are in " a href="cells.csv" { "cells.csv" } "." } }
            script #cells-data type="application/json" { (PreEscaped(data(material, &rows, has_pages))) }
            script { (PreEscaped(SCRIPT)) }
        }
    }
}

/// A condition on the first setting that is a number.
fn example(material: Material<'_>) -> String {
    let mut factors = material.sweep.factors.iter();
    let is_number = |factor: &&Factor| !matches!(factor.levels[0], Setting::Text(_));
    let words = factors.find(is_number).map_or_else(String::new, |factor| {
        let level = &factor.levels[factor.levels.len() / 2];
        format!("{} = {level} ", factor.key.name)
    });
    format!("{words}recovery >= 80")
}

fn headings(material: Material<'_>) -> Vec<String> {
    let factors = material.sweep.factors.iter();
    let factors = factors.map(|factor| words::axis_name(factor.key));
    let results = [
        "verdict",
        "recovery",
        "worlds converged",
        faults::SPLIT,
        "truth mass",
        "ARI",
        "M",
        "acceptance",
        "burn-in",
        "chains agree",
        "distance to exact",
        "never settled",
        "failed",
        "missing",
    ];
    std::iter::once("cell".to_owned())
        .chain(factors)
        .chain(results.map(str::to_owned))
        .collect()
}

fn fields(material: Material<'_>, cell_ix: usize) -> Vec<Field> {
    let cell = &material.sweep.cells[cell_ix];
    let result = &material.results.cells[cell_ix];
    let words = |text: String| Field { key: None, text };
    let number = |value: Option<f64>, text: String| Field {
        // What is undefined is sorted last, whichever way.
        key: Some(value.map_or(Value::Null, |value| json!(value))),
        text,
    };
    let count = |n: usize| number(Some(n as f64), n.to_string());
    let incorrect = if cell.settings.faults().is_empty() {
        ""
    } else {
        " (incorrect)"
    };
    let mut fields = vec![words(format!("{}{incorrect}", cell.title()))];
    for factor in &material.sweep.factors {
        let value = cell.settings.get(factor.key.name);
        let place = || factor.levels.iter().position(|level| level == value);
        // Numbers by themselves, so that conditions can be asked of them; the rest by its place.
        let key = match value {
            Setting::Number(number) => Some(*number),
            Setting::Count(count) => Some(*count as f64),
            Setting::Text(_) => place().map(|place| place as f64),
        };
        fields.push(number(key, value.to_string()));
    }
    fields.extend([
        number(Some(result.verdict.place() as f64), result.verdict_words()),
        number(
            result.recovery.map(|rate| rate.rate),
            words::rate(result.recovery),
        ),
        number(result.converged_share(), words::gate(result)),
        number(
            result.faults.map(|faults| faults.n(Fault::Model) as f64),
            faults::split(result.faults),
        ),
        number(result.truth_mass, words::percent(result.truth_mass)),
        number(
            result.adjusted_rand_index,
            words::number(result.adjusted_rand_index, 2),
        ),
        number(result.n_sets, words::number(result.n_sets, 1)),
        number(
            result.acceptance_rate,
            words::percent(result.acceptance_rate),
        ),
        number(result.burn_in, words::number(result.burn_in, 0)),
        number(result.map_agreement, words::percent(result.map_agreement)),
        number(
            result.exact.largest,
            words::distance(result.exact.largest, result.exact.high),
        ),
        number(
            Some(result.n_never_settled as f64),
            format!("{}/{}", result.n_never_settled, result.n_chains),
        ),
        count(result.n_failed),
        count(result.n_missing),
    ]);
    fields
}

fn static_row(material: Material<'_>, cell: usize, fields: &[Field], has_pages: bool) -> Markup {
    let verdict_at = 1 + material.sweep.factors.len();
    let verdict = material.results.cells[cell].verdict;
    html! {
        tr { @for (place, field) in fields.iter().enumerate() {
            @if place == 0 && has_pages { td { a href=(cell_file(material, cell)) { (field.text) } } }
            @else if place == verdict_at { td { (badge(verdict, &field.text)) } }
            @else if place > verdict_at { td.number { (field.text) } }
            @else { td { (field.text) } }
        } }
    }
}

/// All rows as JSON that may stand in a page: `<` cannot end the script it stands in.
fn data(material: Material<'_>, rows: &[(usize, Vec<Field>)], has_pages: bool) -> String {
    let colours: Vec<String> = CellVerdict::ALL
        .iter()
        .map(|&own| css_colour(own))
        .collect();
    let n_factors = material.sweep.factors.len();
    // All columns but the cell, settings in words, and the verdict hold numbers.
    let is_text = |factor: &Factor| matches!(factor.levels[0], Setting::Text(_));
    let mut numeric: Vec<usize> = (0..n_factors)
        .filter(|place| !is_text(&material.sweep.factors[*place]))
        .map(|place| place + 1)
        .collect();
    let n_fields = rows.first().map_or(0, |(_, fields)| fields.len());
    numeric.extend(n_factors + 2..n_fields);
    let headings = headings(material);
    let names = headings.iter().enumerate().map(|(place, heading)| {
        let mut names = vec![heading.to_lowercase()];
        let factor = place
            .checked_sub(1)
            .and_then(|place| material.sweep.factors.get(place));
        names.extend(factor.map(|factor| factor.key.name.to_owned()));
        names
    });
    let is_share = |heading: &&str| PERCENT.contains(heading);
    let percent = headings.iter().enumerate();
    let percent = percent.filter(|(_, heading)| is_share(&heading.as_str()));
    let percent: Vec<usize> = percent.map(|(place, _)| place).collect();
    let field = |field: &Field| match &field.key {
        None => json!(field.text),
        Some(key) => json!([key, field.text]),
    };
    let row = |(cell, fields): &(usize, Vec<Field>)| {
        json!({
            "href": has_pages.then(|| cell_file(material, *cell)),
            "fields": fields.iter().map(field).collect::<Vec<Value>>(),
        })
    };
    json!({
        "step": N_STATIC,
        "verdict": 1 + material.sweep.factors.len(),
        "colours": colours,
        "names": names.collect::<Vec<Vec<String>>>(),
        "numeric": numeric,
        "percent": percent,
        "rows": rows.iter().map(row).collect::<Vec<Value>>(),
    })
    .to_string()
    .replace('<', "\\u003c")
}
