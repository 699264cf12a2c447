//! A grid of settings laid open: small multiples, interactions, and the nested-loop plot.

use super::super::{Figure, Material, words};
use super::all_cells::order_of_factors;
use super::effects::{interval, unit};
use super::{level_key, level_names, verdict_colour};
use crate::figure::nested_loop::{LoopFactor, NestedLoop};
use crate::figure::small_multiples::{MultiplePanel, Series, SmallMultiples};
use crate::results::{Verdict, marginal};
use crate::settings::Value;
use crate::sweep::{Design, Factor};

/// Cells in one nested-loop plot at most: beyond, a cell is narrower than a pixel.
const MAX_LOOP_CELLS: usize = 2000;
/// Lines of a panel at most, as many as there are colours.
const MAX_SERIES: usize = 8;
/// Panels at most.
const MAX_PANELS: usize = 24;

/// The four factors that matter most: the first along the axis, the second as lines, the others as
/// panels.
pub(super) fn recovery(material: Material<'_>) -> Option<Figure> {
    let (sweep, results) = (material.sweep, material.results);
    if !matches!(sweep.design, Design::Grid(_)) || results.effects.len() < 3 {
        return None;
    }
    let order = order_of_factors(material);
    let factor = |place: usize| &sweep.factors[order[place]];
    let n_columns = factor(2).levels.len();
    let n_rows = if order.len() > 3 {
        factor(3).levels.len()
    } else {
        1
    };
    if n_columns * n_rows > MAX_PANELS || n_columns > 6 || factor(1).levels.len() > MAX_SERIES {
        return None;
    }
    let mut panels = Vec::new();
    for row in 0..n_rows {
        for column in &factor(2).levels {
            let mut at: Vec<(usize, &Value)> = vec![(order[2], column)];
            let mut title = named(factor(2), column);
            if order.len() > 3 {
                let level = &factor(3).levels[row];
                at.push((order[3], level));
                title = format!("{title}, {}", named(factor(3), level));
            }
            panels.push(MultiplePanel {
                title,
                series_name: factor(1).key.label().to_owned(),
                series: series(material, order[0], order[1], &at),
            });
        }
    }
    let figure = SmallMultiples {
        title: String::new(),
        x_name: words::axis_name(factor(0).key),
        levels: level_names(factor(0)),
        panels,
        n_columns,
        value_name: "Recovery rate".to_owned(),
    };
    let rest = if order.len() > 4 {
        ", averaged over the other factors"
    } else {
        ""
    };
    Some(Figure {
        file: "figures/recovery-multiples".to_owned(),
        caption: format!(
            "Recovery rate by the factors that matter most{rest}. Whiskers: 95 %, Student over {}; none where all agree.{}",
            unit(material),
            level_key(&sweep.factors)
        ),
        scene: figure.page(
            (600 * n_columns as u32).clamp(1400, 2600),
            (120 + 480 * n_rows as u32).min(2600),
        ),
    })
}

/// A factor with each other one: where lines are not parallel, the two interact.
pub(in crate::report) fn interactions(material: Material<'_>, factor_ix: usize) -> Option<Figure> {
    let sweep = material.sweep;
    if !matches!(sweep.design, Design::Grid(_)) {
        return None;
    }
    let others = order_of_factors(material)
        .into_iter()
        .filter(|other| *other != factor_ix && sweep.factors[*other].levels.len() <= MAX_SERIES);
    let panel = |other: usize| MultiplePanel {
        title: format!("with {}", sweep.factors[other].key.label()),
        series_name: words::axis_name(sweep.factors[other].key),
        series: series(material, factor_ix, other, &[]),
    };
    let panels: Vec<MultiplePanel> = others.take(MAX_PANELS).map(panel).collect();
    if panels.is_empty() {
        return None;
    }
    let factor = &sweep.factors[factor_ix];
    let n_columns = panels.len().min(3);
    let n_rows = panels.len().div_ceil(n_columns) as u32;
    let figure = SmallMultiples {
        title: String::new(),
        x_name: words::axis_name(factor.key),
        levels: level_names(factor),
        panels,
        n_columns,
        value_name: "Recovery rate".to_owned(),
    };
    Some(Figure {
        file: format!("figures/factors/{}-with-others", factor.key.name),
        caption: format!(
            "Recovery rate by {} and each other factor, averaged over the rest: where lines are not parallel, the two \
             interact. Whiskers: 95 %, Student over {}; none where all agree.{}",
            factor.key.label(),
            unit(material),
            level_key(&sweep.factors)
        ),
        scene: figure.page(2000, 100 + 520 * n_rows),
    })
}

