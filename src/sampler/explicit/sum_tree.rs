//! Weights of sets, from which a set is drawn, and changed, in time log N.
//!
//! A complete binary tree whose nodes hold the sum of their two children: unlike running sums it
//! does not drift, and the total is a function of the weights alone.

use serde::{Deserialize, Serialize};

/// The tree.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SumTree {
    /// The root is at 1, the children of node k at 2k and 2k + 1, the weights from `n_leaves` on.
    nodes: Vec<f64>,
    n_leaves: usize,
}

impl SumTree {
    /// All weights 0, for at most so many sets.
    pub(super) fn new(n: usize) -> Self {
        let n_leaves = n.next_power_of_two();
        Self {
            nodes: vec![0.0; 2 * n_leaves],
            n_leaves,
        }
    }

    /// The sum of all weights.
    pub(super) fn total(&self) -> f64 {
        self.nodes[1]
    }

    /// One weight.
    pub(super) fn get(&self, ix: usize) -> f64 {
        self.nodes[self.n_leaves + ix]
    }

    /// Changes a weight.
    pub(super) fn set(&mut self, ix: usize, weight: f64) {
        let mut node = self.n_leaves + ix;
        self.nodes[node] = weight;
        while node > 1 {
            node /= 2;
            self.nodes[node] = self.nodes[2 * node] + self.nodes[2 * node + 1];
        }
    }

    /// The index at which the weights before it and its own first reach `target`, in (0, total).
    pub(super) fn find(&self, mut target: f64) -> usize {
        let mut node = 1;
        while node < self.n_leaves {
            node *= 2;
            // Rounding may leave a target where there is no weight to the right.
            if target >= self.nodes[node] && self.nodes[node + 1] > 0.0 {
                target -= self.nodes[node];
                node += 1;
            }
        }
        node - self.n_leaves
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_by_weight() {
        for n in [1, 2, 5, 8] {
            let mut tree = SumTree::new(n);
            for ix in 0..n {
                tree.set(ix, if ix == 1 { 0.0 } else { (ix + 1) as f64 });
            }
            let total: f64 = (0..n).map(|ix| tree.get(ix)).sum();
            assert_eq!(tree.total(), total);
            let mut before = 0.0;
            for ix in 0..n {
                let weight = tree.get(ix);
                if weight > 0.0 {
                    assert_eq!(tree.find(before + 1e-9), ix);
                    assert_eq!(tree.find(before + weight - 1e-9), ix);
                }
                before += weight;
            }
            assert_eq!(tree.find(total), n - 1 - usize::from(n == 2));
        }
    }
}
