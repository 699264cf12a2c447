//! Sums over a chain that stay exact when its trace must be thinned or its table of topologies overflows.
//!
//! Mean and scatter of M and of ln target, and the number of steps that each pair of detections spent in one set,
//! are summed in windows of equal width: w steps each, and whenever there are [`MAX_WINDOWS`] of them neighbours
//! are joined and w doubles. So whatever burn-in is found in the end, the sums of the steps after it are had,
//! but for those of the window that it falls into: at most an eighth of the chain.
//!
//! A pair is counted when one of the two leaves their set, for as long as they were together, so a
//! step costs nothing and a move what it parts. A set that gains or loses a few members stays the
//! same set. Pairs are bounded by [`MAX_PAIRS`] for each window; above it those with the fewest steps are
//! dropped by the rule of [`TopologyTable`](super::TopologyTable), and the bound on what a count may lack is kept.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::partition::Topology;

/// Windows at most: an even number.
const MAX_WINDOWS: usize = 16;
/// Width of the first windows, steps.
const FIRST_WIDTH: u64 = 1 << 12;
/// In place of the number of a set, where a detection is in none.
const NO_SET: u32 = u32::MAX;
/// Pairs of detections counted in one window at most: 130 MB or so in all windows.
const MAX_PAIRS: usize = 1 << 18;
/// Members of a set whose pairs are counted at most: those of a larger one do not fit into a window.
/// A chain of ten thousand detections that comes from one cluster would do little else than count.
const MOST_MEMBERS: usize = 724;

/// Number, mean and sum of squared deviations of values with whole weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    /// Total weight.
    pub n: u64,
    /// Mean.
    pub mean: f64,
    /// Σ w·(x − mean)².
    pub sum_of_squares: f64,
}

impl Sums {
    /// Adds a value so many times (West 1979).
    pub fn add(&mut self, value: f64, weight: u64) {
        self.join(&Self {
            n: weight,
            mean: value,
            sum_of_squares: 0.0,
        });
    }

    /// Adds all of another's values (Chan, Golub & LeVeque 1979).
    pub fn join(&mut self, other: &Self) {
        let n = self.n + other.n;
        if other.n == 0 {
            return;
        }
        let deviation = other.mean - self.mean;
        let part = other.n as f64 / n as f64;
        self.mean += deviation * part;
        self.sum_of_squares += other.sum_of_squares + deviation * deviation * part * self.n as f64;
        self.n = n;
    }

    /// Standard deviation of the values; `None` of none.
    pub fn sd(&self) -> Option<f64> {
        (self.n > 0).then(|| (self.sum_of_squares / self.n as f64).sqrt())
    }
}

/// Steps that pairs i < j spent in one set.
pub type PairSteps = HashMap<(u32, u32), u64>;

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Window {
    n_sets: Sums,
    ln_target: Sums,
    pairs: PairSteps,
    pair_error_bound: u64,
    /// Whether pairs of a set that is too large were left out.
    leaves_out: bool,
}

impl Window {
    fn join(&mut self, other: &Self) {
        self.n_sets.join(&other.n_sets);
        self.ln_target.join(&other.ln_target);
        for (&pair, steps) in &other.pairs {
            *self.pairs.entry(pair).or_default() += steps;
        }
        self.pair_error_bound += other.pair_error_bound;
        self.leaves_out |= other.leaves_out;
        self.bound();
    }

    fn count_pair(&mut self, i: u32, j: u32, steps: u64) {
        *self.pairs.entry((i.min(j), i.max(j))).or_default() += steps;
        self.bound();
    }

    fn bound(&mut self) {
        while self.pairs.len() > MAX_PAIRS {
            let mut steps: Vec<u64> = self.pairs.values().copied().collect();
            let middle = steps.len() / 2;
            let (_, &mut least, _) = steps.select_nth_unstable(middle);
            self.pairs.retain(|_, steps| *steps > least);
            self.pair_error_bound += least;
        }
    }
}

