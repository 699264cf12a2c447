//! What detections look like, as evidence for which of them are one landmark.
//!
//! Positions and appearance are taken as independent given the topology (Ranganathan & Dellaert, T-RO 22(1), 2006, section
//! VI-B), so π(T) gains the factor P(O|T) = Π_S P(O_S): one term for each set, whatever the locations. It is added
//! to the bound of a set, and samplers know nothing of it. A new kind of appearance is another field of [`Appearance`].
//!
//! **Corner kinds.** Each landmark has a kind k, open or closed, with probability ½ each; each of its detections shows a
//! kind o with probability c(o|k), the confusion matrix, independently of the others given k. So
//!
//! ln P(O_S) = ln Σ_k ½ Π_{i∈S} c(o_i|k),
//!
//! detections without a kind left out. Summed over all o, Π_S P(O_S) is 1 for every T: a likelihood, with its
//! normaliser, so topologies can be compared. Two detections of a kind gain by being merged and two of
//! different kinds lose, neither without bound: a corner looks closed from one side and open from the other
//! often enough that a difference must not be a ban.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::detections::Corner;

/// How often a corner's kind is misread: the two free entries of the confusion matrix, each in (0, ½].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confusion {
    /// c(closed | open).
    pub open_as_closed: f64,
    /// c(open | closed).
    pub closed_as_open: f64,
}

impl Confusion {
    /// ln P(O_S) of a set with so many detections that look open and so many that look closed, nats; ≤ 0.
    pub fn ln_likelihood(&self, n_open: usize, n_closed: usize) -> f64 {
        let (open, closed) = (n_open as f64, n_closed as f64);
        let (p, q) = (self.open_as_closed, self.closed_as_open);
        let if_open = open * libm::log1p(-p) + closed * libm::log(p);
        let if_closed = open * libm::log(q) + closed * libm::log1p(-q);
        let (low, high) = (if_open.min(if_closed), if_open.max(if_closed));
        high + libm::log1p(libm::exp(low - high)) - std::f64::consts::LN_2
    }
}

/// The setting `corner_kinds`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CornerKinds {
    /// Kinds are not looked at.
    #[default]
    Off,
    /// Kinds are evidence, misread so often.
    Confusion(Confusion),
}

impl fmt::Display for CornerKinds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("off"),
            Self::Confusion(c) if c.open_as_closed == c.closed_as_open => {
                write!(f, "confusion:{}", c.open_as_closed)
            }
            Self::Confusion(c) => write!(f, "confusion:{},{}", c.open_as_closed, c.closed_as_open),
        }
    }
}

impl FromStr for CornerKinds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            "off, confusion:P or confusion:P,Q with probabilities above 0 and up to 0.5 (P of an open corner \
             seen as closed, Q of a closed one seen as open)"
                .to_owned()
        };
        if text == "off" {
            return Ok(Self::Off);
        }
        let rates = text.strip_prefix("confusion:").ok_or_else(expected)?;
        let rate = |text: &str| {
            let rate = text.trim().parse::<f64>().map_err(|_| expected())?;
            // Below the smallest normal number a logarithm would lose its digits.
            let good = (f64::MIN_POSITIVE..=0.5).contains(&rate);
            good.then_some(rate).ok_or_else(expected)
        };
        let (p, q) = rates.split_once(',').unwrap_or((rates, rates));
        Ok(Self::Confusion(Confusion {
            open_as_closed: rate(p)?,
            closed_as_open: rate(q)?,
        }))
    }
}

/// What is known of how the detections of a data set look, and how that bears on topologies.
#[derive(Clone, Debug, Default)]
pub struct Appearance {
    corner_kinds: Option<(Confusion, Vec<Option<Corner>>)>,
}

impl Appearance {
    /// Adds the kinds of the corners, one for each detection, `None` where not known.
    #[must_use]
    pub fn with_corner_kinds(mut self, confusion: Confusion, kinds: Vec<Option<Corner>>) -> Self {
        self.corner_kinds = Some((confusion, kinds));
        self
    }

    /// The same of some of the detections, in this order.
    #[must_use]
    pub(super) fn part(&self, chosen: &[u32]) -> Self {
        let of = |kinds: &Vec<Option<Corner>>| chosen.iter().map(|&i| kinds[i as usize]).collect();
        let corner_kinds = self.corner_kinds.as_ref();
        Self {
            corner_kinds: corner_kinds.map(|(confusion, kinds)| (*confusion, of(kinds))),
        }
    }

