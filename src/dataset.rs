//! A data set ready to be sampled and scored: detections, their truth, and the scene they are from.

use std::io::ErrorKind;

use sha2::{Digest, Sha256};

use crate::chain::Start;
use crate::detections::{Corner, Detections, DetectionsError};
use crate::diagnostics::recovery::Truth;
use crate::files::{path_of, read_text_at_most};
use crate::input::{Note, Source};
use crate::model::{Appearance, CornerKinds, CovarianceModel, MetricModel, Model};
use crate::partition::Topology;
use crate::settings::{Init, Settings};
use crate::sighting::Pose;
use crate::sweep::hex;
use crate::world::{
    Simulation, SimulationError, World, WorldError, crossing_ranges, simulate, world_purpose,
};

/// The one world that is a set of detections and no scene: nothing in it is simulated.
const CROSSING_RANGES: &str = "crossing-ranges";

/// More bytes than the labels of any data set have.
const MAX_START_FILE: u64 = 64_000_000;

/// A data set.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// The detections.
    pub detections: Detections,
    /// Their truth, if any of it is known.
    pub truth: Option<Truth>,
    /// The scene, for drawing; `None` for a CSV.
    pub scene: Option<Scene>,
    /// What the reader of a CSV left out or put up with.
    pub notes: Vec<Note>,
}

/// What a simulated data set was seen in.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Scene {
    /// The walls.
    pub world: World,
    /// Where the robot believed it was.
    pub believed_path: Vec<Pose>,
    /// Where it was.
    pub true_path: Vec<Pose>,
}

/// A data set that cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum DataError {
    /// The CSV.
    #[error(transparent)]
    Detections(#[from] DetectionsError),
    /// The world.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A world or a CSV that a sweep file names.
    #[error("{place}: {}", without_name(source))]
    InSweep {
        /// The sweep file, its section and the key.
        place: String,
        /// What is wrong.
        source: Box<DataError>,
    },
    /// The simulation.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A model that these data do not allow.
    #[error("model: {0}")]
    Model(String),
    /// A start that these data do not have.
    #[error("init: {0}")]
    Start(String),
    /// A file of labels that are no topology of these data.
    #[error("init: {0}")]
    StartFile(String),
}

/// The message without the key that the place before it names already.
fn without_name(error: &DataError) -> String {
    let text = error.to_string();
    text.strip_prefix("world: ")
        .map_or(text.clone(), str::to_owned)
}

/// Simulates replicate number `replicate` of the world that the settings name: all that
/// [`DataSet::load`] makes a data set of.
///
/// # Errors
/// A world that cannot be read, or a simulation that sees nothing.
pub fn simulated(settings: &Settings, replicate: u64) -> Result<(World, Simulation), DataError> {
    let world = World::load(settings.text("world"))?;
    let of_world = settings.simulation();
    let purpose = world_purpose(settings.count("seed"), &world, &of_world, replicate);
    let simulation = simulate(&world, &of_world, &mut purpose.generator())?;
    Ok((world, simulation))
}

impl DataSet {
    /// Reads the CSV that the settings name, or simulates replicate number `replicate` of their
    /// world. A world is a function of (seed, world, world settings, replicate) and of nothing else.
    ///
    /// # Errors
    /// A CSV or a world that cannot be read, or a simulation that sees nothing.
    pub fn load(settings: &Settings, replicate: u64) -> Result<Self, DataError> {
        let csv = settings.text("detections");
        if !csv.is_empty() {
            let source = Source::open(&path_of(csv)).map_err(DetectionsError::from)?;
            let (detections, notes) = Detections::from_source(source)?;
            let data = Self::new(detections, None);
            return Ok(Self { notes, ..data });
        }
        if settings.text("world") == CROSSING_RANGES {
            return Ok(Self::new(crossing_ranges(), None));
        }
        let (world, simulation) = simulated(settings, replicate)?;
        let scene = Scene {
            world,
            believed_path: simulation.believed_path,
            true_path: simulation.true_path,
        };
        Ok(Self::new(simulation.detections, Some(scene)))
    }

    /// From detections at hand.
    pub fn new(detections: Detections, scene: Option<Scene>) -> Self {
        let truth = Truth::new(&detections.truth());
        Self {
            detections,
            truth,
            scene,
            notes: Vec::new(),
        }
    }

