//! `ptm solve`: a whole mission into a graph.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::diagnostics::agreement::adjusted_rand_index;
use crate::import::Recording;
use crate::map::{MapFormat, Node, PosteriorMap};
use crate::mission::{Graph, Solution, SolveSettings, Stage, g2o, sightings_csv, solve, tum};
use crate::partition::Topology;
use clap::Args;
use serde_json::json;

use super::numbers::count;
use super::progress::Stages;
use super::recording::RecordingFlags;
use super::settings::SOLVING;
use super::{
    Arguments, Exit, Failure, check_outputs, make_folder, say_notes, write_json, write_output,
};

/// Arguments of `ptm solve`.
#[derive(Debug, Args)]
#[command(after_help = "\
The folder then holds graph.g2o (poses, landmarks, odometry and sightings, for g2o, GTSAM and ptm),
trajectory.tum (for evo), sightings.csv (a landmark and its probability for each sighting), \
map.graphml, map.geojson, map.dot, map.g2o and summary.json. docs/solve.md says what is computed, \
how well it does, and when sweeps are the better choice.")]
pub struct SolveCommand {
    #[command(flatten)]
    recording: RecordingFlags<SOLVING>,
    /// The folder for the results.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Draws of the posterior for the probabilities; 0 for none.
    #[arg(long, value_name = "N", value_parser = count::<usize>(0, 1_000_000), default_value_t = 20)]
    sweeps: usize,
}

/// The files in the folder, beside the maps.
const GRAPH: &str = "graph.g2o";
const TRAJECTORY: &str = "trajectory.tum";
const SIGHTINGS: &str = "sightings.csv";
const SUMMARY: &str = "summary.json";

/// Runs it.
pub fn run(command: &SolveCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let flags = &command.recording;
    let opened = flags.open(arguments)?;
    let format = opened.format();
    flags.check(format)?;
    let settings = flags.settings(format)?;
    make_folder(&command.out)?;
    let file = |name: &str| command.out.join(name);
    let names = [GRAPH, TRAJECTORY, SIGHTINGS, SUMMARY].map(str::to_owned);
    let maps = MapFormat::ALL.map(|format| format!("map.{}", format.extension()));
    let outputs: Vec<PathBuf> = names.iter().chain(&maps).map(|name| file(name)).collect();
    check_outputs(Some(&flags.path), &outputs.iter().collect::<Vec<_>>())?;

    let mut recording = flags.read(opened, None)?;
    flags.thin(&mut recording, &settings);
    say_notes(&recording.notes, &flags.path, arguments);
    let refused = |error| Failure::data(format!("{}: {error}", flags.path.display()));
    let graph = Graph::of_recording(&recording, &flags.noise(format, &settings));
    let graph = graph.map_err(refused)?;
    let started = Instant::now();
    let stages = Stages::new(arguments.quiet);
    let n_poses = graph.times_s.len();
    let watch = |stage: Stage| {
        stages.say(match stage {
            Stage::Poses(n) => format!("pose {n} of {n_poses}"),
            Stage::Improving => "improving the map".to_owned(),
            Stage::Sweeps(n) => format!("sweep {n} of {}", command.sweeps),
        });
    };
    let wanted = SolveSettings {
        seed: settings.count("seed"),
        sweeps: command.sweeps,
    };
    let solution = solve(&graph, wanted, &watch).map_err(refused)?;
    drop(stages);
    let seconds = started.elapsed().as_secs_f64();

    write_output(&file(GRAPH), g2o(&graph, &solution).as_bytes())?;
    write_output(&file(TRAJECTORY), tum(&graph, &solution).as_bytes())?;
    write_output(
        &file(SIGHTINGS),
        sightings_csv(&graph, &solution).as_bytes(),
    )?;
    let map = map(&graph, &solution);
    let name = flags.path.file_name().unwrap_or_default().to_string_lossy();
    for (format, file_name) in MapFormat::ALL.iter().zip(&maps) {
        write_output(&file(file_name), format.text(&map, &name).as_bytes())?;
    }
    let told = Told::new(&recording, &graph, &solution, seconds);
    write_json(&file(SUMMARY), &told.json(&flags.path, wanted))?;
    if !arguments.quiet {
        told.print(&command.out);
    }
    Ok(Exit::Done)
}

