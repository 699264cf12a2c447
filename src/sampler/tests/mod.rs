//! Tests of the kernel and of its moves.

mod calibration;
mod detailed_balance;
mod tempering;

use std::collections::{HashMap, HashSet};

use super::moves::Proposal;
use super::*;
use crate::chain::{self, Start, Trace, TraceRecorder};
use crate::detections::Covariance;
use crate::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior, Workspace};
use crate::partition::{Change, Partition, Partitions, Topology};
use crate::rng::{Purpose, StepGenerators};

const POSITIONS_M: [[f64; 2]; 5] = [[0.0, 0.0], [0.4, 0.3], [1.4, -0.2], [1.6, 0.5], [0.7, 1.1]];

fn model(height: f64) -> Model {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.5,
        height,
    };
    MetricModel::new(&POSITIONS_M, 0.5, 0.6, penalty).into()
}

fn covariance_model(height: f64) -> Model {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 2.5,
        height,
    };
    let covariances_m2: Vec<Covariance> = (0..5)
        .map(|i| Covariance {
            xx: 0.4 + 0.1 * f64::from(i),
            xy: 0.2 - 0.1 * f64::from(i),
            yy: 0.5,
        })
        .collect();
    CovarianceModel::new(&POSITIONS_M, &covariances_m2, 0.7, 0.9, penalty)
        .expect("good covariances")
        .into()
}

