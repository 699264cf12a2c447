//! Known answers, and how often the intervals hold the true rate.

use super::*;
use crate::rng::Purpose;
use rand::RngExt;

#[test]
fn the_unit_is_the_world() {
    let agree = recovery_rate(&[vec![true; 50], vec![false; 50]], true).expect("outcomes");
    assert_eq!(
        (agree.rate, agree.kind, agree.n),
        (0.5, IntervalKind::Worlds, 2)
    );
    // A hundred chains say no more than two worlds.
    assert_eq!(agree.interval, clopper_pearson(1.0, 2.0));
    let differ = recovery_rate(&[vec![true, false], vec![true; 2], vec![]], true);
    let differ = differ.expect("outcomes");
    assert_eq!(
        (differ.rate, differ.kind, differ.n),
        (0.75, IntervalKind::EffectiveTrials, 2)
    );
    // Two worlds say so little of their spread that no more than two trials count.
    assert_eq!(differ.interval, clopper_pearson(1.5, 2.0));
    let lone = recovery_rate(&[vec![true, false]], true).expect("outcomes");
    assert_eq!(lone.interval, clopper_pearson(0.5, 1.0));
    let csv = recovery_rate(&[vec![true; 4]], false).expect("outcomes");
    assert_eq!(
        (csv.kind, csv.n, csv.interval),
        (IntervalKind::SamplerOnly, 4, clopper_pearson(4.0, 4.0))
    );
    let halves = recovery_rate(&vec![vec![true, false]; 5], true).expect("outcomes");
    assert_eq!((halves.rate, halves.kind), (0.5, IntervalKind::Worlds));
    assert_eq!(halves.interval, clopper_pearson(2.5, 5.0));
    assert_eq!(recovery_rate(&[], true), None);
}

/// By hand: shares ½ of eighteen worlds and 1 of two, of two chains each, have the mean 0.55 and
/// the variance 0.45/19, which is worth 209 trials; (1.959964/2.093024)² takes that down to 183,
/// still more than the 40 chains.
#[test]
fn effective_trials_lie_between_worlds_and_chains() {
    let close = |a: Interval, b: Interval| {
        assert!(
            (a.low - b.low).abs() < 1e-6 && (a.high - b.high).abs() < 1e-6,
            "{a:?} {b:?}"
        );
    };
    let mut worlds = vec![vec![true, false]; 18];
    worlds.extend([vec![true, true], vec![true, true]]);
    let found = recovery_rate(&worlds, true).expect("outcomes");
    assert_eq!(found.kind, IntervalKind::EffectiveTrials);
    close(found.interval, clopper_pearson(22.0, 40.0));
    // 0, ½ and 1 in equal parts of thirty: s² = 5/29, n_eff = 0.25 / (5/870) · (1.959964/2.045230)²
    // = 39.9487.
    let parts = [vec![false, false], vec![true, false], vec![true, true]];
    let worlds: Vec<Vec<bool>> = (0..30).map(|world| parts[world % 3].clone()).collect();
    let found = recovery_rate(&worlds, true).expect("outcomes");
    close(found.interval, clopper_pearson(0.5 * 39.948_7, 39.948_7));
}

#[test]
fn no_rate_is_known_without_error() {
    for (n, chains) in [(1, 1), (1, 5), (3, 2), (40, 2)] {
        for all in [false, true] {
            let rate = recovery_rate(&vec![vec![all; chains]; n], true).expect("outcomes");
            let error = rate.error();
            assert!((error - least_error(n as f64)).abs() < 1e-12 && error > 0.0);
        }
    }
    // One chain of eighty that fails leaves a rate near 1 with an error, too.
    let mut worlds = vec![vec![true; 2]; 40];
    worlds[7][1] = false;
    let found = recovery_rate(&worlds, true).expect("outcomes");
    let interval = found.interval;
    assert!(interval.high < 1.0 && interval.low > 0.9, "{interval:?}");
    assert!(found.error() > least_error(80.0));
}

/// Exact, where the chains of every world agree: the probability that the interval holds p, for 5
/// to 40 worlds and 999 values of p, and just beside each end of an interval, where the coverage is
/// least.
#[test]
fn covers_at_least_95_percent_of_experiments_whatever_the_rate() {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    let mut least = (1.0, 0, 0.0);
    for n in 5..=40_usize {
        let outcomes = |k: usize| -> Vec<Vec<bool>> { (0..n).map(|w| vec![w < k; 2]).collect() };
        let intervals: Vec<Interval> = (0..=n)
            .map(|k| {
                recovery_rate(&outcomes(k), true)
                    .expect("outcomes")
                    .interval
            })
            .collect();
        let grid = (1..1000).map(|k| f64::from(k) / 1000.0);
        let ends = intervals.iter().flat_map(|i| [i.low, i.high]);
        let beside = ends.flat_map(|p| [p - 1e-9, p + 1e-9]);
        for p in grid.chain(beside).filter(|p| *p > 0.0 && *p < 1.0) {
            let probability = |k: usize| {
                let ln_choose = ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k);
                libm::exp(ln_choose + k as f64 * libm::log(p) + (n - k) as f64 * libm::log1p(-p))
            };
            let holds = |k: &usize| intervals[*k].low <= p && p <= intervals[*k].high;
            let coverage: f64 = (0..=n).filter(holds).map(probability).sum();
            if coverage < least.0 {
                least = (coverage, n, p);
            }
        }
    }
    assert!(least.0 >= 0.95 && least.0 < 0.96, "{least:?}");
}

/// Worlds whose probability of success has the law Beta(μk, (1 − μ)k), from all but equal (k = 49)
/// to nearly 0 or 1 (k = 1/9). Of 4,000 experiments at least 95 % less three binomial standard
/// errors hold μ.
#[test]
fn covers_however_much_worlds_differ() {
    let mut rng = Purpose::new("test", 11).generator();
    let n_experiments = 4000;
    let least = 0.95 - 3.0 * (0.95_f64 * 0.05 / f64::from(n_experiments)).sqrt();
    let mut known = std::collections::HashMap::new();
    for (n_worlds, n_chains) in [(5, 2), (8, 3), (10, 4), (20, 10), (40, 2)] {
        for k in [49.0, 7.0 / 3.0, 1.0 / 9.0] {
            for mean in [0.5, 0.8, 0.9, 0.97] {
                let law = rand_distr::Beta::new(mean * k, (1.0 - mean) * k).expect("positive");
                let mut held = 0;
                for _ in 0..n_experiments {
                    let mut counts: Vec<usize> = (0..n_worlds)
                        .map(|_| {
                            let p: f64 = rand_distr::Distribution::sample(&law, &mut rng);
                            (0..n_chains).filter(|_| rng.random::<f64>() < p).count()
                        })
                        .collect();
                    // The interval is the same in any order of worlds.
                    counts.sort_unstable();
                    let interval = *known.entry((n_chains, counts)).or_insert_with_key(|key| {
                        let world = |n: &usize| (0..n_chains).map(|c| c < *n).collect();
                        let worlds: Vec<Vec<bool>> = key.1.iter().map(world).collect();
                        recovery_rate(&worlds, true).expect("outcomes").interval
                    });
                    held += u32::from(interval.low <= mean && mean <= interval.high);
                }
                let share = f64::from(held) / f64::from(n_experiments);
                assert!(share > least, "{n_worlds} {n_chains} {k} {mean}: {share}");
            }
        }
    }
}