/// The topometric map of a solution.
fn map(graph: &Graph, solution: &Solution) -> PosteriorMap {
    let topology = Topology::canonical(&solution.labels);
    let sets = topology.sets();
    let node = |(landmark, members): (_, &Vec<u32>)| {
        let landmark: &crate::mission::SolvedLandmark = landmark;
        Node {
            position_m: landmark.position_m,
            covariance_m2: landmark.covariance_m2,
            members: members.iter().map(|&s| s as usize).collect(),
            probability: landmark.probability,
        }
    };
    let nodes = solution.landmarks.iter().zip(&sets).map(node).collect();
    let draws: Vec<(&Topology, u64)> = solution.draws.iter().map(|draw| (draw, 1)).collect();
    PosteriorMap::of_nodes(nodes, &topology, &solution.sighted_m(graph), &draws)
}

/// What is said of a solution.
struct Told<'a> {
    solution: &'a Solution,
    n_poses: usize,
    seconds: f64,
    /// Landmarks that the recording names among the sightings, and the agreement with them.
    truth: Option<(usize, Option<f64>)>,
}

impl<'a> Told<'a> {
    fn new(recording: &Recording, graph: &Graph, solution: &'a Solution, seconds: f64) -> Self {
        let named = recording.stops.iter().flat_map(|stop| &stop.seen);
        let is_named = named.filter(|seen| seen.landmark.is_some()).count() > 0;
        Self {
            solution,
            n_poses: graph.times_s.len(),
            seconds,
            truth: is_named.then(|| agreement(graph, solution)),
        }
    }

    fn json(&self, path: &Path, settings: SolveSettings) -> serde_json::Value {
        let solution = self.solution;
        let (n_true, agreement) = self.truth.unzip();
        json!({
            "recording": path.display().to_string(),
            "seed": settings.seed,
            "sweeps": settings.sweeps,
            "poses": self.n_poses,
            "sightings": solution.labels.len(),
            "duplicates": solution.n_duplicates,
            "landmarks": solution.landmarks.len(),
            "ln_posterior": solution.ln_posterior,
            "chi_square": solution.chi_square,
            "degrees_of_freedom": solution.degrees_of_freedom,
            "front": if solution.is_deferred { "deferring" } else { "eager" },
            "recorded_landmarks": n_true,
            "adjusted_rand_index": agreement.flatten(),
            "seconds": self.seconds,
        })
    }

    fn print(&self, folder: &Path) {
        let solution = self.solution;
        let n = solution.labels.len();
        outln!("poses       {}", self.n_poses);
        match solution.n_duplicates {
            0 => outln!("sightings   {n}"),
            fused => outln!("sightings   {n}, {fused} of them fused with another of their scan"),
        }
        outln!("landmarks   {}", solution.landmarks.len());
        let sure = solution.probabilities.iter().filter(|p| **p >= 0.99);
        outln!(
            "sure        {} sightings with probability 0.99 or more",
            sure.count()
        );
        outln!("posterior   ln {:.2}", solution.ln_posterior);
        let dof = solution.degrees_of_freedom;
        outln!(
            "fit         χ² {:.1} at {dof} degrees of freedom",
            solution.chi_square
        );
        if let Some((n_true, agreement)) = self.truth {
            let agreement =
                agreement.map_or_else(String::new, |ari| format!(", adjusted Rand index {ari:.4}"));
            outln!("recorded    {n_true} landmarks{agreement}");
        }
        outln!("time        {:.1} s", self.seconds);
        outln!("results     {}", folder.display());
    }
}

/// The number of landmarks that the recording names, and the adjusted Rand index of the sightings
/// that it names.
fn agreement(graph: &Graph, solution: &Solution) -> (usize, Option<f64>) {
    let named = graph.observations.iter().zip(&solution.labels);
    let named = named.filter_map(|(one, label)| Some((one.landmark?, *label)));
    let (recorded, found): (Vec<i64>, Vec<u32>) = named.unzip();
    let counts: BTreeMap<i64, ()> = recorded.iter().map(|id| (*id, ())).collect();
    let [recorded, found] = [Topology::canonical(&recorded), Topology::canonical(&found)];
    (counts.len(), adjusted_rand_index(&recorded, &found))
}
