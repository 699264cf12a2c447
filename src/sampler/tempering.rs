//! Parallel tempering on the penalty, with non-reversible swaps.
//!
//! K replicas stand on the rungs of a ladder 1 = β₀ > β₁ > … > β_{K−1} = 0. Rung k has the law
//!
//! P(T) · p(ε) · Π I₀ · mean_r exp(h_r − β_k·Pen_r)  with the estimator `common`,
//! P(T) · exp(−E(X;T) − β_k·Pen(X;T))                with `explicit`,
//!
//! which is that of the estimator for a penalty of height β_k·H: its marginal over T is the exact
//! posterior of that height, for every R. (MODEL §7 has the mean to the power of β_k in the metric
//! model; inside the mean both models are one formula, and every rung can be held against
//! enumeration.) At β = 0 nothing keeps sets apart or together but E and the prior, and nothing
//! traps.
//!
//! Every `swap_interval` steps neighbours swap states with probability min(1, α),
//!
//! ln α = w_k(b) + w_{k+1}(a) − w_k(a) − w_{k+1}(b),
//!
//! where w_k is ln of what of the law depends on β_k: ln of the mean, or −β_k·Pen. Pairs (0,1),
//! (2,3), … and (1,2), (3,4), … take turns (Okabe et al. 2001), so that replicas travel instead of
//! diffusing; rungs without a partner step as ever. While the ladder is tuned, its rungs are placed
//! where the cumulative rejection of swaps is the same between all neighbours (Syed, Bouchard-Côté,
//! Deligiannidis & Doucet 2022, JRSS B 84(2), algorithm 4).

use serde::{Deserialize, Serialize};

use rand::{Rng, RngExt};

use super::{Kernel, MoveKind, Outcome, SamplerSettings, State, StepInfo};
use crate::model::{Model, Prior};
use crate::partition::Partition;
use crate::rng::{Purpose, StepGenerators};

/// How a chain is tempered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tempering {
    /// K ≥ 2, the number of rungs.
    pub n_temperatures: usize,
    /// Steps from one round of swaps to the next, ≥ 1.
    pub swap_interval: u64,
}

/// The ladder is tuned in the first of so many parts of a chain.
const TUNING_PART: u64 = 4;

/// Steps at the start of a tempered chain in which its ladder is tuned.
pub fn n_tuning(n_steps: u64) -> u64 {
    n_steps / TUNING_PART
}

/// Rungs of the first ladder lie at ((K−1−k)/(K−1))⁴: what a penalty does to a topology spans
/// decades of β.
const FIRST_EXPONENT: i32 = 4;
/// Neighbours that never rejected a swap count as this, so that no two rungs fall together.
const LEAST_REJECTION: f64 = 0.01;

/// Inverse temperatures β from 1 down to 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ladder {
    inverse_temperatures: Vec<f64>,
}

impl Ladder {
    /// Of K ≥ 2 rungs, before anything is known.
    pub fn new(n_temperatures: usize) -> Self {
        let last = (n_temperatures - 1) as f64;
        let rung = |k: usize| ((last - k as f64) / last).powi(FIRST_EXPONENT);
        Self {
            inverse_temperatures: (0..n_temperatures).map(rung).collect(),
        }
    }

    /// β of every rung.
    pub fn inverse_temperatures(&self) -> &[f64] {
        &self.inverse_temperatures
    }

    /// The model of every rung.
    pub fn models(&self, model: &Model) -> Vec<Model> {
        let rungs = self.inverse_temperatures.iter();
        rungs.map(|beta| model.with_penalty_scaled(*beta)).collect()
    }

