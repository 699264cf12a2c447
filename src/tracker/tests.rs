//! Gate, update and time-out of groups of sightings.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::detections::Corner;
use crate::rng::{Purpose, WORLD_SEMANTICS};
use crate::sighting::Pose;

const SETTINGS: TrackerSettings = TrackerSettings {
    gate_probability: 0.99,
    group_timeout_s: 10.0,
    min_sightings: 3,
    odometry_noise: 0.0,
    heading_noise: 0.0,
    since_start: true,
};

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A sighting of `point` from (t, 0) at time t, looking north-east.
fn sighting(time_s: f64, point_m: [f64; 2], landmark: Option<i64>) -> Sighting {
    let believed_pose = Pose {
        x_m: time_s,
        y_m: 0.0,
        heading_rad: 0.8,
    };
    let (range_m, bearing_rad) = believed_pose.range_and_bearing_to(point_m);
    Sighting {
        time_s,
        believed_pose,
        range_m,
        bearing_rad,
        range_std_m: 0.3 + 0.03 * range_m,
        bearing_std_rad: 0.01,
        correlation: 0.0,
        drift: None,
        corner: Some(Corner::Closed),
        landmark,
    }
}

fn with_noise(mut sighting: Sighting, rng: &mut impl Rng) -> Sighting {
    sighting.range_m += sighting.range_std_m * normal(rng);
    sighting.bearing_rad += sighting.bearing_std_rad * normal(rng);
    sighting
}

#[test]
fn the_gate_is_the_chi_square_quantile() {
    // R 4.3: qchisq(c(.5, .99, .999), 2).
    for (p, expected) in [(0.5, 1.386294), (0.99, 9.210340), (0.999, 13.815511)] {
        assert!((gate_squared_distance(p) - expected).abs() < 1e-6);
    }
}

#[test]
fn the_filter_is_consistent_and_the_gate_rejects_its_share() {
    // No drift, right association: the normalised estimation error squared of a consistent filter
    // is chi-square with 2 degrees of freedom (mean 2, variance 4) at the end of each replicate,
    // and every innovation passes the gate with probability p, independently of the others.
    let mut rng = Purpose::new(WORLD_SEMANTICS, 11).generator();
    let (n_replicates, n_scans) = (1000, 40);
    let threshold = gate_squared_distance(0.99);
    let (mut sum_nees, mut n_rejected) = (0.0, 0.0);
    for _ in 0..n_replicates {
        let truth = [rng.random_range(-20.0..40.0), rng.random_range(8.0..40.0)];
        let mut group = None;
        for scan in 0..n_scans {
            let sighting = with_noise(sighting(f64::from(scan) * 0.5, truth, Some(1)), &mut rng);
            let Some(group) = &mut group else {
                group = Some(Group::open(&sighting, 0.0));
                continue;
            };
            let innovation = group
                .innovation(&sighting, 0.0, &SETTINGS)
                .expect("not at the group");
            n_rejected += f64::from(innovation.squared_distance > threshold);
            group.update(&sighting, &innovation, 0.0);
        }
        let group = group.expect("there were scans");
        let error = group.mean_m - nalgebra::Vector2::from(truth);
        let inverse = group
            .covariance_m2(true)
            .try_inverse()
            .expect("positive definite");
        sum_nees += (error.transpose() * inverse * error)[0];
    }
    let n = f64::from(n_replicates);
    // Four standard errors of the mean of n such variables: 2 ± 4·√(4/n) = 2 ± 0.25.
    let mean_nees = sum_nees / n;
    assert!(
        (mean_nees - 2.0).abs() < 4.0 * f64::sqrt(4.0 / n),
        "{mean_nees}"
    );
    let n_innovations = n * f64::from(n_scans - 1);
    let share = n_rejected / n_innovations;
    assert!(
        (share - 0.01).abs() < 4.0 * f64::sqrt(0.01 * 0.99 / n_innovations),
        "{share}"
    );
}

#[test]
fn with_drift_the_filter_stays_near_where_the_landmark_now_seems_to_be() {
    // The true pose does a random walk about the believed one; what the group estimates is where
    // the landmark lies in the believed frame at the last scan.
    let settings = TrackerSettings {
        odometry_noise: 0.2,
        ..SETTINGS
    };
    let mut rng = Purpose::new(WORLD_SEMANTICS, 12).generator();
    let n = 1000;
    let mut sum_nees = 0.0;
    for _ in 0..n {
        let (mut seems, mut group): ([f64; 2], Option<Group>) = ([10.0, 20.0], None);
        for scan in 0..60 {
            let odometer_m = f64::from(scan) * 0.5;
            if scan > 0 {
                seems = seems.map(|v| v + 0.2 * f64::sqrt(0.5) * normal(&mut rng));
            }
            let sighting = with_noise(sighting(odometer_m, seems, None), &mut rng);
            let Some(group) = &mut group else {
                group = Some(Group::open(&sighting, odometer_m));
                continue;
            };
            let innovation = group
                .innovation(&sighting, odometer_m, &settings)
                .expect("apart");
            group.update(&sighting, &innovation, odometer_m);
        }
        let group = group.expect("there were scans");
        let error = group.mean_m - nalgebra::Vector2::from(seems);
        let inverse = group
            .covariance_m2(true)
            .try_inverse()
            .expect("positive definite");
        sum_nees += (error.transpose() * inverse * error)[0];
    }
    let mean_nees = sum_nees / f64::from(n);
    assert!(
        (mean_nees - 2.0).abs() < 4.0 * f64::sqrt(4.0 / f64::from(n)),
        "{mean_nees}"
    );
}