/// Sums of a chain in windows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Windows {
    width: u64,
    windows: Vec<Window>,
    /// M and ln target of the present state, and the step that it is counted from.
    state: (f64, f64),
    since: u64,
    /// Members of each set of the present topology, by a number that stays while a set stands.
    sets: Vec<Vec<u32>>,
    set_of: Vec<u32>,
    /// The step from which each detection is counted in its set.
    joined: Vec<u64>,
    spare: Vec<u32>,
}

/// Sums of a chain from some step on.
#[derive(Clone, Debug, Default)]
pub struct ChainSums {
    /// Of M.
    pub n_sets: Sums,
    /// Of ln target.
    pub ln_target: Sums,
    /// Steps that pairs spent in one set.
    pub pairs: PairSteps,
    /// By how much a pair's steps may be too few.
    pub pair_error_bound: u64,
}

impl Windows {
    /// Of a chain that stands at `topology` from step 0 on.
    pub fn new(topology: &Topology, n_sets: u32, ln_target: f64) -> Self {
        let n = topology.labels().len();
        let mut windows = Self {
            width: FIRST_WIDTH,
            windows: Vec::new(),
            state: (f64::from(n_sets), ln_target),
            since: 0,
            sets: Vec::new(),
            set_of: vec![NO_SET; n],
            joined: vec![0; n],
            spare: Vec::new(),
        };
        windows.stand_at(topology, 0);
        windows
    }

    /// The state is another one from step `step` on.
    pub fn state(&mut self, step: u64, n_sets: u32, ln_target: f64) {
        self.count_state(step);
        self.state = (f64::from(n_sets), ln_target);
    }

