//! Detections with their truth and scene.

use std::path::PathBuf;

use numpy::ndarray::Array3;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use topometric::dataset::{DataError, DataSet};
use topometric::detections::{Corner, Covariance, Detection, Detections as Rows};
use topometric::input::Source;
use topometric::report;

use super::error;

/// Detections of landmarks, in the order of the mission.
#[pyclass(frozen, module = "topometric._topometric")]
pub struct Detections {
    pub(super) data: DataSet,
}

impl Detections {
    pub(super) fn of(data: DataSet) -> Self {
        Self { data }
    }
}

#[pymethods]
impl Detections {
    /// Of arrays of n detections: `positions` (n, 2), `covariances` (n, 2, 2), `times` (n, 2) of
    /// the first and the last sighting, `landmarks` (n) with -1 for unknown and their names,
    /// `corners`.
    #[new]
    #[pyo3(signature = (positions, covariances, times, landmarks, names, corners))]
    fn new(
        positions: PyReadonlyArray2<'_, f64>,
        covariances: Option<PyReadonlyArray3<'_, f64>>,
        times: Option<PyReadonlyArray2<'_, f64>>,
        landmarks: Option<PyReadonlyArray1<'_, i64>>,
        names: Vec<String>,
        corners: Option<Vec<Option<String>>>,
    ) -> PyResult<Self> {
        let positions = positions.as_array();
        let covariances = covariances.as_ref().map(PyReadonlyArray3::as_array);
        let times = times.as_ref().map(PyReadonlyArray2::as_array);
        let landmarks = landmarks.as_ref().map(PyReadonlyArray1::as_array);
        let row = |i: usize| -> PyResult<Detection> {
            let corner = corners.as_ref().and_then(|corners| corners[i].as_deref());
            let kind = |name: &str| {
                Corner::from_name(name).ok_or_else(|| {
                    let what = format!(
                        "corners: got {name:?} at place {i}, expected open, closed or None"
                    );
                    error(what)
                })
            };
            Ok(Detection {
                covariance_m2: covariances.map(|c| Covariance {
                    xx: c[[i, 0, 0]],
                    xy: c[[i, 0, 1]],
                    yy: c[[i, 1, 1]],
                }),
                first_seen_s: times.map(|t| t[[i, 0]]).filter(|t| !t.is_nan()),
                last_seen_s: times.map(|t| t[[i, 1]]).filter(|t| !t.is_nan()),
                corner: corner.map(kind).transpose()?,
                landmark: landmarks.map(|l| l[i]).filter(|landmark| *landmark >= 0),
                ..Detection::at(positions[[i, 0]], positions[[i, 1]])
            })
        };
        let rows = (0..positions.nrows())
            .map(row)
            .collect::<PyResult<Vec<_>>>()?;
        let detections = Rows::new(rows).map_err(error)?;
        let detections = detections.with_landmark_names(&names).map_err(error)?;
        Ok(Self::of(DataSet::new(detections, None)))
    }

    /// Those of a CSV, and what its reader left out or put up with.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<(Self, Vec<String>)> {
        let read = py.detach(|| Rows::from_source(Source::open(&path)?));
        let (detections, notes) = read.map_err(DataError::from).map_err(error)?;
        let notes = notes.iter().map(ToString::to_string).collect();
        Ok((Self::of(DataSet::new(detections, None)), notes))
    }

    /// All of it as bytes, for a pickle.
    fn saved<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.data.to_bytes())
    }

    /// Of such bytes.
    #[staticmethod]
    fn restored(bytes: &[u8]) -> PyResult<Self> {
        Ok(Self::of(DataSet::from_bytes(bytes).map_err(error)?))
    }

    /// As the text of a CSV.
    fn csv(&self) -> String {
        self.data.detections.to_csv_string()
    }

    fn __len__(&self) -> usize {
        self.data.detections.len()
    }

    /// Where each is, m: (n, 2).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.data.detections.positions_m();
        let rows: Vec<Vec<f64>> = rows.into_iter().map(Vec::from).collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// Covariances of the positions, m²: (n, 2, 2); None without.
    #[getter]
    fn covariances<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray3<f64>>> {
        let rows = self.data.detections.covariances_m2()?;
        let value = |(i, a, b): (usize, usize, usize)| match a + b {
            0 => rows[i].xx,
            1 => rows[i].xy,
            _ => rows[i].yy,
        };
        Some(Array3::from_shape_fn((rows.len(), 2, 2), value).into_pyarray(py))
    }

    /// The true landmark of each, counted from 0; -1 where it is not known.
    #[getter]
    fn landmarks<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let truth = self.data.detections.truth().into_iter();
        let landmarks: Vec<i64> = truth.map(|landmark| landmark.unwrap_or(-1)).collect();
        PyArray1::from_vec(py, landmarks)
    }

    /// The names of landmarks 0, 1, …, where these data name them.
    #[getter]
    fn landmark_names(&self) -> Vec<String> {
        let detections = &self.data.detections;
        let most = detections.truth().into_iter().flatten().max();
        let most = most.map_or(0, |most| most + 1);
        // Names are numbered from 0 without gaps; other numbers are their own names.
        if most > detections.len() as i64 {
            return Vec::new();
        }
        (0..most)
            .map(|landmark| detections.landmark_name(landmark))
            .collect()
    }

    /// Times of the first and the last sighting of each, s: (n, 2); NaN where they are not known.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.data.detections.iter();
        let times = rows.map(|row| {
            let times = [row.first_seen_s, row.last_seen_s];
            times.map(|time| time.unwrap_or(f64::NAN)).to_vec()
        });
        Ok(PyArray2::from_vec2(py, &times.collect::<Vec<_>>())?)
    }

    /// What each corner looked like: open, closed, or None where it is not known.
    #[getter]
    fn corners(&self) -> Vec<Option<&'static str>> {
        let rows = self.data.detections.iter();
        rows.map(|row| row.corner.map(Corner::name)).collect()
    }

    /// A picture of them, with the world that they were simulated in: PNG.
    fn png<'py>(&self, py: Python<'py>, title: String) -> Bound<'py, PyBytes> {
        let png = py.detach(|| report::simulation_figure(&self.data, title));
        PyBytes::new(py, &png)
    }
}
