//! The draws of a cell's chains on one world, at even steps after the largest burn-in of any: what other
//! programs want of a chain.
//!
//! Of chains of at most [`MAX_WHOLE`] steps every step is a draw; of longer ones every k-th, so that all
//! chains have the same number and stand at the same steps. They are of the chains' records
//! ([`ChainSeries`]), whose `stride` says whether every state was kept.

use std::collections::HashMap;

use crate::run::{ChainOutcome, ChainSeries};

/// Steps that are draws one by one.
pub const MAX_WHOLE: u64 = 10_000;

/// The draws of one chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainDraws {
    /// M.
    pub n_sets: Vec<u32>,
    /// ln P(T) + ln Ẑ(T).
    pub ln_target: Vec<f64>,
    /// The topology by its place in [`Draws::topologies`].
    pub topology: Vec<u32>,
}

/// The draws of chains on one data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Draws {
    /// Proposals left out of every chain.
    pub first_step: u64,
    /// Proposals from one draw to the next.
    pub every: u64,
    /// Largest stride of the records; 1 if every state was kept.
    pub stride: u64,
    /// Chain by chain.
    pub chains: Vec<ChainDraws>,
    /// Identities of the topologies, in the order in which they are first met.
    pub topologies: Vec<String>,
}

/// Of chains of one length; `None` without any, or if nothing is left after the burn-in.
pub fn draws(chains: &[&ChainOutcome]) -> Option<Draws> {
    let all = || chains.iter().map(|chain| &chain.series);
    let first_step = all().map(|series| series.first_step).max()?;
    let end_step = all().map(ChainSeries::end_step).min()?;
    let n_steps = end_step.checked_sub(first_step).filter(|n| *n > 0)?;
    let every = n_steps.div_ceil(MAX_WHOLE);
    let mut place_of = HashMap::new();
    let mut topologies = Vec::new();
    let mut draw = |series: &ChainSeries| {
        let mut drawn = ChainDraws {
            n_sets: Vec::new(),
            ln_target: Vec::new(),
            topology: Vec::new(),
        };
        let n_sets = series.stretches(&series.n_sets, first_step);
        let others = series
            .stretches(&series.ln_target, first_step)
            .zip(series.stretches(&series.topology, first_step));
        let mut end = 0;
        for ((n_sets, length), ((ln_target, _), (topology, _))) in n_sets.zip(others) {
            end += length;
            let identity = &series.topologies[topology as usize];
            let place = *place_of.entry(identity.clone()).or_insert_with(|| {
                topologies.push(identity.clone());
                topologies.len() as u32 - 1
            });
            // Draw k stands at the last step of its share, so that all shares are whole.
            let n_due = (end.min(n_steps) / every) as usize;
            drawn.n_sets.resize(n_due, n_sets);
            drawn.ln_target.resize(n_due, ln_target);
            drawn.topology.resize(n_due, place);
        }
        drawn
    };
    let drawn = all().map(&mut draw).collect();
    Some(Draws {
        first_step,
        every,
        stride: all().map(|series| series.stride).max()?,
        chains: drawn,
        topologies,
    })
}
