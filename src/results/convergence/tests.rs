//! Chains whose convergence is known, judged.

use rand::RngExt;

use super::*;
use crate::chain::TopologyCount;
use crate::diagnostics::trace_bins::TraceBins;
use crate::partition::{Partitions, Topology};
use crate::results::Verdict;
use crate::rng::{Generator, Purpose};
use crate::run::{
    ChainChecks, ChainSeries, ExactComparison, ExactDistance, ExactQuantity, Journey, MserBurnIns,
    PairSeries, ProbeOutcome, TopTopology,
};

/// The topologies of four detections: 15 of them.
fn topology(k: usize) -> Topology {
    Partitions::of(4).nth(k).expect("fewer than 15")
}

/// A chain that started at topology `start` and was at these topologies, one step each, the first
/// `burn_in` of which are left out of its record; topology 0 is the truth.
pub(in crate::results) fn chain(at: &[usize], burn_in: usize, start: usize) -> ChainOutcome {
    let kept = &at[burn_in..];
    let mut series = ChainSeries {
        first_step: burn_in as u64,
        stride: 1,
        lengths: vec![1; kept.len()],
        n_sets: kept.iter().map(|&k| topology(k).n_sets() as u32).collect(),
        ln_target: kept.iter().map(|&k| -(k as f64)).collect(),
        topology: kept.iter().map(|&k| k as u32).collect(),
        topologies: (0..15).map(|k| topology_identity(&topology(k))).collect(),
        map_distance: Vec::new(),
        together: Vec::new(),
        unsure_pairs: Vec::new(),
    };
    let mut counts: Vec<TopologyCount> = (0..15)
        .map(|k| TopologyCount {
            topology: topology(k),
            count: kept.iter().filter(|at| **at == k).count() as u64,
        })
        .filter(|row| row.count > 0)
        .collect();
    counts.sort_by(|a, b| {
        b.count
            .cmp(&a.count)
            .then_with(|| a.topology.cmp(&b.topology))
    });
    series.together = vec![(0, 1, 0.5)];
    let truth = topology(0);
    let map = (0..15).find(|k| topology(*k) == counts[0].topology);
    let (mut hold, mut longest_hold_elsewhere) = (0, 0);
    for (step, own) in at.iter().enumerate() {
        hold = if step > 0 && at[step - 1] == *own {
            hold + 1
        } else {
            1
        };
        if Some(*own) != map {
            longest_hold_elsewhere = longest_hold_elsewhere.max(hold);
        }
    }
    let arrival = at.iter().position(|own| Some(*own) == map);
    let journey = Journey {
        start: topology_identity(&topology(start)),
        arrival: arrival.map_or(at.len(), |step| step) as u64,
        longest_hold_elsewhere,
    };
    let top = counts.iter().take(10).map(|row| TopTopology {
        labels: row.topology.to_string(),
        n_sets: row.topology.n_sets() as u64,
        count: row.count,
        frequency: row.count as f64 / kept.len() as f64,
        is_truth: Some(row.topology == truth),
    });
    ChainOutcome {
        n_detections: 4,
        n_landmarks: Some(truth.n_sets() as u64),
        n_steps: at.len() as u64,
        moves: Vec::new(),
        acceptance_rate: 0.5,
        evaluated_share: 1.0,
        underflow_share: None,
        tempering: None,
        burn_in: Some(burn_in as u64),
        burn_in_reason: String::new(),
        mser: MserBurnIns::default(),
        mean_n_sets: 0.0,
        sd_n_sets: 0.0,
        last_n_sets: 1,
        mean_ln_target: 0.0,
        ess_n_sets: None,
        ess_ln_target: None,
        n_topologies: counts.len() as u64,
        count_error_bound: 0,
        recovered: Some(counts[0].topology == truth),
        top: top.collect(),
        first_at_truth: None,
        truth_mass: None,
        adjusted_rand_index: None,
        unknown_share: None,
        n_unknown_merged: None,
        exact: ExactComparison::Not {
            reason: String::new(),
        },
        n_sets_bins: TraceBins::default(),
        checks: ChainChecks::default(),
        journey,
        probes: Vec::new(),
        coupling: None,
        series,
    }
}

fn rng(number: u64) -> Generator {
    Purpose::new("convergence", number).generator()
}

