//! A cheap score of putting a detection into a set: it shapes proposals, and nothing else.
//!
//! s(i→S) = ln I₀(S∪i) − ln I₀(S) + max_{j∈S} c_ij, where c_ij is what the pair pays for being in different sets,
//! over the [neighbour graph](super::neighbours): nothing for those that are no neighbours. Not the sum: the
//! members of a set move together, so a large set is not paid for member by member, and a proposal that thought so
//! would never split what it could merge.
//!
//! ln I₀ is that of [`blocks`](super::blocks). Any error in it costs speed and never exactness.

use super::Model;
use super::blocks::{Block, Blocks};
use super::nearby::Nearby;
use super::neighbours::Neighbours;

/// Scores for one model.
#[derive(Clone, Debug)]
pub struct Surrogate<'a> {
    blocks: Blocks<'a>,
    neighbours: Neighbours,
    nearby: Nearby,
}

impl<'a> Surrogate<'a> {
    /// Of a model's detections.
    pub fn of(model: &'a Model) -> Self {
        Self {
            blocks: Blocks::of(model),
            neighbours: Neighbours::of(model),
            nearby: Nearby::of(model),
        }
    }

    /// The neighbour graph.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// A law for partners.
    pub fn nearby(&self) -> &Nearby {
        &self.nearby
    }

    /// The statistics of a set.
    pub fn block(&self, members: &[u32]) -> Block {
        self.blocks.block(members.iter().copied())
    }

    /// A block with detection i.
    pub fn with(&self, block: &Block, i: u32) -> Block {
        self.blocks.with(block, i)
    }

    /// A block without its member i.
    pub fn without(&self, block: &Block, i: u32) -> Block {
        self.blocks.without(block, i)
    }

    /// ln I₀(S∪i) − ln I₀(S), nats.
    pub fn ln_gain(&self, block: &Block, i: u32) -> f64 {
        if block.is_empty() {
            return 0.0;
        }
        self.with(block, i).ln_gaussian() - block.ln_gaussian()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, Penalty, PenaltyShape};

    #[test]
    fn the_gains_of_the_metric_model_are_those_of_its_closed_form() {
        let positions_m = [[0.0, 1.0], [2.0, 0.5], [-1.0, 0.3], [0.7, 0.7]];
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 2.0,
            height: 8.0,
        };
        let metric = MetricModel::new(&positions_m, 0.8, 0.5, penalty);
        let model = Model::from(metric.clone());
        let surrogate = Surrogate::of(&model);
        let block = surrogate.block(&[0, 1, 3]);
        let gain = metric.ln_gaussian(&[0, 1, 3, 2]) - metric.ln_gaussian(&[0, 1, 3]);
        assert!((surrogate.ln_gain(&block, 2) - gain).abs() < 1e-12);
        let back = surrogate.without(&surrogate.with(&block, 2), 2);
        assert!((surrogate.ln_gain(&back, 2) - gain).abs() < 1e-12);
        assert_eq!(surrogate.ln_gain(&Block::default(), 2), 0.0);
    }
}
