//! The loop of a tempered chain: its ladder is tuned in the first quarter, then stands.
//!
//! Tuning goes in rounds, each twice as long as the one before, from a first ladder that knows nothing
//! (Syed et al. 2022). What is tuned looks back at the chain, so the chain has its law from the end of the tuning
//! on; whoever counts leaves out at least that much.

use serde::{Deserialize, Serialize};

use super::position::{Position, SavedPosition, SavedStanding, Standing};
use super::{Observer, Origin, STOP_CHECK_INTERVAL};
use crate::model::{Model, Prior};
use crate::rng::{Generator, Purpose};
use crate::sampler::{Ladder, Rungs, SamplerSettings, SwapCounts, Tempering, n_tuning};

/// Rounds of tuning.
const N_ROUNDS: u32 = 6;

/// How the ladder of a tempered chain did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
fn round_ends(n_tuning: u64, n_steps: u64) -> impl Iterator<Item = u64> {
    let rounds = (0..N_ROUNDS).map(move |round| n_tuning >> (N_ROUNDS - 1 - round));
    rounds.chain([n_steps])
}

/// As [`run`](super::run), for a tempered chain.
pub(super) fn run(
    model: &Model,
    prior: Prior,
    (settings, tempering): (&SamplerSettings, Tempering),
    origin: Origin<'_>,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> SavedPosition {
    let draws = purpose.clone().text("use", "importance draws");
    let mut ladder = Ladder::new(tempering.n_temperatures);
    let mut replicas = None;
    let (mut step, mut n_tuning) = (0, n_tuning(n_steps));
    let mut rngs = generators(tempering, purpose);
    // Of the round that a saved position is in, what the swaps before it came to.
    let mut swaps_before = None;
    let start = match origin {
        Origin::Start(start) => Some(start),
        Origin::Saved(saved) => {
            let SavedStanding::Tempered {
                ladder: of_round,
                replicas: standing,
                swaps,
                rngs: drawn,
                n_tuning: tuned,
            } = saved.chain
            else {
                panic!("a position of another chain");
            };
            (ladder, replicas, rngs) = (of_round, Some(standing), drawn);
            (step, swaps_before, n_tuning) = (saved.step, Some(swaps), tuned);
            None
        }
    };
    let first = step;
    // A position is within a round, and rounds before it have tuned its ladder.
    let mut swaps_so_far = swaps_before.clone().unwrap_or_default();
    let rounds = round_ends(n_tuning, n_steps).filter(|end| start.is_some() || *end > first);
    for end in rounds {
        let models = ladder.models(model);
        let mut rungs = Rungs::new(&models, prior, (settings, tempering), &draws);
        let replicas = match (&mut replicas, start) {
            (Some(replicas), _) => {
                match swaps_before.take() {
                    Some(swaps) => rungs.go_on(swaps),
                    None => {
                        rungs.adopt(replicas);
                        replicas.forget_journeys();
                    }
                }
                replicas
            }
            (none, Some(start)) => {
                let partition = start.partition(model.n_detections(), purpose);
                let started = none.insert(rungs.init(&partition));
                observer.start(started.cold());
                started
            }
            (None, None) => unreachable!("a saved position has its replicas"),
        };
        while step < end {
            if step % STOP_CHECK_INTERVAL == 0 {
                observer.pause(&Position {
                    step,
                    chain: Standing::Tempered {
                        ladder: &ladder,
                        replicas,
                        swaps: rungs.swaps(),
                        rngs: &rngs,
                        n_tuning,
                    },
                });
                if observer.wants_stop() {
                    break;
                }
            }
            let info = rungs.step(replicas, step, &mut rngs);
            observer.step(step, replicas.cold(), &info);
            step += 1;
        }
        swaps_so_far = rungs.swaps().to_vec();
        if step < end {
            break;
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
                swaps: swaps_so_far.clone(),
                round_trips: replicas.round_trips,
                n_tuning,
            });
        }
    }
    SavedPosition {
        step,
        chain: SavedStanding::Tempered {
            ladder,
            replicas: replicas.expect("a chain that was started or saved"),
            swaps: swaps_so_far,
            rngs,
            n_tuning,
        },
    }
}

/// A generator of proposals for every rung.
fn generators(tempering: Tempering, purpose: &Purpose) -> Vec<Generator> {
    let proposals = purpose.clone().text("use", "proposals");
    let rungs = 0..tempering.n_temperatures as u64;
    rungs
        .map(|rung| proposals.clone().number("rung", rung).generator())
        .collect()
}
