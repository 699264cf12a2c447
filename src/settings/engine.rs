//! The sampler that settings ask for, and what `auto` stands for.

use std::fmt;
use std::str::FromStr;

use super::{SettingError, Settings};
use crate::model::{OptimumMethod, Prior};
use crate::sampler::{Estimator, MoveMix, SamplerSettings, Tempering};

/// With more detections than this, `auto` stands for `explicit`, by trial on 27 pairs of data and
/// settings (`docs/model.md`). From 26 detections up, `explicit` had 2 to 60 times the effective
/// draws of M a second of `common`, but where both stick. At 4 to 20 it had between 0.4 and 5 times
/// as many.
const MOST_IN_COMMON: usize = 20;

/// `auto`, or a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OrAuto<T> {
    /// What suits the data.
    Auto,
    /// This one.
    Of(T),
}

impl<T: fmt::Display> fmt::Display for OrAuto<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Of(value) => value.fmt(f),
        }
    }
}

impl<T: FromStr> FromStr for OrAuto<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => text.parse().map(Self::Of),
        }
    }
}

/// Something that is done or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Switch(bool);

impl fmt::Display for Switch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0 { "on" } else { "off" })
    }
}

impl FromStr for Switch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "on" => Ok(Self(true)),
            "off" => Ok(Self(false)),
            _ => Err("on or off".to_owned()),
        }
    }
}

/// The canonical spelling of an estimator or `auto`.
pub(super) fn estimator(text: &str) -> Result<String, String> {
    let choice: Result<OrAuto<Estimator>, String> = text.parse();
    let choice = choice.map_err(|known| format!("auto, {known}"))?;
    Ok(choice.to_string())
}

/// The canonical spelling of a mix of moves or `auto`.
pub(super) fn moves(text: &str) -> Result<String, String> {
    let moves: OrAuto<MoveMix> = text.parse()?;
    Ok(moves.to_string())
}

impl Settings {
    fn choice(&self) -> OrAuto<Estimator> {
        self.parsed("estimator")
    }

    fn moves(&self) -> OrAuto<MoveMix> {
        self.parsed("moves")
    }

    /// The estimator on so many detections. `auto` stands for `explicit` above 20, and for `common`
    /// up to 20 or where a setting needs it: an optimiser, one of its moves. Tiles and coupled
    /// chains need `explicit`.
    pub fn estimator(&self, n_detections: usize) -> Estimator {
        let serves = |estimator| match self.moves() {
            OrAuto::Auto => true,
            OrAuto::Of(mix) => mix.stranger(estimator).is_none(),
        };
        let needs_common =
            !serves(Estimator::Explicit) || self.optimum() != OptimumMethod::ClosedForm;
        let needs_explicit = !serves(Estimator::Common) || self.tiles() || self.is_coupled();
        match self.choice() {
            OrAuto::Of(estimator) => estimator,
            OrAuto::Auto if needs_common => Estimator::Common,
            OrAuto::Auto if needs_explicit => Estimator::Explicit,
            OrAuto::Auto if n_detections <= MOST_IN_COMMON => Estimator::Common,
            OrAuto::Auto => Estimator::Explicit,
        }
    }

    /// How the chain moves on so many detections.
    pub fn sampler(&self, n_detections: usize) -> SamplerSettings {
        let estimator = self.estimator(n_detections);
        let moves = match self.moves() {
            OrAuto::Auto => MoveMix::default_of(estimator),
            OrAuto::Of(mix) => mix,
        };
        SamplerSettings {
            moves: match estimator {
                Estimator::Fresh | Estimator::Explicit => moves,
                Estimator::Common => moves.with_refresh(),
            },
            estimator,
            split: self.parsed("split"),
            arithmetic: self.parsed("arithmetic"),
            importance_samples: self.count("importance_samples") as usize,
            candidates: self.count("candidates") as usize,
            early_rejection: true,
            tempering: self.tempering(),
            tiles: self.tiles(),
        }
    }

