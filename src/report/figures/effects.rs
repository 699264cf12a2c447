//! Which knob matters: one factor at a time, and the two strongest together.

use super::super::{Figure, Material, words};
use super::level_names;
use crate::diagnostics::rate::Rate;
use crate::figure::effects::{self, Effects, LevelEffect};
use crate::figure::heat_map::{HeatFactor, HeatMap};
use crate::figure::style::Palette;
use crate::sweep::Design;

/// The recovery rate at each level of each factor.
pub(super) fn effects(material: Material<'_>) -> Option<Figure> {
    let results = material.results;
    if results.effects.is_empty() {
        return None;
    }
    let factors = results.effects.iter().map(|effect| {
        let factor = &material.sweep.factors[effect.factor];
        let levels =
            level_names(factor)
                .into_iter()
                .zip(&effect.by_level)
                .map(|(label, marginal)| {
                    let interval = |m: &Rate| {
                        let (low, high) = m.interval.map_or((m.rate, m.rate), |i| (i.low, i.high));
                        effects::Interval {
                            low,
                            estimate: m.rate,
                            high,
                        }
                    };
                    LevelEffect {
                        label,
                        rate: marginal.as_ref().map(interval),
                    }
                });
        effects::FactorEffect {
            name: words::axis_name(factor.key),
            note: format!("range {:.2}", effect.range),
            levels: levels.collect(),
        }
    });
    let n = results.effects.len();
    let rows = n.div_ceil(4) as u32;
    let figure = Effects {
        title: String::new(),
        factors: factors.collect(),
        value_name: "Recovery rate".to_owned(),
        range: (0.0, 1.0),
        percent: true,
    };
    let unit = unit(material);
    Some(Figure {
        file: "figures/effects.png".to_owned(),
        caption: format!(
            "Which knob matters: the recovery rate at each level of each factor, {}, by falling range. \
             Whiskers: 95 %, Student over {unit}; none where all agree.",
            if matches!(material.sweep.design, Design::OneAtATime(_)) {
                "all others at the baseline"
            } else {
                "averaged over all others"
            }
        ),
        png: figure.png(2000, 120 + 520 * rows),
    })
}

/// What marginal rates are means over.
fn unit(material: Material<'_>) -> &'static str {
    if material.sweep.has_many_worlds() {
        "worlds"
    } else {
        "chain numbers"
    }
}

/// The recovery rate by the levels of the two factors that matter most.
pub(super) fn pair_recovery(material: Material<'_>) -> Option<Figure> {
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
        palette: Palette::Viridis,
        categories: Vec::new(),
        parts: Vec::new(),
    };
    Some(Figure {
        file: "figures/recovery-pair.png".to_owned(),
        caption: format!(
            "Recovery rate by the two factors that matter most, {} and {}, with 95 % intervals over {}.",
            factor(pair.rows).key.label(),
            factor(pair.columns).key.label(),
            unit(material)
        ),
        png: figure.png(1600, 1000),
    })
}
