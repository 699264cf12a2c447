//! Dimensionality traces: of one chain, and of one setting from every start.

use super::super::{Figure, Material, words};
use crate::figure::dimensionality_trace::{ChainTrace, TraceBin};
use crate::figure::traces_by_init::{InitTraces, TracesByInit};
use crate::run::ChainOutcome;
use crate::sweep::Cell;

pub(super) fn chain_trace(outcome: &ChainOutcome, name: String) -> ChainTrace {
    let bins = outcome.n_sets_bins.iter();
    let bins = bins.map(|bin| TraceBin {
        first_step: bin.first,
        min: bin.low,
        max: bin.high,
        mean: bin.mean(),
    });
    ChainTrace {
        name,
        bins: bins.collect(),
        end_step: outcome.n_steps,
    }
}

/// One setting, that of the most successful cell, from each start that the sweep has: all chains on its
/// first world.
pub(in crate::report) fn by_init(material: Material<'_>) -> Option<Figure> {
    let (sweep, results) = (material.sweep, material.results);
    let first = results.ranking().first().copied()?;
    let key = |cell: &Cell| cell.settings.canonical_text(|key| key.name != "init");
    let wanted = key(&sweep.cells[first]);
    let mut inits: Vec<InitTraces> = Vec::new();
    let mut truth: Vec<u64> = Vec::new();
    for (ix, cell) in sweep.cells.iter().enumerate() {
        if key(cell) != wanted {
            continue;
        }
        let chains: Vec<&ChainOutcome> = results
            .chains_of(ix)
            .filter(|chain| chain.replicate == 0)
            .filter_map(|chain| chain.outcome())
            .collect();
        if chains.is_empty() {
            continue;
        }
        truth.extend(chains.iter().filter_map(|chain| chain.n_landmarks));
        let burn_ins: Option<Vec<u64>> = chains.iter().map(|chain| chain.burn_in).collect();
        inits.push(InitTraces {
            name: format!("{} ({})", cell.settings.text("init"), cell.id),
            chains: chains
                .iter()
                .map(|chain| chain_trace(chain, String::new()))
                .collect(),
            burn_in: burn_ins.and_then(|all| all.into_iter().max()),
        });
    }
    if inits.is_empty() {
        return None;
    }
    truth.dedup();
    let figure = TracesByInit {
        title: String::new(),
        inits,
        truth: match truth.as_slice() {
            [n] => Some(*n as u32),
            _ => None,
        },
    };
    Some(Figure {
        file: "figures/traces-by-init".to_owned(),
        caption: format!(
            "Number of sets M after every proposal, from each start of the sweep: all chains on the first world with the \
             settings of the most successful cell, {}. Grey: the largest burn-in of any; none is marked where a \
             chain never settled.",
            words::settings_line(&sweep.cells[first])
        ),
        scene: figure.page(2000, 760),
    })
}
