//! Two chains on common random numbers, one of them L steps ahead, until they meet.
//!
//! X and Y start by themselves, by one rule. X goes L steps alone, then X at step t and Y at step t
//! − L take every step with the same random numbers. Each is a chain by itself as any other. Once
//! both stand at the same topology with the same locations, to the last bit, they never part. With
//! τ the first t at which X_t = Y_{t−L},
//!
//! TV(law of X_t, π) ≤ E[max(0, ⌈(τ − L − t)/L⌉)]
//!
//! (Biswas, Jacob & Vanetti 2019, NeurIPS, theorem 2.5). The coupling is one of explicit locations:
//! every move draws locations that depend less and less on where they were, so what is drawn with
//! the same numbers comes together, as far as numbers of a machine can be apart. How chains choose
//! among sets depends on the order in which these are listed; so both are listed anew by their
//! first detections, which changes the law of neither.

use crate::model::{Model, Prior};
use crate::rng::{Purpose, StepGenerators};
use crate::sampler::{Kernel, Placement, SamplerSettings, State};

use super::{STOP_CHECK_INTERVAL, Start};

/// Detections for each step from one listing of the sets to the next, so that it costs little.
const DETECTIONS_PER_STEP: u64 = 16;

/// What became of a pair of coupled chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meeting {
    /// The chain ahead was at step τ.
    Met(u64),
    /// They had not met when the chain ahead was there.
    Apart(u64),
    /// They were told to stop.
    Stopped,
}

/// A pair of chains of a model with explicit locations, from starts of one rule.
pub struct Pair<'a> {
    /// The model.
    pub model: &'a Model,
    /// The prior.
    pub prior: Prior,
    /// How both move.
    pub settings: &'a SamplerSettings,
    /// Where both start.
    pub start: &'a Start,
    /// L ≥ 1, steps that X is ahead.
    pub lag: u64,
}

impl Pair<'_> {
    /// Runs both until they meet, X at most to step `most`.
    pub fn meet(&self, most: u64, purpose: &Purpose, stop: &dyn Fn() -> bool) -> Meeting {
        let mut coupled = self.begin(purpose);
        while !coupled.has_met() {
            let step = coupled.step;
            if step >= most {
                return Meeting::Apart(step);
            }
            if step.is_multiple_of(STOP_CHECK_INTERVAL) && stop() {
                return Meeting::Stopped;
            }
            coupled.go();
        }
        Meeting::Met(coupled.step)
    }

    fn begin(&self, purpose: &Purpose) -> Coupled<'_> {
        let begun = |who: &str| {
            let own = purpose.clone().text("coupled", who);
            let generators = StepGenerators::new(&own.clone().text("use", "locations"));
            let mut kernel = Kernel::new(self.model, self.prior, self.settings, generators);
            let n = self.model.n_detections();
            let state = kernel.init(self.start.partition(n, &own));
            (kernel, state)
        };
        Coupled {
            chains: [begun("ahead"), begun("behind")],
            steps: StepGenerators::new(&purpose.clone().text("coupled", "steps")),
            lag: self.lag,
            step: 0,
            list_every: 1 + self.model.n_detections() as u64 / DETECTIONS_PER_STEP,
        }
    }
}

/// Both chains on their way: X at `step`, Y `lag` steps behind once X is that far.
struct Coupled<'a> {
    chains: [(Kernel<'a>, State); 2],
    steps: StepGenerators,
    lag: u64,
    step: u64,
    list_every: u64,
}

impl Coupled<'_> {
    /// One step of X, and the same of Y if it has begun.
    fn go(&mut self) {
        let n_going = if self.step < self.lag { 1 } else { 2 };
        for (kernel, state) in &mut self.chains[..n_going] {
            if self.step.is_multiple_of(self.list_every) {
                kernel.list_anew(state);
            }
            kernel.step(state, self.step, &mut self.steps.at(self.step));
        }
        self.step += 1;
    }

    fn has_met(&self) -> bool {
        let [(_, ahead), (_, behind)] = &self.chains;
        self.step >= self.lag
            && ahead.partition().hash() == behind.partition().hash()
            && ahead.locations().map(Placement::locations_m)
                == behind.locations().map(Placement::locations_m)
    }
}

#[cfg(test)]
mod tests;
