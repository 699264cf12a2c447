//! The answers of sampled designs: the best region, Morris' screening and Sobol's indices.

use super::{Finding, knows_truth, listed, measured, outcome};
use crate::diagnostics::morris::Screening;
use crate::diagnostics::sobol_indices::{Index, SobolIndices};
use crate::report::{Material, words};
use crate::results::sensitivity::{FactorIndices, Response};
use crate::settings::Key;

use super::effects::headline_response;

/// Settings that are written out with their numbers.
const MOST_NAMED: usize = 3;

/// "Recovery is highest for radius D 6–50 m and σₒ 0.3–0.9 m: 85 % …, against 30 % elsewhere".
pub(super) fn region(material: Material<'_>) -> Option<Finding> {
    let found = &material.results.sensitivity;
    let region = found.region.as_ref()?;
    let side = |side: &crate::results::sensitivity::Side| {
        let own = &found.factors[side.factor];
        let (first, last) = (&own.labels[side.first], &own.labels[side.last]);
        let range = match (first.split_once('–'), last.split_once('–')) {
            (Some((low, _)), Some((_, high))) => format!("{low} to {high}"),
            _ if side.first == side.last => first.clone(),
            _ => format!("{first} to {last}"),
        };
        format!(
            "{} {}",
            own.key.label(),
            words::with_unit_of(own.key, &range)
        )
    };
    let sides: Vec<String> = region.sides.iter().map(side).collect();
    let inside = region.inside;
    let interval = inside.interval.map_or_else(String::new, |i| {
        format!(
            " (95\u{a0}% interval {} to {})",
            words::plain_points(i.low),
            words::percent(Some(i.high))
        )
    });
    let text = format!(
        "Recovery is highest for {}: {}{interval} over the {} settings there, against {} elsewhere; \
         a grid inside this region is the next sweep.",
        listed(&sides),
        words::percent(Some(inside.mean)),
        region.cells.len(),
        words::percent(region.outside.map(|own| own.mean))
    );
    Some(Finding::new("Where", text))
}

/// Which settings Morris' screening tells from noise.
pub(super) fn screening(material: Material<'_>) -> [Option<Finding>; 5] {
    let response = headline_response(material);
    let outcome = Some(outcome::finding(material));
    let Some((keys, rows)) = screened(material, response) else {
        return [outcome, None, None, None, None];
    };
    let mut own: Vec<(&Key, Screening)> = (keys.iter().zip(rows))
        .filter_map(|(key, row)| Some((*key, row?)))
        .collect();
    own.sort_by(|a, b| b.1.mu_star.total_cmp(&a.1.mu_star));
    let what = measured(knows_truth(material));
    let matters = |row: &&(&Key, Screening)| row.1.exceeds_noise == Some(true);
    let clear: Vec<&(&Key, Screening)> = own.iter().filter(matters).collect();
    let others: Vec<String> = (own.iter())
        .filter(|row| !matters(row))
        .map(|(key, _)| key.label().to_owned())
        .collect();
    let size = |(key, row): &&(&Key, Screening)| {
        let interval = row.mu_star_interval.map_or_else(String::new, |i| {
            let (low, high) = (words::plain_points(i.low), words::plain_points(i.high));
            format!(", 95\u{a0}% interval {low} to {high}")
        });
        format!("{} ({}{interval})", key.label(), words::points(row.mu_star))
    };
    let named: Vec<String> = clear.iter().take(MOST_NAMED).map(size).collect();
    let more = clear.len().saturating_sub(MOST_NAMED);
    let text = match clear.len() {
        0 => format!("No setting changes {what} by more than noise."),
        n => format!(
            "{n} of {} settings change {what} by more than noise; mean size of the change over the \
             whole range: {}{}.",
            own.len(),
            listed(&named),
            if more > 0 {
                format!(", then {more} more")
            } else {
                String::new()
            }
        ),
    };
    let inert = (!others.is_empty()).then(|| {
        let text = format!(
            "Not told from noise: {}; leave {} at the default and drop {} from the next sweep.",
            listed(&others),
            them(others.len()),
            them(others.len())
        );
        Finding::new("What does not", text)
    });
    let uneven: Vec<String> = (clear.iter())
        .filter(|(_, row)| row.sigma >= row.mu_star)
        .map(|(key, _)| key.label().to_owned())
        .collect();
    let depends = (!uneven.is_empty()).then(|| {
        let text = format!(
            "The effect of {} changes with the other settings (σ at least as large as μ*): look at \
             {} together, on a grid or by Sobol’s indices.",
            listed(&uneven),
            them(uneven.len())
        );
        Finding::new("What depends", text)
    });
    [
        Some(Finding::new("What matters", text)),
        inert,
        depends,
        outcome,
        outcome::faults(material),
    ]
}

