//! Flags for settings, made from the table of settings.

use clap::{Arg, ArgMatches, Args, FromArgMatches};
use topometric::settings::{KEYS, Key, Section, Settings};

use super::Failure;

/// Flags of simulated worlds.
pub const WORLD: u8 = 0;
/// Flags of `ptm sample`: model, sampler and run.
pub const SAMPLING: u8 = 1;
/// Flags of `ptm exact`: the model and the seed.
pub const MODEL: u8 = 2;

/// Flags of some sections.
#[derive(Debug, Clone)]
pub struct SettingsFlags<const OF: u8> {
    given: Vec<(&'static str, String)>,
}

impl<const OF: u8> SettingsFlags<OF> {
    /// The defaults with what was given.
    pub fn settings(&self) -> Result<Settings, Failure> {
        let mut settings = Settings::default();
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
        Ok(settings)
    }

    fn keys() -> impl Iterator<Item = &'static Key> {
        KEYS.iter().filter(|key| match key.section {
            Section::Data => OF == WORLD && !matches!(key.name, "detections" | "replicates"),
            Section::Model => OF != WORLD,
            Section::Sampler => OF == SAMPLING,
            Section::Run => OF == SAMPLING || key.name == "seed",
        })
    }
}

impl<const OF: u8> Args for SettingsFlags<OF> {
    fn augment_args(mut command: clap::Command) -> clap::Command {
        for key in Self::keys() {
            let unit = if key.unit.is_empty() {
                String::new()
            } else {
                format!(", {}", key.unit)
            };
            let help = format!("{}{unit} [default: {}]", key.help, (key.default)());
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

impl<const OF: u8> FromArgMatches for SettingsFlags<OF> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = Self::keys()
            .filter_map(|key| Some((key.name, matches.get_one::<String>(key.name)?.clone())))
            .collect();
        Ok(Self { given })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
