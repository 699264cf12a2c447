//! Draws have the law that their weights are made for.

use super::*;
use crate::sampler::split_merge;

/// Means and products of the locations of the first member of each set: weighted draws from the
/// tilted law q against draws from the normal law γ, E_q[γ/q·φ] = E_γ[φ].
#[test]
fn tilted_draws_are_weighed_back_to_the_normal_law() {
    for model in [
        crowd(PenaltyShape::Cubic),
        crowd_of_ellipses(PenaltyShape::Cubic),
    ] {
        let mut explicit = Explicit::new(&model, Prior::Uniform, 2);
        let state = start(&model, Prior::Uniform, &[0; 6]);
        let (mut rng, mut n_checks) = (rng(7), 0);
        while n_checks < 6 {
            let mut change = Change::default();
            split_merge::propose(SplitRule::Uniform, &state.partition, &mut change, &mut rng);
            if change.added().len() != 2 {
                continue;
            }
            explicit.blocks.ln_closed(&explicit.laws, &state, &change);
            let side = &mut explicit.blocks.proposed;
            let Some(tilt) = side.tilt else {
                continue;
            };
            let cut = change.added()[0].len();
            let mut moments = [[0.0; 14]; 2];
            let mut squares = [[0.0; 14]; 2];
            let n_draws = 200_000;
            for (tilts, (sums, squares)) in moments.iter_mut().zip(&mut squares).enumerate() {
                side.tilt = (tilts == 0).then_some(tilt);
                for _ in 0..n_draws {
                    let mut x_m = Vec::new();
                    side.draw(&explicit.laws, &mut rng, &mut x_m);
                    let mean = |x_m: &[[f64; 2]], axis: usize| {
                        x_m.iter().map(|x| x[axis]).sum::<f64>() / x_m.len() as f64
                    };
                    let r = [0, 1].map(|axis| mean(&x_m[..cut], axis) - mean(&x_m[cut..], axis));
                    let weight = side.tilt.map_or(1.0, |tilt| tilt.ln_correction(r).exp());
                    let [[a, b], [c, d]] = [x_m[0], x_m[5]];
                    let products = [a * a, a * b, b * b, c * c, c * d, d * d];
                    let across = [a * c, a * d, b * c, b * d];
                    let all = [a, b, c, d].into_iter().chain(products).chain(across);
                    for ((value, sum), square) in all.zip(&mut *sums).zip(&mut *squares) {
                        *sum += weight * value / f64::from(n_draws);
                        *square += (weight * value).powi(2) / f64::from(n_draws);
                    }
                }
            }
            for k in 0..14 {
                // Five standard errors of the difference.
                let variance = |side: usize| squares[side][k] - moments[side][k].powi(2);
                let error = 5.0 * ((variance(0) + variance(1)) / f64::from(n_draws)).sqrt();
                let [tilted, plain] = [moments[0][k], moments[1][k]];
                assert!(
                    (tilted - plain).abs() < error,
                    "{k}: {tilted} {plain} {error}"
                );
            }
            n_checks += 1;
        }
    }
}