    /// The ladder of as many rungs whose neighbours reject alike, by the share of swaps that were
    /// rejected between neighbours k and k + 1 of this one; between two rungs rejection is taken to
    /// grow evenly in ln β.
    #[must_use]
    pub fn tuned(&self, rejected: &[f64]) -> Self {
        let beta = &self.inverse_temperatures;
        let rejected: Vec<f64> = rejected.iter().map(|r| r.max(LEAST_REJECTION)).collect();
        let even = rejected.iter().sum::<f64>() / rejected.len() as f64;
        let (mut segment, mut before) = (0, 0.0);
        let mut tuned = vec![1.0];
        for rung in 1..rejected.len() {
            let wanted = even * rung as f64;
            while segment + 1 < rejected.len() && before + rejected[segment] < wanted {
                before += rejected[segment];
                segment += 1;
            }
            let part = ((wanted - before) / rejected[segment]).clamp(0.0, 1.0);
            let (cold, hot) = (beta[segment], beta[segment + 1]);
            tuned.push(if hot > 0.0 {
                cold * libm::pow(hot / cold, part)
            } else {
                cold * (1.0 - part)
            });
        }
        tuned.push(0.0);
        Self {
            inverse_temperatures: tuned,
        }
    }
}

/// Swaps between two neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SwapCounts {
    /// Proposed.
    pub proposed: u64,
    /// Accepted.
    pub accepted: u64,
}

impl SwapCounts {
    /// Share that was rejected; 0 if none was proposed.
    pub fn rejected_share(&self) -> f64 {
        if self.proposed == 0 {
            return 0.0;
        }
        1.0 - self.accepted as f64 / self.proposed as f64
    }
}

/// The states of all rungs, coldest first.
#[derive(Serialize, Deserialize)]
pub struct Replicas {
    pub(super) states: Vec<State>,
    /// Which replica stands on each rung.
    replica_at: Vec<usize>,
    /// Whether a replica has been on the hottest rung since it last was on the coldest.
    has_been_hot: Vec<bool>,
    /// Journeys from the coldest rung to the hottest and back, of all replicas.
    pub round_trips: u64,
}

impl Replicas {
    /// The state of the coldest rung, whose law is the posterior.
    pub fn cold(&self) -> &State {
        &self.states[0]
    }

    /// Replicas on their way count from here.
    pub fn forget_journeys(&mut self) {
        self.has_been_hot.fill(false);
        self.round_trips = 0;
    }

    fn arrived(&mut self) {
        let last = self.states.len() - 1;
        self.has_been_hot[self.replica_at[last]] = true;
        let returned = &mut self.has_been_hot[self.replica_at[0]];
        self.round_trips += u64::from(*returned);
        *returned = false;
    }
}

/// The kernels of all rungs of one ladder.
pub struct Rungs<'a> {
    kernels: Vec<Kernel<'a>>,
    swap_interval: u64,
    /// Between rungs k and k + 1.
    swaps: Vec<SwapCounts>,
}

