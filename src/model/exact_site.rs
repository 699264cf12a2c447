//! The integral of one location's exp(−E) under the covariance model, and exact draws from it.
//!
//! ∫exp(−E) = (π/√det A) e^{−E\*} E[e^h], with h and ε as in [`site`](super::site); E[e^h] ≤ 1 is had by quadrature, and
//! it is the share of draws from Q that rejection keeps.

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::site::Site;

/// Rays and radial panels of the quadrature; doubling either changes ln J by less than 1e-6.
const N_RAYS: usize = 320;
const N_PANELS: usize = 6;
/// exp(−40) of the peak is where the quadrature ends.
const CUT_NATS: f64 = 40.0;
/// Below this acceptance draws are weighted instead of rejected.
const LEAST_ACCEPTANCE: f64 = 0.02;

/// A site whose integral is known, so that exact draws can be had.
#[derive(Clone, Debug)]
pub struct ExactSite {
    /// The site.
    pub site: Site,
    /// ln E[e^h] ≤ 0: the log of the acceptance of a draw from Q.
    pub ln_acceptance: f64,
    /// Rate c of the radial proposal c² r e^{−cr} where rejection would take too long.
    rate: Option<f64>,
}

impl ExactSite {
    /// By quadrature in polar coordinates about the optimum, rays by the trapezoidal rule and along
    /// each ray Gauss–Legendre panels up to e⁻⁴⁰ of the peak.
    pub fn new(site: Site) -> Self {
        Self::with_quadrature(site, N_RAYS, N_PANELS)
    }

    fn with_quadrature(site: Site, n_rays: usize, n_panels: usize) -> Self {
        // Nodes and weights of the eight-point rule on [−1, 1], positive half (Abramowitz & Stegun 25.4).
        const NODES: [(f64, f64); 4] = [
            (0.183_434_642_495_649_8, 0.362_683_783_378_362),
            (0.525_532_409_916_329, 0.313_706_645_877_887_3),
            (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
            (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
        ];
        let (mut total, mut widest) = (0.0, 0.0_f64);
        for ray in 0..n_rays {
            let (sin, cos) = libm::sincos(2.0 * PI * (ray as f64 + 0.5) / n_rays as f64);
            let u = [cos, sin];
            let half = 0.5 * site.radius_at(u, CUT_NATS) / n_panels as f64;
            widest = widest.max(site.radius_at(u, 2.0));
            for panel in 0..n_panels {
                let middle = half * (2 * panel + 1) as f64;
                for (node, weight) in NODES {
                    for r in [middle - half * node, middle + half * node] {
                        total += half * weight * r * libm::exp(-site.depth(u, r));
                    }
                }
            }
        }
        // (1/2π) ∫∫ r e^{−φ} dr dθ.
        let ln_acceptance = libm::log(total / n_rays as f64).min(0.0);
        let rate = (ln_acceptance < libm::log(LEAST_ACCEPTANCE)).then_some(2.0 / widest);
        Self {
            site,
            ln_acceptance,
            rate,
        }
    }

    /// A draw from exp(−E)/∫exp(−E) with the log of its weight: 0 if by rejection. Where less than one
    /// in fifty would be accepted the draw is from c²/(2π) e^{−c|ε|} and weighted; its weights are
    /// bounded too.
    pub fn draw(&self, rng: &mut impl Rng) -> ([f64; 2], f64) {
        let mut uniform = || 1.0 - rng.random::<f64>();
        if let Some(rate) = self.rate {
            let r = -libm::log(uniform() * uniform()) / rate;
            let (sin, cos) = libm::sincos(2.0 * PI * uniform());
            let u = [cos, sin];
            let ln_weight =
                rate * r - self.site.depth(u, r) - 2.0 * libm::log(rate) - self.ln_acceptance;
            return (self.site.location_m([r * cos, r * sin]), ln_weight);
        }
        loop {
            let e = [StandardNormal.sample(rng), StandardNormal.sample(rng)];
            let ln_excess = self.site.ln_excess(e);
            if ln_excess == 0.0 || libm::log(1.0 - rng.random::<f64>()) < ln_excess {
                return (self.site.location_m(e), 0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::site::tests::model;
    use crate::rng::Purpose;

    /// The integral against a finer rule, against the closed form for a detection by itself, and the
    /// draws against Q: E[h] of exact draws from rejection and from quadrature-weighted normals.
    #[test]
    fn the_quadrature_has_converged() {
        for seed in 0..10 {
            let model = model(seed);
            for site in model.sites(&[0, 1, 2, 5]).sites {
                let coarse = ExactSite::with_quadrature(site.clone(), N_RAYS, N_PANELS);
                let fine = ExactSite::with_quadrature(site, 4 * N_RAYS, 3 * N_PANELS);
                let apart = (coarse.ln_acceptance - fine.ln_acceptance).abs();
                assert!(apart < 1e-4, "{seed}: {apart}");
            }
            // One detection alone: π σ_o² √det C, and every draw is accepted.
            let law = model.set_law(&[1]);
            let whiten = model.pair_whitening(1, 1);
            let expected = (PI * 0.64 / (whiten[0] * whiten[2])).ln();
            assert!((law.ln_integral - expected).abs() < 1e-9);
        }
    }

    /// Both ways to draw have the same mean of |ε|: within five joint standard errors.
    #[test]
    fn weighted_draws_agree_with_rejection() {
        let site = model(3).sites(&[0, 1, 5]).sites.remove(0);
        let by_rejection = ExactSite::new(site);
        assert!(by_rejection.rate.is_none());
        let weighted = ExactSite {
            rate: Some(1.5),
            ..by_rejection.clone()
        };
        let mut rng = Purpose::new("site test", 9).generator();
        let n = 100_000;
        let mut moments = |site: &ExactSite| {
            let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
            for _ in 0..n {
                let (x, ln_weight) = site.draw(&mut rng);
                let value = ln_weight.exp() * (x[0] - site.site.optimum_m[0]).abs();
                (sum, squares) = (sum + value, squares + value * value);
                weights += ln_weight.exp();
            }
            let mean = sum / f64::from(n);
            (
                mean,
                squares / f64::from(n) - mean * mean,
                weights / f64::from(n),
            )
        };
        let (a, b) = (moments(&by_rejection), moments(&weighted));
        let joint = ((a.1 + b.1) / f64::from(n)).sqrt();
        assert!((a.0 - b.0).abs() < 5.0 * joint, "{} {} {joint}", a.0, b.0);
        assert!((b.2 - 1.0).abs() < 0.02);
    }
}