    /// ln P(O_S) of a set, members in any order, nats; 0 where nothing is looked at.
    pub fn ln_likelihood(&self, members: &[u32]) -> f64 {
        if self.corner_kinds.is_none() {
            return 0.0;
        }
        self.ln_likelihood_of(self.tally(members))
    }

    /// What of a set its likelihood depends on; nothing where nothing is looked at.
    pub fn tally(&self, members: &[u32]) -> Tally {
        let mut tally = Tally::default();
        if let Some((_, kinds)) = &self.corner_kinds {
            for &i in members {
                match kinds[i as usize] {
                    Some(Corner::Open) => tally.n_open += 1,
                    Some(Corner::Closed) => tally.n_closed += 1,
                    None => {}
                }
            }
        }
        tally
    }

    /// ln P(O_S) of a set with this tally, nats; 0 where nothing is looked at.
    pub fn ln_likelihood_of(&self, tally: Tally) -> f64 {
        let kinds = self.corner_kinds.as_ref();
        kinds.map_or(0.0, |(confusion, _)| {
            confusion.ln_likelihood(tally.n_open as usize, tally.n_closed as usize)
        })
    }

    /// What a detection adds to ln P(O_S) of the others of its set, nats.
    pub fn ln_joining(&self, others: Tally, one: Tally) -> f64 {
        if self.corner_kinds.is_none() {
            return 0.0;
        }
        self.ln_likelihood_of(others.with(one)) - self.ln_likelihood_of(others)
    }
}

/// How many detections of a set look open and how many closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    n_open: u32,
    n_closed: u32,
}

