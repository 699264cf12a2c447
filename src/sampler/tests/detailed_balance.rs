//! Exact detailed balance, from the transition matrix of every move.
//!
//! Every random choice of a move is walked through with its probability, so the matrix is known to
//! rounding. The target is Π_S of the largest weight times P(T), which needs no importance draws; without a
//! penalty it is the metric model's posterior. It is computed here from its definition.

use std::collections::HashMap;

use super::super::choices::Choices;
use super::super::moves::Proposal;
use super::super::pair_split::PairSplit;
use super::super::*;
use crate::detections::Covariance;
use crate::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior, Surrogate};
use crate::partition::{Partition, Partitions, Topology};
use crate::rng::{Purpose, StepGenerators};

/// Choices that are walked through: a script of those made so far, then the first of each.
#[derive(Default)]
struct Walk {
    /// (choice, number of alternatives) in order.
    script: Vec<(usize, usize)>,
    place: usize,
    probability: f64,
}

impl Walk {
    /// Starts the next path; `false` if there is none left.
    fn next(&mut self) -> bool {
        let first = self.probability == 0.0 && self.script.is_empty();
        self.script.truncate(self.place);
        while let Some((choice, n)) = self.script.pop() {
            if choice + 1 < n {
                self.script.push((choice + 1, n));
                break;
            }
        }
        (self.place, self.probability) = (0, 1.0);
        first || !self.script.is_empty()
    }

    fn take(&mut self, n: usize) -> usize {
        if self.place == self.script.len() {
            // A path that no longer counts ends by its last choices, not by drawing for ever.
            let counts = self.probability >= NEGLIGIBLE;
            self.script.push((if counts { 0 } else { n - 1 }, n));
        }
        let (choice, alternatives) = self.script[self.place];
        assert_eq!(alternatives, n, "a move that makes the same choices again");
        self.place += 1;
        choice
    }
}

impl Choices for Walk {
    fn below(&mut self, n: usize) -> usize {
        self.probability /= n as f64;
        self.take(n)
    }

    fn coins(&mut self, n: usize) -> u64 {
        self.below(1 << n) as u64
    }

    fn index(&mut self, probabilities: &[f64]) -> usize {
        let ix = self.take(probabilities.len());
        self.probability *= probabilities[ix];
        ix
    }
}

/// Paths that are less probable than this are left out: a uniform split draws again while one side is
/// empty, without end.
const NEGLIGIBLE: f64 = 1e-13;

/// What the test holds a move to.
struct Verdict {
    /// Largest |π(T)P(T,T') − π(T')P(T',T)|.
    imbalance: f64,
    /// Largest |Σ_T' P(T,T') − 1|.
    leak: f64,
    /// Share of ordered pairs that the move connects.
    connected: f64,
    /// Paths that were holds or impossible.
    n_stays: u64,
}

