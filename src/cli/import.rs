//! `ptm import`: a recording into detections.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use topometric::dataset::DataSet;
use topometric::detections::Detections;
use topometric::diagnostics::consistency::{
    Nees, differences_between_visits, errors_against, nees,
};
use topometric::evidence::{AlignError, Alignment, align};
use topometric::import::{
    DriftNoise, Format, Noise, PRESET_KEYS, Recording, SensorNoise, dead_reckon, read_g2o,
    read_mrclam, read_range_bearing, read_truth,
};
use topometric::report;
use topometric::rng::{Purpose, SAMPLER_SEMANTICS};
use topometric::settings::Settings;
use topometric::sighting::Sighting;
use topometric::tracker::{Tracked, TrackerError, TrackerSettings, track_in_full};
use topometric::tune::scales::Scales;

use super::settings::{SettingsFlags, TRACKING};
use super::{Arguments, Exit, Failure, check_outputs, map_beside, write_output};

/// Arguments of `ptm import`.
#[derive(Debug, Args)]
#[command(after_help = "\
docs/import.md leads from a downloaded folder to detections, format by format, and says what the \
covariances assume.")]
pub struct ImportCommand {
    /// A folder of UTIAS MRCLAM, a g2o file with EDGE_SE2_XY, or a range-bearing CSV with
    /// t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id (-1 = clutter); gzip too.
    path: PathBuf,
    /// The format [default: told from the path].
    #[arg(long, value_name = "FORMAT")]
    format: Option<FormatName>,
    /// Which robot of an MRCLAM folder [default: the only one].
    #[arg(long, value_name = "N")]
    robot: Option<u32>,
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
    /// Leave out what was before this time, s; dead reckoning starts here. MRCLAM counts from the
    /// robot's first odometry, g2o counts poses from 0.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Leave out what was from this time on, s.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    until: Option<f64>,
    /// Take every N-th scan only; the odometry stays whole.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// What a detection's covariance is against: where the landmark is in the frame of the `start`, with
    /// all drift until it was seen, or in the frame in which it was `seen`, as simulated worlds have it.
    #[arg(long, value_name = "FRAME", default_value = "start")]
    covariance: Frame,
    /// Move detections to where they would be if the frame had not drifted, as far as landmarks that came into view
    /// again tell; =SEED for other random numbers than those of 1.
    #[arg(long, value_name = "SEED", num_args = 0..=1, require_equals = true, default_missing_value = "1")]
    align: Option<u64>,
    /// Random walk of the heading by turning, rad/√rad [default: mrclam 0.1, range-bearing 0].
    #[arg(long, value_name = "NOISE", allow_negative_numbers = true)]
    turn_noise: Option<f64>,
    /// Standard deviation of a bend of the whole path that the odometry does not know of, rad/m
    /// [default: mrclam 0.05, range-bearing 0].
    #[arg(long, value_name = "NOISE", allow_negative_numbers = true)]
    bend_noise: Option<f64>,
    /// Leave out sightings further away than --max-range, and state the sensor's noise: the flags of
    /// simulated worlds that describe the sensor and the tracker.
    #[command(flatten)]
    settings: SettingsFlags<TRACKING>,
}

/// Aligning so many detections takes so long that it is said before.
const LONG: usize = 200;

/// Formats as the command line names them.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatName {
    /// A folder of UTIAS MRCLAM.
    Mrclam,
    /// A g2o file with landmarks in the plane.
    G2o,
    /// The plain range-bearing CSV.
    RangeBearing,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Frame {
    /// Of the start.
    Start,
    /// Of the last sighting.
    Seen,
}

