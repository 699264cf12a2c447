//! `group`: two or three members leave a set together, or a set of two or three joins another.
//!
//! Leaving and joining are proposed with probability ½ each, k = 2 with probability 0.7, else k =
//! 3. With h_i(j) = exp(κ·û_i·(z_j − z̄)), û_i the direction of z_i − z̄ in set S, and distances as
//! C_i whitens them, or below the mean covariance of the group (covariance model):
//!
//! - leaving: i uniform of all N, S its set, |S| > k; k − 1 other members one after the other with
//!   probability ∝ h_i: those on its side of the set. The probability of the group is the sum over
//!   which of it came first, and in which order the others.
//! - joining: G uniform of the sets of size k; a set c uniform by its weight n_c/(0.1 m² + |z̄_c −
//!   z̄_G|²) among those with a neighbour of a member of G.
//!
//! Each is the other's way back. Locations come by [`blocks`](super::blocks).

use super::blocks::MOST;
use super::laws::Laws;
use super::placement::SetSums;
use super::{Explicit, MoveKind};
use crate::model::location_law::whitened;
use crate::model::moments::{Moments, square_distance};
use crate::partition::Partition;
use crate::sampler::choices::Random;
use crate::sampler::{State, StepInfo};

/// Share of pairs among the groups.
const PAIRS: f64 = 0.7;
/// κ in units of 1/σ_o.
const STEEPNESS: f64 = 3.0;
/// So far in nats the weights of members may lie apart to either side.
const MOST_LN: f64 = 30.0;
/// Of the weights of joining, in units of σ_o².
const SOFTENING: f64 = 0.1;

/// The members of a group.
pub(super) type Members<'a> = &'a [u32];

/// Working space.
pub(super) struct Group {
    /// Sets that a group could join, with their weights.
    sets: Vec<u32>,
    weights: Vec<f64>,
    met: Vec<u64>,
    round: u64,
}

impl Group {
    pub(super) fn new(n_detections: usize) -> Self {
        Self {
            sets: Vec::new(),
            weights: Vec::new(),
            met: vec![0; n_detections],
            round: 0,
        }
    }

    /// The sets that a group could join once it is by itself, and the total of their weights. The
    /// group is a set, or part of one that it leaves.
    fn look(
        &mut self,
        laws: &Laws,
        partition: &Partition,
        placed: &[SetSums],
        group: Members,
    ) -> f64 {
        self.round += 1;
        self.sets.clear();
        self.weights.clear();
        let own = partition.set_of()[group[0] as usize];
        let own_mean = Moments::of(group.iter().map(|&i| laws.z_m(i))).mean_m;
        let whiten = laws.whitening(group.iter().copied());
        let softening = SOFTENING * laws.sigma_o() * laws.sigma_o();
        let mut total = 0.0;
        for &i in group {
            for &j in laws.neighbours.of_detection(i).0 {
                let set_ix = partition.set_of()[j as usize];
                let met = &mut self.met[set_ix as usize];
                if *met == self.round || group.contains(&j) {
                    continue;
                }
                *met = self.round;
                let mut z = placed[set_ix as usize].z;
                if set_ix == own {
                    for &member in group {
                        z = z.without(laws.z_m(member));
                    }
                }
                let d2 = square_distance(whitened(whiten, own_mean, z.mean_m), [0.0; 2]);
                let weight = z.n as f64 / (softening + d2);
                self.sets.push(set_ix);
                self.weights.push(weight);
                total += weight;
            }
        }
        total
    }
}

/// h_i(j).
fn side(laws: &Laws, mean_m: [f64; 2], i: u32, j: u32) -> f64 {
    let whiten = laws.whitening(std::iter::once(i));
    let [u, v] = [i, j].map(|k| whitened(whiten, mean_m, laws.z_m(k)));
    let length = square_distance(u, [0.0; 2]).sqrt().max(f64::MIN_POSITIVE);
    let along = (u[0] * v[0] + u[1] * v[1]) / length;
    let ln_weight = STEEPNESS / laws.sigma_o() * along;
    libm::exp(ln_weight.clamp(-MOST_LN, MOST_LN))
}

