//! Chains whose convergence is known, judged.

use rand::RngExt;

use super::*;
use crate::chain::TopologyCount;
use crate::diagnostics::trace_bins::TraceBins;
use crate::partition::{Partitions, Topology};
use crate::results::Verdict;
use crate::rng::{Generator, Purpose};
use crate::run::{ChainChecks, ChainSeries, ExactComparison, MserBurnIns, TopTopology};

/// The topologies of four detections: 15 of them.
fn topology(k: usize) -> Topology {
    Partitions::of(4).nth(k).expect("fewer than 15")
}

/// A chain that was at these topologies, one step each, the first `burn_in` of which are left out of
/// its record; topology 0 is the truth.
pub(in crate::results) fn chain(at: &[usize], burn_in: usize, came_to_map: bool) -> ChainOutcome {
    let kept = &at[burn_in..];
    let mut series = ChainSeries {
        first_step: burn_in as u64,
        stride: 1,
        lengths: vec![1; kept.len()],
        n_sets: kept.iter().map(|&k| topology(k).n_sets() as u32).collect(),
        ln_target: kept.iter().map(|&k| -(k as f32)).collect(),
        topology: kept.iter().map(|&k| k as u32).collect(),
        topologies: (0..15).map(|k| topology_identity(&topology(k))).collect(),
        map_distance: Vec::new(),
        together: Vec::new(),
        came_to_map,
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

#[test]
fn chains_of_one_law_mix_and_their_numbers_are_those_of_independent_draws() {
    let found = judged(&[
        chain(&drawn(4000, 0, 15, 1), 0, true),
        chain(&drawn(4000, 0, 15, 2), 500, true),
    ]);
    assert_eq!(words(&found), ["mixes"]);
    assert_eq!((found.first_step, found.n_steps), (500, 3500));
    let ess = found.ln_target.ess_bulk.expect("it moves");
    assert!((ess / 7000.0 - 1.0).abs() < 0.2, "{ess}");
    assert!((found.ess_topologies / 7000.0 - 1.0).abs() < 0.2);
    let at_map = found.at_map.mean.expect("it moves");
    // ½ + ½/15.
    assert!(
        (at_map.value - 0.5333).abs() < 4.0 * at_map.mcse,
        "{at_map:?}"
    );
    assert_eq!(found.n_holding.expect("counts").n, 14);
    assert_eq!(found.unseen.expect("an ESS").mass, 0.0);
    assert_eq!(Verdict::of_world(Some(&found), true, 0), Verdict::Recovered);
}

#[test]
fn chains_of_different_laws_do_not_agree() {
    let found = judged(&[
        chain(&drawn(3000, 0, 15, 1), 0, true),
        chain(&drawn(3000, 9, 15, 2), 0, true),
    ]);
    let words = words(&found);
    assert!(
        words.contains(&"r-hat of ln target".to_owned()),
        "{words:?}"
    );
    assert!(words.contains(&"topologies".to_owned()), "{words:?}");
    // One of the two has the truth as its MAP topology.
    assert_eq!(Verdict::of_world(Some(&found), true, 0), Verdict::ByLuck);
    assert_eq!(
        Verdict::of_world(Some(&found), false, 0),
        Verdict::NotConverged
    );
}

#[test]
fn too_few_draws_are_named() {
    let found = judged(&[
        chain(&drawn(50, 0, 15, 3), 0, true),
        chain(&drawn(50, 0, 15, 4), 0, true),
    ]);
    assert!(
        words(&found).contains(&"ess of M".to_owned()),
        "{:?}",
        words(&found)
    );
}

#[test]
fn standing_still_apart_is_no_convergence() {
    let found = judged(&[chain(&[0; 300], 0, true), chain(&[14; 300], 0, true)]);
    assert_eq!(
        found.n_sets.r_hat.map_err(|reason| reason.name()),
        Err("stuck-disagree")
    );
    let words = words(&found);
    assert!(words.contains(&"stuck-disagree M".to_owned()), "{words:?}");
    assert_eq!(
        found.unseen.map_err(|reason| reason.name()),
        Err("too-rare")
    );
    assert!(
        found
            .topologies
            .expect("two chains")
            .total_variation
            .largest
            > 0.99
    );
}

#[test]
fn rest_at_one_topology_counts_for_chains_that_came_there() {
    let rarely = |k: usize| if k % 40 == 7 { 3 } else { 5 };
    let at: Vec<usize> = (0..400).map(rarely).collect();
    let rest = judged(&[chain(&at, 0, true), chain(&[5; 400], 0, true)]);
    assert_eq!(words(&rest), ["at-rest"]);
    assert_eq!(Verdict::of_world(Some(&rest), false, 0), Verdict::WrongMap);
    // A chain that has been there from the start says nothing.
    let stuck = judged(&[chain(&[5; 400], 0, true), chain(&[5; 400], 0, false)]);
    assert_eq!(words(&stuck), ["still"]);
    assert_eq!(stuck.n_sets.r_hat.map_err(|r| r.name()), Err("constant"));
    // Nor does one that leaves it for more than a twentieth.
    let often: Vec<usize> = (0..400).map(|k| if k % 10 == 7 { 3 } else { 5 }).collect();
    let found = judged(&[chain(&often, 0, true), chain(&[5; 400], 0, true)]);
    assert!(!found.convergence.is_shown());
}

#[test]
fn one_chain_or_none() {
    let one = judged(&[chain(&drawn(4000, 0, 15, 1), 0, true)]);
    assert_eq!(words(&one), ["one-chain"]);
    assert_eq!(
        one.topologies.map_err(|reason| reason.name()),
        Err("too-few")
    );
    assert!(one.n_sets.r_hat.is_ok());
    assert!(diagnose(&[], &mut rng(1)).is_none());
}
