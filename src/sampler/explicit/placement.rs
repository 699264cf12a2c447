//! The state of a chain whose locations are part of it: X, and what is kept of it.
//!
//! For each set the number, mean and scatter of its z and of its x; all locations in [`Cells`] of
//! the side of the penalty's reach; the score of every detection's leaving, and a tree over sets
//! to draw from them; lists of sets that moves draw from or always look at. What is kept of a set
//! is made anew whenever it changes, so nothing drifts but the x of large sets, which are rebuilt.
//! No sum of the penalty is kept.

use serde::{Deserialize, Serialize};

use super::cells::{Cells, Entry, STANDING};
use super::joint::Joint;
use super::laws::Laws;
use super::roster::Roster;
use super::sum_tree::SumTree;
use crate::model::appearance::Tally;
use crate::model::leaving::{MOST_SCORED, SCORE_IN_LARGE};
use crate::model::moments::Moments;
use crate::partition::{Change, Partition};
use crate::sampler::State;
use crate::sampler::choices::Random;

/// Sets of at least so many others are candidates of every detection, wherever they are.
pub(super) const LARGE: usize = 64;

/// What is kept of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SetSums {
    pub(super) z: Moments,
    pub(super) x: Moments,
    pub(super) tally: Tally,
}

/// Locations, and what is kept of them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Placement {
    pub(super) x_m: Vec<[f64; 2]>,
    /// Parallel to the partition's sets.
    pub(super) sums: Vec<SetSums>,
    pub(super) cells: Cells,
    /// v of each detection in a set that is scored.
    leaving: Vec<f64>,
    /// Sums of v over sets.
    tree: SumTree,
    pub(super) pairs: Roster,
    pub(super) triples: Roster,
    pub(super) large: Roster,
}

impl Placement {
    /// The locations of a partition, drawn from the normal laws of its sets.
    pub(super) fn new(laws: &Laws, partition: &Partition, random: &mut impl Random) -> Self {
        let mut x_m = vec![[0.0; 2]; partition.n_detections()];
        let (mut joint, mut drawn) = (Joint::default(), Vec::new());
        for members in partition.sets() {
            joint.fill(laws, members);
            drawn.clear();
            joint.draw(laws, members, random, &mut drawn);
            for (&i, &drawn) in members.iter().zip(&drawn) {
                x_m[i as usize] = drawn;
            }
        }
        Self::at(laws, partition, x_m, &[]).0
    }

    /// These locations of a partition, beside others that stand still, and ln B of each set.
    pub(super) fn at(
        laws: &Laws,
        partition: &Partition,
        x_m: Vec<[f64; 2]>,
        standing_m: &[[f64; 2]],
    ) -> (Self, Vec<f64>) {
        let n = partition.n_detections();
        let mut cells = Cells::new(laws.positions_m(), laws.reach_m());
        for (detection, &x_m) in (n as u32..).zip(standing_m) {
            cells.insert(Entry {
                x_m,
                set_ix: STANDING,
                detection,
            });
        }
        let mut placement = Self {
            x_m,
            sums: Vec::with_capacity(n),
            cells,
            leaving: vec![1.0; n],
            tree: SumTree::new(n),
            pairs: Roster::default(),
            triples: Roster::default(),
            large: Roster::default(),
        };
        let mut joint = Joint::default();
        let mut ln_bounds = Vec::with_capacity(n);
        for (set_ix, members) in (0..).zip(partition.sets()) {
            for &detection in members {
                placement.cells.insert(Entry {
                    x_m: placement.x_m[detection as usize],
                    set_ix,
                    detection,
                });
            }
            ln_bounds.push(placement.push_set(laws, members, &mut joint));
        }
        (placement, ln_bounds)
    }

    /// Where each detection is, m, relative to the mean of all positions.
    pub fn locations_m(&self) -> &[[f64; 2]] {
        &self.x_m
    }

    pub(in crate::sampler) fn into_locations_m(self) -> Vec<[f64; 2]> {
        self.x_m
    }

    /// V, the sum of all scores.
    pub(super) fn total_leaving(&self) -> f64 {
        self.tree.total()
    }

    /// The sum of the scores of a set's members.
    pub(super) fn leaving_of_set(&self, set_ix: u32) -> f64 {
        self.tree.get(set_ix as usize)
    }

    /// v of a detection in a set of n.
    pub(super) fn leaving_of(&self, i: u32, n: usize) -> f64 {
        if n - 1 > MOST_SCORED {
            SCORE_IN_LARGE
        } else {
            self.leaving[i as usize]
        }
    }

    /// A detection with probability v/V.
    pub(super) fn draw_leaving(&self, partition: &Partition, random: &mut impl Random) -> u32 {
        let set_ix = self.tree.find(random.uniform() * self.tree.total());
        let members = &partition.sets()[set_ix];
        if members.len() - 1 > MOST_SCORED {
            return members[random.below(members.len())];
        }
        let mut left = random.uniform() * self.tree.get(set_ix);
        for &i in members {
            left -= self.leaving[i as usize];
            if left <= 0.0 {
                return i;
            }
        }
        members[members.len() - 1]
    }

