//! Associations that look at places only: on dead reckoning, or in turn with the graph.

use topometric::baseline;
use topometric::mission::{Graph, optimum_of};
use topometric::partition::Topology;
use topometric::sighting::Pose;

/// Rounds of associating and optimising.
const MOST_ROUNDS: usize = 15;
/// A cluster on dead reckoning reaches so many standard deviations of a sighting.
const REACH: f64 = 3.0;
/// NP-Graph's spread, in standard deviations of a sighting, …
const SPREAD: f64 = 7.0;
/// … and the weight of a new landmark.
const NEW: f64 = 0.9;
/// Of more sightings no hierarchy is built.
const MOST_FOR_WARD: usize = 6_000;

/// Where sightings lie from these poses, m.
fn places_m(graph: &Graph, poses: &[Pose]) -> Vec<[f64; 2]> {
    let place = |one: &topometric::mission::Observation| {
        let relative = Pose {
            x_m: one.at_m[0],
            y_m: one.at_m[1],
            heading_rad: 0.0,
        };
        poses[one.pose].then(relative).position_m()
    };
    graph.observations.iter().map(place).collect()
}

/// The median standard deviation of a sighting, m.
fn noise_m(graph: &Graph) -> f64 {
    let std = graph.observations.iter().map(|one| {
        let [xx, xy, yy] = one.information;
        (0.5 * (xx + yy) / (xx * yy - xy * xy)).sqrt()
    });
    let mut all: Vec<f64> = std.collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Density clusters of all sightings by dead reckoning (Ester et al. 1996).
pub fn dbscan(graph: &Graph) -> Vec<u32> {
    let places = places_m(graph, &graph.dead_reckoned());
    baseline::dbscan(&places, REACH * noise_m(graph))
        .labels()
        .to_vec()
}

/// Chains of near sightings by dead reckoning.
pub fn gating(graph: &Graph) -> Vec<u32> {
    let places = places_m(graph, &graph.dead_reckoned());
    let found = baseline::gate_by_distance(&places, REACH * noise_m(graph));
    found.labels().to_vec()
}

/// Nearest centroids and the optimum of the graph in turn, from Ward's clusters on dead reckoning,
/// for a number of landmarks that is told.
pub fn k_means(graph: &Graph, n_landmarks: usize) -> Vec<u32> {
    let mut places = places_m(graph, &graph.dead_reckoned());
    if places.len() > MOST_FOR_WARD {
        return (0..places.len() as u32).collect();
    }
    let mut topology = baseline::ward(&places, n_landmarks);
    for _ in 0..MOST_ROUNDS {
        let Ok(found) = optimum_of(graph, topology.labels()) else {
            break;
        };
        places = places_m(graph, &found.poses);
        let centroids = centroids_m(&places, &topology);
        let next = baseline::nearest_place(&places, &centroids);
        if next == topology {
            break;
        }
        topology = next;
    }
    topology.labels().to_vec()
}

/// The rule of NP-Graph (Mu, Liu, Paull, Leonard & How, IROS 2016) and the optimum of the graph in
/// turn: a sighting goes to the landmark with the greatest count · exp(−d²/2s²), or to a new one.
pub fn by_count(graph: &Graph) -> Vec<u32> {
    let spread = SPREAD * noise_m(graph);
    let mut poses = graph.dead_reckoned();
    let mut topology: Option<Topology> = None;
    for _ in 0..MOST_ROUNDS {
        let places = places_m(graph, &poses);
        let next = counted(&places, topology.as_ref(), spread);
        if topology.as_ref() == Some(&next) {
            break;
        }
        let found = optimum_of(graph, next.labels());
        topology = Some(next);
        let Ok(found) = found else { break };
        poses = found.poses;
    }
    topology.map_or_else(Vec::new, |found| found.labels().to_vec())
}

fn counted(places: &[[f64; 2]], before: Option<&Topology>, spread: f64) -> Topology {
    let mut centres = before.map_or_else(Vec::new, |topology| centroids_m(places, topology));
    let mut counts = vec![0.0; centres.len()];
    let mut labels: Vec<Option<usize>> = vec![None; places.len()];
    if let Some(topology) = before {
        for (s, &label) in topology.labels().iter().enumerate() {
            counts[label as usize] += 1.0;
            labels[s] = Some(label as usize);
        }
    }
    for (s, place) in places.iter().enumerate() {
        if let Some(label) = labels[s] {
            counts[label] -= 1.0;
        }
        let weight = |k: usize| {
            let square = (centres[k][0] - place[0]).powi(2) + (centres[k][1] - place[1]).powi(2);
            counts[k] * (-square / (2.0 * spread * spread)).exp()
        };
        let best = (0..centres.len()).max_by(|&a, &b| weight(a).total_cmp(&weight(b)));
        let label = match best.filter(|&best| weight(best) >= NEW) {
            Some(best) => best,
            None => {
                centres.push(*place);
                counts.push(0.0);
                centres.len() - 1
            }
        };
        if before.is_none() {
            let n = counts[label];
            centres[label] = [0, 1].map(|k| (centres[label][k] * n + place[k]) / (n + 1.0));
        }
        counts[label] += 1.0;
        labels[s] = Some(label);
    }
    Topology::canonical(&labels)
}

fn centroids_m(places: &[[f64; 2]], topology: &Topology) -> Vec<[f64; 2]> {
    let sets = topology.sets();
    let centroid = |members: &Vec<u32>| {
        let n = members.len() as f64;
        [0, 1].map(|k| members.iter().map(|&s| places[s as usize][k]).sum::<f64>() / n)
    };
    sets.iter().map(centroid).collect()
}
