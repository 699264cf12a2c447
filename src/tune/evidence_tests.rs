//! Tests of the normalised likelihood.

use super::super::rule::ModelKind;
use super::*;
use crate::detections::Detection;
use crate::rng::Purpose;
use rand_distr::Distribution;

fn at(x: f64, y: f64, seen: Option<(f64, f64)>) -> Detection {
    Detection {
        first_seen_s: seen.map(|s| s.0),
        last_seen_s: seen.map(|s| s.1),
        ..Detection::at(x, y)
    }
}

/// ln of the joint of T, s² on the grid and ρ integrated out, from the definition.
fn ln_joint(mixture: &Mixture, labels: &[usize], ln_variance: f64) -> f64 {
    let n = labels.len();
    let variance = libm::exp(ln_variance);
    let mut n_sets = 0;
    let mut sum = 0.0;
    for label in 0..n {
        let members: Vec<usize> = (0..n).filter(|&i| labels[i] == label).collect();
        if members.is_empty() {
            continue;
        }
        n_sets += 1;
        let k = members.len() as f64;
        // ∫ Π N(z_i; x, s²C_i) dx by completing the square.
        let (mut p, mut w, mut zz, mut ln_det) = ([0.0; 3], [0.0; 2], 0.0, 0.0);
        for &i in &members {
            let (c, [x, y]) = (mixture.shapes[i], mixture.positions_m[i]);
            let det = (c.xx * c.yy - c.xy * c.xy) * variance * variance;
            let [xx, xy, yy] = [c.yy, -c.xy, c.xx].map(|v| v * variance / det);
            p = [p[0] + xx, p[1] + xy, p[2] + yy];
            w = [w[0] + xx * x + xy * y, w[1] + xy * x + yy * y];
            zz += xx * x * x + 2.0 * xy * x * y + yy * y * y;
            ln_det += det.ln();
        }
        let det = p[0] * p[2] - p[1] * p[1];
        let square = (p[2] * w[0] * w[0] - 2.0 * p[1] * w[0] * w[1] + p[0] * w[1] * w[1]) / det;
        sum += mixture.ln_prior(&members)
            - mixture.ln_area
            - (k - 1.0) * std::f64::consts::TAU.ln()
            - (ln_det + det.ln()) / 2.0
            - (zz - square) / 2.0;
    }
    // The second detection overlaps the first.
    let v: f64 = (n_sets..=n)
        .map(|m| {
            let m_f = m as f64;
            let falling: f64 = (0..n_sets).map(|k| m_f - k as f64).product();
            let rising: f64 = (0..n).map(|k| m_f + k as f64).product();
            falling / rising / m_f / (1.0 - 0.99 / m_f)
        })
        .sum();
    sum + v.ln()
}

#[test]
fn the_prior_is_normalised_for_every_number_of_landmarks() {
    let n = 6;
    let ln_new = ln_new(&[0; 6]);
    let mut sum = 0.0;
    for topology in crate::partition::Partitions::of(n) {
        let mut sizes = vec![0_usize; n];
        for &label in topology.labels() {
            sizes[label as usize] += 1;
        }
        let t = sizes.iter().filter(|&&size| size > 0).count();
        let factorials: f64 = sizes.iter().map(|&k| libm::lgamma(k as f64 + 1.0)).sum();
        sum += (ln_new[..t].iter().sum::<f64>() + factorials).exp();
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
    let busy = super::ln_new(&[0, 1, 1, 1, 1, 1]);
    assert!(busy[1] < ln_new[1] && busy[4] < ln_new[4]);
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
    for kind in [ModelKind::Metric, ModelKind::Covariance] {
        let errors = Errors::of(&detections, kind).expect("good covariances");
        holds_to_enumeration(&Mixture::new(&detections, &errors, 0.1));
    }
}

fn holds_to_enumeration(mixture: &Mixture) {
    assert!(mixture.overlap(0, 1) && !mixture.overlap(1, 2) && !mixture.overlap(0, 0));
    let mut expected = std::collections::BTreeMap::new();
    let mut total = 0.0;
    for topology in crate::partition::Partitions::of(4) {
        let labels: Vec<usize> = topology.labels().iter().map(|&l| l as usize).collect();
        let mass: f64 = mixture
            .ln_variances
            .iter()
            .map(|&v| ln_joint(mixture, &labels, v).exp())
            .sum();
        total += mass;
        expected.insert(topology, mass);
    }
    let mut rng = Purpose::new("test", 5).generator();
    let n_draws = 40_000;
    let draws = mixture.sample(100, n_draws, 0.3, &mut rng);
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
            by_enumeration += ln_joint(mixture, &labels, v).exp() / total * v / 2.0;
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
    let errors = Errors::of(&detections, ModelKind::Metric).expect("no need of covariances");
    let mixture = Mixture::new(&detections, &errors, 0.01);
    let draws = mixture.sample(50, 200, 0.8, &mut rng);
    let mut noise: Vec<f64> = draws.iter().map(|draw| draw.noise).collect();
    noise.sort_by(f64::total_cmp);
    // 72 degrees of freedom: 0.5 is known to about 8 %.
    assert!((noise[100] - 0.5).abs() < 0.15, "{}", noise[100]);
    let n_sets = draws.iter().map(|draw| draw.n_sets as f64).sum::<f64>() / 200.0;
    assert!((11.5..13.5).contains(&n_sets), "{n_sets}");
}
