//! What was tried and what came of it; whose fault the wrong maps are.

use super::{Finding, knows_truth, listed};
use crate::report::{Material, faults, words};
use crate::results::{Fault, Verdict};

/// "324 settings were tried on 5 worlds each: in 332 of these 1,620 runs …".
pub(super) fn finding(material: Material<'_>) -> Finding {
    let (sweep, results) = (material.sweep, material.results);
    let n_runs = results.worlds.len();
    let n = |verdict: Verdict| {
        let own = results
            .worlds
            .iter()
            .filter(|world| world.verdict == verdict);
        own.count()
    };
    let on = match (sweep.stopping(), sweep.has_many_worlds()) {
        (Some(_), _) => format!("{} worlds each", words::worlds_per_cell(&results.cells)),
        (None, true) => match sweep.n_replicates() {
            1 => "1 world each".to_owned(),
            n => format!("{n} worlds each"),
        },
        (None, false) => "one data set".to_owned(),
    };
    let settings = match sweep.cells.len() {
        1 => "1 setting was tried".to_owned(),
        n => format!("{} settings were tried", words::thousands(n)),
    };
    let runs = match n_runs {
        n if n == sweep.cells.len() && !sweep.has_many_worlds() => {
            format!("these {} settings", words::thousands(n))
        }
        n => format!("these {} runs", words::thousands(n)),
    };
    let found = if knows_truth(material) {
        vec![
            (
                n(Verdict::Recovered),
                "the chains converged and found the true map",
            ),
            (
                n(Verdict::ByLuck),
                "a chain found the true map without shown convergence",
            ),
            (n(Verdict::WrongMap), "the chains converged to a wrong map"),
            (
                n(Verdict::NotConverged),
                "the chains neither converged nor found the true map",
            ),
        ]
    } else {
        vec![(
            n(Verdict::ConvergedTruthUnknown),
            "the chains converged; the true map is not known",
        )]
    };
    // The first is what is hoped for, so it is said where it is 0, too.
    let (hoped, others) = (found[0], &found[1..]);
    let others = others.iter().filter(|(n, _)| *n > 0);
    let came = if n_runs == 1 {
        let what = others.copied().find(|_| hoped.0 == 0).unwrap_or(hoped).1;
        format!("in the one run {what}")
    } else {
        let first = format!("in {} of {runs} {}", words::thousands(hoped.0), hoped.1);
        let others = others.map(|(n, what)| format!("in {} {what}", words::thousands(*n)));
        listed(&std::iter::once(first).chain(others).collect::<Vec<_>>())
    };
    let n_missing: usize = results.cells.iter().map(|cell| cell.n_missing).sum();
    let open = [(results.n_failed(), "failed"), (n_missing, "not run yet")];
    let open = open.iter().filter(|(n, _)| *n > 0);
    let open: Vec<String> = open
        .map(|(n, what)| format!("{} {what}", words::counted(*n, "chain")))
        .collect();
    let open = if open.is_empty() {
        String::new()
    } else {
        format!(" ({})", listed(&open))
    };
    Finding::new("Result", format!("{settings} on {on}: {came}{open}."))
}

/// "Of the 2,167 chains that ended at a wrong map, 54 % are the model’s fault, …".
pub(super) fn faults(material: Material<'_>) -> Option<Finding> {
    let own = material.results.faults()?;
    let n_failures = own.n_failures();
    let n_all = words::thousands(own.n_all());
    if n_failures == 0 {
        let text = format!("None of the {n_all} chains ended at a wrong map.");
        return Some(Finding::new("Wrong maps", text));
    }
    let mut by_size: Vec<Fault> = Fault::ALL.to_vec();
    by_size.retain(|fault| own.n(*fault) > 0);
    by_size.sort_by_key(|fault| std::cmp::Reverse(own.n(*fault)));
    let part = |fault: &Fault| {
        let share = own.n(*fault) as f64 / n_failures as f64;
        format!("{} {}", words::percent(Some(share)), whose(*fault))
    };
    let parts: Vec<String> = by_size.iter().map(part).collect();
    let advice = match by_size[0] {
        Fault::Model => "change the model first",
        Fault::Sampler => "change the sampler or run longer chains",
        Fault::Arithmetic => "use arithmetic = \"log\"",
        Fault::Undecided => "run longer reference chains to decide them",
    };
    let of_sensitivity = faults::of_sensitivity(material);
    let of_sensitivity = of_sensitivity.map_or_else(String::new, |own| format!("{own} "));
    let text = format!(
        "{of_sensitivity}Of the {} chains (of {n_all}) that ended at a wrong map, {}; {advice}.",
        words::thousands(n_failures),
        listed(&parts)
    );
    Some(Finding::new("Wrong maps", text))
}

fn whose(fault: Fault) -> &'static str {
    match fault {
        Fault::Model => "are the model’s fault (the posterior prefers a wrong map)",
        Fault::Sampler => "are the sampler’s (the posterior has the true map)",
        Fault::Arithmetic => "come from floating-point underflow",
        Fault::Undecided => "are undecided",
    }
}
