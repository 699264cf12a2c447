//! Worlds that resemble the data, and which settings recover them.
//!
//! Worlds are M landmarks, uniform on a box and no nearer to each other than r, each seen about N/M times
//! with noise s, which is a factor on what each detection states for the covariance model. (M, s, r) are chosen by rejection (approximate Bayesian computation, Beaumont et al. 2002): of
//! many worlds from flat laws those are kept whose logarithms of nearest-neighbour distances, the first and
//! the third at five quantiles, are nearest to the data's. Nothing of the likelihood of [`evidence`](crate::evidence)
//! enters, so the two routes can disagree.
//!
//! On the worlds kept every candidate runs two chains, from all apart and from all together. A world is
//! *recovered* if both end with the truth as their MAP topology; the best candidate has the most of
//! these, and of equals the highest mean adjusted Rand index.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::rule::{ModelKind, Tuned, settings_for};
use super::trial::{self, Errors, n_proposals};
use crate::chain::Start;
use crate::detections::Covariance;
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::partition::Topology;
use crate::rng::Purpose;

/// Worlds tried for one that is kept, and kept at most.
const N_TRIED: usize = 4000;
const MOST_KEPT: usize = 12;
const FEWEST_KEPT: usize = 4;
/// Distances up to which pairs are merged, in units of s.
const FACTORS: [f64; 4] = [2.4, 3.0, 4.3, 6.0];
/// Quantiles of the kept worlds' noise that candidates are made of.
const NOISE_QUANTILES: [f64; 3] = [0.1, 0.5, 0.9];
/// Proposals in all, about: seconds.
const BUDGET: usize = 2_000_000;

/// A world that resembles the data.
#[derive(Clone, Debug)]
pub struct MatchedWorld {
    /// s, m, or a factor where covariances are stated.
    pub noise: f64,
    /// M.
    pub n_landmarks: usize,
    positions_m: Vec<[f64; 2]>,
    truth: Topology,
}

/// How settings do on such worlds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// The settings.
    pub settings: Tuned,
    /// Worlds recovered by both chains.
    pub n_recovered: usize,
    /// Worlds on which both chains end at one MAP topology.
    pub n_agree: usize,
    /// Worlds.
    pub n_worlds: usize,
    /// Mean adjusted Rand index over worlds and chains.
    pub mean_rand_index: f64,
}

/// First and third neighbours' distances at five quantiles, in logs.
fn signature(positions_m: &[[f64; 2]]) -> Vec<f64> {
    let n = positions_m.len();
    let mut nearest: [Vec<f64>; 2] = [Vec::with_capacity(n), Vec::with_capacity(n)];
    for (i, a) in positions_m.iter().enumerate() {
        let others = positions_m.iter().enumerate().filter(|(j, _)| *j != i);
        let mut distances: Vec<f64> = others
            .map(|(_, b)| libm::hypot(a[0] - b[0], a[1] - b[1]))
            .collect();
        distances.sort_unstable_by(f64::total_cmp);
        for (k, list) in [0, 2].into_iter().zip(&mut nearest) {
            if let Some(distance) = distances.get(k) {
                list.push(libm::log(distance.max(1e-12)));
            }
        }
    }
    let mut found = Vec::new();
    for list in &mut nearest {
        list.sort_unstable_by(f64::total_cmp);
        for q in [0.1, 0.3, 0.5, 0.7, 0.9] {
            if let Some(last) = list.len().checked_sub(1) {
                found.push(list[(last as f64 * q).round() as usize]);
            }
        }
    }
    found
}