fn settings(moves: &str, split: SplitRule, importance_samples: usize) -> SamplerSettings {
    SamplerSettings {
        moves: moves.parse().expect("a good mix"),
        estimator: Estimator::Fresh,
        split,
        arithmetic: Arithmetic::Log,
        importance_samples,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

fn chain_of(model: &Model, settings: &SamplerSettings, n_steps: u64, seed: u64) -> Trace {
    let mut recorder = TraceRecorder::new(1000);
    let purpose = Purpose::new("test", seed);
    let start = Start::Singletons;
    chain::run(
        model,
        Prior::Uniform,
        settings,
        &start,
        n_steps,
        &purpose,
        &mut recorder,
    );
    recorder.finish()
}

/// A step says how many sets it brought: the last of the partition, which were not there before.
#[test]
fn a_step_says_which_sets_are_new() {
    struct Sets {
        before: HashSet<Vec<u32>>,
        n_moved: u32,
    }
    impl Sets {
        fn of(state: &State) -> Vec<Vec<u32>> {
            let mut sets = state.partition().sets().to_vec();
            sets.iter_mut().for_each(|members| members.sort_unstable());
            sets
        }
    }
    impl chain::Observer for Sets {
        fn start(&mut self, state: &State) {
            self.before = Self::of(state).into_iter().collect();
        }
        fn step(&mut self, _: u64, state: &State, info: &StepInfo) {
            let sets = Self::of(state);
            let (old, new) = sets.split_at(sets.len() - info.n_new_sets as usize);
            assert!(old.iter().all(|members| self.before.contains(members)));
            assert!(!new.iter().any(|members| self.before.contains(members)));
            self.n_moved += u32::from(!new.is_empty());
            self.before = sets.into_iter().collect();
        }
    }
    let model = model(2.0);
    for (estimator, moves) in [
        (Estimator::Fresh, "split-merge=1"),
        (
            Estimator::Common,
            "split-merge=0.6,reassign=0.2,refresh=0.2",
        ),
        (
            Estimator::Explicit,
            "split-merge=0.2,site=0.4,flip=0.2,group=0.2",
        ),
    ] {
        let settings = SamplerSettings {
            estimator,
            ..settings(moves, SplitRule::Uniform, 4)
        };
        let mut sets = Sets {
            before: HashSet::new(),
            n_moved: 0,
        };
        let purpose = Purpose::new("test", 17);
        let (prior, start) = (Prior::Uniform, Start::Singletons);
        chain::run(&model, prior, &settings, &start, 2000, &purpose, &mut sets);
        assert!(sets.n_moved > 50, "{estimator}: {}", sets.n_moved);
    }
}

/// Every ratio that a proposal reports, against its definition with q counted by brute force.
#[test]
fn reported_ratio_is_the_ratio_of_the_proposal_laws() {
    // q(T'|T): the law of algorithm 2, spelled out over all pairs of sets and all splits.
    let law = |topology: &Topology| {
        let mut q: HashMap<Topology, f64> = HashMap::new();
        let labels = topology.labels();
        let n_sets = topology.n_sets() as u32;
        let n_pairs = f64::from(n_sets * (n_sets - 1)) / 2.0;
        for a in 0..n_sets {
            for b in a + 1..n_sets {
                let merged: Vec<u32> = labels.iter().map(|&l| if l == b { a } else { l }).collect();
                *q.entry(Topology::canonical(&merged)).or_default() += 0.5 / n_pairs;
            }
        }
        let members = |set: u32| (0..labels.len()).filter(move |&i| labels[i] == set);
        let many: Vec<u32> = (0..n_sets)
            .filter(|&set| members(set).count() > 1)
            .collect();
        for &set in &many {
            let members: Vec<usize> = members(set).collect();
            let n_splits = (1_u32 << (members.len() - 1)) - 1;
            for code in 1..=n_splits {
                let mut split = labels.to_vec();
                for (bit, &i) in members[1..].iter().enumerate() {
                    if code >> bit & 1 == 1 {
                        split[i] = n_sets;
                    }
                }
                *q.entry(Topology::canonical(&split)).or_default() +=
                    0.5 / many.len() as f64 / f64::from(n_splits);
            }
        }
        q
    };
    let laws: HashMap<Topology, HashMap<Topology, f64>> = Partitions::of(5)
        .map(|topology| (topology.clone(), law(&topology)))
        .collect();

    let mut rng = Purpose::new("test", 11).generator();
    let n_proposals = 4000;
    let (mut chi_square, mut degrees) = (0.0, 0.0);
    for (topology, law) in &laws {
        let partition = Partition::from_labels(topology.labels());
        let mut seen: HashMap<Topology, f64> = HashMap::new();
        let mut n_impossible = 0.0;
        for _ in 0..n_proposals {
            let mut change = Change::default();
            let (_, ratio) =
                split_merge::propose(SplitRule::Uniform, &partition, &mut change, &mut rng);
            let Proposal::Change { ln_ratio: ratio } = ratio else {
                n_impossible += 1.0;
                continue;
            };
            let mut proposed = partition.clone();
            proposed.apply(&change, |_, _| ());
            let proposed = proposed.topology();
            let expected = (laws[&proposed][topology] / law[&proposed]).ln();
            assert!(
                (ratio - expected).abs() < 1e-12,
                "{topology} to {proposed}: {ratio} {expected}"
            );
            *seen.entry(proposed).or_default() += 1.0;
        }
        let possible: f64 = law.values().sum();
        assert!(seen.keys().all(|proposed| law.contains_key(proposed)));
        let expected_impossible = f64::from(n_proposals) * (1.0 - possible).max(0.0);
        assert!(
            (n_impossible - expected_impossible).abs() <= 5.0 * expected_impossible.sqrt() + 1e-9
        );
        for (proposed, &probability) in law {
            let expected = f64::from(n_proposals) * probability;
            chi_square += (seen.get(proposed).unwrap_or(&0.0) - expected).powi(2) / expected;
        }
        degrees += law.len() as f64 - 1.0;
    }
    // Five standard deviations of a chi-square law with so many degrees of freedom (the number of
    // possible proposals is random where some are impossible, which only adds to the variance below).
    assert!(
        (chi_square - degrees).abs() < 5.0 * (2.0 * degrees).sqrt() + 5.0,
        "{chi_square} {degrees}"
    );
}

const ALL_MOVES: &str = "split-merge=0.2,reassign=0.1,pair-reassign=0.1,anchors=0.2,refresh=0.2,\
                         sequential-allocation=0.1,restricted-gibbs=0.1";

#[test]
fn early_rejection_changes_no_bit() {
    let fresh = Estimator::Fresh;
    for (estimator, split, arithmetic) in [
        (fresh, SplitRule::Uniform, Arithmetic::Log),
        (fresh, SplitRule::Uniform, Arithmetic::Linear),
        (fresh, SplitRule::PrefixCut, Arithmetic::Log),
        (fresh, SplitRule::PrefixCut, Arithmetic::Linear),
        (Estimator::Common, SplitRule::Uniform, Arithmetic::Log),
    ] {
        for model in [model(10.0), covariance_model(10.0)] {
            for moves in ["split-merge=0.8,refresh=0.2", ALL_MOVES] {
                let with = SamplerSettings {
                    arithmetic,
                    estimator,
                    ..settings(moves, split, 7)
                };
                let without = SamplerSettings {
                    early_rejection: false,
                    ..with.clone()
                };
                let (a, b) = (
                    chain_of(&model, &with, 20_000, 9),
                    chain_of(&model, &without, 20_000, 9),
                );
                assert!(
                    a.runs.len() > 20,
                    "{estimator} {split} {arithmetic} {moves}: {}",
                    a.runs.len()
                );
                assert_eq!(a.runs, b.runs);
                assert_eq!(a.moves, b.moves);
                assert!(a.n_evaluated < b.n_evaluated);
            }
        }
    }
}

/// Detections over many cells of the grid, so that a change has to find its partners, and to be found.
fn wide_model() -> Model {
    let positions_m: Vec<[f64; 2]> = (0..60)
        .map(|i| {
            let (landmark, copy) = (f64::from(i / 3), f64::from(i % 3));
            [
                3.0 * (landmark % 5.0) + 0.3 * copy,
                2.5 * (landmark / 5.0).floor() + 0.2 * copy * copy,
            ]
        })
        .collect();
    let penalty = Penalty {
        shape: PenaltyShape::Cubic,
        radius_m: 1.5,
        height: 6.0,
    };
    MetricModel::new(&positions_m, 0.5, 0.6, penalty).into()
}

/// What is kept up to date step by step is what it would be from scratch: the sums over draws, the bounds,
/// the prior, and with them the estimate. Past two rebuilds, from the start with the largest sums.
#[test]
fn running_sums_do_not_drift() {
    for model in [model(20.0), covariance_model(20.0), wide_model()] {
        let n = model.n_detections();
        let settings = SamplerSettings {
            estimator: Estimator::Common,
            ..settings(ALL_MOVES, SplitRule::Uniform, 5)
        };
        let prior = Prior::DirichletProcess { concentration: 0.5 };
        let generators = StepGenerators::new(&Purpose::new("test", 4));
        let mut kernel = Kernel::new(&model, prior, &settings, generators);
        let mut state = kernel.init(Partition::singletons(n));
        let mut rng = Purpose::new("test", 5).generator();
        let mut work = Workspace::new(n, 5);
        let (mut n_checks, mut n_moves, mut worst) = (0, 0, 0.0_f64);
        for step in 0..2 * rebuild_interval(model.n_detections()) + 5_000 {
            let info = kernel.step(&mut state, step, &mut rng);
            n_moves += u64::from(info.outcome == Outcome::Accepted);
            if step % 997 == 0 {
                let draws = state.draws().expect("common keeps its draws");
                worst = worst.max(draws.drift(&model, state.partition.set_of(), &mut work));
                let bounds = state.partition.sets().iter();
                let ln_bound: f64 = bounds.map(|set| work.ln_bound(&model, set)).sum();
                assert!((ln_bound - state.ln_bound).abs() < 1e-9);
                assert!((kernel.ln_prior(&state.partition) - state.ln_prior).abs() < 1e-9);
                assert!((draws.ln_mean(&model, &mut Vec::new()) - state.ln_mean).abs() < 1e-9);
                assert!(state.ln_mean <= 0.0);
                n_checks += 1;
            }
        }
        assert!(worst < 1e-9, "{worst}");
        assert!(n_checks > 100 && n_moves > 1000);
    }
}

#[test]
fn one_and_two_detections() {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.0,
        height: 3.0,
    };
    let one = Model::from(MetricModel::new(&[[3.0, 4.0]], 1.0, 1.0, penalty));
    let trace = chain_of(
        &one,
        &settings("split-merge", SplitRule::Uniform, 5),
        1000,
        1,
    );
    assert_eq!(trace.acceptance_rate(), Some(0.0));
    assert_eq!(trace.moves[0].impossible + trace.moves[1].impossible, 1000);
    let two = Model::from(MetricModel::new(
        &[[0.0, 0.0], [0.1, 0.0]],
        1.0,
        1.0,
        penalty,
    ));
    let trace = chain_of(
        &two,
        &settings("split-merge", SplitRule::Uniform, 5),
        20_000,
        1,
    );
    assert!(trace.frequencies(0).len() == 2);
    // Every step is a merge or a split; from either topology just one of them can be made.
    let impossible = trace.moves[0].impossible + trace.moves[1].impossible;
    assert!(
        (impossible as f64 - 10_000.0).abs() < 5.0 * 71.0,
        "{impossible}"
    );
}
