//! Chains whose effective draws are known, given as draws of somebody else.

use rand::RngExt;

use super::*;
use crate::chain::DrawRecorder;
use crate::partition::Topology;
use crate::rng::Generator;

fn rng(seed: u64) -> Generator {
    Purpose::new("labels test", seed).generator()
}

/// Four chains, drawn by a function of the generator and the last topology's number. Sets of chains
/// with different numbers are independent.
fn chains(
    set: u64,
    topologies: &[[u32; 4]],
    n_draws: u64,
    next: impl Fn(&mut Generator, Option<usize>) -> usize,
) -> Vec<LabelChain> {
    let chain = |number: u64| {
        let (mut rng, mut last) = (rng(number), None);
        let mut recorder = DrawRecorder::new(1000);
        let mut first = None;
        for _ in 0..n_draws {
            let place = next(&mut rng, last);
            last = Some(place);
            let topology = Topology::canonical(&topologies[place]);
            recorder.push(&topology, 0.0, 1);
            first.get_or_insert(topology);
        }
        LabelChain {
            name: format!("chain {number}"),
            trace: recorder.finish(),
            start: first.expect("a draw"),
        }
    };
    (4 * set..4 * set + 4).map(chain).collect()
}

fn ess(result: &LabelsResult) -> Vec<f64> {
    let found = result.convergence.as_ref().expect("four chains");
    let values = found.judged.iter().filter_map(|own| own.ess.value);
    values.collect()
}

const FIVE: [[u32; 4]; 5] = [
    [0, 0, 0, 0],
    [0, 0, 1, 1],
    [0, 1, 0, 1],
    [0, 1, 1, 0],
    [0, 1, 2, 3],
];

/// Independent draws, each repeated k times, are worth one draw in k. A record keeps 1,000 stretches,
/// so a chain has fewer.
#[test]
fn repeated_independent_draws_count_once() {
    for k in [1, 5, 20] {
        let n = 800 * k;
        let counter = std::cell::Cell::new(0_u64);
        let next = |rng: &mut Generator, last: Option<usize>| {
            counter.set(counter.get() + 1);
            match last {
                Some(last) if counter.get() % k != 1 % k => last,
                _ => rng.random_range(0..FIVE.len()),
            }
        };
        let result = diagnose_labels(chains(0, &FIVE, n, next), BurnInRule::Fixed(0), &|_| ());
        let found = result.convergence.as_ref().expect("four chains");
        assert_eq!(found.verdict, "mixes", "{k}: {:?}", found.doubts);
        let ess = ess(&result);
        let mean = ess.iter().sum::<f64>() / ess.len() as f64;
        let expected = 4.0 * 800.0;
        assert!(
            ess.len() > 5 && (mean / expected - 1.0).abs() < 0.1,
            "{k}: {ess:?}"
        );
        // M has the mean (1 + 2 + 2 + 2 + 4)/5.
        assert!((result.expected_number_of_sets - 2.2).abs() < 0.1);
    }
}

/// A walk between two modes that changes with probability q at each draw has the autocorrelation
/// (1 − 2q)^t: n draws are worth n·q/(1 − q).
#[test]
fn a_lazy_walk_between_two_modes_has_its_known_worth() {
    let modes = [[0, 0, 1, 1], [0, 1, 0, 1]];
    for (q, n) in [(0.2, 4000), (0.02, 40_000)] {
        let next = |rng: &mut Generator, last: Option<usize>| match last {
            None => rng.random_range(0..2),
            Some(last) if rng.random::<f64>() < q => 1 - last,
            Some(last) => last,
        };
        let expected = 4.0 * n as f64 * q / (1.0 - q);
        // One estimate has a standard deviation of some 6 %.
        let n_sets = 16;
        let mut mean = 0.0;
        for set in 0..n_sets {
            let chains = chains(set, &modes, n, next);
            let result = diagnose_labels(chains, BurnInRule::Fixed(0), &|_| ());
            assert_eq!(result.n_topologies, 2);
            mean += ess(&result)[0] / n_sets as f64;
        }
        assert!(
            (mean / expected - 1.0).abs() < 0.05,
            "{q}: {mean} {expected}"
        );
    }
}

/// Two chains in each of two modes: M says nothing, the topologies do.
#[test]
fn chains_in_different_modes_have_not_converged() {
    let modes = [[0, 0, 1, 1], [0, 1, 0, 1], [0, 0, 1, 2], [0, 1, 0, 2]];
    let number = std::cell::Cell::new(0_usize);
    let next = |rng: &mut Generator, last: Option<usize>| {
        if last.is_none() {
            number.set(number.get() + 1);
        }
        number.get() % 2 + 2 * rng.random_range(0..2)
    };
    let result = diagnose_labels(chains(0, &modes, 5000, next), BurnInRule::Auto, &|_| ());
    let found = result.convergence.expect("four chains");
    assert_eq!(found.verdict, "not-shown");
    assert!(found.n_sets.r_hat.value.expect("it varies") < 1.01);
}