/// Independent draws: topology `first` half the time, else any up to `most`.
pub(in crate::results) fn drawn(n: usize, first: usize, most: usize, number: u64) -> Vec<usize> {
    let mut rng = rng(number);
    let draw = |_| {
        if rng.random::<f64>() < 0.5 {
            first
        } else {
            rng.random_range(0..most)
        }
    };
    (0..n).map(draw).collect()
}

pub(in crate::results) fn judged(chains: &[ChainOutcome]) -> Diagnosis {
    let chains: Vec<&ChainOutcome> = chains.iter().collect();
    diagnose(&chains, &mut rng(9)).expect("chains")
}

fn words(diagnosis: &Diagnosis) -> Vec<String> {
    match &diagnosis.convergence {
        Convergence::Not(doubts) => doubts.iter().map(Doubt::word).collect(),
        shown => vec![shown.name().to_owned()],
    }
}

/// A chain with probes: those that came to its MAP topology, and those that did not.
fn probed(mut chain: ChainOutcome, n_came: usize, n_lost: usize) -> ChainOutcome {
    let probe = |nearest| ProbeOutcome {
        n_steps: 10,
        nearest,
        bound: 0.2,
    };
    chain.probes = vec![probe(0.2); n_came];
    chain.probes.extend(vec![probe(0.21); n_lost]);
    chain
}

#[test]
fn chains_of_one_law_mix_and_their_numbers_are_those_of_independent_draws() {
    let found = judged(&[
        chain(&drawn(8000, 0, 15, 1), 0, 3),
        chain(&drawn(8000, 0, 15, 2), 500, 9),
    ]);
    assert_eq!(words(&found), ["mixes"]);
    assert_eq!((found.first_step, found.n_steps), (500, 7500));
    let ess = found.ln_target.ess_bulk.expect("it moves");
    assert!((ess / 15000.0 - 1.0).abs() < 0.2, "{ess}");
    assert!((found.ess_topologies / 15000.0 - 1.0).abs() < 0.2);
    let (mean, mcse) = (found.at_map.mean, found.at_map.mcse);
    // ½ + ½/15.
    let off = mean.expect("draws") - 0.5333;
    assert!(off.abs() < 4.0 * mcse.expect("it moves"), "{off} {mcse:?}");
    assert_eq!(found.n_holding.expect("counts").n, 14);
    assert_eq!(found.unseen.expect("an ESS").mass, 0.0);
    assert_eq!(Verdict::of_world(Some(&found), true, 0), Verdict::Recovered);
    // M and topology 0 are material; the fourteen others have 3 % each.
    let quantities: Vec<Quantity> = found.judged.iter().map(|own| own.quantity).collect();
    assert_eq!(quantities, [Quantity::NSets, Quantity::Topology(1)]);
}

#[test]
fn chains_of_different_laws_do_not_agree() {
    let found = judged(&[
        chain(&drawn(3000, 0, 15, 1), 0, 3),
        chain(&drawn(3000, 9, 15, 2), 0, 9),
    ]);
    let words = words(&found);
    assert!(words.contains(&"r-hat of topology".to_owned()), "{words:?}");
    assert!(words.contains(&"topologies".to_owned()), "{words:?}");
    // One of the two has the truth as its MAP topology.
    assert_eq!(Verdict::of_world(Some(&found), true, 0), Verdict::ByLuck);
    assert_eq!(
        Verdict::of_world(Some(&found), false, 0),
        Verdict::NotConverged
    );
}

/// Fifteen topologies of which 4, 7 and 9 have two sets of two detections: M and ln target may say
/// nothing while the chains stand at different ones.
#[test]
fn chains_frozen_at_different_topologies_of_one_m_have_not_converged() {
    let pairings: Vec<usize> = (0..15)
        .filter(|k| topology(*k).sets().iter().all(|set| set.len() == 2))
        .collect();
    assert_eq!(pairings.len(), 3);
    let frozen = |at: usize, number| {
        let mut frozen = chain(&vec![pairings[at]; 8000], 0, 14);
        // Refresh moves alone change ln target, by one law in every chain.
        let noise = drawn(8000, 0, 15, number);
        frozen.series.ln_target = noise.iter().map(|k| *k as f64).collect();
        frozen
    };
    let found = judged(&[frozen(0, 1), frozen(1, 2), frozen(0, 3), frozen(1, 4)]);
    assert_eq!(found.n_sets.mean, Ok(2.0));
    assert!(found.ln_target.r_hat.is_ok_and(|value| value < 1.01));
    assert_eq!(words(&found)[0], "stuck-disagree topology");
}

