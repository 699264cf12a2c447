//! The sightings that a front end still thinks about.
//!
//! A sighting that nothing claims stays a landmark of its own and may be claimed later. On a long
//! mission with much clutter there would be many of these, and every one of them is two rows of the
//! joint covariance. So only the latest stay open; the others are put aside, where they say
//! nothing, and are offered to the whole map at the end.

use super::graph::{Observation, Part};
use super::search::Mission;
use super::view::Reach;
use crate::sighting::Pose;

/// Landmarks of one sighting that stay open.
const MOST_OPEN: usize = 120;
/// When there are more, the oldest are put aside until there are so many.
const FEW_OPEN: usize = 80;
/// Sightings offered to the map at a time.
const BATCH: usize = 60;

/// Sightings that are open, in the order of poses, with their landmarks.
#[derive(Clone, Debug, Default)]
pub(super) struct Open {
    pub observations: Vec<Observation>,
    pub labels: Vec<u32>,
    /// The number of each in the whole mission.
    places: Vec<usize>,
    /// Numbers of those that were put aside, in order.
    aside: Vec<usize>,
    n_admitted: usize,
}

impl Open {
    /// Opens what the first `n_poses` poses of a mission saw, each sighting as a landmark of its
    /// own. Gives the place of the first of them.
    pub fn admit(&mut self, whole: Part<'_>, n_poses: usize) -> usize {
        let first = self.observations.len();
        let end = whole.first(n_poses).observations.len();
        self.push(whole, self.n_admitted..end);
        self.n_admitted = end;
        first
    }

    /// Opens these sightings, each as a landmark of its own.
    fn push(&mut self, whole: Part<'_>, places: impl Iterator<Item = usize>) {
        let first = self.labels.iter().max().map_or(0, |&most| most + 1);
        for (label, place) in (first..).zip(places) {
            self.observations.push(whole.observations[place]);
            self.labels.push(label);
            self.places.push(place);
        }
    }

    /// Which sightings are landmarks of their own.
    fn are_single(&self) -> Vec<bool> {
        let n = self
            .labels
            .iter()
            .max()
            .map_or(0, |&most| most as usize + 1);
        let mut counts = vec![0; n];
        for &label in &self.labels {
            counts[label as usize] += 1;
        }
        self.labels
            .iter()
            .map(|&label| counts[label as usize] == 1)
            .collect()
    }

    /// Puts the oldest aside if too many are open.
    pub fn put_aside(&mut self) {
        let are_single = self.are_single();
        let n_single = are_single.iter().filter(|is_single| **is_single).count();
        if n_single > MOST_OPEN {
            let mut left = n_single - FEW_OPEN;
            self.remove(|s| {
                let goes = are_single[s] && left > 0;
                left -= usize::from(goes);
                goes
            });
        }
    }

    fn remove(&mut self, mut goes: impl FnMut(usize) -> bool) {
        let stays: Vec<bool> = (0..self.labels.len()).map(|s| !goes(s)).collect();
        let gone = self.places.iter().zip(&stays).filter(|(_, stays)| !**stays);
        self.aside.extend(gone.map(|(place, _)| *place));
        self.aside.sort_unstable();
        retain(&mut self.observations, &stays);
        retain(&mut self.labels, &stays);
        retain(&mut self.places, &stays);
    }

    /// Offers what was put aside to the map, a batch at a time. Gives the poses then, and labels of
    /// all sightings of the mission; `None` if an information is not positive definite.
    pub fn take_back(
        mut self,
        whole: Part<'_>,
        mut poses: Vec<Pose>,
        reach: Reach,
    ) -> Option<(Vec<Pose>, Vec<u32>)> {
        for batch in std::mem::take(&mut self.aside).chunks(BATCH) {
            self.push(whole, batch.iter().copied());
            self.sort();
            let part = Part {
                odometry: whole.odometry,
                observations: &self.observations,
            };
            let mission = Mission::new(part, &poses, reach);
            let mut state = mission.state(poses, &self.labels)?;
            state.join_greedily(0.0);
            poses = mission.moved_poses(&state);
            self.labels = state.now.labels;
            let are_single = self.are_single();
            let places = self.places.clone();
            self.remove(|s| are_single[s] && batch.binary_search(&places[s]).is_ok());
        }
        Some((poses, self.labels_of(whole.observations.len())))
    }

    /// Labels of the first `n` sightings of the mission; those that are not open are landmarks of
    /// their own.
    pub fn labels_of(&self, n: usize) -> Vec<u32> {
        let first = self.labels.iter().max().map_or(0, |&most| most + 1);
        let mut labels: Vec<u32> = (first..).take(n).collect();
        for (&place, &label) in self.places.iter().zip(&self.labels) {
            labels[place] = label;
        }
        labels
    }

    /// In the order of poses again.
    fn sort(&mut self) {
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by_key(|&s| self.places[s]);
        self.observations = order.iter().map(|&s| self.observations[s]).collect();
        self.labels = order.iter().map(|&s| self.labels[s]).collect();
        self.places = order.iter().map(|&s| self.places[s]).collect();
    }
}

fn retain<T>(values: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    values.retain(|_| stays.next().is_some_and(|stays| *stays));
}
