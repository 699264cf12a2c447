//! Effective draws per second against what a chain costs, cell by cell.

use super::super::{Figure, Material};
use super::{level_key, level_names, verdict_colour};
use crate::diagnostics::student::UnitMean;
use crate::figure::effects::Interval;
use crate::figure::factor_indices::{FactorIndices, IndexPanel, IndexRow};
use crate::figure::scatter::{Scatter, ScatterPoint};
use crate::results::CellVerdict;
use crate::results::timing::{CellCost, LevelRate};

/// Of the cells whose times are known; `None` without any.
pub(in crate::report) fn ess_against_cost(costs: &[CellCost]) -> Option<Figure> {
    let point = |cost: &CellCost| {
        Some(ScatterPoint {
            // A clock may not see a chain of microseconds at all.
            x: cost.seconds_per_chain?.max(1e-6),
            y: cost.ess_per_second.filter(|ess| *ess > 0.0),
            category: cost.verdict.place(),
        })
    };
    let points: Vec<ScatterPoint> = costs.iter().filter_map(point).collect();
    if points.is_empty() {
        return None;
    }
    let category = |verdict: CellVerdict| (verdict.words().to_owned(), verdict_colour(verdict));
    let figure = Scatter {
        title: String::new(),
        names: (
            "seconds per chain".to_owned(),
            "effective draws per second".to_owned(),
        ),
        points,
        categories: CellVerdict::ALL.into_iter().map(category).collect(),
        strip_name: "no ESS".to_owned(),
    };
    Some(Figure {
        file: "figures/timing-ess".to_owned(),
        caption: "Effective draws of ln target per second of wall-clock time against the time of a chain, a point for each cell \
                  by its verdict; cells whose chains change too seldom for an effective sample size stand in the strip. A cell that \
                  gives many draws per second of the wrong posterior gives nothing: look at the verdict first."
            .to_owned(),
        scene: figure.page(1800, 1000),
    })
}

/// Effective draws per second at each level of a factor, of M and of ln target.
pub(in crate::report) fn ess_by_level(
    material: Material<'_>,
    factor_ix: usize,
    rates: &[Option<LevelRate>],
) -> Option<Figure> {
    let factor = &material.sweep.factors[factor_ix];
    let highest = rates.iter().flatten().flat_map(|rate| {
        let top = |found: &UnitMean| found.interval.map_or(found.mean, |i| i.high);
        [top(&rate.n_sets), top(&rate.ln_target)]
    });
    let highest = highest.fold(0.0, f64::max);
    if highest <= 0.0 {
        return None;
    }
    let panel = |name: &str, what: fn(&LevelRate) -> &UnitMean| {
        let interval = |rate: &LevelRate| {
            let found = what(rate);
            let ends = found.interval.map(|i| (i.low.max(0.0), i.high));
            let (low, high) = ends.unwrap_or((found.mean, found.mean));
            Interval {
                low,
                estimate: found.mean,
                high,
            }
        };
        let row = |(name, rate): (String, &Option<LevelRate>)| IndexRow {
            name,
            marks: vec![rate.as_ref().map(interval)],
            noise: None,
        };
        IndexPanel {
            name: name.to_owned(),
            remark: String::new(),
            rows: level_names(factor)
                .into_iter()
                .zip(rates)
                .map(row)
                .collect(),
            range: (0.0, highest),
        }
    };
    let figure = FactorIndices {
        title: String::new(),
        marks: vec!["mean over worlds with its 95 % interval".to_owned()],
        panels: vec![
            panel("M", |rate| &rate.n_sets),
            panel("ln target", |rate| &rate.ln_target),
        ],
        value_name: "effective draws per second".to_owned(),
        percent: false,
    };
    Some(Figure {
        file: format!("figures/timing-by-{}", factor.key.name),
        caption: format!(
            "Effective draws per second of wall-clock time by {}, of M and of ln target, with 95 % intervals over worlds.{}",
            factor.key.label(),
            level_key([factor])
        ),
        scene: figure.page(2000, 300 + 90 * rates.len() as u32),
    })
}
