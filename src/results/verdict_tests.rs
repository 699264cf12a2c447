//! The rules of verdicts, by their numbers.

use super::*;
use Verdict::{ByLuck, Failed, Missing, NotConverged, Recovered, WrongMap};

fn of(counts: &[(Verdict, usize)]) -> WorldsByVerdict {
    let worlds: Vec<Verdict> = (counts.iter())
        .flat_map(|(verdict, n)| vec![*verdict; *n])
        .collect();
    WorldsByVerdict::new(&worlds, false)
}

#[test]
fn a_cell_has_the_verdict_of_most_of_its_worlds_and_the_worst_of_a_tie() {
    let verdict = |counts: &[(Verdict, usize)]| of(counts).verdict();
    assert_eq!(
        verdict(&[(Recovered, 2), (NotConverged, 3)]),
        NotConverged.into()
    );
    assert_eq!(verdict(&[(Recovered, 1), (ByLuck, 1)]), ByLuck.into());
    assert_eq!(verdict(&[(Failed, 1), (NotConverged, 1)]), Failed.into());
    assert_eq!(verdict(&[]), Missing.into());
}

/// Of a cell that recovers 60 % of its worlds, or the most of them by a plurality, nothing is
/// to be relied on.
#[test]
fn a_good_verdict_needs_more_than_a_plurality() {
    for (good, others) in [(3, 2), (2, 1), (4, 1), (2, 0), (4, 0), (6, 2), (25, 15)] {
        let own = of(&[(Recovered, good), (NotConverged, others)]);
        assert_eq!(own.verdict(), CellVerdict::Undecided, "{good} {others}");
        assert!(own.share_at_least(Recovered) < 0.5);
    }
    let plurality = of(&[
        (Recovered, 2),
        (ByLuck, 1),
        (WrongMap, 1),
        (NotConverged, 1),
    ]);
    assert_eq!(plurality.verdict(), CellVerdict::Undecided);
    // The numbers that the documents name, and one less.
    for (good, n) in [(5, 5), (7, 8), (9, 10), (15, 20), (26, 40)] {
        let own = |good| of(&[(Recovered, good), (NotConverged, n - good)]);
        assert_eq!(own(good).verdict(), Recovered.into(), "{good} of {n}");
        assert!(own(good).share_at_least(Recovered) > 0.5);
        assert_eq!(own(good - 1).verdict(), CellVerdict::Undecided);
    }
    // A world that was not run says nothing; one that failed was not recovered.
    assert_eq!(
        of(&[(Recovered, 5), (Missing, 4)]).verdict(),
        Recovered.into()
    );
    assert_eq!(
        of(&[(Recovered, 5), (Failed, 2)]).verdict(),
        CellVerdict::Undecided
    );
}

/// Converged chains are what a reader without truth goes by.
#[test]
fn wrong_maps_take_the_trust_from_the_right_ones() {
    let own = of(&[(Recovered, 17), (WrongMap, 3)]);
    assert_eq!(own.verdict(), CellVerdict::Undecided);
    assert_eq!(
        of(&[(Recovered, 18), (WrongMap, 1)]).verdict(),
        CellVerdict::Undecided
    );
    assert_eq!(
        of(&[(Recovered, 19), (WrongMap, 1)]).verdict(),
        Recovered.into()
    );
    // Worlds without convergence do not hide wrong maps.
    let own = of(&[(Recovered, 18), (WrongMap, 1), (NotConverged, 5)]);
    assert_eq!(own.verdict(), CellVerdict::Undecided);
}

/// There is nothing to generalise to.
#[test]
fn the_only_world_has_its_own_verdict() {
    let only = WorldsByVerdict::new(&[Recovered], true);
    assert_eq!(only.verdict(), Recovered.into());
    assert_eq!(
        only.verdict_words(),
        "recovered and converged: the one data set"
    );
    let one_of_many = WorldsByVerdict::new(&[Recovered], false);
    assert_eq!(one_of_many.verdict(), CellVerdict::Undecided);
    assert_eq!(one_of_many.split(), "1 world recovered and converged");
}

#[test]
fn the_split_has_all_worlds() {
    let own = of(&[(NotConverged, 2), (Recovered, 3)]);
    assert_eq!(
        own.split(),
        "3 of 5 worlds recovered and converged, 2 not converged"
    );
    assert_eq!(of(&[(ByLuck, 4)]).split(), "all 4 worlds recovered by luck");
    assert_eq!(
        own.verdict_words(),
        "undecided: 3 of 5 worlds recovered and converged, 2 not converged"
    );
    let bad = of(&[(NotConverged, 3), (Recovered, 1), (ByLuck, 1)]);
    assert_eq!(
        bad.verdict_words(),
        "not converged: 3 of 5 worlds, 1 recovered and converged, 1 recovered by luck"
    );
    let good = of(&[(Recovered, 5)]);
    assert_eq!(
        good.verdict_words(),
        "recovered and converged: all 5 worlds"
    );
    assert_eq!(of(&[]).verdict_words(), "missing: no world");
}

/// By the table of `suffice`: 3 of 3 need two more (5 of 5); 4 of 5 need three (7 of 8), and at
/// 80 % ten worlds are too few (8 of 10: 0.055), eleven (8) too, twelve (9: 0.073) and thirteen
/// (10: 0.046) are enough.
#[test]
fn more_worlds_that_would_settle_it() {
    let own = of(&[(Recovered, 3)]);
    assert_eq!(
        own.to_settle(),
        ToSettle {
            at_best: 2,
            in_all: Some(5)
        }
    );
    let own = of(&[(Recovered, 4), (NotConverged, 1)]);
    assert_eq!(
        own.to_settle(),
        ToSettle {
            at_best: 3,
            in_all: Some(13)
        }
    );
    // Of half, or of a plurality, more of the same do not help.
    let own = of(&[(Recovered, 2), (ByLuck, 1), (WrongMap, 1)]);
    assert_eq!(own.to_settle().in_all, None);
    assert_eq!(own.to_settle().at_best, 7);
}

/// Exact: at most half of all worlds are good; how often is a cell relied on? Whatever the
/// number of worlds up to 60.
#[test]
fn a_cell_is_relied_on_wrongly_in_at_most_one_of_twenty() {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    let half = |n: usize, k: usize| {
        let ln_choose = ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k);
        libm::exp(ln_choose - n as f64 * std::f64::consts::LN_2)
    };
    for n in 1..=60 {
        let relied_on: f64 = (0..=n)
            .filter(|k| {
                let own = of(&[(Recovered, *k), (NotConverged, n - k)]);
                own.verdict() == Recovered.into()
            })
            .map(|k| half(n, k))
            .sum();
        assert!(relied_on <= 0.05, "{n}: {relied_on}");
        assert_eq!(relied_on > 0.0, n >= 5, "{n}");
    }
}

#[test]
fn a_world_without_chains_is_failed_or_missing() {
    assert_eq!(Verdict::of_world(None, false, 2), Verdict::Failed);
    assert_eq!(Verdict::of_world(None, false, 0), Verdict::Missing);
}

#[test]
fn places_are_those_of_the_list() {
    for (place, verdict) in CellVerdict::ALL.into_iter().enumerate() {
        assert_eq!(verdict.place(), place);
    }
}
