//! Settings from data without truth.
//!
//! Two routes, which share the closed-form [`rule`] that makes settings of a distance, and the [`trial`]s:
//! [`evidence`](crate::evidence) samples a normalised likelihood of the detections, and [`expected`] takes the distance whose map
//! agrees best with its draws; [`matched`] simulates worlds that resemble the detections and tries settings out on
//! them. The first is recommended, as it uses times and every position; the second says what to expect of it. Where
//! they disagree, or where one of them finds that the data do not tell, that is said ([`Tuning::doubts`]).
//!
//! Lengths are metres for the metric model and standard deviations of what the detections state for the
//! covariance model. [`scales`] holds the length scales of a data set.

pub mod expected;
pub mod matched;
pub mod rule;
pub mod scales;
pub mod trial;

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use crate::detections::Detections;
use crate::diagnostics::chains::Chains;
use crate::diagnostics::r_hat::r_hat;
use crate::evidence::{Draw, Mixture};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use expected::{Judge, Rung};
use matched::{Candidate, MatchedWorld};
use rule::{ModelKind, Tuned};
use scales::Scales;
use trial::{Errors, ErrorsError};

/// Chains of the likelihood, their sweeps and how many are left out.
const N_CHAINS: u64 = 4;
const N_LEFT_OUT: usize = 100;
const N_KEPT: usize = 200;
/// Chains of an estimate this far from 1 have not agreed on the noise.
const MOST_R_HAT: f64 = 1.1;
/// Noises of the two routes that differ by this factor or more are not the same noise.
const MOST_APART: f64 = 3.0;
/// A noise scale known no better than to this factor is not known.
const MOST_FACTOR: f64 = 4.0;
/// Pairs seen at once that landmarks are taken to keep apart like: fewer say nothing.
const FEWEST_PAIRS: usize = 20;
/// The recommended setting may fall behind the best by so much in the simulated worlds.
const MOST_BEHIND: f64 = 0.1;
/// Below this the worlds that resemble the data are not recovered, and neither is a map that is expected to be so bad.
const LEAST_RAND_INDEX: f64 = 0.8;

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimated {
    /// The median.
    pub value: f64,
    /// 2.5 % are below; `None` where all draws are the same number, which is no interval: a setting
    /// that the rule fixes, or a number of landmarks that every draw has.
    pub low: Option<f64>,
    /// 2.5 % are above.
    pub high: Option<f64>,
}

impl Estimated {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let last = values.len().saturating_sub(1) as f64;
        let at = |q: f64| values[(last * q).round() as usize];
        let (low, high) = (at(0.025), at(0.975));
        // What differs by rounding alone is the same number.
        let is_spread = high - low > 1e-9 * high.abs().max(low.abs());
        Self {
            value: at(0.5),
            low: is_spread.then_some(low),
            high: is_spread.then_some(high),
        }
    }

    /// The factor between the ends, 1 without an interval.
    fn factor(&self) -> f64 {
        match (self.low, self.high) {
            (Some(low), Some(high)) => high / low,
            _ => 1.0,
        }
    }
}

/// What simulated worlds say.
#[derive(Clone, Debug, Serialize)]
pub struct Simulated {
    /// s of the worlds that resemble the data.
    pub noise: Estimated,
    /// Their landmarks.
    pub n_landmarks: Estimated,
    /// The settings recommended, on these worlds.
    pub recommended: Candidate,
    /// The best of those tried.
    pub best: Candidate,
    /// All that were tried.
    pub tried: Vec<Candidate>,
}

/// What was found. Lengths are m, or standard deviations for the covariance model.
#[derive(Clone, Debug, Serialize)]
pub struct Tuning {
    /// Which model it is for.
    pub model: ModelKind,
    /// The recommended settings.
    pub settings: Tuned,
    /// Their 95 % intervals, by the noise and the revisits of each draw: σ_o, σ_t, D, H.
    pub intervals: [Estimated; 4],
    /// s: standard deviation per axis of a detection about its landmark, m; for the covariance model the factor
    /// between what is so and what is stated.
    pub noise: Estimated,
    /// M.
    pub n_landmarks: Estimated,
    /// The distance that 99 % of pairs seen at once exceed.
    pub apart: Option<f64>,
    /// Up to this distance two detections are merged.
    pub merge: f64,
    /// Share of the pairs of one landmark that lie farther apart.
    pub missed_share: f64,
    /// What the likelihood expects of the map: its mean adjusted Rand index with the draws.
    pub expected_rand_index: f64,
    /// The distances that were tried for it.
    pub ladder: Vec<Rung>,
    /// R-hat of ln s.
    pub r_hat: Option<f64>,
    /// The other route.
    pub simulated: Option<Simulated>,
    /// Whether the data decide: there is no doubt.
    pub decided: bool,
    /// Why the data may not decide, in sentences; empty if they do.
    pub doubts: Vec<String>,
}

