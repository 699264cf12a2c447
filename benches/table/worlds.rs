//! The worlds of the benchmarks: landmarks on a jittered square grid 10 m apart, noise of 0.3 m; and offices.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use topometric::dataset::DataSet;
use topometric::detections::Covariance;
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape};
use topometric::rng::Purpose;
use topometric::settings::Settings;

/// Detections and the landmark of each.
pub struct World {
    pub positions_m: Vec<[f64; 2]>,
    pub landmarks: Vec<u32>,
}

/// So many landmarks, each detected once in every one of so many laps, in the order of a mission.
pub fn grid(n_landmarks: usize, n_laps: usize, seed: u64) -> World {
    let mut rng = Purpose::new("bench", seed)
        .number("landmarks", n_landmarks as u64)
        .generator();
    let side = (n_landmarks as f64).sqrt().ceil() as usize;
    let mut corner = |k: usize| 10.0 * k as f64 + rng.random::<f64>() - 0.5;
    let corners: Vec<[f64; 2]> = (0..n_landmarks)
        .map(|l| [corner(l / side), corner(l % side)])
        .collect();
    let mut world = World {
        positions_m: Vec::new(),
        landmarks: Vec::new(),
    };
    for _ in 0..n_laps {
        for (landmark, corner) in corners.iter().enumerate() {
            let noisy = corner.map(|c| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                c + 0.3 * noise
            });
            world.positions_m.push(noisy);
            world.landmarks.push(landmark as u32);
        }
    }
    world
}

/// So many landmarks at least 4 m apart, with noise of 0.8 m: sets that overlap.
pub fn overlapping(n_landmarks: usize, n_detections: usize, seed: u64) -> World {
    let mut rng = Purpose::new("bench overlapping", seed).generator();
    let side_m = 6.0 * (n_landmarks as f64).sqrt();
    let mut corners: Vec<[f64; 2]> = Vec::new();
    while corners.len() < n_landmarks {
        let corner = [0, 1].map(|_| side_m * rng.random::<f64>());
        let is_apart = |own: &[f64; 2]| (own[0] - corner[0]).hypot(own[1] - corner[1]) >= 4.0;
        if corners.iter().all(is_apart) {
            corners.push(corner);
        }
    }
    let mut world = World {
        positions_m: Vec::new(),
        landmarks: Vec::new(),
    };
    for (landmark, corner) in (0..).zip(&corners) {
        for _ in 0..n_detections {
            let noisy = corner.map(|c| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                c + 0.8 * noise
            });
            world.positions_m.push(noisy);
            world.landmarks.push(landmark);
        }
    }
    world
}

/// A mission of one and a quarter laps in an office of so many rows and columns of rooms, at a fifth of the usual noise.
pub fn office(n_rows: usize) -> World {
    let mut settings = Settings::default();
    let world = format!("office:{n_rows}x{n_rows}");
    for (name, value) in [("world", world.as_str()), ("noise", "0.2")] {
        settings.set_text(name, value).expect("a good setting");
    }
    let data = DataSet::load(&settings, 0).expect("an office that can be driven");
    let mut n_unknown = 0;
    let landmarks = data.detections.truth().into_iter().map(|landmark| {
        landmark.map_or_else(
            || {
                n_unknown += 1;
                u32::MAX - n_unknown
            },
            |landmark| u32::try_from(landmark).expect("a landmark of the world"),
        )
    });
    World {
        landmarks: landmarks.collect(),
        positions_m: data.detections.positions_m(),
    }
}

const PENALTY: Penalty = Penalty {
    shape: PenaltyShape::Quadratic,
    radius_m: 3.0,
    height: 50.0,
};

/// The metric model, σ_o = σ_t = 1 m.
pub fn metric(world: &World) -> Model {
    MetricModel::new(&world.positions_m, 1.0, 1.0, PENALTY).into()
}

/// The covariance of detection i, m².
pub fn covariance_of(i: usize) -> Covariance {
    Covariance {
        xx: 0.3 + 0.01 * (i % 7) as f64,
        xy: 0.05,
        yy: 0.3,
    }
}

/// The covariance model, with covariances of their own for every detection.
pub fn covariance(world: &World) -> Model {
    let covariances_m2: Vec<_> = (0..world.landmarks.len()).map(covariance_of).collect();
    CovarianceModel::new(&world.positions_m, &covariances_m2, 1.0, 1.0, PENALTY)
        .expect("good covariances")
        .into()
}
