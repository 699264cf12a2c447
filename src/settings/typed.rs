//! Settings as the types that the other rooms take.

use std::fmt;
use std::str::FromStr;

use super::{SettingError, Settings, Value, numbers};
use crate::model::optimum::MOST_SCALE_RATIO;
use crate::model::{CornerKinds, OptimumMethod, Penalty, Prior};
use crate::sampler::n_tuning;
use crate::world::SimulationSettings;

/// The initial topology.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Init {
    /// Chains apart: the first from singletons, the second from one cluster, all others from random
    /// partitions.
    Apart,
    /// Every detection by itself.
    Singletons,
    /// All detections together.
    OneCluster,
    /// A random partition, another one for each chain.
    Random,
    /// The true topology, for diagnosis.
    Truth,
    /// A file of labels.
    File(String),
}

impl fmt::Display for Init {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Apart => f.write_str("apart"),
            Self::Singletons => f.write_str("singletons"),
            Self::OneCluster => f.write_str("one-cluster"),
            Self::Random => f.write_str("random"),
            Self::Truth => f.write_str("truth"),
            Self::File(path) => write!(f, "file:{path}"),
        }
    }
}

impl FromStr for Init {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "apart" => Ok(Self::Apart),
            "singletons" => Ok(Self::Singletons),
            "one-cluster" => Ok(Self::OneCluster),
            "random" => Ok(Self::Random),
            "truth" => Ok(Self::Truth),
            _ => match text.strip_prefix("file:") {
                Some(path) if !path.is_empty() => Ok(Self::File(path.to_owned())),
                _ => Err("apart, singletons, one-cluster, random, truth or file:PATH".to_owned()),
            },
        }
    }
}

impl Init {
    /// The start of one of several chains, by its number from 0: never [`Self::Apart`].
    #[must_use]
    pub fn of_chain(&self, chain: u64) -> Self {
        match (self, chain) {
            (Self::Apart, 0) => Self::Singletons,
            (Self::Apart, 1) => Self::OneCluster,
            (Self::Apart, _) => Self::Random,
            (other, _) => other.clone(),
        }
    }
}

/// How many proposals are left out at the start of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BurnInRule {
    /// As many as MSER finds.
    Auto,
    /// This many.
    Fixed(u64),
}

impl fmt::Display for BurnInRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Fixed(n) => write!(f, "{n}"),
        }
    }
}

impl FromStr for BurnInRule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => numbers::whole(text).map(Self::Fixed).ok_or_else(|| {
                let advice = numbers::advice(text);
                format!("auto or a whole number of proposals{advice}")
            }),
        }
    }
}

/// How long chains run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// For so many proposals as `samples` says.
    Samples,
    /// Until the chains of one data set are judged converged, or have made `max_samples` proposals.
    Converged,
}

impl fmt::Display for Until {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Samples => "samples",
            Self::Converged => "converged",
        })
    }
}

impl FromStr for Until {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "samples" => Ok(Self::Samples),
            "converged" => Ok(Self::Converged),
            _ => Err("samples or converged".to_owned()),
        }
    }
}

