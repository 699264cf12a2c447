//! Pair reassign: two detections taken out together and put back one after the other.
//!
//! A frequent trap is a *bridge*, a set of two detections of two different landmarks, whose locations sit
//! half-way, outside the radius of both: neither can leave without the other paying. Here they leave together.
//!
//! Detection a is uniform; b comes from σ(b|a,T) = ½·uniform over the others of a's set + ½·K(b|a), or K(b|a) if a
//! is alone, K a law that looks at z alone ([`Nearby`](crate::model::nearby::Nearby)). On T∖{a,b} first a is placed,
//! then b: candidates are the sets that hold a neighbour of it, "new", and for b also the set where a is now, with
//! probability (1−δ)·softmax(s) + δ/(number of candidates). The way back replays the present places,
//!
//! ln q(T|T') − ln q(T'|T) = ln σ(b|a,T')·p(present) − ln σ(b|a,T)·p(proposed);
//!
//! if one of them is no candidate the move could not be reversed, and is a **hold**. So is T' = T.

use super::anchors::FLOOR;
use super::choices::{Choices, nearby};
use super::moves::{Proposal, Scene};
use crate::model::Block;
use crate::partition::Change;

/// Where a detection can go.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// A set of its own.
    New,
    /// What T∖{a,b} has of the set with this index.
    Set(u32),
    /// The new set that a has opened.
    WithFirst,
}

/// Working space.
#[derive(Clone, Debug, Default)]
pub struct PairReassign {
    places: Vec<Place>,
    probabilities: Vec<f64>,
}

/// Where the detection that is placed second can find the first.
#[derive(Clone, Copy)]
struct First {
    i: u32,
    place: Place,
}

impl PairReassign {
    /// Describes the move in `change`. Impossible with one detection.
    pub fn propose(
        &mut self,
        scene: &Scene,
        change: &mut Change,
        choices: &mut impl Choices,
    ) -> Proposal {
        let (partition, set_of) = (scene.partition, scene.partition.set_of());
        let n = partition.n_detections();
        if n < 2 {
            return Proposal::Impossible;
        }
        let a = choices.below(n) as u32;
        let own = &partition.sets()[set_of[a as usize] as usize];
        let b = if own.len() > 1 && choices.coins(1) == 1 {
            let place = own.iter().position(|&i| i == a).expect("a member");
            let draw = choices.below(own.len() - 1);
            own[draw + usize::from(draw >= place)]
        } else {
            nearby(scene.surrogate.nearby(), a, choices)
        };
        let pair = [a, b];
        let was_together = set_of[a as usize] == set_of[b as usize];
        let rest = |set_ix: u32| {
            let members = partition.sets()[set_ix as usize].iter();
            members.filter(|i| !pair.contains(i)).count()
        };

        // Where they are now, on T∖{a,b} and then with a back in its place.
        let present_a = match rest(set_of[a as usize]) {
            0 => Place::New,
            _ => Place::Set(set_of[a as usize]),
        };
        let present_b = match rest(set_of[b as usize]) {
            0 if was_together => Place::WithFirst,
            0 => Place::New,
            _ => Place::Set(set_of[b as usize]),
        };

        self.weigh(scene, pair, a, None);
        let Some(back_a) = self.probability_of(present_a) else {
            return Proposal::Hold;
        };
        let drawn = choices.index(&self.probabilities);
        let (place_a, forth_a) = (self.places[drawn], self.probabilities[drawn]);

        let first = |place| Some(First { i: a, place });
        self.weigh(scene, pair, b, first(present_a));
        let Some(back_b) = self.probability_of(present_b) else {
            return Proposal::Hold;
        };
        self.weigh(scene, pair, b, first(place_a));
        let drawn = choices.index(&self.probabilities);
        let (place_b, forth_b) = (self.places[drawn], self.probabilities[drawn]);
        if place_a == present_a && place_b == present_b {
            return Proposal::Hold;
        }

        self.describe(scene, pair, [place_a, place_b], change);
        let together = place_b == Place::WithFirst || (place_a == place_b && place_a != Place::New);
        let n_with_a = 1
            + usize::from(together)
            + match place_a {
                Place::Set(set_ix) => rest(set_ix),
                Place::New | Place::WithFirst => 0,
            };
        let far = scene.surrogate.nearby().probability(a, b);
        let chosen = |n_with_a: usize, together: bool| match n_with_a {
            1 => far,
            n if together => 0.5 / (n - 1) as f64 + 0.5 * far,
            _ => 0.5 * far,
        };
        let back = chosen(n_with_a, together) * back_a * back_b;
        let forth = chosen(own.len(), was_together) * forth_a * forth_b;
        Proposal::Change {
            ln_ratio: libm::log(back) - libm::log(forth),
        }
    }

