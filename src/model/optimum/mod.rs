//! X\* and Σ of eq. 4 by a numerical optimiser: the source report's way, kept as a check.
//!
//! The metric model has both in closed form ([`metric`](super::metric)); here they are found as one would without knowing
//! that. For a set S of n members, with E_S over their 2n coordinates,
//!
//! - X\* minimises E_S, by argmin's BFGS or Newton's method from X = Z;
//! - Σ = (∇²E_S(X\*))⁻¹: exp(−E_S) with E_S = (X−X\*)ᵀA(X−X\*) + E\* has the covariance A⁻¹/2, the inverse of the
//!   Hessian 2A. BFGS's own approximation of it is not used: it is right only along the few directions
//!   that its steps have seen;
//! - X = X\* + Lε with L Lᵀ = Σ, L lower, ε ~ N(0, I) is a draw from Q;
//! - ln I₀(S) = −E\* + ½ ln det(2πΣ) − n ln(π/a), a = 1/σ_o².
//!
//! The optimiser works in coordinates centred on the set, in units of the farthest member's distance,
//! on E_S in the matching unit, so that one tolerance of the gradient serves every data set.
//! X\* is then right to 1e-10 of that distance for every σ_o/σ_t that the settings let through. A minimum that
//! is not reached to that tolerance is a fault of this program and a panic: a chain that went on with it, or with the
//! closed form in its place, would check nothing.

mod problem;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use argmin::core::{Executor, OptimizationResult, State, TerminationReason, TerminationStatus};
use argmin::solver::linesearch::BacktrackingLineSearch;
use argmin::solver::newton::Newton;
use argmin::solver::quasinewton::BFGS;
use nalgebra::{Cholesky, DMatrix};

use self::problem::{Point, SetEnergy, SlopeCondition};
use super::{MetricModel, SetLaw};

/// How the metric model finds X\* and Σ of eq. 4.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OptimumMethod {
    /// In closed form: exact, and by far the fastest.
    #[default]
    ClosedForm,
    /// By Broyden, Fletcher, Goldfarb and Shanno's method, as the source report did.
    Bfgs,
    /// By Newton's method.
    Newton,
}

impl fmt::Display for OptimumMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ClosedForm => "closed-form",
            Self::Bfgs => "bfgs",
            Self::Newton => "newton",
        })
    }
}

impl FromStr for OptimumMethod {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        [Self::ClosedForm, Self::Bfgs, Self::Newton]
            .into_iter()
            .find(|method| method.to_string() == text)
            .ok_or_else(|| "closed-form, bfgs or newton".to_owned())
    }
}

/// σ_o/σ_t may be at most this, and at least its inverse, for an optimiser: ∇²E has the condition
/// 1 + n(σ_o/σ_t)², and beyond it Σ would lose the digits that are promised.
pub const MOST_SCALE_RATIO: f64 = 1e3;

/// ‖∇e‖ at which a minimum is reached, e being E_S in units of the set's extent.
const GRADIENT_TOLERANCE: f64 = 1e-10;
/// Iterations of BFGS; three are typical, as ∇²E has two distinct eigenvalues.
const BFGS_ITERATIONS: u64 = 200;
/// By what its line search shortens a step.
const CONTRACTION: f64 = 0.5;
/// Steps of Newton's method at most. One would do in exact arithmetic; at σ_o/σ_t = 10³ the inverse of ∇²E
/// has seven digits fewer, and some five steps mend that.
const NEWTON_STEPS: usize = 40;

/// X\* and Σ of one set, found numerically.
#[derive(Clone, Debug)]
pub struct SetOptimum {
    /// The members, in rising order.
    pub members: Vec<u32>,
    /// X\* of each, m, relative to the mean of all detections.
    pub optimum_m: Vec<[f64; 2]>,
    /// L, 2n×2n, m; coordinates x₀, y₀, x₁, y₁, …
    pub factor_m: DMatrix<f64>,
    /// ln I₀(S), nats.
    pub ln_gaussian: f64,
}