/// ln of the probability that a leaving group of this size is `group`, out of `members`.
pub(super) fn ln_leaves(laws: &Laws, members: Members, mean_m: [f64; 2], group: Members) -> f64 {
    let without = |i: u32, left_out: u32| -> f64 {
        let rest = members.iter().filter(|&&j| j != i && j != left_out);
        rest.map(|&j| side(laws, mean_m, i, j)).sum()
    };
    let mut total = 0.0;
    for &i in group {
        let all = without(i, i);
        for &j in group {
            if j == i {
                continue;
            }
            let first = side(laws, mean_m, i, j) / all;
            if group.len() == 2 {
                total += first;
                continue;
            }
            let last = group.iter().find(|&&k| k != i && k != j);
            let last = *last.expect("a group of three");
            total += first * side(laws, mean_m, i, last) / without(i, j);
        }
    }
    libm::log(total / laws.n_detections() as f64)
}

impl Explicit<'_> {
    pub(super) fn group(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        let size = if random.uniform() < PAIRS { 2 } else { 3 };
        self.change.clear();
        let ln_ratio = if random.coins(1) == 1 {
            self.group_leaves(state, size, random)
        } else {
            self.group_joins(state, size, random)
        };
        self.try_change(MoveKind::Group, ln_ratio, state, random)
    }

    /// Describes a group that leaves; ln q(T|T') − ln q(T'|T).
    pub(super) fn group_leaves(
        &mut self,
        state: &State,
        size: usize,
        random: &mut impl Random,
    ) -> Option<f64> {
        let (partition, placement) = (&state.partition, state.placement());
        let i = random.below(partition.n_detections()) as u32;
        let set_ix = partition.set_of()[i as usize];
        let members = &partition.sets()[set_ix as usize];
        if !(size + 1..=MOST).contains(&members.len()) {
            return None;
        }
        let mean_m = placement.sums[set_ix as usize].z.mean_m;
        let mut group = [i; 3];
        for place in 1..size {
            let chosen = |j: u32| group[..place].contains(&j);
            let weights = &mut self.group.weights;
            weights.clear();
            let weight = |&j: &u32| {
                if chosen(j) {
                    0.0
                } else {
                    side(&self.laws, mean_m, i, j)
                }
            };
            weights.extend(members.iter().map(weight));
            group[place] = members[random.pick(weights, weights.iter().sum())];
        }
        let group = &group[..size];
        let ln_there = ln_leaves(&self.laws, members, mean_m, group);
        let total = self
            .group
            .look(&self.laws, partition, &placement.sums, group);
        // Only a set that holds a neighbour of the group can be joined again.
        let back = self.group.sets.iter().position(|&set| set == set_ix)?;
        let (change, n_left) = (&mut self.change, members.len() - size);
        change.remove(set_ix);
        change.add().extend_from_slice(group);
        change
            .add()
            .extend(members.iter().filter(|i| !group.contains(i)));
        let roster = if size == 2 {
            &placement.pairs
        } else {
            &placement.triples
        };
        let n_groups = roster.list().len() + 1 + usize::from(n_left == size);
        Some(libm::log(self.group.weights[back] / total / n_groups as f64) - ln_there)
    }

    /// Describes a group that joins; ln q(T|T') − ln q(T'|T).
    pub(super) fn group_joins(
        &mut self,
        state: &State,
        size: usize,
        random: &mut impl Random,
    ) -> Option<f64> {
        let (partition, placement) = (&state.partition, state.placement());
        let roster = if size == 2 {
            &placement.pairs
        } else {
            &placement.triples
        };
        let groups = roster.list();
        if groups.is_empty() {
            return None;
        }
        let group_ix = groups[random.below(groups.len())];
        let group = &partition.sets()[group_ix as usize];
        let total = self
            .group
            .look(&self.laws, partition, &placement.sums, group);
        if self.group.sets.is_empty() {
            return None;
        }
        let chosen = random.pick(&self.group.weights, total);
        let set_ix = self.group.sets[chosen];
        let members = &partition.sets()[set_ix as usize];
        if members.len() + size > MOST {
            return None;
        }
        let joined = self.change.add();
        joined.extend_from_slice(members);
        joined.extend_from_slice(group);
        let mean_m = Moments::of(joined.iter().map(|&i| self.laws.z_m(i))).mean_m;
        let ln_back = ln_leaves(&self.laws, joined, mean_m, group);
        self.change.remove(group_ix);
        self.change.remove(set_ix);
        Some(ln_back - libm::log(self.group.weights[chosen] / total / groups.len() as f64))
    }
}
