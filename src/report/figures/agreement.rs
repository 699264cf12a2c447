//! Do the chains on a cell's first world agree?

use super::super::{Figure, Material, words};
use crate::diagnostics::undefined::Undefined;
use crate::figure::chains_page::ChainsPage;
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::rank_ecdf::{RankEcdfPlot, RankLine};
use crate::figure::style::Palette;
use crate::figure::topology_by_chain::{TopologyByChain, TopologyGroup};
use crate::results::agreement::{RankEcdf, side_by_side};
use crate::run::ChainOutcome;

/// Topologies with bars of their own.
const N_SHOWN: usize = 5;
/// Chains drawn: as many as there are colours to tell them apart.
const N_CHAINS: usize = 8;
/// Above so many detections a matrix has no room for its numbers.
const N_NUMBERED: usize = 40;

/// The chains of a cell's first world beside each other; `None` without any that ran to its end.
pub(in crate::report) fn chains(material: Material<'_>, cell: usize) -> Option<Figure> {
    let own = || {
        let of_world = |chain: &&crate::results::ChainResult| chain.replicate == 0;
        let chains = material.results.chains_of(cell).filter(of_world);
        chains.filter_map(|chain| Some((chain.chain, chain.outcome()?)))
    };
    let n_all = own().count();
    let shown: Vec<(u64, &ChainOutcome)> = own().take(N_CHAINS).collect();
    let outcomes: Vec<&ChainOutcome> = shown.iter().map(|(_, outcome)| *outcome).collect();
    let found = side_by_side(&outcomes, N_SHOWN)?;
    let mut groups: Vec<TopologyGroup> = (found.topologies.iter().enumerate())
        .map(|(k, topology)| TopologyGroup {
            label: format!("#{}", k + 1),
            is_truth: topology.is_truth == Some(true),
            shares: topology.shares.clone(),
        })
        .collect();
    let rest = |chain: usize| {
        1.0 - found
            .topologies
            .iter()
            .map(|t| t.shares[chain])
            .sum::<f64>()
    };
    groups.push(TopologyGroup {
        label: "others".to_owned(),
        is_truth: false,
        shares: (0..shown.len()).map(|chain| rest(chain).max(0.0)).collect(),
    });
    let numbers: Vec<String> = found.order.iter().map(|i| i.to_string()).collect();
    let matrix = |title: &str, name: &str, values: &[Vec<f64>], palette, low| {
        let side = |name: &str| HeatFactor {
            name: name.to_owned(),
            levels: if numbers.len() <= N_NUMBERED {
                numbers.clone()
            } else {
                vec![String::new(); numbers.len()]
            },
        };
        let highest = values.iter().flatten().copied().fold(low, f64::max);
        HeatMap {
            title: title.to_owned(),
            row_factors: vec![side("detection")],
            column_factors: vec![side("detection")],
            values: values.iter().flatten().map(|value| Some(*value)).collect(),
            texts: Vec::new(),
            value_name: name.to_owned(),
            range: (0.0, highest),
            percent: false,
            is_log: false,
            palette,
            ..HeatMap::default()
        }
    };
    let page = ChainsPage {
        chains: shown
            .iter()
            .map(|(chain, _)| format!("chain {}", chain + 1))
            .collect(),
        ranks: vec![
            rank_plot("Number of sets M", &found.n_sets),
            rank_plot("ln target", &found.ln_target),
        ],
        topologies: TopologyByChain {
            title: "Topologies sampled most".to_owned(),
            groups,
        },
        co_clustering: vec![
            matrix(
                "In one set, mean of the chains",
                "probability",
                &found.together,
                Palette::Cividis,
                1.0,
            ),
            matrix(
                "Largest difference between two chains",
                "difference",
                &found.apart,
                Palette::Viridis,
                0.1,
            ),
        ],
    };
    let settings = &material.sweep.cells[cell];
    let of_all = if n_all > shown.len() {
        format!(
            "the first {} of {}",
            shown.len(),
            words::counted(n_all, "chain")
        )
    } else {
        words::counted(n_all, "chain")
    };
    let n_detections = outcomes.first()?.n_detections;
    let detections = if found.order.len() < n_detections as usize {
        format!(
            "detections (the first {} of {n_detections})",
            found.order.len()
        )
    } else {
        "detections".to_owned()
    };
    Some(Figure {
        file: format!("figures/cells/{}-chains", settings.id),
        caption: format!(
            "{}, first world, {of_all}: where each chain’s draws lie among those of all (lines that leave the grey band \
             disagree beyond chance; 95 % for all chains at once, at the least effective sample size of any); how often each \
             sampled the topologies that all sampled most; which {detections} share a set, ordered by the sets of #1, and \
             where the chains differ.",
            settings.title()
        ),
        scene: page.page(2000, 1500),
    })
}

fn rank_plot(title: &str, ranks: &Result<Vec<RankEcdf>, Undefined>) -> RankEcdfPlot {
    let line = |chain: &RankEcdf| RankLine {
        points: chain.points.clone(),
        band: chain.band,
    };
    let (chains, note) = match ranks {
        Ok(chains) if chains.len() > 1 && chains.iter().all(|chain| chain.band.is_none()) => {
            let note = "no band: the chains change too seldom for an effective sample size";
            (chains.iter().map(line).collect(), note.to_owned())
        }
        Ok(chains) => (chains.iter().map(line).collect(), String::new()),
        Err(reason) => (Vec::new(), reason.to_string()),
    };
    RankEcdfPlot {
        title: title.to_owned(),
        chains,
        note,
    }
}
