//! Tests of the normalised likelihood.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector3};
use rand_distr::Distribution;

use super::drift::{Linear, SharedDrift, covariance, matrix};
use super::mixture::Mixture;
use super::prior::ln_new;
use crate::detections::{Covariance, Detection, Detections};
use crate::rng::Purpose;
use crate::sighting::{FrameDrift, Pose};

const ROUND: Covariance = Covariance {
    xx: 1.0,
    xy: 0.0,
    yy: 1.0,
};

fn at(x: f64, y: f64, seen: Option<(f64, f64)>) -> Detection {
    Detection {
        first_seen_s: seen.map(|s| s.0),
        last_seen_s: seen.map(|s| s.1),
        ..Detection::at(x, y)
    }
}

fn pose(x_m: f64, y_m: f64, heading_rad: f64) -> Pose {
    Pose {
        x_m,
        y_m,
        heading_rad,
    }
}

/// ln of the joint of T and s² on the grid, weights and u integrated out, from the definition: all detections as one
/// Gaussian of 2N dimensions, landmarks by generalised least squares.
fn ln_joint(mixture: &Mixture, drift: Option<&Linear>, labels: &[usize], ln_variance: f64) -> f64 {
    let n = labels.len();
    let mut covariance = DMatrix::zeros(2 * n, 2 * n);
    for i in 0..n {
        let own = matrix(mixture.shapes[i]) * libm::exp(ln_variance);
        covariance
            .fixed_view_mut::<2, 2>(2 * i, 2 * i)
            .copy_from(&own);
        for (j, drift) in (0..n).flat_map(|j| drift.map(|drift| (j, drift))) {
            let shared = &drift.loadings_m[i] * drift.loadings_m[j].transpose();
            let mut block = covariance.fixed_view_mut::<2, 2>(2 * i, 2 * j);
            block += shared;
        }
    }
    let mut sets: Vec<usize> = labels.to_vec();
    sets.sort_unstable();
    sets.dedup();
    let n_sets = sets.len();
    let mut design = DMatrix::zeros(2 * n, 2 * n_sets);
    let mut prior = 0.0;
    for (k, set) in sets.iter().enumerate() {
        let members: Vec<usize> = (0..n).filter(|&i| labels[i] == *set).collect();
        for &i in &members {
            design
                .fixed_view_mut::<2, 2>(2 * i, 2 * k)
                .copy_from(&Matrix2::identity());
        }
        prior += mixture.prior.ln_of_set(&members) - mixture.ln_area;
    }
    let z: Vec<f64> = mixture.positions_m.iter().flatten().copied().collect();
    let z = DVector::from_vec(z);
    let root = covariance.cholesky().expect("positive definite");
    let solved = root.solve(&design);
    let information = design.transpose() * &solved;
    let information = information.cholesky().expect("positive definite");
    let places = information.solve(&(solved.transpose() * &z));
    let left = &z - design * places;
    let squared = left.dot(&root.solve(&left));
    // The second detection overlaps the first.
    let v: f64 = (n_sets..=n)
        .map(|m| {
            let m_f = m as f64;
            let falling: f64 = (0..n_sets).map(|k| m_f - k as f64).product();
            let rising: f64 = (0..n).map(|k| m_f + k as f64).product();
            falling / rising / m_f / (1.0 - 0.99 / m_f)
        })
        .sum();
    prior + v.ln()
        - (n - n_sets) as f64 * std::f64::consts::TAU.ln()
        - (root.ln_determinant() + information.ln_determinant() + squared) / 2.0
}

#[test]
fn the_prior_is_normalised_for_every_number_of_landmarks() {
    let n = 6;
    let apart = ln_new(&[0; 6]);
    let mut sum = 0.0;
    for topology in crate::partition::Partitions::of(n) {
        let mut sizes = vec![0_usize; n];
        for &label in topology.labels() {
            sizes[label as usize] += 1;
        }
        let t = sizes.iter().filter(|&&size| size > 0).count();
        let factorials: f64 = sizes.iter().map(|&k| libm::lgamma(k as f64 + 1.0)).sum();
        sum += (apart[..t].iter().sum::<f64>() + factorials).exp();
    }
    // V(0) = Σ_M p(M) M!/M! Γ(M)/Γ(M + N) is what ln_new leaves out.
    let v0: f64 = (1..=n)
        .map(|m| {
            let rising: f64 = (0..n).map(|k| (m + k) as f64).product();
            1.0 / m as f64 / rising
        })
        .sum();
    let harmonic: f64 = (1..=n).map(|m| 1.0 / m as f64).sum();
    assert!((sum * v0 / harmonic - 1.0).abs() < 1e-9, "{sum}");
    // What is in view is no candidate: the fewer landmarks, the more that counts for them.
    let busy = ln_new(&[0, 1, 1, 1, 1, 1]);
    assert!(busy[1] < apart[1] && busy[4] < apart[4]);
}

