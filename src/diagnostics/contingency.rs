//! How two topologies of the same detections overlap: what every measure of agreement is made of.

use crate::partition::Topology;

/// The sizes of the sets of two topologies and of their intersections.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contingency {
    /// Non-empty intersections: set of the first, set of the second, number of detections.
    pub joint: Vec<(u32, u32, u64)>,
    /// Sizes of the sets of the first.
    pub of_a: Vec<u64>,
    /// Sizes of the sets of the second.
    pub of_b: Vec<u64>,
    /// Number of detections.
    pub n: u64,
}

impl Contingency {
    /// Of two topologies; intersections in the order of their labels, so that sums have one order.
    ///
    /// # Panics
    /// If they are of different numbers of detections.
    pub fn new(a: &Topology, b: &Topology) -> Self {
        let (of_a, of_b) = (a.labels(), b.labels());
        assert_eq!(of_a.len(), of_b.len(), "topologies of the same detections");
        let mut pairs: Vec<(u32, u32)> = of_a.iter().copied().zip(of_b.iter().copied()).collect();
        pairs.sort_unstable();
        let joint = pairs.chunk_by(|x, y| x == y);
        Self {
            joint: joint
                .map(|same| (same[0].0, same[0].1, same.len() as u64))
                .collect(),
            of_a: sizes(a),
            of_b: sizes(b),
            n: of_a.len() as u64,
        }
    }
}

fn sizes(topology: &Topology) -> Vec<u64> {
    let mut sizes = vec![0; topology.n_sets()];
    for &label in topology.labels() {
        sizes[label as usize] += 1;
    }
    sizes
}

/// Number of unordered pairs among n.
pub fn n_pairs(n: u64) -> u64 {
    n * n.saturating_sub(1) / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlaps() {
        let (a, b) = (
            Topology::canonical(&[0, 0, 1, 1]),
            Topology::canonical(&[0, 1, 1, 1]),
        );
        let table = Contingency::new(&a, &b);
        assert_eq!(table.joint, [(0, 0, 1), (0, 1, 1), (1, 1, 2)]);
        assert_eq!(
            (table.of_a, table.of_b, table.n),
            (vec![2, 2], vec![1, 3], 4)
        );
        assert_eq!([0, 1, 5].map(n_pairs), [0, 0, 10]);
    }
}
