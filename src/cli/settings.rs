//! Flags for settings, made from the table of settings.

use std::ffi::OsString;
use std::path::Path;

use crate::files::text_of;
use crate::import::{FORMATS, Format, PRESET_KEYS};
use crate::settings::{KEYS, Key, Section, Settings};
use crate::sweep::decides_the_world;
use clap::{Arg, ArgMatches, Args, FromArgMatches};

use super::Failure;

/// Flags of `ptm sample`: model, sampler and run.
pub const SAMPLING: u8 = 0;
/// Flags of `ptm simulate`: the world, the robot, its sensor and tracker.
pub const SIMULATING: u8 = 1;
/// Flags of `ptm import`: sensor and tracker.
pub const TRACKING: u8 = 2;
/// Flags of `ptm exact`: the model and the seed.
pub const MODEL: u8 = 3;
/// Flags of `ptm solve`: the sensor and the seed.
pub const SOLVING: u8 = 4;

/// Of the world's settings, those that `TRACKING` and `SOLVING` take.
const SENSOR: [&str; 7] = [
    "noise",
    "odometry_noise",
    "heading_noise",
    "range_noise",
    "range_noise_growth",
    "bearing_noise",
    "max_range",
];

/// Those that `TRACKING` takes besides.
const TRACKER: [&str; 3] = ["gate_probability", "group_timeout_s", "min_sightings"];

/// Flags for one use: [`SAMPLING`], [`SIMULATING`], [`TRACKING`], [`MODEL`] or [`SOLVING`].
#[derive(Debug, Clone)]
pub struct SettingsFlags<const USE: u8> {
    given: Vec<(&'static str, String)>,
}

impl<const USE: u8> SettingsFlags<USE> {
    /// The defaults with what was given.
    pub fn settings(&self) -> Result<Settings, Failure> {
        self.settings_above(&[])
    }

    /// Whether the user gave this one.
    pub fn is_given(&self, name: &str) -> bool {
        self.given.iter().any(|(given, _)| *given == name)
    }

    /// The defaults, with others in the place of some, with what was given.
    pub fn settings_above(&self, others: &[(&str, f64)]) -> Result<Settings, Failure> {
        let mut settings = Settings::default();
        for (name, value) in others {
            settings.set_text(name, &value.to_string())?;
        }
        for (name, text) in &self.given {
            settings.set_text(name, text).map_err(|error| {
                let text = error.to_string();
                let flag = name.replace('_', "-");
                Failure::usage(format!(
                    "--{flag}: {}",
                    text.trim_start_matches(&format!("{name}: "))
                ))
            })?;
        }
        settings.check_together()?;
        Ok(settings)
    }

    fn keys() -> impl Iterator<Item = &'static Key> {
        KEYS.iter().filter(|key| match (USE, key.section) {
            (TRACKING, _) => SENSOR.contains(&key.name) || TRACKER.contains(&key.name),
            (SOLVING, _) => SENSOR.contains(&key.name) || key.name == "seed",
            (SIMULATING, Section::Data) => key.name == "world" || decides_the_world(key),
            (MODEL, Section::Model) => true,
            (SIMULATING | MODEL, _) => key.name == "seed",
            (_, section) => section != Section::Data && key.name != "reference",
        })
    }
}

impl<const USE: u8> Args for SettingsFlags<USE> {
    fn augment_args(mut command: clap::Command) -> clap::Command {
        for key in Self::keys() {
            let unit = if key.unit.is_empty() {
                String::new()
            } else {
                format!(", {}", key.unit)
            };
            let default = match USE {
                TRACKING | SOLVING => defaults_by_format(key),
                _ => (key.default)().to_string(),
            };
            let help = format!("{}{unit} [default: {default}]", key.help);
            let heading = match key.section {
                Section::Data => "World",
                Section::Model => "Model",
                Section::Sampler => "Sampler",
                Section::Run => "Run",
            };
            command = command.arg(
                Arg::new(key.name)
                    .long(key.flag())
                    .value_name(key.name.to_uppercase())
                    // Some settings are paths, which need not be UTF-8.
                    .value_parser(clap::value_parser!(OsString))
                    .help(help)
                    .help_heading(heading)
                    .hide_default_value(true)
                    .allow_negative_numbers(true),
            );
        }
        command
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl<const USE: u8> FromArgMatches for SettingsFlags<USE> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = Self::keys()
            .filter_map(|key| Some((key.name, matches.get_one::<OsString>(key.name)?)))
            .map(|(name, value)| (name, text_of(Path::new(value))))
            .collect();
        Ok(Self { given })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The default of a key in each format, if they differ.
fn defaults_by_format(key: &Key) -> String {
    if !PRESET_KEYS.contains(&key.name) {
        return (key.default)().to_string();
    }
    let of = |format: Format| {
        let preset = format.preset(key.name);
        let value = preset.map_or_else(|| "from the file".to_owned(), |value| value.to_string());
        format!("{} {value}", format.name())
    };
    FORMATS.map(of).join(", ")
}
