//! The table of all settings.

use super::reference::Reference;
use super::{SettingError, Value, engine, numbers, suggestion, typed};
use crate::excerpt::{OF_A_VALUE, excerpt};
use crate::model::{CornerKinds, OptimumMethod, PenaltyShape, Prior};
use crate::sampler::{Arithmetic, SplitRule};
use crate::world::SimulationSettings;

/// The table of a sweep file that a setting stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// `[data]`: where the detections come from.
    Data,
    /// `[model]`: the posterior.
    Model,
    /// `[sampler]`: the chain.
    Sampler,
    /// `[run]`: how much of it.
    Run,
}

impl Section {
    /// All sections, in the order of a sweep file.
    pub const ALL: [Self; 4] = [Self::Data, Self::Model, Self::Sampler, Self::Run];

    /// Its name in a sweep file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Model => "model",
            Self::Sampler => "sampler",
            Self::Run => "run",
        }
    }
}

/// What values a setting takes.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A number > 0 whose square and its reciprocal are finite.
    Positive,
    /// A number ≥ 0 whose square is finite.
    NonNegative,
    /// A number in (0, 1).
    OpenUnit,
    /// A number in [0, 1).
    Rate,
    /// A whole number of at least this.
    Count(u64),
    /// A whole number from this to that: what is had at once must fit into memory, and a slip of a
    /// digit must not end in an abort.
    CountUpTo(u64, u64),
    /// A text that this function brings into canonical spelling, or says what it expected.
    Text(fn(&str) -> Result<String, String>),
}

/// One setting.
pub struct Key {
    /// Its name in sweep files and tables; as a flag, with `-` for `_`.
    pub name: &'static str,
    /// Its section.
    pub section: Section,
    /// Its kind.
    pub kind: Kind,
    /// Its unit, or nothing.
    pub unit: &'static str,
    /// Its symbol in figures, or nothing for its name.
    pub symbol: &'static str,
    /// Its default.
    pub default: fn() -> Value,
    /// Whether a design may vary it.
    pub is_factor: bool,
    /// One line for `--help` and the documentation.
    pub help: &'static str,
}

impl Key {
    /// The key of this name.
    ///
    /// # Errors
    /// No setting has the name.
    pub fn named(name: &str) -> Result<&'static Self, SettingError> {
        index_of(name).map(|key_ix| &KEYS[key_ix])
    }

    /// How figures and tables call it: its symbol, if it has one, or its name.
    pub fn label(&self) -> &'static str {
        if self.symbol.is_empty() {
            self.name
        } else {
            self.symbol
        }
    }

    /// Its flag, without the dashes.
    pub fn flag(&self) -> String {
        self.name.replace('_', "-")
    }

    /// What values it takes, in words.
    pub fn expected(&self) -> String {
        let unit = if self.unit.is_empty() {
            String::new()
        } else {
            format!(" ({})", self.unit)
        };
        match self.kind {
            Kind::Positive => format!("a number > 0{unit}"),
            Kind::NonNegative => format!("a number >= 0{unit}"),
            Kind::OpenUnit => format!("a number between 0 and 1{unit}"),
            Kind::Rate => format!("a number from 0 to below 1{unit}"),
            Kind::Count(least) => format!("a whole number >= {least}{unit}"),
            Kind::CountUpTo(least, most) => {
                format!("a whole number from {least} to {most}{unit}")
            }
            Kind::Text(_) => "a text".to_owned(),
        }
    }

    /// The value that a text gives, as a flag or a number of a sweep file is written.
    ///
    /// # Errors
    /// A text that is not of this kind: the message repeats it as it was written.
    pub fn read(&self, text: &str) -> Result<Value, SettingError> {
        let as_text = || Value::Text(text.to_owned());
        let value = match self.kind {
            Kind::Text(_) => return self.check(&as_text()),
            Kind::Count(_) | Kind::CountUpTo(..) => {
                numbers::whole(text).map_or_else(as_text, Value::Count)
            }
            _ => numbers::finite(text).map_or_else(as_text, Value::Number),
        };
        self.check(&value).map_err(|error| {
            let expected = match error {
                SettingError::Bad { expected, .. } => expected,
                unknown => return unknown,
            };
            SettingError::Bad {
                name: self.name.to_owned(),
                got: numbers::repeated(text),
                expected: expected + &numbers::advice(text),
            }
        })
    }

    /// The value in canonical form, if it is of this kind.
    pub fn check(&self, value: &Value) -> Result<Value, SettingError> {
        let bad = |expected: String| {
            let got = match value {
                Value::Text(text) => format!("{:?}", excerpt(text, OF_A_VALUE)),
                other => other.to_string(),
            };
            SettingError::Bad {
                name: self.name.to_owned(),
                got,
                expected,
            }
        };
        let number = match value {
            Value::Number(number) => Some(*number),
            Value::Count(count) => Some(*count as f64),
            Value::Text(_) => None,
        };
        let in_range = |ok: fn(f64) -> bool| match number {
            Some(number) if number.is_finite() && ok(number) => Ok(Value::Number(number + 0.0)),
            Some(number) if number > EXTREME && number.is_finite() => {
                Err(bad(format!("{}, at most {EXTREME:e}", self.expected())))
            }
            Some(number) if number > 0.0 && number < 1.0 / EXTREME => Err(bad(format!(
                "{}, at least {:e}",
                self.expected(),
                1.0 / EXTREME
            ))),
            _ => Err(bad(self.expected())),
        };
        match self.kind {
            Kind::Positive => in_range(|x| x > 0.0 && (1.0 / EXTREME..=EXTREME).contains(&x)),
            Kind::NonNegative => in_range(|x| (0.0..=EXTREME).contains(&x)),
            Kind::OpenUnit => in_range(|x| x > 0.0 && x < 1.0),
            Kind::Rate => in_range(|x| (0.0..1.0).contains(&x)),
            Kind::Count(least) => match value {
                Value::Count(count) if *count >= least => Ok(value.clone()),
                _ => Err(bad(self.expected())),
            },
            Kind::CountUpTo(least, most) => match value {
                Value::Count(count) if (least..=most).contains(count) => Ok(value.clone()),
                _ => Err(bad(self.expected())),
            },
            Kind::Text(canonical) => canonical(&value.to_string()).map(Value::Text).map_err(bad),
        }
    }
}

