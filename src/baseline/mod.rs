//! Plain clusterings of the same detections, so that a user sees what the posterior buys.
//!
//! None of them looks at a model or says how sure it is. Some look at the truth, to have the best
//! parameter that they could have been given: these are bounds and no methods, and are named so.
//!
//! - DBSCAN (Ester et al. 1996; crate `dbscan`) with one point to a core, so that ε is its only
//!   parameter and no detection is noise.
//! - Nearest-neighbour gating: detections come in the order of the mission; each joins the nearest
//!   landmark so far if it passes the gate, and moves it to the weighted mean; else it is a landmark
//!   of its own. (z−m)ᵀ(C_z + C_m)⁻¹(z−m) ≤ −2·ln(1−p), the p-quantile of chi-square with 2 degrees of
//!   freedom (Bar-Shalom & Fortmann 1988); without covariances |z−m| ≤ ε.
//! - Ward's linkage (1963; crate `kodama`) cut at a given number of sets.
//! - The nearest of given places.

use crate::detections::{Covariance, Detections};
use crate::partition::Topology;

/// DBSCAN with at least one point to a core: what is nearer than ε, m, is of one set.
pub fn dbscan(positions_m: &[[f64; 2]], epsilon_m: f64) -> Topology {
    let points: Vec<Vec<f64>> = positions_m.iter().map(|z| z.to_vec()).collect();
    let found = dbscan::cluster(epsilon_m, 1, &points);
    let label = |(i, class): (usize, dbscan::Classification)| match class {
        dbscan::Classification::Core(set) | dbscan::Classification::Edge(set) => (true, set),
        dbscan::Classification::Noise => (false, i),
    };
    Topology::canonical(&found.into_iter().enumerate().map(label).collect::<Vec<_>>())
}

/// Nearest-neighbour gating with stated covariances at the gate's probability p; `None` without them.
pub fn gate(detections: &Detections, probability: f64) -> Option<Topology> {
    let covariances = detections.covariances_m2()?;
    let most = -2.0 * libm::log1p(-probability);
    let squared = |z: [f64; 2], c: Covariance, landmark: &Landmark| {
        let sum = Covariance {
            xx: c.xx + landmark.covariance_m2.xx,
            xy: c.xy + landmark.covariance_m2.xy,
            yy: c.yy + landmark.covariance_m2.yy,
        };
        squared_distance(z, landmark.place_m, sum)
    };
    Some(gated(
        &detections.positions_m(),
        &covariances,
        most,
        squared,
    ))
}

/// The same with one distance for all, m: each landmark is the mean of its detections.
pub fn gate_by_distance(positions_m: &[[f64; 2]], epsilon_m: f64) -> Topology {
    let same = Covariance {
        xx: 1.0,
        xy: 0.0,
        yy: 1.0,
    };
    let squared = |z: [f64; 2], _, landmark: &Landmark| squared_distance(z, landmark.place_m, same);
    let covariances = vec![same; positions_m.len()];
    gated(positions_m, &covariances, epsilon_m * epsilon_m, squared)
}

struct Landmark {
    place_m: [f64; 2],
    covariance_m2: Covariance,
}

fn gated(
    positions_m: &[[f64; 2]],
    covariances_m2: &[Covariance],
    most: f64,
    squared: impl Fn([f64; 2], Covariance, &Landmark) -> f64,
) -> Topology {
    let mut landmarks: Vec<Landmark> = Vec::new();
    let mut labels = Vec::new();
    for (&place_m, &covariance_m2) in positions_m.iter().zip(covariances_m2) {
        let distances = landmarks.iter().map(|l| squared(place_m, covariance_m2, l));
        let nearest = distances
            .enumerate()
            .min_by(|(_, a), (_, b)| a.total_cmp(b));
        match nearest.filter(|(_, distance)| *distance <= most) {
            Some((ix, _)) => {
                landmarks[ix].take(place_m, covariance_m2);
                labels.push(ix);
            }
            None => {
                labels.push(landmarks.len());
                landmarks.push(Landmark {
                    place_m,
                    covariance_m2,
                });
            }
        }
    }
    Topology::canonical(&labels)
}