/// The transition matrix of one move against the target of `model`, whose penalty has height 0.
fn verdict(model: &Model, prior: Prior, settings: &SamplerSettings) -> Verdict {
    let n = model.n_detections();
    let generators = StepGenerators::new(&Purpose::new("test", 1));
    let mut kernel = Kernel::new(model, prior, settings, generators);
    kernel.moves.restricted_gibbs = PairSplit::new(n, Some(1));
    let table = prior.table(n);
    let topologies: Vec<Topology> = Partitions::of(n).collect();
    let index_of: HashMap<&Topology, usize> = topologies.iter().zip(0..).collect();
    let ln_target: Vec<f64> = topologies
        .iter()
        .map(|topology| {
            let mut sets = vec![Vec::new(); topology.n_sets()];
            for (i, &label) in topology.labels().iter().enumerate() {
                sets[label as usize].push(i as u32);
            }
            let evidence: f64 = sets
                .iter()
                .map(|members| match model {
                    Model::Metric(model) => model.ln_gaussian(members),
                    Model::Covariance(model) => model.sites(members).ln_bound,
                })
                .sum();
            evidence + table.ln_prior(sets.iter().map(Vec::len))
        })
        .collect();
    let largest = ln_target.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let target: Vec<f64> = ln_target.iter().map(|v| (v - largest).exp()).collect();

    let mut transitions = vec![vec![0.0; topologies.len()]; topologies.len()];
    let (mut leak, mut n_stays) = (0.0_f64, 0);
    for (now, topology) in topologies.iter().enumerate() {
        let mut state = kernel.init(Partition::from_labels(topology.labels()));
        // The bounds alone, which the covariance model's draws would lower.
        state.ln_mean = 0.0;
        let mut walk = Walk::default();
        let mut total = 0.0;
        while walk.next() {
            kernel.change.clear();
            let (_, proposal) = kernel.propose(&state, &mut walk);
            if walk.probability < NEGLIGIBLE {
                // What would follow is even less probable.
                continue;
            }
            total += walk.probability;
            let Proposal::Change { ln_ratio } = proposal else {
                n_stays += 1;
                continue;
            };
            let mut after = state.partition.clone();
            after.apply(&kernel.change, |_, _| ());
            let then = index_of[&after.topology()];
            // The rule that accepts is monotone in u: its probability is where it turns.
            let trial = kernel.trial(&state, ln_ratio, 1.0);
            let ln_alpha =
                (trial.ln_prior + trial.ln_bound - state.ln_target() + ln_ratio).min(0.0);
            for (nudge, accepts) in [(-1e-6, true), (1e-6, false)] {
                let u = (ln_alpha + nudge).exp();
                if (1e-300..=1.0).contains(&u) {
                    assert_eq!(kernel.trial(&state, ln_ratio, u).accepts(0.0), accepts);
                }
            }
            transitions[now][then] += walk.probability * ln_alpha.exp();
        }
        leak = leak.max((total - 1.0).abs());
    }
    let (mut imbalance, mut n_connected, mut n_pairs) = (0.0_f64, 0, 0);
    for now in 0..topologies.len() {
        for then in 0..now {
            let there = target[now] * transitions[now][then];
            let back = target[then] * transitions[then][now];
            imbalance = imbalance.max((there - back).abs());
            n_connected += usize::from(transitions[now][then] > 0.0);
            n_pairs += 1;
        }
    }
    Verdict {
        imbalance,
        leak,
        connected: n_connected as f64 / f64::from(n_pairs.max(1)),
        n_stays,
    }
}

