//! Detections of missions whose drift is known, aligned.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rand::{Rng, RngExt};

use super::super::dead_reckon;
use super::honesty::{NOISE, TRACKER, mission};
use crate::detections::{Covariance, Detection, Detections};
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::diagnostics::consistency::{Nees, errors_against, nees};
use crate::evidence::{Alignment, align};
use crate::partition::Topology;
use crate::rng::{Purpose, WORLD_SEMANTICS};
use crate::sighting::FrameDrift;
use crate::tracker::{TrackerSettings, track_in_full};

/// Landmarks about the circle of 10 m that missions drive, none nearer to another than 1.5 m.
fn landmarks(rng: &mut impl Rng) -> Vec<[f64; 2]> {
    let mut found: Vec<[f64; 2]> = Vec::new();
    while found.len() < 30 {
        let (radius, angle) = (rng.random_range(6.0..14.0), rng.random_range(0.0..TAU));
        let (sin, cos) = libm::sincos(angle);
        let point = [radius * cos, 10.0 + radius * sin];
        let is_near =
            |other: &[f64; 2]| libm::hypot(point[0] - other[0], point[1] - other[1]) < 1.5;
        if !found.iter().any(is_near) {
            found.push(point);
        }
    }
    found
}

struct Aligned {
    before: Nees,
    after: Nees,
    rand_index: f64,
    found: Alignment,
}

fn aligned(seed: u64) -> Aligned {
    let purpose = Purpose::new(WORLD_SEMANTICS, seed);
    let mut rng = purpose.generator();
    let points = landmarks(&mut rng);
    let recording = mission(&NOISE, 550, 0, (&points, 4.0), &mut rng);
    let settings = TrackerSettings {
        group_timeout_s: 2.0,
        min_sightings: 5,
        ..TRACKER
    };
    let tracked = track_in_full(&dead_reckon(&recording, &NOISE), &settings);
    let tracked = tracked.expect("groups");
    let detections = tracked.detections;
    let drifts = tracked.drifts.expect("dead reckoning keeps account");
    let found = align(&detections, &drifts, &purpose).expect("enough detections");
    let places: BTreeMap<i64, [f64; 2]> = (1..).zip(points).collect();
    let of = |detections: &Detections| nees(&errors_against(detections, &places)).expect("truth");
    let truth: Vec<u32> = detections
        .truth()
        .iter()
        .map(|l| l.unwrap_or(0) as u32)
        .collect();
    let (truth, labels) = (
        Topology::canonical(&truth),
        Topology::canonical(&found.labels),
    );
    Aligned {
        before: of(&detections),
        after: of(&found.detections),
        rand_index: adjusted_rand_index(&truth, &labels).expect("several"),
        found,
    }
}

/// A first-order correction has a mean of 10 here, and covariances without what is unknown of the drift one of 60.
#[test]
fn errors_shrink_and_covariances_stay_honest() {
    let all: Vec<Aligned> = (0..6).map(aligned).collect();
    // The third mission has drifted twice as far as its odometry claims, and chains say that they do not agree.
    let is_good = |mission: &&Aligned| mission.found.doubts.is_empty();
    let good: Vec<&Aligned> = all.iter().filter(is_good).collect();
    assert!(good.len() >= 4, "{} of 6", good.len());
    assert!(!is_good(&&all[2]));
    let mean =
        |of: fn(&Aligned) -> f64| good.iter().map(|m| of(m)).sum::<f64>() / good.len() as f64;
    for mission in &good {
        assert!(mission.rand_index > 0.97, "{}", mission.rand_index);
        assert!(mission.found.expected_rand_index > 0.95);
    }
    let [before, after] = [mean(|m| m.before.rms_m), mean(|m| m.after.rms_m)];
    assert!(after < 0.5 * before, "{before} m, then {after} m");
    // Errors of a mission share what is left of its drift: its mean NEES, 2 if honest, scatters by 1.6.
    let nees = mean(|m| m.after.mean);
    assert!((0.5..4.5).contains(&nees), "{nees}");
}

#[test]
fn what_cannot_be_aligned_is_refused() {
    let purpose = Purpose::new(WORLD_SEMANTICS, 1);
    let row = |x: f64| Detection {
        covariance_m2: Some(Covariance {
            xx: 1.0,
            xy: 0.0,
            yy: 1.0,
        }),
        ..Detection::at(x, 0.0)
    };
    let said = |rows: Vec<Detection>, drift: FrameDrift| {
        let drifts = vec![drift; rows.len()];
        let detections = Detections::new(rows).expect("good");
        let refused = align(&detections, &drifts, &purpose);
        refused.map(|_| ()).expect_err("refused").to_string()
    };
    let few = said(vec![row(0.0), row(1.0)], FrameDrift::NONE);
    assert!(
        few.starts_with("got 2, expected at least 4 detections"),
        "{few}"
    );
    let one = said(vec![row(1.0); 5], FrameDrift::NONE);
    assert!(one.starts_with("got 5 detections at one place"), "{one}");
    let bare = (0..4).map(|i| Detection::at(f64::from(i), 0.0));
    let bare = said(bare.collect(), FrameDrift::NONE);
    assert!(
        bare.starts_with("got detections without covariances"),
        "{bare}"
    );
    let mut far = FrameDrift::NONE;
    far.random.fill_diagonal(1e-3);
    let far = said((0..4).map(|i| row(1e200 * f64::from(i))).collect(), far);
    assert!(far.contains("numbers overflow"), "{far}");
    let mut large = FrameDrift::NONE;
    large.random.fill_diagonal(1e14);
    let large = said((0..4).map(|i| row(f64::from(i))).collect(), large);
    assert!(
        large.starts_with("got ") && large.contains("m of drift against 0.050 m"),
        "{large}"
    );
}

#[test]
fn without_drift_nothing_moves() {
    let mut rng = Purpose::new(WORLD_SEMANTICS, 5).generator();
    let rows: Vec<Detection> = (0..12)
        .map(|i| Detection {
            covariance_m2: Some(Covariance {
                xx: 0.04,
                xy: 0.0,
                yy: 0.04,
            }),
            ..Detection::at(
                5.0 * f64::from(i % 4) + rng.random_range(-0.2..0.2),
                f64::from(i % 4),
            )
        })
        .collect();
    let detections = Detections::new(rows).expect("good");
    let found = align(
        &detections,
        &[FrameDrift::NONE; 12],
        &Purpose::new(WORLD_SEMANTICS, 1),
    );
    let found = found.expect("twelve detections");
    // But for rounding: places are taken from their middle.
    assert!(found.moved_m < 1e-12, "{}", found.moved_m);
    assert_eq!((found.drift_left_m, found.n_sets), (0.0, 4));
}
