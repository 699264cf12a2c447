//! Draws of several chains, one after the other, into traces.

use std::collections::HashMap;

use crate::chain::{DrawRecorder, Trace};
use crate::partition::Topology;

use super::MAX_WEIGHT;

/// Chains of one length on the same items.
pub struct LabelChains {
    /// N, items of a draw.
    pub n_items: usize,
    /// In the order in which they were first met.
    pub chains: Vec<LabelChain>,
    /// Draws, weights counted in, that were left out at the ends of longer chains.
    pub n_left_out: u64,
}

/// A chain.
pub struct LabelChain {
    /// Its file, and its name there.
    pub name: String,
    /// Its draws.
    pub trace: Trace,
    /// The first of them.
    pub start: Topology,
}

/// Draws that will not do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// What is there.
    pub got: String,
    /// What may be there.
    pub expected: String,
    /// What to change.
    pub change: &'static str,
}

/// Takes draws in.
pub struct Collector {
    max_topologies: usize,
    file: String,
    n_items: Option<usize>,
    chains: Vec<(String, DrawRecorder, Topology)>,
    /// By name within the file.
    place_of: HashMap<String, usize>,
}

impl Collector {
    /// Holds at most `max_topologies` distinct topologies of each chain.
    pub fn new(max_topologies: usize) -> Self {
        Self {
            max_topologies,
            file: String::new(),
            n_items: None,
            chains: Vec::new(),
            place_of: HashMap::new(),
        }
    }

    /// Whether it has taken in no draw.
    pub fn is_empty(&self) -> bool {
        self.chains.is_empty()
    }

    /// Another file: its chains are others, whatever their names.
    pub fn begin_file(&mut self, file: &str) {
        file.clone_into(&mut self.file);
        self.place_of.clear();
    }

    /// A draw of a chain, with the number of steps that it stands for and ln of its target density,
    /// 0 where that is not known. A chain without a name is the only one of its file.
    ///
    /// # Errors
    /// Another number of labels than those before, or a weight that is 0 or too large.
    pub fn push(
        &mut self,
        chain: &str,
        topology: &Topology,
        (n_steps, ln_target): (u64, f64),
    ) -> Result<(), Refused> {
        let (n, wanted) = (topology.labels().len(), self.n_items);
        if n == 0 || wanted.is_some_and(|wanted| wanted != n) {
            return Err(Refused {
                got: format!("{n} labels"),
                expected: match wanted {
                    Some(wanted) => format!("{wanted} as in the draws before"),
                    None => "at least one".to_owned(),
                },
                change: "give every draw one label for each item",
            });
        }
        if !(1..=MAX_WEIGHT).contains(&n_steps) {
            return Err(Refused {
                got: format!("the weight {n_steps}"),
                expected: format!("a whole number from 1 to {MAX_WEIGHT}"),
                change: "write how many steps the draw stands for",
            });
        }
        self.n_items = Some(n);
        let place = match self.place_of.get(chain) {
            Some(place) => *place,
            None => {
                let name = if chain.is_empty() {
                    self.file.clone()
                } else {
                    format!("{}, chain {chain}", self.file)
                };
                self.place_of.insert(chain.to_owned(), self.chains.len());
                let recorder = DrawRecorder::new(self.max_topologies);
                self.chains.push((name, recorder, topology.clone()));
                self.chains.len() - 1
            }
        };
        self.chains[place].1.push(topology, ln_target, n_steps);
        Ok(())
    }

    /// All chains, cut to the shortest. `Err` has the name of one that is too long to be cut.
    ///
    /// # Errors
    /// A chain longer than the shortest whose trace is not whole any more.
    pub fn finish(self) -> Result<LabelChains, String> {
        let lengths = self.chains.iter().map(|chain| chain.1.n_steps());
        let shortest = lengths.clone().min().unwrap_or(0);
        let n_left_out = lengths.map(|n| n - shortest).sum();
        let cut = |(name, recorder, start): (String, DrawRecorder, Topology)| match recorder
            .finish()
            .cut_to(shortest)
        {
            Some(trace) => Ok(LabelChain { name, trace, start }),
            None => Err(name),
        };
        let chains: Result<Vec<LabelChain>, String> = self.chains.into_iter().map(cut).collect();
        Ok(LabelChains {
            n_items: self.n_items.unwrap_or(0),
            chains: chains?,
            n_left_out,
        })
    }
}