impl SetOptimum {
    /// By BFGS or Newton; `members` in rising order. Panics if no minimum is reached, or if asked for the
    /// closed form.
    pub fn find(model: &MetricModel, members: &[u32], method: OptimumMethod) -> Self {
        let (energy, frame) = SetEnergy::of(model, members);
        let (point, energy) = minimise(energy, method);
        let least = energy.scale * energy.value(&point);
        let variance_m2 = model.sigma_o_m() * model.sigma_o_m();
        let factor = positive_definite(energy.second_derivative());
        let n = members.len() as f64;
        // ½ ln det(2πΣ) − n ln(π/a) with Σ = σ_o² H⁻¹: the units drop out and n ln 2 stays.
        let ln_root: f64 = factor
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| libm::log(*d))
            .sum();
        let covariance_m2 = factor.inverse() * variance_m2;
        Self {
            members: members.to_vec(),
            optimum_m: frame.to_model(&point),
            factor_m: positive_definite(covariance_m2).unpack(),
            ln_gaussian: n * std::f64::consts::LN_2 - ln_root - least,
        }
    }

    /// Σ, m².
    pub fn covariance_m2(&self) -> DMatrix<f64> {
        &self.factor_m * self.factor_m.transpose()
    }

    /// ε → X = X\* + Lε for the members: draw r of detection i is `epsilon[axis][from(i)*stride + r]`, and
    /// its location goes to `out[axis][to(i)*stride + r]`.
    pub fn place(
        &self,
        stride: usize,
        (epsilon, from): ([&[f64]; 2], impl Fn(u32) -> usize),
        (out, to): ([&mut [f64]; 2], impl Fn(u32) -> usize),
    ) {
        for k in 0..2 * self.members.len() {
            let row = to(self.members[k / 2]) * stride;
            out[k % 2][row..row + stride].fill(self.optimum_m[k / 2][k % 2]);
            for l in 0..=k {
                let start = from(self.members[l / 2]) * stride;
                let values = &epsilon[l % 2][start..start + stride];
                for (x, epsilon) in out[k % 2][row..row + stride].iter_mut().zip(values) {
                    *x += self.factor_m[(k, l)] * epsilon;
                }
            }
        }
    }
}

/// The law of the locations of a set, by the method that the model names; `members` in rising order.
pub fn set_law(model: &MetricModel, members: &[u32]) -> SetLaw {
    let closed_form = || model.set_law(members);
    let method = model.optimum_method();
    if method == OptimumMethod::ClosedForm {
        return closed_form();
    }
    let optimum = SetOptimum::find(model, members, method);
    let covariance_m2 = optimum.covariance_m2();
    let (energy, _) = SetEnergy::of(model, members);
    let variance_m2 = model.sigma_o_m() * model.sigma_o_m();
    SetLaw {
        ln_integral: optimum.ln_gaussian,
        ln_envelope: vec![0.0; members.len()],
        covariance_m2: (0..members.len())
            .map(|i| [(0, 0), (0, 1), (1, 1)].map(|(a, b)| covariance_m2[(2 * i + a, 2 * i + b)]))
            .collect(),
        mean_m: optimum.optimum_m,
        precision: energy.second_derivative() * (0.5 / variance_m2),
        sites: Vec::new(),
    }
}

fn positive_definite(matrix: DMatrix<f64>) -> Cholesky<f64, nalgebra::Dyn> {
    match Cholesky::new(matrix) {
        Some(factor) => factor,
        None => panic!("the Hessian of E_S is positive definite for every σ_o/σ_t let through"),
    }
}

/// The minimiser, from X = Z, and the problem back.
fn minimise(energy: SetEnergy, method: OptimumMethod) -> (Point, SetEnergy) {
    let start = energy.start();
    let n = start.0.len();
    let (point, energy, status) = match method {
        OptimumMethod::ClosedForm => panic!("the closed form needs no optimiser"),
        OptimumMethod::Bfgs => {
            let line_search = BacktrackingLineSearch::new(SlopeCondition);
            let solver = line_search
                .rho(CONTRACTION)
                .map(BFGS::new)
                .and_then(|solver| solver.with_tolerance_grad(GRADIENT_TOLERANCE))
                .and_then(|solver| solver.with_tolerance_cost(0.0));
            let run = solver.and_then(|solver| {
                Executor::new(energy, solver)
                    .configure(|state| {
                        let identity = DMatrix::identity(n, n);
                        state
                            .param(start)
                            .inv_hessian(identity)
                            .max_iters(BFGS_ITERATIONS)
                    })
                    .ctrlc(false)
                    .timer(false)
                    .run()
            });
            outcome(run, method)
        }
        OptimumMethod::Newton => newton_steps(energy, start),
    };
    reached(&energy, &point, &status, method);
    (point, energy)
}

