//! The chains of one cell against the exact posterior.

use crate::run::{ChainOutcome, ExactComparison, ExactDistance};

/// How far a cell's chains are from the exact posterior.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellDistance {
    /// Chains that were compared.
    pub n_compared: usize,
    /// Of these, chains without an effective sample size to judge by: they stood still, mix slowly or are short.
    pub n_undecided: usize,
    /// Of these, chains further from the posterior than a correct one of their size gets.
    pub n_differ: usize,
    /// The largest total variation of a chain.
    pub largest: Option<f64>,
    /// What a correct chain in that one's place stays below.
    pub high: Option<f64>,
    /// Why none was compared.
    pub reason: Option<String>,
}

/// From the chains that ran to their end.
pub(super) fn cell_distance(outcomes: &[&ChainOutcome]) -> CellDistance {
    let compared: Vec<&ExactDistance> = (outcomes.iter())
        .filter_map(|outcome| match &outcome.exact {
            ExactComparison::Compared(distance) => Some(distance),
            ExactComparison::Not { .. } => None,
        })
        .collect();
    let furthest = compared
        .iter()
        .max_by(|a, b| a.total_variation.total_cmp(&b.total_variation));
    let reasons = outcomes.iter().find_map(|outcome| match &outcome.exact {
        ExactComparison::Not { reason } => Some(reason.clone()),
        ExactComparison::Compared(_) => None,
    });
    let is = |verdict| {
        compared
            .iter()
            .filter(move |d| d.differs() == verdict)
            .count()
    };
    CellDistance {
        n_compared: compared.len(),
        n_undecided: is(None),
        n_differ: is(Some(true)),
        largest: furthest.map(|distance| distance.total_variation),
        high: furthest.and_then(|distance| distance.high),
        reason: if compared.is_empty() { reasons } else { None },
    }
}
