//! Posteriors made up so that the answer is known.

use super::super::convergence::tests::{chain, drawn};
use super::*;

fn topology(probability: f64, is_truth: bool) -> PosteriorTopology {
    PosteriorTopology {
        labels: format!("{probability}"),
        n_sets: 2,
        probability,
        is_truth: Some(is_truth),
    }
}

#[test]
fn the_more_probable_of_truth_and_the_best_other_map_is_preferred() {
    let of = |rows: &[(f64, bool)], error: f64| {
        let rows: Vec<PosteriorTopology> = rows.iter().map(|&(p, t)| topology(p, t)).collect();
        preferred(&rows, 0.01, |_, _| error)
    };
    assert_eq!(of(&[(0.6, true), (0.3, false)], 0.1), Some(Answer::Truth));
    assert_eq!(
        of(&[(0.6, false), (0.3, true)], 0.1),
        Some(Answer::OtherMap)
    );
    // A truth that is nowhere listed, and one that is all that is listed.
    assert_eq!(of(&[(0.6, false)], 0.1), Some(Answer::OtherMap));
    assert_eq!(of(&[(0.6, true)], 0.1), Some(Answer::Truth));
    assert_eq!(preferred(&[], 0.0, |_, _| 0.0), None);
}

/// The first of two topologies of about the same probability is the first by chance: whoever takes
/// it for the answer blames sampler or model by a coin.
#[test]
fn a_tie_is_no_answer() {
    let tie = Some(Answer::Undecided(Unanswered::Tie));
    for first in [true, false] {
        let rows = [topology(0.41, first), topology(0.39, !first)];
        assert_eq!(preferred(&rows, 0.0, |_, _| 0.05), tie);
        assert_ne!(preferred(&rows, 0.0, |_, _| 0.01), tie);
    }
    // A diffuse posterior, whose truth may be just below the list.
    let rows = [topology(0.02, false), topology(0.019, false)];
    assert_eq!(preferred(&rows, 0.019, |_, _| 0.01), tie);
}

#[test]
fn no_truth_no_answer() {
    let mut row = topology(0.9, false);
    row.is_truth = None;
    assert_eq!(preferred(&[row], 0.0, |_, _| 0.0), None);
}

fn judged(chains: Vec<ChainOutcome>, exact: Option<Exact>) -> (bool, Option<Answer>) {
    let own = Gathered {
        chains,
        exact,
        ..Gathered::default()
    };
    let mut rng = crate::rng::Purpose::new("posterior", 1).generator();
    let found = answered(own, true, &mut rng);
    (found.is_exact, found.answer)
}

/// Both chains have the truth as their MAP topology, topology 0 of half the mass.
fn at_truth(n: usize) -> Vec<ChainOutcome> {
    let own = |k: usize| chain(&drawn(n, 0, 15, k as u64), 0, k);
    vec![own(1), own(2)]
}

/// Chains that have not converged decide nothing, though every one of them has the truth as its MAP
/// topology; without that check each failure would be put down to the sampler.
#[test]
fn reference_chains_that_have_not_converged_decide_nothing() {
    assert_eq!(judged(at_truth(8000), None), (false, Some(Answer::Truth)));
    let not = Some(Answer::Undecided(Unanswered::NotConverged));
    assert_eq!(judged(at_truth(60), None), (false, not));
    // Each at rest where it is, and not at one place.
    let apart = vec![chain(&[0; 4000], 0, 1), chain(&[5; 4000], 0, 2)];
    assert_eq!(judged(apart, None), (false, not));
    let other = vec![chain(&[5; 4000], 0, 1), chain(&[5; 4000], 0, 2)];
    assert_eq!(judged(other, None), (false, Some(Answer::OtherMap)));
    let none = Some(Answer::Undecided(Unanswered::NoChain));
    assert_eq!(judged(Vec::new(), None), (false, none));
}

#[test]
fn where_the_exact_posterior_stands_it_decides() {
    let exact = |error| Some((vec![topology(0.6, false), topology(0.4, true)], error));
    let found = judged(at_truth(8000), exact(0.01));
    assert_eq!(found, (true, Some(Answer::OtherMap)));
    let tie = Some(Answer::Undecided(Unanswered::Tie));
    assert_eq!(judged(at_truth(8000), exact(0.11)), (true, tie));
    assert_eq!(
        judged(Vec::new(), exact(0.01)),
        (true, Some(Answer::OtherMap))
    );
}