#[test]
fn a_later_visit_is_another_detection_and_order_is_that_of_first_sighting() {
    let (a, b) = ([0.0, 20.0], [30.0, 20.0]);
    let mut sightings = Vec::new();
    for t in [5.0, 6.0, 7.0, 17.0, 28.0, 29.0, 30.0] {
        sightings.push(sighting(t, a, Some(0)));
    }
    for t in [4.0, 5.0, 6.0] {
        sightings.push(sighting(t, b, Some(1)));
    }
    let detections = track(&sightings, &SETTINGS).expect("three groups");
    // 7 → 17 s is within the time-out of 10 s, 17 → 28 s is not.
    assert_eq!(detections.truth(), [Some(1), Some(0), Some(0)]);
    let times: Vec<_> = detections
        .iter()
        .map(|d| (d.first_seen_s, d.last_seen_s))
        .collect();
    assert_eq!(times[0], (Some(4.0), Some(6.0)));
    assert_eq!(times[1], (Some(5.0), Some(17.0)));
    assert_eq!(times[2], (Some(28.0), Some(30.0)));
    assert!(detections.iter().all(|d| d.corner == Some(Corner::Closed)));
}

#[test]
fn a_group_takes_one_sighting_of_a_scan_and_small_groups_are_dropped() {
    let truth = [0.0, 20.0];
    let mut sightings = Vec::new();
    for t in [0.0, 0.5, 1.0, 1.5] {
        sightings.push(sighting(t, truth, Some(0)));
    }
    // Two more in the last scan, one a little off: it opens a group that stays too small.
    sightings.push(sighting(1.5, [0.1, 20.1], None));
    let detections = track(&sightings, &SETTINGS).expect("one group");
    assert_eq!(detections.len(), 1);
    let position = detections.positions_m()[0];
    assert!(
        (position[0] - truth[0]).hypot(position[1] - truth[1]) < 1e-9,
        "{position:?}"
    );
    let kept = TrackerSettings {
        min_sightings: 1,
        ..SETTINGS
    };
    assert_eq!(
        track(&sightings, &kept).expect("two groups").truth(),
        [Some(0), None]
    );
}

#[test]
fn a_group_has_the_drift_of_its_mean_and_of_the_mean_of_earlier_times() {
    // So little drift that four sightings weigh alike but for their ranges, growing evenly: about Σ min(k, l)/16 = 0.875 and Σ k/4 = 1.5.
    let mut sightings: Vec<Sighting> = (0..4)
        .map(|k| sighting(f64::from(k), [0.0, 20.0], Some(0)))
        .collect();
    for (seen, k) in sightings.iter_mut().zip([0.0, 1.0, 2.0, 3.0]) {
        let mut drift = FrameDrift::NONE;
        drift.random.fill_diagonal(1e-12 * k);
        drift.steady[0] = 1e-9 * k;
        seen.drift = Some(drift);
    }
    // One more, alone, that no group of three takes.
    sightings.push(sighting(3.0, [40.0, 0.0], None));
    let tracked = track_in_full(&sightings, &SETTINGS).expect("one group");
    assert_eq!(
        tracked.detection_of,
        [Some(0), Some(0), Some(0), Some(0), None]
    );
    let drift = tracked.drifts.expect("kept")[0];
    assert!(
        (drift.random[(0, 0)] / 1e-12 - 0.875).abs() < 0.01,
        "{}",
        drift.random
    );
    assert!(
        (drift.steady[0] / 1e-9 - 1.5).abs() < 0.01,
        "{}",
        drift.steady
    );
}

#[test]
fn truth_and_kind_are_those_of_the_majority() {
    let of = |landmarks: &[Option<i64>], n_open: usize| {
        let sightings: Vec<Sighting> = landmarks
            .iter()
            .enumerate()
            .map(|(k, landmark)| Sighting {
                corner: Some(if k < n_open {
                    Corner::Open
                } else {
                    Corner::Closed
                }),
                ..sighting(k as f64, [0.0, 20.0], *landmark)
            })
            .collect();
        let detections = track(&sightings, &SETTINGS).expect("one group");
        let detection = detections.iter().next().expect("one group").clone();
        (detection.landmark, detection.corner)
    };
    assert_eq!(
        of(&[Some(1), Some(2), Some(2)], 1),
        (Some(2), Some(Corner::Closed))
    );
    assert_eq!(of(&[Some(1), Some(1), Some(2), None], 2), (None, None));
    assert_eq!(of(&[None, None, Some(2)], 3), (None, Some(Corner::Open)));
}

