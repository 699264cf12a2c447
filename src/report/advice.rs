//! "My chain did not converge: what now?" — what each verdict and each doubt means and what to try.
//!
//! The essence of `docs/convergence.md`, carried by every report so that it needs no network.

use super::words;
use crate::results::{CellResult, CellVerdict, Doubt, Verdict};

/// What a verdict means, in one sentence.
pub(super) fn meaning(verdict: CellVerdict) -> &'static str {
    match verdict {
        CellVerdict::Of(verdict) => meaning_of_world(verdict),
        CellVerdict::Undecided => {
            "more worlds are recovered than anything else, but so few, or beside so many wrong maps, that most worlds like these \
             may not be"
        }
    }
}

fn meaning_of_world(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Recovered => {
            "the chains agree, and the topology they visit most is the truth; of a cell: on most worlds like these"
        }
        Verdict::ConvergedTruthUnknown => {
            "the chains agree; no truth is known to hold their topology against"
        }
        Verdict::ByLuck => {
            "some chain’s best topology is the truth, but nothing shows that the next chain will find it"
        }
        Verdict::WrongMap => {
            "the chains agree on a topology that is not the truth: the model prefers it, longer chains will not help"
        }
        Verdict::NotConverged => {
            "the chains disagree, are stuck, or are too short to tell; their topologies say little"
        }
        Verdict::Failed => "no chain ran to its end; the table of chains has the reason",
        Verdict::Missing => "not run yet; the same command continues the sweep",
    }
}

/// What to do about a verdict.
pub(super) fn what_now(verdict: CellVerdict) -> &'static str {
    let verdict = match verdict {
        CellVerdict::Of(verdict) => verdict,
        CellVerdict::Undecided => {
            return "More worlds (replicates): the cell’s page says how many would settle it. Where some worlds did not converge, first what \
                    is to be done about those; where some have a wrong map, change the model.";
        }
    };
    match verdict {
        Verdict::Recovered => {
            "Nothing. Before relying on it elsewhere, look whether the neighbouring cells recover too."
        }
        Verdict::ConvergedTruthUnknown => {
            "Compare with cells of other settings that converged: where they differ, the answer is the settings’ and not the data’s."
        }
        Verdict::ByLuck => {
            "Run longer (samples ×10) and with more chains (chains = 4); if the chains then still disagree, treat the cell as not converged."
        }
        Verdict::WrongMap => {
            "Change the model, not the sampler: see which factor separates these cells from those that recover, first the radius D, then the height H and the scales σ."
        }
        Verdict::NotConverged => {
            "The cell’s page lists the doubts. First run longer chains (until = \"converged\"). Then leave out moves and estimator, for the default ones instead of blind split-merge. Then start from singletons and from one-cluster, to see whether the chains meet. Then draw more importance samples where ln target jumps, or lower the height H."
        }
        Verdict::Failed => {
            "Read the reason on the cell’s page; an extreme setting or a world without detections is the usual one."
        }
        Verdict::Missing => "Run the same command again.",
    }
}

/// What the verdict on this cell means, with its own numbers: how far one may rely on it.
pub(super) fn cell_meaning(cell: &CellResult) -> String {
    let worlds = &cell.worlds;
    match cell.verdict {
        CellVerdict::Of(Verdict::Recovered) if worlds.is_only_world => {
            "the chains agree, and the topology they visit most is the truth: trust it on this data set; no other was tried".to_owned()
        }
        CellVerdict::Of(Verdict::Recovered) => format!(
            "the chains agree, and the topology they visit most is the truth, on {} of {} worlds: trust it on most worlds like these, at \
             least {} of them (95 % bound)",
            worlds.n(Verdict::Recovered),
            worlds.n_run(),
            words::percent(Some(worlds.share_at_least(Verdict::Recovered)))
        ),
        CellVerdict::Of(verdict) if worlds.n(verdict) < worlds.n_all() => format!(
            "on the worlds of that verdict {}",
            meaning_of_world(verdict)
        ),
        CellVerdict::Of(verdict) => meaning_of_world(verdict).to_owned(),
        CellVerdict::Undecided => {
            let most = worlds.most();
            format!(
                "{} of {} worlds {} show no more than that at least {} of worlds like these are (95 % bound){}",
                worlds.n(most),
                worlds.n_run(),
                most.words(),
                words::percent(Some(worlds.share_at_least(most))),
                if worlds.has_too_many_wrong_maps() {
                    format!(
                        "; and on {} of the {} whose chains converged they converged to a wrong map, which data of unknown truth would not show",
                        worlds.n(Verdict::WrongMap),
                        worlds.n_converged()
                    )
                } else {
                    String::new()
                }
            )
        }
    }
}

