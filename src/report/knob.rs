//! Which knob matters, in words that its test allows.

use super::{Material, words};
use crate::results::sensitivity::{Contrast, Response, UnitMean};
use crate::results::told_apart::LEVEL;

/// The largest difference in recovery that a factor makes, as `contrasts` has it, with its test.
pub(super) struct Knob {
    estimate: UnitMean,
    /// Holm’s p-value over all pairs of levels of all factors.
    pub p_holm: f64,
    n_contrasts: usize,
    unit: &'static str,
}

impl Knob {
    /// Whether chance does not explain it.
    pub fn is_told(&self) -> bool {
        self.p_holm <= LEVEL
    }

    /// "p = 0.012, paired over 5 worlds, Holm over 18 pairs of levels".
    pub fn words(&self) -> String {
        format!(
            "{}, paired over {}, Holm over {}",
            words::p_value(self.p_holm),
            words::counted(self.estimate.n, self.unit),
            match self.n_contrasts {
                1 => "1 pair of levels".to_owned(),
                n => format!("{n} pairs of levels"),
            }
        )
    }
}

/// Of a factor, by its index; `None` where one unit shows no chance.
pub(super) fn knob(material: Material<'_>, factor: usize) -> Option<Knob> {
    let found = &material.results.sensitivity;
    let strongest = found.strongest(Response::Recovery).into_iter();
    let contrast = strongest.into_iter().find(|row| row.factor == factor)?;
    let is_tested = |row: &&Contrast| row.response == Response::Recovery && row.p_holm.is_some();
    let estimate = contrast.estimate?;
    Some(Knob {
        estimate,
        p_holm: contrast.p_holm?,
        n_contrasts: found.contrasts.iter().filter(is_tested).count(),
        unit: if found.over_worlds {
            "world"
        } else {
            "chain number"
        },
    })
}
