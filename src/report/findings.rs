//! What a sweep found, in sentences; the same in Markdown and HTML.

use super::{Material, advice, factors, words};
use crate::results::sensitivity::{Contrast, Response, UnitMean};
use crate::results::told_apart::{Judged, LEVEL, judged, recovery_difference};
use crate::results::{CellResult, CellVerdict, FactorEffect, Verdict};
use crate::run::Stop;
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

/// A sentence of the answer, with the question that it answers.
pub(super) struct Finding {
    /// The question in a few words.
    pub lead: &'static str,
    /// The sentence.
    pub text: String,
    /// The cell that it recommends.
    pub cell: Option<usize>,
}

/// What every report asks.
pub(super) const QUESTION: &str = "Which settings recover the truth, how surely, did the chains converge, and which knob matters?";

/// The answer, in the order in which a reader needs it.
pub(super) fn answer(material: Material<'_>) -> Vec<Finding> {
    let say = |lead, text| Finding {
        lead,
        text,
        cell: None,
    };
    let mut findings = Vec::new();
    findings.extend(which_knob(material).map(|text| say("The knob that matters most", text)));
    let whose = whose_findings(material);
    if !whose.is_empty() {
        findings.push(say("Whose findings these are", whose.join(" ")));
    }
    findings.extend(cell_to_use(material).map(|(cell, text)| Finding {
        cell,
        ..say("The cell to use", text)
    }));
    findings.push(say("How surely", how_many_recover(material)));
    findings.push(say("Did the chains converge", verdicts(material)));
    findings
}

/// What else a reader should know.
pub(super) fn notes(material: Material<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(exact_distance(material));
    notes.extend(caveats(material));
    notes
}

/// The largest difference in recovery that a factor makes, as `contrasts` has it, with its test.
pub(super) struct Knob {
    /// The level with the lower rate, and the one with the higher.
    levels: [usize; 2],
    estimate: UnitMean,
    /// Holm’s p-value over all pairs of levels of all factors.
    pub p_holm: f64,
    n_contrasts: usize,
    unit: &'static str,
}

impl Knob {
    /// Whether chance does not explain it.
    pub fn is_told(&self) -> bool {
        self.p_holm <= LEVEL
    }

    /// "p = 0.012, paired over 5 worlds, Holm over 18 pairs of levels".
    pub fn words(&self) -> String {
        format!(
            "{}, paired over {}, Holm over {}",
            words::p_value(self.p_holm),
            words::counted(self.estimate.n, self.unit),
            words::counted(self.n_contrasts, "pair of levels").replace("levelss", "levels")
        )
    }
}

/// Of a factor, by its index; `None` where one unit shows no chance.
pub(super) fn knob(material: Material<'_>, factor: usize) -> Option<Knob> {
    let found = &material.results.sensitivity;
    let strongest = found.strongest(Response::Recovery).into_iter();
    let contrast = strongest.into_iter().find(|row| row.factor == factor)?;
    let is_tested = |row: &&Contrast| row.response == Response::Recovery && row.p_holm.is_some();
    let estimate = contrast.estimate?;
    let mut levels = [contrast.from, contrast.to];
    if estimate.mean < 0.0 {
        levels.reverse();
    }
    Some(Knob {
        levels,
        estimate,
        p_holm: contrast.p_holm?,
        n_contrasts: found.contrasts.iter().filter(is_tested).count(),
        unit: if found.over_worlds {
            "world"
        } else {
            "chain number"
        },
    })
}