impl Landmark {
    /// The product of two Gaussians: K = C_m(C_m + C_z)⁻¹, m + K(z − m), (I − K)C_m.
    fn take(&mut self, z: [f64; 2], c: Covariance) {
        let p = self.covariance_m2;
        let s = Covariance {
            xx: p.xx + c.xx,
            xy: p.xy + c.xy,
            yy: p.yy + c.yy,
        };
        let det = s.determinant();
        let k = [
            [
                (p.xx * s.yy - p.xy * s.xy) / det,
                (p.xy * s.xx - p.xx * s.xy) / det,
            ],
            [
                (p.xy * s.yy - p.yy * s.xy) / det,
                (p.yy * s.xx - p.xy * s.xy) / det,
            ],
        ];
        let d = [z[0] - self.place_m[0], z[1] - self.place_m[1]];
        for (place, row) in self.place_m.iter_mut().zip(k) {
            *place += row[0] * d[0] + row[1] * d[1];
        }
        self.covariance_m2 = Covariance {
            xx: p.xx - k[0][0] * p.xx - k[0][1] * p.xy,
            xy: p.xy - k[0][0] * p.xy - k[0][1] * p.yy,
            yy: p.yy - k[1][0] * p.xy - k[1][1] * p.yy,
        };
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2], c: Covariance) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    (c.yy * x * x - 2.0 * c.xy * x * y + c.xx * y * y) / c.determinant()
}

/// Ward's linkage cut at `n_sets` sets, 1 ≤ n_sets ≤ N.
pub fn ward(positions_m: &[[f64; 2]], n_sets: usize) -> Topology {
    let n = positions_m.len();
    let mut condensed = Vec::with_capacity(n * n.saturating_sub(1) / 2);
    for (i, a) in positions_m.iter().enumerate() {
        for b in &positions_m[i + 1..] {
            condensed.push(libm::hypot(a[0] - b[0], a[1] - b[1]));
        }
    }
    // Step k makes cluster N + k of two earlier ones.
    let mut sets: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
    if n > 1 {
        let tree = kodama::linkage(&mut condensed, n, kodama::Method::Ward);
        for step in tree.steps().iter().take(n.saturating_sub(n_sets)) {
            let mut both = std::mem::take(&mut sets[step.cluster1]);
            both.append(&mut std::mem::take(&mut sets[step.cluster2]));
            sets.push(both);
        }
    }
    let mut labels = vec![0; n];
    for (label, members) in sets.iter().enumerate() {
        for &i in members {
            labels[i] = label;
        }
    }
    Topology::canonical(&labels)
}

/// Each detection to the nearest of some places, m; at least one.
pub fn nearest_place(positions_m: &[[f64; 2]], places_m: &[[f64; 2]]) -> Topology {
    let squared = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let nearest = |&z: &[f64; 2]| {
        let distances = places_m.iter().map(|&place| squared(z, place));
        distances
            .enumerate()
            .min_by(|(_, a), (_, b)| a.total_cmp(b))
            .map(|(ix, _)| ix)
    };
    Topology::canonical(&positions_m.iter().map(nearest).collect::<Vec<_>>())
}

