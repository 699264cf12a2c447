//! Jobs on detections.

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pythonize::pythonize;
use topometric::dataset::DataSet;
use topometric::exact::{ExactSettings, MAX_DETECTIONS_LARGE, watched_posterior};
use topometric::figure::scene::Scene;
use topometric::job::{self, Watch};
use topometric::results::evaluation::together;
use topometric::results::exact::exact_result;
use topometric::rng::{Purpose, SAMPLER_SEMANTICS};
use topometric::run::exact_purpose;
use topometric::settings::{KEYS, Key, Section, Settings};
use topometric::sweep::decides_the_world;
use topometric::tune::rule::ModelKind;
use topometric::tune::{Request, tune_until};

use super::chains::Sampled;
use super::detections::Detections;
use super::error;
use super::watched::watched;

/// Settings by name, as texts.
pub type Given = Vec<(String, String)>;

/// What a job has settings for: its name, and which settings these are.
type For = (&'static str, fn(&Key) -> bool);
fn is_of_chains(key: &Key) -> bool {
    key.section != Section::Data && key.name != "reference"
}

const SAMPLE: For = ("sample", is_of_chains);
const EVALUATE: For = ("evaluate", is_of_chains);
const SIMULATE: For = ("simulate", |key| {
    key.name == "world" || key.name == "seed" || decides_the_world(key)
});
const EXACT: For = ("exact", |key| {
    key.section == Section::Model || key.name == "seed"
});

/// The defaults with what was given.
fn settings(given: &Given, (job, takes): For) -> PyResult<Settings> {
    let mut settings = Settings::default();
    for (name, text) in given {
        settings.set_text(name, text).map_err(error)?;
        let key = KEYS.iter().find(|key| key.name == name && takes(key));
        if key.is_none() {
            let what = format!("{name}: no setting of {job}; leave it out");
            return Err(error(what));
        }
    }
    settings.check_together().map_err(error)?;
    Ok(settings)
}

/// All settings: name, section, unit, default and help.
#[pyfunction]
pub fn keys(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let keys = KEYS.iter().map(|key| {
        let row = PyDict::new(py);
        row.set_item("name", key.name)?;
        row.set_item("section", format!("{:?}", key.section).to_lowercase())?;
        row.set_item("unit", key.unit)?;
        row.set_item("default", pythonize(py, &(key.default)())?)?;
        row.set_item("help", key.help)?;
        Ok(row)
    });
    PyList::new(py, keys.collect::<PyResult<Vec<_>>>()?)
}

/// The detections of one simulated mission; `replicate` counts from 1.
#[pyfunction]
pub fn simulate(py: Python<'_>, given: Given, replicate: u64) -> PyResult<Detections> {
    let settings = settings(&given, SIMULATE)?;
    let data = py.detach(|| DataSet::load(&settings, replicate.saturating_sub(1)));
    Ok(Detections::of(data.map_err(error)?))
}

/// Chains on detections.
#[pyfunction]
pub fn sample(py: Python<'_>, detections: &Detections, given: Given) -> PyResult<Sampled> {
    let settings = settings(&given, SAMPLE)?;
    let data = &detections.data;
    let sampled = watched(
        py,
        |stop| {
            let watch = Watch {
                stop,
                ..Watch::NOBODY
            };
            job::sample(data, &settings, &watch)
        },
        |_| Ok(()),
    )?;
    let sampled = sampled.map_err(error)?.ok_or_else(|| error("stopped"))?;
    Ok(Sampled::new(data.clone(), sampled))
}

/// The posterior of a few detections by enumeration.
#[pyfunction]
pub fn exact<'py>(
    py: Python<'py>,
    detections: &Detections,
    tolerance: Option<f64>,
    max_draws: Option<f64>,
    given: Given,
) -> PyResult<Bound<'py, PyAny>> {
    let settings = settings(&given, EXACT)?;
    let data = &detections.data;
    let n = data.detections.len();
    if n > MAX_DETECTIONS_LARGE {
        let what = format!(
            "got {n} detections, expected at most {MAX_DETECTIONS_LARGE}; use topometric.sample"
        );
        return Err(error(what));
    }
    let default = ExactSettings::default();
    let how = ExactSettings {
        tolerance: tolerance.unwrap_or(default.tolerance),
        max_draws: max_draws.unwrap_or(default.max_draws),
    };
    let model = data.model(&settings).map_err(error)?;
    let purpose = exact_purpose(&settings, data);
    let found = watched(
        py,
        |stop| {
            let watch = topometric::exact::Watch {
                round: &mut |_| (),
                stop,
            };
            let posterior = watched_posterior(&model, settings.prior(), &how, &purpose, watch);
            posterior.map(|posterior| exact_result(&posterior, &settings, &how))
        },
        |_| Ok(()),
    )?;
    Ok(pythonize(py, &found.ok_or_else(|| error("stopped"))?)?)
}