/// Why nothing can be said.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// Too few detections.
    #[error(
        "tune: got {0} detections, expected at least 4 at different places; bring more of them"
    )]
    TooFew(usize),
    /// Covariances that the model cannot use.
    #[error("tune: {0}")]
    Errors(#[from] ErrorsError),
}

/// How to tune.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// The model that settings are wanted for.
    pub model: ModelKind,
    /// What a single detection errs by at least, where known, m.
    pub sensor_noise_m: Option<f64>,
    /// Take the second route too.
    pub simulate: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Settings for these detections.
///
/// # Errors
/// Fewer than four detections, or all at one place; the covariance model without good covariances.
pub fn tune(detections: &Detections, request: &Request) -> Result<Tuning, TuneError> {
    static NEVER: AtomicBool = AtomicBool::new(false);
    let found = tune_until(detections, request, &NEVER)?;
    Ok(found.expect("nobody stops it"))
}

/// As [`tune`]; `None` if `stop` was set before it was done.
///
/// # Errors
/// As [`tune`].
pub fn tune_until(
    detections: &Detections,
    request: &Request,
    stop: &AtomicBool,
) -> Result<Option<Tuning>, TuneError> {
    let is_stopped = || stop.load(Ordering::Relaxed);
    let n = detections.len();
    let scales = Scales::of(detections);
    if n < 4 || scales.extent_m <= 0.0 {
        return Err(TuneError::TooFew(n));
    }
    let errors = Errors::of(detections, request.model)?;
    let purpose = Purpose::new(SAMPLER_SEMANTICS, request.seed).text("use", "tune");
    let least = request
        .sensor_noise_m
        .map(|noise_m| noise_m / errors.unit_m());
    let least = least.unwrap_or_else(|| least_noise(detections, &scales, request.model));
    let mixture = Mixture::new(detections, errors.shapes(), errors.unit_m(), least);
    let chain = |k: u64| {
        let mut rng = purpose.clone().number("likelihood", k).generator();
        // Half of the chains start with little noise, half with much.
        let start = mixture.variance_at(if k.is_multiple_of(2) { 0.2 } else { 0.7 });
        mixture.sample_until((N_LEFT_OUT, N_KEPT), start, &mut rng, &is_stopped)
    };
    let chains: Option<Vec<Vec<Draw>>> = (0..N_CHAINS).into_par_iter().map(chain).collect();
    let Some(chains) = chains else {
        return Ok(None);
    };
    let ln_noise = |draws: &Vec<Draw>| draws.iter().map(|d| libm::log(d.noise)).collect();
    let ln_noise: Vec<Vec<f64>> = chains.iter().map(ln_noise).collect();
    let r_hat = Chains::from_draws(&ln_noise).and_then(|chains| r_hat(&chains));
    let r_hat = r_hat.ok().map(|found| found.value());
    let draws: Vec<&Draw> = chains.iter().flatten().collect();

    let noise = Estimated::of(draws.iter().map(|draw| draw.noise).collect());
    let n_landmarks = Estimated::of(draws.iter().map(|draw| draw.n_sets as f64).collect());
    let visits = |n_sets: f64| n as f64 / n_sets;
    let positions_m = detections.positions_m();
    let apart = apart(detections, &mixture, &errors);
    let judge = Judge::new(
        &positions_m,
        &errors,
        &draws,
        [noise.value, visits(n_landmarks.value)],
        &purpose,
    );
    let ladder = judge.ladder();
    let clear = |noise: f64| apart.and_then(|apart| rule::clear_distance(noise, apart));
    let chosen = match clear(noise.value) {
        Some(merge) => judge.rung(merge, expected::N_RUNGS),
        None => *expected::choose(&ladder),
    };
    // What is known of the noise: where it is weighed, the distance is in units of it.
    let each: Vec<Tuned> = draws
        .iter()
        .map(|d| {
            let weighed = chosen.merge / noise.value * d.noise;
            let pair = clear(noise.value)
                .and_then(|_| clear(d.noise))
                .unwrap_or(weighed);
            rule::settings_for(request.model, pair, d.noise, visits(d.n_sets as f64))
        })
        .collect();
    let interval = |value: fn(&Tuned) -> f64| Estimated::of(each.iter().map(value).collect());
    let simulated = if request.simulate && !is_stopped() {
        simulated(&positions_m, &errors, &chosen.settings, (&purpose, stop))
    } else {
        None
    };
    if is_stopped() {
        return Ok(None);
    }
    let unvisited =
        draws.iter().filter(|draw| draw.n_sets == n).count() as f64 / draws.len() as f64;
    let mut found = Tuning {
        model: request.model,
        settings: chosen.settings,
        intervals: [
            interval(|t| t.sigma_o),
            interval(|t| t.sigma_t),
            interval(|t| t.penalty_radius),
            interval(|t| t.penalty_height),
        ],
        noise,
        n_landmarks,
        apart,
        merge: chosen.merge,
        missed_share: libm::exp(-(chosen.merge / noise.value).powi(2) / 4.0),
        expected_rand_index: chosen.expected_rand_index,
        ladder,
        r_hat,
        simulated,
        decided: false,
        doubts: Vec::new(),
    };
    found.doubts = doubts(&found, unvisited);
    found.decided = found.doubts.is_empty();
    Ok(Some(found))
}

