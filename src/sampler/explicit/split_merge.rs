//! `split-merge`: the report's proposal of a topology
//! ([`split_merge`]), with locations by [`blocks`](super::blocks).

use super::blocks::MOST;
use super::{Explicit, settled};
use crate::sampler::choices::Random;
use crate::sampler::moves::Proposal;
use crate::sampler::{SplitRule, State, StepInfo, split_merge};

impl Explicit<'_> {
    pub(super) fn split_merge(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        self.change.clear();
        let (rule, change) = (SplitRule::Uniform, &mut self.change);
        let (kind, proposal) = split_merge::propose(rule, &state.partition, change, random);
        let n_members: usize = change.added().iter().map(Vec::len).sum();
        let ln_ratio = match proposal {
            Proposal::Change { .. } if n_members > MOST => return settled(kind, 0),
            Proposal::Change { ln_ratio } => Some(ln_ratio),
            Proposal::Impossible | Proposal::Hold => None,
        };
        self.try_change(kind, ln_ratio, state, random)
    }
}
