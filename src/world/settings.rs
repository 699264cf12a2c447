//! How the robot drives, sees and tracks in a simulated world.
//!
//! The names are the keys of the sweep file. `noise` multiplies `odometry_noise`, `heading_noise`,
//! `range_noise`, `range_noise_growth` and `bearing_noise`; at 0 the world is perfect. The defaults
//! make two visits of one corner of `square-ring` differ by 1–4.5 m (median 2.4) at variances of
//! 0.08–0.4 m², much like the source report's noisy run (1.8–4.5 m).

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::tracker::TrackerSettings;

/// What a simulation depends on besides the world and the generator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationSettings {
    /// Times around the route; need not be whole.
    pub laps: f64,
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Time between two scans, s.
    pub sighting_interval_s: f64,
    /// One factor for all five kinds of noise.
    pub noise: f64,
    /// Random walk of the true position about the believed path: std per axis, m per √m driven.
    pub odometry_noise: f64,
    /// Random walk of the true heading about the believed one: std, rad per √m driven.
    pub heading_noise: f64,
    /// Std of a range at distance 0, m.
    pub range_noise: f64,
    /// Growth of that std with distance, m per m.
    pub range_noise_growth: f64,
    /// Std of a bearing, rad.
    pub bearing_noise: f64,
    /// Corners further away are not seen, m.
    pub max_range: f64,
    /// Probability that a visible corner is missed in a scan.
    pub missed_rate: f64,
    /// Expected number of false sightings per scan.
    pub false_rate: f64,
    /// p of the tracker's gate.
    pub gate_probability: f64,
    /// The tracker closes a group not seen for longer, s.
    pub group_timeout_s: f64,
    /// The tracker drops groups with fewer sightings.
    pub min_sightings: usize,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self {
            laps: 1.25,
            speed_m_per_s: 1.0,
            sighting_interval_s: 0.5,
            noise: 1.0,
            odometry_noise: 0.2,
            heading_noise: 0.002,
            range_noise: 0.5,
            range_noise_growth: 0.06,
            bearing_noise: 0.015,
            max_range: 100.0,
            missed_rate: 0.05,
            false_rate: 0.02,
            gate_probability: 0.999,
            group_timeout_s: 15.0,
            min_sightings: 3,
        }
    }
}

/// A setting outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key}: got {got}, expected {expected}; change {key}")]
pub struct SettingsError {
    /// The key at fault.
    pub key: &'static str,
    /// Its value.
    pub got: String,
    /// What it may be.
    pub expected: String,
}

