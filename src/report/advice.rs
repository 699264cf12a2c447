//! "My chain did not converge: what now?" — what each verdict and each doubt means and what to try.
//!
//! The essence of `docs/convergence.md`, carried by every report so that it needs no network.

use crate::results::{Doubt, Verdict};

/// What a verdict means, in one sentence.
pub(super) fn meaning(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Recovered => {
            "the chains agree, and the topology they visit most is the truth: trust it"
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
pub(super) fn what_now(verdict: Verdict) -> &'static str {
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
            "Read the doubts on the cell’s page. In this order: longer chains; the default mix of moves and estimator = \"common\" instead of blind split-merge; both starts (singletons and one-cluster) to see whether they meet; more importance draws where ln target jumps; a lower height H."
        }
        Verdict::Failed => {
            "Read the reason on the cell’s page; an extreme setting or a world without detections is the usual one."
        }
        Verdict::Missing => "Run the same command again.",
    }
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
        "exact",
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