    /// These sets stand from step `step` on, in place of those that their members were in. Together they hold
    /// every member of the sets that go.
    pub fn sets<'a>(&mut self, step: u64, new: impl Iterator<Item = &'a [u32]>) {
        // The largest continues first: the few that leave a large set must not take its place.
        let mut new: Vec<&[u32]> = new.collect();
        new.sort_by_key(|members| std::cmp::Reverse(members.len()));
        let mut heirs: Vec<u32> = Vec::new();
        for members in &new {
            let heir = self.heir(members, &heirs);
            heirs.push(heir);
        }
        let moved = |windows: &Self, heir: u32, i: u32| windows.set_of[i as usize] != heir;
        for (members, &heir) in new.iter().zip(&heirs) {
            for &i in *members {
                if self.set_of[i as usize] != NO_SET && moved(self, heir, i) {
                    self.leave(i, step);
                }
            }
        }
        for (members, heir) in new.iter().zip(heirs) {
            let set = if heir == NO_SET { self.open() } else { heir };
            for &i in *members {
                if moved(self, set, i) {
                    self.join(i, set, step);
                }
            }
        }
    }

    /// Stands at a topology from step `step` on: what differs is replaced.
    pub fn stand_at(&mut self, topology: &Topology, step: u64) {
        let mut sets = topology.sets();
        sets.retain(|members: &Vec<u32>| {
            let old = self.set_of[members[0] as usize];
            !(old != NO_SET && self.sets[old as usize] == *members)
        });
        self.sets(step, sets.iter().map(Vec::as_slice));
    }

    /// The chain ends before step `n_steps`.
    pub fn finish(&mut self, n_steps: u64) {
        self.count_state(n_steps);
        for set in 0..self.sets.len() {
            let members = std::mem::take(&mut self.sets[set]);
            for (place, &i) in members.iter().enumerate() {
                self.part(i, &members[place + 1..], members.len(), n_steps);
            }
            self.sets[set] = members;
        }
        self.joined.fill(n_steps);
    }

    /// Sums of the steps from [`first_after`](Self::first_after) `burn_in` on, of a finished chain.
    pub fn after(&self, burn_in: u64) -> ChainSums {
        let mut sums = Window::default();
        let first = self.first_after(burn_in) / self.width;
        for window in self.windows.iter().skip(first as usize) {
            sums.join(window);
        }
        ChainSums {
            n_sets: sums.n_sets,
            ln_target: sums.ln_target,
            pairs: sums.pairs,
            // A pair that is left out lacks all steps at most.
            pair_error_bound: if sums.leaves_out {
                sums.n_sets.n
            } else {
                sums.pair_error_bound
            },
        }
    }

    /// The first step at or after `burn_in` that a window begins with.
    pub fn first_after(&self, burn_in: u64) -> u64 {
        burn_in.next_multiple_of(self.width)
    }

    fn count_state(&mut self, step: u64) {
        let (n_sets, ln_target) = self.state;
        let since = std::mem::replace(&mut self.since, step);
        self.spread(since, step, |window, steps| {
            window.n_sets.add(n_sets, steps);
            window.ln_target.add(ln_target, steps);
        });
    }

    /// The set that a new one continues: of those that it has members from, the one with the most of
    /// them that no other new set continues.
    fn heir(&self, members: &[u32], taken: &[u32]) -> u32 {
        let mut shares: Vec<(u32, usize)> = Vec::new();
        for &i in members {
            let old = self.set_of[i as usize];
            match shares.iter_mut().find(|(set, _)| *set == old) {
                Some((_, n)) => *n += 1,
                None if old == NO_SET || taken.contains(&old) => {}
                None => shares.push((old, 1)),
            }
        }
        let largest = shares.iter().max_by_key(|(_, n)| *n);
        largest.map_or(NO_SET, |&(set, _)| set)
    }

    fn open(&mut self) -> u32 {
        self.spare.pop().unwrap_or_else(|| {
            self.sets.push(Vec::new());
            self.sets.len() as u32 - 1
        })
    }

    fn join(&mut self, i: u32, set: u32, step: u64) {
        let members = &mut self.sets[set as usize];
        // In order, so that a set compares with that of a topology.
        let place = members.partition_point(|&j| j < i);
        members.insert(place, i);
        self.set_of[i as usize] = set;
        self.joined[i as usize] = step;
    }

    fn leave(&mut self, i: u32, step: u64) {
        let set = std::mem::replace(&mut self.set_of[i as usize], NO_SET);
        let mut members = std::mem::take(&mut self.sets[set as usize]);
        let size = members.len();
        members.retain(|&j| j != i);
        self.part(i, &members, size, step);
        if members.is_empty() {
            self.spare.push(set);
        }
        self.sets[set as usize] = members;
    }

    /// A detection parts from others of a set of this size at `step`.
    fn part(&mut self, i: u32, others: &[u32], size: usize, step: u64) {
        if size <= MOST_MEMBERS {
            self.count_pairs(i, others, step);
        } else {
            let since = self.joined[i as usize];
            self.spread(since, step, |window, _| window.leaves_out = true);
        }
    }

    /// Counts the steps that a detection spent with each of these, up to before `step`.
    fn count_pairs(&mut self, i: u32, others: &[u32], step: u64) {
        for &j in others {
            let since = self.joined[i as usize].max(self.joined[j as usize]);
            self.spread(since, step, |window, steps| window.count_pair(i, j, steps));
        }
    }

    /// Calls `add` with the number of steps from `since` to before `step` in each window.
    fn spread(&mut self, since: u64, step: u64, mut add: impl FnMut(&mut Window, u64)) {
        let mut from = since;
        while from < step {
            let ix = (from / self.width) as usize;
            while ix >= self.windows.len() {
                if self.windows.len() == MAX_WINDOWS {
                    self.join_neighbours();
                    return self.spread(from, step, add);
                }
                self.windows.push(Window::default());
            }
            let to = step.min((ix as u64 + 1) * self.width);
            add(&mut self.windows[ix], to - from);
            from = to;
        }
    }

    fn join_neighbours(&mut self) {
        let mut old = self.windows.drain(..);
        let mut joined = Vec::with_capacity(MAX_WINDOWS);
        while let (Some(mut first), Some(second)) = (old.next(), old.next()) {
            first.join(&second);
            joined.push(first);
        }
        drop(old);
        self.windows = joined;
        self.width *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Labels by number, made canonical.
    fn topology(n: u32, label: impl Fn(u32) -> u32) -> Topology {
        Topology::canonical(&(0..n).map(label).collect::<Vec<_>>())
    }

    /// What is dropped is never more than the bound says.
    #[test]
    fn more_pairs_than_fit_are_dropped_by_their_steps() {
        let n = 1200;
        let mut windows = Windows::new(&topology(n, |i| i % 2), 1, 0.0);
        // In two halves for 10 steps, in three thirds for 30, then only 0 and 6.
        windows.stand_at(&topology(n, |i| i % 3), 10);
        windows.stand_at(&topology(n, |i| if i == 6 { 0 } else { i }), 40);
        windows.finish(1000);
        let sums = windows.after(0);
        assert!(sums.pairs.len() <= MAX_PAIRS);
        let steps = |i: u32, j: u32| {
            let halves = if i % 2 == j % 2 { 10 } else { 0 };
            let thirds = if i % 3 == j % 3 { 30 } else { 0 };
            halves + thirds + if (i, j) == (0, 6) { 960 } else { 0 }
        };
        assert!((10..=50).contains(&sums.pair_error_bound));
        for i in 0..n {
            for j in i + 1..n {
                let counted = sums.pairs.get(&(i, j)).copied().unwrap_or(0);
                let lacking = steps(i, j) - counted;
                assert!(lacking <= sums.pair_error_bound, "{i} {j}: {counted}");
            }
        }
        assert_eq!((sums.n_sets.n, sums.n_sets.mean), (1000, 1.0));
    }

    /// The few that leave a large set part from it, and not it from them, whoever is named first.
    #[test]
    fn a_large_set_stays_the_same_set() {
        let n = 500;
        let mut windows = Windows::new(&topology(n, |_| 0), 1, 0.0);
        let stayed = windows.set_of[0];
        let rest: Vec<u32> = (0..n).filter(|&i| i != 7).collect();
        windows.sets(10, [[7].as_slice(), &rest].into_iter());
        assert_eq!(windows.set_of[0], stayed);
        assert_ne!(windows.set_of[7], stayed);
    }

    /// A set that is too large is left out while it stands, and only then.
    #[test]
    fn pairs_of_a_set_that_is_too_large_are_left_out() {
        let n = 900;
        let mut windows = Windows::new(&topology(n, |_| 0), 1, 0.0);
        windows.stand_at(&topology(n, |i| i % 2), 5000);
        windows.finish(20_000);
        assert_eq!(windows.after(0).pair_error_bound, 20_000);
        let sums = windows.after(6000);
        assert_eq!((sums.n_sets.n, sums.pair_error_bound), (20_000 - 8192, 0));
        assert_eq!(sums.pairs.len(), 2 * (450 * 449 / 2));
        assert!(sums.pairs.values().all(|steps| *steps == 20_000 - 8192));
        assert_eq!(sums.pairs.get(&(3, 5)), Some(&(20_000 - 8192)));
    }

    #[test]
    fn joining_is_adding() {
        let values = [1.5, -2.0, 7.25, 3.0, 3.0];
        let (mut whole, mut parts) = (Sums::default(), [Sums::default(); 2]);
        for (k, value) in values.into_iter().enumerate() {
            whole.add(value, k as u64 + 1);
            parts[k % 2].add(value, k as u64 + 1);
        }
        let [mut joined, other] = parts;
        joined.join(&other);
        assert_eq!(joined.n, whole.n);
        assert!((joined.mean - whole.mean).abs() < 1e-14);
        assert!((joined.sum_of_squares - whole.sum_of_squares).abs() < 1e-12);
        assert_eq!(Sums::default().sd(), None);
    }
}
