//! `cut`: one set becomes two along a straight line, two sets become one, or two become two others.
//!
//! i and j are neighbours, drawn by the [doubt](crate::model::neighbours) about the pair, which does
//! not look at T and so cancels. Positions z count, in coordinates in which the mean covariance of
//! the members U is round.
//!
//! - i and j are in one set: it is cut by a [uniform line](super::lines) that crosses the segment
//!   between them.
//! - They are in two sets, A and B: these become one, or, with probability ½, their union is cut
//!   anew in the same way.
//!
//! A cut gives A ∋ i and B ∋ j with probability s(A, B)/(2|z_i − z_j|), s the measure of the lines
//! that part A from B. So q(T|T')/q(T'|T) is |z_i − z_j|/s for one set into two, its inverse for two
//! into one, and s(A, B)/s(A', B') for two into two. Two sets that no line parts stay. Locations
//! come by [`blocks`](super::blocks).
//!
//! Of the 2^{n−1} − 1 ways to split a set, n(n − 1)/2 at most are cuts by a line. Landmarks are
//! parted by one as a rule, so that a large group finds its way out at once.

use super::blocks::MOST;
use super::laws::Laws;
use super::lines::{Line, Parting};
use super::{Explicit, MoveKind};
use crate::model::location_law::whitened;
use crate::sampler::choices::Random;
use crate::sampler::{State, StepInfo};

/// Working space.
#[derive(Default)]
pub(super) struct Cut {
    parting: Parting,
    /// The two sides of a cut.
    sides: [Vec<u32>; 2],
}

/// Positions as a cut sees them: from detection i, whitened.
struct View<'a> {
    laws: &'a Laws<'a>,
    whiten: [f64; 3],
    centre_m: [f64; 2],
}

impl View<'_> {
    fn at(&self, i: u32) -> [f64; 2] {
        whitened(self.whiten, self.centre_m, self.laws.z_m(i))
    }
}

impl Explicit<'_> {
    pub(super) fn cut(&mut self, state: &mut State, random: &mut impl Random) -> StepInfo {
        self.change.clear();
        let ln_ratio = self.cut_or_join(state, random);
        self.try_change(MoveKind::Cut, ln_ratio, state, random)
    }

    /// Describes the change; ln q(T|T') − ln q(T'|T). `None` also if it would change nothing.
    pub(super) fn cut_or_join(&mut self, state: &State, random: &mut impl Random) -> Option<f64> {
        let Self {
            laws, change, cut, ..
        } = self;
        let partition = &state.partition;
        let [i, j] = laws.neighbours.doubtful_pair(random.uniform())?;
        let [own, other] = [i, j].map(|i| partition.set_of()[i as usize]);
        let apart = own != other;
        let ours = partition.sets()[own as usize].as_slice();
        let theirs = if apart {
            partition.sets()[other as usize].as_slice()
        } else {
            &[]
        };
        if ours.len() + theirs.len() > MOST {
            return None;
        }
        let everyone = || ours.iter().chain(theirs).copied();
        let view = View {
            laws,
            whiten: laws.whitening(everyone()),
            centre_m: laws.z_m(i),
        };
        let mut parting = |first: &[u32], second: &[u32]| {
            let [first, second] = [first, second].map(|set| set.iter().map(|&k| view.at(k)));
            cut.parting.measure(first, second)
        };
        let present = if apart {
            Some(parting(ours, theirs)?)
        } else {
            None
        };
        let to = view.at(j);
        let all = 2.0 * (to[0] * to[0] + to[1] * to[1]).sqrt();
        change.remove(own);
        if let Some(present) = present {
            change.remove(other);
            if random.coins(1) == 1 {
                change.add().extend(everyone());
                return Some(libm::log(present / all) - libm::log(0.5));
            }
        }
        let line = Line::across([0.0; 2], to, random);
        let [first, second] = &mut cut.sides;
        first.clear();
        second.clear();
        for k in everyone() {
            let beyond = k == j || (k != i && line.is_beyond(view.at(k)));
            if beyond { &mut *second } else { &mut *first }.push(k);
        }
        let proposed = parting(first, second)?;
        change.add().extend_from_slice(first);
        change.add().extend_from_slice(second);
        match present {
            Some(_) if first.len() == ours.len() && first.iter().eq(ours) => None,
            Some(present) => Some(libm::log(present / proposed)),
            None => Some(libm::log(0.5) - libm::log(proposed / all)),
        }
    }
}
