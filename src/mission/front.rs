//! The front end: the mission pose by pose, in chunks, into a first map.
//!
//! A chunk is dead-reckoned on from where the optimised poses end, its scans are assigned one after
//! the other, recent sightings are reconsidered, loops closed, and the mission is linearised anew.
//! The eager front end takes the best assignment of each scan as it is; the deferring one assigns
//! what is hardly in doubt and leaves the rest as landmarks of their own, for later poses to
//! decide.

use super::graph::{Part, extend_by_odometry};
use super::linear::scans;
use super::open::Open;
use super::search::Mission;
use super::state::State;
use super::view::Reach;
use crate::sighting::Pose;

/// Poses in a chunk.
const CHUNK: usize = 25;
/// A chunk ends earlier if it has so many sightings, …
const MOST_SIGHTINGS: usize = 60;
/// … or if its odometry leaves the heading unsure by so much: chunks are linearised as a whole,
/// rad.
const MOST_TURN_STD_RAD: f64 = 0.15;
/// Sightings of so many poses are reconsidered after each chunk.
const RECENT: usize = 75;
/// A pause that divides the stretches of a landmark, poses.
const PAUSE: usize = 10;
/// What is hardly in doubt: the probability of an assignment, …
const SURE: f64 = 0.95;
/// … the log odds of two landmarks being one, …
const SURE_JOIN: f64 = 4.0;
/// … and those of another place for a sighting.
const SURE_MOVE: f64 = 3.0;
/// What a set of closures must gain, nats.
const SURE_CLOSURE: f64 = 8.0;
/// Sets of closures taken after one chunk.
const MOST_CLOSURES: usize = 8;
/// The explored area is measured anew when the number of scans has grown by this factor.
const GROWTH: f64 = 1.1;

/// How a front end deals with doubt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Front {
    Eager,
    Deferring,
}

/// Runs a front end over a mission that starts at a pose. Gives poses and labels; `None` if an
/// information is not positive definite. `watch` hears how many poses are done.
pub(super) fn run(
    front: Front,
    whole: Part<'_>,
    start: Pose,
    reach: Reach,
    watch: &(dyn Fn(usize) + Sync),
) -> Option<(Vec<Pose>, Vec<u32>)> {
    let mut walk = Walk::new(front, start);
    while walk.n_poses < whole.n_poses() {
        let end = chunk_end(whole, walk.n_poses);
        walk.go_on(whole, end, reach)?;
        watch(end);
    }
    walk.open.take_back(whole, walk.poses, reach)
}

/// A front end on its way through a mission.
#[derive(Clone, Debug)]
pub(super) struct Walk {
    front: Front,
    /// Of the first `n_poses`.
    pub poses: Vec<Pose>,
    pub open: Open,
    area: Area,
    /// Poses that are done.
    pub n_poses: usize,
}

impl Walk {
    /// At the first pose, with nothing seen.
    pub fn new(front: Front, start: Pose) -> Self {
        Self {
            front,
            poses: vec![start],
            open: Open::default(),
            area: Area::default(),
            n_poses: 0,
        }
    }

    /// Takes the mission's poses up to `end` by odometry alone.
    pub fn pass(&mut self, whole: Part<'_>, end: usize) {
        self.n_poses = end;
        extend_by_odometry(&mut self.poses, &whole.odometry[..end - 1]);
    }

