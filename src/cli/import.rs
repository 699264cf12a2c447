//! `ptm import`: a recording into detections.

use std::path::PathBuf;

use crate::dataset::{DataError, DataSet};
use crate::evidence::{AlignError, Alignment, align};
use crate::import::{Format, Noise, Recording, Stated, dead_reckon, information_doubt};
use crate::input::{Note, quoted};
use crate::mission::{Graph, SolveSettings, Stage, solve};
use crate::report;
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::sighting::{FrameDrift, Sighting};
use crate::tracker::{Tracked, TrackerError, TrackerSettings, track_in_full};
use crate::tune::scales::Scales;
use clap::{Args, ValueEnum};

use super::import_words::{print_alignment, print_errors, print_scales};
use super::numbers::count;
use super::progress::Stages;
use super::recording::{RecordingFlags, refuse};
use super::settings::TRACKING;
use super::solve::words_of;
use super::{Arguments, Exit, Failure, check_outputs, map_beside, write_output};

/// Arguments of `ptm import`.
#[derive(Debug, Args)]
#[command(after_help = "\
docs/import.md leads from a downloaded folder to detections, format by format, and says what the \
covariances assume.")]
pub struct ImportCommand {
    #[command(flatten)]
    recording: RecordingFlags<TRACKING>,
    /// The truth of a range-bearing CSV, the same rows with gt_x,gt_y,gt_theta,lm_x,lm_y: to check the
    /// covariances against, and for nothing else.
    #[arg(long, value_name = "CSV")]
    truth: Option<PathBuf>,
    /// Where the detections go.
    #[arg(short, long, value_name = "CSV", default_value = "detections.csv")]
    out: PathBuf,
    /// Where the map goes [default: beside the detections, as PNG; none if
    /// they go to a device or a FIFO].
    #[arg(long, value_name = "PNG")]
    map: Option<PathBuf>,
    /// Write the sightings too, where each was believed to be (t,x,y), the detection that it became part of (its row,
    /// from 0; empty if none) and the landmark.
    #[arg(long, value_name = "CSV")]
    sightings: Option<PathBuf>,
    /// The frame of a detection's covariance: that of the `start`, so that it holds all drift until
    /// the landmark was seen, or that in which it was `seen`, as simulated worlds have it.
    #[arg(long, value_name = "FRAME", default_value = "start")]
    covariance: Frame,
    /// Move detections to where they would be if the frame had not drifted, as far as landmarks that came into view
    /// again tell; =SEED for other random numbers than those of 1.
    #[arg(long, value_name = "SEED", value_parser = count::<u64>(0, u64::MAX), num_args = 0..=1, require_equals = true, default_missing_value = "1")]
    align: Option<u64>,
    /// Put sightings where they lie from the poses that `ptm solve` finds, before they become
    /// detections; =SEED for other random numbers than those of 1. Covariances then hold the errors of
    /// sightings, and none of the poses.
    #[arg(long, value_name = "SEED", value_parser = count::<u64>(0, u64::MAX), num_args = 0..=1, require_equals = true, default_missing_value = "1", conflicts_with = "align")]
    solve: Option<u64>,
}

/// Aligning so many detections takes so long that it is said before.
const LONG: usize = 200;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Frame {
    /// Of the start.
    Start,
    /// Of the last sighting.
    Seen,
}

/// Runs it.
pub fn run(command: &ImportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let opened = command.recording.open(arguments)?;
    let format = opened.format();
    command.check(format)?;
    let settings = command.recording.settings(format)?;
    let map = map_beside(command.map.as_ref(), &command.out);
    let outputs: Vec<&PathBuf> = std::iter::once(&command.out)
        .chain(&map)
        .chain(&command.sightings)
        .collect();
    check_outputs(Some(&command.recording.path), &outputs)?;

    let mut recording = command.recording.read(opened, command.truth.as_deref())?;
    let n_read = recording.n_seen();
    command.recording.thin(&mut recording, &settings);
    let tracker = TrackerSettings {
        since_start: command.covariance == Frame::Start,
        ..settings.simulation().tracker()
    };
    let noise = command.recording.noise(format, &settings);
    let reckoned = dead_reckon(&recording, &noise);
    let sightings = match command.solve {
        Some(seed) => command.solved(&recording, &noise, reckoned, seed, arguments)?,
        None => reckoned,
    };
    let tracked = track_in_full(&sightings, &tracker).map_err(|error| match error {
        TrackerError::NothingKept {
            min_sightings,
            n_sightings,
        } => nothing_kept(min_sightings, n_sightings, &recording.notes),
        _ => Failure::data(error.to_string()),
    })?;
    let n = tracked.detections.len();
    if command.align.is_some() && n > LONG && !arguments.quiet {
        errln!(
            "aligning {n} detections, which takes from half a minute up; windows of time are faster"
        );
    }
    let alignment = command.align.map(|seed| aligned(&tracked, seed));
    let alignment = alignment.transpose()?;
    let detections = match &alignment {
        Some(alignment) => alignment.detections.clone(),
        None => tracked.detections.clone(),
    };
    let names = &recording.landmark_names;
    let detections = detections
        .with_landmark_names(names)
        .map_err(DataError::from)?;
    write_output(&command.out, detections.to_csv_string().as_bytes())?;
    if let Some(path) = &command.sightings {
        let text = sightings_csv(&sightings, &tracked.detection_of, names);
        write_output(path, text.as_bytes())?;
    }
    let name = command.recording.path.file_name().unwrap_or_default();
    let data = DataSet::new(detections, None);
    let png = report::simulation_figure(&data, name.to_string_lossy().into_owned());
    if let Some(map) = &map {
        write_output(map, &png)?;
    }
    if !arguments.quiet {
        outln!(
            "{} of {n_read} sightings, {} detections",
            sightings.len(),
            data.detections.len()
        );
        for note in &recording.notes {
            outln!("noted: {note}");
        }
        let drift = sightings.last().and_then(|sighting| sighting.drift);
        if let Some(drift) = drift {
            outln!(
                "heading against the start: known to {:.2} rad at the end",
                drift.heading_std_rad()
            );
        }
        let scales = Scales::of(&data.detections);
        let stated = Stated {
            heading_std_rad: drift.map_or(0.0, FrameDrift::heading_std_rad),
            precision_m: scales.precision_m.unwrap_or(0.0),
            extent_m: scales.extent_m,
        };
        if let Some(doubt) = information_doubt(&recording, &stated) {
            outln!("DOUBT: {doubt}");
        }
        if let Some(alignment) = &alignment {
            outln!("before alignment:");
            print_errors(&recording, &tracked.detections);
            print_alignment(alignment);
        }
        print_scales(&scales);
        print_errors(&recording, &data.detections);
        outln!("detections: {}", command.out.display());
        if let Some(map) = &map {
            outln!("map: {}", map.display());
        }
        if let Some(path) = &command.sightings {
            outln!("sightings: {}", path.display());
        }
    }
    Ok(Exit::Done)
}

