//! How far frequencies are from a posterior that is known.

use std::collections::HashMap;

use topometric::partition::Topology;
use topometric::run::ChainOutcome;

use super::target::{Known, Target};

/// An event of less mass, or one that nearly always happens, tells nothing of how a chain mixes.
const MATERIAL: std::ops::RangeInclusive<f64> = 0.05..=0.95;

/// A probability: by the posterior, and as sampled.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    pub exact: f64,
    pub sampled: f64,
}

impl Event {
    /// How far apart they are, in what the errors that "converged" promises explain: .05, or four
    /// standard errors at 100 effective draws a chain.
    fn off(&self, n_chains: usize) -> f64 {
        let variance = self.exact * (1.0 - self.exact) / (100.0 * n_chains as f64);
        (self.sampled - self.exact).abs() / (4.0 * variance.max(0.0).sqrt()).max(0.05)
    }

    /// (sampled − exact)² over the variance of one draw; `None` where that says nothing.
    pub fn relative_square(&self) -> Option<f64> {
        let variance = self.exact * (1.0 - self.exact);
        let off = self.sampled - self.exact;
        MATERIAL.contains(&self.exact).then(|| off * off / variance)
    }
}

/// Every pair of detections, and every topology of mass .05 or more, in the pooled draws of these chains.
pub fn events(target: &Target, chains: &[&ChainOutcome]) -> Vec<Event> {
    let n = target.n_detections;
    let mut pairs: HashMap<(usize, usize), f64> = HashMap::new();
    let mut topologies: HashMap<Topology, f64> = HashMap::new();
    let each = 1.0 / chains.len() as f64;
    for chain in chains {
        for &(i, j, share) in &chain.series.together {
            *pairs.entry((i as usize, j as usize)).or_default() += each * f64::from(share);
        }
        for top in &chain.top {
            let topology: Topology = top.labels.parse().expect("labels");
            *topologies.entry(topology).or_default() += each * top.frequency;
        }
    }
    let pair = |i: usize, j: usize| pairs.get(&(i.min(j), i.max(j))).copied().unwrap_or(0.0);
    let topology = |topology: &Topology| topologies.get(topology).copied().unwrap_or(0.0);
    let all_pairs = || (0..n).flat_map(move |i| (i + 1..n).map(move |j| (i, j)));
    match &target.known {
        Known::Table(rows) => {
            let likely = rows.iter().filter(|(_, mass)| *mass >= *MATERIAL.start());
            let of_topology = |(own, mass): &(Topology, f64)| Event {
                exact: *mass,
                sampled: topology(own),
            };
            let mut events: Vec<Event> = likely.map(of_topology).collect();
            events.extend(all_pairs().map(|(i, j)| {
                Event {
                    exact: rows
                        .iter()
                        .filter(|(own, _)| own.labels()[i] == own.labels()[j])
                        .map(|(_, mass)| mass)
                        .sum(),
                    sampled: pair(i, j),
                }
            }));
            events
        }
        Known::Dihedral => {
            let of_pair = |(i, j): (usize, usize)| Event {
                exact: (0..n).map(|k| pair((i + k) % n, (j + k) % n)).sum::<f64>() / n as f64,
                sampled: pair(i, j),
            };
            let mut events: Vec<Event> = all_pairs().map(of_pair).collect();
            for own in topologies
                .iter()
                .filter(|(_, mass)| **mass >= *MATERIAL.start())
            {
                let turned = |k: usize| -> f64 {
                    let turn = |i: usize| own.0.labels()[(i + k) % n];
                    topology(&Topology::canonical(&(0..n).map(turn).collect::<Vec<_>>()))
                };
                let exact = (0..n).map(turned).sum::<f64>() / n as f64;
                events.push(Event {
                    exact,
                    sampled: *own.1,
                });
            }
            events
        }
    }
}

/// Whether some probability is off by more than the errors explain.
pub fn is_off(events: &[Event], n_chains: usize) -> bool {
    events.iter().any(|event| event.off(n_chains) > 1.0)
}
