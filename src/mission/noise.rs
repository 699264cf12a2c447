//! How far the errors of a recording are from what it states, by the evidence of a partition.
//!
//! Four factors multiply the stated standard deviations: those of sightings along and across the
//! line of sight, and those of odometry in place and in heading. Given a partition the graph is
//! nearly linear, so the density of all measurements with poses and landmarks integrated out is
//!
//!   ln p(y, u | T, θ) = −χ²/2 − ½ ln det H_p − ½ ln det H_m + ½ Σ ln det N_s + ½ Σ ln det Q_k⁻¹
//!
//! up to a constant, every term at the factors θ and at the optimum of the graph under them
//! (`optimum`). Times a log-normal prior around what is stated, that is maximised by Nelder and
//! Mead's simplex (MacKay, Neural Computation 4(3), 1992, for the evidence as a guide to noise).

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::neldermead::NelderMead;
use nalgebra::{Matrix2, Matrix3, SVector};

use super::graph::{Graph, Observation, Odometry};
use super::optimum::optimise;
use crate::sighting::Pose;

/// The standard deviation of the log of a factor before anything is seen: stated noise is right to
/// a factor of three.
const PRIOR_STD: f64 = 1.1;
/// Gauss–Newton steps for the evidence of other factors, from the optimum of the present ones.
const STEPS: usize = 2;
/// Steps of the simplex.
const MOST_STEPS: u64 = 150;
/// The simplex ends when its values are this near to each other (standard deviation), nats.
const TOLERANCE: f64 = 0.02;
/// Edges of the first simplex, in logs.
const EDGE: f64 = 0.4;

/// What multiplies the stated standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFactors {
    /// Of sightings, along the line of sight.
    pub range: f64,
    /// Of sightings, across it.
    pub bearing: f64,
    /// Of odometry, x and y.
    pub place: f64,
    /// Of odometry, heading.
    pub heading: f64,
}

/// Logs of the factors, in the order of the fields.
type Logs = SVector<f64, 4>;

impl NoiseFactors {
    /// Noise as it is stated.
    pub const STATED: Self = Self {
        range: 1.0,
        bearing: 1.0,
        place: 1.0,
        heading: 1.0,
    };

    fn of_logs(logs: &Logs) -> Self {
        let [range, bearing, place, heading] = [0, 1, 2, 3].map(|k| libm::exp(logs[k]));
        Self {
            range,
            bearing,
            place,
            heading,
        }
    }

    fn logs(self) -> Logs {
        Logs::from([self.range, self.bearing, self.place, self.heading].map(libm::log))
    }

    /// The same, but none below 1.
    pub(super) fn at_least_stated(self) -> Self {
        Self {
            range: self.range.max(1.0),
            bearing: self.bearing.max(1.0),
            place: self.place.max(1.0),
            heading: self.heading.max(1.0),
        }
    }

    /// The largest log of the ratio to other factors, without sign.
    pub(super) fn ln_distance(self, other: Self) -> f64 {
        (self.logs() - other.logs()).amax()
    }
}

impl Graph {
    /// The same graph with its noise multiplied.
    pub fn with_noise(&self, factors: NoiseFactors) -> Self {
        if factors == NoiseFactors::STATED {
            return self.clone();
        }
        let odometry = self
            .odometry
            .iter()
            .map(|edge| scaled_odometry(edge, factors));
        let seen = self
            .observations
            .iter()
            .map(|one| scaled_sighting(one, factors));
        Self {
            start: self.start,
            times_s: self.times_s.clone(),
            odometry: odometry.collect(),
            observations: seen.collect(),
        }
    }
}

fn scaled_odometry(edge: &Odometry, factors: NoiseFactors) -> Odometry {
    let scale = [factors.place, factors.place, factors.heading];
    Odometry {
        information: Matrix3::from_fn(|i, j| edge.information[(i, j)] / (scale[i] * scale[j])),
        ..*edge
    }
}

fn scaled_sighting(one: &Observation, factors: NoiseFactors) -> Observation {
    let [x, y] = one.at_m;
    let range_m = libm::hypot(x, y);
    let (cos, sin) = if range_m > 0.0 {
        (x / range_m, y / range_m)
    } else {
        (1.0, 0.0)
    };
    let turn = Matrix2::new(cos, -sin, sin, cos);
    let shrink = Matrix2::new(1.0 / factors.range, 0.0, 0.0, 1.0 / factors.bearing);
    let shrink = turn * shrink * turn.transpose();
    let weight = shrink * one.weight() * shrink;
    Observation {
        information: [weight.m11, 0.5 * (weight.m12 + weight.m21), weight.m22],
        ..*one
    }
}

/// What the evidence says of the noise under a partition.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calibration {
    pub factors: NoiseFactors,
    /// What they gain over the stated noise, the prior included, nats.
    pub gain: f64,
}

/// The most probable factors of a graph's noise under a partition (labels from 0 on), sought from
/// `from`; `poses` are near the optimum. `None` if the stated noise has no evidence.
pub(super) fn calibrate(
    graph: &Graph,
    poses: &[Pose],
    labels: &[u32],
    from: NoiseFactors,
) -> Option<Calibration> {
    let posterior = Posterior {
        graph,
        poses,
        labels,
    };
    let stated = posterior.ln_at(&Logs::zeros())?;
    let first = from.logs();
    let corner = |k: usize| first + Logs::ith(k, EDGE);
    let corners = [first].into_iter().chain((0..4).map(corner)).collect();
    let solver = NelderMead::new(corners).with_sd_tolerance(TOLERANCE).ok()?;
    let run = Executor::new(posterior, solver)
        .configure(|state| state.max_iters(MOST_STEPS))
        .run();
    let found = run.ok()?;
    let best = found.state().get_best_param()?;
    Some(Calibration {
        factors: NoiseFactors::of_logs(best),
        gain: -found.state().get_best_cost() - stated,
    })
}

/// The posterior of factors.
struct Posterior<'a> {
    graph: &'a Graph,
    poses: &'a [Pose],
    labels: &'a [u32],
}

impl Posterior<'_> {
    /// Its log, up to a constant; `None` if an information is not positive definite.
    fn ln_at(&self, logs: &Logs) -> Option<f64> {
        let graph = self.graph.with_noise(NoiseFactors::of_logs(logs));
        let mut poses = self.poses.to_vec();
        let (chi_square, ln_determinants) = optimise(graph.part(), &mut poses, self.labels, STEPS)?;
        let n_seen = graph.observations.len() as f64;
        let n_steps = graph.odometry.len() as f64;
        let counts = Logs::from([n_seen, n_seen, 2.0 * n_steps, n_steps]);
        let ln_prior = -0.5 * logs.norm_squared() / (PRIOR_STD * PRIOR_STD);
        Some(-0.5 * chi_square + ln_determinants - counts.dot(logs) + ln_prior)
    }
}

impl CostFunction for Posterior<'_> {
    type Param = Logs;
    type Output = f64;

    fn cost(&self, logs: &Logs) -> Result<f64, Error> {
        Ok(self.ln_at(logs).map_or(f64::MAX, |ln| -ln))
    }
}
