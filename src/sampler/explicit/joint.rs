//! The law of all locations of one set, without the penalty.
//!
//! exp(−E_S(X)) = B·γ(X)·e^{h(X)}. In the metric model B = I₀, γ = N(X\*, Σ)
//! ([`metric`](crate::model::metric)) and h = 0. In the covariance model E_S has one term for each
//! location, so γ is a normal law for each ([`joining`](crate::model::joining)), and h ≤ 0 the sum
//! of what the cones lie above their tangents.

use super::laws::{Law, Laws};
use crate::model::location_law::{Cone, LocationLaw, Normal, whitening};
use crate::model::moments::Moments;
use crate::model::tilt::{Apart, Tilt};
use crate::sampler::choices::Random;

/// The law; working space that is used again.
#[derive(Default)]
pub(super) struct Joint {
    /// Of the members' z.
    pub(super) z: Moments,
    /// ln B.
    pub(super) ln_bound: f64,
    /// A law for each member; none in the metric model.
    laws: Vec<LocationLaw>,
    cones: Vec<Cone>,
}

impl Joint {
    /// That of a set.
    pub(super) fn fill(&mut self, laws: &Laws, members: &[u32]) {
        self.z = Moments::of(members.iter().map(|&i| laws.z_m(i)));
        self.laws.clear();
        self.cones.clear();
        match &laws.law {
            Law::Metric(metric) => {
                self.ln_bound = if self.z.n > 1 {
                    metric.model.ln_gaussian_of(self.z.n, self.z.scatter_m2)
                } else {
                    0.0
                };
            }
            Law::Covariance(covariance) => {
                self.ln_bound = 0.0;
                for &i in members {
                    let others = members.iter().copied().filter(|&j| j != i);
                    let law = covariance.model.joining(i, others, &mut self.cones);
                    self.ln_bound += law.ln_bound;
                    self.laws.push(law);
                }
            }
        }
    }

    /// How many members depend on each other: all, or each on none (covariance model).
    pub(super) fn n_tied(&self) -> usize {
        if self.laws.is_empty() { self.z.n } else { 1 }
    }

    /// Draws all locations from γ, at the end of `to_m`.
    pub(super) fn draw(
        &self,
        laws: &Laws,
        members: &[u32],
        random: &mut impl Random,
        to_m: &mut Vec<[f64; 2]>,
    ) {
        let Law::Metric(metric) = &laws.law else {
            to_m.extend(self.laws.iter().map(|law| law.place(random.normals())));
            return;
        };
        let start = to_m.len();
        let mut mean = [0.0; 2];
        for _ in members {
            let e = random.normals();
            mean[0] += e[0];
            mean[1] += e[1];
            to_m.push(e);
        }
        let mean = mean.map(|sum| sum / members.len() as f64);
        let scales = metric.model.shrinkage(members.len());
        for (&i, at) in members.iter().zip(&mut to_m[start..]) {
            let (z_m, centre_m) = (laws.z_m(i), self.z.mean_m);
            for axis in [0, 1] {
                let optimum = centre_m[axis] + scales.deviation * (z_m[axis] - centre_m[axis]);
                let within = scales.within_m * (at[axis] - mean[axis]);
                at[axis] = optimum + within + scales.mean_m * mean[axis];
            }
        }
    }

    /// The means of γ, at the end of `to_m`.
    pub(super) fn means(&self, laws: &Laws, members: &[u32], to_m: &mut Vec<[f64; 2]>) {
        let Law::Metric(metric) = &laws.law else {
            to_m.extend(self.laws.iter().map(|law| law.mean_m));
            return;
        };
        let shrinkage = metric.model.shrinkage(members.len()).deviation;
        let mean_m = self.z.mean_m;
        to_m.extend(members.iter().map(|&i| {
            let z_m = laws.z_m(i);
            [0, 1].map(|axis| mean_m[axis] + shrinkage * (z_m[axis] - mean_m[axis]))
        }));
    }

    /// h of the location of the k-th member.
    #[inline]
    pub(super) fn ln_excess(&self, k: usize, x_m: [f64; 2]) -> f64 {
        match self.laws.get(k) {
            Some(law) => law.ln_excess(&self.cones, x_m),
            None => 0.0,
        }
    }

    /// The locations once the difference of the means of two sets, of which this is one, has
    /// changed; `share` is the set's of [`Tilt::shares`].
    pub(super) fn shift(&self, tilt: &Tilt, share: f64, change_m: [f64; 2], x_m: &mut [[f64; 2]]) {
        if self.laws.is_empty() {
            for x_m in x_m {
                for axis in [0, 1] {
                    x_m[axis] += share * change_m[axis];
                }
            }
            return;
        }
        let pulled = tilt.normal.pull(change_m);
        for (law, x_m) in self.laws.iter().zip(x_m) {
            // Σ = L Lᵀ.
            let l = law.factor_m;
            let along = [l[0] * pulled[0] + l[1] * pulled[1], l[2] * pulled[1]];
            x_m[0] += share * (l[0] * along[0]);
            x_m[1] += share * (l[1] * along[0] + l[2] * along[1]);
        }
    }

    /// How two sets lie apart.
    pub(super) fn apart(laws: &Laws, [first, second]: [&Self; 2], members: [&[u32]; 2]) -> Apart {
        let [k, m] = members.map(|members| members.len() as f64);
        let n_pairs = members[0].len() * members[1].len();
        if let Law::Metric(metric) = &laws.law {
            let difference_m = [0, 1].map(|axis| first.z.mean_m[axis] - second.z.mean_m[axis]);
            let precision = metric.model.precisions().0 * (k * m / (k + m));
            let whiten = [1.0, 0.0, 1.0];
            return Apart {
                normal: Normal::new(difference_m, whiten, precision),
                whiten,
                precision,
                n_pairs,
                shares: [m / (k + m), -k / (k + m)],
            };
        }
        let (mut difference_m, mut spread) = ([0.0; 2], [0.0; 3]);
        for (set, n, sign) in [(first, k, 1.0), (second, m, -1.0)] {
            for law in &set.laws {
                let l = law.factor_m;
                for axis in [0, 1] {
                    difference_m[axis] += sign * law.mean_m[axis] / n;
                }
                let covariance = [l[0] * l[0], l[0] * l[1], l[1] * l[1] + l[2] * l[2]];
                for (sum, value) in spread.iter_mut().zip(covariance) {
                    *sum += value / (n * n);
                }
            }
        }
        // |Mr|² = rᵀV⁻¹r/2.
        let doubled = spread.map(|value| 2.0 * value);
        let scale = laws.whitening_between(members[0], members[1]);
        Apart {
            normal: Normal::new(difference_m, whitening(doubled), 1.0),
            whiten: scale,
            precision: precision_seen(scale, doubled),
            n_pairs,
            shares: [1.0 / k, -1.0 / m],
        }
    }
}

/// a of a normal law with the covariance `doubled`/2 where M whitens distances: that of the round
/// law with the same trace.
pub(super) fn precision_seen(m: [f64; 3], [xx, xy, yy]: [f64; 3]) -> f64 {
    let trace = m[0] * (m[0] * xx + 2.0 * m[1] * xy) + (m[1] * m[1] + m[2] * m[2]) * yy;
    2.0 / trace
}
