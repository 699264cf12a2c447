//! The page of one factor: what each of its levels does, and how it plays with the others.

use maud::{Markup, html};

use super::super::pages::cell_file;
use super::super::{Figure, Material, knob, words};
use super::{badge, page, picture};
use crate::results::{FactorEffect, Verdict, verdicts_by_level};
use crate::sweep::Factor;

/// The page; its pictures lie beside it.
pub(in crate::report) fn factor_page(
    material: Material<'_>,
    effect: &FactorEffect,
    shown: &[Figure],
) -> String {
    let (sweep, factor) = (material.sweep, &material.sweep.factors[effect.factor]);
    let name = words::axis_name(factor.key);
    let body = html! {
        p { a href="../index.html#factors" { "← " (sweep.title) } }
        h1 { (name) }
        p.soft { (factor.key.help) ": " code { (factor.key.name) } " in a sweep file, " code { "--" (factor.key.flag()) } " on the command line." }
        p.answer { (answer(material, factor, effect)) }
        (levels(material, effect))
        @for figure in shown { (picture(figure, "../")) }
    };
    page(&format!("{name} · {}", sweep.title), &body)
}

fn answer(material: Material<'_>, factor: &Factor, effect: &FactorEffect) -> String {
    use super::super::factors::{at, extreme};
    let ends = extreme(effect, f64::min).zip(extreme(effect, f64::max));
    match ends {
        Some((low, high)) if high > low => format!(
            "Recovery goes from {} to {}: a change of {}{}.",
            at(factor, effect, low),
            at(factor, effect, high),
            words::points(effect.range),
            match knob::knob(material, effect.factor) {
                Some(knob) if knob.is_told() =>
                    format!(", more than chance explains ({})", knob.words()),
                Some(knob) => format!(", no more than chance may explain ({})", knob.words()),
                None => ", of which one unit cannot say whether it is chance".to_owned(),
            }
        ),
        Some((low, _)) => format!(
            "It does not change the recovery rate: {} at every level.",
            words::percent(Some(low))
        ),
        None => "Whether it changes the recovery rate is not known.".to_owned(),
    }
}

/// Every level with its rate, its worlds by verdict (zeros too) and the cell to use.
fn levels(material: Material<'_>, effect: &FactorEffect) -> Markup {
    let (sweep, results) = (material.sweep, material.results);
    let factor = &sweep.factors[effect.factor];
    let verdicts = verdicts_by_level(sweep, &results.cells, effect.factor);
    let best_at = |level| {
        let is_at = |cell: &usize| sweep.cells[*cell].settings.get(factor.key.name) == level;
        results.ranking().iter().copied().find(is_at)
    };
    let rows = factor.levels.iter().zip(&effect.by_level).zip(&verdicts);
    html! {
        div.wide tabindex="0" { table.counts {
            thead { tr {
                th { "level" } th { "recovery rate" } th { "share recovered and converged" }
                @for verdict in Verdict::ALL { th { (badge(verdict, verdict.words())) } }
                th { "most successful cell" }
            } }
            tbody { @for ((level, rate), verdicts) in rows { tr {
                td { b { (words::with_unit_of(factor.key, &level.to_string())) } }
                td.rate { (words::rate(*rate)) }
                td.number { (words::percent(verdicts.recovered_share())) }
                @for verdict in Verdict::ALL { td.number { (verdicts.n(verdict)) } }
                td { @if let Some(cell) = best_at(level) {
                    a href=(format!("../{}", cell_file(material, cell))) { (sweep.cells[cell].title()) }
                } }
            } } }
        } }
        p.soft { "The counts are of the worlds of all cells at that level." }
    }
}
