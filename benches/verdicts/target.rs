//! Posteriors that are known: small ones by enumeration, rings by their symmetry.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use topometric::dataset::DataSet;
use topometric::detections::{Covariance, Detection, Detections};
use topometric::exact::{ExactSettings, posterior};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::settings::Settings;

/// How targets are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// One to four landmarks well apart.
    Clusters,
    /// Detections anywhere in a small box.
    Crowded,
    /// Detections in a line, each a bridge between its neighbours.
    Line,
    /// A ring whose even and odd neighbours are nearly, but not quite, alike.
    Bimodal,
    /// A ring: every rotation of a topology has the same probability.
    Ring,
}

impl Kind {
    pub const ALL: [Self; 5] = [
        Self::Clusters,
        Self::Crowded,
        Self::Line,
        Self::Bimodal,
        Self::Ring,
    ];

    pub fn words(self) -> &'static str {
        match self {
            Self::Clusters => "landmarks apart",
            Self::Crowded => "crowded",
            Self::Line => "lines",
            Self::Bimodal => "nearly two modes",
            Self::Ring => "rings",
        }
    }
}

/// What is known of a posterior.
pub enum Known {
    /// Every topology with its probability.
    Table(Vec<(Topology, f64)>),
    /// Rotations and reflections of the ring leave it as it is.
    Dihedral,
}

pub struct Target {
    pub number: u64,
    pub kind: Kind,
    pub n_detections: usize,
    pub data: DataSet,
    /// Model, prior and seed.
    pub settings: Vec<(&'static str, String)>,
    pub known: Known,
}

/// Rings, by their number of detections. Up to eight they could be enumerated, too.
const RING_SIZES: [usize; 6] = [6, 8, 10, 12, 16, 20];
/// A table that is known less well than this would blur what counts as false: its target is left out.
const MOST_TABLE_ERROR: f64 = 0.01;

impl Target {
    /// Target number `number`; `None` if its posterior cannot be known well enough.
    pub fn new(number: u64) -> Option<Self> {
        let mut rng = Purpose::new("targets of verdicts", number).generator();
        let kind = Kind::ALL[(number % 5) as usize];
        let (positions_m, mut settings) = place(kind, number / 5, &mut rng);
        let n = positions_m.len();
        settings.push(("prior", prior(kind, n, &mut rng)));
        let is_covariance = rng.random_range(0..3) == 0;
        settings.push((
            "model",
            if is_covariance {
                "covariance"
            } else {
                "metric"
            }
            .to_owned(),
        ));
        if is_covariance {
            // Mahalanobis units: with variances of 1 m² all lengths keep their meaning.
            for (name, value) in &mut settings {
                if *name == "sigma_t" {
                    *value = (value.parse::<f64>().expect("a number") * 1.5).to_string();
                }
            }
        }
        settings.push(("seed", (1000 + number).to_string()));
        let rows = positions_m.iter().map(|&[x, y]| Detection {
            covariance_m2: is_covariance.then_some(Covariance {
                xx: 1.0,
                xy: 0.0,
                yy: 1.0,
            }),
            ..Detection::at(x, y)
        });
        let detections = Detections::new(rows.collect()).expect("finite detections");
        let data = DataSet::new(detections, None);
        let known = match kind {
            Kind::Ring => Known::Dihedral,
            _ => Known::Table(table(&data, &settings)?),
        };
        Some(Self {
            number,
            kind,
            n_detections: n,
            data,
            settings,
            known,
        })
    }

    /// Whether its model is the covariance model.
    pub fn is_covariance(&self) -> bool {
        let is_so = |(name, value): &(&str, String)| *name == "model" && value == "covariance";
        self.settings.iter().any(is_so)
    }

