//! Agreement of two topologies: the adjusted Rand index (Hubert & Arabie 1985).

use super::contingency::{Contingency, n_pairs};
use crate::partition::Topology;

/// ARI = (Σ C(n_ab, 2) − e) / (½(Σ C(n_a, 2) + Σ C(n_b, 2)) − e), e their product over C(n, 2): 1 for
/// equal topologies, 0 on average for independent ones of the same sizes. Two equal trivial
/// topologies, for which this is 0/0, agree: 1. `None` without detections.
pub fn adjusted_rand_index(a: &Topology, b: &Topology) -> Option<f64> {
    let n = a.labels().len();
    assert_eq!(n, b.labels().len(), "topologies of the same detections");
    if n == 0 {
        return None;
    }
    if a == b {
        return Some(1.0);
    }
    let table = Contingency::new(a, b);
    let pairs = |sizes: &[u64]| sizes.iter().map(|n| n_pairs(*n)).sum::<u64>() as f64;
    let together: u64 = table.joint.iter().map(|(_, _, n)| n_pairs(*n)).sum();
    let (together, in_a, in_b) = (together as f64, pairs(&table.of_a), pairs(&table.of_b));
    let expected = in_a * in_b / n_pairs(table.n) as f64;
    Some((together - expected) / ((in_a + in_b) / 2.0 - expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ari(a: &[u32], b: &[u32]) -> Option<f64> {
        adjusted_rand_index(&Topology::canonical(a), &Topology::canonical(b))
    }

    #[test]
    fn known_answers() {
        let value =
            ari(&[0, 0, 1, 1, 2, 2, 3, 3], &[0, 0, 1, 1, 1, 2, 3, 3]).expect("eight detections");
        assert!((value - 0.603_773_584_906).abs() < 1e-12, "{value}");
        assert_eq!(ari(&[0, 1, 2], &[5, 6, 7]), Some(1.0));
        assert_eq!(ari(&[0, 0, 0], &[1, 1, 1]), Some(1.0));
        assert_eq!(ari(&[0, 0, 0], &[0, 1, 2]), Some(0.0));
        assert_eq!(ari(&[], &[]), None);
    }
}
