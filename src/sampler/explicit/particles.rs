//! Places that one detection could take: what `site` and `flip` choose from.
//!
//! Detection i is taken out. Its *strata* are: a set of its own ("new"); every set with a location
//! in the 5 × 5 cells around z_i; every set with at least [`LARGE`] others. They depend on T and X
//! without i alone. Each stratum draws particles from a law q of its own, and a particle x has the
//! weight
//!
//! ln w = ln Z + ln(γ/q) − ln(R of the stratum) − Pen(x against other sets),
//!
//! which is π(T', X')/(R·q) up to one constant. For a set, ln Z is the integral of the
//! [`conditional`](crate::model::conditional) law with the ratio of the prior and of the
//! appearance, and q that law γ. For "new", ln Z is the prior's ratio alone, γ = N(z_i, 1/(2a)),
//! and q = ½γ + ½ [`ring`](crate::model::ring) about the candidate with the most members that has
//! its mean within D of z_i (of equals the nearest). The present place takes one place of its own
//! stratum.

use super::cells::Place;
use super::laws::Laws;
use super::placement::{LARGE, Placement};
use crate::model::conditional::Conditional;
use crate::model::moments::{Moments, square_distance};
use crate::model::penalty::{LANES, PADDING};
use crate::model::ring::{Leaving, Ring, ln_over_mixture};
use crate::sampler::State;
use crate::sampler::choices::Random;

/// Share of the normal law among particles of a set of its own, where there is a ring.
pub(super) const NORMAL: f64 = 0.5;

/// A stratum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stratum {
    /// A set of its own.
    New,
    /// The candidate of this index.
    Joins(usize),
}

/// Where a detection is now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Present {
    /// In this stratum.
    In(Stratum),
    /// In a set that is no candidate.
    Far,
}

/// A set that the detection could join.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) set_ix: u32,
    /// ln Z.
    pub(super) ln_z: f64,
    pub(super) law: Conditional,
}

/// A place, with its stratum and ln of its weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Particle {
    pub(super) x_m: [f64; 2],
    pub(super) stratum: Stratum,
    pub(super) ln_weight: f64,
}

/// Candidates and particles of one detection; working space.
pub(super) struct Particles {
    n_new: usize,
    n_join: usize,
    ln_n_new: f64,
    ln_n_join: f64,
    pub(super) detection: u32,
    pub(super) present: Present,
    pub(super) candidates: Vec<Candidate>,
    ring: Option<Ring>,
    ln_new: f64,
    place: Place,
    /// Locations near z_i without i: x, y and set.
    near: [Vec<f64>; 3],
    /// The last detection for which each set was met.
    met: Vec<u64>,
    round: u64,
    /// The present place first, unless it is far.
    pub(super) particles: Vec<Particle>,
    /// w over the largest.
    pub(super) weights: Vec<f64>,
    /// ln of the largest w.
    pub(super) ln_largest: f64,
}

impl Particles {
    /// With so many particles for a set of its own, and for each candidate.
    pub(super) fn new(n_detections: usize, n_new: usize, n_join: usize) -> Self {
        Self {
            n_new,
            n_join,
            ln_n_new: libm::log(n_new as f64),
            ln_n_join: libm::log(n_join as f64),
            detection: 0,
            present: Present::Far,
            candidates: Vec::new(),
            ring: None,
            ln_new: 0.0,
            place: [0; 2],
            near: [const { Vec::new() }; 3],
            met: vec![0; n_detections],
            round: 0,
            particles: Vec::new(),
            weights: Vec::new(),
            ln_largest: 0.0,
        }
    }