/// Runs it.
pub fn run(command: &ImportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let format = match command.format {
        Some(FormatName::Mrclam) => Format::Mrclam,
        Some(FormatName::G2o) => Format::G2o,
        Some(FormatName::RangeBearing) => Format::RangeBearing,
        None => Format::of(&command.path)?,
    };
    command.check(format)?;
    let settings = command.settings(format)?;
    let map = map_beside(command.map.as_ref(), &command.out);
    let outputs: Vec<&PathBuf> = std::iter::once(&command.out)
        .chain(&map)
        .chain(&command.sightings)
        .collect();
    check_outputs(Some(&command.path), &outputs)?;

    let mut recording = command.read(format)?;
    let n_read = recording.n_seen();
    recording.keep_window(
        command.from.unwrap_or(f64::NEG_INFINITY),
        command.until.unwrap_or(f64::INFINITY),
    );
    recording.thin(command.every, settings.simulation().max_range);
    let tracker = TrackerSettings {
        since_start: command.covariance == Frame::Start,
        ..settings.simulation().tracker()
    };
    let sightings = dead_reckon(&recording, &command.noise(format, &settings));
    let tracked = track_in_full(&sightings, &tracker).map_err(|error| match error {
        TrackerError::NothingKept { .. } => Failure::usage(error.to_string()),
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
    write_output(&command.out, detections.to_csv_string().as_bytes())?;
    if let Some(path) = &command.sightings {
        let text = sightings_csv(&sightings, &tracked.detection_of);
        write_output(path, text.as_bytes())?;
    }
    let name = command.path.file_name().unwrap_or_default();
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
            outln!("noted: {} {}", note.count, note.what);
        }
        if let Some(drift) = sightings.last().and_then(|sighting| sighting.drift) {
            outln!(
                "heading against the start: known to {:.2} rad at the end",
                drift.heading_std_rad()
            );
        }
        if let Some(alignment) = &alignment {
            outln!("as the frame stands:");
            print_errors(&recording, &tracked.detections);
            print_alignment(alignment);
        }
        print_scales(&data.detections);
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
    /// Refuses what does not go together, before anything is read.
    fn check(&self, format: Format) -> Result<(), Failure> {
        let refuse = |flag: &str, got: &dyn std::fmt::Display, expected: &str| {
            Err(Failure::usage(format!(
                "--{flag}: got {got}, expected {expected}"
            )))
        };
        let name = format.name();
        if let Some(robot) = self.robot.filter(|_| format != Format::Mrclam) {
            let expected = format!("no such flag for {name}; only MRCLAM folders have robots");
            return refuse("robot", &robot, &expected);
        }
        if let Some(truth) = self
            .truth
            .as_ref()
            .filter(|_| format != Format::RangeBearing)
        {
            let expected = format!("no such flag for {name}; it goes with a range-bearing CSV");
            return refuse("truth", &truth.display(), &expected);
        }
        if self.every == 0 {
            return refuse("every", &0, "a whole number from 1 on");
        }
        if self.align.is_some() && self.covariance == Frame::Seen {
            let expected =
                "start beside --align, which tells drift from what the covariances hold of it";
            return refuse("covariance", &"seen", expected);
        }
        for (flag, value) in [("from", self.from), ("until", self.until)] {
            if let Some(value) = value.filter(|value| value.is_nan()) {
                return refuse(flag, &value, "a number of seconds");
            }
        }
        if let (Some(from), Some(until)) = (self.from, self.until)
            && from >= until
        {
            let expected = format!("a time after --from ({from})");
            return refuse("until", &until, &expected);
        }
        let noises = [
            ("turn-noise", self.turn_noise),
            ("bend-noise", self.bend_noise),
        ];
        for (flag, value) in noises {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= 0.0)) {
                return refuse(flag, &value, "a finite number, 0 or above");
            }
        }
        if format == Format::G2o {
            let stated = PRESET_KEYS
                .iter()
                .filter(|key| format.preset(key).is_none());
            let given = stated.filter(|key| self.settings.is_given(key));
            let given = given.map(|key| key.replace('_', "-"));
            let noises = noises.iter().filter(|(_, value)| value.is_some());
            let given = given.chain(noises.map(|(flag, _)| (*flag).to_owned()));
            if let Some(flag) = given.into_iter().next() {
                let expected = "no such flag for g2o, which states its noise; --noise scales it";
                return refuse(&flag, &"a value", expected);
            }
        }
        Ok(())
    }

    fn settings(&self, format: Format) -> Result<Settings, Failure> {
        let presets = PRESET_KEYS.iter();
        let presets: Vec<_> = presets
            .filter_map(|key| Some((*key, format.preset(key)?)))
            .collect();
        let settings = self.settings.settings_above(&presets)?;
        let checked = settings.simulation().check();
        checked.map_err(|error| Failure::usage(error.to_string()))?;
        Ok(settings)
    }

    fn read(&self, format: Format) -> Result<Recording, Failure> {
        Ok(match format {
            Format::Mrclam => read_mrclam(&self.path, self.robot)?,
            Format::G2o => read_g2o(&self.path)?,
            Format::RangeBearing => {
                let (mut recording, rows) = read_range_bearing(&self.path)?;
                let truth = self.truth.as_deref();
                recording.truth = truth
                    .map(|path: &Path| read_truth(path, &rows))
                    .transpose()?;
                recording
            }
        })
    }

    fn noise(&self, format: Format, settings: &Settings) -> Noise {
        let simulation = settings.simulation();
        let [turn, bend] = format.turn_and_bend();
        Noise {
            sensor: SensorNoise {
                range_m: simulation.range_noise,
                range_growth: simulation.range_noise_growth,
                bearing_rad: simulation.bearing_noise,
            },
            drift: DriftNoise {
                position: simulation.odometry_noise,
                heading: simulation.heading_noise,
                turn: self.turn_noise.unwrap_or(turn),
                bend: self.bend_noise.unwrap_or(bend),
            },
            factor: simulation.noise,
        }
    }
}

