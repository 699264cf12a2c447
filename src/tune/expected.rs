//! Up to which distance to merge: the one whose map is expected to be nearest to the truth.
//!
//! Draws T_k of the likelihood ([`evidence`](crate::evidence)) are what the data say of who is who, as far as
//! it goes. For each distance d of a ladder the settings of the [`rule`](super::rule) are run, and the map t(d)
//! that the model makes of them is judged by its posterior expected adjusted Rand index,
//!
//! R(d) = (1/K) Σ_k ARI(t(d), T_k)
//!
//! (Fritsch & Ickstadt, Bayesian Analysis 4, 2009, with the model's maps as the partitions to choose from). No constant
//! says what a wrongly merged pair weighs against a torn set: where landmarks stand clear of each other's noise R
//! has a plateau, and where they do not, it weighs those that are merged against those that are torn. Distances whose
//! R is within [`LEVEL`] of the highest are one plateau; of the longest run of them d is the geometric middle.
//!
//! Where landmarks are known to stand clear of each other, the distance is not left to this: [`rule::clear_distance`](super::rule::clear_distance).
//!
//! The rungs, the level and the middle were chosen on 120 simulated worlds (numbers 100 to 219 of `benches/tuning.rs`); the
//! table that it prints, and `docs/tune.md` has, is of others.
//!
//! Units: those of the model's distances, m or standard deviations.

use rayon::prelude::*;
use serde::Serialize;

use super::rule::{Tuned, settings_for};
use super::trial::{self, Errors};
use crate::chain::Start;
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::evidence::Draw;
use crate::partition::Topology;
use crate::rng::Purpose;

/// The ladder in units of the noise: from √(4·ln 5), within which 80 % of pairs of one landmark lie, upwards by fourth
/// roots of 2 to 12. Lower rungs are worse on simulated worlds whose noise is more than 0.15 of the distance of
/// landmarks: there the likelihood takes the noise to be smaller than it is, and would tear sets apart.
const FIRST: f64 = 2.537_272_482_359_039;
/// Rungs.
pub const N_RUNGS: u64 = 10;
/// Draws of the likelihood that maps are compared with.
const N_DRAWS: usize = 100;
/// Differences of R that the draws do not tell apart.
pub const LEVEL: f64 = 0.005;

/// One distance of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// d.
    pub merge: f64,
    /// Its settings.
    pub settings: Tuned,
    /// R(d).
    pub expected_rand_index: f64,
}

/// What a distance is judged by.
pub struct Judge<'a> {
    /// z, m.
    pub positions_m: &'a [[f64; 2]],
    /// How they err, and the model.
    pub errors: &'a Errors,
    /// The likelihood's noise.
    pub noise: f64,
    /// Detections of a landmark on average.
    pub visits: f64,
    /// What the chains' random numbers are made of.
    pub purpose: &'a Purpose,
    drawn: Vec<Topology>,
}

impl<'a> Judge<'a> {
    /// By draws of the likelihood.
    pub fn new(
        positions_m: &'a [[f64; 2]],
        errors: &'a Errors,
        draws: &[&Draw],
        [noise, visits]: [f64; 2],
        purpose: &'a Purpose,
    ) -> Self {
        let every = draws.len().div_ceil(N_DRAWS).max(1);
        let drawn = draws.iter().step_by(every);
        Self {
            positions_m,
            errors,
            noise,
            visits,
            purpose,
            drawn: drawn
                .map(|draw| Topology::canonical(&draw.labels))
                .collect(),
        }
    }

    /// R(d), by chain number `chain`.
    pub fn rung(&self, merge: f64, chain: u64) -> Rung {
        let settings = settings_for(self.errors.kind(), merge, self.noise, self.visits);
        let model = self.errors.model(self.positions_m, &settings);
        let purpose = self.purpose.clone().number("rung", chain);
        let map = trial::map(&model, &Start::Singletons, &purpose);
        let index = |drawn: &Topology| adjusted_rand_index(&map, drawn).unwrap_or(1.0);
        let sum: f64 = self.drawn.iter().map(index).sum();
        Rung {
            merge,
            settings,
            expected_rand_index: sum / self.drawn.len() as f64,
        }
    }

    /// The ladder.
    pub fn ladder(&self) -> Vec<Rung> {
        let merge = |k: u64| self.noise * FIRST * libm::exp2(k as f64 / 4.0);
        let rungs = (0..N_RUNGS).into_par_iter();
        rungs.map(|k| self.rung(merge(k), k)).collect()
    }
}

