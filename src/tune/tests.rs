//! Tests of what `tune` recommends.

use super::*;
use crate::detections::Covariance;
use crate::detections::Detection;
use rand_distr::{Distribution, StandardNormal};

fn request(simulate: bool, seed: u64) -> Request {
    Request {
        model: ModelKind::Metric,
        sensor_noise_m: None,
        simulate,
        seed,
    }
}

/// Rounds over a grid of landmarks, a step apart, with noise; two landmarks are in view at once.
fn rounds(n_rounds: usize, step_m: f64, noise_m: f64, timed: bool, seed: u64) -> Detections {
    let mut rng = Purpose::new("test", seed).generator();
    let rows = (0..n_rounds * 9).map(|i| {
        let (k, t) = (i % 9, i as f64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let [x, y] = [k % 3, k / 3].map(|v| step_m * v as f64 + noise_m * normal());
        Detection {
            first_seen_s: timed.then_some(t),
            last_seen_s: timed.then_some(t + 1.5),
            ..Detection::at(x, y)
        }
    });
    Detections::new(rows.collect()).expect("good")
}

#[test]
fn settings_follow_the_noise_and_the_routes_agree() {
    for timed in [false, true] {
        let found = tune(&rounds(4, 30.0, 0.5, timed, 1), &request(true, 1)).expect("enough");
        // 54 degrees of freedom: s is known to 10 %.
        assert!((found.noise.value - 0.5).abs() < 0.15, "{:?}", found.noise);
        assert!(
            (9.0..=10.0).contains(&found.n_landmarks.value),
            "{:?}",
            found.n_landmarks
        );
        assert_eq!(found.settings.sigma_o, rule::SIGMA_O * found.noise.value);
        assert!(found.doubts.is_empty(), "{:?}", found.doubts);
        let simulated = found.simulated.expect("asked for");
        assert!(simulated.recommended.mean_rand_index > 0.9);
        let radius = found.intervals[2];
        let (low, high) = (
            radius.low.expect("a spread"),
            radius.high.expect("a spread"),
        );
        assert!(low <= found.settings.penalty_radius);
        assert!(high >= found.settings.penalty_radius && high < 2.0 * low);
        assert!(found.decided);
    }
}

/// Nothing else is in doubt, so the noise of the second route decides alone.
#[test]
fn routes_that_differ_threefold_in_the_noise_do_not_decide() {
    let found = tune(&rounds(4, 30.0, 0.5, false, 1), &request(true, 1)).expect("enough");
    assert!(found.decided && found.doubts.is_empty());
    // The same with another noise of the second route.
    let with = |factor: f64| {
        let mut other = found.clone();
        let simulated = other.simulated.as_mut().expect("asked for");
        simulated.noise.value = factor * other.noise.value;
        doubts(&other, 0.0)
    };
    for factor in [0.5, 1.0, 2.9] {
        assert!(with(factor).is_empty(), "{factor}");
    }
    for factor in [13.0, 3.01, 1.0 / 3.01, 0.05] {
        let said = with(factor);
        assert_eq!(said.len(), 1, "{factor}");
        let numbers = [found.noise.value, factor * found.noise.value];
        for number in numbers {
            assert!(said[0].contains(&format!("{number:.3} m")), "{said:?}");
        }
        assert!(said[0].contains("--sensor-noise"), "{said:?}");
    }
}

#[test]
fn no_interval_has_a_width_of_zero() {
    let same = Estimated::of(vec![128.898, 128.898 + 1e-13, 128.898]);
    assert_eq!((same.low, same.high), (None, None));
    let found = tune(&rounds(4, 10.0, 1.5, false, 6), &request(true, 1)).expect("enough");
    let simulated = found.simulated.as_ref().expect("asked for");
    let all = found.intervals.iter().chain([
        &found.noise,
        &found.n_landmarks,
        &simulated.noise,
        &simulated.n_landmarks,
    ]);
    for own in all {
        assert_eq!(own.low.is_some(), own.high.is_some());
        if let (Some(low), Some(high)) = (own.low, own.high) {
            assert!(
                low < high && low <= own.value && own.value <= high,
                "{own:?}"
            );
        }
    }
}

#[test]
fn it_says_so_when_the_data_cannot_decide() {
    // Noise as large as the distance between landmarks, two visits, no times.
    let hopeless = tune(&rounds(2, 10.0, 8.0, false, 2), &request(true, 1)).expect("enough");
    assert!(!hopeless.doubts.is_empty());
    // Nothing is seen twice.
    let once = tune(&rounds(1, 10.0, 0.5, false, 3), &request(false, 1)).expect("enough");
    assert!(!once.doubts.is_empty(), "{once:?}");
}

#[test]
fn truth_is_not_looked_at_and_the_same_seed_gives_the_same() {
    let bare = rounds(3, 10.0, 0.7, true, 4);
    let told = bare.iter().enumerate().map(|(i, row)| Detection {
        landmark: Some(i as i64),
        ..row.clone()
    });
    let told = Detections::new(told.collect()).expect("good");
    let [a, b] = [&bare, &told].map(|d| tune(d, &request(false, 7)).expect("enough"));
    assert_eq!(
        serde_json::to_string(&a).ok(),
        serde_json::to_string(&b).ok()
    );
    let least = Request {
        sensor_noise_m: Some(2.0),
        ..request(false, 7)
    };
    let bounded = tune(&bare, &least).expect("enough");
    let low = bounded.noise.low.unwrap_or(bounded.noise.value);
    assert!(low >= 2.0 * 0.999);
}

#[test]
fn the_covariance_model_learns_by_what_factor_covariances_are_wrong() {
    // Each states a third of its true standard deviation.
    let bare = rounds(4, 30.0, 1.0, true, 5);
    let rows = bare.iter().map(|row| Detection {
        covariance_m2: Some(Covariance {
            xx: 1.0 / 9.0,
            xy: 0.0,
            yy: 1.0 / 9.0,
        }),
        ..row.clone()
    });
    let stated = Detections::new(rows.collect()).expect("good");
    let wanted = Request {
        model: ModelKind::Covariance,
        ..request(true, 1)
    };
    let found = tune(&stated, &wanted).expect("enough");
    assert!((found.noise.value - 3.0).abs() < 0.9, "{:?}", found.noise);
    assert!(found.doubts.is_empty(), "{:?}", found.doubts);
    assert!(found.expected_rand_index > 0.95);
    // The radius is in standard deviations as stated: the two models merge the same pairs.
    let metric = tune(&bare, &request(false, 1)).expect("enough");
    let ratio = found.merge / 3.0 / metric.merge;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
    let text = tune(&bare, &wanted)
        .expect_err("no covariances")
        .to_string();
    assert!(
        text.starts_with("tune: got detections without covariances"),
        "{text}"
    );
    assert!(!text.contains('\n'));
}

#[test]
fn too_little_is_refused() {
    let rows = vec![Detection::at(1.0, 1.0); 5];
    let heap = Detections::new(rows).expect("good");
    let text = tune(&heap, &request(false, 1))
        .expect_err("one place")
        .to_string();
    assert_eq!(
        text,
        "tune: got 5 detections, expected at least 4 at different places; bring more of them"
    );
}
