//! How a chain came to its MAP topology: from where, when, and how long anything else held it.
//!
//! A chain that rests says little by itself: it may rest anywhere. What counts is that it started
//! elsewhere, and that it has been at rest for much longer than any other topology ever held it.

use serde::{Deserialize, Serialize};

use super::series::topology_identity;
use crate::chain::{TopologyId, Trace};
use crate::partition::{Partition, Topology};

/// The way of one chain, burn-in included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Journey {
    /// Identity of the topology that the chain started from.
    pub start: String,
    /// Proposals before the chain first stood at its MAP topology.
    pub arrival: u64,
    /// Proposals of the longest stay at any one other topology.
    pub longest_hold_elsewhere: u64,
}

impl Journey {
    /// Of a trace whose chain started at `start`; `map` is its MAP topology after burn-in. A thinned
    /// trace tells both numbers to its stride.
    pub(super) fn new(trace: &Trace, start: &Topology, map: Option<&Topology>) -> Self {
        let map_id = map.map(|map| Partition::from_labels(map.labels()).hash());
        let mut journey = Self {
            start: topology_identity(start),
            arrival: trace.n_steps,
            longest_hold_elsewhere: 0,
        };
        let mut hold: (Option<TopologyId>, u64) = (None, 0);
        for (run, dwell) in trace.dwell_times(0) {
            hold = match hold {
                (Some(id), steps) if id == run.topology => (Some(id), steps + dwell),
                _ => (Some(run.topology), dwell),
            };
            if Some(run.topology) == map_id {
                journey.arrival = journey.arrival.min(run.first_step);
            } else {
                journey.longest_hold_elsewhere = journey.longest_hold_elsewhere.max(hold.1);
            }
        }
        journey
    }
}