    /// The settings of this target with these.
    pub fn with(&self, more: &[(&str, &str)]) -> Settings {
        let mut all = Settings::default();
        let own = self
            .settings
            .iter()
            .map(|(name, value)| (*name, value.as_str()));
        for (name, value) in own.chain(more.iter().copied()) {
            all.set_text(name, value).expect("a setting");
        }
        all
    }
}

fn table(data: &DataSet, settings: &[(&'static str, String)]) -> Option<Vec<(Topology, f64)>> {
    let mut all = Settings::default();
    for (name, value) in settings {
        all.set_text(name, value).expect("a setting");
    }
    let how = ExactSettings {
        tolerance: MOST_TABLE_ERROR / 2.0,
        max_draws: 2e7,
    };
    let model = data.model(&all).expect("a model");
    let purpose = Purpose::new("targets of verdicts", 1).text("data", &data.content_hash());
    let found = posterior(&model, all.prior(), &how, &purpose);
    let rows = found
        .topologies
        .into_iter()
        .map(|row| (row.topology, row.probability));
    (found.error.total() <= MOST_TABLE_ERROR).then(|| rows.collect())
}

fn prior(kind: Kind, n: usize, rng: &mut impl Rng) -> String {
    match (kind, rng.random_range(0..3)) {
        // Without a prior for few sets a ring is all singletons.
        (Kind::Ring, _) => [
            "dirichlet-process:0.00002",
            "dirichlet-process:0.01",
            "poisson:3",
        ][rng.random_range(0..if n == 20 { 1 } else { 3 })]
        .to_owned(),
        (_, 0) => "uniform".to_owned(),
        (_, 1) => {
            let alphas = ["0.00002", "0.01", "0.3", "1"];
            format!("dirichlet-process:{}", alphas[rng.random_range(0..4)])
        }
        _ => format!("poisson:{}", rng.random_range(2..8)),
    }
}

type Placed = (Vec<[f64; 2]>, Vec<(&'static str, String)>);

fn place(kind: Kind, turn: u64, rng: &mut impl Rng) -> Placed {
    let between = |low: f64, high: f64, rng: &mut dyn Rng| low + (high - low) * rng.random::<f64>();
    let normal = |rng: &mut dyn Rng| -> f64 { StandardNormal.sample(rng) };
    let settings = |o: f64, t: f64, radius: f64, height: f64| {
        vec![
            ("sigma_o", o.to_string()),
            ("sigma_t", t.to_string()),
            ("penalty_radius", radius.to_string()),
            ("penalty_height", height.to_string()),
        ]
    };
    match kind {
        Kind::Clusters => {
            let n = rng.random_range(4..9_usize);
            let n_landmarks = rng.random_range(1..=n.div_ceil(2));
            let spread = between(0.2, 0.5, rng);
            let at = |i: usize, rng: &mut dyn Rng| {
                let c = i % n_landmarks;
                let [dx, dy] = [spread * normal(rng), spread * normal(rng)];
                [4.0 * c as f64 + dx, 2.0 * (c % 2) as f64 + dy]
            };
            let height = between(20.0, 80.0, rng);
            (
                (0..n).map(|i| at(i, rng)).collect(),
                settings(1.0, 1.0, 3.0, height),
            )
        }
        Kind::Crowded => {
            let n = rng.random_range(4..8_usize);
            let side = between(1.5, 4.5, rng);
            let positions = (0..n).map(|_| [between(0.0, side, rng), between(0.0, side, rng)]);
            let positions = positions.collect();
            let (o, t) = (between(0.3, 1.0, rng), between(0.3, 1.5, rng));
            (
                positions,
                settings(o, t, between(1.0, 3.0, rng), between(3.0, 33.0, rng)),
            )
        }
        Kind::Line => {
            let n = rng.random_range(4..8_usize);
            let gap = between(0.4, 1.0, rng);
            let at = |i: usize, rng: &mut dyn Rng| {
                [gap * i as f64 + 0.03 * normal(rng), 0.05 * normal(rng)]
            };
            let positions = (0..n).map(|i| at(i, rng)).collect();
            let (o, t) = (between(0.1, 0.4, rng), between(0.3, 0.9, rng));
            (
                positions,
                settings(o, t, between(1.0, 1.5, rng), between(3.0, 43.0, rng)),
            )
        }
        Kind::Bimodal => {
            let n = [4, 6, 8][rng.random_range(0..3)];
            let shift = between(0.0, 0.04, rng);
            // Every second detection a little forward: one pairing is a little shorter.
            let angle = |i: usize| TAU / n as f64 * (i as f64 + shift * (i % 2) as f64);
            (ring(n, angle), ring_settings(rng, settings))
        }
        Kind::Ring => {
            let n = RING_SIZES[(turn % 6) as usize];
            (
                ring(n, |i| TAU / n as f64 * i as f64),
                ring_settings(rng, settings),
            )
        }
    }
}

/// Detections on a circle, a metre from one to the next.
fn ring(n: usize, angle: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
    let radius = 0.5 / (TAU / (2 * n) as f64).sin();
    (0..n)
        .map(|i| [radius * angle(i).cos(), radius * angle(i).sin()])
        .collect()
}

fn ring_settings(
    rng: &mut impl Rng,
    settings: impl Fn(f64, f64, f64, f64) -> Vec<(&'static str, String)>,
) -> Vec<(&'static str, String)> {
    let o = 0.1 + 0.1 * rng.random::<f64>();
    let t = 0.5 + 0.2 * rng.random::<f64>();
    let heights = [5.0, 10.0, 20.0, 30.0, 60.0];
    settings(o, t, 1.0, heights[rng.random_range(0..5)])
}
