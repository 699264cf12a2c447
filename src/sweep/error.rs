//! What can be wrong with a sweep file: one line each.

use crate::settings::SettingError;

/// A sweep file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The file cannot be read.
    #[error(
        "{path}: cannot be read ({source}); give the path of a sweep file, as in sweeps/noisy.toml"
    )]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no TOML, or not of the shape of a sweep file.
    #[error("{path}{place}: {what}")]
    Syntax {
        /// The file.
        path: String,
        /// ":line:column", or nothing.
        place: String,
        /// What is wrong.
        what: String,
    },
    /// A setting is unknown, in the wrong section, or has a bad value.
    #[error("{path}: [{section}] {what}")]
    Setting {
        /// The file.
        path: String,
        /// The table of the file.
        section: String,
        /// What is wrong.
        what: String,
    },
    /// The sweep is for recorded detections, and none are given.
    #[error("{path}: got no detections, expected --data CSV: {how}")]
    NeedsData {
        /// The file.
        path: String,
        /// How to get them.
        how: String,
    },
    /// The design cannot be expanded.
    #[error("{path}: [design] {what}")]
    Design {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

impl SweepError {
    pub(super) fn setting(path: &str, section: &str, error: SettingError) -> Self {
        Self::Setting {
            path: path.to_owned(),
            section: section.to_owned(),
            what: error.to_string(),
        }
    }
}
