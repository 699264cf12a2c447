//! The noise of a mission, calibrated on its first poses, and looked at again on all.
//!
//! The first poses are solved with the noise as it is stated, the evidence of that map says how the
//! noise ought to be, and both are done again until they agree. What gains little over the stated
//! noise is not taken: honest noise stays as it is, to the last bit.
//!
//! Noise is lowered only where errors are as Gaussian as that asks for. Wheels that slip and
//! detectors that lie now and then are covered by the noise that is stated; lowered to what most
//! errors are, one slip would tear the map. Errors that persist from scan to scan say less than
//! their number, and are covered likewise. Where tails are heavy or errors persist, noise is raised
//! at most, and only if the stated noise does not explain the residuals.

use super::candidates::{Map, maps};
use super::fit::fit;
use super::graph::Graph;
use super::noise::{NoiseFactors, calibrate};
use crate::rng::Purpose;

/// Sightings that are enough to calibrate by.
const SIGHTINGS: usize = 300;
/// Rounds of solving and calibrating.
const MOST_ROUNDS: usize = 4;
/// Factors that change by less than this (log) have settled.
const SETTLED: f64 = 0.1;
/// Factors that gain less than this over the stated noise are not taken, nats. Of honest noise four
/// factors gain 2 by chance.
const LEAST_GAIN: f64 = 8.0;

/// The factors of a mission's noise. `None` if its first poses cannot be solved.
pub(super) fn calibrated(
    stated: &Graph,
    purpose: &(impl Fn(&str) -> Purpose + Sync),
) -> Option<NoiseFactors> {
    let first = stated.first_sightings(SIGHTINGS);
    let mut factors = NoiseFactors::STATED;
    for _ in 0..MOST_ROUNDS {
        let found = maps(&first.with_noise(factors), 1, purpose, &|_| {});
        let by_posterior = |a: &Map, b: &Map| a.ln_posterior().total_cmp(&b.ln_posterior());
        let best = found.into_iter().max_by(by_posterior)?;
        let next = of_map(&first, &best, factors)?;
        let moved = next.ln_distance(factors);
        factors = next;
        if moved < SETTLED {
            break;
        }
    }
    Some(factors)
}

/// The factors by a map of the whole mission that was found with some: the same unless the map does
/// not fit them.
pub(super) fn recalibrated(
    stated: &Graph,
    map: &Map,
    factors: NoiseFactors,
) -> Option<NoiseFactors> {
    let labels = map.fused.of_all(&map.optimum.labels);
    let fit = fit(&stated.with_noise(factors), &map.optimum.poses, &labels);
    if factors == NoiseFactors::STATED || !fit.is_worse() {
        return Some(factors);
    }
    of_map(stated, map, factors)
}

/// The factors by one map.
fn of_map(stated: &Graph, map: &Map, from: NoiseFactors) -> Option<NoiseFactors> {
    let labels = map.fused.of_all(&map.optimum.labels);
    let poses = &map.optimum.poses;
    let found = calibrate(stated, poses, &labels, from)?;
    if found.gain < LEAST_GAIN {
        return Some(NoiseFactors::STATED);
    }
    let fits = |factors: NoiseFactors| fit(&stated.with_noise(factors), poses, &labels);
    let calibrated = fits(found.factors);
    Some(
        if !calibrated.has_heavy_tails() && !calibrated.has_persisting_errors() {
            found.factors
        } else if fits(NoiseFactors::STATED).is_worse() {
            found.factors.at_least_stated()
        } else {
            NoiseFactors::STATED
        },
    )
}
