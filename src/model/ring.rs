//! Where a location lies that has left a set: outside the radius of the penalty, about the set's
//! centre.
//!
//! A detection at z that leaves a set of n members at c, |z − c| = d < D, seldom gets out of the
//! penalty by a draw from N(z, 1/(2a)). The ring draws it there: x = c + r·(cos φ, sin φ),
//!
//! - r = r₀ + h/λ with r₀ = D√(1 − min(1, 2/(n·H))), where the n pairs still cost 2 nats (quadratic
//!   penalty), and λ = 2a(r₀ − d)₊ + 1.5√a, about the slope of exp(−a|x−z|²) there; h ~ Exp(1) in
//!   the simplest case;
//! - φ wrapped Cauchy about the direction of z − c, ρ = exp(−0.8/√(2a·r₀·d + 0.16)).
//!
//! With u uniform on the unit circle, (u + ρ)/(1 + ρu) is wrapped Cauchy (complex numbers;
//! McCullagh 1996), so no trigonometric function is needed. The density of x is λ·p(h)/r ·
//! (1−ρ²)/(1+ρ²−2ρ cos φ)/(2π).
//!
//! The same ring serves the difference of the means of two sets of k and m members: a becomes
//! a·k·m/(k+m), c is 0, z is the difference of the sets' mean positions and n the number of pairs
//! k·m.
//!
//! All of that is in coordinates y = M(x − c) in which the penalty is round: M = I in the metric
//! model. The density of x is that of y times det M.

use super::Penalty;
use super::location_law::whitened;

/// Spread of the angle: found by trial with the reference program of this sampler.
const ANGLE: f64 = 0.8;
const LEAST_ANGLE: f64 = 0.16;
/// Least rate of the radial law, in units of √a.
const LEAST_RATE: f64 = 1.5;
/// Nats that all pairs together cost at r₀.
const COST_AT_INNER: f64 = 2.0;

/// What a ring lies around, and what leaves.
#[derive(Clone, Copy, Debug)]
pub struct Leaving {
    /// c, m.
    pub centre_m: [f64; 2],
    /// z, m, within the radius of c.
    pub from_m: [f64; 2],
    /// M, an upper triangle; distances |M(x − y)| are those that the penalty sees.
    pub whiten: [f64; 3],
    /// a of M(x − z): m⁻², without unit in the covariance model.
    pub precision: f64,
    /// n, the number of pairs that the penalty falls on.
    pub n_pairs: usize,
}

/// The ring.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    centre_m: [f64; 2],
    whiten: [f64; 3],
    /// M⁻¹, an upper triangle.
    unwhiten: [f64; 3],
    ln_determinant: f64,
    towards: [f64; 2],
    inner_m: f64,
    rate: f64,
    ln_rate: f64,
    concentration: f64,
}

/// A point outside r₀, as the radial law sees it.
#[derive(Clone, Copy, Debug)]
pub struct Beyond {
    /// h = λ(r − r₀) > 0.
    pub h: f64,
    /// ln of the density of x without that of h.
    pub ln_density: f64,
}

impl Ring {
    /// Round the set that a detection, or a set, leaves.
    pub fn new(penalty: &Penalty, leaving: &Leaving) -> Self {
        let Leaving {
            centre_m,
            from_m,
            whiten: m,
            precision: a,
            n_pairs,
        } = *leaving;
        let [dx, dy] = whitened(m, centre_m, from_m);
        let d = (dx * dx + dy * dy).sqrt();
        let towards = if d > 0.0 {
            [dx / d, dy / d]
        } else {
            [1.0, 0.0]
        };
        // Without any height the quotient is infinite and r₀ is 0.
        let lost = (COST_AT_INNER / (n_pairs as f64 * penalty.height)).min(1.0);
        let inner_m = penalty.radius_m * (1.0 - lost).sqrt();
        let rate = 2.0 * a * (inner_m - d).max(0.0) + LEAST_RATE * a.sqrt();
        let narrow = (2.0 * a * inner_m * d + LEAST_ANGLE).sqrt();
        Self {
            centre_m,
            whiten: m,
            unwhiten: [1.0 / m[0], -m[1] / (m[0] * m[2]), 1.0 / m[2]],
            ln_determinant: libm::log(m[0] * m[2]),
            towards,
            inner_m,
            rate,
            ln_rate: libm::log(rate),
            concentration: libm::exp(-ANGLE / narrow),
        }
    }

    /// The point for a direction u, uniform on the unit circle, and h > 0.
    pub fn place(&self, u: [f64; 2], h: f64) -> [f64; 2] {
        let rho = self.concentration;
        // (u + ρ)/(1 + ρu) = (u + ρ)(1 + ρū)/|1 + ρu|².
        let [re, im] = [u[0] + rho, u[1]];
        let [conj_re, conj_im] = [1.0 + rho * u[0], -rho * u[1]];
        let norm = conj_re * conj_re + conj_im * conj_im;
        let cos = (re * conj_re - im * conj_im) / norm;
        let sin = (re * conj_im + im * conj_re) / norm;
        let [tx, ty] = self.towards;
        let r = self.inner_m + h / self.rate;
        let y = [r * (cos * tx - sin * ty), r * (cos * ty + sin * tx)];
        let x = whitened(self.unwhiten, [0.0; 2], y);
        [self.centre_m[0] + x[0], self.centre_m[1] + x[1]]
    }

