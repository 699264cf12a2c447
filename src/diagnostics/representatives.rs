//! A few topologies that stand for a posterior together, each with its weight: one where there is one
//! answer, several where there are several.
//!
//! Of K topologies every draw belongs to the nearest one, by the variation of information. The K are
//! medoids: they make the expected distance of a draw to its own, L_K, small. They are found by adding
//! the one that lowers L most, and then moving each to the medoid of its draws until none moves
//! (Kaufman & Rousseeuw 1990). One more is taken as long as it lowers L by at least 30 %, and each
//! has 5 % of the draws or more.
//!
//! The idea is that of WASABI (Balocchi & Wade 2025, arXiv 2506.16295): the discrete law on K
//! partitions that is nearest to the posterior in Wasserstein distance. Its partitions need not be
//! draws; ours are.

use std::collections::BTreeMap;

use super::loss::Loss;
use crate::chain::TopologyCount;
use crate::partition::Topology;

/// Draws that are compared at most, at even places of all draws in the order of the rows.
pub const N_DRAWS: u64 = 256;
/// Labels that are compared: of ten thousand detections a hundred draws, which takes a second.
const MOST_LABELS: f64 = 1e8;
/// Answers at most.
const MOST: usize = 6;
/// By so much one more must lower the expected distance.
const LEAST_GAIN: f64 = 0.3;
/// The least share of draws that an answer has.
const LEAST_WEIGHT: f64 = 0.05;
/// Rounds of moving at most; each lowers L, and a few do.
const MOST_ROUNDS: usize = 50;

/// A topology that stands for a share of the draws.
#[derive(Clone, Debug, PartialEq)]
pub struct Representative {
    /// A draw.
    pub topology: Topology,
    /// The share of the draws that are nearest to it.
    pub weight: f64,
    /// Their mean distance to it, nats.
    pub mean_distance: f64,
    /// These draws, each with its share of all.
    pub draws: Vec<(Topology, f64)>,
}

impl Representative {
    /// Pairs of detections (i < j) that share a set in some of its draws, with the share of its
    /// draws in which they do.
    pub fn pairs(&self) -> BTreeMap<(u32, u32), f64> {
        let mut pairs = BTreeMap::new();
        for (topology, share) in &self.draws {
            for members in topology.sets() {
                for (place, &j) in members.iter().enumerate() {
                    for &i in &members[..place] {
                        *pairs.entry((i, j)).or_insert(0.0) += share / self.weight;
                    }
                }
            }
        }
        pairs
    }
}

/// The representatives of topologies by falling count, the one with most draws first; none without
/// any draw.
pub fn representatives(rows: &[TopologyCount]) -> Vec<Representative> {
    let (points, weights) = even_draws(rows);
    if points.is_empty() {
        return Vec::new();
    }
    let vi = Loss::VariationOfInformation;
    let mut distances = vec![vec![0.0; points.len()]; points.len()];
    for (i, one) in points.iter().enumerate() {
        for (j, other) in points[..i].iter().enumerate() {
            let distance = vi.distance(one, other);
            distances[i][j] = distance;
            distances[j][i] = distance;
        }
    }
    let cloud = Cloud { distances, weights };
    let mut found = cloud.moved(vec![cloud.medoid(|_| true)]);
    while found.len() < MOST {
        let more = cloud.moved(cloud.with_one_more(&found));
        let gains = cloud.loss(&more) <= (1.0 - LEAST_GAIN) * cloud.loss(&found);
        let all_matter = cloud
            .shares(&more)
            .iter()
            .all(|share| *share >= LEAST_WEIGHT);
        if cloud.loss(&found) == 0.0 || !gains || !all_matter {
            break;
        }
        found = more;
    }
    let shares = cloud.shares(&found);
    let mut answers: Vec<Representative> = found
        .iter()
        .enumerate()
        .map(|(place, &point)| Representative {
            topology: points[point].clone(),
            weight: shares[place],
            mean_distance: cloud.sum(&found, |own| own == place) / shares[place],
            draws: (points.iter().zip(&cloud.weights).enumerate())
                .filter(|(i, _)| cloud.nearest(&found, *i).0 == place)
                .map(|(_, (&topology, &share))| (topology.clone(), share))
                .collect(),
        })
        .collect();
    answers.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    answers
}

