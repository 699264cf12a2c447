//! A recording followed pose by pose, as on a robot.

use std::time::Instant;

use crate::diagnostics::agreement::adjusted_rand_index;
use crate::mission::{Graph, MissionError, Online, SolvedMap};
use crate::partition::Topology;
use serde_json::{Value, json};

/// How that went.
pub struct Followed {
    poses_per_second: f64,
    longest_s: f64,
    agreement: Option<f64>,
}

/// Follows a recording, and compares the labels at its end with those of a map.
pub fn follow(graph: &Graph, map: &SolvedMap) -> Result<Followed, MissionError> {
    let mut online = Online::new(graph.start);
    let started = Instant::now();
    let mut longest_s: f64 = 0.0;
    let mut left = &graph.observations[..];
    for (pose, &time_s) in graph.times_s.iter().enumerate() {
        let (here, later) = left.split_at(left.partition_point(|one| one.pose == pose));
        left = later;
        let came = Instant::now();
        let odometry = pose.checked_sub(1).map(|before| graph.odometry[before]);
        online.push(time_s, odometry, here)?;
        longest_s = longest_s.max(came.elapsed().as_secs_f64());
    }
    online.catch_up()?;
    let seconds = started.elapsed().as_secs_f64();
    let [own, whole] = [&online.labels(), &map.labels].map(|labels| Topology::canonical(labels));
    Ok(Followed {
        poses_per_second: graph.times_s.len() as f64 / seconds,
        longest_s,
        agreement: adjusted_rand_index(&own, &whole),
    })
}

impl Followed {
    /// For a terminal.
    pub fn words(&self) -> String {
        let agreement = self.agreement.map_or_else(String::new, |index| {
            format!(", adjusted Rand index with the map above {index:.3}")
        });
        format!(
            "{:.0} poses a second, the slowest in {:.0} ms{agreement}",
            self.poses_per_second,
            1e3 * self.longest_s
        )
    }

    /// For programs.
    pub fn json(&self) -> Value {
        json!({
            "poses_per_second": self.poses_per_second,
            "slowest_pose_s": self.longest_s,
            "adjusted_rand_index_with_map": self.agreement,
        })
    }
}