/// One world from the flat laws; `None` if so many landmarks do not fit.
fn draw_world(
    errors: &Errors,
    unit_m: f64,
    box_m: [f64; 2],
    rng: &mut impl Rng,
) -> Option<MatchedWorld> {
    let n = errors.shapes().len();
    let diagonal = libm::hypot(box_m[0], box_m[1]);
    let n_landmarks = rng.random_range(n.div_ceil(12).max(2)..=n);
    let noise = diagonal / unit_m * libm::exp(rng.random_range(libm::log(1e-3)..libm::log(0.15)));
    let per_landmark = (box_m[0] * box_m[1] / n_landmarks as f64).sqrt();
    let apart_m = rng.random_range(0.0..0.8) * per_landmark;
    let mut landmarks: Vec<[f64; 2]> = Vec::new();
    for _ in 0..50 * n_landmarks {
        let place = box_m.map(|side| side * rng.random_range(0.0..1.0));
        let is_clear =
            |other: &[f64; 2]| libm::hypot(place[0] - other[0], place[1] - other[1]) >= apart_m;
        if landmarks.iter().all(is_clear) {
            landmarks.push(place);
        }
        if landmarks.len() == n_landmarks {
            break;
        }
    }
    if landmarks.len() < n_landmarks {
        return None;
    }
    // Every landmark once, then as chance will have it.
    let labels: Vec<usize> = (0..n)
        .map(|i| {
            if i < n_landmarks {
                i
            } else {
                rng.random_range(0..n_landmarks)
            }
        })
        .collect();
    let seen = |(label, c): (&usize, &Covariance)| {
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let (along, across) = (normal(), normal());
        // The lower Cholesky factor of C.
        let xx = c.xx.sqrt();
        let (yx, yy) = (c.xy / xx, (c.determinant() / c.xx).sqrt());
        let [x, y] = landmarks[*label];
        [
            x + noise * xx * along,
            y + noise * (yx * along + yy * across),
        ]
    };
    Some(MatchedWorld {
        noise,
        n_landmarks,
        positions_m: labels.iter().zip(errors.shapes()).map(seen).collect(),
        truth: Topology::canonical(&labels),
    })
}

/// The worlds most like these detections, by falling likeness.
pub fn matched_worlds(
    positions_m: &[[f64; 2]],
    errors: &Errors,
    purpose: &Purpose,
) -> Vec<MatchedWorld> {
    let unit_m = errors.unit_m();
    let n = positions_m.len();
    let box_m = [0, 1].map(|axis| {
        let values = positions_m.iter().map(|z| z[axis]);
        let high = values.clone().fold(f64::NEG_INFINITY, f64::max);
        high - values.fold(f64::INFINITY, f64::min)
    });
    let most = box_m[0].max(box_m[1]);
    let box_m = box_m.map(|side| side.max(0.05 * most));
    let wanted = signature(positions_m);
    // Signatures take N² time: fewer worlds of many detections.
    let n_tried = (N_TRIED * 64 / n.max(64)).max(300);
    let mut tried: Vec<(f64, usize, MatchedWorld)> = (0..n_tried)
        .into_par_iter()
        .filter_map(|k| {
            let mut rng = purpose.clone().number("world", k as u64).generator();
            let world = draw_world(errors, unit_m, box_m, &mut rng)?;
            let pairs = wanted.iter().zip(signature(&world.positions_m));
            let distance: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
            Some((distance, k, world))
        })
        .collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let n_candidates = FACTORS.len() * NOISE_QUANTILES.len() + 1;
    let n_kept = BUDGET / (n_candidates * 2 * n_proposals(n));
    tried.truncate(n_kept.clamp(FEWEST_KEPT, MOST_KEPT));
    tried.into_iter().map(|(_, _, world)| world).collect()
}

/// Settings made of the worlds' own noise.
pub fn candidates(worlds: &[MatchedWorld], model: ModelKind) -> Vec<Tuned> {
    let mut noises: Vec<f64> = worlds.iter().map(|world| world.noise).collect();
    noises.sort_unstable_by(f64::total_cmp);
    let visits = worlds
        .iter()
        .map(|w| w.positions_m.len() as f64 / w.n_landmarks as f64);
    let visits = visits.sum::<f64>() / worlds.len() as f64;
    let mut found = Vec::new();
    for q in NOISE_QUANTILES {
        let noise = noises[((noises.len() - 1) as f64 * q).round() as usize];
        for factor in FACTORS {
            found.push(settings_for(model, factor * noise, noise, visits));
        }
    }
    found
}