/// A pair that two chains treat alike on average, but each half of the time in one long stretch.
#[test]
fn a_pair_that_hardly_changes_is_doubted_though_m_mixes() {
    let slow = |shift: usize, number| {
        // All of M = 2 or 3: the topology changes all the time and none has 5 %.
        let mut slow = chain(&drawn(8000, 5, 15, number), 0, shift);
        let together = (0..8000).map(|k| (k / 2000 + shift).is_multiple_of(2));
        slow.series.unsure_pairs = vec![PairSeries::new((0, 1), together)];
        slow
    };
    let found = judged(&[slow(0, 1), slow(1, 2)]);
    let words = words(&found);
    assert!(
        words.iter().any(|word| word.ends_with(" pair")),
        "{words:?}"
    );
    // A chain that is unsure of other pairs has no series of this one, and it is not judged.
    let mut other = slow(1, 2);
    other.series.unsure_pairs.clear();
    other.series.together = vec![(0, 1, 0.5)];
    let found = judged(&[slow(0, 1), other]);
    assert!(found.judged.iter().all(|own| own.quantity.word() != "pair"));
}

/// Draws that never repeat a topology are as far apart as can be, by any law, and say nothing.
#[test]
fn a_distance_of_topologies_that_never_repeat_is_no_doubt() {
    let scattered = |offset: usize, number| {
        let mut own = chain(&drawn(4000, 5, 15, number), 0, offset);
        own.series.topology = (0..4000).collect();
        own.series.topologies = (0..4000).map(|k| format!("{}", 2 * k + offset)).collect();
        own
    };
    let found = judged(&[scattered(0, 1), scattered(1, 2)]);
    assert_eq!(words(&found), ["mixes"]);
    // Beside the verdict it is not shown either.
    let state = found.topologies.map(|_| ()).map_err(|reason| reason.name());
    assert!(state.is_ok() || state == Err("not-judged"), "{state:?}");
}

#[test]
fn too_few_draws_are_named() {
    // Each draw three times: a third as many are effective.
    let slow = |n: usize, number| {
        let draws = drawn(n / 3, 0, 15, number);
        draws
            .iter()
            .flat_map(|draw| [*draw; 3])
            .collect::<Vec<usize>>()
    };
    let short = |n| judged(&[chain(&slow(n, 3), 0, 3), chain(&slow(n, 4), 0, 9)]);
    assert_eq!(words(&short(99)), ["too-short"]);
    let found = short(150);
    let words = words(&found);
    assert!(
        words.iter().any(|word| word.starts_with("ess of")),
        "{words:?}"
    );
    // Rest is no better from few draws.
    let rest = judged(&[chain(&[5; 99], 0, 3), chain(&[5; 99], 0, 9)]);
    assert_eq!(rest.convergence.doubts().len(), 1);
    assert_eq!(rest.convergence.doubts()[0].word(), "too-short");
}

#[test]
fn standing_still_apart_is_no_convergence() {
    let found = judged(&[chain(&[0; 300], 0, 0), chain(&[14; 300], 0, 14)]);
    assert_eq!(
        found.n_sets.r_hat.map_err(|reason| reason.name()),
        Err("stuck-disagree")
    );
    // The mean is known all the same.
    assert_eq!(found.n_sets.mean, Ok(2.5));
    let words = words(&found);
    assert!(words.contains(&"stuck-disagree M".to_owned()), "{words:?}");
    assert_eq!(
        found.unseen.map_err(|reason| reason.name()),
        Err("too-rare")
    );
    let topologies = found.topologies.expect("two chains");
    assert!(topologies.total_variation.largest > 0.99);
}

