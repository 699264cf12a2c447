//! Places that one detection could take: what `site` and `flip` choose from.
//!
//! Detection i is taken out. Its *strata* are: a set of its own ("new"); every set with a location
//! in the 5 × 5 cells around z_i (in the covariance model within 2.5 D besides); every set with at least [`LARGE`] others. They depend on T and X
//! without i alone. Each stratum draws particles from a law q of its own, and a particle x has the
//! weight
//!
//! ln w = ln Z + ln(γ/q) − ln(R of the stratum) − Pen(x against other sets),
//!
//! which is π(T', X')/(R·q) up to one constant. For a set, ln Z is the bound of the
//! [law](crate::model::location_law) of x there with the ratio of the prior and of the appearance;
//! in the covariance model also with what i costs the others where they are. q is the normal law of
//! that law, and ln(γ/q) = h. For "new", ln Z is the prior's ratio alone, γ is the law of i alone,
//! and q = ½γ + ½ [`ring`](crate::model::ring) about the candidate with the most members that has
//! its mean within D of z_i (of equals the nearest). The present place takes one place of its own
//! stratum.

use super::cells::{Place, STANDING};
use super::laws::Laws;
use super::pairs::Near;
use super::placement::{LARGE, Placement};
use crate::model::location_law::{Cone, LocationLaw, Normal, whitened};
use crate::model::moments::{Moments, square_distance};
use crate::model::ring::{Ring, ln_over_mixture};
use crate::partition::Partition;
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
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) set_ix: u32,
    /// ln Z.
    pub(super) ln_z: f64,
    pub(super) law: LocationLaw,
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
    /// Of the candidates' laws.
    pub(super) cones: Vec<Cone>,
    ring: Option<Ring>,
    /// The law of i alone.
    alone: Option<Normal>,
    ln_new: f64,
    place: Place,
    /// Locations near z_i without i.
    near: Near,
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
            cones: Vec::new(),
            ring: None,
            alone: None,
            ln_new: 0.0,
            place: [0; 2],
            near: Near::default(),
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
        self.cones.clear();
        self.near.clear();
        self.place = placement.cells.place(z_m);
        let scene = Around {
            laws,
            partition,
            placement,
            i,
            own,
        };
        let square_radius = laws.penalty().radius_m * laws.penalty().radius_m;
        let mut core: Option<Core> = None;
        for cell in placement.cells.around(self.place, 2) {
            for entry in cell {
                if entry.detection == i {
                    continue;
                }
                let is_near = laws.note(i, entry, &mut self.near);
                if entry.set_ix == STANDING {
                    continue;
                }
                let met = &mut self.met[entry.set_ix as usize];
                if !is_near || *met == self.round {
                    continue;
                }
                *met = self.round;
                let (candidate, others) = scene.candidate_of(entry.set_ix, &mut self.cones);
                self.candidates.push(candidate);
                let whiten = laws.whitening_to(i, scene.others(entry.set_ix));
                let d2 = square_distance(whitened(whiten, others.mean_m, z_m), [0.0; 2]);
                let is_larger = core
                    .is_none_or(|core| others.n > core.n || (others.n == core.n && d2 < core.d2));
                if is_larger && d2 < square_radius {
                    core = Some(Core {
                        n: others.n,
                        d2,
                        centre_m: others.mean_m,
                        whiten,
                    });
                }
            }
        }
        for &set_ix in placement.large.list() {
            let n_others = partition.sets()[set_ix as usize].len() - usize::from(set_ix == own);
            if self.met[set_ix as usize] != self.round && n_others >= LARGE {
                let (candidate, _) = scene.candidate_of(set_ix, &mut self.cones);
                self.candidates.push(candidate);
            }
        }
        self.near.pad();
        self.ring = core.map(|core| laws.ring(i, core.whiten, core.centre_m, core.n));
        self.alone = self.ring.map(|_| laws.density_alone(i));
        let n_sets_without = partition.n_sets() - usize::from(is_alone);
        self.ln_new =
            laws.ln_opens(n_sets_without) + laws.appearance().ln_likelihood_of(scene.tally());
        self.present = if is_alone {
            Present::In(Stratum::New)
        } else {
            let mut sets = self.candidates.iter();
            let found = sets.position(|candidate| candidate.set_ix == own);
            found.map_or(Present::Far, |ix| Present::In(Stratum::Joins(ix)))
        };
    }

    /// ln γ/q of a place for a set of its own.
    pub(super) fn ln_over_mixture(&self, x_m: [f64; 2]) -> f64 {
        let (Some(ring), Some(alone)) = (&self.ring, &self.alone) else {
            return 0.0;
        };
        let Some(beyond) = ring.beyond(x_m) else {
            return -libm::log(NORMAL);
        };
        let ln_ring = beyond.ln_density - beyond.h;
        let ln_normal = alone.ln_density(x_m);
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
            Stratum::New => self.ln_new + self.ln_over_mixture(x_m) - self.ln_n_new,
            Stratum::Joins(ix) => {
                let candidate = &self.candidates[ix];
                candidate.ln_z - self.ln_n_join + candidate.law.ln_excess(&self.cones, x_m)
            }
        };
        let cell = placement.cells.place(x_m);
        let is_gathered = [0, 1]
            .iter()
            .all(|&axis| cell[axis].abs_diff(self.place[axis]) <= 1);
        let sum = if is_gathered {
            laws.sum_noted(&self.near, x_m, self.label(stratum))
        } else {
            let own = match stratum {
                Stratum::New => u32::MAX,
                Stratum::Joins(ix) => self.candidates[ix].set_ix,
            };
            laws.sum_near(placement, self.detection, x_m, |set_ix| set_ix == own)
        };
        ln_gamma - laws.penalty_of(sum)
    }

    /// Draws and weighs the particles of all strata.
    pub(super) fn draw(&mut self, laws: &Laws, state: &State, random: &mut impl Random) {
        let placement = state.placement();
        let alone = laws.alone(self.detection);
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
            for _ in usize::from(ix == kept_in)..self.n_join {
                let x_m = self.candidates[ix].law.place(random.normals());
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

/// The candidate that the ring lies around.
#[derive(Clone, Copy)]
struct Core {
    n: usize,
    d2: f64,
    centre_m: [f64; 2],
    whiten: [f64; 3],
}

/// A detection among the others.
pub(super) struct Around<'a> {
    pub(super) laws: &'a Laws<'a>,
    pub(super) partition: &'a Partition,
    pub(super) placement: &'a Placement,
    pub(super) i: u32,
    pub(super) own: u32,
}

impl Around<'_> {
    fn tally(&self) -> crate::model::appearance::Tally {
        self.laws.appearance().tally(&[self.i])
    }

    /// The members of a set without the detection.
    fn others(&self, set_ix: u32) -> impl Iterator<Item = u32> + Clone {
        let (members, i) = (&self.partition.sets()[set_ix as usize], self.i);
        members.iter().copied().filter(move |&j| j != i)
    }

    /// A set as a candidate, and the others' locations. Cones are added to a list.
    pub(super) fn candidate_of(&self, set_ix: u32, cones: &mut Vec<Cone>) -> (Candidate, Moments) {
        let sums = &self.placement.sums[set_ix as usize];
        let x_m = &self.placement.x_m;
        let (others, tally) = if set_ix == self.own {
            let x_m = x_m[self.i as usize];
            (sums.x.without(x_m), sums.tally.without(self.tally()))
        } else {
            (sums.x, sums.tally)
        };
        let members = self.others(set_ix);
        let law = self.laws.joining(self.i, &others, members, x_m, cones);
        let candidate = Candidate {
            set_ix,
            ln_z: law.ln_bound
                + self.laws.ln_joins(others.n)
                + self.laws.appearance().ln_joining(tally, self.tally()),
            law,
        };
        (candidate, others)
    }
}
