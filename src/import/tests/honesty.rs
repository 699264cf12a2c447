//! Windows, and whether dead reckoning knows its own error.

use nalgebra::{Matrix2, Vector2};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::super::recording::{Increment, ORIGIN, Recording, Seen, Stop};
use super::super::{DriftNoise, Noise, SensorNoise, dead_reckon};
use crate::rng::{Purpose, WORLD_SEMANTICS};
use crate::sighting::{FrameDrift, Pose};
use crate::tracker::{TrackerSettings, track};

#[test]
fn a_window_starts_dead_reckoning_where_it_had_got_to() {
    let stop = |time_s: f64, x_m: f64| Stop {
        time_s,
        increment: Increment {
            relative: Pose { x_m, ..ORIGIN },
            covariance: None,
        },
        seen: vec![Seen {
            range_m: time_s + 1.0,
            bearing_rad: 0.0,
            stated: None,
            landmark: None,
        }],
    };
    let mut recording = Recording {
        start: Pose { y_m: 1.0, ..ORIGIN },
        stops: vec![
            stop(0.0, 0.0),
            stop(1.0, 2.0),
            stop(2.0, 3.0),
            stop(3.0, 4.0),
            stop(4.0, 5.0),
        ],
        truth: None,
        landmark_names: vec![],
        notes: vec![],
    };
    let whole = recording.clone();
    recording.keep_window(f64::NEG_INFINITY, f64::INFINITY);
    assert_eq!(recording, whole);
    recording.keep_window(2.0, 4.0);
    assert_eq!((recording.start.x_m, recording.start.y_m), (5.0, 1.0));
    assert_eq!(recording.stops.len(), 2);
    let sightings = dead_reckon(&recording, &NOISE);
    let drift = sightings[0].drift.expect("kept");
    assert_eq!(drift, FrameDrift::NONE);
    assert_eq!(sightings[1].believed_pose.x_m, 9.0);
    let mut thinned = whole.clone();
    thinned.thin(2, 4.0);
    let seen: Vec<usize> = thinned.stops.iter().map(|stop| stop.seen.len()).collect();
    assert_eq!(seen, [1, 0, 1, 0, 0]);
    recording.keep_window(9.0, 10.0);
    assert!(recording.stops.is_empty() && dead_reckon(&recording, &NOISE).is_empty());
}

pub(super) const NOISE: Noise = Noise {
    sensor: SensorNoise {
        range_m: 0.1,
        range_growth: 0.01,
        bearing_rad: 0.01,
    },
    drift: DriftNoise {
        position: 0.05,
        heading: 0.01,
        turn: 0.01,
        bend: 0.002,
    },
    factor: 1.0,
};

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Drives circles; what the odometry says is the true way with errors of `noise`. Landmarks are seen within
/// a distance, at the stops from `first` on.
pub(super) fn mission(
    noise: &Noise,
    n_stops: usize,
    first: usize,
    (points_m, max_range_m): (&[[f64; 2]], f64),
    rng: &mut impl Rng,
) -> Recording {
    let (mut pose, mut stops) = (ORIGIN, Vec::new());
    let bend = noise.drift.bend * normal(rng);
    for ix in 0..n_stops {
        let mut increment = Increment::NONE;
        if ix > 0 {
            let (driven_m, turned_rad) = (0.2, 0.02);
            let relative = Pose {
                x_m: driven_m,
                y_m: 0.0,
                heading_rad: turned_rad,
            };
            pose = pose.then(relative);
            let heading = libm::hypot(
                noise.drift.heading * f64::sqrt(driven_m),
                noise.drift.turn * f64::sqrt(turned_rad),
            );
            let position = noise.drift.position * f64::sqrt(driven_m);
            increment.relative = Pose {
                x_m: driven_m + position * normal(rng),
                y_m: position * normal(rng),
                heading_rad: turned_rad + heading * normal(rng) + bend * driven_m,
            };
        }
        let see = |(landmark, point_m): (i64, &[f64; 2])| {
            let (range_m, bearing_rad) = pose.range_and_bearing_to(*point_m);
            let std_m = noise.sensor.range_m + noise.sensor.range_growth * range_m;
            (range_m <= max_range_m).then(|| Seen {
                range_m: range_m + std_m * normal(rng),
                bearing_rad: bearing_rad + noise.sensor.bearing_rad * normal(rng),
                stated: None,
                landmark: Some(landmark),
            })
        };
        let seen: Vec<Seen> = (1..).zip(points_m).filter_map(see).collect();
        let seen = if ix >= first { seen } else { vec![] };
        stops.push(Stop {
            time_s: ix as f64 * 0.1,
            increment,
            seen,
        });
    }
    Recording {
        start: ORIGIN,
        stops,
        truth: None,
        landmark_names: vec![],
        notes: vec![],
    }
}

