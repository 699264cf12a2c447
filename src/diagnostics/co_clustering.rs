//! The co-clustering matrix: the probability that two detections are of one landmark.

use super::undefined::Undefined;
use crate::chain::TopologyCount;

/// N×N, row by row: the share of counted proposals whose topology puts i and j into one set.
/// 1 on the diagonal. `None` if nothing was counted.
pub fn co_clustering(rows: &[TopologyCount]) -> Option<Vec<Vec<f64>>> {
    let total: u64 = rows.iter().map(|row| row.count).sum();
    let n = rows.first()?.topology.labels().len();
    let mut counts = vec![vec![0_u64; n]; n];
    for row in rows {
        let labels = row.topology.labels();
        for i in 0..n {
            for j in 0..n {
                if labels[i] == labels[j] {
                    counts[i][j] += row.count;
                }
            }
        }
    }
    let share = |count: u64| count as f64 / total as f64;
    Some(
        counts
            .into_iter()
            .map(|row| row.into_iter().map(share).collect())
            .collect(),
    )
}

/// How far the co-clustering matrices of chains are from one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoClusteringDifference {
    /// The largest |p_ij − q_ij| over pairs of detections and pairs of chains.
    pub largest: f64,
    /// √(p̄(1 − p̄)(1/ESS_a + 1/ESS_b)): the standard error of that one difference if both chains
    /// sample the same law, p̄ their mean weighted by ESS. It is the largest of many, so two or
    /// three of these are no surprise.
    pub standard_error: f64,
    /// The pair of detections it was found at.
    pub detections: (usize, usize),
    /// The chains it was found between.
    pub chains: (usize, usize),
    /// Mean of |p_ij − q_ij| over pairs of detections and pairs of chains.
    pub mean: f64,
    /// Pairs of detections.
    pub n_pairs: usize,
}

/// Compares N×N co-clustering matrices, one for each chain, with the effective number of draws
/// behind each.
///
/// # Errors
/// [`Undefined::TooFew`] below two chains or two detections.
///
/// # Panics
/// If the matrices differ in size, or `ess` in length.
pub fn co_clustering_difference(
    chains: &[Vec<Vec<f64>>],
    ess: &[f64],
) -> Result<CoClusteringDifference, Undefined> {
    assert_eq!(chains.len(), ess.len(), "an ESS for each chain");
    let n = chains.first().map_or(0, Vec::len);
    let fewest = 2;
    if let Some(&n) = [chains.len(), n].iter().find(|n| **n < fewest) {
        return Err(Undefined::TooFew { n, fewest });
    }
    let (mut sum, mut n_summed) = (0.0, 0_usize);
    let (mut largest, mut detections, mut between) = (-1.0, (0, 1), (0, 1));
    for (a, first) in chains.iter().enumerate() {
        for (b, second) in chains.iter().enumerate().skip(a + 1) {
            assert_eq!(first.len(), second.len(), "matrices of the same detections");
            for i in 0..n {
                for j in i + 1..n {
                    let difference = (first[i][j] - second[i][j]).abs();
                    sum += difference;
                    n_summed += 1;
                    if difference > largest {
                        (largest, detections, between) = (difference, (i, j), (a, b));
                    }
                }
            }
        }
    }
    let (i, j) = detections;
    let (ess_a, ess_b) = (ess[between.0], ess[between.1]);
    let (p, q) = (chains[between.0][i][j], chains[between.1][i][j]);
    let pooled = (p * ess_a + q * ess_b) / (ess_a + ess_b);
    Ok(CoClusteringDifference {
        largest,
        standard_error: (pooled * (1.0 - pooled) * (1.0 / ess_a + 1.0 / ess_b)).sqrt(),
        detections,
        chains: between,
        mean: sum / n_summed as f64,
        n_pairs: n * (n - 1) / 2,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_between_chains() {
        let matrix = |p01: f64, p02: f64, p12: f64| {
            vec![
                vec![1.0, p01, p02],
                vec![p01, 1.0, p12],
                vec![p02, p12, 1.0],
            ]
        };
        let chains = [
            matrix(0.5, 0.2, 0.0),
            matrix(0.5, 0.3, 0.0),
            matrix(0.6, 0.7, 0.1),
        ];
        let found = co_clustering_difference(&chains, &[100.0, 50.0, 25.0]).expect("chains");
        assert_eq!(
            (found.detections, found.chains, found.n_pairs),
            ((0, 2), (0, 2), 3)
        );
        assert!((found.largest - 0.5).abs() < 1e-15);
        // p̄ = (0.2 · 100 + 0.7 · 25)/125 = 0.3.
        let error = (0.3 * 0.7 * (1.0 / 100.0 + 1.0 / 25.0_f64)).sqrt();
        assert!((found.standard_error - error).abs() < 1e-15);
        // (0 + 0.1 + 0) + (0.1 + 0.5 + 0.1) + (0.1 + 0.4 + 0.1), over nine.
        assert!((found.mean - 1.4 / 9.0).abs() < 1e-15);
        let one = co_clustering_difference(&chains[..1], &[1.0]);
        assert_eq!(one, Err(Undefined::TooFew { n: 1, fewest: 2 }));
    }
    use crate::partition::Topology;

    #[test]
    fn shares_of_the_counts() {
        let row = |labels: &[u32], count| TopologyCount {
            topology: Topology::canonical(labels),
            count,
        };
        let matrix = co_clustering(&[row(&[0, 0, 1], 3), row(&[0, 1, 1], 1)]).expect("counts");
        assert_eq!(
            matrix,
            vec![
                vec![1.0, 0.75, 0.0],
                vec![0.75, 1.0, 0.25],
                vec![0.0, 0.25, 1.0]
            ]
        );
        assert_eq!(co_clustering(&[]), None);
    }
}