/// What to do about the verdict on this cell.
pub(super) fn cell_what_now(cell: &CellResult) -> String {
    if cell.verdict != CellVerdict::Undecided {
        return what_now(cell.verdict).to_owned();
    }
    let worlds = &cell.worlds;
    let mut advice = Vec::new();
    if worlds.has_too_many_wrong_maps() {
        advice.push(format!(
            "Wrong maps on more than 1 in 20 of the worlds that converged: {}",
            what_now(Verdict::WrongMap.into())
        ));
    }
    let n_open = worlds.n(Verdict::NotConverged) + worlds.n(Verdict::ByLuck);
    if n_open > 0 {
        advice.push(format!(
            "{} not shown to have converged: longer chains (samples ×10) may settle {} first.",
            match n_open {
                1 => "1 world is".to_owned(),
                n => format!("{n} worlds are"),
            },
            if n_open == 1 { "it" } else { "them" }
        ));
    }
    let needed = worlds.to_settle();
    if needed.at_best > 0 {
        let at_best = words::counted(needed.at_best, "more world");
        let most = worlds.most().words();
        let at_share = match needed.in_all {
            Some(n) => format!("at the share seen so far, {n} worlds in all"),
            None => {
                "at the share seen so far no number of worlds will show that it is most of them"
                    .to_owned()
            }
        };
        advice.push(format!(
            "To settle it by worlds (replicates): {at_best} would do if every one is {most}; {at_share}."
        ));
    }
    advice.join(" ")
}

/// Every kind of doubt and what to do about it: the kind, what it says, what to try.
pub(super) const DOUBTS: [(&str, &str, &str); 15] = [
    (
        "one-chain",
        "one chain has nothing to be compared with",
        "Run at least two chains, better four, from different starts.",
    ),
    (
        "r-hat",
        "the chains lie at different values: R-hat above 1.01",
        "Look at the traces: chains that drift need more proposals; chains that stand apart need moves that cross between them (the default mix), or they show two real modes.",
    ),
    (
        "ess",
        "too few independent draws: ESS below 100 for each chain",
        "More proposals in proportion: an ESS of 20 where 100 are wanted needs five times as many.",
    ),
    (
        "stuck-disagree",
        "each chain stands still, at a different value",
        "More proposals will hardly help. Use the default moves, a lower height H, or more importance draws if the log estimate’s noise holds them.",
    ),
    (
        "too-rare",
        "fewer than ten changes: too few to measure anything by",
        "Ten times the proposals, or moves that are accepted more often.",
    ),
    (
        "too-short",
        "too few draws after the burn-in",
        "More proposals, or a smaller fixed burn_in.",
    ),
    (
        "too-few",
        "too few chains or states to compare",
        "At least two chains that ran to their end; the table of chains says which failed.",
    ),
    (
        "topologies",
        "two chains’ topologies are further apart than chance explains",
        "M and ln target agree, but not which detections share a set: see where the co-clustering differs on the cell’s page. Usually two labellings of one corner that no move connects.",
    ),
    (
        "one-start",
        "all chains started at one topology, and no probe started elsewhere",
        "Start the chains apart (init = \"apart\") or send out probes (probes = 4): chains that started together may all have missed another mode.",
    ),
    (
        "unsettled",
        "a chain spends less than nine tenths of its draws at the MAP topology, though no single topology or pair is uncertain",
        "More proposals, or moves that are accepted more often; compare co-clustering between chains on the cell’s page.",
    ),
    (
        "late",
        "a chain came to rest so late that it may leave again",
        "Ten times the proposals: chains must rest 20 times as long as any other topology ever held one.",
    ),
    (
        "probes",
        "short chains from random starts did not come to where the chains are",
        "There is another mode, or a tenth of the chain is too short to leave a random start. Ten times the proposals tell the two apart.",
    ),
    (
        "far-from-exact",
        "the draws are further from the exact posterior than their error explains",
        "More proposals, or moves that cross between modes (the default mix); the exact posterior itself is on the cell’s page.",
    ),
    (
        "starts",
        "chains from another start converged elsewhere: nested R-hat across starts is too large",
        "Two modes that no chain crosses between: other moves or tempering (temperatures). The start whose ln target is higher is the better guess, and no more than that.",
    ),
    (
        "not-finite",
        "a value is not a number",
        "Use less extreme settings; if it persists, report it.",
    ),
];

/// What to try about one doubt.
pub(super) fn about(doubt: &Doubt) -> Option<&'static str> {
    let word = doubt.word();
    let found = DOUBTS.iter().find(|(kind, _, _)| word.starts_with(kind));
    found.map(|(_, _, advice)| *advice)
}
