//! A whole mission: drive, look, track.

use rand::Rng;

use super::camera::scan;
use super::drive::{drive, n_scans};
use super::{SettingsError, SimulationSettings, World};
use crate::detections::Detections;
use crate::sighting::{Pose, Sighting};
use crate::tracker::{TrackerError, track};

/// What a mission gave. The paths have one pose per scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// What the samplers work on.
    pub detections: Detections,
    /// When each scan was, s.
    pub times_s: Vec<f64>,
    /// Where the robot believed to be.
    pub believed_path: Vec<Pose>,
    /// Where it was.
    pub true_path: Vec<Pose>,
    /// All sightings in the order of time, false ones included.
    pub sightings: Vec<Sighting>,
}

/// Why a mission gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// A setting is out of range.
    #[error("simulation, {0}")]
    Settings(#[from] SettingsError),
    /// The drive is too long to be meant.
    #[error(
        "simulation: got {n_scans} scans from laps, speed_m_per_s and sighting_interval_s, expected \
         at most {MAX_SCANS}; lower laps or raise sighting_interval_s"
    )]
    TooLong {
        /// The number of scans asked for.
        n_scans: f64,
    },
    /// The tracker kept nothing.
    #[error("simulation, {0}")]
    Tracker(#[from] TrackerError),
}

/// A drive of months at one scan a second; sightings would fill the memory before that.
const MAX_SCANS: f64 = 1e7;