#[test]
fn gibbs_draws_from_the_joint_as_it_is_defined() {
    // Four detections: 15 topologies × the grid of s, by enumeration.
    let rows = vec![
        at(0.0, 0.0, Some((0.0, 2.0))),
        at(1.0, 0.3, Some((1.0, 3.0))),
        at(0.4, 0.9, Some((5.0, 6.0))),
        at(6.0, 5.0, Some((7.0, 8.0))),
    ];
    let c = |xx, xy, yy| Some(Covariance { xx, xy, yy });
    let covariances = [
        c(1.0, 0.5, 0.5),
        c(0.2, 0.0, 1.5),
        c(2.0, -0.8, 0.6),
        c(1.0, 0.0, 1.0),
    ];
    let rows = rows.into_iter().zip(covariances);
    let rows = rows.map(|(row, covariance_m2)| Detection {
        covariance_m2,
        ..row
    });
    let detections = Detections::new(rows.collect()).expect("good");
    let stated = detections.covariances_m2().expect("stated");
    for shapes in [vec![ROUND; 4], stated] {
        holds_to_enumeration(&Mixture::new(&detections, &shapes, 1.0, 0.1), None);
    }
}

#[test]
fn gibbs_draws_from_the_joint_with_drift() {
    // Visits of two places before and after a drift of about 1 m: without it all four are apart.
    let noise = Matrix3::from_diagonal(&Vector3::new(0.5, 0.3, 0.01));
    let early = FrameDrift::NONE.after(pose(1.0, 0.0, 0.3), &noise, &Vector3::new(0.0, 0.0, 0.05));
    let late = early.after(pose(4.0, 2.0, 1.0), &noise, &Vector3::new(0.1, 0.0, 0.05));
    let row = |x: f64, y: f64, t: f64, drift: FrameDrift| {
        let (random, steady) = drift.since(FrameDrift::NONE, [x, y]);
        let own = Matrix2::new(0.06, 0.02, 0.02, 0.04);
        Detection {
            covariance_m2: Some(covariance(own + random + steady * steady.transpose())),
            ..at(x, y, Some((t, t + 1.5)))
        }
    };
    let rows = vec![
        row(0.0, 0.0, 0.0, early),
        row(1.5, 0.4, 1.0, early),
        row(0.9, 0.7, 5.0, late),
        row(2.2, 1.3, 7.0, late),
    ];
    let detections = Detections::new(rows).expect("good");
    let drift = SharedDrift::of(&detections, &[early, early, late, late]).expect("finite");
    assert!(drift.n_factors() > 3);
    let linear = drift.about(&DVector::from_element(drift.n_factors(), 0.3));
    let linear = linear.expect("finite");
    let mixture = Mixture::with_drift(&detections, linear.clone());
    holds_to_enumeration(&mixture, Some(&linear));
}

#[test]
fn places_are_linear_about_any_drift_and_own_errors_turn_with_the_frame() {
    // Three long stretches, 0.3 to 0.5 rad each, far from the origin.
    let noise = Matrix3::from_diagonal(&Vector3::new(0.3, 0.2, 0.04));
    let mut drifts = vec![FrameDrift::NONE];
    for k in 0..3 {
        let last = drifts[drifts.len() - 1];
        let pivot = pose(1000.0 + 3.0 * f64::from(k), -2000.0, f64::from(k));
        drifts.push(last.after(pivot, &noise, &Vector3::new(0.0, 0.1, 0.1)));
    }
    let own = Matrix2::new(0.09, 0.02, 0.02, 0.01);
    let rows = drifts.iter().enumerate().map(|(i, drift)| {
        let [x, y] = [1002.0 + 2.0 * i as f64, -1996.0 + i as f64];
        let (random, steady) = drift.since(FrameDrift::NONE, [x, y]);
        Detection {
            covariance_m2: Some(covariance(own + random + steady * steady.transpose())),
            ..Detection::at(x, y)
        }
    });
    let detections = Detections::new(rows.collect()).expect("good");
    let drift = SharedDrift::of(&detections, &drifts).expect("finite");
    let r = drift.n_factors();
    let at = DVector::from_fn(r, |k, _| [0.9, -1.1, 0.7][k % 3]);
    let about = drift.about(&at).expect("finite");
    let h = 1e-5;
    for k in 0..r {
        let step = |sign: f64| {
            let mut moved = at.clone();
            moved[k] += sign * h;
            drift.about(&moved).expect("finite").places_m
        };
        let (up, down) = (step(1.0), step(-1.0));
        for i in 0..4 {
            let slope = (up[i] - down[i]) / (2.0 * h);
            let found = about.loadings_m[i].column(k);
            assert!(
                (slope + found).norm() < 1e-5 * (1.0 + slope.norm()),
                "{i} {k}: {slope} {found}"
            );
        }
    }
    // What is left of the drift in the axes of a place: its own error, turned as far as the place is.
    let untouched = matrix(about.own_m2[0]);
    assert!((untouched - own).norm() < 1e-6, "{untouched}");
    let turned = matrix(about.own_m2[3]);
    let headings = drift.about(&DVector::zeros(r)).expect("finite");
    let still = matrix(headings.own_m2[3]);
    assert!((turned.trace() - still.trace()).abs() < 1e-9);
    assert!((turned - still).norm() > 0.01, "{turned} {still}");
}

