//! A mission that is followed pose by pose.

use super::noise::{laps, truth};
use super::*;
use crate::mission::Online;
use crate::partition::Topology;

fn followed(graph: &Graph) -> Online {
    let mut online = Online::new(graph.start);
    for (k, &time_s) in graph.times_s.iter().enumerate() {
        let odometry = k.checked_sub(1).map(|before| graph.odometry[before]);
        let seen = graph.observations.iter().filter(|one| one.pose == k);
        let seen: Vec<Observation> = seen.copied().collect();
        online.push(time_s, odometry, &seen).expect("definite");
        assert_eq!(online.poses().len(), k + 1);
    }
    online.catch_up().expect("definite");
    online
}

#[test]
fn landmarks_are_known_again_on_the_way() {
    for number in 0..3 {
        let graph = laps(1.0, None, number);
        let online = followed(&graph);
        let found = Topology::canonical(&online.labels());
        // What is undecided stays alone, so there may be more sets, but none of two landmarks.
        let known = truth(&graph);
        assert!((16..=20).contains(&found.n_sets()), "{}", found.n_sets());
        for set in found.sets() {
            let of_truth = |s: &u32| known.labels()[*s as usize];
            assert!(set.iter().all(|s| of_truth(s) == of_truth(&set[0])));
        }
        // The last pose is back at the first but one.
        let last = online.poses()[119];
        let there = graph.start.to(last).position_m();
        assert!(there[0].hypot(there[1]) < 1.2, "{there:?}");
    }
}

#[test]
fn poses_that_see_nothing_are_passed() {
    let mut graph = laps(1.0, None, 4);
    graph.observations.retain(|one| one.pose >= 60);
    let online = followed(&graph);
    assert!(Topology::canonical(&online.labels()).n_sets() < 30);
}