    /// Takes the mission's poses up to `end` as a chunk. `None` if an information is not positive
    /// definite.
    pub fn go_on(&mut self, whole: Part<'_>, end: usize, reach: Reach) -> Option<()> {
        self.pass(whole, end);
        let first_new = self.open.admit(whole, end);
        let part = Part {
            odometry: &whole.odometry[..end - 1],
            observations: &self.open.observations,
        };
        if first_new == part.observations.len() {
            return Some(());
        }
        let mission = Mission {
            part,
            reach,
            ln_area_m2: self.area.ln_m2(reach, part, &self.poses),
        };
        let mut state = mission.state(std::mem::take(&mut self.poses), &self.open.labels)?;
        let scans = scans(part.observations);
        for scan in scans.iter().filter(|scan| scan.first >= first_new) {
            let sightings: Vec<u32> = (scan.first as u32..scan.end as u32).collect();
            let landmarks = state.now.landmarks.iter();
            let known: Vec<bool> = landmarks
                .map(|one| one.sightings.iter().any(|&s| s < sightings[0]))
                .collect();
            let sure = match self.front {
                Front::Eager => 0.0,
                Front::Deferring => SURE,
            };
            state.assign_scan(&sightings, sure, |b| known[b]);
        }
        let recent = end.saturating_sub(RECENT);
        let state = match self.front {
            Front::Eager => eager(mission, state, recent)?,
            Front::Deferring => deferring(mission, state, recent)?,
        };
        self.poses = mission.moved_poses(&state);
        self.open.labels = state.now.labels;
        self.open.put_aside();
        Some(())
    }
}

/// Where the chunk after `from` poses ends.
pub(super) fn chunk_end(whole: Part<'_>, from: usize) -> usize {
    let first = whole.observations.partition_point(|one| one.pose < from);
    let full = whole.observations.get(first + MOST_SIGHTINGS);
    let full = full.map_or(usize::MAX, |one| one.pose.max(from + 1));
    let last = full.min(from + CHUNK).min(whole.n_poses());
    let mut variance_rad2 = 0.0;
    for end in from + 1..last {
        // Of the step from pose end − 1 to pose end.
        let covariance = whole.odometry[end - 1].information.try_inverse();
        variance_rad2 += covariance.map_or(0.0, |c| c.m33);
        if variance_rad2 > MOST_TURN_STD_RAD * MOST_TURN_STD_RAD {
            return end;
        }
    }
    last
}

fn eager(mission: Mission<'_>, mut state: State, recent: usize) -> Option<State> {
    state.join_greedily(0.0);
    let mut state = mission.relinearised(&state, 1)?;
    state.reassign(&state.single_blocks(mission.part, recent), None);
    let observations = mission.part.observations;
    let mut stretches = state.stretches(mission.part, PAUSE);
    stretches.retain(|one| one.iter().any(|&s| observations[s as usize].pose >= recent));
    state.reassign(&stretches, None);
    state.join_greedily(0.0);
    Some(state)
}

fn deferring(mission: Mission<'_>, mut state: State, recent: usize) -> Option<State> {
    state.join_surely(SURE_JOIN);
    let mut state = mission.relinearised(&state, 1)?;
    state.reassign(&state.single_blocks(mission.part, recent), Some(SURE_MOVE));
    state.join_surely(SURE_JOIN);
    close_loops(mission, state, SURE_CLOSURE)
}

/// Takes sets of closures, and linearises anew after each, until none gains `least` nats.
pub(super) fn close_loops(mission: Mission<'_>, mut state: State, least: f64) -> Option<State> {
    for _ in 0..MOST_CLOSURES {
        let Some(closure) = state.closure(least) else {
            break;
        };
        state.close(&closure);
        state = mission.relinearised(&state, 4)?;
    }
    Some(state)
}

/// The explored area of a mission that grows.
#[derive(Clone, Copy, Debug, Default)]
struct Area {
    n_scans: usize,
    ln_m2: f64,
}

impl Area {
    fn ln_m2(&mut self, reach: Reach, part: Part<'_>, poses: &[Pose]) -> f64 {
        let scans = scans(part.observations);
        if scans.len() as f64 >= GROWTH * self.n_scans as f64 {
            self.n_scans = scans.len();
            let seen_from = scans.iter().map(|scan| poses[scan.pose]);
            self.ln_m2 = reach.ln_explored_m2(seen_from);
        }
        self.ln_m2
    }
}
