//! The panoramic camera: what one scan sees, with noise, misses and false sightings.
//!
//! Every corner in line of sight of the *true* pose and within `max_range` is seen unless missed.
//! Its range gains N(0, σ_r²) with σ_r = a + b·range at the true range, its bearing N(0, σ_β²); the
//! sighting states these standard deviations and is tied to the *believed* pose. A range that noise
//! makes zero or negative is no sighting. False sightings come in Poisson numbers, at a uniform
//! bearing and a uniform range up to the wall, and look open or closed with equal probability.

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Poisson, StandardNormal};

use super::{SimulationSettings, World};
use crate::detections::Corner;
use crate::sighting::{Pose, Sighting, wrap_rad};

/// One scan, from left to right in the panorama (by bearing from −π to π).
pub(super) fn scan(
    world: &World,
    settings: &SimulationSettings,
    time_s: f64,
    believed_pose: Pose,
    true_pose: Pose,
    rng: &mut impl Rng,
) -> Vec<Sighting> {
    let mut sightings = Vec::new();
    let bearing_std_rad = settings.scaled_bearing_std_rad();
    for corner in world.visible_corners(true_pose.position_m(), settings.max_range) {
        // All draws are made whatever the outcome, so that a rate of 0 and of 1e-9 agree.
        let is_missed = rng.random::<f64>() < settings.missed_rate;
        let [range_normal, bearing_normal]: [f64; 2] =
            std::array::from_fn(|_| StandardNormal.sample(rng));
        let position_m = world.corners()[corner.landmark].position_m;
        let (range_m, bearing_rad) = true_pose.range_and_bearing_to(position_m);
        let range_std_m = settings.scaled_range_std_m(range_m);
        sightings.push((!is_missed).then_some(Sighting {
            time_s,
            believed_pose,
            range_m: range_m + range_std_m * range_normal,
            bearing_rad: wrap_rad(bearing_rad + bearing_std_rad * bearing_normal),
            range_std_m,
            bearing_std_rad,
            correlation: 0.0,
            drift: None,
            corner: Some(corner.kind),
            landmark: Some(corner.landmark as i64),
        }));
    }
    if settings.false_rate > 0.0 && world.is_free(true_pose.position_m()) {
        let law = Poisson::new(settings.false_rate).expect("a checked rate above 0");
        for _ in 0..law.sample(rng) as usize {
            let bearing_rad = rng.random_range(-PI..PI);
            let wall_m = world
                .free_range_m(true_pose.position_m(), true_pose.heading_rad + bearing_rad)
                .min(settings.max_range);
            let range_m = wall_m * rng.random::<f64>();
            let is_open: bool = rng.random();
            sightings.push(Some(Sighting {
                time_s,
                believed_pose,
                range_m,
                bearing_rad,
                range_std_m: settings.scaled_range_std_m(range_m),
                bearing_std_rad,
                correlation: 0.0,
                drift: None,
                corner: Some(if is_open {
                    Corner::Open
                } else {
                    Corner::Closed
                }),
                landmark: None,
            }));
        }
    }
    let mut sightings: Vec<Sighting> = sightings
        .into_iter()
        .flatten()
        .filter(|sighting| sighting.range_m > 0.0)
        .collect();
    sightings.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
    sightings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Generator, Purpose, WORLD_SEMANTICS};

    const POSE: Pose = Pose {
        x_m: 0.0,
        y_m: 0.0,
        heading_rad: 0.5,
    };
    const N_SCANS: usize = 4000;

    fn scans(settings: &SimulationSettings, seed: u64) -> Vec<Vec<Sighting>> {
        let world = World::built_in("square-ring").expect("built in");
        let mut rng: Generator = Purpose::new(WORLD_SEMANTICS, seed).generator();
        (0..N_SCANS)
            .map(|k| scan(&world, settings, k as f64, POSE, POSE, &mut rng))
            .collect()
    }

    #[test]
    fn corners_are_missed_at_the_stated_rate() {
        let settings = SimulationSettings {
            missed_rate: 0.3,
            false_rate: 0.0,
            ..Default::default()
        };
        let n_seen: usize = scans(&settings, 1).iter().map(Vec::len).sum();
        // Six corners are in sight: binomial, four standard deviations.
        let n = 6.0 * N_SCANS as f64;
        let share = n_seen as f64 / n;
        assert!((share - 0.7).abs() < 4.0 * (0.21 / n).sqrt(), "{share}");
    }

    #[test]
    fn false_sightings_are_poisson_and_lie_before_the_walls() {
        let settings = SimulationSettings {
            missed_rate: 0.0,
            false_rate: 1.5,
            ..Default::default()
        };
        let numbers: Vec<f64> = scans(&settings, 2)
            .iter()
            .map(|scan| {
                let false_: Vec<_> = scan.iter().filter(|s| s.landmark.is_none()).collect();
                let world = World::built_in("square-ring").expect("built in");
                assert!(false_.iter().all(|s| world.is_free(s.point_m())));
                false_.len() as f64
            })
            .collect();
        let n = N_SCANS as f64;
        let mean = numbers.iter().sum::<f64>() / n;
        let variance = numbers.iter().map(|k| (k - mean).powi(2)).sum::<f64>() / n;
        // Mean and variance are both 1.5; standard errors √(1.5/n) and √((1.5 + 2·1.5²)/n).
        assert!((mean - 1.5).abs() < 4.0 * (1.5 / n).sqrt(), "{mean}");
        assert!(
            (variance - 1.5).abs() < 4.0 * (6.0 / n).sqrt(),
            "{variance}"
        );
    }

    #[test]
    fn noise_has_the_stated_standard_deviations() {
        let settings = SimulationSettings {
            missed_rate: 0.0,
            false_rate: 0.0,
            noise: 0.5,
            ..Default::default()
        };
        let (range_m, bearing_rad) = POSE.range_and_bearing_to([45.0, -10.0]);
        let (mut range2, mut bearing2, mut n) = (0.0, 0.0, 0.0);
        for sighting in scans(&settings, 3)
            .iter()
            .flatten()
            .filter(|s| s.landmark == Some(1))
        {
            assert!((sighting.range_std_m - 0.5 * (0.5 + 0.06 * range_m)).abs() < 1e-12);
            assert_eq!(sighting.bearing_std_rad, 0.0075);
            range2 += ((sighting.range_m - range_m) / sighting.range_std_m).powi(2);
            bearing2 += (wrap_rad(sighting.bearing_rad - bearing_rad) / 0.0075).powi(2);
            n += 1.0;
        }
        // A mean square of n standard normals is 1 with standard deviation √(2/n); four of them.
        assert_eq!(n, N_SCANS as f64);
        for mean in [range2 / n, bearing2 / n] {
            assert!((mean - 1.0).abs() < 4.0 * f64::sqrt(2.0 / n), "{mean}");
        }
    }

    #[test]
    fn a_scan_runs_from_left_to_right() {
        let settings = SimulationSettings {
            false_rate: 2.0,
            ..Default::default()
        };
        assert!(
            scans(&settings, 4)
                .iter()
                .all(|scan| scan.is_sorted_by(|a, b| a.bearing_rad <= b.bearing_rad))
        );
    }
}
