//! The whole mission reconsidered: what a front end found is improved until nothing gains.

use rand::{Rng, RngExt};

use super::front::close_loops;
use super::graph::{Observation, Part};
use super::optimum::{Optimum, optimum};
use super::search::{Mission, Order};
use super::state::State;
use super::view::Reach;
use crate::sighting::Pose;

/// Rounds at most.
const MOST_ROUNDS: usize = 5;
/// What a set of closures must gain, nats.
const CLOSURE: f64 = 3.0;
/// A pause that divides the stretches of a landmark, poses.
const PAUSE: usize = 10;
/// Gauss–Newton steps between two passes.
const STEPS: usize = 6;
/// Gauss–Newton steps for a result.
const MOST_STEPS: usize = 60;
/// Two landmarks this near, in standard deviations of a sighting, are reconsidered together.
const NEAR: f64 = 8.0;
/// Windows let go in each round, …
const WINDOWS: usize = 40;
/// … of one of these lengths, poses.
const WINDOW_POSES: [usize; 4] = [3, 8, 20, 50];

/// Finishes a map. `None` if an information is not positive definite.
pub(super) fn finish(
    part: Part<'_>,
    poses: &[Pose],
    labels: &[u32],
    reach: Reach,
    rng: &mut impl Rng,
) -> Option<Optimum> {
    let mut best = optimum(part, poses, labels, reach, MOST_STEPS)?;
    for round in 0..MOST_ROUNDS {
        let mission = Mission::new(part, &best.poses, reach);
        let state = mission.state(best.poses.clone(), &best.labels)?;
        let state = pass(mission, state, rng)?;
        let found = optimum(
            part,
            &state.fixed.poses,
            &state.now.labels,
            reach,
            MOST_STEPS,
        )?;
        let is_same = found.labels == best.labels;
        let gain = found.ln_posterior - best.ln_posterior;
        if gain > 0.0 || round == 0 && !is_same && gain > -1.0 {
            best = found;
        }
        if is_same || gain < 1e-3 {
            break;
        }
    }
    Some(best)
}

fn pass(mission: Mission<'_>, mut state: State, rng: &mut impl Rng) -> Option<State> {
    state.join_greedily(0.0);
    let state = mission.relinearised(&state, STEPS)?;
    let mut state = close_loops(mission, state, CLOSURE)?;
    state.reassign(&state.stretches(mission.part, PAUSE), None);
    state.reassign(&state.single_blocks(mission.part, 0), None);
    let mut state = mission.relinearised(&state, STEPS)?;
    if state.dissolve(mission.part, rng) > 0 {
        state = mission.relinearised(&state, STEPS)?;
    }
    if state.redo_windows(mission.part, rng) > 0 {
        state = mission.relinearised(&state, STEPS)?;
    }
    Some(state)
}

impl State {
    /// Lets the sightings of each landmark go in turn, and those of its nearest neighbour that
    /// stand in the way, to assign them again. Gives how often that was better.
    fn dissolve(&mut self, part: Part<'_>, rng: &mut impl Rng) -> usize {
        let mut landmarks: Vec<(usize, u32)> = self
            .now
            .landmarks
            .iter()
            .map(|one| {
                (
                    one.sightings.len(),
                    one.sightings.iter().copied().min().unwrap_or(0),
                )
            })
            .collect();
        landmarks.sort_unstable();
        let near_m = NEAR * typical_std_m(part);
        let mut n_better = 0;
        for (_, s) in landmarks {
            let a = self.now.labels[s as usize] as usize;
            let own = self.now.landmarks[a].sightings.clone();
            if self.n_landmarks() < 3 || own.len() < 2 {
                continue;
            }
            let order = order(rng);
            let mut is_better = self.redo(&own, order);
            if !is_better && let Some(both) = self.with_neighbour(a, near_m) {
                is_better = self.redo(&both, order);
            }
            n_better += usize::from(is_better);
        }
        n_better
    }

    /// Lets all sightings of random stretches of poses go, to assign them again. Gives how often
    /// that was better.
    fn redo_windows(&mut self, part: Part<'_>, rng: &mut impl Rng) -> usize {
        let n = part.observations.len();
        let mut n_better = 0;
        for _ in 0..WINDOWS {
            let length = WINDOW_POSES[rng.random_range(0..WINDOW_POSES.len())];
            let centre = part.observations[rng.random_range(0..n)].pose;
            let order = order(rng);
            let from = centre.saturating_sub(length / 2);
            let within = |one: &Observation| (from..from + length).contains(&one.pose);
            let sightings = (0..n).filter(|&s| within(&part.observations[s]));
            let sightings: Vec<u32> = sightings.map(|s| s as u32).collect();
            if sightings.len() < n {
                n_better += usize::from(self.redo(&sightings, order));
            }
        }
        n_better
    }

    /// The sightings of a landmark and those that its nearest neighbour has in the same scans, if
    /// any.
    fn with_neighbour(&self, a: usize, near_m: f64) -> Option<Vec<u32>> {
        let here = self.now.joint.mean_m[a];
        let distance = |b: usize| {
            let there = self.now.joint.mean_m[b];
            libm::hypot(there[0] - here[0], there[1] - here[1])
        };
        let others = (0..self.n_landmarks()).filter(|&b| b != a);
        let nearest = others.min_by(|&x, &y| distance(x).total_cmp(&distance(y)))?;
        if distance(nearest) > near_m {
            return None;
        }
        let landmark = &self.now.landmarks[a];
        let other = &self.now.landmarks[nearest];
        let scan = |s: u32| self.fixed.scan_of[s as usize] as usize;
        let in_the_way = other
            .sightings
            .iter()
            .filter(|&&s| landmark.is_seen_in(scan(s)));
        let in_the_way: Vec<u32> = in_the_way.copied().collect();
        let is_all = in_the_way.len() == other.sightings.len();
        let both = landmark.sightings.iter().chain(&in_the_way).copied();
        (!in_the_way.is_empty() && !is_all).then(|| both.collect())
    }
}

fn order(rng: &mut impl Rng) -> Order {
    match rng.random_range(0..3) {
        0 => Order::Forwards,
        1 => Order::Backwards,
        _ => Order::From(rng.random()),
    }
}

/// The median standard deviation of a sighting, m.
fn typical_std_m(part: Part<'_>) -> f64 {
    let variance = |[xx, xy, yy]: [f64; 3]| 0.5 * (xx + yy) / (xx * yy - xy * xy);
    let each = part.observations.iter();
    let mut stds: Vec<f64> = each.map(|one| variance(one.information).sqrt()).collect();
    stds.sort_by(f64::total_cmp);
    stds[stds.len() / 2]
}
