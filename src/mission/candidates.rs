//! The maps that are weighed against each other: of both front ends, with and without duplicates
//! fused.

use rayon::join;

use super::duplicates::{Fused, fuse, unfused};
use super::finish::finish;
use super::front::{self, Front};
use super::graph::Graph;
use super::optimum::Optimum;
use super::solution::{SolvedMap, Stage};
use super::view::Reach;
use crate::partition::Topology;
use crate::rng::Purpose;

/// Maps with a smaller share of the weight of the best are left out.
const LEAST_WEIGHT: f64 = 1e-3;

/// A map at its own optimum.
#[derive(Clone, Debug)]
pub(super) struct Map {
    pub optimum: Optimum,
    /// Whether the front end that defers doubt began it.
    pub is_deferred: bool,
    /// The graph that it is of.
    pub fused: Fused,
}

impl Map {
    /// Of all sightings.
    pub fn ln_posterior(&self) -> f64 {
        self.optimum.ln_posterior + self.fused.ln_differences
    }
}

/// All maps of a graph, each first map improved `starts` times.
pub(super) fn maps(
    graph: &Graph,
    starts: usize,
    purpose: &(impl Fn(&str) -> Purpose + Sync),
    watch: &(dyn Fn(Stage) + Sync),
) -> Vec<Map> {
    let mut maps = Vec::new();
    for fused in [Some(unfused(graph)), fuse(graph)].into_iter().flatten() {
        let reach = Reach::of(&fused.graph.observations);
        let improved = |front: Front, name: &str| -> Vec<Optimum> {
            let part = fused.graph.part();
            let told = |poses| watch(Stage::Poses(poses));
            let first = front::run(front, part, fused.graph.start, reach, &told);
            watch(Stage::Improving);
            let finished = first.iter().flat_map(|(poses, labels)| {
                (0..starts.max(1)).filter_map(move |start| {
                    let purpose = purpose(name);
                    let purpose = match start {
                        0 => purpose,
                        later => purpose.number("start", later as u64),
                    };
                    finish(part, poses, labels, reach, &mut purpose.generator())
                })
            });
            finished.collect()
        };
        let (eager, deferred) = join(
            || improved(Front::Eager, "eager"),
            || improved(Front::Deferring, "deferring"),
        );
        for (optima, is_deferred) in [(eager, false), (deferred, true)] {
            maps.extend(optima.into_iter().map(|optimum| Map {
                optimum,
                is_deferred,
                fused: fused.clone(),
            }));
        }
    }
    maps
}

/// A map with its share of the posterior.
pub(super) struct Weighed {
    pub found: Map,
    weight: f64,
}

impl Weighed {
    /// As it is given to the user.
    pub fn solved(self) -> SolvedMap {
        let Map { optimum, fused, .. } = self.found;
        SolvedMap {
            labels: fused.of_all(&optimum.labels),
            ln_posterior: optimum.ln_posterior + fused.ln_differences,
            poses: optimum.poses,
            landmarks_m: optimum.landmarks_m,
            weight: self.weight,
        }
    }
}

/// The most probable of maps, at least one, and other partitions whose weight counts beside it,
/// the most probable first.
pub(super) fn weighed(mut maps: Vec<Map>) -> (Weighed, Vec<Weighed>) {
    // A stable sort: of equals the first.
    maps.sort_by(|a, b| b.ln_posterior().total_cmp(&a.ln_posterior()));
    let best = maps[0].ln_posterior();
    let mut seen: Vec<Topology> = Vec::new();
    maps.retain(|map| {
        let topology = Topology::canonical(&map.fused.of_all(&map.optimum.labels));
        let is_new = !seen.contains(&topology);
        seen.push(topology);
        is_new && map.ln_posterior() >= best + libm::log(LEAST_WEIGHT)
    });
    let weights: Vec<f64> = maps
        .iter()
        .map(|map| libm::exp(map.ln_posterior() - best))
        .collect();
    let total: f64 = weights.iter().sum();
    let all = maps.into_iter().zip(weights);
    let mut all = all.map(|(found, weight)| Weighed {
        found,
        weight: weight / total,
    });
    let first = all.next().expect("the best map outweighs the least weight");
    (first, all.collect())
}
