//! What each factor does: response curves with interactions, and the indices of designs made for them.

use super::super::{Figure, Material, words};
use super::{label_key, short_labels};
use crate::figure::effects::Interval;
use crate::figure::factor_indices::{FactorIndices, IndexPanel, IndexRow};
use crate::figure::response_curves::{Curve, CurvePanel, ResponseCurves};
use crate::results::sensitivity::{self, Indices, Response, Sensitivity, UnitMean};
use crate::settings::Key;

/// Curves of one panel at most: of a partner with more levels every other is shown, or every third.
const MOST_CURVES: usize = 5;
/// The responses whose indices are shown, side by side.
const SHOWN: [Response; 3] = [Response::Recovery, Response::Acceptance, Response::LogEss];

/// The curves of every response, in the order of tables.
pub(in super::super) fn curves(material: Material<'_>) -> Vec<Figure> {
    let found = &material.results.sensitivity;
    let of = |response| Some(curves_of(found, response)?.0);
    found.responses().into_iter().filter_map(of).collect()
}

/// The indices, of designs made for them.
pub(in super::super) fn indices(material: Material<'_>) -> Option<Figure> {
    let found = &material.results.sensitivity;
    Some(indices_of(found, found.indices.as_ref()?).0)
}

fn interval(estimate: Option<UnitMean>) -> Option<Interval> {
    let estimate = estimate?;
    let (low, high) = estimate
        .interval
        .map_or((estimate.mean, estimate.mean), |i| (i.low, i.high));
    Some(Interval {
        low,
        estimate: estimate.mean,
        high,
    })
}

/// The factor that this one interacts with most, if chance does not explain it.
fn partner(found: &Sensitivity, response: Response, factor: usize) -> Option<usize> {
    let clear = found.clear_interactions(response).into_iter();
    let other = |(a, b): (usize, usize)| match factor {
        _ if a == factor => Some(b),
        _ if b == factor => Some(a),
        _ => None,
    };
    clear.filter_map(|row| other(row.factors)).next()
}

fn panel(found: &Sensitivity, response: Response, factor: usize) -> CurvePanel {
    let own = &found.factors[factor];
    let name = words::axis_name(own.key);
    let Some(other) = partner(found, response, factor) else {
        let mean = found.curve(response, factor);
        return CurvePanel {
            name,
            levels: short_labels(own.labels.clone()),
            by: String::new(),
            best: best(found, response, factor),
            curves: vec![Curve {
                name: String::new(),
                points: mean.iter().map(|row| interval(row.estimate)).collect(),
            }],
        };
    };
    let by = &found.factors[other];
    let pair = found.pair(response, (factor.min(other), factor.max(other)));
    let at = |level: usize, of_other: usize| {
        let wanted = if factor < other {
            (level, of_other)
        } else {
            (of_other, level)
        };
        let row = pair.iter().find(|row| row.levels == wanted)?;
        interval(row.estimate)
    };
    let step = by.labels.len().div_ceil(MOST_CURVES);
    let names = short_labels(by.labels.clone());
    let curve = |of_other: usize| Curve {
        name: names[of_other].clone(),
        points: (0..own.labels.len())
            .map(|level| at(level, of_other))
            .collect(),
    };
    CurvePanel {
        name,
        levels: short_labels(own.labels.clone()),
        by: words::axis_name(by.key),
        best: best(found, response, factor),
        curves: (0..by.labels.len()).step_by(step).map(curve).collect(),
    }
}

/// The bins of the best region, of a sampled design's recovery.
fn best(found: &Sensitivity, response: Response, factor: usize) -> Option<(usize, usize)> {
    let region = found
        .region
        .as_ref()
        .filter(|_| response == Response::Recovery)?;
    let side = region.sides.iter().find(|side| side.factor == factor)?;
    Some((side.first, side.last))
}

