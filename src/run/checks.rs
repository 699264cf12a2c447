//! What a chain's trace says of the chain by itself: holds, drift, and how noisy its estimates are.

use serde::{Deserialize, Serialize};

use crate::chain::{Run, Trace};
use crate::diagnostics::chains::Stretch;
use crate::diagnostics::estimate_noise::{EstimateNoise, estimate_noise};
use crate::diagnostics::geweke::geweke;
use crate::diagnostics::longest_hold::longest_hold;
use crate::diagnostics::undefined::Undefined;
use crate::model::{Draws, Model};
use crate::partition::Partition;
use crate::rng::Purpose;
use crate::sampler::Estimator;
use crate::settings::Settings;

use super::series::ChainSeries;

/// States at which the noise is estimated, and replicates at each: twenty evaluations (forty of differences),
/// a four-hundredth of 10,000 proposals with new draws. A chain's standard deviation is known to about a
/// fifth, that of a cell of ten chains to a fifteenth.
const N_STATES: u64 = 5;
const N_REPLICATES: u64 = 4;

/// A number, or in a word why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noted {
    /// The number.
    pub value: Option<f64>,
    /// `defined`, or why not.
    pub state: String,
}

impl Default for Noted {
    fn default() -> Self {
        Self {
            value: None,
            state: "not-recorded".to_owned(),
        }
    }
}

impl From<Result<f64, Undefined>> for Noted {
    fn from(found: Result<f64, Undefined>) -> Self {
        let state = found.as_ref().map_or_else(Undefined::name, |_| "defined");
        Self {
            value: found.ok(),
            state: state.to_owned(),
        }
    }
}

/// Checks of one chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChainChecks {
    /// Proposals of the longest stretch without an accepted move, after burn-in.
    pub longest_hold: u64,
    /// How many standard deviations longer that is than if every proposal were accepted with the same
    /// probability; tens of them are a chain that stuck.
    pub longest_hold_excess: Noted,
    /// Geweke's z of M.
    pub geweke_n_sets: Noted,
    /// Of ln target.
    pub geweke_ln_target: Noted,
    /// Of the variation of information to the chain's MAP topology.
    pub geweke_map_distance: Noted,
    /// Standard deviation of ln Ẑ at the states visited (`fresh`), or of the difference of two of them with
    /// the same draws (`common`), nats: what sticks if it is above 1.7, and costs in vain if below 1.2.
    pub estimate_sd: Noted,
    /// Its standard error.
    pub estimate_sd_error: Option<f64>,
}

impl ChainChecks {
    /// Of a trace after `burn_in` steps; `series` is what its record keeps.
    pub(super) fn new(trace: &Trace, burn_in: u64, series: &ChainSeries) -> Self {
        let lengths: Vec<u64> = trace.dwell_times(burn_in).map(|(_, dwell)| dwell).collect();
        let hold = longest_hold(&lengths);
        let excess = hold.and_then(|hold| {
            hold.expected?;
            Ok(hold.excess().unwrap_or(0.0))
        });
        let z = |values: Vec<Stretch>| Noted::from(geweke(&values).map(|found| found.z));
        let kept = |value: &dyn Fn(usize) -> f64| -> Vec<Stretch> {
            let stretches = series.lengths.iter().enumerate();
            stretches.map(|(k, length)| (value(k), *length)).collect()
        };
        Self {
            longest_hold: hold.map_or(0, |hold| hold.steps),
            longest_hold_excess: excess.into(),
            geweke_n_sets: z(kept(&|k| f64::from(series.n_sets[k]))),
            geweke_ln_target: z(kept(&|k| series.ln_target[k])),
            geweke_map_distance: z(kept(&|k| series.distance_to_map(k))),
            ..Self::default()
        }
    }

    /// Adds how noisy the estimates are.
    pub fn add_noise(&mut self, found: Result<EstimateNoise, Undefined>) {
        self.estimate_sd_error = found.ok().map(|noise| noise.standard_error);
        self.estimate_sd = found.map(|noise| noise.sd).into();
    }
}