/// Topologies at even places of all draws, with the share of each.
fn even_draws(rows: &[TopologyCount]) -> (Vec<&Topology>, Vec<f64>) {
    let total: u64 = rows.iter().map(|row| row.count).sum();
    let n_labels = rows.first().map_or(1, |row| row.topology.labels().len());
    let affordable = (MOST_LABELS / n_labels.max(1) as f64).sqrt() as u64;
    let n = N_DRAWS.min(total).min(affordable.max(1));
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    let (mut end, mut taken) = (0, 0);
    for row in rows {
        end += row.count;
        // Draw k stands in the middle of its share: at (2k + 1)·total/(2n).
        let mut own = 0;
        while taken < n
            && u128::from(2 * taken + 1) * u128::from(total) < 2 * u128::from(end) * u128::from(n)
        {
            taken += 1;
            own += 1;
        }
        if own > 0 {
            points.push(&row.topology);
            weights.push(own as f64 / n as f64);
        }
    }
    (points, weights)
}

/// Points with their distances and weights.
struct Cloud {
    distances: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Cloud {
    /// Which of some points is nearest to point i: its place among them, and how far away it is.
    fn nearest(&self, medoids: &[usize], i: usize) -> (usize, f64) {
        let distance = |medoid: usize| self.distances[i][medoid];
        let mut nearest = (0, distance(medoids[0]));
        for (place, &medoid) in medoids.iter().enumerate().skip(1) {
            if distance(medoid) < nearest.1 {
                nearest = (place, distance(medoid));
            }
        }
        nearest
    }

    /// Σ w·distance over the points whose nearest is one of these.
    fn sum(&self, medoids: &[usize], counts: impl Fn(usize) -> bool) -> f64 {
        let of = |i: usize| match self.nearest(medoids, i) {
            (place, distance) if counts(place) => self.weights[i] * distance,
            _ => 0.0,
        };
        (0..self.weights.len()).map(of).sum()
    }

    /// L.
    fn loss(&self, medoids: &[usize]) -> f64 {
        self.sum(medoids, |_| true)
    }

    fn shares(&self, medoids: &[usize]) -> Vec<f64> {
        let mut shares = vec![0.0; medoids.len()];
        for (i, weight) in self.weights.iter().enumerate() {
            shares[self.nearest(medoids, i).0] += weight;
        }
        shares
    }

    /// The point with the least mean distance to some of them.
    fn medoid(&self, counts: impl Fn(usize) -> bool) -> usize {
        let all = || 0..self.weights.len();
        let cost = |point: usize| -> f64 {
            let counted = all().filter(|&i| counts(i));
            counted
                .map(|i| self.weights[i] * self.distances[i][point])
                .sum()
        };
        let candidates = all().filter(|&i| counts(i));
        let costs = candidates.map(|point| (point, cost(point)));
        let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(0, |(point, _)| point)
    }

    /// The same points and the one that lowers L most.
    fn with_one_more(&self, medoids: &[usize]) -> Vec<usize> {
        let with = |point: usize| [medoids, &[point]].concat();
        let losses = (0..self.weights.len()).map(|point| (point, self.loss(&with(point))));
        let best = losses.min_by(|a, b| a.1.total_cmp(&b.1));
        with(best.map_or(0, |(point, _)| point))
    }

    /// Each moved to the medoid of its points, until none moves.
    fn moved(&self, mut medoids: Vec<usize>) -> Vec<usize> {
        for _ in 0..MOST_ROUNDS {
            let nearest: Vec<usize> = (0..self.weights.len())
                .map(|i| self.nearest(&medoids, i).0)
                .collect();
            let next: Vec<usize> = (0..medoids.len())
                .map(|place| self.medoid(|i| nearest[i] == place))
                .collect();
            if next == medoids {
                break;
            }
            medoids = next;
        }
        medoids
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Generator, Purpose};
    use rand::RngExt;
    use std::collections::HashMap;

    fn rows(draws: impl Iterator<Item = Vec<u32>>) -> Vec<TopologyCount> {
        let mut counts: HashMap<Topology, u64> = HashMap::new();
        for labels in draws {
            *counts.entry(Topology::canonical(&labels)).or_default() += 1;
        }
        let row = |(topology, count)| TopologyCount { topology, count };
        let mut rows: Vec<TopologyCount> = counts.into_iter().map(row).collect();
        rows.sort_by(|a, b| b.count.cmp(&a.count).then(a.topology.cmp(&b.topology)));
        rows
    }

    /// About a topology: each label is another one with this probability.
    fn about(labels: &[u32], noise: f64, rng: &mut Generator) -> Vec<u32> {
        let label = |&own: &u32| {
            if rng.random::<f64>() < noise {
                rng.random_range(0..5)
            } else {
                own
            }
        };
        labels.iter().map(label).collect()
    }

    fn two() -> [Vec<u32>; 2] {
        let blocks = (0..30).map(|i| i / 10).collect();
        let stripes = (0..30).map(|i| i % 3).collect();
        [blocks, stripes]
    }

    #[test]
    fn one_answer_where_there_is_one() {
        let mut rng = Purpose::new("representatives test", 1).generator();
        let [blocks, _] = two();
        for noise in [0.0, 0.02, 0.1, 0.3] {
            let draws = (0..3000).map(|_| about(&blocks, noise, &mut rng));
            let found = representatives(&rows(draws.collect::<Vec<_>>().into_iter()));
            assert_eq!(found.len(), 1, "{noise}: {found:?}");
            assert!((found[0].weight - 1.0).abs() < 1e-12);
        }
        assert!(representatives(&[]).is_empty());
    }

    #[test]
    fn two_modes_come_with_their_weights() {
        let mut rng = Purpose::new("representatives test", 2).generator();
        let modes = two();
        for (share, noise) in [(0.6, 0.03), (0.85, 0.1), (0.5, 0.0)] {
            let draws: Vec<Vec<u32>> = (0..4000)
                .map(|_| {
                    let first = rng.random::<f64>() < share;
                    about(&modes[usize::from(!first)], noise, &mut rng)
                })
                .collect();
            let found = representatives(&rows(draws.into_iter()));
            assert_eq!(found.len(), 2, "{share} {noise}: {found:?}");
            // 256 draws at even places: within four standard deviations of independent ones.
            assert!((found[0].weight - share).abs() < 0.12, "{share}: {found:?}");
            let total: f64 = found.iter().map(|own| own.weight).sum();
            assert!((total - 1.0).abs() < 1e-12);
            if noise == 0.0 {
                // Items 0 and 1 share a block, items 0 and 3 a block and a stripe.
                for own in &found {
                    let pairs = own.pairs();
                    let is_blocks = own.topology == Topology::canonical(&modes[0]);
                    assert_eq!(pairs.contains_key(&(0, 1)), is_blocks);
                    assert!((pairs[&(0, 3)] - 1.0).abs() < 1e-12);
                    assert!(!pairs.contains_key(&(0, 10)) && !pairs.contains_key(&(1, 0)));
                }
            }
            if noise < 0.05 {
                let own: Vec<&Topology> = found.iter().map(|own| &own.topology).collect();
                for mode in &modes {
                    assert!(own.contains(&&Topology::canonical(mode)), "{own:?}");
                }
            }
        }
    }

    /// A second answer that few draws have is none.
    #[test]
    fn what_few_draws_say_is_no_answer() {
        let [blocks, stripes] = two();
        let draws = (0..1000).map(|k| if k < 30 { &stripes } else { &blocks }.clone());
        let found = representatives(&rows(draws));
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].topology, Topology::canonical(&blocks));
        let vi = Loss::VariationOfInformation;
        let apart = vi.distance(
            &Topology::canonical(&blocks),
            &Topology::canonical(&stripes),
        );
        assert!((found[0].mean_distance / apart - 0.03).abs() < 0.005);
    }
}
