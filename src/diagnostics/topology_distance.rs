//! Whether chains agree on the frequencies of topologies, beyond what chance explains.
//!
//! Total variation ½Σ|p_k − q_k| and Hellinger distance √(½Σ(√p_k − √q_k)²), both from 0 to 1,
//! between the frequencies of every two chains. With many topologies they are large for chains that
//! sample the same law: 100 independent draws each from a thousand equally likely topologies are
//! 0.9 apart. So they are set against a **null by simulation**: every chain draws as many
//! independent topologies as its ESS says, rounded down, from the pooled frequencies; the largest
//! distance of two is taken as for the chains themselves.
//!
//! Topologies with less than five effective draws of all chains, and less than 5 % of each, count as
//! one. What is met once comes again in a simulation, and hardly ever in a chain, so
//! the null would lie too low.

use std::collections::BTreeMap;

use rand::{Rng, RngExt};

use super::undefined::Undefined;
use crate::chain::TopologyCount;

/// Simulations of the null: a 95 % quantile is then between the 93 % and the 97 % one, p-values are
/// known to 0.01.
const N_SIMULATIONS: usize = 400;
/// Independent draws simulated for a chain at most. More would cost and only bring the null nearer
/// to 0: the quantile then errs on the large side.
const MAX_DRAWS: f64 = 10_000.0;

/// Effective draws of all chains from which a topology is told from the rest: what Pearson's test asks
/// of an expected count.
const FEWEST: f64 = 5.0;
/// Share of a chain from which a topology is told from the rest, however few its draws.
const RARE: f64 = 0.05;

/// ½Σ|p − q| of two laws on the same topologies.
pub fn total_variation(p: &[f64], q: &[f64]) -> f64 {
    p.iter().zip(q).map(|(p, q)| (p - q).abs()).sum::<f64>() / 2.0
}

/// √(½Σ(√p − √q)²) of two laws on the same topologies.
pub fn hellinger(p: &[f64], q: &[f64]) -> f64 {
    let square = |(p, q): (&f64, &f64)| (p.sqrt() - q.sqrt()) * (p.sqrt() - q.sqrt());
    (p.iter().zip(q).map(square).sum::<f64>() / 2.0).sqrt()
}

/// The largest distance between two chains, and what it would be if they sampled one law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// As observed.
    pub largest: f64,
    /// The chains it was found between.
    pub chains: (usize, usize),
    /// 95 % quantile of the null.
    pub null_95: f64,
    /// (1 + simulations at least as large)/(1 + simulations).
    pub p_value: f64,
}

/// Both distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyDistance {
    /// Total variation.
    pub total_variation: Distance,
    /// Hellinger distance.
    pub hellinger: Distance,
    /// Simulations of the null.
    pub n_simulations: usize,
}

/// Counts of all topologies that any of the chains holds, in one order, a row for each chain.
/// Topologies that a truncated table has dropped are missing.
pub fn aligned_counts(chains: &[&[TopologyCount]]) -> Vec<Vec<u64>> {
    let mut columns = BTreeMap::new();
    for (chain, rows) in chains.iter().enumerate() {
        for row in *rows {
            let column = columns
                .entry(&row.topology)
                .or_insert_with(|| vec![0; chains.len()]);
            column[chain] += row.count;
        }
    }
    let of_chain = |chain: usize| columns.values().map(|column| column[chain]).collect();
    (0..chains.len()).map(of_chain).collect()
}