pub(super) const TRACKER: TrackerSettings = TrackerSettings {
    gate_probability: 0.999_999,
    group_timeout_s: 100.0,
    min_sightings: 1,
    odometry_noise: 0.0,
    heading_noise: 0.0,
    since_start: true,
};

/// Mean over missions of the normalised squared error against the true place in the start's frame.
fn mean_nees(noise: &Noise, n_stops: usize, first: usize, since_start: bool, seed: u64) -> f64 {
    let mut rng = Purpose::new(WORLD_SEMANTICS, seed).generator();
    let n = 1000;
    let point_m = [6.0, 14.0];
    let settings = TrackerSettings {
        since_start,
        ..TRACKER
    };
    let mut sum = 0.0;
    for _ in 0..n {
        let seen = (&[point_m][..], f64::INFINITY);
        let sightings = dead_reckon(&mission(noise, n_stops, first, seen, &mut rng), noise);
        let detections = track(&sightings, &settings).expect("one group");
        let row = detections.iter().next().expect("one group");
        let c = row.covariance_m2.expect("the tracker gives one");
        let inverse = Matrix2::new(c.xx, c.xy, c.xy, c.yy)
            .try_inverse()
            .expect("positive");
        let error = Vector2::from(row.position_m) - Vector2::from(point_m);
        sum += (error.transpose() * inverse * error)[0];
    }
    sum / f64::from(n)
}

#[test]
fn covariances_against_the_start_are_honest_whether_the_frame_drifts_before_or_while_a_group_is_seen()
 {
    // Chi-square with 2 degrees of freedom: the mean of 1,000 is 2 ± 0.063; four standard errors.
    for (n_stops, first, seed) in [(300, 290, 21), (300, 0, 22), (300, 150, 23)] {
        let mean = mean_nees(&NOISE, n_stops, first, true, seed);
        assert!(
            (mean - 2.0).abs() < 0.25,
            "first seen at stop {first}: {mean}"
        );
    }
    // In the frame of the last sighting the drift until then is not in it.
    let local = mean_nees(&NOISE, 300, 290, false, 24);
    assert!(local > 4.0, "{local}");
}

#[test]
fn a_group_that_lags_behind_the_drift_is_not_made_to_pay_for_it_twice() {
    // Poor sensors and a frame that runs away: the filter's mean is of where the landmark seemed to be,
    // so its error and the drift cancel in part. Random walk first, steady bend second. Steps are long
    // beside their noise, for the way driven is only known as believed.
    let sensor = SensorNoise {
        range_m: 1.0,
        range_growth: 0.0,
        bearing_rad: 0.08,
    };
    let still = DriftNoise {
        position: 0.0,
        heading: 0.0,
        turn: 0.0,
        bend: 0.0,
    };
    let walk = DriftNoise {
        position: 0.1,
        ..still
    };
    let bend = DriftNoise {
        position: 0.05,
        bend: 0.005,
        ..still
    };
    for (drift, seed) in [(walk, 25), (bend, 26)] {
        let noise = Noise {
            sensor,
            drift,
            factor: 1.0,
        };
        let mean = mean_nees(&noise, 40, 0, true, seed);
        assert!((mean - 2.0).abs() < 0.25, "{drift:?}: {mean}");
    }
}

#[test]
fn how_finely_a_way_is_cut_does_not_matter() {
    let straight = |n: usize| {
        let step = Stop {
            time_s: 0.0,
            increment: Increment {
                relative: Pose {
                    x_m: 8.0 / n as f64,
                    ..ORIGIN
                },
                covariance: None,
            },
            seen: vec![],
        };
        let mut stops = vec![step; n + 1];
        stops[n].seen.push(Seen {
            range_m: 1.0,
            bearing_rad: 0.0,
            stated: None,
            landmark: None,
        });
        let recording = Recording {
            start: ORIGIN,
            stops,
            truth: None,
            landmark_names: vec![],
            notes: vec![],
        };
        let drift = dead_reckon(&recording, &NOISE)[0].drift.expect("kept");
        drift.since(FrameDrift::NONE, [40.0, 3.0])
    };
    let (fine, coarse) = (straight(1000), straight(4));
    assert!(
        (fine.0 - coarse.0).norm() < 2e-3 * fine.0.norm(),
        "{} {}",
        fine.0,
        coarse.0
    );
    assert!((fine.1 - coarse.1).norm() < 1e-9);
}
