//! Which moves there are, and how they are mixed.

use std::fmt;
use std::str::FromStr;

use rand::{Rng, RngExt};

/// A move that a mix can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// The report's proposal (algorithm 2): merge or split, each with probability ½.
    SplitMerge,
    /// T' = T with new importance draws, accepted with min(1, Ẑ'/Ẑ).
    Refresh,
}

impl Move {
    const ALL: [(Self, &'static str); 2] = [
        (Self::SplitMerge, "split-merge"),
        (Self::Refresh, "refresh"),
    ];

    fn name(self) -> &'static str {
        match self {
            Self::SplitMerge => "split-merge",
            Self::Refresh => "refresh",
        }
    }
}

/// What a proposal is counted as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MoveKind {
    /// Two sets into one.
    Merge,
    /// One set into two.
    Split,
    /// New importance draws.
    Refresh,
}

impl MoveKind {
    /// All kinds, in the order in which they are reported.
    pub const ALL: [Self; 3] = [Self::Merge, Self::Split, Self::Refresh];

    /// The key under which outputs report it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Merge => "merge",
            Self::Split => "split",
            Self::Refresh => "refresh",
        }
    }
}

/// Moves with weights that sum to one. Written `split-merge=0.8,refresh=0.2`.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveMix {
    weights: Vec<(Move, f64)>,
}

impl MoveMix {
    /// Draws the move of a step. A mix of one move draws nothing.
    pub fn choose(&self, rng: &mut impl Rng) -> Move {
        let (last, others) = self
            .weights
            .split_last()
            .expect("a mix names at least one move");
        if !others.is_empty() {
            let mut left: f64 = rng.random();
            for (candidate, weight) in others {
                if left < *weight {
                    return *candidate;
                }
                left -= weight;
            }
        }
        last.0
    }
}

impl fmt::Display for MoveMix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (candidate, weight)) in self.weights.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            write!(f, "{comma}{}={weight}", candidate.name())?;
        }
        Ok(())
    }
}

impl FromStr for MoveMix {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut weights: Vec<(Move, f64)> = Vec::new();
        for part in text.split(',') {
            let (name, weight) = part.trim().split_once('=').unwrap_or((part.trim(), "1"));
            let Some(&(candidate, _)) = Move::ALL.iter().find(|(_, known)| *known == name) else {
                let known: Vec<_> = Move::ALL.iter().map(|(_, name)| *name).collect();
                return Err(format!(
                    "moves out of {}, as in split-merge=0.8,refresh=0.2",
                    known.join(", ")
                ));
            };
            let weight: f64 = match weight.parse() {
                Ok(weight) if weight >= 0.0 && f64::is_finite(weight) => weight,
                _ => return Err(format!("a weight of at least 0 for {name}")),
            };
            if weights.iter().any(|(named, _)| *named == candidate) {
                return Err(format!("{name} once"));
            }
            weights.push((candidate, weight));
        }
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err("at least one weight above 0".to_owned());
        }
        if weights
            .iter()
            .all(|(candidate, weight)| *candidate == Move::Refresh || *weight == 0.0)
        {
            return Err("a move that changes the topology beside refresh".to_owned());
        }
        weights.retain(|(_, weight)| *weight > 0.0);
        weights.sort_by_key(|(candidate, _)| *candidate as usize);
        // Weights that sum to 1 but for rounding stay as they are, so that what this writes reads back.
        if (total - 1.0).abs() > 1e-9 {
            for (_, weight) in &mut weights {
                *weight /= total;
            }
        }
        Ok(Self { weights })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    fn parse(text: &str) -> Result<MoveMix, String> {
        text.parse()
    }

    #[test]
    fn weights_are_normalised_and_ordered() {
        assert_eq!(
            parse("split-merge").map(|mix| mix.to_string()),
            Ok("split-merge=1".into())
        );
        assert_eq!(
            parse("refresh=1, split-merge=3").map(|mix| mix.to_string()),
            Ok("split-merge=0.75,refresh=0.25".into())
        );
        for text in [
            "",
            "gibbs=1",
            "split-merge=-1",
            "split-merge=nan",
            "refresh=1",
            "split-merge=0",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
        assert!(parse("split-merge,split-merge").is_err());
    }

    #[test]
    fn what_is_written_reads_back() {
        for k in 1..100 {
            let mix = parse(&format!("split-merge=0.01,refresh=0.{k:02}")).expect("a good mix");
            assert_eq!(parse(&mix.to_string()), Ok(mix));
        }
    }

    #[test]
    fn moves_come_by_their_weights() {
        let mix = parse("split-merge=3,refresh=1").expect("a good mix");
        let mut rng = Purpose::new("test", 1).generator();
        let n = 40_000;
        let refreshes = (0..n)
            .filter(|_| mix.choose(&mut rng) == Move::Refresh)
            .count();
        // Binomial(n, ¼): five standard deviations.
        let sd = (n as f64 * 0.25 * 0.75).sqrt();
        assert!((refreshes as f64 - n as f64 * 0.25).abs() < 5.0 * sd);
    }
}
