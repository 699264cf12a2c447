//! Maps of the worlds and their detections.

use super::super::{Figure, Material};
use crate::dataset::DataSet;
use crate::detections::Detections;
use crate::figure::world_map::WorldMap;

/// Worlds drawn at most.
const N_WORLDS: usize = 4;

/// The first replicate of each world of the sweep.
pub(in crate::report) fn worlds(material: Material<'_>) -> Vec<Figure> {
    let mut seen = Vec::new();
    let first_of = |cell| Some((material.plan.tasks_of(cell).first()?.data, cell));
    for (data, cell) in (0..material.sweep.cells.len()).filter_map(first_of) {
        if !seen.iter().any(|(known, _)| *known == data) {
            seen.push((data, cell));
        }
    }
    let n_worlds = seen.len();
    let mut figures = Vec::new();
    for (place, (data, cell)) in seen.into_iter().take(N_WORLDS).enumerate() {
        let Ok(data) = &material.plan.data_sets[data] else {
            continue;
        };
        let cell = &material.sweep.cells[cell];
        let what = match &data.scene {
            Some(scene) => format!("World {}, first replicate", scene.world.name()),
            None => "The detections".to_owned(),
        };
        let noise = match (&data.scene, n_worlds) {
            (Some(_), 2..) => format!(", noise {}", cell.settings.get("noise")),
            _ => String::new(),
        };
        figures.push(Figure {
            file: format!("figures/world-{}", place + 1),
            caption: format!(
                "{what}{noise}: {} detections in the order of the mission, with 2σ ellipses.",
                data.detections.len()
            ),
            scene: world_map(data, String::new()).page(1600, 1400),
        });
    }
    figures
}

fn world_map(data: &DataSet, title: String) -> WorldMap {
    let path = |poses: Option<&Vec<crate::sighting::Pose>>| {
        poses.map_or_else(Vec::new, |poses| {
            poses.iter().map(|pose| pose.position_m()).collect()
        })
    };
    let scene = data.scene.as_ref();
    WorldMap {
        title,
        walls_m: walls_m(data),
        believed_path_m: path(scene.map(|scene| &scene.believed_path)),
        true_path_m: path(scene.map(|scene| &scene.true_path)),
        detections_m: data.detections.positions_m(),
        covariances_m2: covariances_m2(&data.detections),
        ellipse_sigmas: 2.0,
    }
}

fn covariances_m2(detections: &Detections) -> Vec<[[f64; 2]; 2]> {
    let all = detections.covariances_m2().unwrap_or_default();
    all.into_iter()
        .map(|c| [[c.xx, c.xy], [c.xy, c.yy]])
        .collect()
}

/// The map of a simulation, as a PNG: walls, believed and true path, detections with 2σ ellipses.
pub fn simulation_figure(data: &DataSet, title: String) -> Vec<u8> {
    world_map(data, title).page(1600, 1400).png()
}

/// The walls that a data set was seen among; none for a CSV.
pub(super) fn walls_m(data: &DataSet) -> Vec<Vec<[f64; 2]>> {
    let Some(scene) = &data.scene else {
        return Vec::new();
    };
    scene
        .world
        .outer()
        .iter()
        .chain(scene.world.obstacles())
        .cloned()
        .collect()
}