    /// The point x as the radial law sees it; `None` inside r₀, where the density is 0.
    pub fn beyond(&self, x_m: [f64; 2]) -> Option<Beyond> {
        let [dx, dy] = whitened(self.whiten, self.centre_m, x_m);
        let r = (dx * dx + dy * dy).sqrt();
        if r <= self.inner_m {
            return None;
        }
        let cos = (dx * self.towards[0] + dy * self.towards[1]) / r;
        let rho = self.concentration;
        let spread = (1.0 + rho * rho) - 2.0 * rho * cos;
        let angular = (1.0 - rho * rho) / (spread * r * std::f64::consts::TAU);
        Some(Beyond {
            h: self.rate * (r - self.inner_m),
            ln_density: self.ln_rate + libm::log(angular) + self.ln_determinant,
        })
    }
}

/// −ln(s + e^t): how far a mixture with the share s of a law lies below it, where t is ln of the
/// rest over that law.
pub fn ln_over_mixture(share: f64, ln_rest: f64) -> f64 {
    // Beyond this e^t is all there is, and may overflow.
    const LARGE: f64 = 600.0;
    if ln_rest > LARGE {
        -ln_rest
    } else {
        -libm::log(share + libm::exp(ln_rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::PenaltyShape;

    fn ring(height: f64, from_m: [f64; 2], whiten: [f64; 3]) -> Ring {
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.5,
            height,
        };
        let leaving = Leaving {
            centre_m: [0.3, -0.2],
            from_m,
            whiten,
            precision: 2.0,
            n_pairs: 3,
        };
        Ring::new(&penalty, &leaving)
    }

    /// The density integrates to 1 over the plane, and draws fall where it says.
    #[test]
    fn the_density_is_that_of_the_draws() {
        const PLAIN: [f64; 3] = [1.0, 0.0, 1.0];
        for (height, from_m, m) in [
            (5.0, [0.8, 0.1], PLAIN),
            (0.0, [0.3, 0.6], PLAIN),
            (2.0, [0.3, -0.2], PLAIN),
            (40.0, [1.5, 0.4], PLAIN),
            (5.0, [0.8, 0.1], [1.6, -0.7, 0.5]),
        ] {
            let ring = ring(height, from_m, m);
            let density = |x| ring.beyond(x).map_or(0.0, |b| (b.ln_density - b.h).exp());
            // Shares of eight sectors and of two distances, by midpoints in polar coordinates of M(x − c).
            let (n_angles, n_radii) = (800, 4000);
            let part = |x: [f64; 2]| {
                let (dx, dy) = (x[0] - 0.3, x[1] + 0.2);
                let (dx, dy) = (m[0] * dx + m[1] * dy, m[2] * dy);
                let octant = usize::from(dx > 0.0)
                    + 2 * usize::from(dy > 0.0)
                    + 4 * usize::from(dx.abs() > dy.abs());
                let far = (dx * dx + dy * dy).sqrt() > ring.inner_m + 0.5 / ring.rate;
                octant + 8 * usize::from(far)
            };
            let mut expected = [0.0; 16];
            let step = 20.0 / ring.rate / f64::from(n_radii);
            for k in 0..n_radii {
                let r = ring.inner_m + (f64::from(k) + 0.5) * step;
                for l in 0..n_angles {
                    let angle = (f64::from(l) + 0.5) / f64::from(n_angles) * std::f64::consts::TAU;
                    let dy = r * angle.sin() / m[2];
                    let x = [0.3 + (r * angle.cos() - m[1] * dy) / m[0], -0.2 + dy];
                    let area = r * step * std::f64::consts::TAU / f64::from(n_angles);
                    expected[part(x)] += density(x) * area / (m[0] * m[2]);
                }
            }
            let total: f64 = expected.iter().sum();
            assert!((total - 1.0).abs() < 1e-4, "{total}");
            let n = 160_000;
            let mut seen = [0.0; 16];
            for k in 0..n {
                // An even grid in place of random numbers.
                let angle = (f64::from(k % 400) + 0.5) / 400.0 * std::f64::consts::TAU;
                let h = -((f64::from(k / 400) + 0.5) / 400.0).ln();
                let x = ring.place([angle.cos(), angle.sin()], h);
                let back = ring.beyond(x).expect("outside");
                assert!((back.h - h).abs() < 1e-9 * (1.0 + 1.0 / h));
                seen[part(x)] += 1.0 / f64::from(n);
            }
            for (a, b) in seen.iter().zip(expected) {
                assert!((a - b).abs() < 0.01, "{height} {seen:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_mixture_is_never_far_below_its_part() {
        for t in [-800.0, -3.0, 0.0, 5.0, 599.0, 601.0, 5000.0] {
            assert!(ln_over_mixture(0.5, t) <= 0.5_f64.ln().abs());
            let expected = -(0.5 + f64::exp(t.min(600.0))).ln() - (t - 600.0).max(0.0);
            assert!((ln_over_mixture(0.5, t) - expected).abs() < 1e-9, "{t}");
        }
    }
}
