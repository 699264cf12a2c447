//! Morris' screening: which factors matter at all, from a few trajectories.
//!
//! An elementary effect is the change of the response from one point of a trajectory to the next, over the
//! share of its range that the factor moved. Over trajectories μ is their mean, μ* the mean of their sizes
//! (Campolongo, Cariboni & Saltelli, Environmental Modelling & Software 22, 2007) and σ their standard
//! deviation: large where the effect depends on where one is, by interactions or a bend.
//!
//! **Noise.** An effect is a mean over worlds, whose spread gives its variance by noise. That is taken off
//! σ². μ* cannot be freed of it, since sizes do not cancel: `mu_star_of_noise` = √(2/π) × the standard
//! deviation by noise is what a factor without effect would show. A factor is **told from noise** if the mean
//! of its effects' squares, taken across different worlds ([`product_across`]) where noise has mean 0, is above
//! 0 by its interval. Intervals: Bayesian bootstrap of trajectories, and, but for μ*, of worlds.

use rand::Rng;

use super::interval::Interval;
use super::r_hat::variance;
use super::weights::{N_DRAWS, equal_weights, percentiles, product_across, random_weights};

/// What the elementary effects of one factor show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screening {
    /// Mean size.
    pub mu_star: f64,
    /// Its 95 % interval.
    pub mu_star_interval: Option<Interval>,
    /// Mean.
    pub mu: f64,
    /// Its 95 % interval.
    pub mu_interval: Option<Interval>,
    /// Standard deviation over trajectories, that of the noise taken off.
    pub sigma: f64,
    /// Its 95 % interval.
    pub sigma_interval: Option<Interval>,
    /// Mean size that noise alone would give; `None` for one world, where noise cannot be told.
    pub mu_star_of_noise: Option<f64>,
    /// Whether it is told from noise; `None` for one world.
    pub exceeds_noise: Option<bool>,
    /// Trajectories.
    pub n_trajectories: usize,
    /// Worlds.
    pub n_units: usize,
}

/// From elementary effects by trajectory and world; `None` for fewer than two trajectories.
pub fn screening(effects: &[Vec<f64>], rng: &mut impl Rng) -> Option<Screening> {
    let n_trajectories = effects.len();
    if n_trajectories < 2 {
        return None;
    }
    let n_units = effects[0].len();
    // Variance by noise in one world, a mean over trajectories; one world cannot tell.
    let sum: Option<f64> = effects.iter().map(|own| variance(own)).sum();
    let noise = sum.map(|sum| sum / n_trajectories as f64);
    let squares = |weights: &[f64]| weights.iter().map(|w| w * w).sum::<f64>();
    let weigh = |by_trajectory: &[f64], by_unit: &[f64]| {
        let mean = |own: &Vec<f64>| own.iter().zip(by_unit).map(|(x, w)| x * w).sum::<f64>();
        let means: Vec<f64> = effects.iter().map(mean).collect();
        let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
            let terms = means.iter().zip(by_trajectory);
            terms.map(|(x, weight)| weight * of(*x)).sum()
        };
        let mu = sum(&|x| x);
        let spread = sum(&|x| (x - mu) * (x - mu)) / (1.0 - squares(by_trajectory));
        let of_noise = noise.unwrap_or(0.0) * squares(by_unit);
        [sum(&f64::abs), mu, (spread - of_noise).max(0.0).sqrt()]
    };
    let (equal, all_worlds) = (equal_weights(n_trajectories), equal_weights(n_units));
    let [mu_star, mu, sigma] = weigh(&equal, &all_worlds);
    let mut draws = [const { Vec::new() }; 4];
    for _ in 0..N_DRAWS {
        let by_trajectory = random_weights(n_trajectories, rng);
        let by_unit = random_weights(n_units, rng);
        // Uneven weights of worlds would add noise to every size.
        let [mu_star, ..] = weigh(&by_trajectory, &all_worlds);
        let [_, mu, sigma] = weigh(&by_trajectory, &by_unit);
        let across = |own: &Vec<f64>| product_across(own, own, &by_unit);
        let terms = effects.iter().zip(&by_trajectory);
        let square = terms.map(|(own, weight)| weight * across(own)).sum();
        let found = [mu_star, mu, sigma, square];
        draws.iter_mut().zip(found).for_each(|(all, x)| all.push(x));
    }
    let [of_mu_star, of_mu, of_sigma, of_square] = draws.map(percentiles);
    let of_noise = noise.map(|noise| noise / n_units as f64);
    Some(Screening {
        mu_star,
        mu_star_interval: of_mu_star,
        mu,
        mu_interval: of_mu,
        sigma,
        sigma_interval: of_sigma,
        mu_star_of_noise: of_noise.map(|noise| (noise * 2.0 / std::f64::consts::PI).sqrt()),
        exceeds_noise: noise.and(of_square).map(|interval| interval.low > 0.0),
        n_trajectories,
        n_units,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand_distr::{Distribution, StandardNormal};

    fn of(effects: &[Vec<f64>]) -> Screening {
        let mut rng = Purpose::new("test", 1).generator();
        screening(effects, &mut rng).expect("trajectories")
    }

    /// y = 3 x₁ + x₂²: the effect of x₁ is 3 everywhere; of x₂, moved by Δ = ⅔ up from 0 or ⅓, 2x + Δ.
    #[test]
    fn a_line_has_no_sigma_and_a_bend_has() {
        let line = of(&vec![vec![3.0]; 6]);
        assert_eq!((line.mu_star, line.mu, line.sigma), (3.0, 3.0, 0.0));
        assert_eq!((line.mu_star_of_noise, line.exceeds_noise), (None, None));
        let bend: Vec<Vec<f64>> = [2.0, 4.0].repeat(4).iter().map(|x| vec![x / 3.0]).collect();
        let bend = of(&bend);
        assert!((bend.mu - 1.0).abs() < 1e-12 && bend.mu == bend.mu_star);
        // Variance over 8 − 1 of values ±⅓ about 1.
        assert!((bend.sigma - (8.0_f64 / 7.0 / 9.0).sqrt()).abs() < 1e-12);
        let signs = of(&[vec![2.0], vec![-2.0]]);
        assert_eq!((signs.mu, signs.mu_star), (0.0, 2.0));
    }

    /// Noise of standard deviation 1 in each of five worlds: 1/√5 in an effect.
    #[test]
    fn noise_is_no_effect_and_no_bend() {
        let mut rng = Purpose::new("test", 2).generator();
        let mut effects = |effect: f64| -> Vec<Vec<f64>> {
            let mut noisy = || {
                let noise: f64 = StandardNormal.sample(&mut rng);
                effect + noise
            };
            (0..200)
                .map(|_| (0..5).map(|_| noisy()).collect())
                .collect()
        };
        let inert = of(&effects(0.0));
        let expected = (2.0 / std::f64::consts::PI / 5.0_f64).sqrt();
        let of_noise = inert.mu_star_of_noise.expect("five worlds");
        assert!((of_noise / expected - 1.0).abs() < 0.1, "{of_noise}");
        assert_eq!(inert.exceeds_noise, Some(false));
        let line = of(&effects(3.0));
        assert_eq!(line.exceeds_noise, Some(true));
        // Without the noise taken off, σ would be 0.447; of 200 trajectories its square is 0 ± 0.02.
        assert!(line.sigma < 0.33, "{line:?}");
        let interval = line.mu_interval.expect("an interval");
        assert!(interval.low < 3.0 && 3.0 < interval.high, "{interval:?}");
    }
}
