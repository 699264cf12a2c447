//! Loop closures that are decided together: one pair of landmarks may prove little, all pairs that
//! it entails prove much.
//!
//! From a seed, a pair that may be one, the joint is conditioned on it, then on every further pair
//! that gains, the best first. The set is taken if its whole gain is high enough, and higher than
//! that of every rival: a set from another seed that says something else of the same landmarks.

use super::joint::Joint;
use super::state::State;
use super::view::Standing;

/// A pair is a seed if it gains more than this, nats, …
const SEED_GAIN: f64 = -8.0;
/// … and lies no further apart than this, squared and in standard deviations.
const SEED_GATE: f64 = 18.0;
/// Landmarks are looked at if they lie so near to another.
const GATE: f64 = 30.0;
/// Seeds tried.
const MOST_SEEDS: usize = 40;
/// Pairs in a set.
const MOST_PAIRS: usize = 13;
/// A set must gain so much more than its best rival, nats.
const ABOVE_RIVALS: f64 = 3.0;
/// Landmarks looked at together.
const MOST_LANDMARKS: usize = 80;

/// Pairs to join, each by one sighting of both.
pub(super) type Closure = Vec<[u32; 2]>;

/// The landmarks that may be closed.
#[derive(Clone)]
struct Small {
    joint: Joint,
    standing: Vec<Standing>,
    /// For each landmark, a bit for each other that a scan saw with it.
    conflicts: Vec<u128>,
    is_gone: Vec<bool>,
    n_landmarks: usize,
}

/// What one seed entails.
struct Set {
    gain: f64,
    pairs: Vec<(usize, usize)>,
}

/// What closures start from.
struct Seeds {
    /// Landmarks that lie near another.
    all: Vec<usize>,
    /// Pairs by their places in that list, the best first.
    pairs: Vec<(usize, usize)>,
}

impl State {
    /// The best set of closures, if it gains at least `least` nats and no rival comes near.
    pub fn closure(&self, least: f64) -> Option<Closure> {
        let Seeds { all, pairs } = self.seeds()?;
        let small = Small::new(self, &all);
        let mut sets: Vec<Set> = Vec::new();
        for (a, b) in pairs {
            if sets.iter().all(|set| !set.pairs.contains(&(a, b))) {
                sets.push(self.entailed(small.clone(), (a, b)));
            }
        }
        let by_gain = |x: &&Set, y: &&Set| x.gain.total_cmp(&y.gain);
        let best = sets.iter().rev().max_by(by_gain)?;
        let touches = |set: &Set| {
            let mut ends = set.pairs.iter().flat_map(|&(a, b)| [a, b]);
            ends.any(|end| best.pairs.iter().any(|&(a, b)| a == end || b == end))
        };
        let shares = |set: &Set| set.pairs.iter().any(|pair| best.pairs.contains(pair));
        let rivals = sets.iter().filter(|set| !shares(set) && touches(set));
        let rival = rivals.map(|set| set.gain).fold(0.0, f64::max);
        if best.gain < least || best.gain - rival < ABOVE_RIVALS {
            return None;
        }
        let sighting = |place: usize| self.now.landmarks[all[place]].sightings[0];
        let pairs = best.pairs.iter().map(|&(a, b)| [sighting(a), sighting(b)]);
        Some(pairs.collect())
    }

    /// Joins the pairs of a closure as far as no scan saw both.
    pub fn close(&mut self, closure: &Closure) {
        for pair in closure {
            let [a, b] = pair.map(|s| self.now.labels[s as usize] as usize);
            if a != b && !self.conflict(a, b) {
                self.join(a, b);
            }
        }
    }

    /// Landmarks that lie near another, and pairs of them to start from.
    fn seeds(&self) -> Option<Seeds> {
        let mut near: Vec<(f64, f64, usize, usize)> = Vec::new();
        for a in 0..self.n_landmarks() {
            for b in a + 1..self.n_landmarks() {
                if let Some((gain, distance)) = self.joining(a, b, GATE) {
                    near.push((gain, distance, a, b));
                }
            }
        }
        near.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.2, x.3).cmp(&(y.2, y.3))));
        let mut all: Vec<usize> = Vec::new();
        for &(_, _, a, b) in &near {
            for end in [a, b] {
                if all.len() < MOST_LANDMARKS && !all.contains(&end) {
                    all.push(end);
                }
            }
        }
        all.sort_unstable();
        let place = |a: usize| all.binary_search(&a).ok();
        let seeds = near
            .iter()
            .filter(|(gain, distance, _, _)| *gain > SEED_GAIN && *distance < SEED_GATE);
        let seeds = seeds.filter_map(|&(_, _, a, b)| Some((place(a)?, place(b)?)));
        let pairs: Vec<(usize, usize)> = seeds.take(MOST_SEEDS).collect();
        (!pairs.is_empty()).then_some(Seeds { all, pairs })
    }

    fn entailed(&self, mut small: Small, seed: (usize, usize)) -> Set {
        let mut set = Set {
            gain: 0.0,
            pairs: Vec::new(),
        };
        let mut next = Some((small.gain(self, seed.0, seed.1), seed.0, seed.1));
        while let Some((gain, a, b)) = next {
            set.gain += gain;
            set.pairs.push((a, b));
            small.join(a, b);
            if set.pairs.len() == MOST_PAIRS {
                break;
            }
            next = small.best(self);
        }
        set
    }
}

impl Small {
    fn new(state: &State, all: &[usize]) -> Self {
        let conflicts = all.iter().map(|&a| {
            let others = all.iter().enumerate();
            let seen_with = others.filter(|&(_, &b)| a == b || state.conflict(a, b));
            seen_with.fold(0, |bits, (place, _)| bits | 1 << place)
        });
        Self {
            joint: state.now.joint.of_some(all),
            standing: all
                .iter()
                .map(|&a| state.now.landmarks[a].standing)
                .collect(),
            conflicts: conflicts.collect(),
            is_gone: vec![false; all.len()],
            n_landmarks: state.n_landmarks(),
        }
    }

    fn gain(&self, state: &State, a: usize, b: usize) -> f64 {
        let prior = state.ln_fewer(self.n_landmarks) + self.standing[a].gain(self.standing[b]);
        self.joint.match_of(a, b).ln_density + prior
    }

    /// The pair that gains most, if any gains.
    fn best(&self, state: &State) -> Option<(f64, usize, usize)> {
        let mut best: Option<(f64, usize, usize)> = None;
        let left: Vec<usize> = (0..self.is_gone.len())
            .filter(|&a| !self.is_gone[a])
            .collect();
        for (place, &a) in left.iter().enumerate() {
            for &b in &left[place + 1..] {
                if self.conflicts[a] >> b & 1 == 1 {
                    continue;
                }
                if self.joint.match_of(a, b).square_distance > GATE {
                    continue;
                }
                let gain = self.gain(state, a, b);
                if gain > best.map_or(0.0, |(most, _, _)| most) {
                    best = Some((gain, a, b));
                }
            }
        }
        best
    }

    fn join(&mut self, a: usize, b: usize) {
        self.joint.identify(a, b);
        self.is_gone[b] = true;
        self.standing[a] = self.standing[a].with(self.standing[b]);
        self.n_landmarks -= 1;
        self.conflicts[a] |= self.conflicts[b];
        let of_a = self.conflicts[a];
        for (place, conflicts) in self.conflicts.iter_mut().enumerate() {
            if of_a >> place & 1 == 1 {
                *conflicts |= 1 << a;
            }
        }
    }
}
