//! Settings computed correctly beside the same as a faulty program computes them: whose finding is
//! it?

use super::{Material, words};
use crate::results::told_apart::{Judged, judged, recovery_difference};
use crate::results::{Answer, CellResult};
use crate::sweep::{Cell, Design};

/// A setting computed correctly and as a faulty program computes it.
pub(super) struct Comparison {
    /// Its label.
    pub label: String,
    /// The remark of the sweep file.
    pub note: String,
    /// What the correct computation does.
    pub correct: String,
    /// What the faulty one does.
    pub faulty: String,
    /// Whose finding it is.
    pub verdict: String,
    /// The same in a few words.
    pub short: String,
    /// The test of the two recovery rates that the finding rests on.
    pub test: Option<Judged>,
}

impl Comparison {
    /// The finding with its test: "… (p = 0.014, Fisher’s exact test over chains, 20 and 20)".
    pub fn finding(&self) -> String {
        let Some(test) = self.test else {
            return self.verdict.clone();
        };
        let [n_a, n_b] = test.found.n;
        format!(
            "{} ({}, {}, {n_a} and {n_b}; Holm over {})",
            self.verdict,
            words::p_value(test.p_holm),
            test.found.test.words(),
            words::counted(test.n_tests, "test")
        )
    }
}

/// Whose findings the compared settings show: the labels that share a verdict, with it.
pub(super) fn whose(material: Material<'_>) -> Vec<(Vec<String>, String)> {
    let mut by_verdict: Vec<(Vec<String>, String)> = Vec::new();
    for comparison in comparisons(material) {
        let label = match comparison.test {
            Some(test) if test.differs() => {
                format!("({}; {})", comparison.label, words::p_value(test.p_holm))
            }
            _ => format!("({})", comparison.label),
        };
        let known = by_verdict
            .iter_mut()
            .find(|(_, verdict)| *verdict == comparison.short);
        match known {
            Some((labels, _)) => labels.push(label),
            None => by_verdict.push((vec![label], comparison.short)),
        }
    }
    by_verdict
}

/// Settings that a list gives both correctly and with faults, side by side.
pub(super) fn comparisons(material: Material<'_>) -> Vec<Comparison> {
    if !matches!(material.sweep.design, Design::List(_)) {
        return Vec::new();
    }
    let cells = &material.sweep.cells;
    let is_faulty = |cell: &Cell| !cell.settings.faults().is_empty();
    let results = &material.results.cells;
    let pairs = cells
        .iter()
        .enumerate()
        .filter(|(_, cell)| !is_faulty(cell) && !cell.label.is_empty());
    let pairs: Vec<(usize, usize)> = pairs
        .filter_map(|(right, cell)| {
            let is_its_own = |other: &Cell| other.label == cell.label && is_faulty(other);
            Some((right, cells.iter().position(is_its_own)?))
        })
        .collect();
    // A random walk is told by its underflow and needs no test.
    let tests = pairs.iter().map(|&(right, wrong)| {
        let own = recovery_difference(material.sweep, material.results, right, wrong);
        own.filter(|_| !results[wrong].walks_at_random)
    });
    let tests = judged(&tests.collect::<Vec<_>>());
    let compared = |((right, wrong), test): ((usize, usize), Option<Judged>)| Comparison {
        label: cells[right].label.clone(),
        note: if cells[right].note.is_empty() {
            cells[wrong].note.clone()
        } else {
            cells[right].note.clone()
        },
        correct: behaviour(&results[right]),
        faulty: behaviour(&results[wrong]),
        short: short(
            answer(material, right),
            &results[right],
            &results[wrong],
            test,
        )
        .to_owned(),
        verdict: match answer(material, right) {
            Some(answer) => by_posterior(answer, &results[right], &results[wrong], test),
            None => by_rates(&results[right], &results[wrong], test).to_owned(),
        },
        test,
    };
    pairs.into_iter().zip(tests).map(compared).collect()
}

fn recovers(cell: &CellResult) -> Option<bool> {
    cell.recovery.map(|rate| rate.rate > 0.5)
}

/// Chains that mostly end at different MAP topologies have not converged, whatever each does by itself.
fn disagree(cell: &CellResult) -> bool {
    cell.map_agreement.is_some_and(|agreement| agreement < 0.5)
}

