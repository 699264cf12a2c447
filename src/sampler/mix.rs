//! How moves are mixed.

use std::fmt;
use std::str::FromStr;

use super::choices::Choices;
use super::{Estimator, Move};

/// Moves with weights that sum to one. Written `split-merge=0.8,refresh=0.2`.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveMix {
    /// In the order of [`Move::ALL`]; a weight of 0 is kept for `refresh` alone, where it says that there
    /// shall be none.
    weights: Vec<(Move, f64)>,
    /// The weights alone.
    probabilities: Vec<f64>,
}

/// The default mix of `fresh` and `common`, by trial: from one cluster of 8 × 8 detections (landmarks 10 m apart, noise 0.3 m, σ_o = σ_t = 1,
/// radius 3, height 50) it sampled the truth within 20,000 proposals for each of twenty seeds, and of the three mixes that
/// did it spent most of its time there.
pub const DEFAULT_MOVES: &str =
    "split-merge=0.1,reassign=0.2,pair-reassign=0.3,anchors=0.3,refresh=0.1";

/// The default mix of the estimator `explicit`, by trial. Four chains from starts apart were judged
/// converged after 4.1 and 5.2 s on 1,000 detections of 100 landmarks, and after 30 s on 10,240 of
/// 1,024. With `split-merge` in place of `cut` that took 4.4, 7.4 and 44 s.
pub const DEFAULT_EXPLICIT_MOVES: &str = "site=0.35,flip=0.25,slice=0.2,group=0.1,cut=0.1";

/// Weight of `refresh` that the estimator `common` adds to a mix that does not name it.
pub const DEFAULT_REFRESH: f64 = 0.2;

impl MoveMix {
    /// A mix of one move, also of one that does not reach every topology by itself.
    #[cfg(test)]
    pub fn only(only: Move) -> Self {
        Self {
            weights: vec![(only, 1.0)],
            probabilities: vec![1.0],
        }
    }

    /// The default mix of an estimator.
    pub fn default_of(estimator: Estimator) -> Self {
        let text = match estimator {
            Estimator::Fresh | Estimator::Common => DEFAULT_MOVES,
            Estimator::Explicit => DEFAULT_EXPLICIT_MOVES,
        };
        text.parse().expect("a mix of our own")
    }

    /// Whether a move of the mix asks the model for scores.
    pub fn scores(&self) -> bool {
        let mut moves = self.weights.iter();
        moves.any(|(candidate, weight)| candidate.scores() && *weight > 0.0)
    }

    /// The first move that cannot be made with this estimator, and the names of those that can.
    pub fn stranger(&self, estimator: Estimator) -> Option<(&'static str, String)> {
        let (stranger, _) = self.weights.iter().find(|(m, _)| !m.serves(estimator))?;
        let serving = Move::ALL.iter().filter(|(m, _)| m.serves(estimator));
        let names: Vec<_> = serving.map(|(_, name)| *name).collect();
        Some((stranger.name(), names.join(", ")))
    }

    /// The weight of `refresh`; `None` if the mix does not name it.
    pub fn refresh(&self) -> Option<f64> {
        let mut moves = self.weights.iter();
        moves
            .find(|(candidate, _)| *candidate == Move::Refresh)
            .map(|(_, weight)| *weight)
    }

    /// This mix for the estimator `common`, which needs `refresh`: with a weight of
    /// [`DEFAULT_REFRESH`] added before normalising, if it does not name it.
    #[must_use]
    pub fn with_refresh(mut self) -> Self {
        if self.refresh().is_none() {
            self.weights.push((Move::Refresh, DEFAULT_REFRESH));
            self.settle(1.0 + DEFAULT_REFRESH);
        }
        self
    }

    /// Orders and normalises weights of this total.
    fn settle(&mut self, total: f64) {
        self.weights
            .retain(|(candidate, weight)| *weight > 0.0 || *candidate == Move::Refresh);
        self.weights
            .sort_by_key(|(candidate, _)| *candidate as usize);
        // Weights that sum to 1 but for rounding stay as they are, so that what this writes reads back.
        if (total - 1.0).abs() > 1e-9 {
            for (_, weight) in &mut self.weights {
                *weight /= total;
            }
        }
        self.probabilities = self.weights.iter().map(|(_, weight)| *weight).collect();
    }

    /// Draws the move of a step. A mix of one move draws nothing.
    pub fn choose(&self, choices: &mut impl Choices) -> Move {
        match self.weights[..] {
            [(only, _)] => only,
            _ => self.weights[choices.index(&self.probabilities)].0,
        }
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
                    "moves out of {}, as in split-merge=0.5,reassign=0.5",
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
        let mut moves = weights.iter();
        if !moves.any(|(candidate, weight)| candidate.is_irreducible() && *weight > 0.0) {
            return Err(
                "split-merge, anchors, sequential-allocation, restricted-gibbs or site among the moves: \
                 the others alone do not reach every topology"
                    .to_owned(),
            );
        }
        let mut mix = Self {
            weights,
            probabilities: Vec::new(),
        };
        mix.settle(total);
        Ok(mix)
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
            "reassign=1",
            "split-merge=0",
            "split-merge=0,reassign=1",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
        assert!(parse("split-merge,split-merge").is_err());
    }

    #[test]
    fn common_gets_its_refresh() {
        let text = |text: &str| parse(text).map(|mix| mix.with_refresh().to_string());
        assert_eq!(
            text("split-merge=1,reassign=1"),
            Ok(format!(
                "split-merge={w},reassign={w},refresh={r}",
                w = 0.5 / 1.2,
                r = 0.2 / 1.2
            ))
        );
        assert_eq!(
            text("split-merge,refresh=1"),
            text("split-merge=0.5,refresh=0.5")
        );
        assert_eq!(
            parse("split-merge=1,refresh=0").map(|mix| mix.refresh()),
            Ok(Some(0.0))
        );
        assert_eq!(
            text("split-merge=1,refresh=0"),
            Ok("split-merge=1,refresh=0".into())
        );
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
