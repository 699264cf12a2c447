//! Linearising anew, and moves that only go up: reassigning blocks, and letting sightings go to
//! assign them again scan by scan.

use super::graph::Part;
use super::linear::scans;
use super::optimum::{chi_square, moved, optimise};
use super::state::State;
use super::view::Reach;
use crate::sighting::Pose;

/// A step of the poses is halved at most so often.
const MOST_HALVINGS: usize = 4;
/// What counts as higher, nats.
const HIGHER: f64 = 1e-6;

/// The mission and what never changes about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mission<'a> {
    pub part: Part<'a>,
    pub reach: Reach,
    pub ln_area_m2: f64,
}

impl<'a> Mission<'a> {
    /// Of a part whose poses are about these.
    pub fn new(part: Part<'a>, poses: &[Pose], reach: Reach) -> Self {
        let scans = scans(part.observations);
        let seen_from = scans.iter().map(|scan| poses[scan.pose]);
        Self {
            part,
            reach,
            ln_area_m2: reach.ln_explored_m2(seen_from),
        }
    }

    /// Linearises at `poses`.
    pub fn state(&self, poses: Vec<Pose>, labels: &[u32]) -> Option<State> {
        State::new(self.part, poses, labels, self.reach, self.ln_area_m2)
    }

    /// The poses at the optimum of a state, to first order; less far if that fits worse.
    pub fn moved_poses(&self, state: &State) -> Vec<Pose> {
        let shift = state.moved_poses();
        let labels = &state.now.labels;
        let here = chi_square(self.part, &state.fixed.poses, labels);
        let mut share = 1.0;
        for _ in 0..MOST_HALVINGS {
            let poses = moved(&state.fixed.poses, &shift, share);
            if chi_square(self.part, &poses, labels) <= here {
                return poses;
            }
            share *= 0.5;
        }
        state.fixed.poses.clone()
    }

    /// The same partition, linearised where its poses go in so many steps.
    pub fn relinearised(&self, state: &State, steps: usize) -> Option<State> {
        let mut poses = self.moved_poses(state);
        if steps > 1 {
            optimise(self.part, &mut poses, &state.now.labels, steps - 1)?;
        }
        self.state(poses, &state.now.labels)
    }
}

/// In which order scans are assigned again.
#[derive(Clone, Copy, Debug)]
pub(super) enum Order {
    Forwards,
    Backwards,
    /// From a scan (share of them) onwards, then from there backwards.
    From(f64),
}

impl State {
    /// Puts each block where its weight is highest, in this order, if the log odds of that are at
    /// least `margin`. Blocks that are no longer of one landmark are left. Gives how many moved.
    pub fn reassign(&mut self, blocks: &[Vec<u32>], margin: Option<f64>) -> usize {
        let mut n_moved = 0;
        for block in blocks {
            let label = |s: u32| self.now.labels[s as usize];
            if block.iter().any(|&s| label(s) != label(block[0])) {
                continue;
            }
            let Some(placing) = self.placing(block) else {
                continue;
            };
            let (target, odds) = placing.best();
            if margin.is_none_or(|margin| odds >= margin) {
                n_moved += usize::from(self.place(block, &placing, target));
            }
        }
        n_moved
    }

    /// Each sighting as a block, from a pose on.
    pub fn single_blocks(&self, part: Part<'_>, from_pose: usize) -> Vec<Vec<u32>> {
        let first = part
            .observations
            .partition_point(|one| one.pose < from_pose);
        (first as u32..part.observations.len() as u32)
            .map(|s| vec![s])
            .collect()
    }

    /// Stretches of each landmark's sightings without a pause of more than `gap` poses, of two and
    /// more.
    pub fn stretches(&self, part: Part<'_>, gap: usize) -> Vec<Vec<u32>> {
        let pose = |s: u32| part.observations[s as usize].pose;
        let mut stretches = Vec::new();
        for landmark in &self.now.landmarks {
            let mut sorted = landmark.sightings.clone();
            sorted.sort_unstable();
            let together = sorted.chunk_by(|&s, &t| pose(t) - pose(s) <= gap);
            stretches.extend(together.filter(|one| one.len() > 1).map(<[u32]>::to_vec));
        }
        stretches.sort();
        stretches
    }

    /// Lets sightings go and assigns them again scan by scan. If the posterior is no higher then,
    /// everything is as before; gives whether it is higher.
    pub fn redo(&mut self, sightings: &[u32], order: Order) -> bool {
        let before = self.now.clone();
        let ln_before = self.ln_target();
        self.let_go(sightings);
        let mut is_pending = vec![false; self.now.labels.len()];
        for &s in sightings {
            is_pending[s as usize] = true;
        }
        for scan in self.scans_in(sightings, order) {
            self.assign_greedily(scan.clone(), &is_pending);
            for s in scan {
                is_pending[s as usize] = false;
            }
        }
        let is_higher = self.ln_target() > ln_before + HIGHER;
        if !is_higher {
            self.now = before;
        }
        is_higher
    }

    /// Makes each sighting a landmark of its own.
    fn let_go(&mut self, sightings: &[u32]) {
        for &s in sightings {
            let label = self.now.labels[s as usize] as usize;
            if self.now.landmarks[label].sightings.len() == 1 {
                continue;
            }
            if let Some((freed, ln_density)) = self.freed(&[s]) {
                self.split(&[s], &freed, ln_density);
            }
        }
    }

    /// Sightings by scan, in an order of scans.
    fn scans_in(&self, sightings: &[u32], order: Order) -> Vec<Vec<u32>> {
        let mut sorted = sightings.to_vec();
        sorted.sort_unstable();
        let scan = |s: u32| self.fixed.scan_of[s as usize];
        let scans = sorted.chunk_by(|&s, &t| scan(s) == scan(t));
        let mut scans: Vec<Vec<u32>> = scans.map(<[u32]>::to_vec).collect();
        match order {
            Order::Forwards => {}
            Order::Backwards => scans.reverse(),
            Order::From(share) => {
                let middle = (share * scans.len() as f64) as usize;
                let mut later = scans.split_off(middle.min(scans.len()));
                scans.reverse();
                later.extend(scans);
                return later;
            }
        }
        scans
    }

    /// Assigns sightings of one scan, the surest first, to landmarks of which none is pending.
    fn assign_greedily(&mut self, mut left: Vec<u32>, is_pending: &[bool]) {
        loop {
            let mut best: Option<(f64, u32, usize)> = None;
            for &s in &left {
                let a = self.now.labels[s as usize] as usize;
                for b in 0..self.n_landmarks() {
                    if b == a || is_pending[self.now.landmarks[b].sightings[0] as usize] {
                        continue;
                    }
                    let Some((gain, _)) = self.joining(a, b, 60.0) else {
                        continue;
                    };
                    if gain > best.map_or(0.0, |(most, _, _)| most) {
                        best = Some((gain, s, b));
                    }
                }
            }
            let Some((_, s, b)) = best else { return };
            let a = self.now.labels[s as usize] as usize;
            self.join(b, a);
            left.retain(|&one| one != s);
        }
    }
}