    /// These settings with the estimator that `auto` stands for on so many detections named, and every
    /// move of its mix with the refresh that `common` adds. So what is recorded is what runs.
    #[must_use]
    pub fn naming_sampler(&self, n_detections: usize) -> Self {
        let SamplerSettings {
            estimator, moves, ..
        } = self.sampler(n_detections);
        let mut named = self.clone();
        named.name("estimator", &estimator);
        named.name("moves", &moves);
        named
    }

    /// Names the moves that `auto` stands for, where the estimator is known.
    pub(super) fn name_auto_moves(&mut self) {
        if let (OrAuto::Of(estimator), OrAuto::Auto) = (self.choice(), self.moves()) {
            self.name("moves", &MoveMix::default_of(estimator));
        }
    }

    /// Whether a setting says nothing to the chain: draws where locations are explicit, candidates
    /// where they are not.
    pub fn is_idle(&self, name: &str) -> bool {
        self.choice() != OrAuto::Auto && self.may_be_idle(name)
    }

    /// As [`is_idle`](Self::is_idle); also where `auto` may stand for an estimator without it.
    pub fn may_be_idle(&self, name: &str) -> bool {
        let (draws, candidates) = (name == "importance_samples", name == "candidates");
        match self.choice() {
            OrAuto::Auto => draws || candidates,
            OrAuto::Of(Estimator::Explicit) => draws,
            OrAuto::Of(_) => candidates,
        }
    }

    pub(super) fn name(&mut self, setting: &str, value: &impl fmt::Display) {
        if let Err(error) = self.set_text(setting, &value.to_string()) {
            panic!("what was read reads back: {error}");
        }
    }

    /// Parallel tempering, if there is more than one rung.
    pub(super) fn tempering(&self) -> Option<Tempering> {
        let n_temperatures = self.count("temperatures") as usize;
        (n_temperatures > 1).then(|| Tempering {
            n_temperatures,
            swap_interval: self.count("swap_interval"),
        })
    }

    /// Whether each chain sends out a pair of coupled chains.
    fn is_coupled(&self) -> bool {
        self.count("coupling_lag") > 0
    }

    /// Whether a chain goes by tiles.
    pub(super) fn tiles(&self) -> bool {
        self.parsed::<Switch>("tiles").0
    }

    pub(super) fn check_estimator(&self) -> Result<(), SettingError> {
        // What `auto` stands for on few detections and on many.
        [1, usize::MAX]
            .into_iter()
            .try_for_each(|n| self.check_sampler(self.estimator(n)))
    }

