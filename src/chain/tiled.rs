//! The loop of a chain in tiles: several threads run an epoch, while the one before is told step by
//! step.

use std::ops::Range;
use std::panic;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use serde::{Deserialize, Serialize};

use super::position::{Position, SavedPosition, SavedStanding, Standing};
use super::{Observer, Origin};
use crate::model::{Model, Prior};
use crate::rng::{Purpose, StepGenerators};
use crate::sampler::tiles::{Cut, Scene, TileRun, Tiles};
use crate::sampler::{Kernel, SamplerSettings, State};

/// Where a chain in tiles stands at the beginning of an epoch.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Tiled {
    state: State,
    /// All locations.
    x_m: Vec<[f64; 2]>,
    /// Epochs with one tile at the start.
    n_whole: u64,
}

/// As [`run`](super::run), for a chain in tiles. A chain that ends within an epoch is saved as it
/// stood at the beginning of it: one that goes on makes its steps again and tells those to come.
pub(super) fn run(
    model: &Model,
    prior: Prior,
    settings: &SamplerSettings,
    origin: Origin<'_>,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> SavedPosition {
    let tiles = Tiles::new(model, prior, settings, purpose);
    let (mut step, mut stands) = begin(&tiles, (model, prior, settings), origin, purpose, observer);
    lead(&tiles, &mut stands, &mut step, n_steps, observer);
    SavedPosition {
        step,
        chain: SavedStanding::Tiled(stands),
    }
}

/// The next step of a chain, and where it stands.
fn begin(
    tiles: &Tiles<'_>,
    (model, prior, settings): (&Model, Prior, &SamplerSettings),
    origin: Origin<'_>,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> (u64, Box<Tiled>) {
    match origin {
        Origin::Start(start) => {
            let draws = purpose.clone().text("use", "importance draws");
            let mut kernel = Kernel::new(model, prior, settings, StepGenerators::new(&draws));
            let mut state = kernel.init(start.partition(model.n_detections(), purpose));
            observer.start(&state);
            let stands = Tiled {
                x_m: state.take_locations(),
                n_whole: tiles.n_whole(state.partition()),
                state,
            };
            (0, Box::new(stands))
        }
        Origin::Saved(saved) => match saved.chain {
            SavedStanding::Tiled(stands) => (saved.step, stands),
            _ => panic!("a position of another chain"),
        },
    }
}

/// What the tiles of an epoch did, not told yet.
struct Untold {
    cut: Cut,
    runs: Vec<TileRun>,
    /// The first step of the epoch, and the first that is not made.
    steps: Range<u64>,
}

/// Leads a chain on to step `n_steps`. While the tiles of an epoch run, the epoch before is told.
fn lead(
    tiles: &Tiles<'_>,
    stands: &mut Tiled,
    step: &mut u64,
    n_steps: u64,
    observer: &mut impl Observer,
) {
    let length = tiles.epoch_length();
    let mut first = *step / length * length;
    let mut ahead = Scene::new(stands.state.partition(), &stands.x_m);
    let mut untold: Option<Untold> = None;
    while first < n_steps {
        let steps = first..n_steps.min(first + length);
        let epoch = (first / length, stands.n_whole);
        let cut = tiles.cut(&ahead, epoch, steps.end - first);
        let (n_threads, mut stops) = (observer.n_threads(), false);
        let run = |tile| tiles.run(&cut, tile, &ahead);
        let runs = on_threads(n_threads, &cut.by_work(), run, || {
            if let Some(untold) = untold.take() {
                tell(tiles, &untold, stands, step, observer);
            }
            if *step == first {
                observer.pause(&Position {
                    step: *step,
                    chain: Standing::Tiled(stands),
                });
                stops = observer.wants_stop();
            }
        });
        if stops {
            break;
        }
        ahead = ahead.after(&cut, &runs);
        untold = Some(Untold { cut, runs, steps });
        first += length;
    }
    if let Some(untold) = untold {
        tell(tiles, &untold, stands, step, observer);
    }
}

/// Tells an epoch, of which the steps before `step` are told. Where it is cut off the chain stays at
/// its beginning.
fn tell(
    tiles: &Tiles<'_>,
    untold: &Untold,
    stands: &mut Tiled,
    step: &mut u64,
    observer: &mut impl Observer,
) {
    let Untold { cut, runs, steps } = untold;
    let is_cut_off = steps.end - steps.start < tiles.epoch_length();
    let before = is_cut_off.then(|| stands.state.clone());
    let mut replay = tiles.replay(cut, runs);
    for at in steps.clone() {
        let info = replay.step(&mut stands.state);
        let info = info.expect("as many steps as were dealt");
        if at >= *step {
            observer.step(at, &stands.state, &info);
        }
    }
    *step = steps.end;
    match before {
        Some(before) => stands.state = before,
        None => tiles.settle(cut, runs, &mut stands.state, &mut stands.x_m),
    }
}

/// What `run` gives for each number below their count, in this order by so many threads; this one
/// does something else first.
fn on_threads<T: Send>(
    n_threads: usize,
    order: &[usize],
    run: impl Fn(usize) -> T + Sync,
    first: impl FnOnce(),
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let Some(&ix) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push((ix, run(ix)));
        }
        done
    };
    let mut done = thread::scope(|scope| {
        let n_more = n_threads.saturating_sub(1).min(order.len());
        let more: Vec<_> = (0..n_more).map(|_| scope.spawn(work)).collect();
        first();
        let mut done = work();
        for thread in more {
            match thread.join() {
                Ok(own) => done.extend(own),
                Err(panicked) => panic::resume_unwind(panicked),
            }
        }
        done
    });
    done.sort_unstable_by_key(|(ix, _)| *ix);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests;
