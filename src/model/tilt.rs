//! Where two sets lie relative to each other when one has left the other: the difference of their
//! mean locations.
//!
//! Under exp(−E) the means of two sets of k and m members differ by r ~ N(δ, 1/(2a')) per axis, δ
//! the difference of their mean positions and a' = a·k·m/(k+m), independently of all else about
//! them: of the deviations within each and of (k·x̄₁ + m·x̄₂)/(k+m). So r can be drawn anew by
//! moving the sets by m/(k+m) and −k/(k+m) of its change. If |δ| ≤ D it has the law
//!
//! q(r) = 0.3 N(r) + 0.35 ring with h ~ Exp(1) + 0.35 ring with h ~ Gamma(3)
//!
//! ([`ring`](super::ring)), so N/q ≤ 1/0.3; further apart the normal law alone.

use super::moments::{Moments, square_distance};
use super::ring::{Leaving, Ring, ln_over_mixture};
use super::{MetricModel, Penalty};

/// Share of the normal law.
pub const NORMAL: f64 = 0.3;
/// Share of each of the two rings.
const RING: f64 = 0.35;

/// From which part of the mixture a difference comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The normal law.
    Normal,
    /// The ring with the exponential radius.
    Exponential,
    /// The ring with the gamma radius.
    Gamma,
}

/// The law of the difference.
#[derive(Clone, Copy, Debug)]
pub struct Tilt {
    ring: Ring,
    difference_m: [f64; 2],
    precision: f64,
    ln_peak: f64,
    /// How much of a change of r each set moves.
    pub shares: [f64; 2],
}

impl Tilt {
    /// Of two sets with these mean positions; `None` if they are too far apart for a ring.
    pub fn new(model: &MetricModel, [first, second]: [&Moments; 2]) -> Option<Self> {
        let penalty: &Penalty = model.penalty();
        let difference_m = [0, 1].map(|axis| first.mean_m[axis] - second.mean_m[axis]);
        if square_distance(difference_m, [0.0; 2]) > penalty.radius_m * penalty.radius_m {
            return None;
        }
        let (k, m) = (first.n as f64, second.n as f64);
        let precision = model.precisions().0 * (k * m / (k + m));
        let leaving = Leaving {
            centre_m: [0.0; 2],
            from_m: difference_m,
            precision,
            n_pairs: first.n * second.n,
        };
        Some(Self {
            ring: Ring::new(penalty, &leaving),
            difference_m,
            precision,
            ln_peak: libm::log(precision / std::f64::consts::PI),
            shares: [m / (k + m), -k / (k + m)],
        })
    }

    /// The part of the mixture for u uniform on (0, 1).
    pub fn part(u: f64) -> Part {
        if u < NORMAL {
            Part::Normal
        } else if u < NORMAL + RING {
            Part::Exponential
        } else {
            Part::Gamma
        }
    }

    /// The difference for a direction u, uniform on the unit circle, and h > 0.
    pub fn place(&self, u: [f64; 2], h: f64) -> [f64; 2] {
        self.ring.place(u, h)
    }

    /// ln N(r)/q(r) ≤ −ln 0.3.
    pub fn ln_correction(&self, r: [f64; 2]) -> f64 {
        let Some(beyond) = self.ring.beyond(r) else {
            return -libm::log(NORMAL);
        };
        let ln_normal = self.ln_peak - self.precision * square_distance(r, self.difference_m);
        let radial = libm::log(RING + 0.5 * RING * beyond.h * beyond.h) - beyond.h;
        ln_over_mixture(NORMAL, beyond.ln_density + radial - ln_normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::PenaltyShape;

    /// q integrates to 1: the mean of q/N under N is 1, so that of the mixture's parts is.
    #[test]
    fn the_mixture_is_a_density() {
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.5,
            height: 3.0,
        };
        let z = [[0.0, 0.0], [0.3, 0.1], [0.9, 0.4]];
        let model = MetricModel::new(&z, 0.8, 0.9, penalty);
        let z = model.positions_m();
        let [first, second] = [&z[..2], &z[2..]].map(|set| Moments::of(set.iter().copied()));
        let tilt = Tilt::new(&model, [&first, &second]).expect("near");
        let (side, mut total) = (0.01, 0.0);
        for p in -1500..1500 {
            for q in -1500..1500 {
                let r = [f64::from(p) * side, f64::from(q) * side];
                let e2 = square_distance(r, tilt.difference_m);
                let ln_normal = tilt.ln_peak - tilt.precision * e2;
                total += (ln_normal - tilt.ln_correction(r)).exp() * side * side;
            }
        }
        assert!((total - 1.0).abs() < 2e-3, "{total}");
        assert!((tilt.shares[0] - tilt.shares[1] - 1.0).abs() < 1e-15);
        let far = Moments::of([[9.0, 9.0]].into_iter());
        assert!(Tilt::new(&model, [&first, &far]).is_none());
    }
}