/// The figure, and the numbers that it is drawn from.
pub(super) fn curves_of(
    found: &Sensitivity,
    response: Response,
) -> Option<(Figure, ResponseCurves)> {
    let order: Vec<usize> = found
        .strongest(response)
        .iter()
        .map(|row| row.factor)
        .collect();
    let panels: Vec<CurvePanel> = order
        .iter()
        .map(|factor| panel(found, response, *factor))
        .collect();
    let points = || {
        panels
            .iter()
            .flat_map(|p| &p.curves)
            .flat_map(|c| c.points.iter().flatten())
    };
    points().next()?;
    let interacts = panels.iter().any(|panel| !panel.by.is_empty());
    let range = if response.is_share() && response != Response::Acceptance {
        (0.0, 1.0)
    } else {
        // Intervals of few worlds are wide; the axis is that of the estimates, with some room.
        let estimates = || points().map(|point| point.estimate);
        let low = estimates().fold(f64::INFINITY, f64::min);
        let high = estimates().fold(f64::NEG_INFINITY, f64::max);
        let room = 0.35 * (high - low).max(1e-3 * high.abs().max(1e-3));
        (
            if response.is_share() {
                0.0
            } else {
                (low - room).max(0.0)
            },
            high + room,
        )
    };
    let rows = panels
        .len()
        .div_ceil(crate::figure::grid::columns_for(panels.len())) as u32;
    let figure = ResponseCurves {
        title: String::new(),
        panels,
        value_name: response.words().to_owned(),
        range,
        percent: response.is_share(),
    };
    let others = if found.round_baseline {
        "all others at the baseline"
    } else {
        "averaged over all others"
    };
    let bins = if found.is_sampled {
        " Bins are equal shares of a range; whiskers count how the points fell, too. Shaded: the best region."
    } else {
        ""
    };
    let partner = if interacts {
        " A factor that interacts with another has a curve for each level of it: curves that are not parallel are the interaction."
    } else if found.is_sampled || found.round_baseline {
        ""
    } else {
        " No two factors act together beyond chance (5 %, Holm)."
    };
    let shown = Figure {
        file: format!("figures/response-{}", response.name().replace('_', "-")),
        caption: format!(
            "What each factor does to {}: {others}, by falling size of the largest difference. Whiskers: 95 %, Student over {}; \
             none where all agree.{bins}{partner}{}",
            name(response),
            unit(found),
            found
                .factors
                .iter()
                .map(|own| label_key(own.key.label(), &own.labels))
                .collect::<String>()
        ),
        scene: figure.page(2000, 120 + (if interacts { 560 } else { 480 }) * rows),
    };
    Some((shown, figure))
}

fn name(response: Response) -> String {
    match response {
        Response::RecoveredConverged | Response::Converged => {
            format!("share of worlds {}", response.words())
        }
        _ => response.words().to_owned(),
    }
}

fn unit(found: &Sensitivity) -> &'static str {
    if found.over_worlds {
        "worlds"
    } else {
        "chain numbers"
    }
}

/// The figure, and the numbers that it is drawn from.
pub(super) fn indices_of(found: &Sensitivity, own: &Indices) -> (Figure, FactorIndices) {
    match &own.by_response {
        sensitivity::FactorIndices::Morris(by_response) => {
            let panel = |(response, by_factor): &(Response, Vec<sensitivity::Screened>)| {
                let rows = own.factors.iter().zip(by_factor).map(|(key, screened)| {
                    let of =
                        |value: f64, i: Option<crate::diagnostics::interval::Interval>| Interval {
                            low: i.map_or(value, |i| i.low),
                            estimate: value,
                            high: i.map_or(value, |i| i.high),
                        };
                    let s = screened.screening;
                    IndexRow {
                        name: words::axis_name(key),
                        marks: vec![
                            s.map(|s| of(s.mu_star, s.mu_star_interval)),
                            s.map(|s| of(s.sigma, s.sigma_interval)),
                        ],
                        noise: s.and_then(|s| s.mu_star_of_noise),
                    }
                });
                IndexPanel {
                    name: response.words().to_owned(),
                    remark: String::new(),
                    rows: rows.collect(),
                    range: (0.0, 1.0),
                }
            };
            let shown = by_response
                .iter()
                .filter(|(response, _)| SHOWN.contains(response));
            let mut panels: Vec<IndexPanel> = shown.map(panel).collect();
            for panel in &mut panels {
                let high = marks(panel).map(|mark| mark.high).fold(0.0, f64::max);
                panel.range = (0.0, if high > 0.0 { 1.05 * high } else { 1.0 });
            }
            sort_rows(&mut panels);
            figure(
                FactorIndices {
                    title: String::new(),
                    marks: vec![
                        "μ*, mean size of the effect over the whole range".to_owned(),
                        "σ, how much it depends on where".to_owned(),
                    ],
                    panels,
                    value_name: "effect".to_owned(),
                    percent: false,
                },
                "screening",
                &format!(
                    "Morris' screening: factors by falling μ* of the first response. A μ* within the grey band is what noise alone would give. \
                     Whiskers: 95 %, bootstrap over trajectories and {}.",
                    unit(found)
                ),
            )
        }
        sensitivity::FactorIndices::Sobol(by_response) => {
            let shown = by_response
                .iter()
                .filter(|(response, ..)| SHOWN.contains(response));
            let mut panels: Vec<IndexPanel> = shown
                .map(|(response, _, found)| sobol_panel(*response, &own.factors, found.as_ref()))
                .collect();
            sort_rows(&mut panels);
            figure(
                FactorIndices {
                    title: String::new(),
                    marks: vec![
                        "first order: by itself".to_owned(),
                        "total: with all its interactions".to_owned(),
                    ],
                    panels,
                    value_name: "share of the variance".to_owned(),
                    percent: true,
                },
                "indices",
                &format!(
                    "Sobol's indices: the share of the variance over all settings that a factor explains. Noise of chains and worlds is not in \
                     them. Whiskers: 95 %, bootstrap over points and {}.",
                    unit(found)
                ),
            )
        }
    }
}

