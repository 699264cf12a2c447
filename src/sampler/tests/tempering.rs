//! Every rung of a ladder against enumeration, and a wrong swap that is caught.

use super::*;
use crate::exact::enumerate;

/// Every so many steps are counted.
const EVERY: u64 = 4;

/// Topology counts and M of one rung.
#[derive(Default)]
struct Rung {
    counts: HashMap<Topology, u64>,
    n_sets: Vec<f64>,
}

impl Rung {
    /// Total variation to the exact posterior of `model`, and what a correct chain stays below: the
    /// mean under multinomial counts at the effective sample size of M (batch means, 100 batches),
    /// and four of the most that it can vary by.
    fn distance_and_bound(&self, model: &Model) -> (f64, f64) {
        let mut rng = Purpose::new("tempering test", 2).generator();
        let exact = enumerate(model, Prior::Uniform, 400_000, &mut rng);
        let n = self.n_sets.len() as f64;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let square = |values: &[f64], about: f64| {
            mean(
                &values
                    .iter()
                    .map(|x| (x - about).powi(2))
                    .collect::<Vec<_>>(),
            )
        };
        let centre = mean(&self.n_sets);
        let batches: Vec<f64> = self
            .n_sets
            .chunks_exact(self.n_sets.len() / 100)
            .map(mean)
            .collect();
        let ess = 100.0 * square(&self.n_sets, centre) / square(&batches, centre);
        let (mut distance, mut expected) = (0.0, 4.0 / ess.sqrt());
        for row in &exact {
            let count = self.counts.get(&row.topology).copied().unwrap_or(0);
            distance += (count as f64 / n - row.probability).abs() / 2.0;
            expected += (row.probability * (1.0 - row.probability) / ess).sqrt();
            expected += row.probability * row.se;
        }
        (distance, expected / 2.0)
    }
}

/// The estimators that can be tempered, each with a mix of its moves.
const TEMPERED: [(Estimator, &str); 2] = [
    (Estimator::Common, "split-merge=0.8,refresh=0.2"),
    (Estimator::Explicit, "site=0.6,flip=0.2,slice=0.2"),
];

/// What each rung of a fixed ladder visits, and the round trips, when swaps are decided by
/// `accepts` from ln α and a uniform number.
fn rungs(
    models: &[Model],
    (estimator, moves): (Estimator, &str),
    n_steps: u64,
    accepts: impl Fn(f64, f64) -> bool,
) -> (Vec<Rung>, u64) {
    let settings = SamplerSettings {
        estimator,
        ..settings(moves, SplitRule::Uniform, 4)
    };
    let tempering = Tempering {
        n_temperatures: models.len(),
        swap_interval: 2,
    };
    let purpose = Purpose::new("tempering test", 1);
    let mut rungs = Rungs::new(models, Prior::Uniform, (&settings, tempering), &purpose);
    let mut replicas = rungs.init(&Partition::singletons(5));
    let number = |rung: usize| purpose.clone().number("proposals", rung as u64).generator();
    let mut rngs: Vec<_> = (0..models.len()).map(number).collect();
    let mut seen: Vec<Rung> = models.iter().map(|_| Rung::default()).collect();
    for step in 0..n_steps {
        rungs.step_where(&mut replicas, step, &mut rngs, &accepts);
        if step % EVERY != 0 {
            continue;
        }
        for (rung, state) in seen.iter_mut().zip(&replicas.states) {
            *rung.counts.entry(state.partition.topology()).or_default() += 1;
            rung.n_sets.push(state.partition.n_sets() as f64);
        }
    }
    (seen, replicas.round_trips)
}

#[test]
fn every_rung_has_the_posterior_of_its_height() {
    let ladder = Ladder::new(3);
    for model in [model(4.0), covariance_model(4.0)] {
        let models = ladder.models(&model);
        for tempered in TEMPERED {
            let accepts = |ln_alpha: f64, u: f64| u.ln() < ln_alpha;
            let (right, round_trips) = rungs(&models, tempered, 2_000_000, accepts);
            assert!(round_trips > 1000, "{round_trips}");
            for (rung, model) in right.iter().zip(&models) {
                let (distance, bound) = rung.distance_and_bound(model);
                assert!(bound < 0.05, "{tempered:?}: too short to tell: {bound}");
                assert!(distance < bound, "{tempered:?}: {distance} {bound}");
            }
        }
    }
}

#[test]
fn a_wrong_swap_is_caught() {
    for model in [model(4.0), covariance_model(4.0)] {
        let models = Ladder::new(3).models(&model);
        for tempered in TEMPERED {
            // As if hot states were worth on a cold rung what they are worth on a hot one.
            let wrong = |ln_alpha: f64, u: f64| u.ln() < -ln_alpha;
            let (rungs, _) = rungs(&models, tempered, 500_000, wrong);
            let (distance, bound) = rungs[0].distance_and_bound(&models[0]);
            assert!(distance > 2.0 * bound, "{tempered:?}: {distance} {bound}");
        }
    }
}