/// Compares the chains' counts of the same topologies (as [`aligned_counts`] gives them), with the
/// ESS of each chain ([`topology_ess`](super::topology_ess)). A chain too stuck to have one is
/// worth a single draw: give 1.
///
/// # Errors
/// [`Undefined::TooFew`] below two chains; [`Undefined::TooShort`] for a chain without counts, or
/// with an ESS below 1.
///
/// # Panics
/// If `ess` or a chain's counts differ in length from the others.
pub fn topology_distance(
    counts: &[Vec<u64>],
    ess: &[f64],
    rng: &mut impl Rng,
) -> Result<TopologyDistance, Undefined> {
    assert_eq!(counts.len(), ess.len(), "an ESS for each chain");
    if counts.len() < 2 {
        return Err(Undefined::TooFew {
            n: counts.len(),
            fewest: 2,
        });
    }
    assert!(
        counts.iter().all(|row| row.len() == counts[0].len()),
        "counts of the same topologies"
    );
    for (row, ess) in counts.iter().zip(ess) {
        let n = row.iter().sum::<u64>();
        if n == 0 || ess.is_nan() || *ess < 1.0 {
            return Err(Undefined::TooShort {
                n: n.min(ess.max(0.0) as u64),
                fewest: 1,
            });
        }
    }
    let observed = with_rare_as_one(counts.iter().map(|row| frequencies(row)).collect(), ess);
    let n_draws: Vec<u64> = ess.iter().map(|ess| ess.min(MAX_DRAWS) as u64).collect();
    let cumulative = cumulative_of_pool(&observed, ess);
    let mut simulated = [Vec::new(), Vec::new()];
    for _ in 0..N_SIMULATIONS {
        let mut draw = |&n: &u64| {
            let mut row = vec![0; cumulative.len()];
            for _ in 0..n {
                let u = rng.random::<f64>();
                row[cumulative
                    .partition_point(|c| *c <= u)
                    .min(cumulative.len() - 1)] += 1;
            }
            frequencies(&row)
        };
        let rows: Vec<Vec<f64>> = n_draws.iter().map(&mut draw).collect();
        simulated[0].push(largest(&rows, total_variation).0);
        simulated[1].push(largest(&rows, hellinger).0);
    }
    let [null_total_variation, null_hellinger] = simulated;
    Ok(TopologyDistance {
        total_variation: against(largest(&observed, total_variation), null_total_variation),
        hellinger: against(largest(&observed, hellinger), null_hellinger),
        n_simulations: N_SIMULATIONS,
    })
}

fn frequencies(counts: &[u64]) -> Vec<f64> {
    let total = counts.iter().sum::<u64>() as f64;
    counts.iter().map(|count| *count as f64 / total).collect()
}

/// The same rows with all topologies that are rare among all chains in one column, the last.
fn with_rare_as_one(rows: Vec<Vec<f64>>, ess: &[f64]) -> Vec<Vec<f64>> {
    let draws = |k: usize| -> f64 { rows.iter().zip(ess).map(|(row, ess)| row[k] * ess).sum() };
    let is_rare = |k: usize| draws(k) < FEWEST && rows.iter().all(|row| row[k] < RARE);
    let is_rare: Vec<bool> = (0..rows[0].len()).map(is_rare).collect();
    let of_row = |row: &Vec<f64>| {
        let (mut kept, mut rest) = (Vec::new(), 0.0);
        for (&share, &is_rare) in row.iter().zip(&is_rare) {
            if is_rare {
                rest += share;
            } else {
                kept.push(share);
            }
        }
        kept.push(rest);
        kept
    };
    rows.iter().map(of_row).collect()
}

/// Cumulative frequencies of all chains, each weighted by its ESS.
fn cumulative_of_pool(rows: &[Vec<f64>], ess: &[f64]) -> Vec<f64> {
    let total: f64 = ess.iter().sum();
    let pooled = |k: usize| {
        rows.iter()
            .zip(ess)
            .map(|(row, ess)| row[k] * ess / total)
            .sum::<f64>()
    };
    let cumulate = |sum: &mut f64, k: usize| {
        *sum += pooled(k);
        Some(*sum)
    };
    (0..rows[0].len()).scan(0.0, cumulate).collect()
}

fn largest(rows: &[Vec<f64>], distance: fn(&[f64], &[f64]) -> f64) -> (f64, (usize, usize)) {
    let pairs = (0..rows.len()).flat_map(|a| (a + 1..rows.len()).map(move |b| (a, b)));
    let distances = pairs.map(|(a, b)| (distance(&rows[a], &rows[b]), (a, b)));
    distances
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .expect("at least two chains")
}