fn named(factor: &Factor, level: &Value) -> String {
    let place = factor.levels.iter().position(|own| own == level);
    let name = place.map_or_else(
        || words::level(level),
        |place| level_names(factor).swap_remove(place),
    );
    let value = words::with_unit_of(factor.key, &name);
    format!("{} {value}", factor.key.label())
}

/// A line for each level of `second` over the levels of `first`, with more levels fixed.
fn series(
    material: Material<'_>,
    first: usize,
    second: usize,
    fixed: &[(usize, &Value)],
) -> Vec<Series> {
    let (sweep, chains) = (material.sweep, &material.results.chains);
    let line = |(level, name): (&Value, String)| {
        let rate = |along: &Value| {
            let mut at = vec![(first, along), (second, level)];
            at.extend(fixed);
            marginal(sweep, chains, &at).as_ref().map(interval)
        };
        Series {
            name,
            rates: sweep.factors[first].levels.iter().map(rate).collect(),
        }
    };
    let names = level_names(&sweep.factors[second]);
    (sweep.factors[second].levels.iter().zip(names))
        .map(line)
        .collect()
}

/// Every cell of a grid along one axis.
pub(super) fn nested_loop(material: Material<'_>) -> Option<Figure> {
    let (sweep, results) = (material.sweep, material.results);
    let n = sweep.cells.len();
    if !matches!(sweep.design, Design::Grid(_))
        || results.effects.is_empty()
        || !(8..=MAX_LOOP_CELLS).contains(&n)
    {
        return None;
    }
    let order = order_of_factors(material);
    let level_of = |cell: usize, factor: usize| {
        let factor = &sweep.factors[factor];
        let value = sweep.cells[cell].settings.get(factor.key.name);
        factor.levels.iter().position(|level| level == value)
    };
    let place = |cell: usize| -> Vec<Option<usize>> {
        order.iter().map(|&factor| level_of(cell, factor)).collect()
    };
    let mut cells: Vec<usize> = (0..n).collect();
    cells.sort_by_key(|&cell| place(cell));
    let loops = order.iter().map(|&factor| LoopFactor {
        name: words::axis_name(sweep.factors[factor].key),
        levels: level_names(&sweep.factors[factor]),
        level_of: cells
            .iter()
            .map(|&cell| level_of(cell, factor).unwrap_or(0))
            .collect(),
    });
    let rate = |&cell: &usize| {
        let shown = interval(results.cells[cell].recovery.as_ref()?);
        Some((shown.low, shown.estimate, shown.high))
    };
    let gated = |&cell: &usize| results.cells[cell].worlds.recovered_share();
    let figure = NestedLoop {
        title: String::new(),
        rates: cells.iter().map(rate).collect(),
        gated: cells.iter().map(gated).collect(),
        names: [
            "Recovery rate".to_owned(),
            "its 95 % interval".to_owned(),
            Verdict::Recovered.words().to_owned(),
        ],
        factors: loops.collect(),
        gated_colour: verdict_colour(Verdict::Recovered),
    };
    let height = 760 + 60 * order.len() as u32;
    Some(Figure {
        file: "figures/nested-loop".to_owned(),
        caption: format!(
            "Every cell in the order of nested loops, the factor that matters most outermost: where the recovery rate \
             follows a staircase, that factor matters.{}",
            level_key(&sweep.factors)
        ),
        scene: figure.page(2200, height),
    })
}