    /// Finds the candidates of detection i.
    pub(super) fn look(&mut self, laws: &Laws, state: &State, i: u32) {
        let (partition, placement) = (&state.partition, state.placement());
        let z_m = laws.z_m(i);
        let own = partition.set_of()[i as usize];
        let is_alone = partition.sets()[own as usize].len() == 1;
        self.detection = i;
        self.round += 1;
        self.candidates.clear();
        self.near.iter_mut().for_each(Vec::clear);
        self.place = placement.cells.place(z_m);
        let scene = Around {
            laws,
            placement,
            i,
            own,
        };
        let mut core: Option<(usize, f64, [f64; 2])> = None;
        for cell in placement.cells.around(self.place, 2) {
            for entry in cell {
                if entry.detection == i {
                    continue;
                }
                self.near[0].push(entry.x_m[0]);
                self.near[1].push(entry.x_m[1]);
                self.near[2].push(f64::from(entry.set_ix));
                let met = &mut self.met[entry.set_ix as usize];
                if *met != self.round {
                    *met = self.round;
                    let others = scene.candidate(entry.set_ix, &mut self.candidates);
                    let d2 = square_distance(z_m, others.mean_m);
                    let is_larger = core
                        .is_none_or(|(n, least, _)| others.n > n || (others.n == n && d2 < least));
                    if is_larger && d2 < laws.penalty().radius_m * laws.penalty().radius_m {
                        core = Some((others.n, d2, others.mean_m));
                    }
                }
            }
        }
        for &set_ix in placement.large.list() {
            let n_others = partition.sets()[set_ix as usize].len() - usize::from(set_ix == own);
            if self.met[set_ix as usize] != self.round && n_others >= LARGE {
                scene.candidate(set_ix, &mut self.candidates);
            }
        }
        let padded = self.near[0].len().next_multiple_of(LANES);
        for (column, padding) in self.near.iter_mut().zip([PADDING, PADDING, -2.0]) {
            column.resize(padded, padding);
        }
        self.ring = core.map(|(n, _, centre_m)| {
            let leaving = Leaving {
                centre_m,
                from_m: z_m,
                precision: laws.model.precisions().0,
                n_pairs: n,
            };
            Ring::new(laws.penalty(), &leaving)
        });
        let n_sets_without = partition.n_sets() - usize::from(is_alone);
        self.ln_new =
            laws.ln_opens(n_sets_without) + laws.model.appearance().ln_likelihood_of(scene.tally());
        self.present = if is_alone {
            Present::In(Stratum::New)
        } else {
            let mut sets = self.candidates.iter();
            let found = sets.position(|candidate| candidate.set_ix == own);
            found.map_or(Present::Far, |ix| Present::In(Stratum::Joins(ix)))
        };
    }

    /// ln γ/q of a place for a set of its own.
    pub(super) fn ln_over_mixture(&self, laws: &Laws, x_m: [f64; 2]) -> f64 {
        let Some(ring) = &self.ring else {
            return 0.0;
        };
        let Some(beyond) = ring.beyond(x_m) else {
            return -libm::log(NORMAL);
        };
        let a = laws.model.precisions().0;
        let e2 = square_distance(x_m, laws.z_m(self.detection));
        let ln_normal = libm::log(a / std::f64::consts::PI) - a * e2;
        let ln_ring = beyond.ln_density - beyond.h;
        ln_over_mixture(NORMAL, ln_ring - ln_normal + libm::log(1.0 - NORMAL))
    }

    /// The set of a stratum as the columns have it.
    fn label(&self, stratum: Stratum) -> f64 {
        match stratum {
            Stratum::New => -1.0,
            Stratum::Joins(ix) => f64::from(self.candidates[ix].set_ix),
        }
    }

    /// ln w of a place.
    pub(super) fn ln_weight(
        &self,
        laws: &Laws,
        placement: &Placement,
        x_m: [f64; 2],
        stratum: Stratum,
    ) -> f64 {
        let ln_gamma = match stratum {
            Stratum::New => self.ln_new + self.ln_over_mixture(laws, x_m) - self.ln_n_new,
            Stratum::Joins(ix) => self.candidates[ix].ln_z - self.ln_n_join,
        };
        let penalty = laws.penalty();
        let cell = placement.cells.place(x_m);
        let is_gathered = [0, 1]
            .iter()
            .all(|&axis| cell[axis].abs_diff(self.place[axis]) <= 1);
        let sum = if is_gathered {
            let near = [0, 1, 2].map(|column| self.near[column].as_slice());
            penalty.sum_over_others(x_m, self.label(stratum), near)
        } else {
            let set_ix = match stratum {
                Stratum::New => u32::MAX,
                Stratum::Joins(ix) => self.candidates[ix].set_ix,
            };
            sum_without(laws, placement, x_m, (self.detection, set_ix))
        };
        ln_gamma - penalty.height * sum
    }

