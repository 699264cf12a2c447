//! A mission as it happens, pose by pose: the deferring front end, a chunk at a time.
//!
//! What is certain becomes a landmark as the robot goes on, and what is not stays open (`front`,
//! `open`). A chunk is taken as soon as the pose after it is there, so a sighting is looked at
//! at most 25 poses after it was made.

use super::error::MissionError;
use super::front::{Front, Walk, chunk_end};
use super::graph::{Graph, Observation, Odometry, extend_by_odometry};
use super::view::Reach;
use crate::sighting::Pose;

/// A mission so far.
#[derive(Clone, Debug)]
pub struct Online {
    graph: Graph,
    walk: Walk,
}

impl Online {
    /// Before the first pose, which defines the frame.
    pub fn new(start: Pose) -> Self {
        Self {
            graph: Graph {
                start,
                times_s: Vec::new(),
                odometry: Vec::new(),
                observations: Vec::new(),
            },
            walk: Walk::new(Front::Deferring, start),
        }
    }

    /// The next pose: when it was (s), the odometry that led there (`None` for the first pose), and
    /// what was seen from it; the numbers of poses in `seen` do not matter. Says whether the map
    /// changed.
    ///
    /// # Errors
    /// Information that is not positive definite. The mission cannot go on then.
    ///
    /// # Panics
    /// If odometry is missing, or given for the first pose.
    pub fn push(
        &mut self,
        time_s: f64,
        odometry: Option<Odometry>,
        seen: &[Observation],
    ) -> Result<bool, MissionError> {
        let pose = self.graph.times_s.len();
        assert_eq!(
            odometry.is_some(),
            pose > 0,
            "every pose but the first has odometry"
        );
        self.graph.times_s.push(time_s);
        self.graph.odometry.extend(odometry);
        let seen = seen.iter().map(|one| Observation { pose, ..*one });
        self.graph.observations.extend(seen);
        let mut is_changed = false;
        loop {
            let end = chunk_end(self.graph.part(), self.walk.n_poses);
            if end > pose {
                return Ok(is_changed);
            }
            self.go_on(end)?;
            is_changed = true;
        }
    }

    /// Takes what is left as a chunk, as at the end of a mission.
    ///
    /// # Errors
    /// As for [`Online::push`].
    pub fn catch_up(&mut self) -> Result<(), MissionError> {
        let n = self.graph.times_s.len();
        if self.walk.n_poses < n {
            self.go_on(n)?;
        }
        Ok(())
    }

    fn go_on(&mut self, end: usize) -> Result<(), MissionError> {
        let part = self.graph.part();
        let seen = part.first(end).observations;
        if seen.is_empty() {
            self.walk.pass(part, end);
            return Ok(());
        }
        let went = self.walk.go_on(part, end, Reach::of(seen));
        went.ok_or(MissionError::Diverged)
    }

    /// All poses so far, the latest by odometry.
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses = self.walk.poses.clone();
        extend_by_odometry(&mut poses, &self.graph.odometry);
        poses
    }

    /// The landmark of each sighting so far; what is undecided is a landmark of its own.
    pub fn labels(&self) -> Vec<u32> {
        self.walk.open.labels_of(self.graph.observations.len())
    }
}
