use std::collections::HashMap;

use super::*;
use crate::chain::{self, Start, Trace, TraceRecorder};
use crate::detections::Covariance;
use crate::model::{CovarianceModel, MetricModel, Penalty, PenaltyShape};
use crate::partition::{Partitions, Topology};
use crate::rng::Purpose;

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
        early_rejection: true,
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

/// Without a penalty nothing is estimated, and the law is known in closed form: the whole machinery
/// but for the importance draws.
#[test]
fn without_a_penalty_the_chain_has_the_closed_form_law() {
    let model = model(0.0);
    let trace = chain_of(
        &model,
        &settings("split-merge", SplitRule::Uniform, 1),
        400_000,
        1,
    );
    let exact = crate::exact::enumerate(
        &model,
        Prior::Uniform,
        2,
        &mut Purpose::new("test", 0).generator(),
    );
    assert!(total_variation(&trace, &exact) < threshold(&trace, &exact));
}

#[test]
fn the_stationary_law_does_not_depend_on_r() {
    for model in [model(4.0), covariance_model(4.0)] {
        the_law_is_that_of_every_r(&model);
    }
}

fn the_law_is_that_of_every_r(model: &Model) {
    let mut rng = Purpose::new("test", 5).generator();
    let exact = crate::exact::enumerate(model, Prior::Uniform, 200_000, &mut rng);
    for (importance_samples, moves) in [
        (1, "split-merge"),
        (4, "split-merge"),
        (30, "split-merge"),
        (2, "split-merge=0.7,refresh=0.3"),
    ] {
        let settings = settings(moves, SplitRule::Uniform, importance_samples);
        let trace = chain_of(model, &settings, 400_000, 2);
        let (distance, bound) = (total_variation(&trace, &exact), threshold(&trace, &exact));
        assert!(
            distance < bound,
            "R = {importance_samples}: {distance} {bound}"
        );
    }
}

/// α is small so that large sets are common: with many singletons the term for a set's size would be
/// next to nothing, and its sign untested.
#[test]
fn every_prior_and_shape_has_its_own_stationary_law() {
    for prior in [
        Prior::Poisson { rate: 1.0 },
        Prior::DirichletProcess { concentration: 0.3 },
    ] {
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            let penalty = Penalty {
                shape,
                radius_m: 1.5,
                height: 1.0,
            };
            let model: Model = MetricModel::new(&POSITIONS_M, 0.5, 0.6, penalty).into();
            let mut rng = Purpose::new("test", 6).generator();
            let exact = crate::exact::enumerate(&model, prior, 50_000, &mut rng);
            let uniform = crate::exact::enumerate(&model, Prior::Uniform, 50_000, &mut rng);
            let mut recorder = TraceRecorder::new(1000);
            let settings = settings("split-merge", SplitRule::Uniform, 8);
            let (start, purpose) = (Start::Singletons, Purpose::new("test", 3));
            chain::run(
                &model,
                prior,
                &settings,
                &start,
                400_000,
                &purpose,
                &mut recorder,
            );
            let trace = recorder.finish();
            let (distance, bound) = (total_variation(&trace, &exact), threshold(&trace, &exact));
            assert!(distance < bound, "{prior} {shape}: {distance} {bound}");
            // The prior matters here, so a chain that ignored it would fail.
            let ignored = total_variation(&trace, &uniform);
            assert!(ignored > 5.0 * bound, "{prior} {shape}: {ignored} {bound}");
        }
    }
}

/// The same test on the report's faulty proposal must fail: it would catch a wrong ratio.
#[test]
fn a_wrong_ratio_is_caught() {
    // A low penalty, so that the faulty chain mixes and its law, not its sluggishness, is tested.
    let model = model(1.0);
    let mut rng = Purpose::new("test", 5).generator();
    let exact = crate::exact::enumerate(&model, Prior::Uniform, 20_000, &mut rng);
    let right = chain_of(
        &model,
        &settings("split-merge", SplitRule::Uniform, 8),
        400_000,
        2,
    );
    assert!(total_variation(&right, &exact) < threshold(&right, &exact));
    let wrong = chain_of(
        &model,
        &settings("split-merge", SplitRule::PrefixCut, 8),
        4_000_000,
        2,
    );
    let (distance, bound) = (total_variation(&wrong, &exact), threshold(&wrong, &exact));
    assert!(distance > 5.0 * bound, "{distance} {bound}");
}

#[test]
fn early_rejection_changes_no_bit() {
    for (model, arithmetic) in [model(40.0), covariance_model(40.0)]
        .into_iter()
        .flat_map(|model| {
            [
                (model.clone(), Arithmetic::Log),
                (model, Arithmetic::Linear),
            ]
        })
    {
        for split in [SplitRule::Uniform, SplitRule::PrefixCut] {
            let with = SamplerSettings {
                arithmetic,
                ..settings("split-merge=0.8,refresh=0.2", split, 7)
            };
            let without = SamplerSettings {
                early_rejection: false,
                ..with.clone()
            };
            let (a, b) = (
                chain_of(&model, &with, 20_000, 9),
                chain_of(&model, &without, 20_000, 9),
            );
            assert_eq!(a.runs, b.runs);
            assert_eq!(a.moves, b.moves);
            assert!(a.n_evaluated < b.n_evaluated);
        }
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

fn total_variation(trace: &Trace, exact: &[crate::exact::ExactTopology]) -> f64 {
    let counts: HashMap<Topology, u64> = trace
        .frequencies(0)
        .into_iter()
        .map(|row| (row.topology, row.count))
        .collect();
    let n = trace.n_steps as f64;
    let apart = exact.iter().map(|row| {
        let frequency = counts.get(&row.topology).copied().unwrap_or(0) as f64 / n;
        (frequency - row.probability).abs()
    });
    apart.sum::<f64>() / 2.0
}

/// What the total variation of a correct chain stays below: the mean under multinomial counts at the
/// chain's effective sample size is at most ½ Σ √(p(1−p)/n), and it varies by less than 1/(2√n) (each
/// of n independent draws moves it by at most 1/n: bounded differences); four of those are added.
/// The effective sample size is estimated from the indicator of the likeliest topology and of M.
fn threshold(trace: &Trace, exact: &[crate::exact::ExactTopology]) -> f64 {
    let top = exact
        .iter()
        .max_by(|a, b| a.probability.total_cmp(&b.probability))
        .expect("not empty");
    let top_ix =
        |run: &chain::Run| f64::from(trace.topologies.get(run.topology) == Some(&top.topology));
    let ess = effective_sample_size(&trace.expand(top_ix)).min(effective_sample_size(
        &trace.expand(|run| f64::from(run.n_sets)),
    ));
    let mean: f64 = exact
        .iter()
        .map(|row| (row.probability * (1.0 - row.probability) / ess).sqrt())
        .sum();
    let monte_carlo: f64 = exact.iter().map(|row| row.probability * row.se).sum();
    (mean + 4.0 / ess.sqrt() + monte_carlo) / 2.0
}

/// Effective sample size by batch means: a batch mean has variance σ²·B/ESS, B = 100 batches.
fn effective_sample_size(series: &[f64]) -> f64 {
    const N_BATCHES: usize = 100;
    let n = series.len() as f64;
    let mean = series.iter().sum::<f64>() / n;
    let variance = series.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    let size = series.len() / N_BATCHES;
    let batches = series
        .chunks_exact(size)
        .map(|batch| batch.iter().sum::<f64>() / size as f64);
    let of_batch_means =
        batches.map(|batch| (batch - mean).powi(2)).sum::<f64>() / N_BATCHES as f64;
    N_BATCHES as f64 * variance / of_batch_means
}
