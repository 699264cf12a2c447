//! Dimensionality traces: of one chain, and of many by their start.

use super::super::{Figure, Material};
use crate::figure::dimensionality_trace::{ChainTrace, TraceBin};
use crate::figure::traces_by_init::{InitTraces, TracesByInit};
use crate::run::ChainOutcome;

/// Traces overlaid for one start at most; more only blacken the panel.
const N_TRACES: usize = 40;

pub(super) fn chain_trace(outcome: &ChainOutcome, name: String) -> ChainTrace {
    let bins = outcome.n_sets_bins.iter();
    let bins = bins.map(|(first_step, min, max, mean)| TraceBin {
        first_step,
        min,
        max,
        mean,
    });
    ChainTrace {
        name,
        bins: bins.collect(),
        end_step: outcome.n_steps,
    }
}

/// One panel for each initial topology.
pub(super) fn by_init(material: Material<'_>) -> Option<Figure> {
    let mut inits: Vec<InitTraces> = Vec::new();
    let mut truth: Vec<u64> = Vec::new();
    let mut n_total = 0;
    for chain in &material.results.chains {
        let Some(outcome) = chain.outcome() else {
            continue;
        };
        n_total += 1;
        truth.extend(outcome.n_landmarks);
        let name = material.sweep.cells[chain.cell].settings.text("init");
        if !inits.iter().any(|init| init.name == name) {
            inits.push(InitTraces {
                name: name.to_owned(),
                chains: Vec::new(),
            });
        }
        if let Some(init) = inits.iter_mut().find(|init| init.name == name) {
            init.chains.push(chain_trace(outcome, String::new()));
        }
    }
    if inits.is_empty() {
        return None;
    }
    for init in &mut inits {
        let n = init.chains.len();
        if n > N_TRACES {
            let mut place = 0;
            init.chains.retain(|_| {
                place += 1;
                // Every k-th, evenly: the cells of a sweep are ordered by their factors.
                (place * N_TRACES) / n != ((place - 1) * N_TRACES) / n
            });
        }
    }
    truth.dedup();
    let shown: usize = inits.iter().map(|init| init.chains.len()).sum();
    let figure = TracesByInit {
        title: String::new(),
        inits,
        truth: match truth.as_slice() {
            [n] => Some(*n as u32),
            _ => None,
        },
        burn_in: None,
    };
    Some(Figure {
        file: "figures/traces-by-init.png".to_owned(),
        caption: format!(
            "Number of sets M after every proposal, by initial topology: {shown} of {n_total} chains, \
             evenly over the cells."
        ),
        png: figure.png(2000, 760),
    })
}