impl Tally {
    /// Of both together.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self {
            n_open: self.n_open + other.n_open,
            n_closed: self.n_closed + other.n_closed,
        }
    }

    /// Without a part.
    #[must_use]
    pub fn without(self, part: Self) -> Self {
        Self {
            n_open: self.n_open - part.n_open,
            n_closed: self.n_closed - part.n_closed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::Partitions;

    const OPEN: Option<Corner> = Some(Corner::Open);
    const CLOSED: Option<Corner> = Some(Corner::Closed);

    fn confusion(open_as_closed: f64, closed_as_open: f64) -> Confusion {
        Confusion {
            open_as_closed,
            closed_as_open,
        }
    }

    /// ln P(O|T).
    fn ln_likelihood(confusion: Confusion, kinds: &[Option<Corner>], sets: &[&[u32]]) -> f64 {
        let appearance = Appearance::default().with_corner_kinds(confusion, kinds.to_vec());
        sets.iter()
            .map(|members| appearance.ln_likelihood(members))
            .sum()
    }

    #[test]
    fn by_hand() {
        let c = confusion(0.1, 0.3);
        let near = |kinds: &[Option<Corner>], sets: &[&[u32]], expected: f64| {
            let got = ln_likelihood(c, kinds, sets).exp();
            assert!((got - expected).abs() < 1e-15, "{got} {expected}");
        };
        // ½ (0.9 + 0.3), ½ (0.1 + 0.7).
        near(&[OPEN], &[&[0]], 0.6);
        near(&[CLOSED], &[&[0]], 0.4);
        // ½ (0.9² + 0.3²), ½ (0.1² + 0.7²), ½ (0.9·0.1 + 0.3·0.7).
        near(&[OPEN, OPEN], &[&[0, 1]], 0.45);
        near(&[CLOSED, CLOSED], &[&[1, 0]], 0.25);
        near(&[OPEN, CLOSED], &[&[0, 1]], 0.15);
        // A detection without a kind says nothing, wherever it is.
        near(&[OPEN, None, CLOSED], &[&[0, 1, 2]], 0.15);
        near(&[OPEN, None, CLOSED], &[&[0, 2], &[1]], 0.15);
        near(&[OPEN, None, CLOSED], &[&[0], &[1, 2]], 0.6 * 0.4);
        // ½ (0.9²·0.1 + 0.3²·0.7).
        near(&[OPEN, CLOSED, OPEN], &[&[2, 0, 1]], 0.5 * (0.081 + 0.063));
        assert_eq!(Appearance::default().ln_likelihood(&[0, 1]), 0.0);
    }

    #[test]
    fn a_detection_that_joins_is_counted() {
        let kinds = [OPEN, CLOSED, OPEN, None];
        let appearance =
            Appearance::default().with_corner_kinds(confusion(0.1, 0.3), kinds.to_vec());
        for (one, others) in [(0, [1, 2]), (1, [0, 2]), (3, [0, 1])] {
            let (single, rest) = (appearance.tally(&[one]), appearance.tally(&others));
            let whole = appearance.tally(&[others[0], others[1], one]);
            assert_eq!(rest.with(single), whole);
            assert_eq!(whole.without(single), rest);
            let gain = appearance.ln_likelihood(&[0, 1, 2, 3][..]);
            let gain = gain - appearance.ln_likelihood(&[0, 1, 2]);
            assert_eq!(gain, 0.0);
            let joins = appearance.ln_likelihood_of(whole) - appearance.ln_likelihood_of(rest);
            assert!((appearance.ln_joining(rest, single) - joins).abs() < 1e-15);
        }
    }

    #[test]
    fn alike_gains_and_unlike_loses() {
        for c in [
            confusion(0.1, 0.1),
            confusion(0.01, 0.4),
            confusion(0.3, 0.05),
        ] {
            let gain = |kinds: &[Option<Corner>]| {
                ln_likelihood(c, kinds, &[&[0, 1]]) - ln_likelihood(c, kinds, &[&[0], &[1]])
            };
            assert!(gain(&[OPEN, OPEN]) > 0.0 && gain(&[CLOSED, CLOSED]) > 0.0);
            assert!(gain(&[OPEN, CLOSED]) < 0.0);
        }
    }

    /// At ½ a kind says nothing: every topology has the same likelihood. Towards 0 a difference costs ever more, by
    /// ln 2p for a pair, and is finite for the least rate there is and for large sets.
    #[test]
    fn limits() {
        let kinds = [OPEN, CLOSED, OPEN, CLOSED];
        let sets: [&[&[u32]]; 3] = [
            &[&[0, 1, 2, 3]],
            &[&[0, 2], &[1, 3]],
            &[&[0], &[1], &[2], &[3]],
        ];
        for sets in sets {
            let got = ln_likelihood(confusion(0.5, 0.5), &kinds, sets);
            assert!((got + 4.0 * std::f64::consts::LN_2).abs() < 1e-14);
        }
        for p in [1e-3, 1e-9, 1e-100, f64::MIN_POSITIVE] {
            let pair = ln_likelihood(confusion(p, p), &kinds, &[&[0, 1]]);
            assert!((pair - libm::log(p) - libm::log1p(-p)).abs() < 1e-12 * pair.abs());
            let large = confusion(p, p).ln_likelihood(5000, 5000);
            assert!(large.is_finite() && large < 4999.0 * libm::log(p));
            let alike = confusion(p, p).ln_likelihood(10_000, 0);
            assert!((alike + std::f64::consts::LN_2 - 1e4 * libm::log1p(-p)).abs() < 1e-12);
        }
    }

    /// Σ_o P(o|T) = 1 for every topology, with and without a detection whose kind is not known.
    #[test]
    fn the_likelihood_is_proper() {
        let c = confusion(0.12, 0.34);
        for n_known in [4, 5] {
            for topology in Partitions::of(5) {
                let sets: Vec<Vec<u32>> = (0..topology.n_sets() as u32)
                    .map(|set| {
                        (0..5)
                            .filter(|&i| topology.labels()[i as usize] == set)
                            .collect()
                    })
                    .collect();
                let sets: Vec<&[u32]> = sets.iter().map(Vec::as_slice).collect();
                let total: f64 = (0..1_u32 << n_known)
                    .map(|code| {
                        let kind = |i: u32| match (i < n_known, code >> i & 1) {
                            (false, _) => None,
                            (true, 0) => OPEN,
                            _ => CLOSED,
                        };
                        let kinds: Vec<_> = (0..5).map(kind).collect();
                        ln_likelihood(c, &kinds, &sets).exp()
                    })
                    .sum();
                assert!((total - 1.0).abs() < 1e-13, "{topology}: {total}");
            }
        }
    }

    #[test]
    fn spelling() {
        for (text, canonical) in [
            ("off", "off"),
            ("confusion:0.1", "confusion:0.1"),
            ("confusion:0.10,0.1", "confusion:0.1"),
            ("confusion:0.1, 0.5", "confusion:0.1,0.5"),
        ] {
            assert_eq!(
                text.parse::<CornerKinds>().map(|k| k.to_string()),
                Ok(canonical.to_owned())
            );
        }
        for text in [
            "",
            "on",
            "confusion",
            "confusion:",
            "confusion:0",
            "confusion:0.6",
            "confusion:0.1,nan",
            "confusion:0.1,0.2,0.3",
            "confusion:1e-310",
        ] {
            assert!(text.parse::<CornerKinds>().is_err(), "{text}");
        }
    }
}