fn settings(moves: &str, split: SplitRule) -> SamplerSettings {
    SamplerSettings {
        moves: moves.parse().expect("a good mix"),
        estimator: Estimator::Fresh,
        split,
        arithmetic: Arithmetic::Log,
        importance_samples: 1,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

/// Five detections with a target that is far from flat. The radius decides who is a neighbour: of all of
/// them, of some, of nobody.
fn models(radius_m: f64) -> [Model; 2] {
    const POSITIONS_M: [[f64; 2]; 5] =
        [[0.0, 0.0], [0.5, 0.3], [1.3, -0.2], [1.9, 0.6], [0.8, 1.2]];
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m,
        height: 0.0,
    };
    let covariances_m2: Vec<Covariance> = (0..5)
        .map(|i| Covariance {
            xx: 0.4 + 0.1 * f64::from(i),
            xy: 0.2 - 0.1 * f64::from(i),
            yy: 0.5,
        })
        .collect();
    [
        MetricModel::new(&POSITIONS_M, 0.9, 1.1, penalty).into(),
        CovarianceModel::new(&POSITIONS_M, &covariances_m2, 0.7, 1.9, penalty)
            .expect("good covariances")
            .into(),
    ]
}

/// Radii at which the graph (of 1.5 radii) is complete, leaves pairs out, and is empty.
const RADII_M: [f64; 3] = [10.0, 1.15, 0.01];

fn n_edges(model: &Model) -> usize {
    let surrogate = Surrogate::of(model);
    let of = |i| surrogate.neighbours().of_detection(i).0.len();
    (0..5).map(of).sum::<usize>() / 2
}

#[test]
fn the_graphs_are_what_the_tests_below_need() {
    for (radius_m, low, high) in [(RADII_M[0], 10, 10), (RADII_M[1], 2, 9), (RADII_M[2], 0, 0)] {
        for model in models(radius_m) {
            assert!(
                (low..=high).contains(&n_edges(&model)),
                "{radius_m}: {}",
                n_edges(&model)
            );
        }
    }
}

#[test]
fn every_move_is_in_detailed_balance() {
    let priors = [
        Prior::Uniform,
        Prior::Poisson { rate: 2.0 },
        Prior::DirichletProcess { concentration: 0.3 },
    ];
    for radius_m in RADII_M {
        for (model, prior) in models(radius_m).iter().zip(priors.iter().cycle()) {
            for (moves, least_connected, can_stay) in [
                ("split-merge", 0.1, true),
                ("anchors", 0.3, true),
                ("sequential-allocation", 0.1, false),
                ("restricted-gibbs", 0.1, false),
                ("split-merge=0.5,reassign=0.5", 0.1, true),
                ("split-merge=0.5,pair-reassign=0.5", 0.1, true),
                ("anchors=0.2,reassign=0.5,split-merge=0.3", 0.3, true),
            ] {
                let verdict = verdict(model, *prior, &settings(moves, SplitRule::Uniform));
                let context = format!("{moves} {prior} radius {radius_m}");
                assert!(verdict.leak < 1e-9, "{context}: {}", verdict.leak);
                assert!(
                    verdict.imbalance < 1e-10,
                    "{context}: {}",
                    verdict.imbalance
                );
                assert!(
                    verdict.connected > least_connected,
                    "{context}: {}",
                    verdict.connected
                );
                assert_eq!(verdict.n_stays > 0, can_stay, "{context}");
            }
        }
    }
}

/// Reassign and pair reassign by themselves: they are not irreducible, so the mix refuses them, but their
/// matrices balance.
#[test]
fn reassigning_alone_is_in_detailed_balance() {
    for (radius_m, only) in RADII_M
        .into_iter()
        .flat_map(|radius_m| [(radius_m, Move::Reassign), (radius_m, Move::PairReassign)])
    {
        for model in models(radius_m) {
            let mut alone = settings("split-merge", SplitRule::Uniform);
            alone.moves = MoveMix::only(only);
            let verdict = verdict(&model, Prior::Uniform, &alone);
            assert!(verdict.leak < 1e-12, "{radius_m}: {}", verdict.leak);
            assert!(
                verdict.imbalance < 1e-12,
                "{radius_m}: {}",
                verdict.imbalance
            );
            // Two detections can be put together without being neighbours.
            let can_move = radius_m > 0.1 || only == Move::PairReassign;
            assert_eq!(verdict.connected > 0.0, can_move);
            assert!(verdict.n_stays > 0);
        }
    }
}

/// One to four detections: the matrices at the edges, where moves become impossible.
#[test]
fn few_detections_are_in_detailed_balance() {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.0,
        height: 0.0,
    };
    for n in 1..=4 {
        let positions_m: Vec<[f64; 2]> = (0..n).map(|i| [0.7 * i as f64, 0.1]).collect();
        let model = Model::from(MetricModel::new(&positions_m, 1.0, 1.0, penalty));
        for moves in [
            "split-merge",
            "anchors",
            "sequential-allocation",
            "restricted-gibbs",
        ] {
            let settings = settings(moves, SplitRule::Uniform);
            let verdict = verdict(&model, Prior::Uniform, &settings);
            assert!(
                verdict.leak < 1e-9 && verdict.imbalance < 1e-10,
                "{moves} {n}"
            );
            assert_eq!(verdict.connected > 0.0, n > 1, "{moves} {n}");
        }
    }
}

/// The report's faulty proposal fails by ten orders of magnitude.
#[test]
fn a_wrong_ratio_is_out_of_balance() {
    for model in models(1.0) {
        let settings = settings("split-merge", SplitRule::PrefixCut);
        let verdict = verdict(&model, Prior::Uniform, &settings);
        assert!(verdict.imbalance > 1e-3, "{}", verdict.imbalance);
    }
}
