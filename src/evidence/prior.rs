//! How probable a topology is before anything but times is looked at.
//!
//! The number of landmarks M has p(M) ∝ 1/M, up to N; every landmark is seen with a weight of its own, and those weights are uniform on the
//! simplex (a Dirichlet of parameter 1), so that a set of n comes with n! (mixtures of finite mixtures: Miller & Harrison,
//! JASA 113, 2018; unlike a Chinese restaurant, they do not add landmarks as detections go on). But two things seen
//! at once are two landmarks: where the intervals of two members overlap, P(T) has a factor 1/100, as a
//! tracker may see double. So of v_i earlier detections that are in view with detection i, about a share v_i/M of
//! the landmarks is not to be had, and P(T|M) has to be normalised for it, or few landmarks would pay more than
//! many: P(T|M) = M!/(M−t)! · Γ(M)/Γ(M+N) · Π_S n_S! · Π_i 1/(1 − 0.99·v_i/M) · 100^{−overlaps}, t = |T|. The product
//! over i is exact for equal weights and one overlap each, and about right otherwise. Without times v_i = 0.

use crate::detections::{Detection, Detections};

/// What an overlap of two members costs: a factor.
const OVERLAP: f64 = 0.01;
/// Its logarithm.
const LN_OVERLAP: f64 = -4.605_170_185_988_091;

/// P(T) = V(|T|) · Π_S n_S! · 100^{−overlaps}.
#[derive(Clone, Debug)]
pub(super) struct Prior {
    n: usize,
    /// N×N, row by row.
    overlaps: Vec<bool>,
    /// ln of V(t + 1)/V(t), t from 0.
    ln_new: Vec<f64>,
}

impl Prior {
    /// Of detections, by when they were seen.
    pub(super) fn new(detections: &Detections) -> Self {
        let n = detections.len();
        let interval = |row: &Detection| Some((row.first_seen_s?, row.last_seen_s?));
        let intervals: Vec<_> = detections.iter().map(interval).collect();
        let mut overlaps = vec![false; n * n];
        for i in 0..n {
            for j in 0..n {
                if let (Some(a), Some(b)) = (intervals[i], intervals[j]) {
                    overlaps[i * n + j] = i != j && a.0 <= b.1 && b.0 <= a.1;
                }
            }
        }
        let in_view: Vec<usize> = (0..n)
            .map(|i| (0..i).filter(|j| overlaps[i * n + j]).count())
            .collect();
        Self {
            n,
            overlaps,
            ln_new: ln_new(&in_view),
        }
    }

    /// Whether two detections were in view at once.
    pub(super) fn overlap(&self, i: usize, j: usize) -> bool {
        self.overlaps[i * self.n + j]
    }

    /// ln of V(t + 1)/V(t).
    pub(super) fn ln_new(&self, n_sets: usize) -> f64 {
        self.ln_new[n_sets]
    }

    /// ln of n! and of what the set's overlaps cost, members in rising order.
    pub(super) fn ln_of_set(&self, members: &[usize]) -> f64 {
        let of = |k: usize| {
            let overlaps = |&&j: &&usize| self.overlap(members[k], j);
            let n_overlaps = members[..k].iter().filter(overlaps).count();
            libm::log((k + 1) as f64) + LN_OVERLAP * n_overlaps as f64
        };
        (1..members.len()).map(of).sum()
    }
}

/// ln of V(t + 1)/V(t), t from 0 to N − 1, given how many earlier detections are in view with each.
pub(super) fn ln_new(in_view: &[usize]) -> Vec<f64> {
    let n = in_view.len();
    let ln_of_landmarks = |m: usize| {
        let landmarks = m as f64;
        // More in view than there are landmarks takes seeing double: the factor of one overlap.
        let free = |&v: &usize| (1.0 - (1.0 - OVERLAP) * v as f64 / landmarks).max(OVERLAP);
        let in_view: f64 = in_view.iter().map(|v| libm::log(free(v))).sum();
        // M!·Γ(M)/Γ(M+N)/M
        libm::lgamma(landmarks + 1.0) + libm::lgamma(landmarks)
            - libm::lgamma(landmarks + n as f64)
            - libm::log(landmarks)
            - in_view
    };
    let ln_of_landmarks: Vec<f64> = (1..=n).map(ln_of_landmarks).collect();
    let ln_v = |t: usize| {
        let terms =
            (t.max(1)..=n).map(|m| ln_of_landmarks[m - 1] - libm::lgamma((m - t + 1) as f64));
        let terms: Vec<f64> = terms.collect();
        let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest + libm::log(terms.iter().map(|v| libm::exp(v - largest)).sum())
    };
    let ln_v: Vec<f64> = (0..=n).map(ln_v).collect();
    ln_v.windows(2).map(|pair| pair[1] - pair[0]).collect()
}