fn them(n: usize) -> &'static str {
    if n == 1 { "it" } else { "them" }
}

type ScreenedRows<'a> = (&'a [&'static Key], Vec<Option<Screening>>);

/// The elementary effects of a response, by setting.
pub(in crate::report) fn screened(
    material: Material<'_>,
    response: Response,
) -> Option<ScreenedRows<'_>> {
    let indices = material.results.sensitivity.indices.as_ref()?;
    let FactorIndices::Morris(by_response) = &indices.by_response else {
        return None;
    };
    let (_, rows) = by_response.iter().find(|(own, _)| *own == response)?;
    let rows = rows.iter().map(|row| row.screening).collect();
    Some((&indices.factors, rows))
}

/// How much of the variance each setting explains.
pub(super) fn indices(material: Material<'_>) -> [Option<Finding>; 5] {
    let outcome = Some(outcome::finding(material));
    let response = headline_response(material);
    let what = measured(knows_truth(material));
    let Some(indices) = &material.results.sensitivity.indices else {
        return [outcome, None, None, None, None];
    };
    let FactorIndices::Sobol(by_response) = &indices.by_response else {
        return [outcome, None, None, None, None];
    };
    let own = by_response.iter().find(|(own, ..)| *own == response);
    let found = match own {
        Some((.., Ok(found))) => found,
        Some((.., Err(reason))) => {
            let text = format!("There are no indices of {what}: {}.", reason.words());
            let finding = Some(Finding::new("What matters", text));
            return [finding, outcome, outcome::faults(material), None, None];
        }
        None => return [outcome, None, None, None, None],
    };
    let [share, little] = explained(found, &indices.factors, what);
    [
        share,
        little,
        together(found),
        outcome,
        outcome::faults(material),
    ]
}

fn explained(found: &SobolIndices, keys: &[&'static Key], what: &str) -> [Option<Finding>; 2] {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by(|&a, &b| found.total[b].value.total_cmp(&found.total[a].value));
    // Only what its interval keeps away from 0 is named as an effect.
    let is_upheld = |index: &Index| index.interval.is_some_and(|i| i.low > 0.0);
    let (clear, others): (Vec<usize>, Vec<usize>) = order
        .into_iter()
        .partition(|&place| is_upheld(&found.total[place]));
    let share = |index: &Index| {
        // Estimates of a share may lie a little beyond it.
        let cut = |x: f64| x.clamp(0.0, 1.0);
        let interval = index.interval.map_or_else(String::new, |i| {
            let (low, high) = (words::plain_points(cut(i.low)), cut(i.high));
            format!(" ({low} to {})", words::percent(Some(high)))
        });
        format!("{}{interval}", words::percent(Some(cut(index.value))))
    };
    let named: Vec<String> = (clear.iter().take(MOST_NAMED))
        .map(|&place| {
            format!(
                "{} {} by itself and {} with its interactions",
                keys[place].label(),
                share(&found.first[place]),
                share(&found.total[place])
            )
        })
        .collect();
    let text = if named.is_empty() {
        format!("No setting’s share of the variance of {what} is told from 0.")
    } else {
        format!(
            "Shares of the variance of {what} between settings, with 95\u{a0}% intervals: {}.",
            listed(&named)
        )
    };
    let others: Vec<String> = (others.iter())
        .map(|&place| format!("{} ({})", keys[place].label(), share(&found.total[place])))
        .collect();
    let little = (!others.is_empty()).then(|| {
        let text = format!(
            "Not told from 0, interactions included: {}.",
            listed(&others)
        );
        Finding::new("What does not", text)
    });
    [Some(Finding::new("What matters", text)), little]
}

/// What settings explain only together, and how much of all variance is theirs.
fn together(found: &SobolIndices) -> Option<Finding> {
    let total: f64 = found.total.iter().map(|index| index.value.max(0.0)).sum();
    let joint = if total > 1.1 {
        format!(
            "The shares with interactions sum to {}, more than 100\u{a0}%, so settings act jointly",
            words::percent(Some(total))
        )
    } else {
        "The shares with interactions sum to about 100\u{a0}%, so settings hardly act jointly"
            .to_owned()
    };
    let noise = found.variance_of_noise.map_or_else(String::new, |noise| {
        let all = noise + found.variance.value + found.variance_of_worlds.unwrap_or(0.0);
        format!(
            "; {} of all variance is between settings, the rest between worlds and chains",
            words::percent(Some(found.variance.value / all))
        )
    });
    Some(Finding::new("Jointly", format!("{joint}{noise}.")))
}
