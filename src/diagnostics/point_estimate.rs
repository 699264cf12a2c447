//! One topology that stands for the posterior: the one of least expected loss.
//!
//! The MAP topology of a flat posterior is an accident of counting. The mean of a loss over the
//! posterior is not: Binder's (Binder, Biometrika 65, 1978; least squares in Dahl 2006) or the
//! variation of information (Wade & Ghahramani, Bayesian Analysis 13, 2018). Over co-clustering
//! probabilities p_ij both are sums over sets: Binder's mean is Σ_S Σ_{i<j∈S} (1 − 2p_ij) +
//! constant, exactly; of the mean VI, Σ_S Σ_{i∈S} [ln|S| − 2 ln Σ_{j∈S} p_ij]/N + constant is a
//! lower bound, by Jensen's inequality (their §4.1). The search takes the visited topology of the
//! least sum and moves single detections between sets while that lowers it (the sweetening of
//! SALSO: Dahl, Johnson & Müller, JCGS 31, 2022). Of the two, and of the MAP topology, that of the
//! least **mean loss over the draws** is the estimate.

use super::loss::Loss;
use super::undefined::Undefined;
use crate::chain::TopologyCount;
use crate::partition::Topology;

/// Visited topologies that the search starts from, the most frequent ones.
const MAX_VISITED: usize = 10_000;
/// Sweeps over all detections; each lowers the sum, and in practice a few suffice.
const MAX_SWEEPS: usize = 100;
/// A move has to lower the sum by more than what rounding may.
const LEAST_GAIN: f64 = 1e-10;

/// A point estimate with its expected loss.
#[derive(Clone, Debug, PartialEq)]
pub struct PointEstimate {
    /// The topology.
    pub topology: Topology,
    /// Mean distance to the draws, in the unit of the loss.
    pub expected_loss: f64,
    /// Its Monte Carlo standard error, s/√ESS.
    pub standard_error: f64,
    /// Proposals spent at the topology; 0 if it was found by moving detections only.
    pub count: u64,
}

/// The estimate from visited topologies (by falling count), their co-clustering matrix (as
/// [`co_clustering`](super::co_clustering::co_clustering) gives it) and the effective number of
/// draws behind them.
///
/// # Errors
/// [`Undefined::TooShort`] without counts.
///
/// # Panics
/// If the matrix is not one of these topologies' detections.
pub fn point_estimate(
    rows: &[TopologyCount],
    co_clustering: &[Vec<f64>],
    loss: Loss,
    ess: f64,
) -> Result<PointEstimate, Undefined> {
    let Some(map) = rows.first().filter(|row| row.count > 0) else {
        return Err(Undefined::TooShort { n: 0, fewest: 1 });
    };
    let costs = Costs {
        p: co_clustering,
        loss,
    };
    assert_eq!(
        map.topology.labels().len(),
        co_clustering.len(),
        "a matrix of the same detections"
    );
    let visited = rows.iter().take(MAX_VISITED).map(|row| &row.topology);
    let best_visited = visited
        .map(|topology| (costs.of(topology), topology))
        .reduce(|best, next| if next.0 < best.0 { next } else { best })
        .map_or(&map.topology, |(_, topology)| topology);
    let improved = costs.improved(best_visited);
    let finalists = [&improved, best_visited, &map.topology];
    let judged = finalists.map(|topology| (mean_loss(topology, rows, loss), topology));
    let (moments, topology) = judged
        .into_iter()
        .reduce(|best, next| {
            if next.0.mean < best.0.mean {
                next
            } else {
                best
            }
        })
        .expect("three finalists");
    Ok(PointEstimate {
        topology: topology.clone(),
        expected_loss: moments.mean,
        standard_error: moments.sd / ess.sqrt(),
        count: rows
            .iter()
            .find(|row| row.topology == *topology)
            .map_or(0, |row| row.count),
    })
}

/// Mean and standard deviation of a topology's distance to the draws.
pub fn mean_loss(
    topology: &Topology,
    rows: &[TopologyCount],
    loss: Loss,
) -> super::moments::Moments {
    let distances = rows
        .iter()
        .map(|row| (loss.distance(topology, &row.topology), row.count));
    super::moments::moments(distances).expect("counted topologies")
}

