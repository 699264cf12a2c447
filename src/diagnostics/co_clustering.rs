//! The co-clustering matrix: the probability that two detections are of one landmark.

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

#[cfg(test)]
mod tests {
    use super::*;
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
