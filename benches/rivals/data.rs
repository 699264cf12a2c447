//! Recordings whose landmarks are known.

use std::fs;
use std::path::Path;

use topometric::import::{Choices, DriftNoise, Noise, Opened, SensorNoise};
use topometric::mission::Graph;
use topometric::partition::Topology;

/// One recording, or a window of one.
pub struct Case {
    pub graph: Graph,
    /// The true landmark of each sighting.
    pub truth: Vec<u32>,
    /// Where the robot was at each pose, m.
    pub true_path_m: Option<Vec<[f64; 2]>>,
}

/// A name and its cases: windows of one recording share a row.
pub type Group = (String, Vec<Case>);

/// A window, s.
const WINDOW_S: f64 = 120.0;
/// Windows of each robot.
const WINDOWS: usize = 6;

impl Case {
    fn new(mut graph: Graph, true_path_m: Option<Vec<[f64; 2]>>) -> Self {
        // What nobody knows cannot be scored.
        graph.observations.retain(|one| one.landmark.is_some());
        let ids = graph.observations.iter().map(|one| one.landmark.unwrap());
        let truth = Topology::canonical(&ids.collect::<Vec<_>>());
        Self {
            truth: truth.labels().to_vec(),
            graph,
            true_path_m,
        }
    }

    pub fn n_landmarks(&self) -> usize {
        self.truth.iter().max().map_or(0, |&most| most as usize + 1)
    }
}

/// All of a folder with this in their name.
pub fn groups(folder: &Path, part: &str) -> Vec<Group> {
    let mut groups = Vec::new();
    let graphs = fs::read_dir(folder.join("graphs"));
    let mut graphs: Vec<_> = graphs
        .into_iter()
        .flatten()
        .flatten()
        .map(|one| one.path())
        .collect();
    graphs.retain(|path| path.extension().is_some_and(|ending| ending == "g2o"));
    graphs.sort();
    for path in graphs {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !name.contains(part) {
            continue;
        }
        let truth = true_path_m(&path.with_file_name(format!("{name}_truth.csv")));
        for (factor, words) in [(1.0, ""), (1.5, ", noise × 1.5"), (0.7, ", noise × 0.7")] {
            let graph = read(&path, None, [f64::NEG_INFINITY, f64::INFINITY], factor);
            groups.push((
                format!("{name}{words}"),
                vec![Case::new(graph, truth.clone())],
            ));
        }
    }
    let mrclam = folder.join("mrclam_ds6");
    if mrclam.is_dir() && "MRCLAM".contains(part) {
        let mut cases = Vec::new();
        for robot in [1, 2] {
            for window in 0..WINDOWS {
                let from = WINDOW_S * window as f64;
                let graph = read(&mrclam, Some(robot), [from, from + WINDOW_S], 1.0);
                cases.push(Case::new(graph, None));
            }
        }
        groups.push(("MRCLAM, 12 windows".to_owned(), cases));
    }
    groups
}

fn read(path: &Path, robot: Option<u32>, [from, until]: [f64; 2], factor: f64) -> Graph {
    let opened = Opened::new(path, None, |_| {}).unwrap();
    let format = opened.format();
    let mut recording = opened.read(Choices { robot, truth: None }).unwrap();
    recording.keep_window(from, until);
    let preset = |key: &str| format.preset(key).unwrap_or(0.0);
    let [turn, bend] = format.turn_and_bend();
    let noise = Noise {
        sensor: SensorNoise {
            range_m: preset("range_noise"),
            range_growth: preset("range_noise_growth"),
            bearing_rad: preset("bearing_noise"),
        },
        drift: DriftNoise {
            position: preset("odometry_noise"),
            heading: preset("heading_noise"),
            turn,
            bend,
        },
        factor,
    };
    Graph::of_recording(&recording, &noise).unwrap()
}

fn true_path_m(path: &Path) -> Option<Vec<[f64; 2]>> {
    let text = fs::read_to_string(path).ok()?;
    let rows = text.lines().skip(1).map(|line| {
        let mut numbers = line.split(',').map(|word| word.trim().parse().unwrap());
        [numbers.next().unwrap(), numbers.next().unwrap()]
    });
    Some(rows.collect())
}