impl SimulationSettings {
    /// Checks every key by itself and the time-out against the time between scans.
    pub fn check(&self) -> Result<(), SettingsError> {
        let fault = |key, got: f64, expected: &str| {
            Err(SettingsError {
                key,
                got: got.to_string(),
                expected: expected.into(),
            })
        };
        for (key, value) in [
            ("laps", self.laps),
            ("speed_m_per_s", self.speed_m_per_s),
            ("sighting_interval_s", self.sighting_interval_s),
            ("max_range", self.max_range),
            ("group_timeout_s", self.group_timeout_s),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fault(key, value, "a finite number above 0");
            }
        }
        for (key, value) in [
            ("noise", self.noise),
            ("odometry_noise", self.odometry_noise),
            ("heading_noise", self.heading_noise),
            ("range_noise", self.range_noise),
            ("range_noise_growth", self.range_noise_growth),
            ("bearing_noise", self.bearing_noise),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return fault(key, value, "a finite number, 0 or above");
            }
        }
        if !(0.0..1.0).contains(&self.missed_rate) {
            let expected = "a probability, 0 or above and below 1";
            return fault("missed_rate", self.missed_rate, expected);
        }
        if !(0.0..=MAX_FALSE_RATE).contains(&self.false_rate) {
            let expected = "an expected number per scan from 0 to 1000";
            return fault("false_rate", self.false_rate, expected);
        }
        if !(self.gate_probability > 0.0 && self.gate_probability < 1.0) {
            let expected = "a probability above 0 and below 1";
            return fault("gate_probability", self.gate_probability, expected);
        }
        if self.min_sightings == 0 {
            return fault("min_sightings", 0.0, "1 or more");
        }
        if self.group_timeout_s < self.sighting_interval_s {
            let interval_s = self.sighting_interval_s;
            let expected = format!(
                "at least sighting_interval_s ({interval_s} s), or no group would see two scans"
            );
            return fault("group_timeout_s", self.group_timeout_s, &expected);
        }
        Ok(())
    }

    /// Odometry noise with the factor applied, m per √m.
    pub fn scaled_odometry_noise(&self) -> f64 {
        self.noise * self.odometry_noise
    }

    /// Heading noise with the factor applied, rad per √m.
    pub fn scaled_heading_noise(&self) -> f64 {
        self.noise * self.heading_noise
    }

    /// Std of a range at a distance with the factor applied, m.
    pub fn scaled_range_std_m(&self, range_m: f64) -> f64 {
        self.noise * (self.range_noise + self.range_noise_growth * range_m)
    }

    /// Std of a bearing with the factor applied, rad.
    pub fn scaled_bearing_std_rad(&self) -> f64 {
        self.noise * self.bearing_noise
    }

    /// What the tracker needs to know of these.
    pub fn tracker(&self) -> TrackerSettings {
        TrackerSettings {
            gate_probability: self.gate_probability,
            group_timeout_s: self.group_timeout_s,
            min_sightings: self.min_sightings,
            odometry_noise: self.scaled_odometry_noise(),
            heading_noise: self.scaled_heading_noise(),
            since_start: true,
        }
    }

    /// All keys and values as one text, for identity: equal settings, equal text.
    pub fn canonical_text(&self) -> String {
        // Taken apart by name, so that a new key cannot be forgotten here.
        let Self {
            laps,
            speed_m_per_s,
            sighting_interval_s,
            noise,
            odometry_noise,
            heading_noise,
            range_noise,
            range_noise_growth,
            bearing_noise,
            max_range,
            missed_rate,
            false_rate,
            gate_probability,
            group_timeout_s,
            min_sightings,
        } = self;
        let mut text = String::new();
        for (key, value) in [
            ("laps", laps),
            ("speed_m_per_s", speed_m_per_s),
            ("sighting_interval_s", sighting_interval_s),
            ("noise", noise),
            ("odometry_noise", odometry_noise),
            ("heading_noise", heading_noise),
            ("range_noise", range_noise),
            ("range_noise_growth", range_noise_growth),
            ("bearing_noise", bearing_noise),
            ("max_range", max_range),
            ("missed_rate", missed_rate),
            ("false_rate", false_rate),
            ("gate_probability", gate_probability),
            ("group_timeout_s", group_timeout_s),
        ] {
            // Adding 0 turns −0 into 0.
            writeln!(text, "{key} {}", value + 0.0).expect("a String takes any text");
        }
        writeln!(text, "min_sightings {min_sightings}").expect("a String takes any text");
        text
    }
}

/// More would only be a slip of the pen, and would fill the memory.
const MAX_FALSE_RATE: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_good_and_the_text_sees_every_key() {
        let default = SimulationSettings::default();
        assert_eq!(default.check(), Ok(()));
        let serde_json::Value::Object(keys) =
            serde_json::to_value(&default).expect("plain numbers")
        else {
            panic!("a struct is an object")
        };
        assert_eq!(keys.len(), default.canonical_text().lines().count());
        for (key, value) in keys {
            let changed = if value.is_u64() {
                7.into()
            } else {
                serde_json::Value::from(0.125)
            };
            let other: SimulationSettings =
                serde_json::from_value(serde_json::json!({ key: changed })).expect("a known key");
            assert_ne!(other.canonical_text(), default.canonical_text());
        }
    }

    #[test]
    fn a_bad_value_is_named_in_one_line() {
        let message = |text: &str| {
            let settings: SimulationSettings = toml::from_str(text).expect("known keys");
            settings.check().expect_err("out of range").to_string()
        };
        assert_eq!(
            message("laps = 0.0"),
            "laps: got 0, expected a finite number above 0; change laps"
        );
        assert_eq!(
            message("missed_rate = 1.0"),
            "missed_rate: got 1, expected a probability, 0 or above and below 1; change missed_rate"
        );
        assert_eq!(
            message("noise = nan"),
            "noise: got NaN, expected a finite number, 0 or above; change noise"
        );
        assert_eq!(
            message("min_sightings = 0"),
            "min_sightings: got 0, expected 1 or more; change min_sightings"
        );
        assert_eq!(
            message("group_timeout_s = 0.1"),
            "group_timeout_s: got 0.1, expected at least sighting_interval_s (0.5 s), or no group \
             would see two scans; change group_timeout_s"
        );
    }
}