/// Simulates one mission. The same generator state gives the same mission.
pub fn simulate(
    world: &World,
    settings: &SimulationSettings,
    rng: &mut impl Rng,
) -> Result<Simulation, SimulationError> {
    settings.check()?;
    let n_scans = n_scans(world, settings);
    if n_scans > MAX_SCANS {
        return Err(SimulationError::TooLong { n_scans });
    }
    let path = drive(world, settings, rng);
    let mut sightings = Vec::new();
    for ((time_s, believed), true_) in path.times_s.iter().zip(&path.believed).zip(&path.true_) {
        sightings.extend(scan(world, settings, *time_s, *believed, *true_, rng));
    }
    let detections = track(&sightings, &settings.tracker())?;
    Ok(Simulation {
        detections,
        times_s: path.times_s,
        believed_path: path.believed,
        true_path: path.true_,
        sightings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::world_purpose;

    fn run(name: &str, settings: &SimulationSettings, replicate: u64) -> Simulation {
        let world = World::built_in(name).expect("built in");
        let mut rng = world_purpose(1, &world, settings, replicate).generator();
        simulate(&world, settings, &mut rng).expect("good settings")
    }

    fn ring_with_noise(noise: f64, replicate: u64) -> Detections {
        run(
            "square-ring",
            &SimulationSettings {
                noise,
                ..Default::default()
            },
            replicate,
        )
        .detections
    }

    fn perfect() -> SimulationSettings {
        SimulationSettings {
            noise: 0.0,
            missed_rate: 0.0,
            false_rate: 0.0,
            ..Default::default()
        }
    }

    /// Positions of the detections of each landmark of the ring.
    fn visits(detections: &Detections) -> Vec<Vec<[f64; 2]>> {
        let of = |landmark| {
            let is_of = |d: &&crate::detections::Detection| d.landmark == Some(landmark);
            detections
                .iter()
                .filter(is_of)
                .map(|d| d.position_m)
                .collect()
        };
        (0..8).map(of).collect()
    }

    fn offset_m(visits: &[[f64; 2]]) -> f64 {
        (visits[1][0] - visits[0][0]).hypot(visits[1][1] - visits[0][1])
    }

    #[test]
    fn a_perfect_ring_gives_sixteen_detections_in_eight_coincident_pairs() {
        let world = World::built_in("square-ring").expect("built in");
        let simulation = run("square-ring", &perfect(), 0);
        assert_eq!(simulation.detections.len(), 16);
        assert_eq!(simulation.believed_path, simulation.true_path);
        for (landmark, visits) in visits(&simulation.detections).iter().enumerate() {
            assert_eq!(visits.len(), 2, "landmark {landmark}");
            let corner = world.corners()[landmark].position_m;
            for visit in visits {
                assert!(
                    (visit[0] - corner[0]).hypot(visit[1] - corner[1]) < 1e-9,
                    "{visit:?}"
                );
            }
        }
    }

    #[test]
    fn misses_and_coarser_or_finer_scans_leave_a_quiet_ring_in_pairs() {
        // Coarse scans with misses would leave the shortest stretch (10 s) too few sightings.
        for (sighting_interval_s, missed_rate) in [(0.1, 0.0), (0.1, 0.3), (0.5, 0.3), (2.0, 0.0)] {
            let settings = SimulationSettings {
                sighting_interval_s,
                missed_rate,
                ..perfect()
            };
            for replicate in 0..5 {
                let detections = run("square-ring", &settings, replicate).detections;
                assert_eq!(detections.len(), 16, "{sighting_interval_s} {missed_rate}");
            }
        }
    }

    #[test]
    fn a_noisy_ring_mostly_gives_two_detections_per_corner() {
        for noise in [0.25, 1.0] {
            let in_pairs = (0..20)
                .map(|replicate| ring_with_noise(noise, replicate))
                .filter(|d| {
                    (16..=20).contains(&d.len()) && visits(d).iter().all(|visits| visits.len() == 2)
                })
                .count();
            assert!(in_pairs >= 15, "noise {noise}: {in_pairs} of 20");
        }
    }

    #[test]
    fn visits_differ_more_with_more_noise_and_as_in_the_report_by_default() {
        let mean_offset_m = |noise| {
            let offsets: Vec<f64> = (0..20)
                .flat_map(|replicate| visits(&ring_with_noise(noise, replicate)))
                .filter(|visits| visits.len() == 2)
                .map(|visits| offset_m(&visits))
                .collect();
            offsets.iter().sum::<f64>() / offsets.len() as f64
        };
        let means = [0.25, 0.5, 1.0].map(mean_offset_m);
        assert!(
            means[1] > 1.4 * means[0] && means[2] > 1.4 * means[1],
            "{means:?}"
        );
        assert!((1.5..4.0).contains(&means[2]), "{means:?}");
    }

    #[test]
    fn an_office_is_seen_whole() {
        let settings = SimulationSettings {
            laps: 1.0,
            ..perfect()
        };
        let simulation = run("office", &settings, 0);
        let mut landmarks: Vec<i64> = simulation
            .detections
            .truth()
            .into_iter()
            .flatten()
            .collect();
        landmarks.sort_unstable();
        landmarks.dedup();
        assert_eq!(landmarks.len(), 60);
        assert_eq!(
            simulation.detections.truth().iter().flatten().count(),
            simulation.detections.len()
        );
    }

    #[test]
    fn the_same_purpose_gives_the_same_mission_and_another_replicate_another() {
        let settings = SimulationSettings::default();
        let first = run("square-ring", &settings, 0);
        assert_eq!(first, run("square-ring", &settings, 0));
        assert_ne!(
            first.detections,
            run("square-ring", &settings, 1).detections
        );
    }

    #[test]
    fn impossible_missions_are_refused_in_one_line() {
        let world = World::built_in("square-ring").expect("built in");
        let message = |settings: SimulationSettings| {
            let mut rng = world_purpose(1, &world, &settings, 0).generator();
            simulate(&world, &settings, &mut rng)
                .expect_err("impossible")
                .to_string()
        };
        assert_eq!(
            message(SimulationSettings {
                laps: -1.0,
                ..Default::default()
            }),
            "simulation, laps: got -1, expected a finite number above 0; change laps"
        );
        assert_eq!(
            message(SimulationSettings {
                laps: 1e9,
                ..Default::default()
            }),
            "simulation: got 280000000001 scans from laps, speed_m_per_s and sighting_interval_s, \
             expected at most 10000000; lower laps or raise sighting_interval_s"
        );
        assert_eq!(
            message(SimulationSettings {
                max_range: 1.0,
                ..perfect()
            }),
            "simulation, tracker: got no group of at least 3 sightings out of 0 sightings, expected \
             at least one; lower min_sightings, or raise max_range or laps"
        );
    }
}