/// Half of what the surest detection states, or a thousandth of the extent, m; for the covariance model a tenth of
/// what is stated, as errors that detections have in common are stated by each.
fn least_noise(detections: &Detections, scales: &Scales, model: ModelKind) -> f64 {
    if model == ModelKind::Covariance {
        return 0.1;
    }
    let precisions = detections.covariances_m2().into_iter().flatten();
    let least = precisions
        .map(|c| ((c.xx + c.yy) / 2.0).sqrt())
        .reduce(f64::min);
    least.map_or(scales.extent_m * 1e-3, |precision_m| precision_m / 2.0)
}

/// The distance that 99 % of pairs seen at once exceed, in the unit of the model.
fn apart(detections: &Detections, mixture: &Mixture, errors: &Errors) -> Option<f64> {
    let z = detections.positions_m();
    let mut distances = Vec::new();
    for i in 0..z.len() {
        for j in i + 1..z.len() {
            if mixture.overlap(i, j) {
                let way = [z[i][0] - z[j][0], z[i][1] - z[j][1]];
                distances.push(errors.distance(i, j, way));
            }
        }
    }
    distances.sort_unstable_by(f64::total_cmp);
    (distances.len() >= FEWEST_PAIRS).then(|| distances[distances.len() / 100])
}

/// `None` if it was stopped.
fn simulated(
    positions_m: &[[f64; 2]],
    errors: &Errors,
    settings: &Tuned,
    (purpose, stop): (&Purpose, &AtomicBool),
) -> Option<Simulated> {
    let purpose = purpose.clone().text("route", "simulation");
    let worlds = matched::matched_worlds(positions_m, errors, &purpose);
    let try_out = |settings: &Tuned| matched::try_out(settings, &worlds, errors, &purpose);
    let candidates = matched::candidates(&worlds, errors.kind());
    let try_on = |candidate| (!stop.load(Ordering::Relaxed)).then(|| try_out(candidate));
    let tried = candidates
        .iter()
        .map(try_on)
        .collect::<Option<Vec<Candidate>>>()?;
    let recommended = try_out(settings);
    let best = matched::best(&tried).copied().unwrap_or(recommended);
    let of = |value: fn(&MatchedWorld) -> f64| Estimated::of(worlds.iter().map(value).collect());
    Some(Simulated {
        noise: of(|world| world.noise),
        n_landmarks: of(|world| world.n_landmarks as f64),
        recommended,
        best,
        tried,
    })
}

fn doubts(found: &Tuning, unvisited: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    let noise = &found.noise;
    let unit = match found.model {
        ModelKind::Metric => "m",
        ModelKind::Covariance => "times what is stated",
    };
    if unvisited > 0.5 {
        doubts.push("the detections look as if no landmark was seen twice".to_owned());
    }
    if found.r_hat.is_none_or(|r_hat| r_hat > MOST_R_HAT) {
        doubts.push("chains of the likelihood do not agree on the noise".to_owned());
    }
    if let (Some(low), Some(high)) = (noise.low, noise.high)
        && noise.factor() > MOST_FACTOR
    {
        doubts.push(format!(
            "the noise is only known to lie between {low:.3} and {high:.3} {unit}"
        ));
    }
    if found.expected_rand_index < LEAST_RAND_INDEX {
        doubts.push(format!(
            "landmarks are near for their noise: the map is expected to have a Rand index of {:.2}",
            found.expected_rand_index
        ));
    }
    if let Some(simulated) = &found.simulated {
        let theirs = &simulated.noise;
        let apart = noise.value.max(theirs.value) / noise.value.min(theirs.value);
        if apart >= MOST_APART {
            doubts.push(format!(
                "the routes differ {apart:.1}-fold in the noise: {:.3} {unit} by the likelihood, {:.3} {unit} by simulated worlds; if you know what a \
                 detection errs by, give it as --sensor-noise; if the frame drifts, align the detections first (ptm import); else run both \
                 commands below and compare their maps",
                noise.value, theirs.value
            ));
        }
        let (best, ours) = (&simulated.best, &simulated.recommended);
        if ours.mean_rand_index < best.mean_rand_index - MOST_BEHIND {
            doubts.push(format!(
                "the routes disagree: on worlds like these radius {:.3} {} has Rand index {:.2}, the recommended {:.2}",
                best.settings.penalty_radius, found.model.unit(), best.mean_rand_index, ours.mean_rand_index
            ));
        }
        if best.mean_rand_index < LEAST_RAND_INDEX {
            doubts.push(format!(
                "no setting recovers worlds like these: at best a Rand index of {:.2}",
                best.mean_rand_index
            ));
        }
    }
    doubts
}

#[cfg(test)]
mod tests;