impl ImportCommand {
    /// Sightings from the poses of the most probable map.
    fn solved(
        &self,
        recording: &Recording,
        noise: &Noise,
        mut sightings: Vec<Sighting>,
        seed: u64,
        arguments: &Arguments,
    ) -> Result<Vec<Sighting>, Failure> {
        let name = self.recording.path.display();
        let refused = |error| Failure::data(format!("{name}: --solve: {error}"));
        let graph = Graph::of_recording(recording, noise).map_err(refused)?;
        let wanted = SolveSettings {
            sweeps: 0,
            ..SolveSettings::with_seed(seed)
        };
        let stages = Stages::new(arguments.quiet);
        let n_poses = graph.times_s.len();
        let watch = |stage: Stage| stages.say(words_of(stage, n_poses, 0));
        let solution = solve(&graph, wanted, &watch).map_err(refused)?;
        // Both are in the order of the recording.
        for (sighting, one) in sightings.iter_mut().zip(&graph.observations) {
            sighting.believed_pose = solution.map.poses[one.pose];
            sighting.drift = Some(FrameDrift::NONE);
        }
        Ok(sightings)
    }

    /// Refuses what does not go together, before anything is read.
    fn check(&self, format: Format) -> Result<(), Failure> {
        self.recording.check(format)?;
        if let Some(truth) = self
            .truth
            .as_ref()
            .filter(|_| format != Format::RangeBearing)
        {
            let name = format.name();
            let expected = format!("no such flag for {name}; it goes with a range-bearing CSV");
            return refuse("truth", &truth.display(), &expected);
        }
        if self.align.is_some() && self.covariance == Frame::Seen {
            let expected =
                "start beside --align, which tells drift from what the covariances hold of it";
            return refuse("covariance", &"seen", expected);
        }
        Ok(())
    }
}

/// Why no group was kept: the numbers of the command line, unless those of the file are in doubt.
fn nothing_kept(min_sightings: usize, n_sightings: usize, notes: &[Note]) -> Failure {
    let got = format!(
        "tracker: got no group of at least {min_sightings} sightings out of {n_sightings}, expected \
         at least one"
    );
    let change = if n_sightings == 0 {
        "give another span of time (--from, --until), or raise --max-range"
    } else {
        "lower --min-sightings, or raise --group-timeout-s or --max-range"
    };
    match notes.iter().find(|note| note.what.ends_with('?')) {
        Some(note) => Failure::data(format!("{got}; {note} If not, {change}")),
        None => Failure::usage(format!("{got}; {change}")),
    }
}

fn sightings_csv(
    sightings: &[Sighting],
    detection_of: &[Option<usize>],
    names: &[String],
) -> String {
    let mut text = String::from("t,x,y,detection,landmark\n");
    for (sighting, detection) in sightings.iter().zip(detection_of) {
        let [x, y] = sighting.point_m();
        let detection = detection.map_or_else(String::new, |ix| ix.to_string());
        let landmark =
            sighting
                .landmark
                .map_or_else(String::new, |id| match names.get(id as usize) {
                    Some(name) => quoted(name),
                    None => id.to_string(),
                });
        text += &format!("{},{x},{y},{detection},{landmark}\n", sighting.time_s);
    }
    text
}

fn aligned(tracked: &Tracked, seed: u64) -> Result<Alignment, Failure> {
    let drifts = tracked.drifts.as_ref();
    let drifts = drifts.expect("dead reckoning keeps account of the drift");
    let purpose = Purpose::new(SAMPLER_SEMANTICS, seed).text("use", "align");
    align(&tracked.detections, drifts, &purpose).map_err(|error| match error {
        AlignError::TooFew(_) | AlignError::OnePlace(_) => {
            Failure::usage(format!("--align: {error}"))
        }
        _ => Failure::data(format!("--align: {error}")),
    })
}
