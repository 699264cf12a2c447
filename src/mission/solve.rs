//! The whole way from a graph to its best partition, with poses, landmarks and probabilities.

use super::calibration::{calibrated, recalibrated};
use super::candidates::{Map, Weighed, maps, weighed};
use super::duplicates::{Fused, fuse_by_label};
use super::error::MissionError;
use super::fit::fit;
use super::graph::Graph;
use super::noise::NoiseFactors;
use super::optimum::{Optimum, optimum};
use super::search::Mission;
use super::solution::{Solution, SolveSettings, SolvedLandmark, Stage};
use super::sweeps::{Sweeper, Tally};
use super::view::Reach;
use crate::partition::Topology;
use crate::rng::Purpose;

/// Gauss–Newton steps from dead reckoning.
const MOST_STEPS: usize = 200;

/// Solves a mission. `watch` hears how far it has come, from more than one thread.
///
/// The noise is calibrated on the first poses, unless it is to be taken as stated. Two front ends,
/// an eager one and one that defers doubt, are each finished by the same search; the higher log
/// posterior is kept, and sweeps from there give the probabilities. Other maps that were found are
/// alternatives, weighed by their posterior.
///
/// # Errors
/// Information that is not positive definite at some poses.
pub fn solve(
    stated: &Graph,
    settings: SolveSettings,
    watch: &(dyn Fn(Stage) + Sync),
) -> Result<Solution, MissionError> {
    if stated.observations.is_empty() {
        return Err(MissionError::NothingSeen);
    }
    let purpose = |what: &str| Purpose::new("mission-1", settings.seed).text("use", what);
    let noise = if settings.is_calibrated {
        watch(Stage::Calibrating);
        calibrated(stated, &purpose).ok_or(MissionError::Diverged)?
    } else {
        NoiseFactors::STATED
    };
    let (noise, maps) = mapped(stated, noise, settings, &purpose, watch)?;
    let graph = &stated.with_noise(noise);
    let (map, alternatives) = weighed(maps);
    let Map {
        optimum: best,
        is_deferred,
        fused,
    } = &map.found;
    let reach = Reach::of(&fused.graph.observations);
    let mut rng = purpose("sweeps").generator();
    let swept = swept(fused, best, reach, settings.sweeps, watch, &mut rng);
    let Swept {
        landmarks,
        probabilities,
        draws,
    } = swept.ok_or(MissionError::Diverged)?;
    let is_deferred = *is_deferred;
    let probabilities = fused.of_all(&probabilities);
    let n_left = best.labels.len();
    let map = map.solved();
    Ok(Solution {
        noise,
        fit: fit(graph, &map.poses, &map.labels),
        n_duplicates: map.labels.len() - n_left,
        probabilities,
        map,
        landmarks,
        draws,
        is_deferred,
        alternatives: alternatives.into_iter().map(Weighed::solved).collect(),
    })
}

/// All maps of the whole mission, at least one, and their noise. Where calibrated noise does not fit
/// the whole as it fits the first poses, it is calibrated once more. Lowered noise must not need more
/// landmarks than the noise that is stated: errors that are not independent tear landmarks in two.
fn mapped(
    stated: &Graph,
    noise: NoiseFactors,
    settings: SolveSettings,
    purpose: &(impl Fn(&str) -> Purpose + Sync),
    watch: &(dyn Fn(Stage) + Sync),
) -> Result<(NoiseFactors, Vec<Map>), MissionError> {
    let maps = |noise: NoiseFactors| {
        let maps = maps(&stated.with_noise(noise), settings.starts, purpose, watch);
        if maps.is_empty() {
            Err(MissionError::Diverged)
        } else {
            Ok(maps)
        }
    };
    let mut noise = noise;
    let mut found = maps(noise)?;
    if noise == NoiseFactors::STATED {
        return Ok((noise, found));
    }
    let again = recalibrated(stated, best_of(&found), noise).ok_or(MissionError::Diverged)?;
    if again != noise {
        (noise, found) = (again, maps(again)?);
    }
    let raised = noise.at_least_stated();
    if raised != noise {
        let safe = maps(raised)?;
        let n_landmarks = |maps: &[Map]| best_of(maps).optimum.landmarks_m.len();
        if n_landmarks(&found) > n_landmarks(&safe) {
            (noise, found) = (raised, safe);
        }
    }
    Ok((noise, found))
}

/// The most probable of maps, at least one.
fn best_of(maps: &[Map]) -> &Map {
    let by_posterior = |a: &&Map, b: &&Map| a.ln_posterior().total_cmp(&b.ln_posterior());
    let best = maps.iter().max_by(by_posterior);
    best.expect("there is a map")
}

/// The optimum of a graph under a partition of its sightings, given as labels: as for [`solve`],
/// which finds the labels by itself. Sightings of one scan with one label count as one that was
/// reported twice.
///
/// # Errors
/// Information that is not positive definite at some poses.
pub fn optimum_of(graph: &Graph, labels: &[u32]) -> Result<Optimum, MissionError> {
    if graph.observations.is_empty() {
        return Err(MissionError::NothingSeen);
    }
    let fused = fuse_by_label(graph, labels);
    let mut fused_labels = vec![0; fused.graph.observations.len()];
    for (&place, &label) in fused.place_of.iter().zip(labels) {
        fused_labels[place] = label;
    }
    let poses = graph.dead_reckoned();
    let reach = Reach::of(&fused.graph.observations);
    let part = fused.graph.part();
    let mut found =
        optimum(part, &poses, &fused_labels, reach, MOST_STEPS).ok_or(MissionError::Diverged)?;
    found.ln_posterior += fused.ln_differences;
    found.labels = fused.of_all(&found.labels);
    Ok(found)
}

/// What sweeps say.
struct Swept {
    landmarks: Vec<SolvedLandmark>,
    /// Of the sightings that are left when duplicates are fused.
    probabilities: Vec<f64>,
    draws: Vec<Topology>,
}

fn swept(
    fused: &Fused,
    best: &Optimum,
    reach: Reach,
    sweeps: usize,
    watch: &(dyn Fn(Stage) + Sync),
    rng: &mut impl rand::Rng,
) -> Option<Swept> {
    let mission = Mission::new(fused.graph.part(), &best.poses, reach);
    let mut state = mission.state(best.poses.clone(), &best.labels)?;
    let n = best.landmarks_m.len();
    let covariance = |a: usize| {
        let [xx, xy, _, yy] = state.now.joint.block(a, a);
        [xx, xy, yy]
    };
    let covariances: Vec<[f64; 3]> = (0..n).map(covariance).collect();
    let sweeper = Sweeper::new(&state, mission.part);
    let mut draws = Vec::with_capacity(sweeps);
    let mut tally = Tally::new(&best.labels, n);
    if sweeps == 0 {
        tally.count(&state);
    }
    for sweep in 0..sweeps {
        sweeper.sweep(&mut state, rng)?;
        tally.count(&state);
        draws.push(Topology::canonical(&fused.of_all(&state.now.labels)));
        watch(Stage::Sweeps(sweep + 1));
    }
    let probabilities = tally.of_landmarks();
    let landmarks = (0..n).map(|a| SolvedLandmark {
        position_m: best.landmarks_m[a],
        covariance_m2: covariances[a],
        probability: probabilities[a],
    });
    Some(Swept {
        landmarks: landmarks.collect(),
        probabilities: tally.of_sightings(),
        draws,
    })
}
