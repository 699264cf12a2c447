//! Where two sets lie relative to each other when one has left the other: the difference of their
//! mean locations.
//!
//! In the metric model, under exp(−E) the means of two sets of k and m members differ by r ~ N(δ,
//! 1/(2a')) per axis, δ the difference of their mean positions and a' = a·k·m/(k+m), independently
//! of all else about them: of the deviations within each and of (k·x̄₁ + m·x̄₂)/(k+m). So r can be
//! drawn anew by moving the sets by m/(k+m) and −k/(k+m) of its change. In the covariance model the
//! Gaussian above exp(−E) has locations x_i ~ N(m_i, Σ_i) that are independent, so r ~ N(δ, V), V =
//! ΣΣ_i/k² + ΣΣ_j/m², and x_i − Σ_iV⁻¹r/k and x_j + Σ_jV⁻¹r/m are independent of r: a change of r
//! moves x_i by Σ_iV⁻¹/k of it, and x_j by −Σ_jV⁻¹/m. If |δ| ≤ D, r has the law
//!
//! q(r) = 0.3 N(r) + 0.35 ring with h ~ Exp(1) + 0.35 ring with h ~ Gamma(3)
//!
//! ([`ring`](super::ring)), so N/q ≤ 1/0.3; further apart the normal law alone.

use super::Penalty;
use super::location_law::{Normal, whitened};
use super::moments::square_distance;
use super::ring::{Leaving, Ring, ln_over_mixture};

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

/// How two sets lie apart under exp(−E) before it is tilted.
#[derive(Clone, Copy, Debug)]
pub struct Apart {
    /// The law N of r.
    pub normal: Normal,
    /// M of the distances that the penalty sees, about.
    pub whiten: [f64; 3],
    /// a' of M·r.
    pub precision: f64,
    /// k·m.
    pub n_pairs: usize,
    /// What of a change of r is each set's.
    pub shares: [f64; 2],
}

/// The law of the difference.
#[derive(Clone, Copy, Debug)]
pub struct Tilt {
    ring: Ring,
    /// N.
    pub normal: Normal,
    /// As in [`Apart`].
    pub shares: [f64; 2],
}

impl Tilt {
    /// Of two sets; `None` if they are too far apart for a ring.
    pub fn new(penalty: &Penalty, apart: &Apart) -> Option<Self> {
        let delta_m = apart.normal.mean_m;
        let seen = whitened(apart.whiten, [0.0; 2], delta_m);
        if square_distance(seen, [0.0; 2]) > penalty.radius_m * penalty.radius_m {
            return None;
        }
        let leaving = Leaving {
            centre_m: [0.0; 2],
            from_m: delta_m,
            whiten: apart.whiten,
            precision: apart.precision,
            n_pairs: apart.n_pairs,
        };
        Some(Self {
            ring: Ring::new(penalty, &leaving),
            normal: apart.normal,
            shares: apart.shares,
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
        let ln_normal = self.normal.ln_density(r);
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
        for (normal, whiten) in [
            ([1.0, 0.0, 1.0], [1.0, 0.0, 1.0]),
            ([1.3, -0.6, 0.9], [1.2, 0.5, 0.7]),
        ] {
            let apart = |x: f64| Apart {
                normal: Normal::new([x, 0.3], normal, 2.1),
                whiten,
                precision: 2.0,
                n_pairs: 2,
                shares: [1.0 / 3.0, -2.0 / 3.0],
            };
            let tilt = Tilt::new(&penalty, &apart(-0.7)).expect("near");
            let (side, mut total) = (0.01, 0.0);
            for p in -1500..1500 {
                for q in -1500..1500 {
                    let r = [f64::from(p) * side, f64::from(q) * side];
                    let ln_density = tilt.normal.ln_density(r) - tilt.ln_correction(r);
                    total += ln_density.exp() * side * side;
                }
            }
            assert!((total - 1.0).abs() < 2e-3, "{total}");
            assert!(Tilt::new(&penalty, &apart(9.0)).is_none());
        }
    }
}
