use rand::{Rng, RngExt};

use super::*;
use crate::model::{Draws, Model, Penalty, PenaltyShape};
use crate::rng::Purpose;

const METHODS: [OptimumMethod; 2] = [OptimumMethod::Bfgs, OptimumMethod::Newton];

fn model(positions_m: &[[f64; 2]], sigma_o_m: f64, sigma_t_m: f64) -> MetricModel {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 1.0,
        height: 1.0,
    };
    MetricModel::new(positions_m, sigma_o_m, sigma_t_m, penalty)
}

/// n positions over a spread of 10⁻³ to 10³ σ_o, far from the origin; some coincide, in a seventh of the sets all.
fn positions(n: usize, sigma_o_m: f64, rng: &mut impl Rng) -> Vec<[f64; 2]> {
    let spread_m = sigma_o_m * libm::exp10(6.0 * rng.random::<f64>() - 3.0);
    let all_coincide = rng.random_range(0..7) == 0;
    let mut positions_m: Vec<[f64; 2]> = Vec::new();
    for i in 0..n {
        let fresh = [100.0, -40.0].map(|c| c + spread_m * rng.random::<f64>());
        let twin = i > 0 && (all_coincide || rng.random_range(0..4) == 0);
        let position_m = if twin { positions_m[i - 1] } else { fresh };
        positions_m.push(position_m);
    }
    positions_m
}

/// X\*, Σ and ln I₀ of one set against the closed form. X\* to 10⁻⁸ of the set's extent, ln I₀ to 10⁻⁸, and Σ
/// to 10⁻⁸ both of its largest entry and of the variance of the difference of two members, which is
/// smaller by up to n(σ_o/σ_t)².
fn check(model: &MetricModel, members: &[u32], method: OptimumMethod) {
    let n = members.len();
    let found = SetOptimum::find(model, members, method);
    let (scales, centre) = (model.shrinkage(n), model.mean_m(members));
    let place = |i: u32, axis: usize| model.positions_m()[i as usize][axis];
    let extent = members
        .iter()
        .map(|&i| (place(i, 0) - centre[0]).hypot(place(i, 1) - centre[1]))
        .fold(0.0, f64::max);
    let context = format!(
        "{method}, n = {n}, ratio {:e}",
        model.sigma_o_m() / model.sigma_t_m()
    );
    for (&i, optimum) in members.iter().zip(&found.optimum_m) {
        for axis in [0, 1] {
            let expected = centre[axis] + scales.deviation * (place(i, axis) - centre[axis]);
            // Rounding of the coordinates themselves is the closed form's too.
            let apart = (optimum[axis] - expected).abs();
            assert!(
                apart <= 1e-8 * extent + 1e-13,
                "{context}: x* {apart:e} of {extent:e}"
            );
        }
    }
    let expected = model.ln_gaussian(members);
    let apart = (found.ln_gaussian - expected).abs();
    assert!(
        apart <= 1e-8 * expected.abs().max(1.0),
        "{context}: ln I0 {apart:e} of {expected}"
    );
    let covariance_m2 = found.covariance_m2();
    let (within, mean) = (scales.within_m.powi(2), scales.mean_m.powi(2));
    for k in 0..2 * n {
        for l in 0..2 * n {
            let same = f64::from(u8::from(k == l)) * within;
            let shared = f64::from(u8::from(k % 2 == l % 2)) * (mean - within) / n as f64;
            let apart = (covariance_m2[(k, l)] - same - shared).abs();
            assert!(apart <= 1e-8 * mean, "{context}: Σ {apart:e}");
        }
    }
    for k in 2..2 * n {
        let difference = found.factor_m.row(k) - found.factor_m.row(k - 2);
        let apart = (difference.norm_squared() / (2.0 * within) - 1.0).abs();
        assert!(apart <= 1e-8, "{context}: Σ of a difference {apart:e}");
    }
}

#[test]
fn every_way_agrees_with_the_closed_form() {
    let mut rng = Purpose::new("optimum test", 1).generator();
    for round in 0..60 {
        for n in 1..=12 {
            // The extremes themselves in the first rounds.
            let exponent = match round {
                0 => -3.0,
                1 => 3.0,
                _ => 6.0 * rng.random::<f64>() - 3.0,
            };
            let sigma_t_m = libm::exp10(2.0 * rng.random::<f64>() - 1.0);
            let sigma_o_m = sigma_t_m * libm::exp10(exponent);
            let positions_m = positions(n, sigma_o_m, &mut rng);
            let model = model(&positions_m, sigma_o_m, sigma_t_m);
            let members: Vec<u32> = (0..n as u32).collect();
            for method in METHODS {
                check(&model, &members, method);
            }
        }
    }
}

/// Larger sets than a test can have many of, at scales that are not extreme.
#[test]
fn a_large_set_agrees_too() {
    let mut rng = Purpose::new("optimum test", 2).generator();
    let positions_m = positions(60, 1.0, &mut rng);
    let members: Vec<u32> = (0..60).collect();
    for method in METHODS {
        check(&model(&positions_m, 1.0, 0.3), &members, method);
    }
}

/// BFGS moves by itself: its point is neither the start nor Newton's to the last bit.
#[test]
fn the_routes_are_routes_of_their_own() {
    let positions_m = [[0.0, 0.0], [1.0, 0.3], [-0.4, 2.0], [3.0, 1.1]];
    let model = model(&positions_m, 1.0, 0.4);
    let members: Vec<u32> = (0..4).collect();
    let [bfgs, newton] = METHODS.map(|method| SetOptimum::find(&model, &members, method));
    assert_ne!(bfgs.optimum_m, newton.optimum_m);
    for (x, z) in bfgs.optimum_m.iter().zip(model.positions_m()) {
        assert!((x[0] - z[0]).hypot(x[1] - z[1]) > 0.5);
    }
}

