//! Settings from data without truth.
//!
//! Two routes, which share the closed-form [`rule`] that makes settings of noise and revisits and nothing else:
//! [`evidence`] samples a normalised likelihood of the detections, [`matched`] simulates worlds that
//! resemble them and tries settings out. The first is recommended, as it uses times and every position;
//! the second says what to expect of it. Where they disagree, or where one of them finds that the
//! data do not tell, that is said ([`Tuning::doubts`]). Only the metric model is tuned.
//!
//! [`scales`] holds the length scales of a data set.

pub mod evidence;
pub mod matched;
pub mod rule;
pub mod scales;

use rayon::prelude::*;
use serde::Serialize;

use crate::detections::Detections;
use crate::diagnostics::chains::Chains;
use crate::diagnostics::r_hat::r_hat;
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::Settings;
use evidence::{Draw, Mixture};
use matched::{Candidate, MatchedWorld};
use rule::{Scene, Tuned};
use scales::Scales;

/// Chains of the likelihood, their sweeps and how many are left out.
const N_CHAINS: u64 = 4;
const N_LEFT_OUT: usize = 100;
const N_KEPT: usize = 200;
/// Chains of an estimate this far from 1 have not agreed on the noise.
const MOST_R_HAT: f64 = 1.1;
/// A noise scale known no better than to this factor is not known.
const MOST_FACTOR: f64 = 4.0;
/// Pairs seen at once that landmarks are taken to keep apart like: fewer say nothing.
const FEWEST_PAIRS: usize = 20;
/// The recommended setting may fall behind the best by so much in the simulated worlds.
const MOST_BEHIND: f64 = 0.1;
/// Below this the worlds that resemble the data are not recovered.
const LEAST_RAND_INDEX: f64 = 0.8;

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimated {
    /// The median.
    pub value: f64,
    /// 2.5 % are below.
    pub low: f64,
    /// 2.5 % are above.
    pub high: f64,
}

impl Estimated {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let last = values.len().saturating_sub(1) as f64;
        let at = |q: f64| values[(last * q).round() as usize];
        Self {
            value: at(0.5),
            low: at(0.025),
            high: at(0.975),
        }
    }
}