/// The part of the expected loss that depends on the estimate, as a sum over its sets.
struct Costs<'a> {
    p: &'a [Vec<f64>],
    loss: Loss,
}

impl Costs<'_> {
    fn of(&self, topology: &Topology) -> f64 {
        let sets = sets_of(topology);
        sets.iter()
            .map(|set| {
                // One after another, each joining those before.
                let mut sums: Vec<f64> = Vec::with_capacity(set.len());
                let mut cost = 0.0;
                for (place, &i) in set.iter().enumerate() {
                    cost += self.of_joining(i, &set[..place], &sums);
                    for (sum, &j) in sums.iter_mut().zip(set) {
                        *sum += self.p[i][j];
                    }
                    sums.push(1.0 + set[..place].iter().map(|&j| self.p[i][j]).sum::<f64>());
                }
                cost
            })
            .sum()
    }

    /// What detection i adds by joining `set`, whose members' Σ_{j∈S} p are `sums`.
    fn of_joining(&self, i: usize, set: &[usize], sums: &[f64]) -> f64 {
        let p = &self.p[i];
        match self.loss {
            Loss::Binder => set.iter().map(|&j| 1.0 - 2.0 * p[j]).sum(),
            Loss::VariationOfInformation => {
                let n = set.len() as f64;
                let sizes =
                    (n + 1.0) * libm::log(n + 1.0) - if n > 0.0 { n * libm::log(n) } else { 0.0 };
                let (mut own, mut others) = (1.0, 0.0);
                for (&j, &sum) in set.iter().zip(sums) {
                    own += p[j];
                    others += libm::log1p(p[j] / sum);
                }
                sizes - 2.0 * (others + libm::log(own))
            }
        }
    }

    /// Moves single detections to the set, or to one of their own, where they cost least, in their
    /// order, until a sweep moves none.
    fn improved(&self, start: &Topology) -> Topology {
        let n = start.labels().len();
        let mut sets = sets_of(start);
        let mut set_of: Vec<usize> = start.labels().iter().map(|&label| label as usize).collect();
        let sum_in = |i: usize, set: &[usize]| set.iter().map(|&j| self.p[i][j]).sum::<f64>();
        let mut sums: Vec<f64> = (0..n).map(|i| sum_in(i, &sets[set_of[i]])).collect();
        for _ in 0..MAX_SWEEPS {
            let mut moved = false;
            for i in 0..n {
                let from = set_of[i];
                sets[from].retain(|&j| j != i);
                for &j in &sets[from] {
                    sums[j] -= self.p[i][j];
                }
                let cost = |set: &[usize]| {
                    let of_members: Vec<f64> = set.iter().map(|&j| sums[j]).collect();
                    self.of_joining(i, set, &of_members)
                };
                let (mut to, mut least) = (from, cost(&sets[from]) - LEAST_GAIN);
                let mut empty = sets[from].is_empty();
                for (other, set) in sets.iter().enumerate().filter(|(other, _)| *other != from) {
                    // Of a set that never holds one of its own kind only an empty one can be
                    // better, and one empty set is as good as another.
                    let is_candidate = if set.is_empty() {
                        !empty
                    } else {
                        set.iter().any(|&j| self.p[i][j] > 0.0)
                    };
                    empty |= set.is_empty();
                    if is_candidate && cost(set) < least {
                        (to, least) = (other, cost(set));
                    }
                }
                if !empty && cost(&[]) < least {
                    to = sets.len();
                    sets.push(Vec::new());
                }
                for &j in &sets[to] {
                    sums[j] += self.p[i][j];
                }
                sums[i] = 1.0 + sum_in(i, &sets[to]);
                sets[to].push(i);
                set_of[i] = to;
                moved |= to != from;
            }
            if !moved {
                break;
            }
        }
        Topology::canonical(&set_of)
    }
}