    fn check_sampler(&self, estimator: Estimator) -> Result<(), SettingError> {
        let bad = |name: &str, got: &str, expected: &str| {
            Err(SettingError::Bad {
                name: name.to_owned(),
                got: format!("{got} with estimator {estimator}"),
                expected: expected.to_owned(),
            })
        };
        if let OrAuto::Of(mix) = self.moves() {
            if let Some((stranger, serving)) = mix.stranger(estimator) {
                return bad(
                    "moves",
                    stranger,
                    &format!("auto, or moves out of {serving}"),
                );
            }
            if estimator == Estimator::Common && mix.refresh() == Some(0.0) {
                return bad(
                    "moves",
                    "refresh=0",
                    "a weight above 0, or no refresh at all to have 0.2: without it the draws would stay as they are",
                );
            }
        }
        if estimator == Estimator::Fresh && self.tempering().is_some() {
            return bad(
                "temperatures",
                &self.count("temperatures").to_string(),
                "1, or estimator common or explicit: only draws or locations that are kept have a \
                 weight at another temperature",
            );
        }
        let moves_at_once = self.tiles() || self.tempering().is_some();
        if self.is_coupled() && (estimator != Estimator::Explicit || moves_at_once) {
            let got = self.count("coupling_lag").to_string();
            let expected = "0, or estimator explicit with tiles off and temperatures 1: other \
                            chains do not come together on common random numbers";
            return bad("coupling_lag", &got, expected);
        }
        if self.tiles() {
            let got = "on";
            if estimator != Estimator::Explicit {
                let expected = "off, or estimator explicit, whose locations lie in tiles";
                return bad("tiles", got, expected);
            }
            if self.tempering().is_some() {
                let temperatures = self.count("temperatures");
                return Err(SettingError::Bad {
                    name: "tiles".to_owned(),
                    got: format!("{got} with temperatures {temperatures}"),
                    expected: "off, or temperatures 1: the rungs of a ladder do not go by tiles"
                        .to_owned(),
                });
            }
            if let prior @ Prior::Poisson { .. } = self.prior() {
                return Err(SettingError::Bad {
                    name: "tiles".to_owned(),
                    got: format!("{got} with prior {prior}"),
                    expected: "off, or prior uniform or dirichlet-process: one that looks at the \
                               number of sets ties all tiles together"
                        .to_owned(),
                });
            }
        }
        if estimator == Estimator::Fresh {
            return Ok(());
        }
        for (fault, correct) in [("split", "uniform"), ("arithmetic", "log")] {
            if self.text(fault) != correct {
                let expected =
                    format!("{correct}, or estimator fresh, which the report's program had");
                return bad(fault, self.text(fault), &expected);
            }
        }
        if estimator == Estimator::Explicit && self.optimum() != OptimumMethod::ClosedForm {
            let expected =
                "closed-form, or estimator common or fresh, which an optimiser can check";
            return bad("optimum", self.text("optimum"), expected);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::settings;

    #[test]
    fn auto_is_common_on_few_detections_and_explicit_on_many() {
        let auto = settings(&[]);
        for (n, estimator) in [
            (1, Estimator::Common),
            (20, Estimator::Common),
            (21, Estimator::Explicit),
            (10_000, Estimator::Explicit),
        ] {
            let sampler = auto.sampler(n);
            assert_eq!(sampler.estimator, estimator, "{n}");
            assert_eq!(sampler.moves, MoveMix::default_of(estimator), "{n}");
            let named = auto.naming_sampler(n);
            assert_eq!(named.text("estimator"), estimator.to_string());
            assert_eq!(named.text("moves"), sampler.moves.to_string());
            assert_eq!(named.check_together(), Ok(()));
        }
    }

    #[test]
    fn auto_stands_for_the_estimator_that_the_other_settings_need() {
        for change in [("optimum", "newton"), ("moves", "anchors=1")] {
            let asked = settings(&[change]);
            assert_eq!(asked.estimator(1000), Estimator::Common, "{change:?}");
            assert_eq!(asked.check_together(), Ok(()), "{change:?}");
        }
        for few in [
            ("moves", "site=1"),
            ("tiles", "on"),
            ("coupling_lag", "100"),
        ] {
            assert_eq!(
                settings(&[few]).estimator(3),
                Estimator::Explicit,
                "{few:?}"
            );
        }
        // Both have it.
        let both = settings(&[("moves", "split-merge=1")]);
        assert_eq!(
            [3, 1000].map(|n| both.estimator(n)),
            [Estimator::Common, Estimator::Explicit]
        );
        // No estimator has both.
        for none in [
            settings(&[("moves", "site=0.5,anchors=0.5")]),
            settings(&[("tiles", "on"), ("temperatures", "4")]),
            settings(&[("estimator", "fresh"), ("temperatures", "4")]),
            settings(&[("arithmetic", "linear")]),
            settings(&[("coupling_lag", "100"), ("estimator", "common")]),
            settings(&[("coupling_lag", "100"), ("temperatures", "4")]),
        ] {
            assert!(none.check_together().is_err());
        }
    }

    #[test]
    fn what_a_chain_has_no_use_for_does_not_name_it() {
        let name = |changes: &[(&str, &str)], n| {
            let named = settings(changes).naming_sampler(n);
            named.identity_text(|_| true)
        };
        let few_draws = ("importance_samples", "3");
        let more_candidates = ("candidates", "3");
        assert_eq!(name(&[], 30), name(&[few_draws], 30));
        assert_ne!(name(&[], 30), name(&[more_candidates], 30));
        assert_eq!(name(&[], 10), name(&[more_candidates], 10));
        assert_ne!(name(&[], 10), name(&[few_draws], 10));
    }
}