/// Distances at which a clustering by distance can change: those of all pairs, m, each once.
pub fn pair_distances_m(positions_m: &[[f64; 2]]) -> Vec<f64> {
    let mut found = Vec::new();
    for (i, a) in positions_m.iter().enumerate() {
        for b in &positions_m[i + 1..] {
            found.push(libm::hypot(a[0] - b[0], a[1] - b[1]));
        }
    }
    found.sort_unstable_by(f64::total_cmp);
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::Detection;

    /// A chain of three, a metre apart, and a pair 10 m away.
    const Z: [[f64; 2]; 5] = [[0.0, 0.0], [10.0, 0.0], [1.0, 0.0], [10.0, 0.5], [2.0, 0.0]];

    #[test]
    fn dbscan_follows_chains_and_gating_follows_means() {
        let all = Topology::canonical(&[0, 1, 0, 1, 0]);
        assert_eq!(dbscan(&Z, 1.01), all);
        assert_eq!(dbscan(&Z, 0.6), Topology::canonical(&[0, 1, 2, 1, 3]));
        assert_eq!(dbscan(&Z, 0.1).n_sets(), 5);
        // The third of the chain is 1.5 m from the mean of the first two.
        assert_eq!(gate_by_distance(&Z, 1.5), all);
        let apart = gate_by_distance(&Z, 1.4);
        assert_eq!(apart, Topology::canonical(&[0, 1, 0, 1, 2]));
    }

    #[test]
    fn gates_are_as_wide_as_covariances_say() {
        let c = |xx: f64, xy: f64, yy: f64| Some(Covariance { xx, xy, yy });
        let at = |x: f64, y: f64, covariance_m2| Detection {
            covariance_m2,
            ..Detection::at(x, y)
        };
        // Chi-square with 2 degrees of freedom: 99 % below 9.21. Along x 3²/(0.5 + 0.5) = 9 passes;
        // across, 2²/(0.2 + 0.2) = 10 does not.
        let rows = vec![
            at(0.0, 0.0, c(0.5, 0.0, 0.2)),
            at(3.0, 0.0, c(0.5, 0.0, 0.2)),
            at(1.5, 2.0, c(0.5, 0.0, 0.2)),
        ];
        let detections = Detections::new(rows).expect("good");
        let found = gate(&detections, 0.99).expect("covariances");
        assert_eq!(found, Topology::canonical(&[0, 0, 1]));
        assert_eq!(gate(&detections, 0.98).map(|t| t.n_sets()), Some(3));
        let bare = Detections::new(vec![Detection::at(0.0, 0.0)]).expect("good");
        assert_eq!(gate(&bare, 0.99), None);
        // Information adds up: (I/1 + diag(3, 1))⁻¹, and the mean lies nearer to the surer.
        let mut landmark = Landmark {
            place_m: [0.0, 0.0],
            covariance_m2: Covariance {
                xx: 2.0,
                xy: 1.0,
                yy: 2.0,
            },
        };
        landmark.take(
            [3.0, 0.0],
            Covariance {
                xx: 1.0,
                xy: 0.0,
                yy: 0.5,
            },
        );
        // C_m⁻¹ = [[2, −1], [−1, 2]]/3, C_z⁻¹ = diag(1, 2): the sum is [[5, −1], [−1, 8]]/3 with the
        // inverse 3/39·[[8, 1], [1, 5]]; the mean is that times (3, 0).
        let p = landmark.covariance_m2;
        let expected = [24.0 / 39.0, 3.0 / 39.0, 15.0 / 39.0];
        for (got, expected) in [p.xx, p.xy, p.yy].into_iter().zip(expected) {
            assert!((got - expected).abs() < 1e-12, "{p:?}");
        }
        let [x, y] = landmark.place_m;
        assert!((x - 72.0 / 39.0).abs() < 1e-12 && (y - 9.0 / 39.0).abs() < 1e-12);
    }

    #[test]
    fn ward_cuts_where_it_is_told() {
        assert_eq!(ward(&Z, 2), Topology::canonical(&[0, 1, 0, 1, 0]));
        assert_eq!(ward(&Z, 1).n_sets(), 1);
        assert_eq!(ward(&Z, 5).n_sets(), 5);
        // The pair half a metre apart is the first to be joined.
        assert_eq!(ward(&Z, 4), Topology::canonical(&[0, 1, 2, 1, 3]));
        assert_eq!(ward(&Z[..1], 1).n_sets(), 1);
    }

    #[test]
    fn every_detection_goes_to_the_nearest_place() {
        let places = [[9.0, 0.0], [0.4, 0.0]];
        assert_eq!(
            nearest_place(&Z, &places),
            Topology::canonical(&[0, 1, 0, 1, 0])
        );
        assert_eq!(pair_distances_m(&Z[..3]), [1.0, 9.0, 10.0]);
    }
}
