//! Small missions whose posterior is known: by dense algebra, and by enumeration of all partitions.

mod duplicates;
mod evidence;
mod noise;
mod online;
mod optimum;
mod sampler;

use nalgebra::{DMatrix, DVector, Matrix3};

use super::graph::{Graph, Observation, Odometry};
use super::linear::residual;
use super::search::Mission;
use super::state::State;
use super::view::Reach;
use crate::sighting::Pose;

fn pose(x_m: f64, y_m: f64, heading_rad: f64) -> Pose {
    Pose {
        x_m,
        y_m,
        heading_rad,
    }
}

/// A pose that sees a point in its axes, with information.
fn seen(pose: usize, at_m: [f64; 2], information: [f64; 3]) -> Observation {
    Observation {
        pose,
        at_m,
        information,
        landmark: None,
    }
}

/// Three poses on a bend, and seven sightings that may be of two, three or more landmarks.
fn crowded() -> Graph {
    let step = |relative: Pose, information: [f64; 3]| Odometry {
        relative,
        information: Matrix3::from_diagonal(&information.into()),
    };
    let round = [16.0, 0.0, 16.0];
    Graph {
        start: pose(1.0, -2.0, 0.4),
        times_s: vec![0.0, 1.0, 2.0],
        odometry: vec![
            step(pose(1.0, 0.1, 0.1), [25.0, 30.0, 100.0]),
            step(pose(0.9, -0.1, 0.2), [20.0, 25.0, 80.0]),
        ],
        observations: vec![
            seen(0, [2.0, 0.0], round),
            seen(0, [2.6, 0.9], [20.0, 5.0, 11.0]),
            seen(1, [1.1, 0.1], round),
            seen(1, [1.7, 0.7], round),
            seen(2, [0.2, -0.2], [14.0, -3.0, 9.0]),
            seen(2, [0.7, 0.6], round),
            seen(2, [0.4, -0.9], round),
        ],
    }
}

/// A state at the dead-reckoned poses, with an explored area of so much.
fn state(graph: &Graph, labels: &[u32], ln_area_m2: f64) -> State {
    let reach = Reach::of(&graph.observations);
    let mission = Mission {
        part: graph.part(),
        reach,
        ln_area_m2,
    };
    mission
        .state(graph.dead_reckoned(), labels)
        .expect("positive definite")
}

/// All partitions of the sightings of a graph in which no two of one pose are together.
fn all_partitions(graph: &Graph) -> Vec<Vec<u32>> {
    let mut all: Vec<Vec<u32>> = vec![Vec::new()];
    for (s, one) in graph.observations.iter().enumerate() {
        let mut grown = Vec::new();
        for labels in all {
            let n = labels.iter().max().map_or(0, |&most| most + 1);
            for label in 0..=n {
                let is_free =
                    (0..s).all(|t| graph.observations[t].pose != one.pose || labels[t] != label);
                if is_free {
                    grown.push([&labels[..], &[label]].concat());
                }
            }
        }
        all = grown;
    }
    all
}

/// ln ∫∫ exp(−χ²/2) of the linearised graph over all poses but the first and all landmarks, by
/// dense algebra.
fn ln_integral(graph: &Graph, labels: &[u32]) -> f64 {
    let poses = graph.dead_reckoned();
    let n_landmarks = labels.iter().max().map_or(0, |&most| most as usize + 1);
    let n_free = 3 * (poses.len() - 1);
    let n = n_free + 2 * n_landmarks;
    let mut information = DMatrix::<f64>::zeros(n, n);
    let mut vector = DVector::<f64>::zeros(n);
    let mut square = 0.0;
    let mut add = |row: &DMatrix<f64>, error: &DVector<f64>, weight: &DMatrix<f64>| {
        information += row.transpose() * weight * row;
        vector -= row.transpose() * weight * error;
        square += (error.transpose() * weight * error)[0];
    };
    for (k, edge) in graph.odometry.iter().enumerate() {
        let (error, [before, after]) = residual(edge, poses[k], poses[k + 1]);
        let mut row = DMatrix::zeros(3, n);
        for i in 0..3 {
            for j in 0..3 {
                if k > 0 {
                    row[(i, 3 * (k - 1) + j)] = before[(i, j)];
                }
                row[(i, 3 * k + j)] = after[(i, j)];
            }
        }
        let weight = DMatrix::from_fn(3, 3, |i, j| edge.information[(i, j)]);
        add(&row, &DVector::from_column_slice(error.as_slice()), &weight);
    }
    for (one, &label) in graph.observations.iter().zip(labels) {
        let (place, weight) = one.in_frame(poses[one.pose]);
        let mut row = DMatrix::zeros(2, n);
        for axis in 0..2 {
            row[(axis, n_free + 2 * label as usize + axis)] = 1.0;
            if one.pose > 0 {
                row[(axis, 3 * (one.pose - 1) + axis)] = -1.0;
            }
        }
        if one.pose > 0 {
            let from = poses[one.pose];
            row[(0, 3 * (one.pose - 1) + 2)] = place.y - from.y_m;
            row[(1, 3 * (one.pose - 1) + 2)] = from.x_m - place.x;
        }
        let weight = DMatrix::from_fn(2, 2, |i, j| weight[(i, j)]);
        let error = DVector::from_column_slice(&[-place.x, -place.y]);
        add(&row, &error, &weight);
    }
    let root = information.cholesky().expect("positive definite");
    let best = root.solve(&vector);
    let half_ln_det: f64 = root.l().diagonal().iter().map(|value| value.ln()).sum();
    0.5 * vector.dot(&best) - 0.5 * square - half_ln_det
        + n_landmarks as f64 * std::f64::consts::TAU.ln()
}