    /// What is kept of a set that takes the last number; its locations are in place.
    fn push_set(&mut self, laws: &Laws, members: &[u32], joint: &mut Joint) -> f64 {
        let set_ix = self.sums.len();
        let tally = laws.appearance().tally(members);
        let ln_bound = laws.ln_bound(members, tally, joint);
        let sums = SetSums {
            z: joint.z,
            x: Moments::of(members.iter().map(|&i| self.x_m[i as usize])),
            tally,
        };
        self.score(laws, set_ix, members, &sums);
        self.pairs.push_set(members.len() == 2);
        self.triples.push_set(members.len() == 3);
        self.large.push_set(members.len() >= LARGE);
        self.sums.push(sums);
        ln_bound
    }

    /// The scores of a set's members, and their sum.
    fn score(&mut self, laws: &Laws, set_ix: usize, members: &[u32], sums: &SetSums) {
        let leaving = &mut self.leaving;
        let total = laws.leaving(members.iter().copied(), sums, |i, score| {
            leaving[i as usize] = score;
        });
        self.tree.set(set_ix, total);
    }

    /// All scores anew: what is kept was of laws with another height of the penalty, on which
    /// nothing else of it depends.
    pub(super) fn score_anew(&mut self, laws: &Laws, partition: &Partition) {
        for (set_ix, members) in partition.sets().iter().enumerate() {
            let sums = self.sums[set_ix];
            self.score(laws, set_ix, members, &sums);
        }
    }

    fn swap_remove_set(&mut self, last: usize, to: usize) {
        self.sums.swap_remove(to);
        self.tree.set(to, self.tree.get(last));
        self.tree.set(last, 0.0);
        for roster in [&mut self.pairs, &mut self.triples, &mut self.large] {
            roster.swap_remove_set(to);
        }
    }

    /// Moves one location; its set stays.
    pub(super) fn move_one(&mut self, partition: &Partition, i: u32, x_m: [f64; 2]) {
        let set_ix = partition.set_of()[i as usize] as usize;
        let members = &partition.sets()[set_ix];
        let before = std::mem::replace(&mut self.x_m[i as usize], x_m);
        self.cells.relocate(i, x_m);
        let x = &mut self.sums[set_ix].x;
        *x = if members.len() < LARGE {
            Moments::of(members.iter().map(|&i| self.x_m[i as usize]))
        } else {
            x.without(before).with(x_m)
        };
    }

    /// Moves the locations of a whole set.
    pub(super) fn move_set(&mut self, set_ix: u32, members: &[u32], to_m: &[[f64; 2]]) {
        for (&i, &x_m) in members.iter().zip(to_m) {
            self.x_m[i as usize] = x_m;
            self.cells.relocate(i, x_m);
        }
        self.sums[set_ix as usize].x = Moments::of(to_m.iter().copied());
    }

    /// What large sets have summed up, from scratch.
    pub(in crate::sampler) fn rebuild(&mut self, partition: &Partition) {
        for (members, sums) in partition.sets().iter().zip(&mut self.sums) {
            sums.x = Moments::of(members.iter().map(|&i| self.x_m[i as usize]));
        }
    }
}

/// Applies a change of the partition with the locations that come with it; `joint` is working space.
pub(super) fn commit(
    laws: &Laws,
    state: &mut State,
    change: &Change,
    moved_m: impl Iterator<Item = (u32, [f64; 2])>,
    joint: &mut Joint,
) {
    let State {
        partition,
        ln_bound_of,
        ln_bound,
        ln_prior,
        placement,
        ..
    } = state;
    let placement = placement.as_mut().expect("explicit keeps its locations");
    for (i, x_m) in moved_m {
        placement.x_m[i as usize] = x_m;
        placement.cells.relocate(i, x_m);
    }
    let n_sets = partition.n_sets();
    for &set in change.removed() {
        *ln_bound -= ln_bound_of[set as usize];
        *ln_prior -= laws.prior.ln_size(partition.sets()[set as usize].len());
    }
    let (mut renumbered, mut n_renumbered) = ([0; 4], 0);
    partition.apply(change, |last, to| {
        ln_bound_of.swap_remove(to);
        placement.swap_remove_set(last, to);
        renumbered[n_renumbered] = to;
        n_renumbered += 1;
    });
    let n_kept = partition.n_sets() - change.added().len();
    let kept = renumbered[..n_renumbered].iter().filter(|&&to| to < n_kept);
    for set_ix in kept.copied().chain(n_kept..partition.n_sets()) {
        for &i in &partition.sets()[set_ix] {
            placement.cells.relabel(i, set_ix as u32);
        }
    }
    for members in change.added() {
        let bound = placement.push_set(laws, members, joint);
        ln_bound_of.push(bound);
        *ln_bound += bound;
        *ln_prior += laws.prior.ln_size(members.len());
    }
    *ln_prior += laws.prior.ln_n_sets(partition.n_sets()) - laws.prior.ln_n_sets(n_sets);
}
