//! What `ptm diagnose` found, in lines for a terminal.

use super::{answers_line, convergence_lines, estimate_lines, fitted, topology_lines};
use crate::results::labels::{LabelChainSummary, LabelsResult};

/// Chains that are listed.
const N_CHAINS: usize = 8;

/// What a person wants to know first, in lines of at most `width` columns.
pub fn labels_summary(result: &LabelsResult, width: usize) -> String {
    let n_chains = result.chains.len();
    let chains = if n_chains == 1 { "chain" } else { "chains" };
    let mut lines = vec![format!(
        "{n_chains} {chains} of {} draws of {} items",
        result.n_draws, result.n_items
    )];
    let chain = |own: &LabelChainSummary| {
        let burn_in = own.burn_in.map_or_else(
            || format!("no burn-in: {}", own.burn_in_reason),
            |n| format!("burn-in {n}"),
        );
        format!(
            "chain       {}: {burn_in}, M {:.3}",
            own.name, own.mean_n_sets
        )
    };
    lines.extend(result.chains.iter().take(N_CHAINS).map(chain));
    if n_chains > N_CHAINS {
        lines.push(format!(
            "            … and {} more chains",
            n_chains - N_CHAINS
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
    lines.extend(convergence_lines(result.convergence.as_ref()));
    lines.extend(estimate_lines(&result.estimates));
    lines.extend(answers_line(&result.representatives));
    if result.truncated {
        lines.push(
            "truncated   the table of topologies was full; the rarest were dropped".to_owned(),
        );
    }
    fitted(lines, width)
}
