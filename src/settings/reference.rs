//! The settings that ask the reference sampler for a posterior.
//!
//! A failure of a cell is the sampler's only if the posterior itself has the truth as its MAP
//! topology. The reference sampler answers that: the engine that mixes best, in chains long enough
//! for the shipped sweeps, with the model and the data of the cell. Cells that differ only in
//! settings of the sampler have one posterior, and share its chains.

use std::fmt;
use std::str::FromStr;

use super::{KEYS, Section, Settings, Until, Value};
use crate::sampler::Estimator;

/// Whether the reference sampler is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// Where the cell's own sampler is not the default one.
    Auto,
    /// Never.
    None,
}

impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::None => "none",
        })
    }
}

impl FromStr for Reference {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::None),
            _ => Err("auto or none".to_owned()),
        }
    }
}

/// Proposals of each reference chain before the first look whether they have converged, and at
/// most, by trial on the 405 posteriors of the sweep `noisy`.
const SAMPLES: [u64; 2] = [2_500, 40_000];
/// Their mix of moves, by the same trial. The default mix decides one posterior fewer of the
/// report's Figure 7.
const MOVES: &str = "split-merge=0.02,site=0.1,flip=0.48,slice=0.3,group=0.1";
/// Settings of the sampler that make it another one. The start and the number of importance samples
/// tune a sampler; they do not.
const SAMPLER_KEYS: [&str; 5] = ["estimator", "moves", "split", "arithmetic", "temperatures"];
/// What a run keeps beside model and data: its random numbers, and what it compares chains with.
const KEPT_OF_RUN: [&str; 2] = ["seed", "exact_up_to"];

impl Settings {
    /// The settings that ask the reference sampler for the posterior of these; `None` if it is not
    /// asked.
    pub fn reference(&self) -> Option<Self> {
        let is_asked = self.parsed::<Reference>("reference") == Reference::Auto;
        let name = |own: &Self| own.identity_text(|key| SAMPLER_KEYS.contains(&key.name));
        let is_default = |estimator: &&str| {
            let mut default = Self::default();
            default.name("estimator", estimator);
            name(self) == name(&default)
        };
        let is_other = !["auto", "common", "explicit"].iter().any(is_default);
        (is_asked && is_other).then(|| self.with_reference_sampler())
    }

    /// Model and data of these settings with the reference sampler.
    fn with_reference_sampler(&self) -> Self {
        let mut settings = self.clone();
        let given = [
            ("estimator", Value::Text(Estimator::Explicit.to_string())),
            ("moves", Value::Text(MOVES.to_owned())),
            ("samples", Value::Count(SAMPLES[0])),
            ("max_samples", Value::Count(SAMPLES[1])),
            ("until", Value::Text(Until::Converged.to_string())),
        ];
        for (value, key) in settings.values.iter_mut().zip(KEYS) {
            let is_of_chain = matches!(key.section, Section::Sampler | Section::Run)
                && !KEPT_OF_RUN.contains(&key.name);
            // Optimisers check the closed form and change no posterior.
            if is_of_chain || key.name == "optimum" {
                let given = given.iter().find(|(name, _)| *name == key.name);
                *value = given.map_or_else(key.default, |(_, value)| value.clone());
            }
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::settings;

    #[test]
    fn the_default_sampler_and_the_reference_sampler_need_no_reference() {
        assert_eq!(settings(&[]).reference(), None);
        assert_eq!(settings(&[("estimator", "explicit")]).reference(), None);
        // The start and the number of draws tune a sampler.
        let tuned = [("importance_samples", "5"), ("init", "one-cluster")];
        assert_eq!(settings(&tuned).reference(), None);
        let common = ("estimator", "common");
        assert_eq!(settings(&[common]).reference(), None);
        let spelt = ("moves", crate::sampler::mix::DEFAULT_MOVES);
        assert_eq!(settings(&[common, spelt]).reference(), None);
        let fresh = ("estimator", "fresh");
        assert!(settings(&[fresh]).reference().is_some());
        assert!(
            settings(&[("moves", "split-merge=1")])
                .reference()
                .is_some()
        );
        assert_eq!(settings(&[fresh, ("reference", "none")]).reference(), None);
    }

    #[test]
    fn it_keeps_model_data_and_seed_and_nothing_of_the_chain() {
        let of_posterior = [
            ("penalty_radius", "3"),
            ("noise", "0.5"),
            ("seed", "7"),
            ("corner_kinds", "confusion:0.1"),
        ];
        let of_chain = [
            ("estimator", "fresh"),
            ("arithmetic", "linear"),
            ("split", "prefix-cut"),
            ("init", "one-cluster"),
            ("importance_samples", "30"),
            ("samples", "300"),
            ("burn_in", "10"),
            ("chains", "20"),
            ("optimum", "bfgs"),
        ];
        let asked = settings(&[of_posterior.as_slice(), &of_chain].concat());
        let reference = asked.reference().expect("a reference");
        for (name, text) in of_posterior {
            assert_eq!(reference.get(name).to_string(), text, "{name}");
        }
        let other = settings(&[of_posterior.as_slice(), &[("moves", "split-merge=1")]].concat());
        assert_eq!(other.reference(), Some(reference.clone()));
        assert_eq!(reference.check_together(), Ok(()));
        assert_eq!(reference.text("estimator"), "explicit");
        assert_eq!(reference.until(), Until::Converged);
    }
}