/// Settings for detections of unknown truth.
#[pyfunction]
pub fn tune<'py>(
    py: Python<'py>,
    detections: &Detections,
    model: &str,
    sensor_noise_m: Option<f64>,
    simulate: bool,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let kinds = [ModelKind::Metric, ModelKind::Covariance];
    let kind = kinds.into_iter().find(|kind| kind.name() == model);
    let model = kind.ok_or_else(|| {
        error(format!(
            "model: got {model:?}, expected metric or covariance"
        ))
    })?;
    let request = Request {
        model,
        sensor_noise_m,
        simulate,
        seed,
    };
    let data = &detections.data.detections;
    let found = watched(py, |stop| tune_until(data, &request, stop), |_| Ok(()))?;
    let found = found.map_err(error)?.ok_or_else(|| error("stopped"))?;
    Ok(pythonize(py, &found)?)
}

/// The posterior on detections of known truth, beside plain clusterings.
#[pyfunction]
pub fn evaluate<'py>(
    py: Python<'py>,
    data_sets: Vec<(String, PyRef<'py, Detections>)>,
    tunes: bool,
    given: Given,
) -> PyResult<Bound<'py, PyAny>> {
    let settings = settings(&given, EVALUATE)?;
    let data_sets: Vec<(String, DataSet)> = data_sets
        .iter()
        .map(|(name, own)| (name.clone(), own.data.clone()))
        .collect();
    let evaluation = watched(
        py,
        |stop| {
            let watch = Watch {
                stop,
                ..Watch::NOBODY
            };
            let scored = data_sets
                .iter()
                .map(|(name, data)| job::evaluate(name, data, settings.clone(), tunes, &watch));
            let scored: Result<Option<Vec<_>>, _> = scored.collect();
            let purpose = Purpose::new(SAMPLER_SEMANTICS, settings.count("seed"));
            let mut rng = purpose.text("use", "evaluation").generator();
            scored.map(|scored| scored.map(|scored| together(scored, &mut rng)))
        },
        |_| Ok(()),
    )?;
    let evaluation = evaluation.map_err(error)?;
    Ok(pythonize(py, &evaluation.ok_or_else(|| error("stopped"))?)?)
}

/// A list of rows of one length as an array.
pub fn array<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    rows: &[Vec<T>],
) -> PyResult<Bound<'py, numpy::PyArray2<T>>> {
    Ok(numpy::PyArray2::from_vec2(py, rows)?)
}

/// A picture as PNG, or as SVG with this title.
pub fn picture(scene: &Scene, title: &str, svg: bool) -> Vec<u8> {
    if svg {
        scene.svg(title).into_bytes()
    } else {
        scene.png()
    }
}

/// Values of an array of three dimensions, without a copy.
pub fn cube<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: [usize; 3],
) -> PyResult<Bound<'_, numpy::PyArray3<T>>> {
    let array = numpy::ndarray::Array3::from_shape_vec(shape, values);
    Ok(array.map_err(error)?.into_pyarray(py))
}
