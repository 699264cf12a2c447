//! States of a chain at even steps, where its topologies do not all fit.
//!
//! A chain of a thousand detections seldom comes back to a topology. Which of them it met most often
//! says little then, and a verdict needs to see whole topologies at known steps: whether chains agree
//! on a pair of detections, and how fast they forget. So a trace that is no longer whole keeps its
//! state at every k-th step, with k doubled as often as needed.

use serde::{Deserialize, Serialize};

use super::topologies::TopologyId;
use crate::partition::Topology;

/// Snapshots held at most.
const MOST: usize = 1000;
/// Labels held at most, bytes.
const MOST_LABEL_BYTES: usize = 24 << 20;
/// So many snapshots are held whatever their size.
const FEWEST: usize = 128;

/// A state of a chain.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshot {
    /// Its topology.
    pub topology: Topology,
    /// The identity of that.
    pub id: TopologyId,
    /// M.
    pub n_sets: u32,
    /// ln P(T) + ln Ẑ(T).
    pub ln_target: f64,
}

/// The states after step 0, `every`, 2·`every` and so on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshots {
    every: u64,
    states: Vec<Snapshot>,
    most: usize,
}

impl Snapshots {
    /// Of a chain of N detections that made `n_steps` steps so far; `state` gives the state after
    /// one of them, which are asked for in order.
    pub(super) fn new(
        n_detections: usize,
        n_steps: u64,
        mut state: impl FnMut(u64) -> Snapshot,
    ) -> Self {
        let bytes = n_detections * size_of::<u32>();
        let most = (MOST_LABEL_BYTES / bytes.max(1)).clamp(FEWEST, MOST);
        let mut every = 1;
        while n_steps.div_ceil(every) > most as u64 {
            every *= 2;
        }
        let states = (0..n_steps.div_ceil(every)).map(|k| state(k * every));
        Self {
            every,
            states: states.collect(),
            most,
        }
    }

    /// Keeps the state after the next step that is due.
    pub(super) fn push(&mut self, state: Snapshot) {
        self.states.push(state);
        if self.states.len() > self.most {
            let mut place = 0;
            self.states.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// Steps from one snapshot to the next.
    pub fn every(&self) -> u64 {
        self.every
    }

    /// The snapshots of a chain of `n_steps` steps from step `burn_in` on. Each stands for the steps
    /// to the next one, the first also for those before it.
    pub fn after(&self, burn_in: u64, n_steps: u64) -> impl Iterator<Item = (&Snapshot, u64)> {
        let first = burn_in.div_ceil(self.every);
        let kept = self.states.iter().zip(0_u64..).skip(first as usize);
        kept.map(move |(state, k)| {
            let start = if k == first { burn_in } else { k * self.every };
            (state, ((k + 1) * self.every).min(n_steps) - start)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(step: u64) -> Snapshot {
        Snapshot {
            topology: Topology::canonical(&[0_u32, 1]),
            id: 0,
            n_sets: 2,
            ln_target: step as f64,
        }
    }

    #[test]
    fn snapshots_stand_at_even_steps() {
        for n_before in [1, 700, 1000, 1001, 5000] {
            let mut snapshots = Snapshots::new(2, n_before, state);
            for n_steps in n_before + 1..=20_000 {
                let step = n_steps - 1;
                if step.is_multiple_of(snapshots.every()) {
                    snapshots.push(state(step));
                }
                if n_steps % 977 != 0 {
                    continue;
                }
                for burn_in in [0, 1, n_steps / 3] {
                    let kept: Vec<_> = snapshots.after(burn_in, n_steps).collect();
                    let (n, every) = (kept.len() as u64, snapshots.every());
                    assert!(n <= 1000 && (n + 1) * every >= n_steps - burn_in);
                    let total: u64 = kept.iter().map(|(_, steps)| steps).sum();
                    assert_eq!(total, n_steps - burn_in);
                    for (state, _) in &kept {
                        let step = state.ln_target as u64;
                        assert!(step >= burn_in && step.is_multiple_of(every));
                    }
                }
            }
            assert_eq!(snapshots.every(), 32);
        }
    }
}
