//! Which knob matters: one factor at a time, and the two strongest together.

use super::super::{Figure, Material, words};
use super::{level_key, level_names};
use crate::diagnostics::rate::Rate;
use crate::figure::effects::{self, Effects, LevelEffect};
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::style::Palette;
use crate::results::{FactorEffect, Verdict, WorldsByVerdict, verdicts_by_level};
use crate::sweep::Design;

/// The recovery rate at each level of each factor.
pub(in crate::report) fn effects(material: Material<'_>) -> Option<Figure> {
    let effects = &material.results.effects;
    if effects.is_empty() {
        return None;
    }
    let rows = effects.len().div_ceil(4) as u32;
    Some(Figure {
        file: "figures/effects".to_owned(),
        caption: format!(
            "Which knob matters: the recovery rate at each level of each factor, by falling range; {}{}",
            how_to_read(material),
            level_key(&material.sweep.factors)
        ),
        scene: panels(material, effects).page(2000, 160 + 520 * rows),
    })
}

/// The recovery rate at each level of one factor.
pub(in crate::report) fn effect(material: Material<'_>, effect: &FactorEffect) -> Figure {
    let factor = &material.sweep.factors[effect.factor];
    Figure {
        file: format!("figures/factors/{}", factor.key.name),
        caption: format!(
            "The recovery rate at each level of {}; {}{}",
            factor.key.label(),
            how_to_read(material),
            level_key([factor])
        ),
        scene: panels(material, std::slice::from_ref(effect)).page(1000, 760),
    }
}

fn how_to_read(material: Material<'_>) -> String {
    let others = if matches!(material.sweep.design, Design::OneAtATime(_)) {
        "all others at the baseline"
    } else {
        "averaged over all others"
    };
    format!(
        "{others}. Whiskers: 95 %, over {}. Hollow: the share of worlds that \
         converged chains recovered, which is what a rate can be relied on for.",
        unit(material)
    )
}

pub(super) fn panels(material: Material<'_>, shown: &[FactorEffect]) -> Effects {
    let of_factor = |effect: &FactorEffect| {
        let factor = &material.sweep.factors[effect.factor];
        let verdicts = verdicts_by_level(material.sweep, &material.results.cells, effect.factor);
        let levels = level_names(factor)
            .into_iter()
            .zip(&effect.by_level)
            .zip(verdicts);
        let level =
            |((label, rate), verdicts): ((String, &Option<Rate>), WorldsByVerdict)| LevelEffect {
                label,
                gated: rate.and(verdicts.recovered_share()),
                rate: rate.as_ref().map(interval),
            };
        effects::FactorEffect {
            name: words::axis_name(factor.key),
            note: format!("largest change {}", words::points(effect.range)),
            levels: levels.map(level).collect(),
        }
    };
    Effects {
        title: String::new(),
        factors: shown.iter().map(of_factor).collect(),
        value_name: "Recovery rate".to_owned(),
        key: Some((
            "recovery rate".to_owned(),
            Verdict::Recovered.words().to_owned(),
        )),
        range: (0.0, 1.0),
        percent: true,
    }
}

/// A rate for a figure.
pub(super) fn interval(rate: &Rate) -> effects::Interval {
    effects::Interval {
        low: rate.interval.low,
        estimate: rate.rate,
        high: rate.interval.high,
    }
}

/// What marginal rates are means over.
pub(super) fn unit(material: Material<'_>) -> &'static str {
    if material.sweep.has_many_worlds() {
        "worlds"
    } else {
        "the chains of one data set"
    }
}

/// The recovery rate by the levels of the two factors that matter most.
pub(in crate::report) fn pair_recovery(material: Material<'_>) -> Option<Figure> {
    let pair = material.results.pair.as_ref()?;
    let factor = |ix: usize| &material.sweep.factors[ix];
    let heat_factor = |ix: usize| HeatFactor {
        name: words::axis_name(factor(ix).key),
        levels: level_names(factor(ix)),
    };
    let values: Vec<Option<&Rate>> = pair
        .by_levels
        .iter()
        .flatten()
        .map(Option::as_ref)
        .collect();
    let text = |rate: &Option<&Rate>| words::rate(rate.copied()).replacen(" [", "\n[", 1);
    let figure = HeatMap {
        title: String::new(),
        row_factors: vec![heat_factor(pair.rows)],
        column_factors: vec![heat_factor(pair.columns)],
        values: values
            .iter()
            .map(|marginal| marginal.map(|m| m.rate))
            .collect(),
        texts: values.iter().map(text).collect(),
        value_name: "Recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
        is_log: false,
        palette: Palette::Viridis,
        ..HeatMap::default()
    };
    Some(Figure {
        file: "figures/recovery-pair".to_owned(),
        caption: format!(
            "Recovery rate by the two factors that matter most, {} and {}, with 95 % intervals over {}.{}",
            factor(pair.rows).key.label(),
            factor(pair.columns).key.label(),
            unit(material),
            level_key([factor(pair.rows), factor(pair.columns)])
        ),
        scene: figure.page(1600, 1000),
    })
}
