//! `split-merge`: the report's proposal of a topology
//! ([`split_merge`]), with locations by [`blocks`](super::blocks).

use super::blocks::MOST;
use super::{Explicit, Outcome, info, settled};
use crate::sampler::choices::Random;
use crate::sampler::moves::Proposal;
use crate::sampler::{SplitRule, State, StepInfo, split_merge};

impl Explicit<'_> {
    pub(super) fn split_merge(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        self.change.clear();
        let (rule, change) = (SplitRule::Uniform, &mut self.change);
        let (kind, proposal) = split_merge::propose(rule, &state.partition, change, random);
        let Proposal::Change { ln_ratio } = proposal else {
            return info(kind, Outcome::Impossible, 0);
        };
        let n_members: usize = change.added().iter().map(Vec::len).sum();
        let accepted = n_members <= MOST
            && self
                .blocks
                .run(&self.laws, state, &self.change, ln_ratio, random);
        settled(
            kind,
            if accepted {
                self.change.added().len()
            } else {
                0
            },
        )
    }
}
