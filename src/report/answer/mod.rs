//! What a sweep was run to learn, answered: a question for each design, at most five sentences, and
//! the one figure that shows it.
//!
//! Effects are named only where the test upholds them, with size and interval; what the test does
//! not uphold is said to be so. The parts of the page below have everything else.

mod effects;
mod list;
mod outcome;
mod sampled;
mod to_use;

pub(super) use effects::headline_response;
pub(super) use sampled::screened;

use super::{Leading, Material, figures};
use crate::sweep::{Design, Sampling};

/// Sentences of an answer at most.
const MOST: usize = 5;

/// The question of a design with its answer.
pub(super) struct Answer {
    /// The question.
    pub question: String,
    /// The sentences, in the order in which a reader needs them.
    pub findings: Vec<Finding>,
    /// What shows it.
    pub leading: Leading,
}

/// A sentence of the answer.
pub(super) struct Finding {
    /// What it is about, in a few words.
    pub lead: &'static str,
    /// The sentence.
    pub text: String,
    /// The cell that it names.
    pub cell: Option<usize>,
}

impl Finding {
    fn new(lead: &'static str, text: String) -> Self {
        Self {
            lead,
            text,
            cell: None,
        }
    }
}

/// The answer of a sweep.
pub(super) fn answer(material: Material<'_>) -> Answer {
    let knows_truth = knows_truth(material);
    let of_effects = || effects::finding(material);
    let outcome = || Some(outcome::finding(material));
    let faults = || outcome::faults(material);
    let [to_use, how_sure] = to_use::findings(material);
    let (question, findings, figure) = match &material.sweep.design {
        Design::List(_) => (
            list::question(material),
            [
                outcome(),
                list::finding(material),
                to_use,
                how_sure,
                faults(),
            ],
            list::figure(material),
        ),
        Design::Sampled(design) => match design.sampling {
            Sampling::Morris => (
                format!(
                    "Which of these {} settings matter at all?",
                    design.axes.len()
                ),
                sampled::screening(material),
                figures::screening_plane(material),
            ),
            Sampling::SobolIndices => (
                format!(
                    "How much of the variation in {} does each setting explain?",
                    measured(knows_truth)
                ),
                sampled::indices(material),
                figures::indices_alone(material),
            ),
            Sampling::LatinHypercube | Sampling::Sobol => (
                if knows_truth {
                    "Where in these ranges is the true map recovered, and which settings decide it?"
                } else {
                    "Where in these ranges do the chains converge, and which settings decide it?"
                }
                .to_owned(),
                [
                    outcome(),
                    of_effects(),
                    sampled::region(material),
                    to_use,
                    how_sure,
                ],
                figures::main_curves(material),
            ),
        },
        Design::OneAtATime(_) => (
            format!(
                "Starting from the baseline, which single setting changes {}?",
                measured(knows_truth)
            ),
            [outcome(), of_effects(), to_use, how_sure, faults()],
            figures::main_effects(material),
        ),
        Design::Grid(_) => (
            if knows_truth {
                "Which settings recover the true map, and which of them matter?"
            } else {
                "With which settings do the chains converge, and which of them matter?"
            }
            .to_owned(),
            [outcome(), of_effects(), to_use, how_sure, faults()],
            figures::main_effects(material),
        ),
    };
    let findings: Vec<Finding> = findings.into_iter().flatten().collect();
    debug_assert!(findings.len() <= MOST, "an answer is short");
    Answer {
        question,
        findings,
        leading: figure.unwrap_or_else(|| figures::run_status(material).into()),
    }
}

/// Whether any outcome could be held against the truth.
fn knows_truth(material: Material<'_>) -> bool {
    let mut cells = material.results.cells.iter();
    cells.any(|cell| cell.recovery.is_some())
}

/// What the settings act on, in words.
fn measured(knows_truth: bool) -> &'static str {
    if knows_truth {
        "recovery"
    } else {
        "convergence"
    }
}

/// "A", "A and B", "A, B and C".
fn listed(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