/// All settings as Markdown, a table for each section of a sweep file: what `docs/sweep.md` shows.
pub fn keys_table() -> String {
    let mut text = String::new();
    for section in Section::ALL {
        text.push_str(&format!("### `[{}]`\n\n", section.name()));
        text.push_str("| key | values | default | factor | meaning |\n|---|---|---|---|---|\n");
        for key in KEYS.iter().filter(|key| key.section == section) {
            let default = match (key.default)() {
                Value::Text(text) if text.is_empty() => "none".to_owned(),
                value => format!("`{value}`"),
            };
            let factor = if key.is_factor { "yes" } else { "no" };
            let row = [
                &format!("`{}`", key.name),
                &key.expected(),
                &default,
                factor,
                key.help,
            ];
            text.push_str(&format!("| {} |\n", row.join(" | ").replace('>', "\\>")));
        }
        text.push('\n');
    }
    text
}

/// Where a name stands in [`KEYS`].
pub(super) fn index_of(name: &str) -> Result<usize, SettingError> {
    KEYS.iter()
        .position(|key| key.name == name)
        .ok_or_else(|| SettingError::Unknown {
            name: excerpt(name, OF_A_VALUE),
            suggestion: suggestion(name, KEYS.iter().map(|key| key.name)),
        })
}

fn parsed<T: std::str::FromStr<Err = String> + ToString>(text: &str) -> Result<String, String> {
    text.parse::<T>().map(|value| value.to_string())
}

fn any_text(text: &str) -> Result<String, String> {
    Ok(text.to_owned())
}

fn model(text: &str) -> Result<String, String> {
    match text {
        "metric" | "covariance" => Ok(text.to_owned()),
        _ => Err("metric or covariance".to_owned()),
    }
}

macro_rules! key {
    ($section:ident, $name:literal, $kind:expr, $unit:literal, $symbol:literal, $default:expr, $is_factor:literal, $help:literal) => {
        Key {
            name: $name,
            section: Section::$section,
            kind: $kind,
            unit: $unit,
            symbol: $symbol,
            default: || $default,
            is_factor: $is_factor,
            help: $help,
        }
    };
}

fn text(value: &str) -> Value {
    Value::Text(value.to_owned())
}

fn simulated(setting: fn(&SimulationSettings) -> f64) -> Value {
    Value::Number(setting(&SimulationSettings::default()))
}

/// Squares of numbers up to this, and their reciprocals, are finite.
const EXTREME: f64 = 1e75;

/// Bell(10) = 115,975 partitions: what the exact posterior takes without being asked for more.
const MAX_EXACT: u64 = 10;

const MILLION: u64 = 1_000_000;

/// Swaps cost next to nothing, but replicas should change between two.
const DEFAULT_SWAP_INTERVAL: u64 = 20;

