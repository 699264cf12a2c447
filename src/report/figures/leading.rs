//! The figures that answers open with, each with a second layout for narrow pages.

use super::super::{Figure, Leading, Material, answer, words};
use super::{effects, sensitivity};
use crate::figure::axes::{Axis, Scale};
use crate::figure::effects::Interval;
use crate::figure::plane::{Plane, PlaneKey, PlanePoint};
use crate::figure::scene::Hover;
use crate::figure::style::{MUTED, SERIES};
use crate::results::sensitivity::Response;

/// Width of the layout for narrow pages: at half size its text can still be read.
pub(super) const NARROW_PX: u32 = 660;
/// Height of one of its panels.
const PANEL_PX: u32 = 440;
/// Panels of it at most: those of the factors that matter most.
const MOST_PANELS: usize = 4;

/// What each setting does to the outcome: the recovery rate by level; by level and partner where
/// two settings act together; `None` where nothing differs.
pub(in super::super) fn main_effects(material: Material<'_>) -> Option<Leading> {
    let (results, response) = (material.results, answer::headline_response(material));
    let found = &results.sensitivity;
    let differs = |row: &&crate::results::sensitivity::Contrast| {
        row.estimate.is_some_and(|estimate| estimate.mean != 0.0)
    };
    found.strongest(response).iter().find(|row| differs(row))?;
    let acts_alone = found.clear_interactions(response).is_empty();
    if response == Response::Recovery && acts_alone {
        let shown = &results.effects;
        let few = &shown[..shown.len().min(MOST_PANELS)];
        let height = 110 + PANEL_PX * few.len() as u32;
        return Some(Leading {
            figure: effects::effects(material)?,
            narrow: Some(effects::panels(material, few).page(NARROW_PX, height)),
        });
    }
    main_curves(material)
}

/// The outcome along each setting.
pub(in super::super) fn main_curves(material: Material<'_>) -> Option<Leading> {
    let found = &material.results.sensitivity;
    let (figure, mut drawn) = sensitivity::curves_of(found, answer::headline_response(material))?;
    drawn.panels.truncate(MOST_PANELS);
    let height = 60 + (PANEL_PX + 60) * drawn.panels.len() as u32;
    Some(Leading {
        figure,
        narrow: Some(drawn.page(NARROW_PX, height)),
    })
}

/// Sobol's indices of the outcome alone.
pub(in super::super) fn indices_alone(material: Material<'_>) -> Option<Leading> {
    let found = &material.results.sensitivity;
    let response = answer::headline_response(material);
    let (mut figure, mut drawn) = sensitivity::indices_of(found, found.indices.as_ref()?);
    drawn.panels.retain(|panel| panel.name == response.words());
    let n_rows = drawn.panels.first()?.rows.len() as u32;
    figure.file = "figures/indices-alone".to_owned();
    figure.scene = drawn.page(1500, 260 + 80 * n_rows);
    Some(Leading {
        figure,
        narrow: Some(drawn.page(NARROW_PX, 300 + 90 * n_rows)),
    })
}

/// Morris' plane: how large the effects of each setting are, and how much they vary.
pub(in super::super) fn screening_plane(material: Material<'_>) -> Option<Leading> {
    let response = answer::headline_response(material);
    let (keys, rows) = answer::screened(material, response)?;
    let known = || rows.iter().flatten();
    let ends = known().flat_map(|row| {
        let high = |value: f64, i: Option<crate::diagnostics::interval::Interval>| {
            i.map_or(value, |i| i.high)
        };
        [
            high(row.mu_star, row.mu_star_interval),
            high(row.sigma, row.sigma_interval),
        ]
    });
    let high = 1.05 * ends.fold(0.0, f64::max);
    let high = if high > 0.0 { high } else { 1.0 };
    let interval = |value: f64, i: Option<crate::diagnostics::interval::Interval>| Interval {
        low: i.map_or(value, |i| i.low),
        estimate: value,
        high: i.map_or(value, |i| i.high),
    };
    let point = |(key, row): (&&'static crate::settings::Key, &Option<_>)| {
        let row: crate::diagnostics::morris::Screening = (*row)?;
        let is_told = row.exceeds_noise != Some(false);
        Some(PlanePoint {
            name: key.label().to_owned(),
            x: interval(row.mu_star, row.mu_star_interval),
            y: interval(row.sigma, row.sigma_interval),
            colour: if is_told { SERIES } else { MUTED },
            is_hollow: !is_told,
            hover: Some(Hover {
                text: format!(
                    "{}: μ* {}, σ {}, of noise {}",
                    key.label(),
                    words::points(row.mu_star),
                    words::points(row.sigma),
                    row.mu_star_of_noise.map_or_else(words::dash, words::points)
                ),
                href: None,
            }),
        })
    };
    let axis = |name: &str| Axis::new(Scale::Share(0.0, high), name);
    let sign = |colour, is_hollow, words: &str| PlaneKey {
        colour,
        is_hollow,
        words: words.to_owned(),
    };
    let plane = Plane {
        axes: (
            axis("μ*: mean size of the change"),
            axis("σ: how much it varies"),
        ),
        points: keys.iter().zip(&rows).filter_map(point).collect(),
        key: vec![
            sign(SERIES, false, "more than noise"),
            sign(MUTED, true, "not told from noise"),
        ],
        diagonal: Some("σ = μ*".to_owned()),
    };
    let figure = Figure {
        file: "figures/screening-plane".to_owned(),
        caption: format!(
            "Morris’ plane of the {}: to the right are settings that change it much, further up \
             those whose effect varies with the other settings. Above the dashed line the effect \
             varies more than it is large. Lines: 95 % intervals.",
            response.words()
        ),
        scene: plane.page(1500, 1000),
    };
    Some(Leading {
        figure,
        narrow: Some(plane.page(NARROW_PX, 640)),
    })
}
