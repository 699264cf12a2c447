//! Noise that is stated wrong, and what a solution says of its fit.

use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::mission::{Fit, NoiseFactors, Solution, SolveSettings, fit, solve};
use crate::partition::Topology;
use crate::rng::Purpose;

/// Standard deviations of the errors: of sightings (m), and of odometry in place (m) and heading
/// (rad).
const TRUE_STD: [f64; 3] = [0.05, 0.02, 0.01];

/// Three laps of 6 m radius past 16 landmarks that stand 2 m outside it, seen up to 4 m away. The
/// noise is stated `factor` times as large as it is; the step that has `slip` in it goes that much
/// further (m) than the odometry says.
pub fn laps(factor: f64, slip: Option<(usize, f64)>, number: u64) -> Graph {
    laps_with(factor, slip, 0.0, number)
}

/// The same, with a correlation between the errors of a landmark in one scan and the next.
fn laps_with(factor: f64, slip: Option<(usize, f64)>, correlation: f64, number: u64) -> Graph {
    let mut rng = Purpose::new("test", number).generator();
    let mut error = |std: f64| {
        let normal: f64 = StandardNormal.sample(&mut rng);
        std * normal
    };
    let [seen_std, place_std, heading_std] = TRUE_STD;
    let ring = |angle: f64, radius: f64| [radius * angle.cos(), radius * angle.sin()];
    let landmarks: Vec<[f64; 2]> = (0..16)
        .map(|k| ring(f64::from(k) * std::f64::consts::FRAC_PI_8, 8.0))
        .collect();
    let step = std::f64::consts::TAU / 40.0;
    let true_pose = |k: usize| {
        let angle = step * k as f64;
        let [x, y] = ring(angle, 6.0);
        pose(x, y, angle + std::f64::consts::FRAC_PI_2)
    };
    let information = |std: f64| (factor * std).powi(-2);
    let mut graph = Graph {
        start: true_pose(0),
        times_s: (0..120_u32).map(f64::from).collect(),
        odometry: Vec::new(),
        observations: Vec::new(),
    };
    let mut errors = vec![[0.0; 2]; landmarks.len()];
    for k in 0..120 {
        let here = true_pose(k);
        if k > 0 {
            let before = true_pose(k - 1);
            let mut relative = before.to(here);
            relative.x_m += error(place_std);
            relative.y_m += error(place_std);
            relative.heading_rad += error(heading_std);
            if let Some((_, by_m)) = slip.filter(|(at, _)| *at == k) {
                relative.x_m -= by_m;
            }
            let place = information(place_std);
            let heading = information(heading_std);
            graph.odometry.push(Odometry {
                relative,
                information: Matrix3::from_diagonal(&[place, place, heading].into()),
            });
        }
        for (id, landmark) in landmarks.iter().enumerate() {
            let (range, bearing) = here.range_and_bearing_to(*landmark);
            if range < 4.0 {
                let at = [range * bearing.cos(), range * bearing.sin()];
                let fresh = (1.0 - correlation * correlation).sqrt() * seen_std;
                let of_one = &mut errors[id];
                *of_one = of_one.map(|before| correlation * before + error(fresh));
                let at = [at[0] + of_one[0], at[1] + of_one[1]];
                let weight = information(seen_std);
                let one = seen(k, at, [weight, 0.0, weight]);
                graph.observations.push(Observation {
                    landmark: Some(id as i64),
                    ..one
                });
            }
        }
    }
    graph
}

fn solved(graph: &Graph) -> Solution {
    let settings = SolveSettings {
        sweeps: 0,
        ..SolveSettings::with_seed(1)
    };
    solve(graph, settings, &|_| {}).expect("solved")
}

pub fn truth(graph: &Graph) -> Topology {
    let ids = graph.observations.iter().map(|one| one.landmark);
    Topology::canonical(&ids.collect::<Vec<_>>())
}

#[test]
fn honest_noise_stays_as_it_is() {
    for number in 0..5 {
        let graph = laps(1.0, None, number);
        let found = solved(&graph);
        assert_eq!(found.noise, NoiseFactors::STATED, "{number}");
        assert_eq!(Topology::canonical(&found.map.labels), truth(&graph));
        // Three standard deviations of a standard normal number.
        let score = found.fit.score().expect("degrees of freedom");
        assert!(score.abs() < 3.0, "{score}");
    }
}