#[test]
fn rest_at_one_topology_counts_for_chains_that_came_there() {
    let rarely = |k: usize| if k % 40 == 7 { 3 } else { 5 };
    let at: Vec<usize> = (0..800).map(rarely).collect();
    let mut stuck_estimate = chain(&[5; 800], 0, 2);
    stuck_estimate.series.ln_target = vec![-9.0; 800];
    let rest = judged(&[chain(&at, 0, 1), stuck_estimate]);
    assert_eq!(words(&rest), ["at-rest"]);
    assert_eq!(Verdict::of_world(Some(&rest), false, 0), Verdict::WrongMap);
    // What would read as speaking against the verdict is left out, with its reason.
    assert_eq!(
        rest.ln_target.r_hat.map_err(|reason| reason.name()),
        Err("not-judged")
    );
    // Chains that were all there from the start say nothing, but for their probes.
    let stuck = |n_came, n_lost| {
        let one = probed(chain(&[5; 800], 0, 5), n_came, n_lost);
        words(&judged(&[chain(&at, 0, 5), one]))
    };
    assert_eq!(stuck(0, 0), ["one-start"]);
    assert_eq!(stuck(4, 0), ["at-rest"]);
    assert_eq!(stuck(3, 1), ["probes"]);
    // Nor does a chain that leaves it for more than a tenth.
    let often: Vec<usize> = (0..800)
        .map(|k| if k % 8 == 7 { k / 8 % 5 } else { 5 })
        .collect();
    let found = judged(&[chain(&often, 0, 1), chain(&[5; 800], 0, 2)]);
    assert!(!found.convergence.is_shown());
}

#[test]
fn rest_must_outlast_what_held_a_chain_elsewhere() {
    // The burn-in takes what held the chain from the record, not from its journey.
    let held = |n: usize| {
        let at: Vec<usize> = (0..1000).map(|k| if k < n { 3 } else { 5 }).collect();
        words(&judged(&[chain(&at, n, 3), chain(&[5; 1000], 0, 2)]))
    };
    assert_eq!(held(47), ["at-rest"]);
    assert_eq!(held(48), ["late"]);
    let short = judged(&[chain(&[5; 499], 0, 3), chain(&[5; 499], 0, 2)]);
    assert_eq!(words(&short), ["late"]);
}

#[test]
fn a_lost_probe_withholds_what_mixes() {
    let with = |n_lost| {
        let one = probed(chain(&drawn(8000, 0, 15, 1), 0, 3), 4, n_lost);
        words(&judged(&[one, chain(&drawn(8000, 0, 15, 2), 0, 9)]))
    };
    assert_eq!(with(0), ["mixes"]);
    assert_eq!(with(1), ["probes"]);
}

#[test]
fn where_the_exact_posterior_is_known_it_decides() {
    let compared = |start: usize, sampled: f64| {
        let mut own = chain(&[5; 800], 0, start);
        own.exact = ExactComparison::Compared(ExactDistance {
            total_variation: 0.0,
            table_error: 0.0,
            effective_samples: None,
            expected: None,
            high: None,
            top: Vec::new(),
            quantities: vec![
                ExactQuantity {
                    exact: 0.5,
                    sampled,
                },
                ExactQuantity {
                    exact: 1.0,
                    sampled: 1.0,
                },
            ],
        });
        own
    };
    // Two chains: 2.5 √(¼/200) = .088 apart at most.
    let with = |a, b| words(&judged(&[compared(1, a), compared(2, b)]));
    assert_eq!(with(0.2, 0.8), ["exact"]);
    assert_eq!(with(0.57, 0.60), ["exact"]);
    assert_eq!(with(0.57, 0.61), ["far-from-exact"]);
    // By the rule all four would be at rest.
    let wrong = judged(&[compared(1, 1.0), compared(2, 1.0)]);
    assert_eq!(wrong.by_rule, Convergence::AtRest);
    let doubt = wrong.convergence.doubts()[0];
    assert!(
        matches!(doubt, Doubt::Exact { exact, .. } if exact == 0.5),
        "{doubt:?}"
    );
    // Without a comparison in every chain the rule decides.
    let found = judged(&[compared(1, 1.0), chain(&[5; 800], 0, 2)]);
    assert_eq!(words(&found), ["at-rest"]);
}

#[test]
fn one_chain_or_none() {
    let one = judged(&[chain(&drawn(8000, 0, 15, 1), 0, 3)]);
    assert_eq!(words(&one), ["one-chain"]);
    assert_eq!(
        one.topologies.map_err(|reason| reason.name()),
        Err("too-few")
    );
    assert!(one.n_sets.r_hat.is_ok());
    assert!(diagnose(&[], &mut rng(1)).is_none());
}

#[test]
fn starts_that_all_ended_here_leave_a_share_that_may_not() {
    let percent = |k| (100.0 * most_elsewhere(k)).round() as u64;
    assert_eq!((percent(4), percent(8)), (53, 31));
}
