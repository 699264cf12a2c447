//! Where the importance draws of a posterior value come from, if there are any.

use std::fmt;
use std::str::FromStr;

/// The estimator of eq. 5 inside the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// New draws of all locations for every proposal, as in the source report.
    Fresh,
    /// Draws that are part of the state; needs the move `refresh`.
    Common,
    /// No draws: the locations themselves are part of the state. For the metric model.
    Explicit,
}

impl Estimator {
    /// Whether posterior values are estimated, by draws of locations.
    pub fn draws_locations(self) -> bool {
        self != Self::Explicit
    }
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fresh => "fresh",
            Self::Common => "common",
            Self::Explicit => "explicit",
        })
    }
}

impl FromStr for Estimator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "fresh" => Ok(Self::Fresh),
            "common" => Ok(Self::Common),
            "explicit" => Ok(Self::Explicit),
            _ => Err("fresh, common or explicit".to_owned()),
        }
    }
}
