//! The picture of a solved mission.

use crate::figure::mission_map::{MissionLandmark, MissionMap};
use crate::figure::scene::Scene;
use crate::mission::{Graph, Misfit, Solution};
use crate::sighting::Pose;

/// A sighting is in doubt if its landmark is less probable than this.
pub const DOUBTFUL: f64 = 0.95;

/// The way, the landmarks, what is in doubt and what does not fit. The graph is that of the
/// solution's noise.
pub fn mission_figure(graph: &Graph, solution: &Solution, title: String) -> Scene {
    let map = &solution.map;
    let seen = map.sighted_m(graph);
    let doubtful = (0..seen.len()).filter(|&s| solution.probabilities[s] < DOUBTFUL);
    let landmarks = solution.landmarks.iter().map(|one| {
        let [xx, xy, yy] = one.covariance_m2;
        MissionLandmark {
            position_m: one.position_m,
            covariance_m2: [[xx, xy], [xy, yy]],
            probability: one.probability,
        }
    });
    let way = |poses: &[Pose]| poses.iter().map(|pose| pose.position_m()).collect();
    let figure = MissionMap {
        title,
        reckoned_m: way(&graph.dead_reckoned()),
        driven_m: way(&map.poses),
        landmarks: landmarks.collect(),
        doubtful_m: doubtful
            .map(|s| [seen[s], map.landmarks_m[map.labels[s] as usize]])
            .collect(),
        misfits_m: solution
            .fit
            .worst
            .iter()
            .map(|misfit| match *misfit {
                Misfit::Odometry(k, _) => map.poses[k + 1].position_m(),
                Misfit::Sighting(s, _) => seen[s],
            })
            .collect(),
    };
    figure.page(1600, 1300)
}