fn sightings_csv(sightings: &[Sighting], detection_of: &[Option<usize>]) -> String {
    let mut text = String::from("t,x,y,detection,landmark\n");
    for (sighting, detection) in sightings.iter().zip(detection_of) {
        let [x, y] = sighting.point_m();
        let detection = detection.map_or_else(String::new, |ix| ix.to_string());
        let landmark = sighting
            .landmark
            .map_or_else(String::new, |id| id.to_string());
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

fn print_alignment(found: &Alignment) {
    outln!(
        "aligned: moved by {:.2} m (root mean square); drift known to {:.2} m per axis, before to {:.2} m; own errors {:.2} \
         times what is stated",
        found.moved_m,
        found.drift_left_m,
        found.drift_before_m,
        found.noise_factor
    );
    outln!(
        "aligned: {} landmarks; Rand index {:.2} with the truth is expected of them",
        found.n_sets,
        found.expected_rand_index
    );
    for doubt in &found.doubts {
        outln!("DOUBT: {doubt}");
    }
}

fn print_scales(detections: &Detections) {
    let scales = Scales::of(detections);
    let metres = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |m| format!("{m:.2} m"));
    outln!(
        "scales: nearest other {}, stated precision {}, extent {:.1} m",
        metres(scales.nearest_m),
        metres(scales.precision_m),
        scales.extent_m
    );
}

/// How honest the covariances are, as far as the recording can tell.
fn print_errors(recording: &Recording, detections: &Detections) {
    let places_m = recording.stops.first().and_then(|first| {
        let truth = recording.truth.as_ref()?;
        truth.landmarks_in_frame_m(first.time_s, recording.start)
    });
    let errors = places_m.and_then(|places_m| nees(&errors_against(detections, &places_m)));
    outln!(
        "against true places: {}",
        nees_words(
            errors,
            detections.len(),
            "unknown, the recording has none at its start"
        )
    );
    let differences = nees(&differences_between_visits(detections));
    outln!(
        "between visits of one landmark: {}",
        nees_words(
            differences,
            detections.len(),
            "unknown, no landmark was detected twice"
        )
    );
}

/// NEES beside what it would be if covariances are honest.
pub(super) fn nees_words(errors: Option<Nees>, n_detections: usize, none: &str) -> String {
    match errors {
        None => none.to_owned(),
        Some(nees) => format!(
            "NEES mean {:.2} (honest: 2), median {:.2} (1.39), {:.0} % within 95 %; error {:.2} m; \
             {} of {n_detections} detections",
            nees.mean,
            nees.median,
            100.0 * nees.within_95,
            nees.rms_m,
            nees.n
        ),
    }
}