fn which_knob(material: Material<'_>) -> Option<String> {
    let (sweep, results) = (material.sweep, material.results);
    let strongest = results.effects.first()?;
    if strongest.range == 0.0 {
        let rate = strongest.by_level.iter().flatten().next()?.rate;
        let rate = words::percent(Some(rate));
        return Some(format!(
            "none: the recovery rate is {rate} at every level of every setting."
        ));
    }
    let describe = |effect: &FactorEffect| {
        let factor = &sweep.factors[effect.factor];
        // The levels that the test is of; without a test those with the lowest and the highest rate.
        let rates = match knob(material, effect.factor) {
            Some(knob) => knob.levels.map(|level| Some(effect.by_level[level]?.rate)),
            None => {
                [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| factors::extreme(effect, of))
            }
        };
        let [low, high] = [rates[0]?, rates[1]?];
        Some(format!(
            "{}: recovery goes from {} to {}, a change of {}",
            factor.key.label(),
            factors::at(factor, effect, low),
            factors::at(factor, effect, high),
            words::points(high - low)
        ))
    };
    let changing = results.effects.iter().filter(|effect| effect.range > 0.0);
    let (told, not_told): (Vec<&FactorEffect>, Vec<&FactorEffect>) = changing
        .partition(|effect| knob(material, effect.factor).is_some_and(|knob| knob.is_told()));
    let named = |effects: &[&FactorEffect]| {
        let name = |effect: &&FactorEffect| {
            let label = sweep.factors[effect.factor].key.label();
            let p = knob(material, effect.factor)
                .map_or_else(|| "one unit".to_owned(), |knob| words::p_value(knob.p_holm));
            format!("{label} ({}, {p})", words::points(effect.range))
        };
        effects.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let Some((first, others)) = told.split_first() else {
        let test = match knob(material, strongest.factor) {
            Some(knob) => format!("{}{}", knob.words(), too_few(&knob)),
            None => "one unit shows no chance: run more worlds or chains".to_owned(),
        };
        return Some(format!(
            "none shows an effect beyond chance. The largest change seen is that of {} ({test}).",
            describe(strongest)?
        ));
    };
    let test = knob(material, first.factor)?.words();
    let then = if others.is_empty() {
        String::new()
    } else {
        format!("; then {}", named(others))
    };
    let left = if not_told.is_empty() {
        String::new()
    } else {
        format!(" Not beyond chance: {}.", named(&not_told))
    };
    Some(format!("{} ({test}){then}.{left}", describe(first)?))
}

/// What a test lacks that finds nothing although all units agree: units.
fn too_few(knob: &Knob) -> String {
    if knob.estimate.standard_error != Some(0.0) || knob.estimate.mean == 0.0 {
        return String::new();
    }
    // 2^(1 − n) times the number of contrasts is below the level.
    let needed = 1.0 + libm::log2(knob.n_contrasts as f64 / LEVEL);
    format!(
        "; all {} agree, and {} that do would be enough",
        words::counted(knob.estimate.n, knob.unit),
        needed.ceil()
    )
}

/// Chains on small data sets against the exact posterior.
fn exact_distance(material: Material<'_>) -> Option<String> {
    let cells = &material.results.cells;
    let count = |of: fn(&CellResult) -> usize| cells.iter().map(of).sum::<usize>();
    let n_compared = count(|cell| cell.exact.n_compared);
    let furthest = (cells.iter())
        .filter(|cell| cell.exact.largest.is_some())
        .max_by(|a, b| {
            let of = |cell: &CellResult| cell.exact.largest.unwrap_or(0.0);
            of(a).total_cmp(&of(b))
        })?;
    let title = |cell: &CellResult| material.sweep.cells[cell.cell].title();
    let differing: Vec<String> = (cells.iter())
        .filter(|cell| cell.exact.n_differ > 0)
        .map(|cell| {
            let (n, all) = (cell.exact.n_differ, cell.exact.n_compared);
            format!("{} ({n} of {all})", title(cell))
        })
        .collect();
    let verdict = if differing.is_empty() {
        "no chain that can be judged is further off than a correct one of its effective sample size gets".to_owned()
    } else {
        let cells = differing.join(", ");
        format!("NOT drawn from the posterior, further off than chance explains: {cells}")
    };
    let undecided = match count(|cell| cell.exact.n_undecided) {
        0 => String::new(),
        n => format!(
            "; {} cannot be judged (standing still, mixing slowly, or short)",
            words::counted(n, "chain")
        ),
    };
    Some(format!(
        "{} on data of at most {} detections compared with the exact posterior: the largest total \
         variation is {} in {}; {verdict}{undecided}.",
        words::counted(n_compared, "chain"),
        material.sweep.base.count("exact_up_to"),
        words::distance(furthest.exact.largest, furthest.exact.high),
        title(furthest),
    ))
}

fn how_many_recover(material: Material<'_>) -> String {
    let (sweep, results) = (material.sweep, material.results);
    let rates: Vec<f64> = results
        .cells
        .iter()
        .filter_map(|cell| cell.recovery)
        .map(|r| r.rate)
        .collect();
    let size = format!(
        "{} × {} × {}",
        words::counted(sweep.cells.len(), "cell"),
        match (sweep.stopping(), sweep.is_simulated()) {
            (Some(_), _) => format!("{} worlds", words::worlds_per_cell(&results.cells)),
            (None, true) => words::counted(sweep.n_replicates() as usize, "world"),
            (None, false) => words::counted(sweep.n_replicates() as usize, "data set"),
        },
        words::counted(sweep.n_chains() as usize, "chain"),
    );
    if rates.is_empty() {
        return format!(
            "{size}; the truth of these detections is not known, so recovery is not judged."
        );
    }
    let (all, none) = (
        rates.iter().filter(|&&r| r == 1.0).count(),
        rates.iter().filter(|&&r| r == 0.0).count(),
    );
    format!(
        "{size}: {} recover the true topology in every chain, {} in none, {} in some.",
        words::counted(all, "cell"),
        none,
        rates.len() - all - none
    )
}

/// What the rates are worth: worlds by verdict, and the chains without an outcome, zeros too.
fn verdicts(material: Material<'_>) -> String {
    let results = material.results;
    let count = |verdict: Verdict| {
        let of = |cell: &CellResult| cell.worlds.n(verdict);
        results.cells.iter().map(of).sum::<usize>()
    };
    let is_shown =
        |verdict: &Verdict| *verdict != Verdict::ConvergedTruthUnknown || count(*verdict) > 0;
    let parts = Verdict::ALL.into_iter().filter(is_shown);
    let parts: Vec<String> = parts
        .map(|verdict| format!("{} {}", count(verdict), verdict.words()))
        .collect();
    let n_cells = |verdict: CellVerdict| {
        let own = results.cells.iter().filter(|cell| cell.verdict == verdict);
        own.count()
    };
    let cells: Vec<String> = CellVerdict::ALL
        .into_iter()
        .filter(|verdict| n_cells(*verdict) > 0)
        .map(|verdict| format!("{} {}", n_cells(verdict), verdict.words()))
        .collect();
    let n_missing = results.cells.iter().map(|cell| cell.n_missing).sum();
    let n_failed = results.cells.iter().map(|cell| cell.n_failed).sum();
    format!(
        "of the {} of all cells, {}. Of {}, {} by the share of {} worlds; chains: {}.",
        words::counted(results.worlds.len(), "world"),
        parts.join(", "),
        words::counted(results.cells.len(), "cell"),
        cells.join(", "),
        if results.cells.len() == 1 {
            "its"
        } else {
            "their"
        },
        words::missingness(n_failed, n_missing)
    )
}

/// The cell to use, of those that are computed correctly, and why; no cell where none can be
/// recommended.
fn cell_to_use(material: Material<'_>) -> Option<(Option<usize>, String)> {
    let (sweep, results) = (material.sweep, material.results);
    if !matches!(sweep.design, Design::Grid(_) | Design::OneAtATime(_)) {
        return None;
    }
    let is_correct = |cell: &usize| sweep.cells[*cell].settings.faults().is_empty();
    let first = results.ranking().iter().copied().find(is_correct)?;
    let best = &results.cells[first];
    let what = format!(
        "{} ({})",
        sweep.cells[first].title(),
        words::differing(sweep, &sweep.cells[first])
    );
    let Some(rate) = best.recovery else {
        let n = (results.cells.iter())
            .filter(|cell| cell.verdict == Verdict::ConvergedTruthUnknown.into())
            .count();
        let of = words::counted(results.cells.len(), "cell");
        return Some(match n {
            0 => (
                None,
                format!("none: the truth is not known, and the chains converge in none of {of}."),
            ),
            _ => (
                Some(first),
                format!(
                    "one of the {n} of {of} whose chains converge, as {what}; the truth is not known, so recovery is not judged."
                ),
            ),
        });
    };
    let rate_words = words::rate(Some(rate));
    if best.worlds.n(Verdict::Recovered) == 0 {
        return Some((
            None,
            format!(
                "none: no cell recovers the truth with chains that are shown to have converged; the most \
                 successful is {what}, with a recovery rate of {rate_words} by luck."
            ),
        ));
    }
    if best.verdict != Verdict::Recovered.into() {
        return Some((
            Some(first),
            format!(
                "none is shown to be one yet. The most successful is {what}: {}, recovery {rate_words}. {}",
                best.verdict_words(),
                advice::cell_what_now(best)
            ),
        ));
    }
    let around = results.neighbours_rate(first).map(|neighbours| {
        format!(
            " The cells next to it recover {} on average.",
            words::percent(Some(neighbours))
        )
    });
    Some((
        Some(first),
        format!(
            "{what}: {}, recovery {rate_words}.{}{}",
            best.worlds.split(),
            around.unwrap_or_default(),
            not_told_apart(material, first).unwrap_or_default()
        ),
    ))
}

/// How many other cells' recovery rates cannot be told apart from that of the best.
fn not_told_apart(material: Material<'_>, best: usize) -> Option<String> {
    let cells = 0..material.results.cells.len();
    let found: Vec<_> = cells
        .filter(|cell| *cell != best)
        .map(|cell| recovery_difference(material.sweep, material.results, best, cell))
        .collect();
    let all: Vec<Judged> = judged(&found).into_iter().flatten().collect();
    let test = all.first()?.found.test;
    let n_alike = all.iter().filter(|own| !own.differs()).count();
    Some(format!(
        " By recovery rate {n_alike} of the other {} cannot be told apart from it ({}, Holm over {}, p > {LEVEL}).",
        words::counted(all.len(), "cell"),
        test.words(),
        words::counted(all.len(), "test")
    ))
}

/// Whose findings the compared settings show: which labels share a verdict.
fn whose_findings(material: Material<'_>) -> Vec<String> {
    let mut by_verdict: Vec<(String, Vec<String>)> = Vec::new();
    let mut tests: Option<Judged> = None;
    for comparison in comparisons(material) {
        tests = tests.or(comparison.test);
        let label = match comparison.test {
            Some(test) => format!("({}, {})", comparison.label, words::p_value(test.p_holm)),
            None => format!("({})", comparison.label),
        };
        match by_verdict
            .iter_mut()
            .find(|(verdict, _)| *verdict == comparison.verdict)
        {
            Some((_, labels)) => labels.push(label),
            None => by_verdict.push((comparison.verdict, vec![label])),
        }
    }
    let mut sentences: Vec<String> = by_verdict
        .into_iter()
        .map(|(verdict, labels)| format!("{}: {verdict}.", labels.join(", ")))
        .collect();
    sentences.extend(tests.map(|test| {
        format!(
            "p: {}, by Holm over the {} that could have found anything.",
            test.found.test.words(),
            words::counted(test.n_tests, "test")
        )
    }));
    sentences
}

fn caveats(material: Material<'_>) -> Vec<String> {
    let (sweep, results) = (material.sweep, material.results);
    let mut caveats = Vec::new();
    let n_done = results.chains.len() - results.n_failed();
    let count = |of: fn(&CellResult) -> usize| results.cells.iter().map(of).sum::<usize>();
    let n_never = count(|cell| cell.n_never_settled);
    if n_never > 0 {
        caveats.push(format!(
            "{n_never} of {n_done} chains have no burn-in (MSER finds none in their first half, or they are \
             too short to tell); nothing is left out of those, and their outcome says little."
        ));
    }
    let judged = || results.cells.iter().filter_map(|cell| cell.map_agreement);
    let disagree = judged().filter(|&agreement| agreement < 0.5).count();
    if disagree > 0 {
        caveats.push(format!(
            "In {disagree} of {} the chains mostly end at different MAP topologies on the same data: they \
             are stuck or spread, not converged, however still each stands by itself.",
            words::counted(judged().count(), "cell")
        ));
    }
    if results.n_failed() > 0 {
        caveats.push(format!(
            "{} failed; the table of chains says why.",
            words::counted(results.n_failed(), "chain")
        ));
    }
    let missing = material.plan.tasks.len() - results.chains.len();
    if missing > 0 {
        caveats.push(format!("{} not run yet.", words::counted(missing, "chain")));
    }
    let at_cap = |cell: &&CellResult| cell.stop == Some(Stop::AtCap);
    let n_at_cap = results.cells.iter().filter(at_cap).count();
    if let Some(rule) = sweep.stopping().filter(|_| n_at_cap > 0) {
        caveats.push(format!(
            "{} stopped at the cap of {} worlds before the recovery rate was known to ± {}; their intervals are \
             wider than asked for.",
            words::counted(n_at_cap, "cell"),
            rule.most,
            words::within(Some(rule.error))
        ));
    }
    let n_truncated = count(|cell| cell.n_truncated);
    if n_truncated > 0 {
        caveats.push(format!(
            "In {} the table of topologies was full and the rarest were dropped (truncated).",
            words::counted(n_truncated, "chain")
        ));
    }
    let faulty = sweep
        .cells
        .iter()
        .filter(|cell| !cell.settings.faults().is_empty())
        .count();
    if faulty > 0 {
        caveats.push(format!(
            "{} computed INCORRECTLY on purpose, as the source report's program does; they are marked.",
            if faulty == 1 { "1 cell is".to_owned() } else { format!("{faulty} cells are") }
        ));
    }
    if !sweep.dropped_factors.is_empty() {
        caveats.push(format!(
            "The data come from a CSV, so what the sweep says of simulated worlds is left out: {}.",
            sweep.dropped_factors.join(", ")
        ));
    }
    caveats
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
        own.filter(|_| !walks_at_random(&results[wrong]))
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
        verdict: verdict(&results[right], &results[wrong], test).to_owned(),
        test,
    };
    pairs.into_iter().zip(tests).map(compared).collect()
}

/// A chain that stands at a posterior value of 0 for most of its proposals accepts whatever comes.
fn walks_at_random(cell: &CellResult) -> bool {
    cell.underflow_share.is_some_and(|share| share > 0.5)
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
    let what = match (walks_at_random(cell), recovers(cell)) {
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

fn verdict(correct: &CellResult, faulty: &CellResult, test: Option<Judged>) -> &'static str {
    match (walks_at_random(faulty), recovers(correct)) {
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
