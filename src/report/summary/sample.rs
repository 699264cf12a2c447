//! What `ptm sample` found, in lines for a terminal.

use super::{answers_line, convergence_lines, estimate_lines, fitted, topology_lines};
use crate::dataset::DataSet;
use crate::diagnostics::pareto::MAX_PARETO_K;
use crate::results::sample::SampleResult;
use crate::run::{ChainOutcome, TemperingOutcome};

/// What a person wants to know first, in lines of at most `width` columns.
pub fn sample_summary(
    (result, outcomes): (&SampleResult, &[&ChainOutcome]),
    data: &DataSet,
    name: &str,
    width: usize,
) -> String {
    let mut lines = Vec::new();
    let n_steps = outcomes.first().map_or(0, |outcome| outcome.n_steps);
    lines.push(format!(
        "{name}: {} detections, {} chains of {n_steps} proposals",
        data.detections.len(),
        outcomes.len(),
    ));
    lines.push(format!(
        "time        {:.2} s, {:.0} proposals/s",
        result.seconds, result.proposals_per_second
    ));
    for fault in &result.incorrect {
        lines.push(format!("INCORRECT   {fault}"));
    }
    for (number, outcome) in outcomes.iter().enumerate().take(4) {
        let rates = outcome.moves.iter().map(|row| {
            let rate = 100.0 * row.accepted as f64 / row.proposed as f64;
            format!("{} {rate:.2} %", row.kind)
        });
        let burn_in = match outcome.burn_in {
            Some(n) => format!("burn-in {n}"),
            None => format!("no burn-in: {}", outcome.burn_in_reason),
        };
        let rates: Vec<String> = rates.collect();
        lines.push(format!(
            "chain {:<5} accepted {:.2} %, {burn_in} ({})",
            number + 1,
            100.0 * outcome.acceptance_rate,
            rates.join(", ")
        ));
        if let Some(ladder) = &outcome.tempering {
            lines.push(ladder_line(ladder));
        }
    }
    if outcomes.len() > 4 {
        lines.push(format!(
            "            … and {} more chains",
            outcomes.len() - 4
        ));
    }
    lines.push(format!(
        "sets M      {:.3} on average",
        result.expected_number_of_sets
    ));
    lines.extend(topology_lines(
        &result.topologies,
        (result.n_topologies, result.truncated),
    ));
    if let Some(importance) = &result.importance {
        let tail = match importance.pareto_k {
            Some(k) if k > MAX_PARETO_K => format!("; Pareto k {k:.2}: NOT to be trusted"),
            Some(k) => format!("; Pareto k {k:.2}"),
            None => String::new(),
        };
        lines.push(format!(
            "importance  R = {} samples count as {:.1} at the MAP topology{tail}",
            result.settings["importance_samples"], importance.effective_samples
        ));
    }
    lines.extend(convergence_lines(result.convergence.as_ref()));
    lines.extend(estimate_lines(&result.estimates));
    lines.extend(answers_line(&result.representatives));
    if let Some(truth) = &data.truth {
        let recovered = outcomes
            .iter()
            .filter(|outcome| outcome.recovered == Some(true))
            .count();
        let mass =
            outcomes.iter().filter_map(|o| o.truth_mass).sum::<f64>() / outcomes.len() as f64;
        lines.push(format!(
            "truth       {} landmarks; the MAP topology of {recovered} of {} chains, {:.1} % of draws",
            truth.n_landmarks(),
            outcomes.len(),
            100.0 * mass
        ));
    }
    if result.truncated {
        lines.push(
            "truncated   the table of topologies was full; the rarest were dropped".to_owned(),
        );
    }
    fitted(lines, width)
}

/// How a chain's ladder of temperatures did.
fn ladder_line(ladder: &TemperingOutcome) -> String {
    let rejected = || ladder.rejected.iter().map(|share| 100.0 * share);
    format!(
        "            {} rungs, {} round trips, swaps rejected {:.0} to {:.0} %, barrier {:.1}",
        ladder.inverse_temperatures.len(),
        ladder.round_trips,
        rejected().fold(f64::INFINITY, f64::min),
        rejected().fold(0.0, f64::max),
        ladder.barrier
    )
}
