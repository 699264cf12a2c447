//! The section of `docs/verdicts.md` on genMCMCDiag's distances.

use std::fmt::Write as _;

use super::page::{n_false, withheld};
use super::rates::words;
use super::study::{FIRST_MAPPED, N_RULES, RULES, Row};
use super::target::Kind;

/// The rules that its picture compares: that of `ptm`, R-hat of M and ln target, and one of each map.
pub const RULES_OF_FIGURE: [usize; 5] = [0, 2, 3, 7, 8];
/// The rules of its table by kind of target.
const RULES_BY_KIND: [usize; 6] = [0, 2, 3, 5, 7, 8];

/// The section, of `n` targets.
pub fn section(text: &mut String, rows: &[Row], n: usize) {
    let _ = write!(
        text,
        "## Distances to a draw: genMCMCDiag\n\n\
         {n} targets. genMCMCDiag ([arXiv 2408.15392](https://arxiv.org/abs/2408.15392)) turns every draw into a \
         number by a distance and judges the number. Three of its maps are rebuilt here. One is the Hamming distance of \
         [co-clustering](glossary.md#co-clustering) matrices to one draw taken at random (`lanfear` with `hammingDist`). One is the \
         [variation of information](glossary.md#binder-and-vi-estimates) (VI) to that draw. The third is the way along a tour from each distinct draw to its nearest \
         neighbour (`ts`). \
         Its users look for a PSRF (Gelman-Rubin) below 1.1. A stricter user would ask for a rank-normalised R-hat \
         of at most 1.01 and 100 effective draws a chain, in the bulk and in the tails. A map that is constant \
         passes. All samplers and both starts.\n\n\
         Topologies that are equally far from the reference are one number, so chains that differ between them \
         agree.\n\n\
         ![False and withheld verdicts of maps to a number](verdicts-mapped.png)\n\n\
         | rule | false: two | false: four | withheld: two | withheld: four |\n|---|---|---|---|---|\n"
    );
    for rule in [0, 2].into_iter().chain(FIRST_MAPPED..N_RULES) {
        let of = |n_chains: usize| move |row: &Row| row.n_chains == n_chains;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            name(rule),
            words(n_false(rows, rule, of(2))),
            words(n_false(rows, rule, of(4))),
            words(withheld(rows, rule, of(2))),
            words(withheld(rows, rule, of(4)))
        );
    }
    text.push_str("\nFalse verdicts on four chains, by kind of target:\n\n| target |");
    let names: Vec<&str> = RULES_BY_KIND.into_iter().map(name).collect();
    let _ = writeln!(
        text,
        " {} |\n|---{}|",
        names.join(" | "),
        "|---".repeat(names.len())
    );
    for kind in Kind::ALL {
        let of = |row: &Row| row.n_chains == 4 && Kind::ALL[(row.target % 5) as usize] == kind;
        let shares = RULES_BY_KIND.map(|rule| words(n_false(rows, rule, of)));
        let _ = writeln!(text, "| {} | {} |", kind.words(), shares.join(" | "));
    }
    text.push('\n');
}

fn name(rule: usize) -> &'static str {
    match rule {
        0 => "`ptm`: topologies, pairs and probes",
        _ => RULES[rule],
    }
}
