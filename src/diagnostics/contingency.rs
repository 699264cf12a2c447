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
        let (sizes_a, sizes_b) = (sizes(a), sizes(b));
        // The labels in b, set after set of a: sets are small, so sorting each costs less than sorting all.
        let mut ends: Vec<usize> = Vec::with_capacity(sizes_a.len());
        for size in &sizes_a {
            ends.push(ends.last().copied().unwrap_or(0) + *size as usize);
        }
        let mut labels = vec![0; of_b.len()];
        let mut places = ends.clone();
        for (&in_a, &in_b) in of_a.iter().zip(of_b) {
            places[in_a as usize] -= 1;
            labels[places[in_a as usize]] = in_b;
        }
        let mut joint = Vec::with_capacity(sizes_a.len());
        let mut rest = &mut labels[..];
        for (in_a, size) in sizes_a.iter().enumerate() {
            let (set, others) = rest.split_at_mut(*size as usize);
            rest = others;
            set.sort_unstable();
            let same = set.chunk_by(|x, y| x == y);
            joint.extend(same.map(|same| (in_a as u32, same[0], same.len() as u64)));
        }
        Self {
            joint,
            of_a: sizes_a,
            of_b: sizes_b,
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