fn against((largest, chains): (f64, (usize, usize)), mut null: Vec<f64>) -> Distance {
    null.sort_unstable_by(f64::total_cmp);
    // Equal laws may differ in the last digit by the order of their sums.
    let n_as_large = null.iter().filter(|d| **d >= largest - 1e-12).count();
    Distance {
        largest,
        chains,
        null_95: null[(0.95 * null.len() as f64).ceil() as usize - 1],
        p_value: (1 + n_as_large) as f64 / (1 + null.len()) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::Topology;
    use crate::rng::Purpose;

    #[test]
    fn known_distances() {
        let (p, q) = ([0.5, 0.5, 0.0], [0.0, 0.5, 0.5]);
        assert_eq!(total_variation(&p, &q), 0.5);
        assert!((hellinger(&p, &q) - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!((total_variation(&p, &p), hellinger(&p, &p)), (0.0, 0.0));
        assert_eq!(
            (
                total_variation(&[1.0, 0.0], &[0.0, 1.0]),
                hellinger(&[1.0, 0.0], &[0.0, 1.0])
            ),
            (1.0, 1.0)
        );
    }

    #[test]
    fn topologies_are_matched_by_what_they_are() {
        let row = |labels: &[u32], count| TopologyCount {
            topology: Topology::canonical(labels),
            count,
        };
        let first = [row(&[0, 1], 5), row(&[0, 0], 2)];
        let second = [row(&[3, 3], 4)];
        assert_eq!(aligned_counts(&[&first, &second]), [[2, 5], [4, 0]]);
    }

    /// Chains of independent draws from one law: the p-value is uniform, so of 200 repetitions
    /// about 5 % fall below 0.05. Five standard errors; the pooled law, which knows its own draws,
    /// makes it a little conservative.
    #[test]
    fn chance_is_not_taken_for_disagreement() {
        let mut rng = Purpose::new("topology distance", 1).generator();
        let mut n_below = [0; 2];
        for _ in 0..200 {
            let counts: Vec<Vec<u64>> = (0..3)
                .map(|_| {
                    let mut row = vec![0; 20];
                    for _ in 0..80 {
                        let u: f64 = rng.random();
                        row[(u * u * 20.0) as usize] += 1;
                    }
                    row
                })
                .collect();
            let found = topology_distance(&counts, &[80.0; 3], &mut rng).expect("three chains");
            n_below[0] += usize::from(found.total_variation.p_value <= 0.05);
            n_below[1] += usize::from(found.hellinger.p_value <= 0.05);
        }
        for n in n_below {
            let error = (200.0_f64 * 0.05 * 0.95).sqrt();
            assert!((n as f64) < 10.0 + 5.0 * error, "{n_below:?}");
        }
    }

    /// A quarter of the draws at one topology, the others hardly ever at one twice: chance does not
    /// put two chains further apart than the null has it.
    #[test]
    fn topologies_that_hardly_repeat_are_no_disagreement() {
        let mut rng = Purpose::new("topology distance", 4).generator();
        let (n_chains, n_draws, n_others) = (4, 400, 40_000);
        let mut n_below = 0;
        for _ in 0..40 {
            let counts: Vec<Vec<u64>> = (0..n_chains)
                .map(|_| {
                    let mut row = vec![0; 1 + n_others];
                    for _ in 0..n_draws {
                        let is_first = rng.random::<f64>() < 0.25;
                        let other = 1 + rng.random_range(0..n_others);
                        row[if is_first { 0 } else { other }] += 1;
                    }
                    row
                })
                .collect();
            let ess = vec![f64::from(n_draws); n_chains];
            let found = topology_distance(&counts, &ess, &mut rng).expect("four chains");
            n_below += u32::from(found.total_variation.p_value <= 0.05);
        }
        // Of 40, 2 and five standard errors.
        assert!(n_below < 9, "{n_below}");
    }

    #[test]
    fn disagreement_is_found_at_the_chains_that_disagree() {
        let mut rng = Purpose::new("topology distance", 2).generator();
        let counts = [
            vec![50, 30, 20, 0],
            vec![48, 33, 19, 0],
            vec![10, 20, 20, 50],
        ];
        let found = topology_distance(&counts, &[100.0; 3], &mut rng).expect("three chains");
        for distance in [found.total_variation, found.hellinger] {
            assert!(distance.p_value < 0.01 && distance.largest > distance.null_95);
            assert_eq!(distance.chains.1, 2);
        }
        // The same frequencies behind two draws say nothing.
        let found = topology_distance(&counts, &[2.0; 3], &mut rng).expect("three chains");
        assert!(found.total_variation.p_value > 0.3);
    }

    #[test]
    fn undefined_with_a_reason() {
        let mut rng = Purpose::new("topology distance", 3).generator();
        let name = |counts: &[Vec<u64>], ess: &[f64], rng: &mut _| {
            topology_distance(counts, ess, rng)
                .map_err(|reason| reason.name())
                .err()
        };
        assert_eq!(name(&[vec![1]], &[1.0], &mut rng), Some("too-few"));
        assert_eq!(
            name(&[vec![1], vec![0]], &[1.0, 1.0], &mut rng),
            Some("too-short")
        );
        assert_eq!(
            name(&[vec![1], vec![1]], &[1.0, 0.5], &mut rng),
            Some("too-short")
        );
        assert_eq!(
            name(&[vec![1], vec![1]], &[1.0, f64::NAN], &mut rng),
            Some("too-short")
        );
        // Chains that agree on a single topology do not differ, nor would they by chance.
        let found =
            topology_distance(&[vec![9], vec![7]], &[1.0, 1.0], &mut rng).expect("two chains");
        assert_eq!(
            (found.hellinger.largest, found.hellinger.p_value),
            (0.0, 1.0)
        );
    }
}
