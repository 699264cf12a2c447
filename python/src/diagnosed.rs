//! Chains of label vectors that another program drew.

use std::path::PathBuf;

use numpy::ndarray::ArrayView2;
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use pythonize::pythonize;
use rayon::prelude::*;
use topometric::job;
use topometric::labels::{Collector, LabelChains};
use topometric::partition::Topology;
use topometric::report;
use topometric::results::labels::LabelsResult;
use topometric::settings::BurnInRule;

use super::error;
use super::jobs::{array, picture};

/// Columns of summaries, those of a plain terminal: a notebook does not say how wide it is.
pub const COLUMNS: usize = 80;

/// The diagnosis of chains.
#[pyclass(frozen, module = "topometric._topometric")]
pub struct Diagnosed {
    found: LabelsResult,
    #[pyo3(get)]
    n_left_out: u64,
}

#[pymethods]
impl Diagnosed {
    /// What `ptm diagnose --json` writes.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.found)?)
    }

    /// All of it as bytes, for a pickle.
    fn saved<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &py.detach(|| self.found.to_bytes()))
    }

    /// Of such bytes and the number of draws left out.
    #[staticmethod]
    fn restored(py: Python<'_>, bytes: &[u8], n_left_out: u64) -> PyResult<Self> {
        let found = py.detach(|| LabelsResult::from_bytes(bytes));
        let found = found.map_err(error)?;
        Ok(Self { found, n_left_out })
    }

    /// What `ptm diagnose` says.
    fn summary(&self) -> String {
        report::labels_summary(&self.found, COLUMNS)
    }

    /// The probability that two items share a set: (n, n).
    fn co_clustering<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &self.found.co_clustering.dense(self.found.n_items))
    }

    /// The page of `ptm diagnose`: HTML.
    fn page(&self, py: Python<'_>, title: &str) -> String {
        py.detach(|| report::labels_page(&self.found, title))
    }

    /// The picture of `ptm diagnose`: PNG, or SVG as bytes.
    fn figure<'py>(&self, py: Python<'py>, title: String, svg: bool) -> Bound<'py, PyBytes> {
        let bytes = py.detach(|| {
            let scene = report::labels_figure(&self.found, title.clone());
            picture(&scene, &title, svg)
        });
        PyBytes::new(py, &bytes)
    }
}

/// Labels (draw, item) of any whole numbers; so they are not copied, however many they are.
#[derive(FromPyObject)]
pub enum Labels<'py> {
    I64(PyReadonlyArray2<'py, i64>),
    I32(PyReadonlyArray2<'py, i32>),
    I16(PyReadonlyArray2<'py, i16>),
    I8(PyReadonlyArray2<'py, i8>),
    U8(PyReadonlyArray2<'py, u8>),
    U16(PyReadonlyArray2<'py, u16>),
    U32(PyReadonlyArray2<'py, u32>),
    U64(PyReadonlyArray2<'py, u64>),
}

/// The number of draws, and each as a topology; to be looked at without the GIL.
type View<'a> = (usize, Box<dyn Fn(usize) -> Topology + Sync + 'a>);

impl Labels<'_> {
    fn view(&self) -> View<'_> {
        match self {
            Self::I64(labels) => view(labels.as_array(), |label| label),
            Self::I32(labels) => view(labels.as_array(), i64::from),
            Self::I16(labels) => view(labels.as_array(), i64::from),
            Self::I8(labels) => view(labels.as_array(), i64::from),
            Self::U8(labels) => view(labels.as_array(), i64::from),
            Self::U16(labels) => view(labels.as_array(), i64::from),
            Self::U32(labels) => view(labels.as_array(), i64::from),
            // Which labels are alike is all that counts.
            Self::U64(labels) => view(labels.as_array(), |label| label as i64),
        }
    }
}

fn view<'a, T: Copy + Sync>(
    labels: ArrayView2<'a, T>,
    number: impl Fn(T) -> i64 + Sync + 'a,
) -> View<'a> {
    let topology = move |draw: usize| {
        let labels = labels.row(draw);
        let numbers: Vec<i64> = labels.iter().map(|&label| number(label)).collect();
        Topology::of_numbers(&numbers)
    };
    (labels.nrows(), Box::new(topology))
}

/// Draws that are made topologies at once.
const BLOCK: usize = 4096;

/// One chain: labels (draw, item), weights (draw), ln target (draw).
pub type Chain<'py> = (
    Labels<'py>,
    Option<PyReadonlyArray1<'py, u64>>,
    Option<PyReadonlyArray1<'py, f64>>,
);

/// Diagnoses chains of labels.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    chains: Vec<Chain<'_>>,
    burn_in: &str,
    max_topologies: usize,
) -> PyResult<Diagnosed> {
    let rule = rule(burn_in)?;
    let views: Vec<_> = chains
        .iter()
        .map(|(labels, weights, ln_target)| {
            let weights = weights.as_ref().map(PyReadonlyArray1::as_array);
            let ln_target = ln_target.as_ref().map(PyReadonlyArray1::as_array);
            (labels.view(), weights, ln_target)
        })
        .collect();
    let found = py.detach(|| {
        let mut collector = Collector::new(max_topologies);
        for (number, ((n_draws, topology), weights, ln_target)) in views.iter().enumerate() {
            collector.begin_file(&format!("chain {}", number + 1));
            for first in (0..*n_draws).step_by(BLOCK) {
                let draws = first..(first + BLOCK).min(*n_draws);
                let topologies: Vec<Topology> =
                    draws.clone().into_par_iter().map(topology).collect();
                for (draw, topology) in draws.zip(&topologies) {
                    let n_steps = weights.map_or(1, |weights| weights[draw]);
                    let ln_target = ln_target.map_or(0.0, |values| values[draw]);
                    let pushed = collector.push("", topology, (n_steps, ln_target));
                    pushed.map_err(|own| {
                        let (got, expected) = (own.got, own.expected);
                        format!(
                            "chain {}: got {got}, expected {expected}; {}",
                            number + 1,
                            own.change
                        )
                    })?;
                }
            }
        }
        job::whole(collector).map_err(|error| error.to_string())
    });
    diagnosed(py, found.map_err(error)?, rule)
}

/// Diagnoses the chains of files.
#[pyfunction]
pub fn diagnose_files(
    py: Python<'_>,
    files: Vec<PathBuf>,
    burn_in: &str,
    max_topologies: usize,
) -> PyResult<Diagnosed> {
    let rule = rule(burn_in)?;
    let found = py.detach(|| job::read_labels(&files, max_topologies, &|_| ()));
    diagnosed(py, found.map_err(error)?, rule)
}

fn rule(burn_in: &str) -> PyResult<BurnInRule> {
    let rule = burn_in.parse();
    rule.map_err(|_| {
        error(format!(
            "burn_in: got {burn_in:?}, expected \"auto\" or a whole number of draws"
        ))
    })
}

fn diagnosed(py: Python<'_>, chains: LabelChains, rule: BurnInRule) -> PyResult<Diagnosed> {
    let n_left_out = chains.n_left_out;
    let found = py.detach(|| job::diagnose(chains.chains, rule, &|_| ()));
    let found = found.map_err(error)?;
    Ok(Diagnosed { found, n_left_out })
}
