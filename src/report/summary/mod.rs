//! What chains found, in lines for a terminal: topologies, verdict and estimates. `ptm sample` and
//! `ptm diagnose` say these alike.

mod labels;
mod mission;
mod sample;

pub use labels::labels_summary;
pub use mission::{fit_words, mission_answer, noise_words};
pub use sample::sample_summary;

use crate::results::sample::{
    ConvergenceSummary, CouplingSummary, Estimate, JudgedSummary, Measured, RepresentativeRow,
    StartsSummary, TopologyRow,
};

/// Topologies in the summary.
const N_SHOWN: usize = 5;

/// Lines as one text, none wider than so many columns.
fn fitted(lines: Vec<String>, width: usize) -> String {
    let fit = |line: String| match line.char_indices().nth(width.saturating_sub(1)) {
        Some((end, _)) => format!("{}…\n", &line[..end]),
        None => format!("{line}\n"),
    };
    lines.into_iter().map(fit).collect()
}

/// The topologies sampled most, out of so many, and whether the table was full.
fn topology_lines(rows: &[TopologyRow], (n_topologies, truncated): (usize, bool)) -> Vec<String> {
    // Of a full table the others are not known.
    let counted = if truncated { "held" } else { "distinct" };
    let mut lines = vec![format!(
        "topologies  {n_topologies} {counted}, the most sampled:"
    )];
    for (rank, row) in rows.iter().take(N_SHOWN).enumerate() {
        lines.push(format!(
            "  {:>2}  {:>6.2} %  M = {:<3} {}",
            rank + 1,
            100.0 * row.frequency,
            row.topology.n_sets(),
            row.topology
        ));
    }
    lines
}

/// Whether the chains have converged, and the numbers that say so.
fn convergence_lines(found: Option<&ConvergenceSummary>) -> Vec<String> {
    let Some(found) = found else {
        return Vec::new();
    };
    let mut lines = vec![format!("converged   {}", verdict_of(found))];
    lines.extend(judged_line(found));
    lines.push(starts_line(&found.starts));
    lines.extend(found.coupling.as_ref().map(coupling_line));
    let mut of_chains = Vec::new();
    let apart = (&found.topology_distance, &found.topology_distance_null_95);
    if let (Some(distance), Some(by_chance)) = (apart.0.value, apart.1.value) {
        of_chains.push(format!(
            "topologies {distance:.3} apart, by chance up to {by_chance:.3}"
        ));
    }
    if let Some(unseen) = found.unseen_mass.value {
        of_chains.push(format!("unseen mass {unseen:.3}"));
    }
    if !of_chains.is_empty() {
        lines.push(format!("chains      {}", of_chains.join("; ")));
    }
    lines
}

/// The same in one sentence, for a picture.
pub(super) fn verdict_line(found: Option<&ConvergenceSummary>) -> String {
    found.map_or_else(
        || "Converged? Not known, as nothing is left after the burn-in".to_owned(),
        |found| {
            let words = verdict_of(found);
            let words = words
                .strip_prefix("yes")
                .map_or(words.clone(), |rest| format!("Yes{rest}"));
            format!("Converged? {words}")
        },
    )
}

fn verdict_of(found: &ConvergenceSummary) -> String {
    let verdict = match (found.verdict, found.exact_difference) {
        (_, Some(largest)) => {
            &format!("yes: every probability is within {largest:.3} of the exact posterior")
        }
        ("mixes", _) => "yes: the chains mix and agree",
        ("at-rest", _) => "yes: every chain came to rest at the first topology",
        _ => "NOT shown",
    };
    // The first doubt says enough for a terminal; all of them are in the JSON.
    let doubt = match &found.doubts[..] {
        [] => String::new(),
        [only] => format!(": {only}"),
        [first, _] => format!(": {first}, and 1 more doubt"),
        [first, others @ ..] => format!(": {first}, and {} more doubts", others.len()),
    };
    format!("{verdict}{doubt}")
}

