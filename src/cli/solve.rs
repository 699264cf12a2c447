//! `ptm solve`: a whole mission into a graph.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::diagnostics::agreement::adjusted_rand_index;
use crate::import::Recording;
use crate::map::{MapFormat, Node, PosteriorMap};
use crate::mission::{
    Graph, Misfit, Solution, SolveSettings, SolvedMap, Stage, g2o, sightings_csv, solve, tum,
};
use crate::partition::Topology;
use crate::report;
use clap::Args;
use serde_json::json;

use super::numbers::count;
use super::online::{self, Followed};
use super::progress::Stages;
use super::recording::RecordingFlags;
use super::settings::SOLVING;
use super::{
    Arguments, Exit, Failure, check_outputs, make_folder, say_notes, write_json, write_output,
};

/// Arguments of `ptm solve`.
#[derive(Debug, Args)]
#[command(after_help = "\
The folder then holds index.html (the answer, with its picture), graph.g2o (poses, landmarks, odometry and \
sightings, for g2o, GTSAM and ptm), trajectory.tum (for evo), sightings.csv (a landmark and its probability \
for each sighting), map.png, .svg, .graphml, .geojson, .dot and .g2o, summary.json, and, where the search came \
to other maps that count, alternatives/1, 2, … with the same three files of each. docs/solve.md says what is \
computed, how well it does, and when sweeps are the better choice.")]
pub struct SolveCommand {
    #[command(flatten)]
    recording: RecordingFlags<SOLVING>,
    /// The folder for the results.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Draws of the posterior for the probabilities; 0 for none.
    #[arg(long, value_name = "N", value_parser = count::<usize>(0, 1_000_000), default_value_t = 20)]
    sweeps: usize,
    /// Take the noise as it is stated, and do not calibrate it on the first poses.
    #[arg(long)]
    stated_noise: bool,
    /// How often each first map is improved, with other random numbers every time. More find better
    /// maps, and more alternatives.
    #[arg(long, value_name = "N", value_parser = count::<usize>(1, 1_000), default_value_t = 1)]
    starts: usize,
    /// Also go through the recording as a robot would, pose by pose, and say how fast that is and how
    /// far its answer agrees.
    #[arg(long)]
    online: bool,
}

/// The files in the folder, beside the maps.
const PAGE: &str = "index.html";
const PICTURES: [&str; 2] = ["map.png", "map.svg"];
const ALTERNATIVES: &str = "alternatives";
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
    let names = [PAGE, GRAPH, TRAJECTORY, SIGHTINGS, SUMMARY].map(str::to_owned);
    let maps = MapFormat::ALL.map(|format| format!("map.{}", format.extension()));
    let pictures = PICTURES.map(str::to_owned);
    let outputs = names.iter().chain(&maps).chain(&pictures);
    let outputs: Vec<PathBuf> = outputs.map(|name| file(name)).collect();
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
    let watch = |stage: Stage| stages.say(words_of(stage, n_poses, command.sweeps));
    let wanted = SolveSettings {
        seed: settings.count("seed"),
        sweeps: command.sweeps,
        is_calibrated: !command.stated_noise,
        starts: command.starts,
    };
    let solution = solve(&graph, wanted, &watch).map_err(refused)?;
    let graph = graph.with_noise(solution.noise);
    drop(stages);
    let seconds = started.elapsed().as_secs_f64();

    // Without draws every probability would be 1.
    let are_known = !solution.draws.is_empty();
    let probabilities = are_known.then_some(&solution.probabilities[..]);
    write_map(&command.out, &graph, &solution.map, probabilities)?;
    for (place, other) in solution.alternatives.iter().enumerate() {
        let folder = command.out.join(ALTERNATIVES).join((place + 1).to_string());
        make_folder(&folder)?;
        write_map(&folder, &graph, other, None)?;
    }
    remove_alternatives_from(&command.out, solution.alternatives.len() + 1);
    let map = map(&graph, &solution);
    let name = flags.path.file_name().unwrap_or_default().to_string_lossy();
    for (format, file_name) in MapFormat::ALL.iter().zip(&maps) {
        write_output(&file(file_name), format.text(&map, &name).as_bytes())?;
    }
    let title = format!("{name}, solved");
    let picture = report::mission_figure(&graph, &solution, title.clone());
    let [png, svg] = PICTURES;
    write_output(&file(png), &picture.png())?;
    write_output(&file(svg), picture.svg(&title).as_bytes())?;
    let page = report::mission_page(&graph, &solution, &title);
    write_output(&file(PAGE), page.as_bytes())?;
    let online = command
        .online
        .then(|| online::follow(&graph, &solution.map));
    let online = online.transpose().map_err(refused)?;
    let told = Told::new(&recording, &graph, &solution, seconds);
    write_json(
        &file(SUMMARY),
        &told.json(&flags.path, wanted, online.as_ref()),
    )?;
    if !arguments.quiet {
        told.print(&command.out, online.as_ref());
    }
    Ok(Exit::Done)
}

/// How far solving has come.
pub fn words_of(stage: Stage, n_poses: usize, n_sweeps: usize) -> String {
    match stage {
        Stage::Calibrating => "calibrating the noise".to_owned(),
        Stage::Poses(n) => format!("pose {n} of {n_poses}"),
        Stage::Improving => "improving the map".to_owned(),
        Stage::Sweeps(n) => format!("sweep {n} of {n_sweeps}"),
    }
}

