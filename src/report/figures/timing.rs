//! Effective draws per second against what a chain costs, cell by cell.

use super::super::Figure;
use super::verdict_colour;
use crate::figure::scatter::{Scatter, ScatterPoint};
use crate::results::Verdict;
use crate::results::timing::CellCost;

/// Of the cells whose times are known; `None` without any.
pub(in crate::report) fn ess_against_cost(costs: &[CellCost]) -> Option<Figure> {
    let point = |cost: &CellCost| {
        Some(ScatterPoint {
            // A clock may not see a chain of microseconds at all.
            x: cost.seconds_per_chain?.max(1e-6),
            y: cost.ess_per_second.filter(|ess| *ess > 0.0),
            category: cost.verdict as usize,
        })
    };
    let points: Vec<ScatterPoint> = costs.iter().filter_map(point).collect();
    if points.is_empty() {
        return None;
    }
    let category = |verdict: Verdict| (verdict.words().to_owned(), verdict_colour(verdict));
    let figure = Scatter {
        title: String::new(),
        names: (
            "seconds per chain".to_owned(),
            "effective draws per second".to_owned(),
        ),
        points,
        categories: Verdict::ALL.into_iter().map(category).collect(),
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
