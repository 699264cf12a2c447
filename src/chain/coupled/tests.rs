use std::collections::HashMap;

use super::*;
use crate::diagnostics::chains::Chains;
use crate::diagnostics::coupling::total_variation;
use crate::diagnostics::ess::ess_mean;
use crate::exact::{ExactTopology, enumerate};
use crate::model::{CovarianceModel, MetricModel, Penalty, PenaltyShape};
use crate::partition::Topology;
use crate::settings::Settings;

const POSITIONS_M: [[f64; 2]; 5] = [[0.0, 0.0], [0.6, 0.2], [1.5, -0.2], [1.9, 0.4], [3.2, 0.1]];

fn models() -> [Model; 2] {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.3,
        height: 6.0,
    };
    let metric = MetricModel::new(&POSITIONS_M, 0.6, 0.8, penalty);
    let ellipse = |i: usize| crate::detections::Covariance {
        xx: 0.3 + 0.1 * i as f64,
        xy: 0.05,
        yy: 0.4,
    };
    let covariances_m2: Vec<_> = (0..POSITIONS_M.len()).map(ellipse).collect();
    let wide = Penalty {
        radius_m: 2.2,
        ..penalty
    };
    let covariance = CovarianceModel::new(&POSITIONS_M, &covariances_m2, 1.0, 2.0, wide);
    [metric.into(), covariance.expect("good covariances").into()]
}

fn settings() -> SamplerSettings {
    let mut settings = Settings::default();
    let named = settings.set_text("estimator", "explicit");
    named.expect("an estimator");
    settings.sampler(POSITIONS_M.len())
}

fn exact_of(model: &Model) -> Vec<ExactTopology> {
    let mut rng = Purpose::new("coupling test", 1).generator();
    enumerate(model, Prior::Uniform, 40_000, &mut rng)
}

/// Total variation of counts to the posterior, and what that of as many independent draws is on
/// average at most: ½ Σ √(p(1 − p)/n).
fn distance(exact: &[ExactTopology], counts: &HashMap<Topology, u64>) -> (f64, f64) {
    let n = counts.values().sum::<u64>() as f64;
    let (mut distance, mut chance) = (0.0, 0.0);
    for row in exact {
        let count = counts.get(&row.topology).copied().unwrap_or(0) as f64;
        distance += (count / n - row.probability).abs() / 2.0;
        chance += (row.probability * (1.0 - row.probability) / n).sqrt() / 2.0;
        chance += row.probability * row.se;
    }
    (distance, chance)
}

/// The law of plain chains after t steps is never further from the posterior than the bound says,
/// and the bound comes down to nothing.
#[test]
fn the_bound_is_never_below_the_distance_of_chains() {
    const N_CHAINS: u64 = 5_000;
    const LAG: u64 = 40;
    let settings = settings();
    for (model, start) in models()
        .iter()
        .flat_map(|model| [Start::Singletons, Start::OneCluster].map(|start| (model, start)))
    {
        let exact = exact_of(model);
        let pair = Pair {
            model,
            prior: Prior::Uniform,
            settings: &settings,
            start: &start,
            lag: LAG,
        };
        let met: Vec<u64> = (0..300)
            .map(|number| {
                let purpose = Purpose::new("coupling test", number).text("use", "pair");
                match pair.meet(100_000, &purpose, &|| false) {
                    Meeting::Met(step) => step,
                    apart => panic!("{start:?}: {apart:?}"),
                }
            })
            .collect();
        let looks = [0, 5, 20, 80, 200];
        let mut counts = vec![HashMap::new(); looks.len()];
        for number in 0..N_CHAINS {
            let purpose = Purpose::new("coupling test", number).text("use", "chain");
            let generators = StepGenerators::new(&purpose);
            let mut kernel = Kernel::new(model, Prior::Uniform, &settings, generators);
            let mut state = kernel.init(start.partition(POSITIONS_M.len(), &purpose));
            let mut rng = purpose.clone().text("use", "steps").generator();
            for step in 0..=looks[looks.len() - 1] {
                if let Some(look) = looks.iter().position(|&look| look == step) {
                    *counts[look]
                        .entry(state.partition().topology())
                        .or_default() += 1;
                }
                kernel.step(&mut state, step, &mut rng);
            }
        }
        for (t, counts) in looks.iter().zip(&counts) {
            let (distance, chance) = distance(&exact, counts);
            let bound = total_variation(&met, LAG, *t);
            assert!(
                bound.value + 3.0 * bound.se > distance - 3.0 * chance,
                "{start:?}, {t} steps: {distance} {chance} {bound:?}"
            );
        }
        let far = distance(&exact, &counts[0]).0;
        assert!(far > 0.3, "the start is far from the posterior: {far}");
        let last = met.iter().max().expect("pairs");
        assert_eq!(total_variation(&met, LAG, *last).value, 0.0);
    }
}

/// Each of two coupled chains has the law of a chain by itself: common numbers and a new listing of
/// the sets change neither.
#[test]
fn a_coupled_chain_has_the_law_of_enumeration() {
    const N_DRAWS: u64 = 400_000;
    const STEPS_PER_DRAW: u64 = 10;
    let settings = settings();
    for model in models() {
        let exact = exact_of(&model);
        let pair = Pair {
            model: &model,
            prior: Prior::Uniform,
            settings: &settings,
            start: &Start::Singletons,
            lag: 10,
        };
        let mut coupled = pair.begin(&Purpose::new("coupling test", 2));
        let mut counts = [HashMap::new(), HashMap::new()];
        let mut n_sets = [Vec::new(), Vec::new()];
        for _ in 0..N_DRAWS {
            (0..STEPS_PER_DRAW).for_each(|_| coupled.go());
            for (who, (_, state)) in coupled.chains.iter().enumerate() {
                let partition = state.partition();
                *counts[who].entry(partition.topology()).or_default() += 1;
                n_sets[who].push((f64::from(partition.n_sets() as u32), 1));
            }
        }
        assert!(coupled.has_met(), "they stay together");
        for (counts, n_sets) in counts.iter().zip(&n_sets) {
            // The mean for independent draws, for so many fewer as M is worth, and four of the most
            // that it can vary by.
            let chain = Chains::new(std::slice::from_ref(n_sets)).expect("one chain");
            let ess = ess_mean(&chain).expect("M moves").ess;
            let (distance, chance) = distance(&exact, counts);
            let bound = chance * (N_DRAWS as f64 / ess).sqrt() + 2.0 / ess.sqrt();
            assert!(bound < 0.05, "too short to tell: {bound}");
            assert!(distance < bound, "{distance} {bound}");
        }
    }
}

/// Chains that differ in nothing but where their first detection is are apart: equal topologies are
/// no meeting.
#[test]
fn equal_topologies_alone_are_no_meeting() {
    let (model, settings) = (&models()[0], settings());
    let pair = Pair {
        model,
        prior: Prior::Uniform,
        settings: &settings,
        start: &Start::Singletons,
        lag: 1,
    };
    let mut coupled = pair.begin(&Purpose::new("coupling test", 3));
    let [(_, ahead), (_, behind)] = &coupled.chains;
    assert_eq!(ahead.partition().hash(), behind.partition().hash());
    coupled.step = 1;
    assert!(!coupled.has_met());
    assert_eq!(
        pair.meet(1, &Purpose::new("coupling test", 3), &|| false),
        Meeting::Apart(1)
    );
    assert_eq!(
        pair.meet(9, &Purpose::new("coupling test", 3), &|| true),
        Meeting::Stopped
    );
}