/// The distance to take: the middle of the longest run of rungs that are as good as the best; of equally long
/// ones the first, of two in the middle the farther.
///
/// # Panics
/// If the ladder has no rung.
pub fn choose(ladder: &[Rung]) -> &Rung {
    let highest = ladder
        .iter()
        .map(|rung| rung.expected_rand_index)
        .fold(f64::NEG_INFINITY, f64::max);
    let is_good = |rung: &Rung| rung.expected_rand_index >= highest - LEVEL;
    let (mut longest, mut from) = (0..0, 0);
    for k in 0..=ladder.len() {
        if ladder.get(k).is_some_and(is_good) {
            continue;
        }
        if k - from > longest.len() {
            longest = from..k;
        }
        from = k + 1;
    }
    &ladder[longest.start + longest.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::{Covariance, Detection, Detections};
    use crate::evidence::Mixture;
    use crate::tune::rule::ModelKind;
    use rand_distr::{Distribution, StandardNormal};

    fn of(indices: &[f64]) -> Vec<Rung> {
        let rung = |(k, &expected_rand_index): (usize, &f64)| Rung {
            merge: k as f64,
            settings: settings_for(ModelKind::Metric, 1.0, 1.0, 2.0),
            expected_rand_index,
        };
        indices.iter().enumerate().map(rung).collect()
    }

    #[test]
    fn the_middle_of_the_longest_plateau_is_taken() {
        let chosen = |indices: &[f64]| choose(&of(indices)).merge;
        assert_eq!(chosen(&[0.1, 0.9, 0.2]), 1.0);
        assert_eq!(chosen(&[0.1, 0.9, 0.9, 0.9, 0.2]), 2.0);
        assert_eq!(chosen(&[0.9, 0.8991, 0.2, 0.9, 0.9, 0.9]), 4.0);
        assert_eq!(chosen(&[0.2, 0.9, 0.9, 0.3, 0.9, 0.9]), 2.0);
        assert_eq!(chosen(&[0.9, 0.9]), 1.0);
        assert_eq!(chosen(&[0.2, 0.9 + 2.0 * LEVEL, 0.9, 0.9, 0.9]), 1.0);
        assert_eq!(chosen(&[0.5]), 0.0);
    }

    /// Rounds over pairs of landmarks: those of a pair so far from each other, pairs 10 m apart.
    fn ladder_of(apart_m: f64, kind: ModelKind) -> Vec<Rung> {
        let mut rng = Purpose::new("test", 11).generator();
        let rows = (0..6 * 12).map(|i| {
            let (k, t) = (i % 12, f64::from(i));
            let [x, y] = [f64::from(k / 2 % 3) * 10.0, f64::from(k / 6) * 10.0];
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            Detection {
                first_seen_s: Some(t),
                last_seen_s: Some(t + 0.5),
                // Stated half as large as it is.
                covariance_m2: Some(Covariance {
                    xx: 0.01,
                    xy: 0.0,
                    yy: 0.01,
                }),
                ..Detection::at(
                    x + f64::from(k % 2) * apart_m + 0.2 * normal(),
                    y + 0.2 * normal(),
                )
            }
        });
        let detections = Detections::new(rows.collect()).expect("good");
        let errors = Errors::of(&detections, kind).expect("good covariances");
        let mixture = Mixture::new(&detections, errors.shapes(), errors.unit_m(), 0.01);
        let draws = mixture.sample(100, 200, mixture.variance_at(0.3), &mut rng);
        let draws: Vec<&Draw> = draws.iter().collect();
        let noise = if kind == ModelKind::Metric { 0.2 } else { 2.0 };
        let z = detections.positions_m();
        let purpose = Purpose::new("test", 12);
        Judge::new(&z, &errors, &draws, [noise, 6.0], &purpose).ladder()
    }

    #[test]
    fn what_stands_clear_has_a_plateau_and_what_does_not_is_weighed() {
        for kind in [ModelKind::Metric, ModelKind::Covariance] {
            let clear = ladder_of(5.0, kind);
            let chosen = choose(&clear);
            assert!(chosen.expected_rand_index > 0.98, "{kind:?} {chosen:?}");
            // Neither tears sets nor merges the two landmarks of a pair, 25 noises away.
            let unit = if kind == ModelKind::Metric { 0.2 } else { 2.0 };
            let in_noises = chosen.merge / unit;
            assert!((3.0..15.0).contains(&in_noises), "{kind:?} {in_noises}");
            // Four noises away only short distances keep them apart.
            let near = ladder_of(0.8, kind);
            let chosen = choose(&near);
            assert!(chosen.merge / unit < 6.0, "{kind:?} {near:?}");
            let merged = near.last().expect("rungs");
            assert!(
                merged.expected_rand_index < chosen.expected_rand_index - 0.2,
                "{kind:?} {near:?}"
            );
        }
    }
}