fn holds_to_enumeration(mixture: &Mixture, drift: Option<&Linear>) {
    assert!(mixture.overlap(0, 1) && !mixture.overlap(1, 2) && !mixture.overlap(0, 0));
    let mut expected = std::collections::BTreeMap::new();
    let mut total = 0.0;
    for topology in crate::partition::Partitions::of(4) {
        let labels: Vec<usize> = topology.labels().iter().map(|&l| l as usize).collect();
        let mass: f64 = mixture
            .ln_variances
            .iter()
            .map(|&v| ln_joint(mixture, drift, &labels, v).exp())
            .sum();
        total += mass;
        expected.insert(topology, mass);
    }
    let mut rng = Purpose::new("test", 5).generator();
    let n_draws = 40_000;
    let draws = mixture.sample(100, n_draws, mixture.variance_at(0.3), &mut rng);
    let mut counts = std::collections::BTreeMap::new();
    for draw in &draws {
        *counts
            .entry(crate::partition::Topology::canonical(&draw.labels))
            .or_insert(0.0) += 1.0;
    }
    for (topology, mass) in &expected {
        let p = mass / total;
        let share = counts.get(topology).copied().unwrap_or(0.0) / n_draws as f64;
        // Successive sweeps are correlated: an effective tenth of the draws, four standard errors.
        let error = 4.0 * (p * (1.0 - p) / (n_draws as f64 / 10.0)).sqrt();
        assert!(
            (share - p).abs() < error.max(2e-3),
            "{topology}: {share} against {p}"
        );
    }
    let mean = draws.iter().map(|draw| draw.noise.ln()).sum::<f64>() / n_draws as f64;
    let mut by_enumeration = 0.0;
    for topology in expected.keys() {
        let labels: Vec<usize> = topology.labels().iter().map(|&l| l as usize).collect();
        for &v in &mixture.ln_variances {
            by_enumeration += ln_joint(mixture, drift, &labels, v).exp() / total * v / 2.0;
        }
    }
    assert!(
        (mean - by_enumeration).abs() < 0.1,
        "{mean} against {by_enumeration}"
    );
}

#[test]
fn noise_and_landmarks_are_found_again() {
    // 12 landmarks on a grid of 40 m, each seen four times with s = 0.5 m, in rounds.
    let mut rng = Purpose::new("test", 6).generator();
    let mut rows = Vec::new();
    for round in 0..4 {
        for k in 0..12 {
            let mut normal = || rand_distr::StandardNormal.sample(&mut rng);
            let (dx, dy): (f64, f64) = (normal(), normal());
            let t = f64::from(round * 12 + k);
            rows.push(at(
                40.0 * f64::from(k % 4) + 0.5 * dx,
                40.0 * f64::from(k / 4) + 0.5 * dy,
                Some((t, t + 0.5)),
            ));
        }
    }
    let detections = Detections::new(rows).expect("good");
    let mixture = Mixture::new(&detections, &vec![ROUND; detections.len()], 1.0, 0.01);
    let draws = mixture.sample(50, 200, mixture.variance_at(0.8), &mut rng);
    let mut noise: Vec<f64> = draws.iter().map(|draw| draw.noise).collect();
    noise.sort_by(f64::total_cmp);
    // 72 degrees of freedom: 0.5 is known to about 8 %.
    assert!((noise[100] - 0.5).abs() < 0.15, "{}", noise[100]);
    let n_sets = draws.iter().map(|draw| draw.n_sets as f64).sum::<f64>() / 200.0;
    assert!((11.5..13.5).contains(&n_sets), "{n_sets}");
}
