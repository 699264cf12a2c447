//! The loop of a tempered chain: its ladder is tuned in the first quarter, then stands.
//!
//! Tuning goes in rounds, each twice as long as the one before, from a first ladder that knows nothing
//! (Syed et al. 2022). What is tuned looks back at the chain, so the chain has its law from the end of the tuning
//! on; whoever counts leaves out at least that much.

use super::{Observer, STOP_CHECK_INTERVAL, Start};
use crate::model::{Model, Prior};
use crate::rng::{Generator, Purpose};
use crate::sampler::{Ladder, Rungs, SamplerSettings, SwapCounts, Tempering, n_tuning};

/// Rounds of tuning.
const N_ROUNDS: u32 = 6;

/// How the ladder of a tempered chain did.
#[derive(Clone, Debug, PartialEq)]
pub struct TemperingReport {
    /// β of every rung, from 1 to 0.
    pub inverse_temperatures: Vec<f64>,
    /// Swaps between neighbours since the ladder stands.
    pub swaps: Vec<SwapCounts>,
    /// Journeys of replicas from the coldest rung to the hottest and back since then.
    pub round_trips: u64,
    /// Steps in which the ladder was tuned.
    pub n_tuning: u64,
}

/// The last step of every round of tuning, and of the chain.
fn round_ends(n_steps: u64) -> impl Iterator<Item = u64> {
    let rounds = (0..N_ROUNDS).map(move |round| n_tuning(n_steps) >> (N_ROUNDS - 1 - round));
    rounds.chain([n_steps])
}

/// As [`run`](super::run), for a tempered chain.
pub(super) fn run(
    model: &Model,
    prior: Prior,
    (settings, tempering): (&SamplerSettings, Tempering),
    start: &Start,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> u64 {
    let draws = purpose.clone().text("use", "importance draws");
    let proposals = purpose.clone().text("use", "proposals");
    let rungs = 0..tempering.n_temperatures as u64;
    let mut rngs: Vec<Generator> = rungs
        .map(|rung| proposals.clone().number("rung", rung).generator())
        .collect();
    let mut ladder = Ladder::new(tempering.n_temperatures);
    let mut replicas = None;
    let mut step = 0;
    for end in round_ends(n_steps) {
        let models = ladder.models(model);
        let mut rungs = Rungs::new(&models, prior, (settings, tempering), &draws);
        let replicas = match &mut replicas {
            Some(replicas) => {
                rungs.adopt(replicas);
                replicas
            }
            none => {
                let partition = start.partition(model.n_detections(), purpose);
                let started = none.insert(rungs.init(&partition));
                observer.start(started.cold());
                started
            }
        };
        replicas.forget_journeys();
        while step < end {
            if step % STOP_CHECK_INTERVAL == 0 && observer.wants_stop() {
                return step;
            }
            let info = rungs.step(replicas, step, &mut rngs);
            observer.step(step, replicas.cold(), &info);
            step += 1;
        }
        if end < n_steps {
            let rejected: Vec<f64> = rungs
                .swaps()
                .iter()
                .map(SwapCounts::rejected_share)
                .collect();
            ladder = ladder.tuned(&rejected);
        } else {
            observer.tempered(&TemperingReport {
                inverse_temperatures: ladder.inverse_temperatures().to_vec(),
                swaps: rungs.swaps().to_vec(),
                round_trips: replicas.round_trips,
                n_tuning: n_tuning(n_steps),
            });
        }
    }
    n_steps
}