fn sobol_panel(
    response: Response,
    factors: &[&'static Key],
    found: Result<
        &crate::diagnostics::sobol_indices::SobolIndices,
        &crate::diagnostics::sobol_indices::NoIndices,
    >,
) -> IndexPanel {
    let row = |(place, key): (usize, &&'static Key)| {
        let of = |index: crate::diagnostics::sobol_indices::Index| Interval {
            low: index.interval.map_or(index.value, |i| i.low),
            estimate: index.value,
            high: index.interval.map_or(index.value, |i| i.high),
        };
        IndexRow {
            name: words::axis_name(key),
            marks: match found {
                Ok(found) => vec![Some(of(found.first[place])), Some(of(found.total[place]))],
                Err(_) => vec![None, None],
            },
            noise: None,
        }
    };
    let all = |found: &crate::diagnostics::sobol_indices::SobolIndices| {
        let others = [found.variance_of_noise, found.variance_of_worlds];
        found.variance.value + others.into_iter().flatten().sum::<f64>()
    };
    let total = found.map_or(1.0, all);
    let share = |part: f64| words::percent(Some(part.max(0.0) / total));
    let remark = match found {
        Err(reason) => format!("no indices: {}", reason.words()),
        Ok(found) => match (found.variance_of_noise, found.variance_of_worlds) {
            (Some(noise), Some(worlds)) => format!(
                "{} of all variance is between settings, {} between worlds, {} noise of chains",
                share(found.variance.value),
                share(worlds),
                share(noise)
            ),
            _ => "one world: noise counts as effect".to_owned(),
        },
    };
    IndexPanel {
        name: response.words().to_owned(),
        remark,
        rows: factors.iter().enumerate().map(row).collect(),
        range: (-0.1, 1.0),
    }
}

fn marks(panel: &IndexPanel) -> impl Iterator<Item = &Interval> {
    panel.rows.iter().flat_map(|row| row.marks.iter().flatten())
}

/// Rows of all panels by falling last mark of the first panel that has any.
fn sort_rows(panels: &mut [IndexPanel]) {
    let Some(first) = panels.iter().find(|panel| marks(panel).next().is_some()) else {
        return;
    };
    let by = usize::from(first.range.0 < 0.0);
    let size = |row: &IndexRow| {
        row.marks
            .get(by)
            .copied()
            .flatten()
            .map_or(f64::NEG_INFINITY, |m| m.estimate)
    };
    let mut order: Vec<usize> = (0..first.rows.len()).collect();
    order.sort_by(|&a, &b| size(&first.rows[b]).total_cmp(&size(&first.rows[a])));
    for panel in panels.iter_mut() {
        panel.rows = order
            .iter()
            .map(|&place| panel.rows[place].clone())
            .collect();
    }
}

fn figure(figure: FactorIndices, file: &str, caption: &str) -> (Figure, FactorIndices) {
    let n_rows = figure.panels.first().map_or(1, |panel| panel.rows.len()) as u32;
    let shown = Figure {
        file: format!("figures/{file}"),
        caption: caption.to_owned(),
        scene: figure.page(2000, 330 + 70 * n_rows),
    };
    (shown, figure)
}