/// The noise of ln Ẑ at states of the chain, evenly over its steps after burn-in.
///
/// With `fresh` draws, of ln Ẑ(T) itself. With `common` ones the chain sees ln Ẑ(T') − ln Ẑ(T) of the same draws,
/// so it is of that, T' the topology that the chain went to next.
pub fn noise_of(
    trace: &Trace,
    burn_in: u64,
    model: &Model,
    settings: &Settings,
    chain: &Purpose,
) -> Result<EstimateNoise, Undefined> {
    let sampler = settings.sampler(model.n_detections());
    if !sampler.estimator.draws_locations() {
        // It estimates nothing.
        return Err(Undefined::TooFew { n: 0, fewest: 2 });
    }
    let is_common = sampler.estimator == Estimator::Common;
    let mut draws = Draws::new(model.n_detections(), sampler.importance_samples);
    let purpose = chain.clone().text("use", "noise of the estimate");
    let mut ln_mean = |partition: &Partition, state: u64, replicate: u64| {
        let numbered = purpose
            .clone()
            .number("state", state)
            .number("replicate", replicate);
        let sets = partition.sets().iter().map(Vec::as_slice);
        // A detection's draws are the same in both topologies of a difference.
        draws.ln_mean_exp(model, sets, &mut numbered.generator())
    };
    let visited: Vec<(&Run, u64)> = trace.dwell_times(burn_in).collect();
    let held = |run: &Run| trace.topologies.get(run.topology);
    let n_steps: u64 = visited.iter().map(|(_, dwell)| dwell).sum();
    let (mut replicates, mut end, mut place) = (Vec::new(), 0, 0);
    for state in 0..N_STATES {
        let step = (2 * state + 1) * n_steps / (2 * N_STATES);
        while place < visited.len() && end + visited[place].1 <= step {
            end += visited[place].1;
            place += 1;
        }
        let Some(own) = visited.get(place).and_then(|(run, _)| held(run)) else {
            continue;
        };
        let here = Partition::from_labels(own.labels());
        let others = visited[place..].iter().chain(visited[..place].iter().rev());
        let next = others
            .filter_map(|(run, _)| held(run))
            .find(|other| *other != own);
        let next = match (is_common, next) {
            (false, _) => None,
            (true, Some(next)) => Some(Partition::from_labels(next.labels())),
            (true, None) => continue,
        };
        let of = |replicate| {
            let there = next
                .as_ref()
                .map_or(0.0, |next| ln_mean(next, state, replicate));
            there - ln_mean(&here, state, replicate)
        };
        replicates.push((0..N_REPLICATES).map(of).collect());
    }
    estimate_noise(&replicates)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{self, Start, TraceRecorder};
    use crate::diagnostics::estimate_noise::SamplesVerdict;
    use crate::model::{MetricModel, Penalty, PenaltyShape};
    use crate::settings::Settings;

    fn settings(pairs: &[(&str, &str)]) -> Settings {
        let mut settings = Settings::default();
        for (name, value) in pairs {
            settings.set_text(name, value).expect("a setting");
        }
        settings
    }

    /// Two landmarks seen three times each, a metre apart: the penalty varies from draw to draw.
    fn run(settings: &Settings, height: f64) -> (Trace, Model, Purpose) {
        let positions_m = [
            [0.0, 0.0],
            [0.3, 0.1],
            [0.1, -0.2],
            [1.5, 0.0],
            [1.6, 0.2],
            [1.4, 0.1],
        ];
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 3.0,
            height,
        };
        let model: Model = MetricModel::new(&positions_m, 1.0, 1.0, penalty).into();
        let purpose = Purpose::new("test", 1);
        let mut recorder = TraceRecorder::new(1000);
        let (prior, sampler) = (settings.prior(), settings.sampler(positions_m.len()));
        chain::run(
            &model,
            prior,
            &sampler,
            &Start::Singletons,
            4000,
            &purpose,
            &mut recorder,
        );
        (recorder.finish(), model, purpose)
    }

    /// Four times the samples halve the noise, where the penalty is low enough for the log of a mean to be about normal: five states of four replicates, four times, 60 degrees of freedom each, so the
    /// ratio of variances is within a factor of 2 but once in 100 times; seeds are fixed.
    #[test]
    fn more_samples_make_less_noise() {
        for estimator in ["fresh", "common"] {
            let with = |r: &str| settings(&[("estimator", estimator), ("importance_samples", r)]);
            // At the same states, whose noise differs.
            let (trace, model, purpose) = run(&with("1000"), 1.0);
            let noise = |r: &str| {
                let of = |k: u64| {
                    let purpose = purpose.clone().number("k", k);
                    noise_of(&trace, 500, &model, &with(r), &purpose)
                };
                let all: Vec<EstimateNoise> = (0..4).map(|k| of(k).expect("noise")).collect();
                all.iter().map(|noise| noise.sd * noise.sd).sum::<f64>() / 4.0
            };
            let ratio = noise("1000") / noise("4000");
            assert!((2.0..8.0).contains(&ratio), "{estimator}: {ratio}");
        }
    }

    #[test]
    fn too_few_samples_are_told_from_enough() {
        let verdict = |r: &str| {
            let settings = settings(&[("estimator", "fresh"), ("importance_samples", r)]);
            let (trace, model, purpose) = run(&settings, 20.0);
            let found = noise_of(&trace, 500, &model, &settings, &purpose).expect("noise");
            found.verdict()
        };
        assert_eq!(verdict("2000"), SamplesVerdict::MoreThanNeeded);
        assert_ne!(verdict("1"), SamplesVerdict::MoreThanNeeded);
    }

    #[test]
    fn a_trace_is_checked_after_its_burn_in() {
        let (trace, ..) = run(&settings(&[]), 20.0);
        let kept =
            |first| ChainSeries::new(&trace, first, &trace.frequencies(first), &trace.sums(first));
        let series = kept(500);
        let checks = ChainChecks::new(&trace, 500, &series);
        let longest = trace.dwell_times(500).map(|(_, dwell)| dwell).max();
        assert_eq!(Some(checks.longest_hold), longest);
        assert_eq!(checks.longest_hold_excess.state, "defined");
        assert_eq!(checks.geweke_n_sets.state, "defined");
        // A chain that has settled: |z| beyond 4 comes once in 16,000 times.
        for z in [
            &checks.geweke_n_sets,
            &checks.geweke_ln_target,
            &checks.geweke_map_distance,
        ] {
            assert!(z.value.is_some_and(|z| z.abs() < 4.0), "{z:?}");
        }
        let still = ChainChecks::new(&trace, 3999, &kept(3999));
        assert_eq!(
            (still.longest_hold, still.longest_hold_excess.state.as_str()),
            (1, "too-rare")
        );
        let text = serde_json::to_string(&checks).expect("a record");
        assert_eq!(
            serde_json::from_str::<ChainChecks>(&text).expect("the record"),
            checks
        );
    }
}
