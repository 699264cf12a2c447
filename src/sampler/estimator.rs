//! Where the importance draws of a posterior value come from.

use std::fmt;
use std::str::FromStr;

/// The estimator of eq. 5 inside the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// New draws of all locations for every proposal, as in the source report.
    Fresh,
    /// Draws that are part of the state; needs the move `refresh`.
    Common,
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fresh => "fresh",
            Self::Common => "common",
        })
    }
}

impl FromStr for Estimator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "fresh" => Ok(Self::Fresh),
            "common" => Ok(Self::Common),
            _ => Err("fresh or common".to_owned()),
        }
    }
}
