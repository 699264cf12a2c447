//! Parameter sweeps and diagnostics for Probabilistic Topological Maps.
//!
//! N detections of landmarks are given; a *topology* is a set partition of them, one set for each
//! landmark. This crate samples the posterior over topologies of Ranganathan & Dellaert (IROS 2004;
//! T-RO 22(1), 2006) as emulated by the source report, "Performing Inference over Topometric Maps",
//! whose equations the modules cite; runs it over grids of settings; and tells which settings
//! recover the truth. The program `ptm` is a thin shell round it.
//!
//! [`job`] is the front door: detections in, chains run and judged.
//!
//! ```
//! use topometric::dataset::DataSet;
//! use topometric::detections::{Detection, Detections};
//! use topometric::job::{self, Watch};
//! use topometric::settings::Settings;
//!
//! // Four detections, metres: two corners, each seen twice.
//! let rows = [[0.0, 0.0], [0.8, 0.3], [9.0, 0.1], [9.4, -0.5]].map(|[x, y]| Detection::at(x, y));
//! let data = DataSet::new(Detections::new(rows.to_vec())?, None);
//! let mut settings = Settings::default();
//! settings.set_text("penalty_radius", "3")?;
//! settings.set_text("samples", "2000")?;
//! let sampled = job::sample(&data, &settings, &Watch::NOBODY)?.expect("nobody stops it");
//! assert_eq!(sampled.result.topologies[0].topology.labels(), [0, 0, 1, 1]);
//! assert!(sampled.result.convergence.is_some_and(|found| found.verdict != "not-shown"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Below it, a chain by itself:
//!
//! ```
//! use topometric::chain::{self, Start, TraceRecorder};
//! use topometric::model::{MetricModel, Model, Penalty, PenaltyShape, Prior};
//! use topometric::rng::Purpose;
//! use topometric::settings::Settings;
//!
//! let positions_m = [[0.0, 0.0], [0.8, 0.3], [9.0, 0.1], [9.4, -0.5]];
//! let penalty = Penalty { shape: PenaltyShape::Quadratic, radius_m: 3.0, height: 50.0 };
//! let model = Model::from(MetricModel::new(&positions_m, 1.0, 1.0, penalty));
//! let sampler = Settings::default().sampler(positions_m.len());
//! let mut recorder = TraceRecorder::new(1000);
//! let purpose = Purpose::new("example", 1);
//! chain::run(&model, Prior::Uniform, &sampler, &Start::Singletons, 5000, &purpose, &mut recorder);
//! let most_sampled = &recorder.finish().frequencies(0)[0];
//! assert_eq!(most_sampled.topology.labels(), [0, 0, 1, 1]);
//! ```

pub mod baseline;
pub mod chain;
#[cfg(feature = "reports")]
pub mod cli;
pub mod dataset;
pub mod detections;
pub mod diagnostics;
pub mod evidence;
pub mod exact;
pub mod excerpt;
#[cfg(feature = "reports")]
pub mod figure;
pub mod files;
pub mod import;
pub mod input;
pub mod job;
pub mod labels;
pub mod map;
pub mod mission;
pub mod model;
pub mod partition;
#[cfg(feature = "reports")]
pub mod report;
pub mod results;
pub mod rng;
pub mod run;
pub mod sampler;
pub mod settings;
pub mod sighting;
pub mod sweep;
#[cfg(feature = "reports")]
pub mod table;
pub mod tracker;
pub mod tune;
pub mod world;
