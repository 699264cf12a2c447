//! What `ptm import` and `ptm solve` read: a recording of any format, a part of it, and its noise.

use std::path::{Path, PathBuf};

use crate::import::{
    Choices, DriftNoise, Format, Noise, Opened, PRESET_KEYS, Recording, SensorNoise,
};
use crate::settings::Settings;
use clap::{Args, ValueEnum};

use super::numbers::{count, number};
use super::progress::reading;
use super::settings::SettingsFlags;
use super::{Arguments, Failure};

/// A recording; `USE` is that of [`SettingsFlags`].
#[derive(Debug, Args)]
pub struct RecordingFlags<const USE: u8> {
    /// A folder of UTIAS MRCLAM; a graph with landmarks in the plane (g2o, iSAM, TORO); or a
    /// range-bearing CSV with t,robot_x,robot_y,robot_theta,range,bearing in s, m and rad, and
    /// optionally true_landmark_id (numbers or names; -1 or nothing = unknown). Without range and
    /// bearing a row is a pose only. gzip too.
    pub path: PathBuf,
    /// The format [default: told from the path].
    #[arg(long, value_name = "FORMAT")]
    format: Option<FormatName>,
    /// Which robot of an MRCLAM folder [default: the only one].
    #[arg(long, value_name = "N", value_parser = count::<u32>(0, u64::from(u32::MAX)))]
    robot: Option<u32>,
    /// Leave out what was before this time, s; dead reckoning starts here. MRCLAM counts from the
    /// robot's first odometry, g2o counts poses from 0.
    #[arg(long, value_name = "S", value_parser = number, allow_negative_numbers = true)]
    from: Option<f64>,
    /// Leave out what was from this time on, s.
    #[arg(long, value_name = "S", value_parser = number, allow_negative_numbers = true)]
    until: Option<f64>,
    /// Take every N-th scan only; the odometry stays whole.
    #[arg(long, value_name = "N", value_parser = count::<usize>(1, u64::MAX), default_value_t = 1)]
    every: usize,
    /// Random walk of the heading by turning, rad/√rad [default: mrclam 0.1, range-bearing 0].
    #[arg(long, value_name = "NOISE", value_parser = number, allow_negative_numbers = true)]
    turn_noise: Option<f64>,
    /// Standard deviation of a bend of the whole path that the odometry does not know of, rad/m
    /// [default: mrclam 0.05, range-bearing 0].
    #[arg(long, value_name = "NOISE", value_parser = number, allow_negative_numbers = true)]
    bend_noise: Option<f64>,
    /// Leave out sightings further away than --max-range, and state the sensor's noise: the flags
    /// of simulated worlds that describe the sensor and the tracker.
    #[command(flatten)]
    settings: SettingsFlags<USE>,
}

/// Formats as the command line names them.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatName {
    /// A folder of UTIAS MRCLAM.
    Mrclam,
    /// A graph with landmarks in the plane: g2o, iSAM, TORO.
    #[value(aliases = ["isam", "toro"])]
    G2o,
    /// The plain range-bearing CSV.
    RangeBearing,
}

impl<const USE: u8> RecordingFlags<USE> {
    /// Opens the recording.
    pub fn open(&self, arguments: &Arguments) -> Result<Opened<'static>, Failure> {
        let format = self.format.map(|name| match name {
            FormatName::Mrclam => Format::Mrclam,
            FormatName::G2o => Format::G2o,
            FormatName::RangeBearing => Format::RangeBearing,
        });
        let watch = reading(&self.path, arguments.quiet);
        Ok(Opened::new(&self.path, format, watch)?)
    }

    /// Reads it, the stated span of time.
    pub fn read(&self, opened: Opened<'_>, truth: Option<&Path>) -> Result<Recording, Failure> {
        Ok(opened.read(Choices {
            robot: self.robot,
            truth,
        })?)
    }

    /// Leaves out what the flags say.
    pub fn thin(&self, recording: &mut Recording, settings: &Settings) {
        recording.keep_window(
            self.from.unwrap_or(f64::NEG_INFINITY),
            self.until.unwrap_or(f64::INFINITY),
        );
        recording.thin(self.every, settings.simulation().max_range);
    }

    /// Refuses what does not go together, before anything is read.
    pub fn check(&self, format: Format) -> Result<(), Failure> {
        let name = format.name();
        if let Some(robot) = self.robot.filter(|_| format != Format::Mrclam) {
            let expected = format!("no such flag for {name}; only MRCLAM folders have robots");
            return refuse("robot", &robot, &expected);
        }
        if let (Some(from), Some(until)) = (self.from, self.until)
            && from >= until
        {
            let expected = format!("a time after --from ({from})");
            return refuse("until", &until, &expected);
        }
        let noises = [
            ("turn-noise", self.turn_noise),
            ("bend-noise", self.bend_noise),
        ];
        for (flag, value) in noises {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= 0.0)) {
                return refuse(flag, &value, "a finite number, 0 or above");
            }
        }
        if format == Format::G2o {
            let stated = PRESET_KEYS
                .iter()
                .filter(|key| format.preset(key).is_none());
            let given = stated.filter(|key| self.settings.is_given(key));
            let given = given.map(|key| key.replace('_', "-"));
            let noises = noises.iter().filter(|(_, value)| value.is_some());
            let given = given.chain(noises.map(|(flag, _)| (*flag).to_owned()));
            if let Some(flag) = given.into_iter().next() {
                let expected = "no such flag for g2o, which states its noise; --noise scales it";
                return refuse(&flag, &"a value", expected);
            }
        }
        Ok(())
    }

    pub fn settings(&self, format: Format) -> Result<Settings, Failure> {
        let presets = PRESET_KEYS.iter();
        let presets: Vec<_> = presets
            .filter_map(|key| Some((*key, format.preset(key)?)))
            .collect();
        let settings = self.settings.settings_above(&presets)?;
        let checked = settings.simulation().check();
        checked.map_err(|error| Failure::usage(error.to_string()))?;
        Ok(settings)
    }

    pub fn noise(&self, format: Format, settings: &Settings) -> Noise {
        let simulation = settings.simulation();
        let [turn, bend] = format.turn_and_bend();
        Noise {
            sensor: SensorNoise {
                range_m: simulation.range_noise,
                range_growth: simulation.range_noise_growth,
                bearing_rad: simulation.bearing_noise,
            },
            drift: DriftNoise {
                position: simulation.odometry_noise,
                heading: simulation.heading_noise,
                turn: self.turn_noise.unwrap_or(turn),
                bend: self.bend_noise.unwrap_or(bend),
            },
            factor: simulation.noise,
        }
    }
}

/// A flag that does not go with the rest.
pub fn refuse(flag: &str, got: &dyn std::fmt::Display, expected: &str) -> Result<(), Failure> {
    Err(Failure::usage(format!(
        "--{flag}: got {got}, expected {expected}"
    )))
}
