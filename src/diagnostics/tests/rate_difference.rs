//! Known answers, and the level that the tests hold.

use super::*;

/// One chain a world.
fn lone(recovered: &[bool]) -> Vec<Vec<bool>> {
    recovered.iter().map(|one| vec![*one]).collect()
}

fn first(n_recovered: usize, n: usize) -> Vec<bool> {
    (0..n).map(|k| k < n_recovered).collect()
}

/// By the hypergeometric law of 28 successes in 20 and 20: 0.013 814; panel (a) of the source
/// report's Figure 7, whose 95 % intervals overlap.
#[test]
fn eighteen_of_twenty_and_ten_of_twenty_are_told_apart() {
    let (a, b) = (vec![first(18, 20)], vec![first(10, 20)]);
    let found = rate_difference(&a, &b, Pairing::OneDataSet, Scope::NewWorlds).expect("chains");
    assert!((found.p_value - 0.013_814).abs() < 1e-6, "{found:?}");
    assert_eq!((found.n, found.test), ([20, 20], RateTest::FisherChains));
    assert!((found.difference + 0.4).abs() < 1e-12);
    // The same of worlds: other ones each.
    let (a, b) = (lone(&first(18, 20)), lone(&first(10, 20)));
    let found = rate_difference(&a, &b, Pairing::OtherWorlds, Scope::NewWorlds).expect("worlds");
    assert!((found.p_value - 0.013_814).abs() < 1e-6, "{found:?}");
    assert_eq!((found.n, found.test), ([20, 20], RateTest::FisherWorlds));
}

/// McNemar's exact test: 8 worlds that only A recovers and 1 that only B does; two-sided 2 (1 + 9)
/// / 2⁹.
#[test]
fn on_the_same_worlds_it_is_mcnemars_test() {
    let a: Vec<bool> = (0..20).map(|k| k < 18).collect();
    let b: Vec<bool> = (0..20).map(|k| (8..18).contains(&k) || k == 19).collect();
    let found = rate_difference(&lone(&a), &lone(&b), Pairing::SameWorlds, Scope::NewWorlds)
        .expect("worlds");
    assert!((found.p_value - 20.0 / 512.0).abs() < 1e-12, "{found:?}");
    assert!((found.least_p_value - 2.0 / 512.0).abs() < 1e-12);
    assert_eq!((found.n, found.test), ([20, 20], RateTest::SignFlip));
    // Worlds that one of them lacks do not count.
    let (mut a, b) = (lone(&a), lone(&b));
    a[0].clear();
    let found = rate_difference(&a, &b, Pairing::SameWorlds, Scope::NewWorlds).expect("worlds");
    assert_eq!(found.n, [19, 19]);
    assert!((found.p_value - 2.0 * 9.0 / 256.0).abs() < 1e-12);
}

/// Fractional shares, by hand: differences ½ on five worlds and 1 on one, all the same way: only
/// the two choices of all signs alike are as far, 2/2⁶. With the 1 the other way the sum is 3
/// halves: all sums |±1±1±1±1±1±2| ≥ 3 of 64.
#[test]
fn shares_of_chains_that_disagree_are_flipped_with_their_size() {
    let a = vec![vec![false, false]; 6];
    let mut b = vec![vec![true, false]; 5];
    b.push(vec![true, true]);
    let found = rate_difference(&a, &b, Pairing::SameWorlds, Scope::NewWorlds).expect("worlds");
    assert!((found.p_value - 2.0 / 64.0).abs() < 1e-12, "{found:?}");
    let (mut a, mut b) = (a, b);
    a[5] = vec![true, true];
    b[5] = vec![false, false];
    let found = rate_difference(&a, &b, Pairing::SameWorlds, Scope::NewWorlds).expect("worlds");
    let far = (0..64_u32)
        .filter(|signs| {
            let sum: i32 = (0..6)
                .map(|k| {
                    let size = if k == 5 { 2 } else { 1 };
                    if signs >> k & 1 == 1 { size } else { -size }
                })
                .sum();
            sum.abs() >= 3
        })
        .count();
    assert!(
        (found.p_value - far as f64 / 64.0).abs() < 1e-12,
        "{found:?}"
    );
}

/// By enumeration of all ways to deal the shares of seven worlds to three and four.
#[test]
fn shares_of_other_worlds_are_dealt_anew() {
    let world = |k: usize| first(k, 4);
    let (a, b): (Vec<_>, Vec<_>) = (
        [4, 3, 4].into_iter().map(world).collect(),
        [0, 1, 2, 0].into_iter().map(world).collect(),
    );
    let found = rate_difference(&a, &b, Pairing::OtherWorlds, Scope::NewWorlds).expect("worlds");
    // As far from 3 · 14/7 = 6 as 11 are the choice of 4, 3 and 4 itself, and that of 0, 0 and 1.
    assert_eq!(found.test, RateTest::Permutation);
    assert!((found.p_value - 2.0 / 35.0).abs() < 1e-12, "{found:?}");
    assert!((found.least_p_value - 2.0 / 35.0).abs() < 1e-12);
    // Many worlds go by the normal law: nearly the same.
    let all: Vec<i64> = (0..60).map(|k| k % 3).collect();
    let (exact, _) = exchange_p_values(&all, 30, 38);
    let (normal, _) = by_the_normal_law(&all, 30, 38);
    // The normal law has no continuity correction: half a step of the exact law is 0.02 here.
    assert!((exact - normal).abs() < 0.03, "{exact} {normal}");
}

