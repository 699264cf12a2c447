//! Which knob matters, in words that its test allows.

use super::{Material, factors, words};
use crate::results::FactorEffect;
use crate::results::sensitivity::{Contrast, Response, UnitMean};
use crate::results::told_apart::LEVEL;

/// The largest difference in recovery that a factor makes, as `contrasts` has it, with its test.
pub(super) struct Knob {
    /// The level with the lower rate, and the one with the higher.
    levels: [usize; 2],
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
    let mut levels = [contrast.from, contrast.to];
    if estimate.mean < 0.0 {
        levels.reverse();
    }
    Some(Knob {
        levels,
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

/// The knob that matters most, with its test.
pub(super) fn which_knob(material: Material<'_>) -> Option<String> {
    let (sweep, results) = (material.sweep, material.results);
    let strongest = results.effects.first()?;
    if strongest.range == 0.0 {
        let rate = strongest.by_level.iter().flatten().next()?.rate;
        let rate = words::percent(Some(rate));
        return Some(format!(
            "none: the recovery rate is {rate} at every level of every setting."
        ));
    }
    let describe = |effect: &FactorEffect| {
        let factor = &sweep.factors[effect.factor];
        // The levels that the test is of; without a test those with the lowest and the highest
        // rate.
        let rates = match knob(material, effect.factor) {
            Some(knob) => knob.levels.map(|level| Some(effect.by_level[level]?.rate)),
            None => {
                [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| factors::extreme(effect, of))
            }
        };
        let [low, high] = [rates[0]?, rates[1]?];
        Some(format!(
            "{}: recovery goes from {} to {}, a change of {}",
            factor.key.label(),
            factors::at(factor, effect, low),
            factors::at(factor, effect, high),
            words::points(high - low)
        ))
    };
    let changing = results.effects.iter().filter(|effect| effect.range > 0.0);
    let (told, not_told): (Vec<&FactorEffect>, Vec<&FactorEffect>) = changing
        .partition(|effect| knob(material, effect.factor).is_some_and(|knob| knob.is_told()));
    let named = |effects: &[&FactorEffect]| {
        let name = |effect: &&FactorEffect| {
            let label = sweep.factors[effect.factor].key.label();
            let p = knob(material, effect.factor)
                .map_or_else(|| "one unit".to_owned(), |knob| words::p_value(knob.p_holm));
            format!("{label} ({}, {p})", words::points(effect.range))
        };
        effects.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let Some((first, others)) = told.split_first() else {
        let test = match knob(material, strongest.factor) {
            Some(knob) => format!("{}{}", knob.words(), too_few(&knob)),
            None => "one unit shows no chance: run more worlds or chains".to_owned(),
        };
        return Some(format!(
            "none shows an effect beyond chance. The largest change seen is that of {} ({test}).",
            describe(strongest)?
        ));
    };
    let test = knob(material, first.factor)?.words();
    let then = if others.is_empty() {
        String::new()
    } else {
        format!("; then {}", named(others))
    };
    let left = if not_told.is_empty() {
        String::new()
    } else {
        format!(" Not beyond chance: {}.", named(&not_told))
    };
    Some(format!("{} ({test}){then}.{left}", describe(first)?))
}

/// What a test lacks that finds nothing although all units agree: units.
fn too_few(knob: &Knob) -> String {
    if knob.estimate.standard_error != Some(0.0) || knob.estimate.mean == 0.0 {
        return String::new();
    }
    // 2^(1 − n) times the number of contrasts is below the level.
    let needed = 1.0 + libm::log2(knob.n_contrasts as f64 / LEVEL);
    format!(
        "; all {} agree, and {} that do would be enough",
        words::counted(knob.estimate.n, knob.unit),
        needed.ceil()
    )
}