/// All settings. The order is that of every listing, table and canonical text.
#[rustfmt::skip]
pub static KEYS: &[Key] = &[
    key!(Data, "world", Kind::Text(any_text), "", "", text("square-ring"), true,
        "World to simulate: square-ring, office, office:ROWSxCOLUMNS, the path of a world file, or crossing-ranges (six given detections)"),
    key!(Data, "detections", Kind::Text(any_text), "", "", text(""), false,
        "Detections CSV to use instead of a simulated world"),
    key!(Data, "replicates", Kind::CountUpTo(1, MILLION), "", "", Value::Count(1), false,
        "Number of independent worlds simulated per cell"),
    key!(Data, "rate_error", Kind::Rate, "", "", Value::Number(0.0), false,
        "Worlds are added to a cell until its recovery rate is known to ± this, half the width of its 95 % interval; 0 for exactly replicates"),
    key!(Data, "max_replicates", Kind::CountUpTo(0, MILLION), "", "", Value::Count(0), false,
        "The most worlds per cell where rate_error adds some; 0 without rate_error"),
    key!(Data, "noise", Kind::NonNegative, "", "noise", simulated(|s| s.noise), true,
        "Factor on all five kinds of noise; 0 is the perfect world"),
    key!(Data, "laps", Kind::Positive, "", "", simulated(|s| s.laps), true,
        "Times round the route; need not be whole"),
    key!(Data, "odometry_noise", Kind::NonNegative, "m/√m", "", simulated(|s| s.odometry_noise), true,
        "Random walk of the true position about the believed path, per axis"),
    key!(Data, "heading_noise", Kind::NonNegative, "rad/√m", "", simulated(|s| s.heading_noise), true,
        "Random walk of the true heading about the believed one"),
    key!(Data, "range_noise", Kind::NonNegative, "m", "", simulated(|s| s.range_noise), true,
        "Standard deviation of a range at distance 0"),
    key!(Data, "range_noise_growth", Kind::NonNegative, "m/m", "", simulated(|s| s.range_noise_growth), true,
        "Growth of that standard deviation with distance"),
    key!(Data, "bearing_noise", Kind::NonNegative, "rad", "", simulated(|s| s.bearing_noise), true,
        "Standard deviation of a bearing"),
    key!(Data, "max_range", Kind::Positive, "m", "", simulated(|s| s.max_range), true,
        "Corners further away are not seen"),
    key!(Data, "missed_rate", Kind::Rate, "", "", simulated(|s| s.missed_rate), true,
        "Probability that a visible corner is missed in a scan"),
    key!(Data, "false_rate", Kind::NonNegative, "", "", simulated(|s| s.false_rate), true,
        "Expected number of false sightings per scan"),
    key!(Data, "speed_m_per_s", Kind::Positive, "m/s", "", simulated(|s| s.speed_m_per_s), true,
        "Speed of the robot"),
    key!(Data, "sighting_interval_s", Kind::Positive, "s", "", simulated(|s| s.sighting_interval_s), true,
        "Time between two scans"),
    key!(Data, "gate_probability", Kind::OpenUnit, "", "", simulated(|s| s.gate_probability), true,
        "Share of a corner's sightings that the tracker's gate lets through"),
    key!(Data, "group_timeout_s", Kind::Positive, "s", "", simulated(|s| s.group_timeout_s), true,
        "The tracker closes a group that is not seen for longer"),
    key!(Data, "min_sightings", Kind::Count(1), "", "", Value::Count(SimulationSettings::default().min_sightings as u64), true,
        "The tracker drops groups with fewer sightings"),
    key!(Model, "model", Kind::Text(model), "", "", text("metric"), true,
        "Model of the detections: metric (eq. 3), or covariance (eq. 6: Mahalanobis distances, needs covariances)"),
    key!(Model, "sigma_o", Kind::Positive, "m", "σₒ", Value::Number(1.0), true,
        "Observation scale: how far a location may lie from its detection (eq. 3)"),
    key!(Model, "sigma_t", Kind::Positive, "m", "σₜ", Value::Number(1.0), true,
        "Topology scale: how far locations in one set may lie apart (eq. 3)"),
    key!(Model, "penalty_radius", Kind::Positive, "m", "radius D", Value::Number(10.0), true,
        "Distance from which distinct landmarks cost nothing (eq. 2)"),
    key!(Model, "penalty_height", Kind::NonNegative, "nats", "height H", Value::Number(100.0), true,
        "What two distinct landmarks at distance 0 cost (eq. 2)"),
    key!(Model, "penalty_shape", Kind::Text(parsed::<PenaltyShape>), "", "", text("quadratic"), true,
        "Form of the penalty: quadratic (the report's) or cubic (Ranganathan & Dellaert's)"),
    key!(Model, "prior", Kind::Text(parsed::<Prior>), "", "", text("uniform"), true,
        "Prior over topologies: uniform, poisson:RATE or dirichlet-process:CONCENTRATION"),
    key!(Model, "optimum", Kind::Text(parsed::<OptimumMethod>), "", "", text("closed-form"), true,
        "How X* and its covariance are found in the metric model (eq. 4): closed-form, or by an optimiser as a check: bfgs, newton"),
    key!(Model, "corner_kinds", Kind::Text(parsed::<CornerKinds>), "", "", text("off"), true,
        "Open and closed corners as evidence: off, confusion:P or confusion:P,Q with the rates at which open corners are seen as closed and closed as open"),
    key!(Sampler, "importance_samples", Kind::CountUpTo(1, MILLION), "", "R", Value::Count(30), true,
        "R, the number of importance samples of each posterior value (eq. 5), with estimator fresh or common"),
    key!(Sampler, "estimator", Kind::Text(engine::estimator), "", "", text("auto"), true,
        "Where locations come from: fresh importance samples for every proposal (the report), samples common to the whole chain, or explicit locations as part of the state; auto is common for up to 20 detections, explicit above"),
    key!(Sampler, "candidates", Kind::CountUpTo(1, 1000), "", "", Value::Count(2), true,
        "Candidates for the locations that a proposal changes, with explicit locations"),
    key!(Sampler, "arithmetic", Kind::Text(parsed::<Arithmetic>), "", "", text("log"), true,
        "log, or linear (INCORRECT: underflows as the report's program does)"),
    key!(Sampler, "moves", Kind::Text(engine::moves), "", "", text("auto"), true,
        "Moves with weights: auto (the default mix of the estimator), or out of split-merge (the report), reassign, pair-reassign, anchors, refresh, sequential-allocation, restricted-gibbs; with estimator explicit, out of split-merge, site, flip, slice, group, cut"),
    key!(Sampler, "split", Kind::Text(parsed::<SplitRule>), "", "", text("uniform"), true,
        "uniform, or prefix-cut (INCORRECT: splits as the report's program does)"),
    key!(Sampler, "temperatures", Kind::CountUpTo(1, 64), "", "", Value::Count(1), true,
        "Rungs of parallel tempering on the penalty, each one more chain; 1 for none (not with the estimator fresh or tiles)"),
    key!(Sampler, "swap_interval", Kind::CountUpTo(1, MILLION), "", "", Value::Count(DEFAULT_SWAP_INTERVAL), true,
        "Proposals from one round of swaps between rungs to the next"),
    key!(Sampler, "tiles", Kind::Text(parsed::<engine::Switch>), "", "", text("off"), true,
        "Whether the plane is cut into tiles whose sets move at the same time, so that one chain keeps several threads busy (explicit locations; a prior that does not look at M)"),
    key!(Sampler, "init", Kind::Text(parsed::<typed::Init>), "", "", text("apart"), true,
        "Initial topology: apart (singletons, one cluster, then random ones, chain by chain), singletons, one-cluster, random, truth or file:PATH"),
    key!(Run, "samples", Kind::CountUpTo(1, MILLION * MILLION), "", "", Value::Count(10_000), true,
        "Proposals per chain, rejections included; with until converged, those before the first look"),
    key!(Run, "until", Kind::Text(parsed::<typed::Until>), "", "", text("samples"), false,
        "When chains end: samples (after so many proposals), or converged (looked at after samples proposals, twice as many, and so on, until they are judged converged)"),
    key!(Run, "max_samples", Kind::CountUpTo(1, MILLION * MILLION), "", "", Value::Count(10 * MILLION), false,
        "Proposals per chain at most, with until converged"),
    key!(Run, "chains", Kind::CountUpTo(1, MILLION), "", "", Value::Count(4), false,
        "Independent chains per world"),
    key!(Run, "seed", Kind::Count(0), "", "", Value::Count(1), false,
        "Seed of everything random"),
    key!(Run, "burn_in", Kind::Text(parsed::<typed::BurnInRule>), "", "", text("auto"), true,
        "Proposals left out at the start: auto (MSER) or a number"),
    key!(Run, "probes", Kind::CountUpTo(0, 1000), "", "", Value::Count(4), false,
        "Short chains per chain, each a tenth as long and from a random topology, that must come to where the chain went; 0 for none"),
    key!(Run, "coupling_lag", Kind::CountUpTo(0, MILLION * MILLION), "", "", Value::Count(0), false,
        "Lag, in proposals, of two coupled chains that each chain sends out; when they meet bounds the distance to the posterior; 0 for none (needs explicit locations, no tiles, no temperatures)"),
    key!(Run, "max_topologies", Kind::Count(16), "", "", Value::Count(100_000), false,
        "Distinct topologies held per chain; above it the rarest are dropped and the result is marked truncated"),
    key!(Run, "exact_up_to", Kind::CountUpTo(0, MAX_EXACT), "", "", Value::Count(8), false,
        "Chains on data sets of at most so many detections are judged by the exact posterior; 0 for none"),
    key!(Run, "reference", Kind::Text(parsed::<Reference>), "", "", text("auto"), false,
        "Whether a sweep asks the reference sampler for the posterior of each cell and world, to sort failures: auto (where the sampler is not the default one) or none"),
];