fn sets_of(topology: &Topology) -> Vec<Vec<usize>> {
    let mut sets = vec![Vec::new(); topology.n_sets()];
    for (i, &label) in topology.labels().iter().enumerate() {
        sets[label as usize].push(i);
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::co_clustering::co_clustering;
    use crate::diagnostics::tests::random_posterior;
    use crate::partition::Partitions;

    const LOSSES: [Loss; 2] = [Loss::Binder, Loss::VariationOfInformation];

    /// Against every one of the 203 topologies of six detections, on random posteriors. Binder's
    /// sum is the mean itself but for a constant and a factor; single moves may end in a local
    /// minimum, not below the best and not above the best visited.
    #[test]
    fn against_enumeration() {
        let (mut n_best, n_cases) = ([0, 0], 60);
        for seed in 0..n_cases {
            let rows = random_posterior(6, 12, seed);
            let matrix = co_clustering(&rows).expect("counts");
            for (place, loss) in LOSSES.into_iter().enumerate() {
                let found = point_estimate(&rows, &matrix, loss, 100.0).expect("counts");
                let all: Vec<f64> = Partitions::of(6)
                    .map(|t| mean_loss(&t, &rows, loss).mean)
                    .collect();
                let best = all.iter().copied().fold(f64::INFINITY, f64::min);
                let map = mean_loss(&rows[0].topology, &rows, loss).mean;
                assert!(found.expected_loss >= best - 1e-12 && found.expected_loss <= map + 1e-12);
                if loss == Loss::Binder {
                    let visited = rows
                        .iter()
                        .map(|row| mean_loss(&row.topology, &rows, loss).mean);
                    assert!(found.expected_loss <= visited.fold(f64::INFINITY, f64::min) + 1e-12);
                }
                n_best[place] += usize::from(found.expected_loss <= best + 1e-12);
            }
        }
        assert!(
            n_best[0] >= 50 && n_best[1] >= 40,
            "{n_best:?} of {n_cases}"
        );
    }

    #[test]
    fn binders_sum_is_the_mean_loss_and_that_of_vi_a_bound() {
        let rows = random_posterior(6, 12, 7);
        let matrix = co_clustering(&rows).expect("counts");
        let constants: Vec<Vec<f64>> = LOSSES
            .iter()
            .map(|&loss| {
                let costs = Costs { p: &matrix, loss };
                let scale = if loss == Loss::Binder { 15.0 } else { 6.0 };
                Partitions::of(6)
                    .map(|t| mean_loss(&t, &rows, loss).mean - costs.of(&t) / scale)
                    .collect()
            })
            .collect();
        for difference in &constants[0] {
            assert!((difference - constants[0][0]).abs() < 1e-12);
        }
        // The constant of the bound is Σ_i mean of ln|S_i| over the draws; what is above it is the
        // gap.
        let total: u64 = rows.iter().map(|row| row.count).sum();
        let constant: f64 = rows
            .iter()
            .map(|row| {
                let sizes: f64 = sets_of(&row.topology)
                    .iter()
                    .map(|s| s.len() as f64 * (s.len() as f64).ln())
                    .sum();
                sizes / 6.0 * row.count as f64 / total as f64
            })
            .sum();
        assert!(
            constants[1]
                .iter()
                .all(|difference| *difference >= constant - 1e-12)
        );
    }

    #[test]
    fn the_improved_topology_costs_no_more_and_its_cost_is_the_sum_over_sets() {
        for seed in 0..20 {
            let rows = random_posterior(9, 5, seed);
            let matrix = co_clustering(&rows).expect("counts");
            for loss in LOSSES {
                let costs = Costs { p: &matrix, loss };
                for start in rows.iter().map(|row| &row.topology) {
                    assert!(costs.of(&costs.improved(start)) <= costs.of(start) + 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_posterior_on_one_topology() {
        let rows = [TopologyCount {
            topology: Topology::canonical(&[0, 1, 0]),
            count: 5,
        }];
        let matrix = co_clustering(&rows).expect("counts");
        for loss in LOSSES {
            let found = point_estimate(&rows, &matrix, loss, 1.0).expect("counts");
            assert_eq!(
                (found.topology, found.expected_loss, found.count),
                (rows[0].topology.clone(), 0.0, 5)
            );
        }
        assert!(point_estimate(&[], &[], Loss::Binder, 1.0).is_err());
    }
}
