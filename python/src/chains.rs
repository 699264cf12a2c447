//! Chains on one data set, and what they found.

use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use pythonize::pythonize;
use topometric::chain::Trace;
use topometric::dataset::DataSet;
use topometric::job;
use topometric::map::PosteriorMap;
use topometric::partition::Topology;
use topometric::report;
use topometric::results::draws::draws;

use super::detections::Detections;
use super::error;
use super::jobs::{array, cube, picture};

/// Chains that ran to their end.
#[pyclass(frozen, module = "topometric._topometric")]
pub struct Sampled {
    data: DataSet,
    sampled: job::Sampled,
}

impl Sampled {
    pub(super) fn new(data: DataSet, sampled: job::Sampled) -> Self {
        Self { data, sampled }
    }

    fn draws(&self) -> PyResult<topometric::results::draws::Draws> {
        let found = draws(&self.sampled.outcomes());
        found.ok_or_else(|| error("no draw is left after the burn-in; run longer chains"))
    }
}

#[pymethods]
impl Sampled {
    /// What `ptm sample --json` writes.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.sampled.result)?)
    }

    /// The chains as bytes, for a pickle.
    fn saved<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &py.detach(|| self.sampled.to_bytes()))
    }

    /// Of such bytes and the detections.
    #[staticmethod]
    fn restored(py: Python<'_>, bytes: &[u8], detections: &Detections) -> PyResult<Self> {
        let data = &detections.data;
        let sampled = py.detach(|| job::Sampled::from_bytes(bytes, data));
        Ok(Self::new(data.clone(), sampled.map_err(error)?))
    }

    /// What `ptm sample` says.
    fn summary(&self, name: &str) -> String {
        let outcomes = self.sampled.outcomes();
        report::sample_summary(
            (&self.sampled.result, &outcomes),
            &self.data,
            name,
            crate::diagnosed::COLUMNS,
        )
    }

    /// M, ln target and the topology's number at even steps after the burn-in, each (chain, draw);
    /// the identities of the topologies; the first step, and steps from draw to draw.
    fn series<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = self.draws()?;
        let (mut n_sets, mut ln_target, mut topology) = (Vec::new(), Vec::new(), Vec::new());
        for own in found.chains {
            n_sets.push(own.n_sets);
            ln_target.push(own.ln_target);
            topology.push(own.topology);
        }
        let series = PyDict::new(py);
        series.set_item("n_sets", array(py, &n_sets)?)?;
        series.set_item("ln_target", array(py, &ln_target)?)?;
        series.set_item("topology", array(py, &topology)?)?;
        series.set_item("topologies", found.topologies)?;
        series.set_item("first_step", found.first_step)?;
        series.set_item("every", found.every)?;
        Ok(series)
    }

    /// Labels at even steps after the burn-in: (chain, draw, detection), at most so many draws.
    fn labels<'py>(&self, py: Python<'py>, most: u64) -> PyResult<Bound<'py, PyArray3<u32>>> {
        let first = self.draws()?.first_step;
        let n = self.data.detections.len();
        let traces = || self.sampled.chains.iter().map(|chain| &chain.trace);
        let mut drawn: Vec<Vec<&Topology>> = traces()
            .map(|trace| topologies(trace, first, most.max(1)))
            .collect();
        let shortest = drawn.iter().map(Vec::len).min().unwrap_or(0);
        drawn.iter_mut().for_each(|draws| draws.truncate(shortest));
        let labels = drawn
            .iter()
            .flatten()
            .flat_map(|topology| topology.labels());
        cube(py, labels.copied().collect(), [drawn.len(), shortest, n])
    }

    /// The picture of `ptm sample`: PNG, or SVG as bytes.
    fn figure<'py>(
        &self,
        py: Python<'py>,
        title: String,
        svg: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let scene = py.detach(|| {
            let (outcomes, settings) = (self.sampled.outcomes(), &self.sampled.settings);
            let scene = report::sample_figure(&outcomes, &self.data, settings, title.clone())?;
            Some(picture(&scene, &title, svg))
        });
        let bytes = scene.ok_or_else(|| error("no chain"))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The map of one topology, with the probabilities of its parts: a dictionary of nodes and
    /// edges.
    fn map<'py>(&self, py: Python<'py>, labels: Vec<i64>) -> PyResult<Bound<'py, PyDict>> {
        let topology = Topology::canonical(&labels);
        let model = self.data.model(&self.sampled.settings).map_err(error)?;
        let positions_m = self.data.detections.positions_m();
        if labels.len() != positions_m.len() {
            let (got, n) = (labels.len(), positions_m.len());
            return Err(error(format!(
                "labels: got {got}, expected {n}, one for each detection"
            )));
        }
        let rows = self.sampled.result.topologies.iter();
        let draws: Vec<(&Topology, u64)> = rows.map(|row| (&row.topology, row.count)).collect();
        let found = py.detach(|| PosteriorMap::new(&topology, &positions_m, &model, &draws));
        let nodes = found.nodes.iter().map(|node| {
            let row = PyDict::new(py);
            row.set_item("position", node.position_m)?;
            row.set_item("covariance", node.covariance_m2)?;
            row.set_item("members", node.members.clone())?;
            row.set_item("probability", node.probability)?;
            Ok(row)
        });
        let edges = found.edges.iter().map(|edge| {
            let row = PyDict::new(py);
            row.set_item("first", edge.first)?;
            row.set_item("second", edge.second)?;
            row.set_item("weight", edge.weight)?;
            row.set_item("support", edge.support)?;
            Ok(row)
        });
        let map = PyDict::new(py);
        map.set_item("nodes", nodes.collect::<PyResult<Vec<_>>>()?)?;
        map.set_item("edges", edges.collect::<PyResult<Vec<_>>>()?)?;
        Ok(map)
    }

    /// The probability that two detections share a set: (n, n).
    fn co_clustering<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let n = self.data.detections.len();
        array(py, &self.sampled.result.co_clustering.dense(n))
    }
}

/// Topologies of a chain at even steps from `first` on, at most so many: those at which it stood
/// where its trace holds all, its snapshots otherwise.
fn topologies(trace: &Trace, first: u64, most: u64) -> Vec<&Topology> {
    let every = trace.n_steps.saturating_sub(first).div_ceil(most).max(1);
    if let Some(snapshots) = trace.snapshots() {
        let kept: Vec<_> = snapshots.after(first, trace.n_steps).collect();
        let skip = (kept.len() as u64).div_ceil(most).max(1) as usize;
        let states = kept.iter().step_by(skip);
        return states.map(|(state, _)| &state.topology).collect();
    }
    let mut drawn = Vec::new();
    let mut end = 0;
    for (run, dwell) in trace.dwell_times(first) {
        end += dwell;
        let due = (end / every) as usize;
        if let (true, Some(topology)) = (due > drawn.len(), trace.topologies.get(run.topology)) {
            drawn.resize(due, topology);
        }
    }
    drawn
}