/// What the starts show: whether all came to one place, and what that is worth.
fn starts_line(starts: &StartsSummary) -> String {
    let initial = match starts.initial_topologies {
        1 => "one topology".to_owned(),
        n => format!("{n} topologies"),
    };
    if starts.probes_came < starts.probes {
        let lost = starts.probes - starts.probes_came;
        return format!(
            "starts      {initial}; {lost} of {} probes ended elsewhere",
            starts.probes
        );
    }
    format!(
        "starts      {initial}, {} probes; up to {:.0} % of starts may end elsewhere",
        starts.probes,
        100.0 * starts.most_elsewhere
    )
}

/// Whether coupled chains met, and what that is worth.
fn coupling_line(found: &CouplingSummary) -> String {
    let CouplingSummary { met, pairs, .. } = found;
    let what = match (found.last_met, found.most_later) {
        (Some(last), Some(most)) => format!(
            "met, the last at proposal {last}; {:.0} % may be later",
            100.0 * most
        ),
        _ => "met: no bound".to_owned(),
    };
    format!("coupled     {met} of {pairs} pairs {what}")
}

/// The worst numbers of what the verdict rests on; no line where it rests on none.
fn judged_line(found: &ConvergenceSummary) -> Option<String> {
    if found.judged.is_empty() || found.verdict == "exact" {
        return None;
    }
    let undefined = |own: &&JudgedSummary| own.r_hat.value.is_none() || own.ess.value.is_none();
    if let Some(own) = found.judged.iter().find(undefined) {
        let state = if own.r_hat.value.is_none() {
            own.r_hat.state
        } else {
            own.ess.state
        };
        return Some(format!("judged      {}: {state}", own.quantity));
    }
    let by = |value: fn(&JudgedSummary) -> Measured| {
        let values = found
            .judged
            .iter()
            .filter_map(move |own| Some((value(own).value?, own)));
        values.map(|(value, own)| (value, own.quantity.as_str()))
    };
    let (r_hat, r_hat_of) = by(|own| own.r_hat).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (ess, _) = by(|own| own.ess).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let n = found.judged.len();
    let quantities = if n == 1 {
        "1 quantity"
    } else {
        &format!("{n} quantities")
    };
    Some(format!(
        "judged      {quantities}: ESS at least {ess:.0}, R-hat at most {r_hat:.3} ({r_hat_of})"
    ))
}

/// Where one topology does not stand for all: how many answers there are, with their shares.
fn answers_line(answers: &[RepresentativeRow]) -> Option<String> {
    if answers.len() < 2 {
        return None;
    }
    let answer = |own: &RepresentativeRow| {
        format!(
            "{:.0} ± {:.0} % near M = {}",
            100.0 * own.weight,
            100.0 * own.weight_se,
            own.n_sets
        )
    };
    let shares: Vec<String> = answers.iter().map(answer).collect();
    Some(format!(
        "answers     {}: {}",
        answers.len(),
        shares.join(", ")
    ))
}

/// MAP, Binder and VI estimates: one line each.
fn estimate_lines(estimates: &[Estimate]) -> Vec<String> {
    let first = estimates.first().map(|estimate| &estimate.labels);
    let line = |estimate: &Estimate| {
        let name = match estimate.kind {
            "map" => "MAP",
            "binder" => "Binder",
            _ => "VI",
        };
        let same = match first {
            Some(labels) if name != "MAP" && *labels == estimate.labels => " = MAP",
            _ => "",
        };
        let truth = estimate.truth.map_or_else(String::new, |truth| {
            format!(
                "; ARI {:.2}, VI {:.2}, M {:+}",
                truth.adjusted_rand_index, truth.variation_of_information, truth.n_sets_error
            )
        });
        let ball = &estimate.credible_ball;
        format!(
            "{name:<11} M = {}{same}, 95 % within {:.3} {}{truth}",
            estimate.n_sets,
            ball.radius,
            if estimate.loss == "vi" {
                "nats"
            } else {
                "of pairs"
            }
        )
    };
    estimates.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_at_the_width_and_not_before() {
        let lines = || vec!["σσσσσσ".to_owned(), "ab".to_owned()];
        assert_eq!(fitted(lines(), 4), "σσσ…\nab\n");
        assert_eq!(fitted(lines(), 7), "σσσσσσ\nab\n");
    }
}
