//! Where each chain's draws lie among those of all chains: the picture behind R-hat.
//!
//! F_c − F, the empirical distribution of chain c less that of all m chains, against F, which is the
//! normalised rank (the rank plots of Vehtari, Gelman, Simpson, Carpenter & Bürkner, Bayesian Analysis
//! 16, 2021, §4.5, as differences of ECDFs: Säilynoja, Bürkner & Vehtari, Statistics and Computing 32,
//! 2022). Chains that sample one law stay within ±K √((1 − 1/m)/ESS_c) everywhere at once, K the
//! quantile of Kolmogorov's law at level 1 − 0.05/m (Bonferroni over the chains); ties and few draws
//! make that a little wide.

use super::chains::Chains;
use super::ranks::Ordered;

/// Share of sets of converged chains that stay inside the bands, all of them.
const LEVEL: f64 = 0.95;

/// One chain's difference.
#[derive(Clone, Debug, PartialEq)]
pub struct RankEcdf {
    /// (F, F_c − F) by rising F, from (0, 0) to (1, 0).
    pub points: Vec<(f64, f64)>,
    /// Half the height of the band; `None` without an ESS, or for one chain.
    pub band: Option<f64>,
}

/// Of each chain, at no more than `max_points` values; `ess` is that of each chain by itself.
///
/// # Panics
/// If `ess` has not one entry for each chain.
pub fn rank_ecdfs(chains: &Chains, ess: &[Option<f64>], max_points: usize) -> Vec<RankEcdf> {
    assert_eq!(ess.len(), chains.n_chains(), "an ESS for each chain");
    let pooled = Ordered::new(chains);
    let distinct = pooled.cumulative();
    let n_pooled = pooled.n() as f64;
    let every = distinct.len().div_ceil(max_points.max(1)).max(1);
    let m = chains.n_chains() as f64;
    let of_chain = |(draws, ess): (&[(f64, u64)], &Option<f64>)| {
        let mut own: Vec<(f64, u64)> = draws.to_vec();
        own.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let n: u64 = own.iter().map(|(_, n)| n).sum();
        let (mut place, mut below) = (0, 0);
        let mut points = vec![(0.0, 0.0)];
        for (k, &(value, up_to)) in distinct.iter().enumerate() {
            while place < own.len() && own[place].0 <= value {
                below += own[place].1;
                place += 1;
            }
            if (k + 1) % every == 0 || k + 1 == distinct.len() {
                let share = up_to as f64 / n_pooled;
                points.push((share, below as f64 / n as f64 - share));
            }
        }
        let level = 1.0 - (1.0 - LEVEL) / m;
        let band = ess
            .filter(|_| m > 1.0)
            .map(|ess| kolmogorov_quantile(level) * ((1.0 - 1.0 / m) / ess).sqrt());
        RankEcdf { points, band }
    };
    chains.iter().zip(ess).map(of_chain).collect()
}

/// K with P(sup|B| ≤ K) = `level` for a Brownian bridge B, by the first term of Kolmogorov's series:
/// right to 10⁻⁴ above 0.9.
fn kolmogorov_quantile(level: f64) -> f64 {
    (-0.5 * libm::log((1.0 - level) / 2.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    #[test]
    fn known_differences() {
        let chains = Chains::from_draws(&[vec![1.0, 2.0, 2.0, 4.0], vec![2.0, 4.0, 4.0, 4.0]]);
        let found = rank_ecdfs(&chains.expect("draws"), &[Some(4.0), None], 100);
        // F: 1/8 at 1, 4/8 at 2, 1 at 4.
        let first = [(0.0, 0.0), (0.125, 0.125), (0.5, 0.25), (1.0, 0.0)];
        assert_eq!(found[0].points, first);
        let second = [(0.0, 0.0), (0.125, -0.125), (0.5, -0.25), (1.0, 0.0)];
        assert_eq!(found[1].points, second);
        assert_eq!(found[1].band, None);
        let band = found[0].band.expect("an ESS");
        assert!((band - kolmogorov_quantile(0.975) * (0.5_f64 / 4.0).sqrt()).abs() < 1e-15);
        // Kolmogorov's 95 % point.
        assert!((kolmogorov_quantile(0.95) - 1.3581).abs() < 1e-4);
    }

    /// Independent draws of four chains: about 5 % of 400 repetitions have a chain outside its band
    /// somewhere. Five standard errors; Bonferroni and few draws make it conservative, by no more
    /// than half.
    #[test]
    fn bands_hold_as_often_as_said() {
        let mut rng = Purpose::new("rank ecdf", 1).generator();
        let mut n_outside = 0;
        for _ in 0..400 {
            let mut draws = || (0..200).map(|_| rng.random::<f64>()).collect::<Vec<f64>>();
            let chains = [draws(), draws(), draws(), draws()];
            let chains = Chains::from_draws(&chains).expect("draws");
            let found = rank_ecdfs(&chains, &[Some(200.0); 4], 10_000);
            let leaves = |chain: &RankEcdf| {
                let band = chain.band.expect("an ESS");
                chain.points.iter().any(|(_, y)| y.abs() > band)
            };
            n_outside += usize::from(found.iter().any(leaves));
        }
        let error = (400.0_f64 * 0.05 * 0.95).sqrt();
        assert!((n_outside as f64) < 20.0 + 5.0 * error, "{n_outside}");
        assert!(n_outside >= 4, "{n_outside}");
    }

    #[test]
    fn many_values_are_thinned_and_the_end_is_kept() {
        let draws: Vec<f64> = (0..1000).map(f64::from).collect();
        let chains = Chains::from_draws(&[draws.clone(), draws]).expect("draws");
        for chain in rank_ecdfs(&chains, &[None, None], 100) {
            assert!(chain.points.len() <= 102);
            assert_eq!(chain.points.last(), Some(&(1.0, 0.0)));
        }
    }
}