/// Draw r of `place` at the unit vectors of ε: column r of L, whatever order a sampler keeps a set in, so their
/// sum of squares is Σ of the closed form, axes apart.
#[test]
fn draws_are_placed_by_the_factor() {
    let positions_m = [[0.0, 0.0], [0.4, 0.3], [9.0, 9.0], [0.7, 1.1]];
    let (n, n_draws) = (4, 9);
    let model = model(&positions_m, 0.7, 1.3).with_optimum(OptimumMethod::Bfgs);
    let members = [3, 0, 1];
    let mut normals = [vec![0.0; n * n_draws], vec![0.0; n * n_draws]];
    for (k, i) in [0, 0, 1, 1, 3, 3].into_iter().enumerate() {
        normals[k % 2][i * n_draws + 1 + k] = 1.0;
    }
    let mut values = [vec![0.0; n * n_draws], vec![0.0; n * n_draws]];
    let ([x, y], row) = (&mut values, |i: u32| i as usize);
    let mut memory = OptimumMemory::default();
    let optimum = memory.get(&model, &members).expect("not the closed form");
    let epsilon = normals.each_ref().map(Vec::as_slice);
    optimum.place(n_draws, (epsilon, row), ([x, y], row));
    let scales = model.shrinkage(3);
    let (within, mean) = (scales.within_m.powi(2), scales.mean_m.powi(2));
    let from_optimum = |i: u32, axis: usize, r: usize| {
        let start = i as usize * n_draws;
        values[axis][start + r] - values[axis][start]
    };
    for &i in &members {
        for &j in &members {
            let same = if i == j { within } else { 0.0 };
            let expected = same + (mean - within) / 3.0;
            for axis in [0, 1] {
                let products = (1..7).map(|r| from_optimum(i, axis, r) * from_optimum(j, axis, r));
                assert!((products.sum::<f64>() - expected).abs() < 1e-12);
            }
            let across = (1..7).map(|r| from_optimum(i, 0, r) * from_optimum(j, 1, r));
            assert!(across.sum::<f64>().abs() < 1e-12);
        }
    }
    // The detection outside the set stays as it was.
    assert!(
        values
            .iter()
            .all(|v| v[2 * n_draws..3 * n_draws].iter().all(|&v| v == 0.0))
    );
}

/// The seam: bounds, set laws and estimates of the two ways, the estimates within five joint standard errors.
#[test]
fn draws_see_the_optimiser_through_the_same_seam() {
    let positions_m = [[0.0, 0.0], [0.4, 0.3], [1.4, -0.2], [1.6, 0.5], [0.7, 1.1]];
    let closed = model(&positions_m, 0.5, 0.6);
    let sets: [&[u32]; 3] = [&[4, 0], &[2, 1], &[3]];
    let n_draws = 20_000;
    let estimate = |model: &Model, seed| {
        let mut draws = Draws::new(5, n_draws);
        let mut rng = Purpose::new("optimum test", seed).generator();
        let ln_mean = draws.ln_mean_exp(model, sets.into_iter(), &mut rng);
        let weights = draws.ln_weights().iter().map(|l| (l - ln_mean).exp() - 1.0);
        let variance = weights.map(|w| w * w).sum::<f64>() / (n_draws as f64).powi(2);
        (ln_mean, variance)
    };
    let expected = estimate(&closed.clone().into(), 1);
    for method in METHODS {
        let other = Model::from(closed.clone().with_optimum(method));
        let mut draws = Draws::new(5, 1);
        for members in sets {
            let bound = draws.ln_bound(&other, members);
            assert!((bound - closed.ln_gaussian(members)).abs() < 1e-8);
            let mut sorted = members.to_vec();
            sorted.sort_unstable();
            let (a, b) = (closed.set_law(&sorted), other.set_law(&sorted));
            assert!((a.ln_integral - b.ln_integral).abs() < 1e-8);
            assert!((a.precision - b.precision).abs().max() < 1e-8);
            for (a, b) in a.covariance_m2.iter().zip(&b.covariance_m2) {
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-8));
            }
            for (a, b) in a.mean_m.iter().zip(&b.mean_m) {
                assert!((0..2).all(|k| (a[k] - b[k]).abs() < 1e-8));
            }
        }
        let found = estimate(&other, 2);
        let joint = (expected.1 + found.1).sqrt();
        assert!((found.0 - expected.0).abs() < 5.0 * joint, "{method}");
    }
}

#[test]
#[should_panic(expected = "gradient")]
fn a_point_that_is_no_minimum_is_never_used() {
    let model = model(&[[0.0, 0.0], [1.0, 0.0], [0.2, 0.7]], 1.0, 1.0);
    let (energy, _) = SetEnergy::of(&model, &[0, 1, 2]);
    let converged = TerminationStatus::Terminated(TerminationReason::SolverConverged);
    reached(&energy, &energy.start(), &converged, OptimumMethod::Bfgs);
}

/// An error inside the line search is not taken for an end of the search.
#[test]
#[should_panic(expected = "E is NaN")]
fn a_search_that_fails_says_so() {
    let model = model(&[[0.0, 0.0], [f64::NAN, 0.0]], 1.0, 1.0);
    SetOptimum::find(&model, &[0, 1], OptimumMethod::Bfgs);
}