impl<'a> Rungs<'a> {
    /// On the models of a ladder. Each rung has importance draws of its own.
    pub fn new(
        models: &'a [Model],
        prior: Prior,
        (settings, tempering): (&'a SamplerSettings, Tempering),
        draws: &Purpose,
    ) -> Self {
        let kernel = |(rung, model): (usize, &'a Model)| {
            let draws = draws.clone().number("rung", rung as u64);
            Kernel::new(model, prior, settings, StepGenerators::new(&draws))
        };
        Self {
            kernels: models.iter().enumerate().map(kernel).collect(),
            swap_interval: tempering.swap_interval,
            swaps: vec![SwapCounts::default(); models.len() - 1],
        }
    }

    /// All replicas at one partition, each with draws of its own.
    pub fn init(&mut self, partition: &Partition) -> Replicas {
        let kernels = self.kernels.iter_mut();
        let states: Vec<State> = kernels
            .map(|kernel| kernel.init(partition.clone()))
            .collect();
        let n = states.len();
        Replicas {
            states,
            replica_at: (0..n).collect(),
            has_been_hot: vec![false; n],
            round_trips: 0,
        }
    }

    /// Takes over replicas of another ladder: their estimates become those of the rungs they stand
    /// on.
    pub fn adopt(&mut self, replicas: &mut Replicas) {
        for (kernel, state) in self.kernels.iter_mut().zip(&mut replicas.states) {
            kernel.rebuild(state);
            let ln_penalised = kernel.ln_penalised_here(state);
            kernel.adopt(state, ln_penalised);
        }
    }

    /// Goes on after these swaps.
    pub fn go_on(&mut self, swaps: Vec<SwapCounts>) {
        self.swaps = swaps;
    }

    /// Swaps so far between rungs k and k + 1.
    pub fn swaps(&self) -> &[SwapCounts] {
        &self.swaps
    }

    /// Step number `step` of every rung, each with a generator of its own; says what the coldest
    /// did.
    pub fn step(&mut self, replicas: &mut Replicas, step: u64, rngs: &mut [impl Rng]) -> StepInfo {
        self.step_where(replicas, step, rngs, |ln_alpha, u| libm::log(u) < ln_alpha)
    }

    /// As [`step`](Self::step), where `accepts` decides on a swap by ln α and a uniform number.
    pub(super) fn step_where(
        &mut self,
        replicas: &mut Replicas,
        step: u64,
        rngs: &mut [impl Rng],
        accepts: impl Fn(f64, f64) -> bool,
    ) -> StepInfo {
        let n = self.kernels.len();
        // The first of a pair is even in one round and odd in the next.
        let first = (step + 1)
            .is_multiple_of(self.swap_interval)
            .then(|| ((step + 1) / self.swap_interval % 2) as usize);
        let mut cold = None;
        let mut rung = 0;
        while rung < n {
            let swaps = first.is_some_and(|first| rung % 2 == first) && rung + 1 < n;
            let info = if swaps {
                let u = 1.0 - rngs[rung].random::<f64>();
                self.swap(replicas, rung, |ln_alpha| accepts(ln_alpha, u))
            } else {
                let state = &mut replicas.states[rung];
                self.kernels[rung].step(state, step, &mut rngs[rung])
            };
            cold = cold.or(Some(info));
            rung += 1 + usize::from(swaps);
        }
        if first.is_some() {
            replicas.arrived();
        }
        cold.expect("a ladder has rungs")
    }

    /// Proposes that the replicas on rungs `cold` and `cold` + 1 change places.
    fn swap(
        &mut self,
        replicas: &mut Replicas,
        cold: usize,
        accepts: impl Fn(f64) -> bool,
    ) -> StepInfo {
        let hot = cold + 1;
        let states = &replicas.states;
        let cold_when_hot = self.kernels[hot].ln_penalised(&states[cold]);
        let hot_when_cold = self.kernels[cold].ln_penalised(&states[hot]);
        let now = self.kernels[cold].ln_penalised_here(&states[cold])
            + self.kernels[hot].ln_penalised_here(&states[hot]);
        let ln_alpha = (cold_when_hot + hot_when_cold) - now;
        let accepted = accepts(ln_alpha);
        if accepted {
            replicas.states.swap(cold, hot);
            replicas.replica_at.swap(cold, hot);
            self.kernels[cold].adopt(&mut replicas.states[cold], hot_when_cold);
            self.kernels[hot].adopt(&mut replicas.states[hot], cold_when_hot);
        }
        let counts = &mut self.swaps[cold];
        counts.proposed += 1;
        counts.accepted += u64::from(accepted);
        let n_sets = replicas.states[cold].partition.n_sets();
        StepInfo {
            kind: MoveKind::Swap,
            outcome: if accepted {
                Outcome::Accepted
            } else {
                Outcome::Rejected
            },
            evaluated: true,
            underflowed: false,
            n_new_sets: if accepted { n_sets as u32 } else { 0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tuned_ladder_rejects_alike_where_it_was_measured() {
        let ladder = Ladder::new(5);
        let beta = ladder.inverse_temperatures();
        assert_eq!((beta[0], beta[4]), (1.0, 0.0));
        // Even rejection leaves the ladder as it is.
        let same = ladder.tuned(&[0.3; 4]);
        for (a, b) in beta.iter().zip(same.inverse_temperatures()) {
            assert!((a - b).abs() < 1e-12);
        }
        // All of it between the first two: all rungs go there, evenly in ln β, but for the least.
        let crowded = ladder.tuned(&[0.97, 0.0, 0.0, 0.0]);
        let crowded = crowded.inverse_temperatures();
        assert!(crowded.windows(2).all(|pair| pair[0] > pair[1]));
        assert!(crowded[3] > beta[1] && crowded[4] == 0.0);
        let steps = crowded[1] / crowded[0] - crowded[2] / crowded[1];
        assert!(steps.abs() < 1e-12);
    }
}