fn behaviour(cell: &CellResult) -> String {
    let stuck = disagree(cell);
    let what = match (cell.walks_at_random, recovers(cell)) {
        (true, _) => "walks at random",
        (false, Some(true)) => "recovers the truth",
        (false, Some(false)) if stuck => "does not converge",
        (false, Some(false)) => "settles elsewhere",
        (false, None) => "samples",
    };
    let rate = match cell.recovery {
        Some(rate) => format!(" (recovery {})", words::rate(Some(rate))),
        None => String::new(),
    };
    let underflow = match cell.underflow_share {
        Some(share) => format!(", value 0 in {} of proposals", words::percent(Some(share))),
        None => String::new(),
    };
    format!(
        "{what}{rate}: {} over {}, M {} ± {}, acceptance {}{underflow}",
        match cell.n_maps_first_world {
            1 => "one MAP topology".to_owned(),
            n => format!("{n} MAP topologies"),
        },
        words::counted(cell.n_chains, "chain"),
        words::number(cell.n_sets, 1),
        words::number(cell.sd_n_sets, 1),
        words::percent(cell.acceptance_rate)
    )
}

/// What the posterior of a setting prefers, on its first world.
fn answer(material: Material<'_>, cell: usize) -> Option<Answer> {
    material.results.worlds_of(cell).next()?.answer
}

/// As [`Fault`](crate::results::Fault) sorts each chain: first what the posterior says, then what the computation does.
fn by_posterior(
    answer: Answer,
    correct: &CellResult,
    faulty: &CellResult,
    test: Option<Judged>,
) -> String {
    let besides = if faulty.walks_at_random {
        "; the faulty program walks at random besides, by floating-point underflow"
    } else {
        ""
    };
    let finds = recovers(correct) == Some(true);
    match answer {
        Answer::OtherMap => {
            format!("the model’s: the posterior itself prefers another map{besides}")
        }
        Answer::Undecided(why) => {
            let why = why.words();
            format!("undecided, sampler or model: {why}{besides}")
        }
        Answer::Truth if faulty.walks_at_random && finds => {
            "floating-point underflow: the posterior has the truth, and in logarithms it is found"
                .to_owned()
        }
        Answer::Truth if faulty.walks_at_random => {
            "floating-point underflow, and in logarithms the sampler: the posterior has the truth, and the \
             chains do not get there"
                .to_owned()
        }
        Answer::Truth if test.is_some_and(|test| test.differs()) => {
            "the faulty proposal changes how often the truth is found, without any underflow; the posterior has it"
                .to_owned()
        }
        Answer::Truth if [correct, faulty].map(n_failures) == [0, 0] => {
            "the posterior has the truth, and every chain of either computation finds it".to_owned()
        }
        Answer::Truth if finds => {
            "the recovery rates cannot be told apart; the posterior has the truth, so what fails is the sampler’s"
                .to_owned()
        }
        Answer::Truth => {
            "the sampler’s: the posterior has the truth, and the chains of neither computation get there"
                .to_owned()
        }
    }
}

/// The verdict in a few words, as the end of a sentence that begins with the setting.
fn short(
    answer: Option<Answer>,
    correct: &CellResult,
    faulty: &CellResult,
    test: Option<Judged>,
) -> &'static str {
    let differs = test.is_some_and(|test| test.differs());
    let finds = recovers(correct) == Some(true);
    match (answer, faulty.walks_at_random) {
        (Some(Answer::OtherMap), _) => "fails by the model, whose posterior prefers another map",
        (Some(Answer::Undecided(_)), _) => "is undecided between model and sampler",
        (_, true) if finds => "fails only by the program’s floating-point underflow",
        (Some(Answer::Truth), true) => "fails by underflow, and without it by the sampler",
        (None, true) => "walks at random by floating-point underflow",
        (_, false) if differs => "is changed by the program’s faulty proposal",
        (_, false) if finds => "works in both computations",
        (Some(Answer::Truth), false) => "fails by the sampler, whose chains do not get there",
        (None, false) => "fails in both computations, by the method itself",
    }
}

fn n_failures(cell: &CellResult) -> usize {
    cell.faults.map_or(0, |faults| faults.n_failures())
}

/// Where no posterior was asked for.
fn by_rates(correct: &CellResult, faulty: &CellResult, test: Option<Judged>) -> &'static str {
    match (faulty.walks_at_random, recovers(correct)) {
        (true, Some(true)) => "floating-point underflow: in logarithms the truth is found",
        (true, _) if disagree(correct) => {
            "the random walk is floating-point underflow; in logarithms each chain freezes, at topologies \
             of its own"
        }
        (true, _) => {
            "the random walk is floating-point underflow; in logarithms the chains settle, though not at \
             the truth"
        }
        (false, _) if test.is_some_and(|test| test.differs()) => {
            "the faulty proposal changes how often the truth is found, without any underflow"
        }
        (false, Some(false)) if disagree(correct) => {
            "the method's own: the chains do not converge in either computation"
        }
        (false, _) if test.is_none() => "not judged: no outcome is known",
        (false, _) => "the method's own: the recovery rates cannot be told apart",
    }
}
