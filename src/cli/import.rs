//! `ptm import`: a recording into detections.

use std::path::PathBuf;

use clap::Args;
use topometric::dataset::DataSet;
use topometric::import::{SensorNoise, read_range_bearing};
use topometric::report;
use topometric::tracker::track;
use topometric::tune::scales::Scales;

use super::settings::{SettingsFlags, TRACKING};
use super::{Arguments, Exit, Failure, check_outputs, unwritable};

/// Arguments of `ptm import`.
#[derive(Debug, Args)]
pub struct ImportCommand {
    /// Range-bearing CSV: t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id; gzip too.
    file: PathBuf,
    /// Where the detections go.
    #[arg(short, long, value_name = "CSV", default_value = "detections.csv")]
    out: PathBuf,
    /// Where the map goes [default: beside the detections, as PNG].
    #[arg(long, value_name = "PNG")]
    map: Option<PathBuf>,
    /// Leave out sightings before this time, s.
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Leave out sightings from this time on, s.
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Leave out sightings further away than --max-range, and state the sensor's noise: the flags of
    /// simulated worlds that describe the sensor and the tracker.
    #[command(flatten)]
    settings: SettingsFlags<TRACKING>,
}

/// Runs it.
pub fn run(command: &ImportCommand, arguments: &Arguments) -> Result<Exit, Failure> {
    let settings = command.settings.settings()?.simulation();
    settings
        .check()
        .map_err(|error| Failure::usage(error.to_string()))?;
    let map = command
        .map
        .clone()
        .unwrap_or_else(|| command.out.with_extension("png"));
    check_outputs(Some(&command.file), &[&command.out, &map])?;
    let noise = SensorNoise {
        range_m: settings.range_noise * settings.noise,
        range_growth: settings.range_noise_growth * settings.noise,
        bearing_rad: settings.bearing_noise * settings.noise,
    };
    let mut sightings = read_range_bearing(&command.file, noise)?;
    let n_read = sightings.len();
    sightings.retain(|sighting| {
        command.from.is_none_or(|from| sighting.time_s >= from)
            && command.until.is_none_or(|until| sighting.time_s < until)
            && sighting.range_m <= settings.max_range
    });
    let detections = track(&sightings, &settings.tracker())
        .map_err(|error| Failure::usage(error.to_string()))?;
    detections
        .write_csv(&command.out)
        .map_err(|error| Failure::usage(error.to_string()))?;
    let scales = Scales::of(&detections);
    let data = DataSet::new(detections, None);
    let title = command
        .file
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let png = report::simulation_figure(&data, title);
    std::fs::write(&map, png).map_err(|error| unwritable(&map, &error))?;
    if !arguments.quiet {
        let metres =
            |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |m| format!("{m:.2} m"));
        println!(
            "{} of {n_read} sightings, {} detections",
            sightings.len(),
            data.detections.len()
        );
        println!(
            "scales: nearest other {}, stated precision {}, extent {:.1} m",
            metres(scales.nearest_m),
            metres(scales.precision_m),
            scales.extent_m
        );
        println!("detections: {}", command.out.display());
        println!("map: {}", map.display());
    }
    Ok(Exit::Done)
}