    /// Where a chain starts, by its number from 0.
    ///
    /// # Errors
    /// The truth where none is known, or a file that holds no topology of these detections.
    pub fn start(&self, init: &Init, chain: u64) -> Result<Start, DataError> {
        match &init.of_chain(chain) {
            Init::Apart => unreachable!("a chain has a start of its own"),
            Init::Singletons => Ok(Start::Singletons),
            Init::OneCluster => Ok(Start::OneCluster),
            Init::Random => Ok(Start::Random),
            Init::Truth => match &self.truth {
                Some(truth) => Ok(Start::At(truth.completed())),
                None => Err(DataError::Start(
                    "got truth, but no detection's landmark is known; choose another start"
                        .to_owned(),
                )),
            },
            Init::File(path) => {
                let file = path_of(path);
                let path = file.display();
                let wrong = |what: String| DataError::StartFile(format!("{path}: {what}"));
                let read = read_text_at_most(&file, MAX_START_FILE);
                let text = read.map_err(|error| match error.kind() {
                    ErrorKind::InvalidData | ErrorKind::FileTooLarge => wrong(format!(
                        "got no list of labels ({error}), expected one label per detection, as in \
                         0,0,1,2; give another file"
                    )),
                    _ => {
                        let what = format!("{path}: cannot be read ({error}); check the path");
                        DataError::Start(what)
                    }
                })?;
                let topology: Topology = text.parse().map_err(|e| wrong(format!("{e}")))?;
                let (got, expected) = (topology.labels().len(), self.detections.len());
                if got != expected {
                    return Err(wrong(format!(
                        "got {got} labels, expected {expected}; write one for each detection"
                    )));
                }
                Ok(Start::At(topology))
            }
        }
    }

    /// The model that the settings choose, of these detections.
    ///
    /// # Errors
    /// The covariance model without covariances, or with one that is singular; corner kinds where none is known.
    pub fn model(&self, settings: &Settings) -> Result<Model, DataError> {
        let appearance = self.appearance(settings)?;
        let positions_m = self.detections.positions_m();
        let (sigma_o, sigma_t) = (settings.number("sigma_o"), settings.number("sigma_t"));
        let penalty = settings.penalty();
        if settings.text("model") != "covariance" {
            let model = MetricModel::new(&positions_m, sigma_o, sigma_t, penalty);
            let model = model.with_optimum(settings.optimum());
            return Ok(model.with_appearance(appearance).into());
        }
        let Some(covariances_m2) = self.detections.covariances_m2() else {
            return Err(DataError::Model(
                "got detections without covariances, expected the columns cov_xx,cov_xy,cov_yy for model \
                 covariance; add them, or use model metric"
                    .to_owned(),
            ));
        };
        CovarianceModel::new(&positions_m, &covariances_m2, sigma_o, sigma_t, penalty)
            .map(|model| model.with_appearance(appearance).into())
            .map_err(|error| DataError::Model(error.to_string()))
    }

    /// What the settings let the model see of how detections look.
    fn appearance(&self, settings: &Settings) -> Result<Appearance, DataError> {
        let kinds = settings.corner_kinds();
        let CornerKinds::Confusion(confusion) = kinds else {
            return Ok(Appearance::default());
        };
        let corners: Vec<_> = self.detections.iter().map(|row| row.corner).collect();
        if corners.iter().all(Option::is_none) {
            return Err(DataError::Model(format!(
                "got corner_kinds {kinds} and detections without any kind, expected the column corner (open or \
                 closed) where it is known; add it, or use corner_kinds off"
            )));
        }
        Ok(Appearance::default().with_corner_kinds(confusion, corners))
    }

    /// Hash of what a sampler sees under these settings: positions, covariances and, where they are evidence, the kinds of
    /// corners; never the truth.
    pub fn sampled_hash(&self, settings: &Settings) -> String {
        let mut hasher = Sha256::new();
        for detection in &self.detections {
            let covariance = detection.covariance_m2.map(|c| [c.xx, c.xy, c.yy]);
            for value in detection
                .position_m
                .into_iter()
                .chain(covariance.into_iter().flatten())
            {
                hasher.update((value + 0.0).to_bits().to_le_bytes());
            }
            hasher.update([u8::from(covariance.is_some())]);
            if settings.corner_kinds() != CornerKinds::Off {
                hasher.update(detection.corner.map_or("unknown", Corner::name));
            }
        }
        hex(&hasher.finalize()[..16])
    }

    /// Hash of the whole data set, truth included.
    pub fn content_hash(&self) -> String {
        hex(&self.detections.content_hash()[..16])
    }
}