#[test]
fn five_worlds_speak_of_themselves_only() {
    let (a, b) = (vec![vec![true; 2]; 5], vec![vec![false; 2]; 5]);
    let of = |n: usize, scope| {
        rate_difference(&a[..n], &b[..n], Pairing::SameWorlds, scope).expect("worlds")
    };
    let few = of(5, Scope::NewWorlds);
    assert_eq!(
        (few.test, few.test.scope()),
        (RateTest::ChainsWithinWorlds, Scope::TheseWorlds)
    );
    assert!((few.p_value - 2.0 / 7776.0).abs() < 1e-12);
    let (a, b) = (vec![vec![true; 2]; 6], vec![vec![false; 2]; 6]);
    let enough = rate_difference(&a, &b, Pairing::SameWorlds, Scope::NewWorlds).expect("worlds");
    assert_eq!(
        (enough.test, enough.p_value),
        (RateTest::SignFlip, 2.0 / 64.0)
    );
    let none: Vec<Vec<bool>> = vec![vec![]; 6];
    assert_eq!(
        rate_difference(&a, &none, Pairing::SameWorlds, Scope::NewWorlds),
        None
    );
}

/// A test that cannot reject whatever comes says so: nothing succeeds, or all does.
#[test]
fn the_least_p_value_tells_which_tests_could_have_found_anything() {
    for recovered in [0, 20] {
        let own = vec![first(recovered, 20)];
        let found = rate_difference(&own, &own, Pairing::OneDataSet, Scope::NewWorlds);
        let found = found.expect("chains");
        assert_eq!((found.p_value, found.least_p_value), (1.0, 1.0));
    }
    let (a, b) = (vec![first(2, 20)], vec![first(0, 20)]);
    let found = rate_difference(&a, &b, Pairing::OneDataSet, Scope::NewWorlds).expect("chains");
    assert!((found.least_p_value - found.p_value).abs() < 1e-12 && found.p_value > 0.4);
}

/// Exact: of all outcomes of 8 worlds of two chains each, drawn with any probabilities, those with
/// p ≤ 0.05 have a probability of at most 0.05, whether worlds are the same or others.
#[test]
fn the_level_is_held() {
    // Chances of 0, 1 or 2 chains of a world that recover; the same law for A and for B.
    for law in [
        [0.5, 0.0, 0.5],
        [0.25, 0.5, 0.25],
        [0.1, 0.1, 0.8],
        [0.02, 0.08, 0.9],
    ] {
        // Of the same worlds only the differences count: −2 to 2, each with its probability.
        let mut of_difference = [0.0; 5];
        for (x, p) in law.iter().enumerate() {
            for (y, q) in law.iter().enumerate() {
                of_difference[2 + x - y] += p * q;
            }
        }
        let mut rejected = 0.0;
        let mut counts = [0_usize; 5];
        each_split(8, 0, &mut counts, &mut |counts| {
            let mut probability = 1.0;
            let (mut a, mut b) = (Vec::new(), Vec::new());
            let mut left = 8;
            for (k, n) in counts.iter().enumerate() {
                for i in 0..*n {
                    probability *= of_difference[k] * (left - i) as f64 / (i + 1) as f64;
                    a.push(first(2_usize.saturating_sub(k), 2));
                    b.push(first(k.saturating_sub(2), 2));
                }
                left -= n;
            }
            let found = rate_difference(&a, &b, Pairing::SameWorlds, Scope::NewWorlds);
            if found.expect("worlds").p_value <= 0.05 {
                rejected += probability;
            }
        });
        assert!(
            rejected > 0.0 && rejected <= 0.05 + 1e-12,
            "{law:?}: {rejected}"
        );
        // Of other worlds: five of A and four of B, by how many have each share.
        let mut rejected = 0.0;
        let mut in_a = [0_usize; 3];
        each_split(5, 0, &mut in_a, &mut |in_a| {
            let mut in_b = [0_usize; 3];
            each_split(4, 0, &mut in_b, &mut |in_b| {
                let mut probability = 1.0;
                let mut worlds = [Vec::new(), Vec::new()];
                for (own, counts, mut left) in [(0, in_a, 5), (1, in_b, 4)] {
                    for (k, n) in counts.iter().enumerate() {
                        for i in 0..*n {
                            probability *= law[k] * (left - i) as f64 / (i + 1) as f64;
                            worlds[own].push(first(k, 2));
                        }
                        left -= n;
                    }
                }
                let [a, b] = &worlds;
                let found = rate_difference(a, b, Pairing::OtherWorlds, Scope::NewWorlds);
                if found.expect("worlds").p_value <= 0.05 {
                    rejected += probability;
                }
            });
        });
        assert!(rejected <= 0.05 + 1e-12, "{law:?}: {rejected}");
    }
}

/// Calls back with every way to split `n` units over the places from `place` on.
fn each_split<const K: usize>(
    n: usize,
    place: usize,
    counts: &mut [usize; K],
    found: &mut dyn FnMut(&[usize; K]),
) {
    if place + 1 == K {
        counts[place] = n;
        found(counts);
        return;
    }
    for own in 0..=n {
        counts[place] = own;
        each_split(n - own, place + 1, counts, found);
    }
}

/// 30 of 50 successes among the first 50 of 100: five more than their mean, by a hypergeometric law of
/// variance 50·50·25/(99·100).
#[test]
fn many_worlds_are_told_apart_by_the_variance_of_their_sum() {
    let all: Vec<i64> = (0..100).map(|k| i64::from(k < 50)).collect();
    let (p_value, _) = by_the_normal_law(&all, 50, 30);
    assert!((p_value - 0.046_593_703).abs() < 1e-8, "{p_value}");
}
