//! The loop over steps: from a kernel and a start to a trace.
//!
//! The loop knows no clock and no file; it speaks outward through one [`Observer`]. A chain in
//! tiles may use several threads, which change nothing but the time that it takes.

mod coupled;
mod draws;
mod position;
mod snapshots;
mod tempered;
mod tiled;
mod topologies;
mod trace;
mod windows;

pub use coupled::{Meeting, Pair};
pub use draws::DrawRecorder;
pub use position::{Position, SavedPosition};
pub use snapshots::{Snapshot, Snapshots};
pub use tempered::TemperingReport;
pub use topologies::{TopologyCount, TopologyId, TopologyTable};
pub use trace::{MAX_RUNS, MoveCounts, Run, Trace, TraceRecorder};
pub use windows::{ChainSums, PairSteps, Sums};

use crate::model::{Model, Prior};
use crate::partition::Partition;
use crate::rng::{Purpose, StepGenerators};
use crate::sampler::{Kernel, SamplerSettings, State, StepInfo};

use position::{SavedStanding, Standing};

/// What wants to know of a chain. Every method has a default that does nothing.
pub trait Observer {
    /// The start, before the first step.
    fn start(&mut self, _state: &State) {}
    /// After step number `step`, counted from 0.
    fn step(&mut self, _step: u64, _state: &State, _info: &StepInfo) {}
    /// After the last step of a tempered chain: how its ladder did.
    fn tempered(&mut self, _report: &TemperingReport) {}
    /// Every [`STOP_CHECK_INTERVAL`] steps, before the question whether to stop: where the chain stands.
    fn pause(&mut self, _position: &Position<'_>) {}
    /// Asked every [`STOP_CHECK_INTERVAL`] steps; `true` ends the chain there.
    fn wants_stop(&mut self) -> bool {
        false
    }
    /// Threads that a chain in tiles may use. They change nothing but the time that it takes.
    fn n_threads(&self) -> usize {
        1
    }
}

/// Steps between two questions whether to stop: seconds at most where a step takes a tenth of one, and
/// nothing to speak of where it takes a microsecond.
pub const STOP_CHECK_INTERVAL: u64 = 16;

impl<A: Observer, B: Observer> Observer for (A, B) {
    fn start(&mut self, state: &State) {
        self.0.start(state);
        self.1.start(state);
    }
    fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
        self.0.step(step, state, info);
        self.1.step(step, state, info);
    }
    fn tempered(&mut self, report: &TemperingReport) {
        self.0.tempered(report);
        self.1.tempered(report);
    }
    fn pause(&mut self, position: &Position<'_>) {
        self.0.pause(position);
        self.1.pause(position);
    }
    fn wants_stop(&mut self) -> bool {
        self.0.wants_stop() || self.1.wants_stop()
    }
    fn n_threads(&self) -> usize {
        self.0.n_threads().max(self.1.n_threads())
    }
}

/// Where a chain starts.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// Every detection by itself.
    Singletons,
    /// All detections together.
    OneCluster,
    /// A random partition, another one for each chain.
    Random,
    /// A given topology: the truth, or one read from a file.
    At(crate::partition::Topology),
}

impl Start {
    /// The partition that a chain of this purpose starts from.
    pub fn partition(&self, n_detections: usize, purpose: &Purpose) -> Partition {
        match self {
            Self::Singletons => Partition::singletons(n_detections),
            Self::OneCluster => Partition::one_cluster(n_detections),
            Self::Random => Partition::random(
                n_detections,
                &mut purpose.clone().text("use", "start").generator(),
            ),
            Self::At(topology) => Partition::from_labels(topology.labels()),
        }
    }
}

/// Runs `n_steps` steps from `start`. Everything random comes from `purpose`: one generator for the
/// start, one for the proposals, and one for each step's importance draws. Returns where the chain
/// stands, which is before step `n_steps` if the observer stopped it. Of a tempered chain the
/// observer sees the coldest rung; its ladder is tuned in the first quarter of these `n_steps`,
/// however far the chain is led afterwards.
pub fn run(
    model: &Model,
    prior: Prior,
    settings: &SamplerSettings,
    start: &Start,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> SavedPosition {
    let start = Origin::Start(start);
    go(model, prior, settings, start, n_steps, purpose, observer)
}

/// Goes on to step `n_steps` from where the chain of this model, prior, settings and purpose stood,
/// with the observer that saw it until there. Returns as [`run`].
pub fn resume(
    model: &Model,
    prior: Prior,
    settings: &SamplerSettings,
    position: SavedPosition,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> SavedPosition {
    let position = Origin::Saved(Box::new(position));
    go(model, prior, settings, position, n_steps, purpose, observer)
}

/// Where the loop begins.
enum Origin<'a> {
    Start(&'a Start),
    Saved(Box<SavedPosition>),
}

fn go(
    model: &Model,
    prior: Prior,
    settings: &SamplerSettings,
    origin: Origin<'_>,
    n_steps: u64,
    purpose: &Purpose,
    observer: &mut impl Observer,
) -> SavedPosition {
    if let Some(tempering) = settings.tempering {
        let settings = (settings, tempering);
        return tempered::run(model, prior, settings, origin, n_steps, purpose, observer);
    }
    if settings.tiles {
        return tiled::run(model, prior, settings, origin, n_steps, purpose, observer);
    }
    let draws = purpose.clone().text("use", "importance draws");
    let mut kernel = Kernel::new(model, prior, settings, StepGenerators::new(&draws));
    let (first, mut state, mut rng) = match origin {
        Origin::Start(start) => {
            let state = kernel.init(start.partition(model.n_detections(), purpose));
            observer.start(&state);
            let rng = purpose.clone().text("use", "proposals").generator();
            (0, state, rng)
        }
        Origin::Saved(saved) => match saved.chain {
            SavedStanding::Plain { state, rng } => (saved.step, *state, rng),
            _ => panic!("a position of another chain"),
        },
    };
    let mut step = first;
    while step < n_steps {
        if step % STOP_CHECK_INTERVAL == 0 {
            observer.pause(&Position {
                step,
                chain: Standing::Plain {
                    state: &state,
                    rng: &rng,
                },
            });
            if observer.wants_stop() {
                break;
            }
        }
        let info = kernel.step(&mut state, step, &mut rng);
        observer.step(step, &state, &info);
        step += 1;
    }
    SavedPosition {
        step,
        chain: SavedStanding::Plain {
            state: Box::new(state),
            rng,
        },
    }
}