/// Runs settings on every world.
pub fn try_out(
    settings: &Tuned,
    worlds: &[MatchedWorld],
    errors: &Errors,
    purpose: &Purpose,
) -> Candidate {
    let on_world = |(k, world): (usize, &MatchedWorld)| {
        let model = errors.model(&world.positions_m, settings);
        let map = |start: Start| {
            let purpose = purpose
                .clone()
                .number("world", k as u64)
                .text("start", &format!("{start:?}"));
            trial::map(&model, &start, &purpose)
        };
        let maps = [Start::Singletons, Start::OneCluster].map(map);
        let index = |map: &Topology| adjusted_rand_index(map, &world.truth).unwrap_or(1.0);
        let agree = maps[0] == maps[1];
        (
            agree,
            agree && maps[0] == world.truth,
            (index(&maps[0]) + index(&maps[1])) / 2.0,
        )
    };
    let found: Vec<(bool, bool, f64)> = worlds.par_iter().enumerate().map(on_world).collect();
    Candidate {
        settings: *settings,
        n_agree: found.iter().filter(|world| world.0).count(),
        n_recovered: found.iter().filter(|world| world.1).count(),
        n_worlds: found.len(),
        mean_rand_index: found.iter().map(|world| world.2).sum::<f64>() / found.len() as f64,
    }
}

/// The best of candidates: most worlds recovered, then the highest mean index.
pub fn best(candidates: &[Candidate]) -> Option<&Candidate> {
    candidates.iter().reduce(|best, next| {
        let better = next.n_recovered.cmp(&best.n_recovered);
        let better = better.then(next.mean_rand_index.total_cmp(&best.mean_rand_index));
        if better.is_gt() { next } else { best }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::{Detection, Detections};

    #[test]
    fn worlds_like_the_data_have_its_noise_and_its_best_settings_recover_them() {
        // 10 landmarks 10 m apart in two rows, three visits each, s = 0.4 m.
        let mut rng = Purpose::new("test", 8).generator();
        let z: Vec<[f64; 2]> = (0..30)
            .map(|i| {
                let (column, row) = (i % 5, i / 5 % 2);
                [column, row].map(|k| {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    10.0 * f64::from(k) + 0.4 * normal
                })
            })
            .collect();
        let purpose = Purpose::new("test", 9);
        let rows: Vec<Detection> = z.iter().map(|&[x, y]| Detection::at(x, y)).collect();
        let detections = Detections::new(rows).expect("good");
        let errors = Errors::of(&detections, ModelKind::Metric).expect("no need of covariances");
        let worlds = matched_worlds(&z, &errors, &purpose);
        assert_eq!(worlds.len(), MOST_KEPT);
        let mut noise: Vec<f64> = worlds.iter().map(|world| world.noise).collect();
        noise.sort_by(f64::total_cmp);
        assert!((0.2..0.8).contains(&noise[6]), "{noise:?}");
        let tried: Vec<Candidate> = candidates(&worlds, ModelKind::Metric)
            .iter()
            .map(|c| try_out(c, &worlds, &errors, &purpose))
            .collect();
        let best = best(&tried).expect("candidates");
        assert!(
            best.n_recovered >= 6 && best.mean_rand_index > 0.9,
            "{best:?}"
        );
        // A radius far below the noise merges nothing.
        let small = settings_for(ModelKind::Metric, 0.01, 0.01, 3.0);
        let none = try_out(&small, &worlds, &errors, &purpose);
        assert!(
            none.n_recovered == 0 && none.mean_rand_index < 0.2,
            "{none:?}"
        );
    }

    #[test]
    fn the_best_recovers_most_and_then_comes_nearest() {
        let of = |n_recovered, mean_rand_index| Candidate {
            settings: settings_for(ModelKind::Metric, 1.0, 1.0, 2.0),
            n_recovered,
            n_agree: 4,
            n_worlds: 4,
            mean_rand_index,
        };
        let all = [of(1, 0.9), of(2, 0.5), of(2, 0.6), of(2, 0.6)];
        assert!(std::ptr::eq(best(&all).expect("some"), &all[2]));
        assert_eq!(best(&[]), None);
    }
}