impl Settings {
    /// A number; panics if the setting is none, as the table of keys says what it is.
    pub fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Value::Number(number) => *number,
            other => panic!("{name} is no number: {other}"),
        }
    }

    /// A count.
    pub fn count(&self, name: &str) -> u64 {
        match self.get(name) {
            Value::Count(count) => *count,
            other => panic!("{name} is no count: {other}"),
        }
    }

    /// A text.
    pub fn text(&self, name: &str) -> &str {
        match self.get(name) {
            Value::Text(text) => text,
            other => panic!("{name} is no text: {other}"),
        }
    }

    pub(super) fn parsed<T: FromStr<Err = String>>(&self, name: &str) -> T {
        match self.text(name).parse() {
            Ok(value) => value,
            Err(expected) => panic!("{name} was checked when it was set: expected {expected}"),
        }
    }

    /// The penalty of eq. 2.
    pub fn penalty(&self) -> Penalty {
        Penalty {
            shape: self.parsed("penalty_shape"),
            radius_m: self.number("penalty_radius"),
            height: self.number("penalty_height"),
        }
    }

    /// The prior over topologies.
    pub fn prior(&self) -> Prior {
        self.parsed("prior")
    }

    /// How the metric model finds X\* and Σ.
    pub fn optimum(&self) -> OptimumMethod {
        self.parsed("optimum")
    }

    /// Whether and how the kinds of corners are evidence.
    pub fn corner_kinds(&self) -> CornerKinds {
        self.parsed("corner_kinds")
    }

    /// The initial topology.
    pub fn init(&self) -> Init {
        self.parsed("init")
    }

    /// The burn-in rule.
    pub fn burn_in(&self) -> BurnInRule {
        self.parsed("burn_in")
    }

    /// How a simulated robot drives, sees and tracks.
    pub fn simulation(&self) -> SimulationSettings {
        SimulationSettings {
            laps: self.number("laps"),
            speed_m_per_s: self.number("speed_m_per_s"),
            sighting_interval_s: self.number("sighting_interval_s"),
            noise: self.number("noise"),
            odometry_noise: self.number("odometry_noise"),
            heading_noise: self.number("heading_noise"),
            range_noise: self.number("range_noise"),
            range_noise_growth: self.number("range_noise_growth"),
            bearing_noise: self.number("bearing_noise"),
            max_range: self.number("max_range"),
            missed_rate: self.number("missed_rate"),
            false_rate: self.number("false_rate"),
            gate_probability: self.number("gate_probability"),
            group_timeout_s: self.number("group_timeout_s"),
            min_sightings: self.count("min_sightings") as usize,
        }
    }

    /// How long chains run.
    pub fn until(&self) -> Until {
        self.parsed("until")
    }

    /// Proposals that a chain makes at most.
    pub fn most_samples(&self) -> u64 {
        self.count(match self.until() {
            Until::Samples => "samples",
            Until::Converged => "max_samples",
        })
    }

    /// Proposals at the start of every chain that never count: those in which a tempered chain tunes its ladder.
    pub fn least_burn_in(&self) -> u64 {
        match self.tempering() {
            Some(_) => n_tuning(self.count("samples")),
            None => 0,
        }
    }

    /// What is wrong with the settings together, though each is fine by itself.
    ///
    /// # Errors
    /// A burn-in that leaves no proposal or counts some in which a ladder of temperatures is tuned, or an optimiser that the model has no use for or that scales so far
    /// apart would rob of its digits; an estimator with a move that it does not have or without the refresh that it needs, with temperatures or a model
    /// that it cannot have, or with a fault of the report's program, which has `fresh`.
    pub fn check_together(&self) -> Result<(), SettingError> {
        self.check_optimum()?;
        self.check_estimator()?;
        self.check_until()?;
        match (self.burn_in(), self.count("samples")) {
            (BurnInRule::Fixed(n), samples) if n >= samples => Err(SettingError::Bad {
                name: "burn_in".to_owned(),
                got: n.to_string(),
                expected: format!("less than samples ({samples})"),
            }),
            (BurnInRule::Fixed(n), _) if n < self.least_burn_in() => Err(SettingError::Bad {
                name: "burn_in".to_owned(),
                got: n.to_string(),
                expected: format!(
                    "auto, or at least {}, a quarter of samples, in which the ladder of temperatures is tuned",
                    self.least_burn_in()
                ),
            }),
            _ => Ok(()),
        }
    }

    fn check_until(&self) -> Result<(), SettingError> {
        if self.until() == Until::Samples {
            return Ok(());
        }
        let (samples, most) = (self.count("samples"), self.count("max_samples"));
        let bad = |name: &str, got: u64, expected: String| {
            Err(SettingError::Bad {
                name: name.to_owned(),
                got: format!("{got} with until converged"),
                expected,
            })
        };
        if most < samples {
            let expected = format!("at least samples ({samples}), the first length looked at");
            return bad("max_samples", most, expected);
        }
        if self.count("chains") < 2 {
            let expected = "at least 2: one chain shows no convergence".to_owned();
            return bad("chains", self.count("chains"), expected);
        }
        Ok(())
    }

    fn check_optimum(&self) -> Result<(), SettingError> {
        let method = self.optimum();
        let bad = |got: String, expected: String| {
            let name = "optimum".to_owned();
            Err(SettingError::Bad {
                name,
                got,
                expected,
            })
        };
        if method == OptimumMethod::ClosedForm {
            return Ok(());
        }
        if self.text("model") != "metric" {
            return bad(
                format!("{method} with model {}", self.text("model")),
                "closed-form, or model metric: no other model has a choice of optimiser".to_owned(),
            );
        }
        let ratio = self.number("sigma_o") / self.number("sigma_t");
        if !(1.0 / MOST_SCALE_RATIO..=MOST_SCALE_RATIO).contains(&ratio) {
            return bad(
                format!("{method} with sigma_o/sigma_t {ratio:e}"),
                format!(
                    "closed-form, or a ratio between 1/{MOST_SCALE_RATIO} and {MOST_SCALE_RATIO}"
                ),
            );
        }
        Ok(())
    }

    /// The labelled faults that are switched on, in words; empty for a correct sampler.
    pub fn faults(&self) -> Vec<&'static str> {
        let mut faults = Vec::new();
        if self.text("split") == "prefix-cut" {
            faults.push("prefix-cut splits with first-kind Stirling numbers");
        }
        if self.text("arithmetic") == "linear" {
            faults.push("linear arithmetic, which underflows");
        }
        faults
    }
}