    fn probability_of(&self, place: Place) -> Option<f64> {
        let ix = self.places.iter().position(|&other| other == place)?;
        Some(self.probabilities[ix])
    }

    /// The places for detection i on T without the pair, and with `first` if it is placed already.
    fn weigh(&mut self, scene: &Scene, pair: [u32; 2], i: u32, first: Option<First>) {
        let surrogate = scene.surrogate;
        self.places.clear();
        // Scores, until they are turned into probabilities.
        self.probabilities.clear();
        self.places.push(Place::New);
        self.probabilities.push(0.0);
        if let Some(first) = first {
            // It joins the first wherever that is, neighbour or not.
            self.places.push(match first.place {
                Place::New => Place::WithFirst,
                place => place,
            });
            self.probabilities.push(0.0);
        }
        let (neighbours, costs) = surrogate.neighbours().of_detection(i);
        for (&j, &cost) in neighbours.iter().zip(costs) {
            let place = match first {
                Some(first) if first.i == j => self.places[1],
                _ if pair.contains(&j) => continue,
                _ => Place::Set(scene.partition.set_of()[j as usize]),
            };
            match self.places.iter().position(|&other| other == place) {
                Some(ix) => self.probabilities[ix] = self.probabilities[ix].max(cost),
                None => {
                    self.places.push(place);
                    self.probabilities.push(cost);
                }
            }
        }
        let mut largest = f64::NEG_INFINITY;
        for (place, score) in self.places.iter().zip(&mut self.probabilities) {
            let block = match *place {
                Place::New => Block::default(),
                Place::WithFirst => surrogate.block(&pair[..1]),
                Place::Set(set_ix) => {
                    let mut block = scene.blocks[set_ix as usize];
                    for gone in pair {
                        if scene.partition.set_of()[gone as usize] == set_ix {
                            block = surrogate.without(&block, gone);
                        }
                    }
                    match first {
                        Some(first) if first.place == *place => surrogate.with(&block, first.i),
                        _ => block,
                    }
                }
            };
            *score += surrogate.ln_gain(&block, i);
            largest = largest.max(*score);
        }
        let mut total = 0.0;
        for score in &mut self.probabilities {
            *score = libm::exp(*score - largest);
            total += *score;
        }
        let even = FLOOR / self.places.len() as f64;
        for weight in &mut self.probabilities {
            *weight = (1.0 - FLOOR) * (*weight / total) + even;
        }
    }

    /// The sets that go, and those that come.
    fn describe(&self, scene: &Scene, pair: [u32; 2], places: [Place; 2], change: &mut Change) {
        let set_of = scene.partition.set_of();
        let target = |place: Place| match place {
            Place::Set(set_ix) => Some(set_ix),
            Place::New | Place::WithFirst => None,
        };
        let now = pair.map(|i| Some(set_of[i as usize]));
        for set_ix in now.into_iter().chain(places.map(target)).flatten() {
            if change.removed().contains(&set_ix) {
                continue;
            }
            change.remove(set_ix);
            let joins = |k: usize| target(places[k]) == Some(set_ix);
            let members = scene.partition.sets()[set_ix as usize].iter().copied();
            let mut staying = members.filter(|i| !pair.contains(i)).peekable();
            if staying.peek().is_some() {
                let set = change.add();
                set.extend(staying);
                set.extend((0..2).filter(|&k| joins(k)).map(|k| pair[k]));
            }
        }
        if places[0] == Place::New {
            change.add().push(pair[0]);
            if places[1] == Place::WithFirst {
                let last = change.add_to_last();
                last.push(pair[1]);
            }
        }
        if places[1] == Place::New {
            change.add().push(pair[1]);
        }
    }
}
