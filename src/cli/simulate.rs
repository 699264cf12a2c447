//! `ptm simulate`: a mission in a polygonal world.

use std::path::PathBuf;

use crate::dataset::{DataSet, simulated};
use crate::import::range_bearing_csv;
use crate::report;
use clap::Args;

use super::numbers::count;
use super::settings::{SIMULATING, SettingsFlags};
use super::{Arguments, Exit, Failure, check_outputs, map_beside, write_output};

/// Arguments of `ptm simulate`.
#[derive(Debug, Args)]
pub struct SimulateCommand {
    /// Where the detections go.
    #[arg(short, long, value_name = "CSV", default_value = "detections.csv")]
    out: PathBuf,
    /// Where the map goes [default: beside the detections, as PNG; none if
    /// they go to a device or a FIFO].
    #[arg(long, value_name = "PNG")]
    map: Option<PathBuf>,
    /// Write the sightings too, as a range-bearing CSV that `ptm solve` and `ptm import` read; a pose
    /// from which nothing was seen is a row without range and bearing.
    #[arg(long, value_name = "CSV")]
    recording: Option<PathBuf>,
    /// Which of the worlds that a sweep of the same seed would simulate, from 1.
    #[arg(long, value_name = "N", value_parser = count::<u64>(1, u64::MAX), default_value_t = 1)]
    replicate: u64,
    #[command(flatten)]
    settings: SettingsFlags<SIMULATING>,
}

/// Runs it.
pub fn run(command: &SimulateCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let settings = command.settings.settings()?;
    // The flag takes no 0.
    let replicate = command.replicate - 1;
    let map = map_beside(command.map.as_ref(), &command.out);
    let outputs: Vec<&PathBuf> = std::iter::once(&command.out)
        .chain(&map)
        .chain(&command.recording)
        .collect();
    check_outputs(None, &outputs)?;
    let data = DataSet::load(&settings, replicate)?;
    write_output(&command.out, data.detections.to_csv_string().as_bytes())?;
    if let Some(path) = &command.recording {
        if data.scene.is_none() {
            return Err(no_recording());
        }
        let (_, drive) = simulated(&settings, replicate)?;
        let poses = drive.times_s.into_iter().zip(drive.believed_path);
        let text = range_bearing_csv(poses, &drive.sightings);
        write_output(path, text.as_bytes())?;
    }
    let title = format!(
        "{}, noise {}",
        settings.text("world"),
        settings.get("noise")
    );
    let png = report::simulation_figure(&data, title);
    if let Some(map) = &map {
        write_output(map, &png)?;
    }
    if !arguments.quiet {
        let landmarks = data.truth.as_ref().map_or(0, |truth| truth.n_landmarks());
        let unknown = data
            .truth
            .as_ref()
            .map_or(1.0, |truth| truth.unknown_share());
        let n = data.detections.len();
        outln!(
            "{n} detections of {landmarks} landmarks, {:.0} % of unknown truth",
            100.0 * unknown
        );
        outln!("detections: {}", command.out.display());
        if let Some(map) = &map {
            outln!("map: {}", map.display());
        }
        if let Some(path) = &command.recording {
            outln!("recording: {}", path.display());
        }
    }
    Ok(Exit::Done)
}

/// Worlds that are a set of detections have no sightings.
fn no_recording() -> Failure {
    Failure::usage(
        "--recording: got a world that is a set of detections, expected one with a drive; leave \
         the flag out or choose another world"
            .to_owned(),
    )
}
