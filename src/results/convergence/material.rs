//! The quantities that a verdict rests on: what the chains are really unsure of.
//!
//! M and ln target may agree in chains that stand at different topologies. So a verdict also looks
//! at the topology itself, by indicators whose mean over all chains is neither near 0 nor near 1:
//!
//! - M, unless one value holds .95 of all draws;
//! - up to six topologies, those sampled most, of a share in \[.05, .95\];
//! - up to 24 pairs of detections that share a set in a share in \[.05, .95\] of the draws.
//!
//! Constants, near-constants and rare events say nothing: they are neither a pass nor a doubt.
//! Where more than 24 pairs are material, those first by a fixed hash are taken
//! ([`rank`]): a choice that depends on nothing that the chains did.

use std::collections::HashMap;

use super::quantity::Quantity;
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::undefined::Undefined;
use crate::run::{ChainOutcome, PairSeries, UNSURE, rank};

/// An event of a smaller share, or one that fails in a smaller share, is not material.
const LEAST_SHARE: f64 = 0.05;
const MAX_TOPOLOGIES: usize = 6;
const MAX_PAIRS: usize = 24;

/// One quantity with its draws.
pub(in crate::results) struct Material {
    pub quantity: Quantity,
    pub chains: Chains,
}

fn is_material(share: f64) -> bool {
    (LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&share)
}

/// Of the chains from step `first_step` on; `topologies` has their topologies in one numbering.
pub(in crate::results) fn material(
    chains: &[&ChainOutcome],
    first_step: u64,
    topologies: &[Vec<(u32, u64)>],
) -> Result<Vec<Material>, Undefined> {
    let n_sets = n_sets(chains, first_step)?;
    let mut found = Vec::new();
    if largest_atom(&n_sets) < 1.0 - LEAST_SHARE {
        found.push(Material {
            quantity: Quantity::NSets,
            chains: n_sets,
        });
    }
    for (place, (index, share)) in ranked(topologies).into_iter().enumerate() {
        if !is_material(share) || place >= MAX_TOPOLOGIES {
            continue;
        }
        let stands = |&(own, n): &(u32, u64)| (f64::from(u8::from(own == index)), n);
        let draws: Vec<Vec<Stretch>> = topologies
            .iter()
            .map(|chain| chain.iter().map(stands).collect())
            .collect();
        found.push(Material {
            quantity: Quantity::Topology(place + 1),
            chains: Chains::new(&draws)?,
        });
    }
    let mut pairs: Vec<(u32, u32)> = chains
        .iter()
        .flat_map(|chain| chain.series.unsure_pairs.iter().map(|own| own.pair))
        .collect();
    pairs.sort_unstable_by_key(|pair| (std::cmp::Reverse(rank(*pair)), *pair));
    pairs.dedup();
    let mut n_pairs = 0;
    for pair in pairs {
        if n_pairs == MAX_PAIRS {
            break;
        }
        let draws: Option<Vec<Vec<Stretch>>> = chains
            .iter()
            .map(|chain| of_pair(chain, pair, first_step))
            .collect();
        let Some(draws) = draws else { continue };
        let draws = Chains::new(&draws)?;
        if is_material(draws.mean()) {
            n_pairs += 1;
            found.push(Material {
                quantity: Quantity::Pair(pair.0, pair.1),
                chains: draws,
            });
        }
    }
    Ok(found)
}

/// M of every chain from step `first_step` on.
pub(in crate::results) fn n_sets(
    chains: &[&ChainOutcome],
    first_step: u64,
) -> Result<Chains, Undefined> {
    let of_chain = |chain: &&ChainOutcome| -> Vec<Stretch> {
        let series = &chain.series;
        let kept = series.stretches(&series.n_sets, first_step);
        kept.map(|(m, n)| (f64::from(m), n)).collect()
    };
    Chains::new(&chains.iter().map(of_chain).collect::<Vec<_>>())
}

/// Share of the draws at the value that has most of them.
fn largest_atom(draws: &Chains) -> f64 {
    let mut counts: HashMap<u64, u64> = HashMap::new();
    for (value, n) in draws.pooled() {
        *counts.entry(value.to_bits()).or_default() += n;
    }
    let most = counts.into_values().max().unwrap_or(0);
    most as f64 / draws.n_total() as f64
}

/// Topologies by falling share of the draws of all chains.
fn ranked(topologies: &[Vec<(u32, u64)>]) -> Vec<(u32, f64)> {
    let mut counts: HashMap<u32, u64> = HashMap::new();
    for (index, n) in topologies.iter().flatten() {
        *counts.entry(*index).or_default() += n;
    }
    let total = counts.values().sum::<u64>() as f64;
    let mut ranked: Vec<(u32, u64)> = counts.into_iter().collect();
    ranked.sort_unstable_by_key(|&(index, n)| (std::cmp::Reverse(n), index));
    ranked
        .into_iter()
        .map(|(index, n)| (index, n as f64 / total))
        .collect()
}

/// Whether a pair shares a set, along one chain. A chain that is sure of a pair has no series of it,
/// only its share, which then stands for all of its draws. `None` if the chain is unsure of the pair
/// but has kept others.
fn of_pair(chain: &ChainOutcome, pair: (u32, u32), first_step: u64) -> Option<Vec<Stretch>> {
    let series = &chain.series;
    if let Some(own) = series.unsure_pairs.iter().find(|own| own.pair == pair) {
        return Some(stretches(chain, own, first_step));
    }
    let place = series
        .together
        .binary_search_by_key(&pair, |&(i, j, _)| (i, j));
    let share = place.map_or(0.0, |place| f64::from(series.together[place].2));
    let n_steps = series.end_step() - first_step;
    match share {
        share if share < UNSURE => Some(vec![(0.0, n_steps)]),
        share if share > 1.0 - UNSURE => Some(vec![(1.0, n_steps)]),
        _ => None,
    }
}

fn stretches(chain: &ChainOutcome, pair: &PairSeries, first_step: u64) -> Vec<Stretch> {
    let places: Vec<usize> = (0..chain.series.lengths.len()).collect();
    let kept = chain.series.stretches(&places, first_step);
    kept.map(|(k, n)| (f64::from(u8::from(pair.is_together(k))), n))
        .collect()
}
