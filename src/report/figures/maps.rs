//! The topometric map of a sample.

use super::worlds::walls_m;
use crate::dataset::DataSet;
use crate::figure::posterior_map::{MapNode, PosteriorMapFigure, SupportedEdge};
use crate::figure::scene::Scene;
use crate::map::PosteriorMap;

/// A map with its probabilities.
pub fn map_figure(map: &PosteriorMap, data: &DataSet, title: String) -> Scene {
    let positions_m = data.detections.positions_m();
    let figure = PosteriorMapFigure {
        title,
        walls_m: walls_m(data),
        nodes: map
            .nodes
            .iter()
            .map(|node| MapNode {
                position_m: node.position_m,
                covariance_m2: {
                    let [xx, xy, yy] = node.covariance_m2;
                    [[xx, xy], [xy, yy]]
                },
                probability: node.probability,
                members_m: node.members.iter().map(|&i| positions_m[i]).collect(),
            })
            .collect(),
        edges: map
            .edges
            .iter()
            .map(|edge| SupportedEdge {
                first: edge.first,
                second: edge.second,
                weight: edge.weight,
                support: edge.support,
            })
            .collect(),
    };
    figure.page(1600, 1300)
}
