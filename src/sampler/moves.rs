//! Which moves there are.

use super::Estimator;
use crate::model::{Block, Surrogate};
use crate::partition::Partition;

/// A move that a mix can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// The report's proposal (algorithm 2): merge or split, each with probability ½.
    SplitMerge,
    /// One detection to another set.
    Reassign,
    /// Two detections to other sets.
    PairReassign,
    /// The sets of two or three detections put together anew.
    Anchors,
    /// T' = T with new importance draws: all of them (`fresh`), or those of one set (`common`).
    Refresh,
    /// Dahl's sequentially-allocated split-merge.
    SequentialAllocation,
    /// Jain & Neal's restricted-Gibbs split-merge.
    RestrictedGibbs,
    /// Set and location of one detection (`explicit`).
    Site,
    /// One detection out of a set or into one, where it is worth a try (`explicit`).
    Flip,
    /// The locations of one set (`explicit`).
    Slice,
    /// Two or three detections out of a set or into one (`explicit`).
    Group,
    /// One set into two along a straight line, two into one or two others (`explicit`).
    Cut,
}

impl Move {
    pub(super) const ALL: [(Self, &'static str); 12] = [
        (Self::SplitMerge, "split-merge"),
        (Self::Reassign, "reassign"),
        (Self::PairReassign, "pair-reassign"),
        (Self::Anchors, "anchors"),
        (Self::Refresh, "refresh"),
        (Self::SequentialAllocation, "sequential-allocation"),
        (Self::RestrictedGibbs, "restricted-gibbs"),
        (Self::Site, "site"),
        (Self::Flip, "flip"),
        (Self::Slice, "slice"),
        (Self::Group, "group"),
        (Self::Cut, "cut"),
    ];

    pub(super) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Whether the move reaches every topology from every other by itself.
    pub(super) fn is_irreducible(self) -> bool {
        matches!(
            self,
            Self::SplitMerge
                | Self::Anchors
                | Self::SequentialAllocation
                | Self::RestrictedGibbs
                | Self::Site
        )
    }

    /// Whether the move can be made with this estimator.
    pub(super) fn serves(self, estimator: Estimator) -> bool {
        let needs_locations = matches!(
            self,
            Self::Site | Self::Flip | Self::Slice | Self::Group | Self::Cut
        );
        match estimator {
            Estimator::Explicit => needs_locations || self == Self::SplitMerge,
            Estimator::Fresh | Estimator::Common => !needs_locations,
        }
    }

    /// Whether the move asks the model for scores.
    pub(super) fn scores(self) -> bool {
        matches!(
            self,
            Self::Reassign
                | Self::PairReassign
                | Self::Anchors
                | Self::SequentialAllocation
                | Self::RestrictedGibbs
        )
    }
}

/// What a proposal is counted as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MoveKind {
    /// Two sets into one.
    Merge,
    /// One set into two.
    Split,
    /// [`Move::Reassign`].
    Reassign,
    /// [`Move::PairReassign`].
    PairReassign,
    /// [`Move::Anchors`].
    Anchors,
    /// [`Move::Refresh`].
    Refresh,
    /// [`Move::SequentialAllocation`].
    SequentialAllocation,
    /// [`Move::RestrictedGibbs`].
    RestrictedGibbs,
    /// Two rungs of a tempered chain change their states.
    Swap,
    /// [`Move::Site`].
    Site,
    /// [`Move::Flip`].
    Flip,
    /// [`Move::Slice`].
    Slice,
    /// [`Move::Group`].
    Group,
    /// [`Move::Cut`].
    Cut,
}

impl MoveKind {
    /// All kinds, in the order in which they are reported.
    pub const ALL: [Self; 14] = [
        Self::Merge,
        Self::Split,
        Self::Reassign,
        Self::PairReassign,
        Self::Anchors,
        Self::Refresh,
        Self::SequentialAllocation,
        Self::RestrictedGibbs,
        Self::Swap,
        Self::Site,
        Self::Flip,
        Self::Slice,
        Self::Group,
        Self::Cut,
    ];

    /// The key under which outputs report it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Merge => "merge",
            Self::Split => "split",
            Self::Reassign => "reassign",
            Self::PairReassign => "pair-reassign",
            Self::Anchors => "anchors",
            Self::Refresh => "refresh",
            Self::SequentialAllocation => "sequential-allocation",
            Self::RestrictedGibbs => "restricted-gibbs",
            Self::Swap => "swap",
            Self::Site => "site",
            Self::Flip => "flip",
            Self::Slice => "slice",
            Self::Group => "group",
            Self::Cut => "cut",
        }
    }
}

/// What a move sees.
pub struct Scene<'a> {
    /// The current topology.
    pub partition: &'a Partition,
    /// Statistics of its sets.
    pub blocks: &'a [Block],
    /// Scores.
    pub surrogate: &'a Surrogate<'a>,
}

/// What a move proposes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Proposal {
    /// The move cannot be made from here.
    Impossible,
    /// To stay.
    Hold,
    /// What it has described.
    Change {
        /// ln q(T|T') − ln q(T'|T).
        ln_ratio: f64,
    },
}