/// Panics unless the point is a minimum. argmin's Newton stops by its number of steps alone, and an error
/// inside a line search may come back as an `Ok` with another status: what counts is the gradient.
fn reached(energy: &SetEnergy, point: &Point, status: &TerminationStatus, method: OptimumMethod) {
    let converged = TerminationStatus::Terminated(TerminationReason::SolverConverged);
    let slope = energy.slope(point).0.norm();
    // Written so that a NaN does not pass.
    let good =
        slope <= GRADIENT_TOLERANCE && (method == OptimumMethod::Newton || *status == converged);
    assert!(
        good,
        "optimum {method} of a set of {}: {status}, gradient {slope:e} above {GRADIENT_TOLERANCE:e}; \
         closed-form needs no optimiser",
        point.0.len() / 2
    );
}

/// Newton's steps, until the gradient is nothing or their number is used up: argmin's solver looks at
/// neither, so it is asked for one step at a time.
fn newton_steps(mut energy: SetEnergy, mut point: Point) -> (Point, SetEnergy, TerminationStatus) {
    let mut status = TerminationStatus::NotTerminated;
    for _ in 0..NEWTON_STEPS {
        if energy.slope(&point).0.norm() <= GRADIENT_TOLERANCE {
            break;
        }
        let run = Executor::new(energy, Newton::<f64>::new())
            .configure(|state| state.param(point).max_iters(1))
            .ctrlc(false)
            .timer(false)
            .run();
        (point, energy, status) = outcome(run, OptimumMethod::Newton);
    }
    (point, energy, status)
}

/// The point where argmin stopped, the problem, and why it stopped.
fn outcome<S, I>(
    run: Result<OptimizationResult<SetEnergy, S, I>, argmin::core::Error>,
    method: OptimumMethod,
) -> (Point, SetEnergy, TerminationStatus)
where
    I: State<Param = Point>,
{
    let result = run.unwrap_or_else(|error| panic!("optimum {method}: {error}"));
    let status = result.state.get_termination_status().clone();
    let point = result.state.get_param().cloned();
    match (point, result.problem.problem) {
        (Some(point), Some(energy)) => (point, energy, status),
        _ => panic!("optimum {method}: argmin kept the problem ({status})"),
    }
}

/// Numbers held by remembered factors at most: 128 MiB.
const MAX_NUMBERS: usize = 1 << 24;

/// Optima of sets met before. What it gives is a function of the set alone, so forgetting everything
/// when it is full changes no result.
#[derive(Clone, Debug, Default)]
pub struct OptimumMemory {
    sets: HashMap<Vec<u32>, Arc<SetOptimum>>,
    n_numbers: usize,
    sorted: Vec<u32>,
}

impl OptimumMemory {
    /// The optimum of a set, members in any order; `None` where the model uses its closed form.
    pub fn get(&mut self, model: &MetricModel, members: &[u32]) -> Option<Arc<SetOptimum>> {
        let method = model.optimum_method();
        if method == OptimumMethod::ClosedForm {
            return None;
        }
        self.sorted.clear();
        self.sorted.extend_from_slice(members);
        self.sorted.sort_unstable();
        if let Some(optimum) = self.sets.get(&self.sorted) {
            return Some(Arc::clone(optimum));
        }
        let optimum = Arc::new(SetOptimum::find(model, &self.sorted, method));
        if self.n_numbers + optimum.factor_m.len() > MAX_NUMBERS {
            self.sets.clear();
            self.n_numbers = 0;
        }
        self.n_numbers += optimum.factor_m.len();
        self.sets.insert(self.sorted.clone(), Arc::clone(&optimum));
        Some(optimum)
    }

    /// ln I₀(S) by the method that the model names, members in any order.
    pub fn ln_gaussian(&mut self, model: &MetricModel, members: &[u32]) -> f64 {
        self.get(model, members)
            .map_or_else(|| model.ln_gaussian(members), |optimum| optimum.ln_gaussian)
    }
}