    /// Draws and weighs the particles of all strata.
    pub(super) fn draw(&mut self, laws: &Laws, state: &State, random: &mut impl Random) {
        let placement = state.placement();
        let z_m = laws.z_m(self.detection);
        let alone = laws.conditionals.given(z_m, &Moments::default());
        self.particles.clear();
        let mut kept = [0; 2];
        let mut kept_in = usize::MAX;
        if let Present::In(stratum) = self.present {
            let x_m = placement.x_m[self.detection as usize];
            self.push(laws, placement, x_m, stratum);
            match stratum {
                Stratum::New => kept[0] = 1,
                Stratum::Joins(ix) => (kept[1], kept_in) = (1, ix),
            }
        }
        for _ in kept[0]..self.n_new {
            let x_m = match self.ring {
                Some(ring) if random.uniform() >= NORMAL => {
                    let h = random.exponential();
                    ring.place(random.direction(), h)
                }
                _ => alone.place(random.normals()),
            };
            self.push(laws, placement, x_m, Stratum::New);
        }
        for ix in 0..self.candidates.len() {
            let law = self.candidates[ix].law;
            for _ in usize::from(ix == kept_in)..self.n_join {
                let x_m = law.place(random.normals());
                self.push(laws, placement, x_m, Stratum::Joins(ix));
            }
        }
        let of = |particle: &Particle| particle.ln_weight;
        let largest = self
            .particles
            .iter()
            .map(of)
            .fold(f64::NEG_INFINITY, f64::max);
        self.ln_largest = largest;
        self.weights.clear();
        let relative = self
            .particles
            .iter()
            .map(|p| libm::exp(p.ln_weight - largest));
        self.weights.extend(relative);
    }

    /// Which particles a detection that leaves its set, or that joins one, chooses from.
    pub(super) fn side(&self, leaves: bool) -> std::ops::Range<usize> {
        // The present place is first, then come those of a set of its own.
        if leaves {
            1..1 + self.n_new
        } else {
            self.n_new..self.particles.len()
        }
    }

    fn push(&mut self, laws: &Laws, placement: &Placement, x_m: [f64; 2], stratum: Stratum) {
        self.particles.push(Particle {
            x_m,
            stratum,
            ln_weight: self.ln_weight(laws, placement, x_m, stratum),
        });
    }
}

/// Σ f/H between a place and all locations but those of one detection and of one set.
pub(super) fn sum_without(
    laws: &Laws,
    placement: &Placement,
    x_m: [f64; 2],
    (detection, set_ix): (u32, u32),
) -> f64 {
    let penalty = laws.penalty();
    placement.cells.sum_near(
        x_m,
        penalty.inverse_square_radius(),
        |u2| crate::model::Penalty::share(penalty.shape, u2),
        |entry| entry.detection == detection || entry.set_ix == set_ix,
    )
}

/// A detection among the others.
pub(super) struct Around<'a> {
    pub(super) laws: &'a Laws<'a>,
    pub(super) placement: &'a Placement,
    pub(super) i: u32,
    pub(super) own: u32,
}

impl Around<'_> {
    fn tally(&self) -> crate::model::appearance::Tally {
        self.laws.model.appearance().tally(&[self.i])
    }

    /// Adds a set to the candidates; returns the others' locations.
    fn candidate(&self, set_ix: u32, candidates: &mut Vec<Candidate>) -> Moments {
        let (candidate, others) = self.candidate_of(set_ix);
        candidates.push(candidate);
        others
    }

    /// A set as a candidate, and the others' locations.
    pub(super) fn candidate_of(&self, set_ix: u32) -> (Candidate, Moments) {
        let sums = &self.placement.sums[set_ix as usize];
        let (others, tally) = if set_ix == self.own {
            let x_m = self.placement.x_m[self.i as usize];
            (sums.x.without(x_m), sums.tally.without(self.tally()))
        } else {
            (sums.x, sums.tally)
        };
        let law = self.laws.conditionals.given(self.laws.z_m(self.i), &others);
        let candidate = Candidate {
            set_ix,
            ln_z: law.ln_integral
                + self.laws.ln_joins(others.n)
                + self.laws.model.appearance().ln_joining(tally, self.tally()),
            law,
        };
        (candidate, others)
    }
}
