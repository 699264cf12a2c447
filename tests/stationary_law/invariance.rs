//! The posterior does not know where the origin is, which way is north, or how detections are numbered.

use std::collections::HashMap;

use topometric::chain::{self, Start, TraceRecorder};
use topometric::detections::Covariance;
use topometric::exact::{self, ExactTopology};
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::SamplerSettings;
use topometric::settings::Settings;

use crate::statistic::{threshold, total_variation};

const POSITIONS_M: [[f64; 2]; 5] = [[0.0, 0.0], [0.4, 0.3], [1.4, -0.2], [1.6, 0.5], [0.7, 1.1]];
/// Detection i of the relabelled data is detection ORDER[i] of the original.
const ORDER: [usize; 5] = [3, 0, 4, 1, 2];

type Data = (Vec<[f64; 2]>, Vec<Covariance>);

fn data() -> Data {
    let covariances_m2 = (0..5).map(|i| Covariance {
        xx: 0.4 + 0.1 * f64::from(i),
        xy: 0.2 - 0.1 * f64::from(i),
        yy: 0.5,
    });
    (POSITIONS_M.to_vec(), covariances_m2.collect())
}

fn models((positions_m, covariances_m2): &Data) -> [Model; 2] {
    let penalty = |radius_m| Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m,
        height: 3.0,
    };
    let covariance = CovarianceModel::new(positions_m, covariances_m2, 0.7, 0.9, penalty(2.0));
    [
        MetricModel::new(positions_m, 0.5, 0.6, penalty(1.2)).into(),
        covariance.expect("good covariances").into(),
    ]
}

/// Turned by an angle, then moved by a kilometre or two.
fn moved((positions_m, covariances_m2): &Data) -> Data {
    let (sin, cos) = 0.7_f64.sin_cos();
    let turn = |z: &[f64; 2]| {
        [
            cos * z[0] - sin * z[1] + 1500.0,
            sin * z[0] + cos * z[1] - 800.0,
        ]
    };
    let turn_covariance = |c: &Covariance| Covariance {
        xx: cos * cos * c.xx - 2.0 * sin * cos * c.xy + sin * sin * c.yy,
        xy: sin * cos * (c.xx - c.yy) + (cos * cos - sin * sin) * c.xy,
        yy: sin * sin * c.xx + 2.0 * sin * cos * c.xy + cos * cos * c.yy,
    };
    (
        positions_m.iter().map(turn).collect(),
        covariances_m2.iter().map(turn_covariance).collect(),
    )
}

fn relabelled((positions_m, covariances_m2): &Data) -> Data {
    (
        ORDER.map(|i| positions_m[i]).to_vec(),
        ORDER.map(|i| covariances_m2[i]).to_vec(),
    )
}

fn enumerate(model: &Model) -> Vec<ExactTopology> {
    let mut rng = Purpose::new("invariance test", 2).generator();
    exact::enumerate(model, Prior::Uniform, 50_000, &mut rng)
}

#[test]
fn the_integral_of_every_set_moves_with_the_data() {
    for (here, there) in models(&data()).iter().zip(&models(&moved(&data()))) {
        for code in 1_u32..32 {
            let members: Vec<u32> = (0..5).filter(|i| code >> i & 1 == 1).collect();
            let apart = here.set_law(&members).ln_integral - there.set_law(&members).ln_integral;
            // The covariance model's quadrature is good to 1e-6, and its rays do not turn with the data.
            let digits = if matches!(here, Model::Metric(_)) {
                1e-9
            } else {
                1e-6
            };
            assert!(apart.abs() < digits, "{members:?}: {apart}");
        }
    }
}

/// ln π of every topology, in other coordinates and under other numbers, within the Monte Carlo error.
#[test]
fn the_posterior_does_not_depend_on_coordinates_or_numbers() {
    type Image = fn(&Topology) -> Topology;
    let there: Image = Topology::clone;
    let numbered: Image = |topology| Topology::canonical(&ORDER.map(|i| topology.labels()[i]));
    let original = models(&data());
    let cases = [
        (models(&moved(&data())), there),
        (models(&relabelled(&data())), numbered),
    ];
    for (changed, image) in cases {
        for (here, there) in original.iter().zip(&changed) {
            let rows = enumerate(there);
            let by_topology: HashMap<_, _> = rows.iter().map(|row| (&row.topology, row)).collect();
            for row in enumerate(here) {
                let other = by_topology[&image(&row.topology)];
                let apart = row.ln_unnormalised - other.ln_unnormalised;
                let joint = row.se.hypot(other.se);
                assert!(
                    apart.abs() < 5.0 * joint + 1e-8,
                    "{}: {apart} {joint}",
                    row.topology
                );
            }
        }
    }
}

/// A chain over relabelled data has the original's law, relabelled: for every move, as some of them look at the
/// order of the detections.
#[test]
fn chains_do_not_depend_on_numbers() {
    for (here, there) in models(&data()).iter().zip(&models(&relabelled(&data()))) {
        let expected: Vec<ExactTopology> = enumerate(here)
            .into_iter()
            .map(|row| ExactTopology {
                topology: Topology::canonical(&ORDER.map(|i| row.topology.labels()[i])),
                ..row
            })
            .collect();
        let settings = SamplerSettings {
            importance_samples: 4,
            moves: "split-merge=0.2,reassign=0.3,anchors=0.2,sequential-allocation=0.1,restricted-gibbs=0.1,refresh=0.1"
                .parse()
                .expect("a good mix"),
            ..Settings::default().sampler(4)
        };
        let mut recorder = TraceRecorder::new(1000);
        let purpose = Purpose::new("invariance test", 3);
        let start = &Start::OneCluster;
        let prior = Prior::Uniform;
        chain::run(
            there,
            prior,
            &settings,
            start,
            400_000,
            &purpose,
            &mut recorder,
        );
        let trace = recorder.finish();
        let (distance, bound) = (
            total_variation(&trace, 0, &expected),
            threshold(&trace, 0, &expected),
        );
        assert!(distance < bound, "{distance} {bound}");
    }
}
