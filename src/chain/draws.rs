//! The trace of a chain that another program ran, from its draws.

use super::trace::{Trace, TraceRecorder};
use crate::partition::{Partition, Topology};

/// Records draws, one after the other. Each stands for a number of steps.
pub struct DrawRecorder {
    recorder: TraceRecorder,
    last: Option<(Topology, Partition, f64)>,
    n_steps: u64,
}

impl DrawRecorder {
    /// Holds at most `max_topologies` distinct topologies.
    pub fn new(max_topologies: usize) -> Self {
        Self {
            recorder: TraceRecorder::new(max_topologies),
            last: None,
            n_steps: 0,
        }
    }

    /// Draws so far, each as often as it stands for a step.
    pub fn n_steps(&self) -> u64 {
        self.n_steps
    }

    /// Adds a draw that stands for `n_steps` steps, at least one. `ln_target` is ln of its target
    /// density, or always 0 where that is not known.
    pub fn push(&mut self, topology: &Topology, ln_target: f64, n_steps: u64) {
        let is_same = |last: &(Topology, Partition, f64)| {
            last.0 == *topology && last.2.to_bits() == ln_target.to_bits()
        };
        let moves = !self.last.as_ref().is_some_and(is_same);
        let (_, partition, ln_target) = match self.last.take() {
            Some(last) if !moves => self.last.insert(last),
            last => {
                let stays = last.filter(|last| last.0 == *topology);
                let partition = stays.map_or_else(
                    || Partition::from_labels(topology.labels()),
                    |(_, partition, _)| partition,
                );
                if self.n_steps == 0 {
                    self.recorder.begin(&partition);
                }
                self.last.insert((topology.clone(), partition, ln_target))
            }
        };
        let (place, mut more) = ((&*partition, *ln_target), n_steps);
        if moves && n_steps > 0 {
            // Which sets are new is not known: all may be.
            let n_new_sets = partition.n_sets() as u32;
            self.recorder.stand(self.n_steps, place, Some(n_new_sets));
            more -= 1;
        }
        self.recorder.stay(place, more);
        self.n_steps += n_steps;
    }

    /// The trace so far.
    pub fn finish(self) -> Trace {
        self.recorder.finish()
    }
}