/// Takes away alternatives of an earlier solution that had more of them, from number `first` on.
fn remove_alternatives_from(folder: &Path, first: usize) {
    for number in first.. {
        let folder = folder.join(ALTERNATIVES).join(number.to_string());
        if !folder.is_dir() {
            break;
        }
        for name in [GRAPH, TRAJECTORY, SIGHTINGS] {
            let _ = std::fs::remove_file(folder.join(name));
        }
        // Stays if there is something else in it.
        let _ = std::fs::remove_dir(&folder);
    }
    let _ = std::fs::remove_dir(folder.join(ALTERNATIVES));
}

/// The files of one map.
fn write_map(
    folder: &Path,
    graph: &Graph,
    map: &SolvedMap,
    probabilities: Option<&[f64]>,
) -> Result<(), Failure> {
    let text = sightings_csv(graph, map, probabilities);
    write_output(&folder.join(GRAPH), g2o(graph, map).as_bytes())?;
    write_output(&folder.join(TRAJECTORY), tum(graph, map).as_bytes())?;
    write_output(&folder.join(SIGHTINGS), text.as_bytes())
}

/// The topometric map of a solution.
fn map(graph: &Graph, solution: &Solution) -> PosteriorMap {
    let topology = Topology::canonical(&solution.map.labels);
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
    PosteriorMap::of_nodes(nodes, &topology, &solution.map.sighted_m(graph), &draws)
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

    fn json(
        &self,
        path: &Path,
        settings: SolveSettings,
        online: Option<&Followed>,
    ) -> serde_json::Value {
        let solution = self.solution;
        let (n_true, agreement) = self.truth.unzip();
        let (noise, fit) = (solution.noise, &solution.fit);
        let misfits = fit.worst.iter().map(|misfit| {
            let deviations = misfit.square().sqrt();
            match *misfit {
                Misfit::Odometry(k, _) => {
                    json!({"odometry_from": k, "standard_deviations": deviations})
                }
                Misfit::Sighting(s, _) => json!({"sighting": s, "standard_deviations": deviations}),
            }
        });
        let alternatives = solution.alternatives.iter().map(|map| {
            json!({
                "ln_posterior": map.ln_posterior,
                "weight": map.weight,
                "landmarks": map.landmarks_m.len(),
            })
        });
        json!({
            "recording": path.display().to_string(),
            "seed": settings.seed,
            "sweeps": settings.sweeps,
            "starts": settings.starts,
            "poses": self.n_poses,
            "sightings": solution.map.labels.len(),
            "duplicates": solution.n_duplicates,
            "landmarks": solution.landmarks.len(),
            "ln_posterior": solution.map.ln_posterior,
            "weight": solution.map.weight,
            "alternatives": alternatives.collect::<Vec<_>>(),
            "noise_factors": {
                "range": noise.range,
                "bearing": noise.bearing,
                "odometry_place": noise.place,
                "odometry_heading": noise.heading,
            },
            "chi_square": fit.chi_square,
            "degrees_of_freedom": fit.degrees_of_freedom,
            "chi_square_score": fit.score(),
            "fit": fit.verdict(),
            "correlation_of_neighbouring_errors": fit.correlation,
            "misfits": misfits.collect::<Vec<_>>(),
            "front": if solution.is_deferred { "deferring" } else { "eager" },
            "recorded_landmarks": n_true,
            "adjusted_rand_index": agreement.flatten(),
            "online": online.map(Followed::json),
            "seconds": self.seconds,
        })
    }

    fn print(&self, folder: &Path, online: Option<&Followed>) {
        let solution = self.solution;
        let n = solution.map.labels.len();
        outln!("poses       {}", self.n_poses);
        match solution.n_duplicates {
            0 => outln!("sightings   {n}"),
            fused => outln!("sightings   {n}, {fused} of them fused with another of their scan"),
        }
        outln!("landmarks   {}", solution.landmarks.len());
        if !solution.draws.is_empty() {
            let sure = solution.probabilities.iter().filter(|p| **p >= 0.99);
            outln!(
                "sure        {} sightings with probability 0.99 or more",
                sure.count()
            );
        }
        outln!("posterior   ln {:.2}", solution.map.ln_posterior);
        if let Some(second) = solution.alternatives.first() {
            outln!(
                "other maps  {}, the next best with {:.1} % of the weight: {ALTERNATIVES}/1",
                solution.alternatives.len(),
                100.0 * second.weight
            );
        }
        outln!("noise       {}", report::noise_words(solution.noise));
        outln!("fit         {}", report::fit_words(solution));
        if let Some((n_true, agreement)) = self.truth {
            let agreement =
                agreement.map_or_else(String::new, |ari| format!(", adjusted Rand index {ari:.4}"));
            outln!("recorded    {n_true} landmarks{agreement}");
        }
        outln!("time        {:.1} s", self.seconds);
        if let Some(online) = online {
            outln!("online      {}", online.words());
        }
        outln!("results     {}", folder.join(PAGE).display());
    }
}

/// The number of landmarks that the recording names, and the adjusted Rand index of the sightings
/// that it names.
fn agreement(graph: &Graph, solution: &Solution) -> (usize, Option<f64>) {
    let named = graph.observations.iter().zip(&solution.map.labels);
    let named = named.filter_map(|(one, label)| Some((one.landmark?, *label)));
    let (recorded, found): (Vec<i64>, Vec<u32>) = named.unzip();
    let counts: BTreeMap<i64, ()> = recorded.iter().map(|id| (*id, ())).collect();
    let [recorded, found] = [Topology::canonical(&recorded), Topology::canonical(&found)];
    (counts.len(), adjusted_rand_index(&recorded, &found))
}