#[test]
fn perfect_sightings_give_a_floored_but_proper_covariance() {
    let exact = |t: f64| Sighting {
        range_std_m: 0.0,
        bearing_std_rad: 0.0,
        ..sighting(t, [3.0, 1.0], Some(0))
    };
    let sightings: Vec<Sighting> = (0..10_000).map(|k| exact(f64::from(k) * 1e-3)).collect();
    let detections = track(&sightings, &SETTINGS).expect("one group");
    assert_eq!(detections.len(), 1);
    let c = detections.covariances_m2().expect("the tracker gives them")[0];
    let smallest = (c.xx + c.yy) / 2.0 - ((c.xx - c.yy) / 2.0).hypot(c.xy);
    assert!(
        (smallest / MIN_VARIANCE_M2 - 1.0).abs() < 1e-6,
        "{smallest}"
    );
}

#[test]
fn what_cannot_be_tracked_is_refused_in_one_line() {
    assert_eq!(
        track(&[], &SETTINGS).expect_err("nothing").to_string(),
        "tracker: got no group of at least 3 sightings out of 0 sightings, expected at least one; \
         lower min_sightings, or raise max_range or laps"
    );
    let bad = Sighting {
        range_m: f64::NAN,
        ..sighting(0.0, [0.0, 20.0], None)
    };
    assert_eq!(
        track(&[bad], &SETTINGS).expect_err("NaN").to_string(),
        "tracker, sighting 1: got NaN as its range, expected a finite number; correct the recording"
    );
}

#[test]
fn a_gate_grows_with_the_distance_driven_and_with_the_heading() {
    // The robot stands still for the second sighting, only its odometer has run: S = H·P·Hᵀ + R with
    // P from one sighting of the same R, so S = 2R + what the drift adds along and across the sight.
    let settings = TrackerSettings {
        odometry_noise: 0.3,
        heading_noise: 0.05,
        ..SETTINGS
    };
    let first = sighting(0.0, [12.0, 16.0], None);
    let group = Group::open(&first, 2.0);
    let (driven_m, range_m) = (3.0, 20.0);
    let shifted = |range_m: f64, bearing_rad: f64| Sighting {
        range_m: first.range_m + range_m,
        bearing_rad: first.bearing_rad + bearing_rad,
        ..first
    };
    let squared = |sighting: &Sighting| {
        let innovation = group.innovation(sighting, 2.0 + driven_m, &settings);
        innovation.expect("apart").squared_distance
    };
    let along = 2.0 * first.range_std_m.powi(2) + 0.09 * driven_m;
    assert!((squared(&shifted(1.5, 0.0)) - 1.5 * 1.5 / along).abs() < 1e-9);
    let across = 2.0 * 0.01_f64.powi(2)
        + 0.09 * driven_m / (range_m * range_m)
        + 0.05_f64.powi(2) * driven_m;
    assert!((squared(&shifted(0.0, 0.2)) - 0.04 / across).abs() < 1e-9);
}

#[test]
fn a_confirmed_group_chooses_before_a_tentative_one_that_is_nearer() {
    let truth = [0.0, 20.0];
    let mut sightings: Vec<Sighting> = [0.0, 0.5, 1.0, 1.5]
        .map(|t| sighting(t, truth, Some(0)))
        .into();
    let away = |time_s: f64, range_m: f64, landmark| {
        let at = sighting(time_s, truth, landmark);
        Sighting {
            range_m: at.range_m + range_m,
            ..at
        }
    };
    // Beyond the gate, so a group of its own; the next is nearer to that one, but within the gate of
    // the first; the last two are where the second is.
    sightings.push(away(2.0, 3.6, Some(1)));
    sightings.push(away(2.5, 2.2, Some(0)));
    let kept = TrackerSettings {
        min_sightings: 2,
        ..SETTINGS
    };
    let detections = track(&sightings, &kept).expect("one group");
    let seen: Vec<_> = detections.iter().map(|d| d.last_seen_s).collect();
    assert_eq!(seen, [Some(2.5)]);
    // Of two confirmed groups the nearer one chooses.
    sightings.insert(5, away(2.25, 3.6, Some(1)));
    let detections = track(&sightings, &kept).expect("two groups");
    let seen: Vec<_> = detections.iter().map(|d| d.last_seen_s).collect();
    assert_eq!(seen, [Some(1.5), Some(2.5)]);
}

#[test]
fn a_sighting_turned_by_most_of_a_turn_is_near() {
    // Bearings across ±π: an innovation that is not wrapped would be 2π − 0.02.
    let believed_pose = Pose {
        x_m: 0.0,
        y_m: 0.0,
        heading_rad: 0.0,
    };
    let at = |bearing_rad: f64| Sighting {
        believed_pose,
        range_m: 10.0,
        bearing_rad,
        ..sighting(0.0, [0.0, 20.0], None)
    };
    let group = Group::open(&at(std::f64::consts::PI - 0.01), 0.0);
    let innovation = group.innovation(&at(0.01 - std::f64::consts::PI), 0.0, &SETTINGS);
    let expected = 0.02_f64.powi(2) / (2.0 * 0.01_f64.powi(2));
    assert!((innovation.expect("apart").squared_distance - expected).abs() < 1e-9);
}