/// What simulated worlds say.
#[derive(Clone, Debug, Serialize)]
pub struct Simulated {
    /// s of the worlds that resemble the data, m.
    pub noise_m: Estimated,
    /// Their landmarks.
    pub n_landmarks: Estimated,
    /// The settings recommended, on these worlds.
    pub recommended: Candidate,
    /// The best of those tried.
    pub best: Candidate,
    /// All that were tried.
    pub tried: Vec<Candidate>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Tuning {
    /// The recommended settings.
    pub settings: Tuned,
    /// Their 95 % intervals, by the noise and the revisits of each draw: σ_o, σ_t, D, H.
    pub intervals: [Estimated; 4],
    /// s, m: standard deviation per axis of a detection about its landmark.
    pub noise_m: Estimated,
    /// M.
    pub n_landmarks: Estimated,
    /// The distance that 99 % of pairs seen at once exceed, m.
    pub apart_m: Option<f64>,
    /// Up to this distance two detections are merged, m.
    pub merge_m: f64,
    /// Share of the pairs of one landmark that lie farther apart.
    pub missed_share: f64,
    /// R-hat of ln s.
    pub r_hat: Option<f64>,
    /// The other route.
    pub simulated: Option<Simulated>,
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
}

/// Settings for these detections. `sensor_noise_m` is what a single detection errs by at least, where
/// known; `simulate` takes the second route too.
///
/// # Errors
/// Fewer than four detections, or all at one place.
pub fn tune(
    detections: &Detections,
    sensor_noise_m: Option<f64>,
    simulate: bool,
    seed: u64,
) -> Result<Tuning, TuneError> {
    let n = detections.len();
    let scales = Scales::of(detections);
    if n < 4 || scales.extent_m <= 0.0 {
        return Err(TuneError::TooFew(n));
    }
    let purpose = Purpose::new(SAMPLER_SEMANTICS, seed).text("use", "tune");
    let least_m = sensor_noise_m.unwrap_or_else(|| least_noise_m(detections, &scales));
    let mixture = Mixture::new(detections, least_m);
    let chain = |k: u64| {
        let mut rng = purpose.clone().number("likelihood", k).generator();
        // Half of the chains start with little noise, half with much.
        let start = if k.is_multiple_of(2) { 0.2 } else { 0.7 };
        mixture.sample(N_LEFT_OUT, N_KEPT, start, &mut rng)
    };
    let chains: Vec<Vec<Draw>> = (0..N_CHAINS).into_par_iter().map(chain).collect();
    let ln_noise = |draws: &Vec<Draw>| draws.iter().map(|d| libm::log(d.noise_m)).collect();
    let ln_noise: Vec<Vec<f64>> = chains.iter().map(ln_noise).collect();
    let r_hat = Chains::from_draws(&ln_noise).and_then(|chains| r_hat(&chains));
    let r_hat = r_hat.ok().map(|found| found.value());
    let draws: Vec<&Draw> = chains.iter().flatten().collect();

    let apart_m = apart_m(detections, &mixture);
    let mut noises_m: Vec<f64> = draws.iter().map(|draw| draw.noise_m).collect();
    noises_m.sort_unstable_by(f64::total_cmp);
    let least_noise_m = noises_m[noises_m.len() / 4];
    let scene = |noise_m: f64, n_sets: f64| Scene {
        noise_m,
        least_noise_m,
        visits: n as f64 / n_sets,
        apart_m,
    };
    let noise_m = Estimated::of(draws.iter().map(|draw| draw.noise_m).collect());
    let n_landmarks = Estimated::of(draws.iter().map(|draw| draw.n_sets as f64).collect());
    let settings = rule::settings(&scene(noise_m.value, n_landmarks.value));
    let each: Vec<Tuned> = draws
        .iter()
        .map(|d| rule::settings(&scene(d.noise_m, d.n_sets as f64)))
        .collect();
    let interval = |value: fn(&Tuned) -> f64| Estimated::of(each.iter().map(value).collect());
    let merge_m = rule::merge_distance_m(&scene(noise_m.value, n_landmarks.value));
    let simulated = simulate.then(|| simulated(detections, &settings, &purpose));
    let unvisited =
        draws.iter().filter(|draw| draw.n_sets == n).count() as f64 / draws.len() as f64;
    let mut found = Tuning {
        settings,
        intervals: [
            interval(|t| t.sigma_o),
            interval(|t| t.sigma_t),
            interval(|t| t.penalty_radius),
            interval(|t| t.penalty_height),
        ],
        noise_m,
        n_landmarks,
        apart_m,
        merge_m,
        missed_share: libm::exp(-merge_m * merge_m / (4.0 * noise_m.value * noise_m.value)),
        r_hat,
        simulated,
        doubts: Vec::new(),
    };
    found.doubts = doubts(&found, unvisited);
    Ok(found)
}

/// Half of what the surest detection states, or a thousandth of the extent.
fn least_noise_m(detections: &Detections, scales: &Scales) -> f64 {
    let precisions = detections.covariances_m2().into_iter().flatten();
    let least = precisions
        .map(|c| ((c.xx + c.yy) / 2.0).sqrt())
        .reduce(f64::min);
    least.map_or(scales.extent_m * 1e-3, |precision_m| precision_m / 2.0)
}

/// The distance that 99 % of pairs seen at once exceed, m.
fn apart_m(detections: &Detections, mixture: &Mixture) -> Option<f64> {
    let z = detections.positions_m();
    let mut distances = Vec::new();
    for i in 0..z.len() {
        for j in i + 1..z.len() {
            if mixture.overlap(i, j) {
                distances.push(libm::hypot(z[i][0] - z[j][0], z[i][1] - z[j][1]));
            }
        }
    }
    distances.sort_unstable_by(f64::total_cmp);
    (distances.len() >= FEWEST_PAIRS).then(|| distances[distances.len() / 100])
}

fn simulated(detections: &Detections, settings: &Tuned, purpose: &Purpose) -> Simulated {
    let purpose = purpose.clone().text("route", "simulation");
    let worlds = matched::matched_worlds(&detections.positions_m(), &purpose);
    let sampler = Settings::default().sampler();
    let try_out = |settings: &Tuned| matched::try_out(settings, &worlds, &sampler, &purpose);
    let tried: Vec<Candidate> = matched::candidates(&worlds).iter().map(try_out).collect();
    let recommended = try_out(settings);
    let best = matched::best(&tried).copied().unwrap_or(recommended);
    let of = |value: fn(&MatchedWorld) -> f64| Estimated::of(worlds.iter().map(value).collect());
    Simulated {
        noise_m: of(|world| world.noise_m),
        n_landmarks: of(|world| world.n_landmarks as f64),
        recommended,
        best,
        tried,
    }
}

fn doubts(found: &Tuning, unvisited: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    let noise = &found.noise_m;
    if unvisited > 0.5 {
        doubts.push("the detections look as if no landmark was seen twice".to_owned());
    }
    if found.r_hat.is_none_or(|r_hat| r_hat > MOST_R_HAT) {
        doubts.push("chains of the likelihood do not agree on the noise".to_owned());
    }
    if noise.high > MOST_FACTOR * noise.low {
        doubts.push(format!(
            "the noise is only known to lie between {:.3} and {:.3} m",
            noise.low, noise.high
        ));
    }
    let apart_m = found
        .apart_m
        .filter(|apart_m| rule::MARGIN * apart_m < rule::NEAREST * noise.low);
    if let Some(apart_m) = apart_m {
        doubts.push(format!(
            "landmarks are seen {apart_m:.3} m apart, visits of one lie up to {:.3} m apart: some will be merged",
            rule::NEAREST * noise.value
        ));
    }
    if let Some(simulated) = &found.simulated {
        let (best, ours) = (&simulated.best, &simulated.recommended);
        if ours.mean_rand_index < best.mean_rand_index - MOST_BEHIND {
            doubts.push(format!(
                "the routes disagree: on worlds like these radius {:.3} m has Rand index {:.2}, the recommended {:.2}",
                best.settings.penalty_radius, best.mean_rand_index, ours.mean_rand_index
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
mod tests {
    use super::*;
    use crate::detections::Detection;
    use rand_distr::{Distribution, StandardNormal};

    /// Rounds over a grid of landmarks, a step apart, with noise; two landmarks are in view at once.
    fn rounds(n_rounds: usize, step_m: f64, noise_m: f64, timed: bool, seed: u64) -> Detections {
        let mut rng = Purpose::new("test", seed).generator();
        let rows = (0..n_rounds * 9).map(|i| {
            let (k, t) = (i % 9, i as f64);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let [x, y] = [k % 3, k / 3].map(|v| step_m * v as f64 + noise_m * normal());
            Detection {
                first_seen_s: timed.then_some(t),
                last_seen_s: timed.then_some(t + 1.5),
                ..Detection::at(x, y)
            }
        });
        Detections::new(rows.collect()).expect("good")
    }

    #[test]
    fn settings_follow_the_noise_and_the_routes_agree() {
        for timed in [false, true] {
            let found = tune(&rounds(4, 30.0, 0.5, timed, 1), None, true, 1).expect("enough");
            // 54 degrees of freedom: s is known to 10 %.
            assert!(
                (found.noise_m.value - 0.5).abs() < 0.15,
                "{:?}",
                found.noise_m
            );
            assert!(
                (9.0..=10.0).contains(&found.n_landmarks.value),
                "{:?}",
                found.n_landmarks
            );
            assert_eq!(found.settings.sigma_o, rule::SIGMA_O * found.noise_m.value);
            assert!(found.doubts.is_empty(), "{:?}", found.doubts);
            let simulated = found.simulated.expect("asked for");
            assert!(simulated.recommended.mean_rand_index > 0.9);
            let radius = found.intervals[2];
            assert!(radius.low <= found.settings.penalty_radius);
            assert!(radius.high >= found.settings.penalty_radius && radius.high < 2.0 * radius.low);
        }
    }

    #[test]
    fn it_says_so_when_the_data_cannot_decide() {
        // Noise as large as the distance between landmarks, two visits, no times.
        let hopeless = tune(&rounds(2, 10.0, 8.0, false, 2), None, true, 1).expect("enough");
        assert!(!hopeless.doubts.is_empty());
        // Nothing is seen twice.
        let once = tune(&rounds(1, 10.0, 0.5, false, 3), None, false, 1).expect("enough");
        assert!(!once.doubts.is_empty(), "{once:?}");
    }

    #[test]
    fn truth_is_not_looked_at_and_the_same_seed_gives_the_same() {
        let bare = rounds(3, 10.0, 0.7, true, 4);
        let told = bare.iter().enumerate().map(|(i, row)| Detection {
            landmark: Some(i as i64),
            ..row.clone()
        });
        let told = Detections::new(told.collect()).expect("good");
        let [a, b] = [&bare, &told].map(|d| tune(d, None, false, 7).expect("enough"));
        assert_eq!(
            serde_json::to_string(&a).ok(),
            serde_json::to_string(&b).ok()
        );
        let bounded = tune(&bare, Some(2.0), false, 7).expect("enough");
        assert!(bounded.noise_m.low >= 2.0 * 0.999);
    }

    #[test]
    fn too_little_is_refused() {
        let rows = vec![Detection::at(1.0, 1.0); 5];
        let heap = Detections::new(rows).expect("good");
        let text = tune(&heap, None, false, 1)
            .expect_err("one place")
            .to_string();
        assert_eq!(
            text,
            "tune: got 5 detections, expected at least 4 at different places; bring more of them"
        );
    }
}
