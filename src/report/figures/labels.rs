//! The picture of a diagnosis of label chains.

use super::traces::chain_trace;
use crate::figure::diagnosis::DiagnosisPage;
use crate::figure::dimensionality_trace::DimensionalityTrace;
use crate::figure::pair_matrix::PairMatrix;
use crate::figure::scene::Scene;
use crate::figure::topology_bars::{TopologyBar, TopologyBars};
use crate::partition::Topology;
use crate::report::summary::verdict_line;
use crate::results::labels::LabelsResult;

/// Topologies that have a bar.
const N_BARS: usize = 8;
/// Of more items no matrix is drawn.
const MOST_ITEMS: usize = 4000;

/// M draw by draw, the topologies drawn most, and the pairs that share a set.
pub fn labels_figure(found: &LabelsResult, title: String) -> Scene {
    let chains = found.outcomes.iter().zip(&found.chains);
    let chains = chains.map(|(outcome, own)| chain_trace(outcome, own.name.clone()));
    let burn_ins: Option<Vec<u64>> = found.outcomes.iter().map(|own| own.burn_in).collect();
    let shown = found.topologies.iter().take(N_BARS).enumerate();
    let bars: Vec<TopologyBar> = shown
        .map(|(k, row)| TopologyBar {
            label: format!("#{}", k + 1),
            frequency: row.frequency,
            is_truth: false,
        })
        .collect();
    let share: f64 = bars.iter().map(|bar| bar.frequency).sum();
    let page = DiagnosisPage {
        title,
        verdict: verdict_line(found.convergence.as_ref()),
        trace: DimensionalityTrace {
            title: format!("{} chains", found.chains.len()),
            chains: chains.collect(),
            burn_in: burn_ins.and_then(|all| all.into_iter().max()),
            truth: None,
            m_range: None,
        },
        bars: TopologyBars {
            title: "topologies drawn most".to_owned(),
            all_others: (share < 1.0 - 1e-9).then_some(1.0 - share),
            bars,
            highest: None,
        },
        pairs: (found.n_items <= MOST_ITEMS).then(|| matrix(found)),
    };
    page.page(1900, 1000)
}

/// Pairs of items in the order of the sets of the VI estimate, the largest first.
fn matrix(found: &LabelsResult) -> PairMatrix {
    let labels = found.estimates.iter().find(|own| own.kind == "vi");
    let consensus = labels.map_or_else(
        || Topology::canonical(&vec![0_u32; found.n_items]),
        |own| Topology::canonical(&own.labels),
    );
    let mut sets = consensus.sets();
    sets.sort_by_key(|members| std::cmp::Reverse(members.len()));
    let order: Vec<usize> = sets.iter().flatten().map(|&item| item as usize).collect();
    let dense = found.co_clustering.dense(found.n_items);
    let row = |&i: &usize| order.iter().map(|&j| dense[i][j]).collect();
    PairMatrix {
        title: "probability that two items share a set".to_owned(),
        probabilities: order.iter().map(row).collect(),
        set_sizes: sets.iter().map(Vec::len).collect(),
    }
}
