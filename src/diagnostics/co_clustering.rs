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
        for members in row.topology.sets() {
            for &i in &members {
                for &j in &members {
                    counts[i as usize][j as usize] += row.count;
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

/// Detections i < j with the probability that they share a set, by i and then j; 0 for a pair that is not among them.
pub type Pairs = [(u32, u32, f32)];

/// Compares the co-clustering of N detections by several chains, with the effective number of draws behind each. Costs
/// what the pairs cost that share a set at all, of which there are about N and not N².
///
/// # Errors
/// [`Undefined::TooFew`] below two chains or two detections.
///
/// # Panics
/// If `ess` differs in length.
pub fn co_clustering_difference(
    chains: &[&Pairs],
    n: usize,
    ess: &[f64],
) -> Result<CoClusteringDifference, Undefined> {
    assert_eq!(chains.len(), ess.len(), "an ESS for each chain");
    let fewest = 2;
    if let Some(&n) = [chains.len(), n].iter().find(|n| **n < fewest) {
        return Err(Undefined::TooFew { n, fewest });
    }
    let (n_pairs, n_compared) = (n * (n - 1) / 2, chains.len() * (chains.len() - 1) / 2);
    let mut sum = 0.0;
    let (mut largest, mut detections, mut between) = (0.0, (0, 1), (0, 1));
    for (a, first) in chains.iter().enumerate() {
        for (b, second) in chains.iter().enumerate().skip(a + 1) {
            for_both(first, second, |pair, p, q| {
                let difference = (p - q).abs();
                sum += difference;
                if difference > largest {
                    (largest, detections, between) = (difference, pair, (a, b));
                }
            });
        }
    }
    let (ess_a, ess_b) = (ess[between.0], ess[between.1]);
    let share = |chain: usize| probability(chains[chain], detections);
    let (p, q) = (share(between.0), share(between.1));
    let pooled = (p * ess_a + q * ess_b) / (ess_a + ess_b);
    Ok(CoClusteringDifference {
        largest,
        standard_error: (pooled * (1.0 - pooled) * (1.0 / ess_a + 1.0 / ess_b)).sqrt(),
        detections: (detections.0 as usize, detections.1 as usize),
        chains: between,
        mean: sum / (n_pairs * n_compared) as f64,
        n_pairs,
    })
}

/// The probability of one pair, 0 if it is not listed.
pub fn probability(pairs: &Pairs, (i, j): (u32, u32)) -> f64 {
    let place = pairs.binary_search_by_key(&(i.min(j), i.max(j)), |&(i, j, _)| (i, j));
    place.map_or(0.0, |place| f64::from(pairs[place].2))
}

/// Every pair that is in either list, in order, with its probability in both.
fn for_both(first: &Pairs, second: &Pairs, mut visit: impl FnMut((u32, u32), f64, f64)) {
    let (mut first, mut second) = (first.iter().peekable(), second.iter().peekable());
    let place = |pair: &(u32, u32, f32)| (pair.0, pair.1);
    loop {
        let pair = match (first.peek(), second.peek()) {
            (Some(p), Some(q)) => place(p).min(place(q)),
            (Some(one), None) | (None, Some(one)) => place(one),
            (None, None) => break,
        };
        let take = |list: &mut std::iter::Peekable<std::slice::Iter<'_, (u32, u32, f32)>>| {
            let found = list.next_if(|entry| place(entry) == pair);
            found.map_or(0.0, |entry| f64::from(entry.2))
        };
        let (p, q) = (take(&mut first), take(&mut second));
        visit(pair, p, q);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_between_chains() {
        let chains: [&Pairs; 3] = [
            &[(0, 1, 0.5), (0, 2, 0.25)],
            &[(0, 1, 0.5), (0, 2, 0.375)],
            &[(0, 1, 0.625), (0, 2, 0.75), (1, 2, 0.125)],
        ];
        let found = co_clustering_difference(&chains, 3, &[100.0, 50.0, 25.0]).expect("chains");
        assert_eq!(
            (found.detections, found.chains, found.n_pairs),
            ((0, 2), (0, 2), 3)
        );
        assert_eq!(found.largest, 0.5);
        // p̄ = (0.25 · 100 + 0.75 · 25)/125 = 0.35.
        let error = (0.35 * 0.65 * (1.0 / 100.0 + 1.0 / 25.0_f64)).sqrt();
        assert!((found.standard_error - error).abs() < 1e-15);
        // (0 + 1/8 + 0) + (1/8 + 1/2 + 1/8) + (1/8 + 3/8 + 1/8), over nine.
        assert!((found.mean - 1.5 / 9.0).abs() < 1e-15);
        let one = co_clustering_difference(&chains[..1], 3, &[1.0]);
        assert_eq!(one, Err(Undefined::TooFew { n: 1, fewest: 2 }));
        assert_eq!(probability(chains[2], (2, 1)), 0.125);
        // Chains that agree differ by nothing, at no pair in particular.
        let same =
            co_clustering_difference(&[chains[0], chains[0]], 3, &[9.0, 9.0]).expect("chains");
        assert_eq!(
            (same.largest, same.mean, same.detections),
            (0.0, 0.0, (0, 1))
        );
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
