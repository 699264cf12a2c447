//! Whether a solution fits its noise, and what fits worst.
//!
//! Under the stated noise and the right associations the sum of weighted squares of all residuals
//! has a χ² law with two degrees of freedom for each sighting less two for each landmark, and the
//! square of a single residual has at most one with 2 (a sighting) or 3 (odometry).

use nalgebra::Vector2;

use super::graph::Graph;
use super::linear::residual;
use super::optimum::places;
use crate::sighting::Pose;

/// 99.9 % of χ² with 2 and with 3 degrees of freedom.
const BEYOND: [f64; 2] = [13.815_510_557_964_274, 16.266_236_196_238_13];
/// The share of residuals that are beyond.
const SHARE: f64 = 0.001;
/// A standard normal number above this is no chance.
const NO_CHANCE: f64 = 3.0;
/// A correlation of neighbouring errors above this, and so many of its standard errors above 0, is
/// one that persists.
const LEAST_CORRELATION: [f64; 2] = [0.3, 5.0];
/// Sightings of one landmark so many poses apart or fewer are neighbours.
const NEIGHBOURS: usize = 10;
/// Misfits that are listed.
const MOST_LISTED: usize = 20;

/// A residual that its noise does not explain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// Odometry from this pose to the next, and its residual in standard deviations, squared.
    Odometry(usize, f64),
    /// This sighting, and the same.
    Sighting(usize, f64),
}

impl Misfit {
    /// The residual in standard deviations, squared.
    pub fn square(self) -> f64 {
        match self {
            Self::Odometry(_, square) | Self::Sighting(_, square) => square,
        }
    }
}

/// How well a solution fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The weighted squares of all residuals.
    pub chi_square: f64,
    /// Two for each sighting less two for each landmark.
    pub degrees_of_freedom: usize,
    /// Residuals beyond 99.9 % of their law, and how many residuals there are.
    pub n_beyond: [usize; 2],
    /// Those beyond, the worst first; at most 20.
    pub worst: Vec<Misfit>,
    /// The correlation between the residual of a sighting and that of the next one of its landmark,
    /// up to ten poses on, in the axes of their poses; 0 without such pairs.
    pub correlation: f64,
    /// How many such pairs there are.
    pub n_neighbours: usize,
}

impl Fit {
    /// Where χ² lies in its law, as a standard normal number (Wilson & Hilferty, PNAS 17, 1931);
    /// `None` without degrees of freedom.
    pub fn score(&self) -> Option<f64> {
        let k = self.degrees_of_freedom as f64;
        let spread = 2.0 / (9.0 * k);
        let score = (libm::cbrt(self.chi_square / k) - (1.0 - spread)) / spread.sqrt();
        (self.degrees_of_freedom > 0).then_some(score)
    }

    /// Whether residuals are larger than the noise explains.
    pub fn is_worse(&self) -> bool {
        self.score().is_some_and(|score| score > NO_CHANCE)
    }

    /// Whether residuals are smaller than the noise explains.
    pub fn is_better(&self) -> bool {
        self.score().is_some_and(|score| score < -NO_CHANCE)
    }

    /// Whether there are more residuals beyond 99.9 % of their law than by chance, or one so large
    /// that among so many there would be none in a thousand missions.
    pub fn has_heavy_tails(&self) -> bool {
        let [n, of] = self.n_beyond.map(|count| count as f64);
        let expected = SHARE * of;
        let largest = self.worst.first().map_or(0.0, |one| one.square());
        let is_one_in_many = largest > 2.0 * libm::log(of / SHARE);
        is_one_in_many || n > expected + NO_CHANCE * expected.sqrt() + 1.0
    }

    /// Whether errors of sightings persist from one scan to the next: they say less than their
    /// number.
    pub fn has_persisting_errors(&self) -> bool {
        // Two numbers for each pair.
        let errors = self.correlation * (2.0 * self.n_neighbours as f64).sqrt();
        self.correlation > LEAST_CORRELATION[0] && errors > LEAST_CORRELATION[1]
    }

    /// What χ² says, in words.
    pub fn verdict(&self) -> &'static str {
        if self.is_worse() {
            "more than the noise explains, so noise or associations are wrong"
        } else if self.is_better() {
            "less than the noise explains, so the noise is overstated"
        } else {
            "as the noise explains, which does not prove the associations"
        }
    }
}

/// How well poses and labels (from 0 on) fit a graph.
pub fn fit(graph: &Graph, poses: &[Pose], labels: &[u32]) -> Fit {
    let n = labels.iter().max().map_or(0, |&most| most as usize + 1);
    let landmarks = places(&graph.observations, poses, labels, n);
    let edges = graph.odometry.iter().enumerate().map(|(k, edge)| {
        let (error, _) = residual(edge, poses[k], poses[k + 1]);
        Misfit::Odometry(k, error.dot(&(edge.information * error)))
    });
    let sightings = graph.observations.iter().zip(labels).enumerate();
    let sightings = sightings.map(|(s, (one, &label))| {
        let (place, weight) = one.in_frame(poses[one.pose]);
        let error = place - Vector2::from(landmarks[label as usize]);
        Misfit::Sighting(s, error.dot(&(weight * error)))
    });
    let all: Vec<Misfit> = edges.chain(sightings).collect();
    let is_beyond = |one: &&Misfit| match one {
        Misfit::Sighting(_, square) => *square > BEYOND[0],
        Misfit::Odometry(_, square) => *square > BEYOND[1],
    };
    let mut worst: Vec<Misfit> = all.iter().filter(is_beyond).copied().collect();
    let n_beyond = [worst.len(), all.len()];
    worst.sort_by(|a, b| b.square().total_cmp(&a.square()));
    worst.truncate(MOST_LISTED);
    let (correlation, n_neighbours) = correlation(graph, poses, labels, &landmarks);
    Fit {
        chi_square: all.iter().map(|one| one.square()).sum(),
        degrees_of_freedom: 2 * (labels.len() - n),
        n_beyond,
        worst,
        correlation,
        n_neighbours,
    }
}

/// See [`Fit::correlation`].
fn correlation(
    graph: &Graph,
    poses: &[Pose],
    labels: &[u32],
    landmarks: &[[f64; 2]],
) -> (f64, usize) {
    let mut latest: Vec<Option<usize>> = vec![None; landmarks.len()];
    let residual = |s: usize| {
        let one = &graph.observations[s];
        let pose = poses[one.pose];
        let [x, y] = landmarks[labels[s] as usize];
        let (sin, cos) = libm::sincos(pose.heading_rad);
        let (dx, dy) = (x - pose.x_m, y - pose.y_m);
        let expected = Vector2::new(cos * dx + sin * dy, cos * dy - sin * dx);
        Vector2::from(one.at_m) - expected
    };
    let (mut products, mut squares, mut n) = (0.0, 0.0, 0);
    for (s, &label) in labels.iter().enumerate() {
        let before = latest[label as usize].replace(s);
        let pose = |s: usize| graph.observations[s].pose;
        let Some(before) = before.filter(|&t| pose(s) - pose(t) <= NEIGHBOURS) else {
            continue;
        };
        let weight = graph.observations[s].weight();
        let [a, b] = [before, s].map(residual);
        products += a.dot(&(weight * b));
        squares += 0.5 * (a.dot(&(weight * a)) + b.dot(&(weight * b)));
        n += 1;
    }
    (
        if squares > 0.0 {
            products / squares
        } else {
            0.0
        },
        n,
    )
}