/// Some 300 sightings tell a standard deviation to 4 % (1/√2n), and its factor is to be within four
/// of these; odometry is told less well.
#[test]
fn noise_that_is_misstated_is_put_right() {
    for factor in [0.6, 1.6] {
        let graph = laps(factor, None, 7);
        assert!(graph.observations.len() > 300);
        let found = solved(&graph);
        let noise = found.noise;
        for (name, found, off) in [
            ("range", noise.range, 0.16),
            ("bearing", noise.bearing, 0.16),
            ("place", noise.place, 0.4),
            ("heading", noise.heading, 0.4),
        ] {
            let right = 1.0 / factor;
            assert!((found / right).ln().abs() < off, "{name}: {found}, {right}");
        }
        assert_eq!(Topology::canonical(&found.map.labels), truth(&graph));
    }
}

/// A step that slips is what overstated noise is for: lowered to what all other steps are, it would
/// tear the map there.
#[test]
fn noise_is_not_lowered_where_a_wheel_slipped() {
    let graph = laps(4.0, Some((50, 0.5)), 3);
    let found = solved(&graph);
    assert_eq!(found.noise, NoiseFactors::STATED);
}

/// Errors that persist, as those of a camera do, say less than their number. Overstated noise covers
/// that too.
#[test]
fn noise_is_not_lowered_where_errors_persist() {
    let graph = laps_with(3.0, None, 0.95, 5);
    let found = solved(&graph);
    assert_eq!(found.noise, NoiseFactors::STATED);
    assert!(
        found.fit.has_persisting_errors(),
        "{}",
        found.fit.correlation
    );
    let without = solved(&laps(3.0, None, 5));
    assert!(
        !without.fit.has_persisting_errors(),
        "{}",
        without.fit.correlation
    );
    assert!(without.noise.range < 0.5, "{:?}", without.noise);
}

#[test]
fn a_wrong_landmark_is_seen_in_the_fit() {
    let graph = laps(1.0, None, 1);
    let found = solved(&graph);
    let mut labels = found.map.labels.clone();
    let all = |labels: &[u32]| -> Fit { fit(&graph, &found.map.poses, labels) };
    assert!(!all(&labels).is_worse() && !all(&labels).has_heavy_tails());
    // A sighting of the third landmark is given to the first.
    let wrong = labels.iter().position(|&label| label == 2).expect("seen");
    labels[wrong] = 0;
    let broken = all(&labels);
    assert!(broken.has_heavy_tails());
    assert_eq!(
        broken.worst[0],
        crate::mission::Misfit::Sighting(wrong, broken.worst[0].square())
    );
}

#[test]
fn factors_act_along_and_across_the_line_of_sight() {
    let ahead = seen(0, [2.0, 0.0], [4.0, 0.0, 9.0]);
    let graph = Graph {
        observations: vec![ahead, seen(1, [0.0, 3.0], [4.0, 0.0, 9.0])],
        ..crowded()
    };
    let factors = NoiseFactors {
        range: 2.0,
        place: 4.0,
        heading: 5.0,
        ..NoiseFactors::STATED
    };
    let scaled = graph.with_noise(factors);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(scaled.observations[0].information, [1.0, 0.0, 9.0]));
    assert!(near(scaled.observations[1].information, [4.0, 0.0, 2.25]));
    let [before, after] = [&graph, &scaled].map(|one| one.odometry[0].information);
    assert!((before.m11 / 16.0 - after.m11).abs() < 1e-12);
    assert!((before.m33 / 25.0 - after.m33).abs() < 1e-12);
}

#[test]
fn maps_that_count_share_the_weight() {
    let graph = crowded();
    let settings = SolveSettings {
        sweeps: 0,
        is_calibrated: false,
        starts: 8,
        ..SolveSettings::with_seed(2)
    };
    let found = solve(&graph, settings, &|_| {}).expect("solved");
    let all: Vec<_> = std::iter::once(&found.map)
        .chain(&found.alternatives)
        .collect();
    let total: f64 = all.iter().map(|map| map.weight).sum();
    assert!((total - 1.0).abs() < 1e-12, "{total}");
    let known = |map: &crate::mission::SolvedMap| Topology::canonical(&map.labels);
    for pair in all.windows(2) {
        assert!(pair[0].ln_posterior >= pair[1].ln_posterior);
        assert_ne!(known(pair[0]), known(pair[1]));
        let apart = pair[0].ln_posterior - pair[1].ln_posterior;
        assert!(((pair[0].weight / pair[1].weight).ln() - apart).abs() < 1e-9);
    }
}
