//! What the targets of imports share: a file in memory, and the way from a recording to detections.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use topometric::import::{DriftNoise, ImportError, Noise, Recording, SensorNoise, dead_reckon};
use topometric::tracker::{TrackerSettings, track};

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

const NOISE: Noise = Noise {
    sensor: SensorNoise {
        range_m: 0.1,
        range_growth: 0.01,
        bearing_rad: 0.01,
    },
    drift: DriftNoise {
        position: 0.05,
        heading: 0.01,
        turn: 0.01,
        bend: 0.002,
    },
    factor: 1.0,
};

const TRACKER: TrackerSettings = TrackerSettings {
    gate_probability: 0.999_999,
    group_timeout_s: 100.0,
    min_sightings: 1,
    odometry_noise: 0.0,
    heading_noise: 0.0,
    since_start: true,
};

/// The path of a file of this process with these bytes.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    FOLDER.with(|folder| {
        let memory = Path::new("/dev/shm");
        let make = || {
            if memory.is_dir() {
                tempfile::tempdir_in(memory)
            } else {
                tempfile::tempdir()
            }
        };
        let path = folder.get_or_init(|| make().expect("a folder")).path().join(name);
        std::fs::write(&path, bytes).expect("room for a small file");
        path
    })
}

/// All the way to detections, or a refusal in one line.
pub fn follow(recording: Result<Recording, ImportError>) {
    let error = match recording {
        Ok(recording) => {
            let sightings = dead_reckon(&recording, &NOISE);
            track(&sightings, &TRACKER).err().map(|error| error.to_string())
        }
        Err(error) => Some(error.to_string()),
    };
    if let Some(error) = error {
        assert!(!error.contains('\n'), "{error}");
    }
}
