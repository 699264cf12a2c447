"""Posteriors of detections: chains, enumeration, settings from data."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from . import _topometric
from ._arrays import frame, positive, refuse, settings_texts, whole
from ._detections import Detections, as_detections
from ._results import Found


def settings(section: str | None = None) -> list[dict[str, Any]]:
    """All settings: "name", "section" (data, model, sampler, run), "unit", "default", "help"."""
    keys = _topometric.keys()
    known = sorted({key["section"] for key in keys})
    if section is not None and section not in known:
        raise refuse("section", repr(section), f"one of {', '.join(known)}")
    return [key for key in keys if section is None or key["section"] == section]


def sample(detections: Any, **settings: Any) -> Sample:
    """Samples the posterior over topologies: which detections are of one landmark.

    detections: positions (n, 2) in metres, `Detections`, or the path of a detections CSV.
    Settings are those of `ptm sample`: sigma_o, sigma_t (m), penalty_radius (m), penalty_height
    (nats), samples, chains, seed, until="converged", … Runs on all cores; Ctrl-C ends it.
    """
    data = as_detections(detections)
    return Sample(_topometric.sample(data._inner, settings_texts(settings)), data)


class Sample(Found):
    """Chains on detections: what they found, and whether they converged."""

    def __init__(self, inner: Any, detections: Detections) -> None:
        self._inner = inner
        self._title = f"{len(detections)} detections"
        #: The detections.
        self.detections = detections

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._inner.saved(), self.detections)

    def _summary(self) -> str:
        return self._inner.summary("sample")

    @cached_property
    def _series(self) -> dict[str, Any]:
        return self._inner.series()

    @property
    def n_sets(self) -> np.ndarray:
        """M after each proposal that is left after the burn-in: (chain, draw)."""
        return self._series["n_sets"]

    @property
    def ln_target(self) -> np.ndarray:
        """ln P(T) + ln Z(T) there: (chain, draw), nats."""
        return self._series["ln_target"]

    def draws(self, most: int = 1000) -> np.ndarray:
        """Label vectors at even steps after the burn-in: (chain, draw, detection)."""
        return self._inner.labels(whole("most", most, 1))

    def to_datatree(self, most_labels: int = 1000) -> Any:
        """An xarray.DataTree for ArviZ 1.x: n_sets, topology and labels in `posterior`, ln target
        as `lp` in `sample_stats`. `labels` has draws of its own, at most `most_labels`."""
        import xarray

        series, labels = self._series, self.draws(most_labels)
        dims = ("chain", "draw")
        step = series["first_step"] + series["every"] * np.arange(1, self.n_sets.shape[1] + 1)
        coords = {"chain": np.arange(self.n_sets.shape[0]), "draw": np.arange(len(step))}
        posterior = xarray.Dataset(
            {"n_sets": (dims, self.n_sets), "topology": (dims, series["topology"])},
            coords={**coords, "proposal": ("draw", step)},
            attrs={
                "topologies": series["topologies"],
                "created_by": f"topometric {_topometric.__version__}",
            },
        )
        stats = xarray.Dataset({"lp": (dims, self.ln_target)}, coords=coords)
        drawn = xarray.Dataset({"labels": (("chain", "draw", "detection"), labels)})
        data = xarray.Dataset({"positions": (("detection", "axis"), self.detections.positions)})
        groups = {
            "posterior": posterior,
            "sample_stats": stats,
            "labels": drawn,
            "observed_data": data,
        }
        return xarray.DataTree.from_dict(groups)

    def to_polars(self) -> Any:
        """A row for each chain and draw: chain, draw, n_sets, ln_target, topology."""
        return frame(self._columns(), "polars")

    def to_pandas(self) -> Any:
        """The same as a pandas table."""
        return frame(self._columns(), "pandas")

    def _columns(self) -> dict[str, np.ndarray]:
        n_chains, n_draws = self.n_sets.shape
        return {
            "chain": np.repeat(np.arange(n_chains), n_draws),
            "draw": np.tile(np.arange(n_draws), n_chains),
            "n_sets": self.n_sets.ravel(),
            "ln_target": self.ln_target.ravel(),
            "topology": self._series["topology"].ravel(),
        }

    def map(self, estimate: str | np.ndarray = "map") -> Any:
        """The topometric map of an estimate, or of any labels, as a networkx.Graph.

        Nodes are landmarks: pos (m), covariance (xx, xy, yy, m²), members, probability. Edges join
        landmarks that the mission saw one after the other: weight (passes), support (probability).
        """
        import networkx

        labels = self.labels(estimate) if isinstance(estimate, str) else np.asarray(estimate)
        if labels.ndim != 1 or labels.dtype.kind not in "iu":
            raise refuse("labels", f"{labels.dtype} of shape {labels.shape}", "whole numbers (n,)")
        found = self._inner.map([int(label) for label in labels])
        graph = networkx.Graph()
        for number, node in enumerate(found["nodes"]):
            place = {"pos": tuple(node.pop("position"))}
            graph.add_node(number, **place, **node)
        for edge in found["edges"]:
            graph.add_edge(edge.pop("first"), edge.pop("second"), **edge)
        return graph

    def to_rerun(self, path: str | os.PathLike[str], estimate: str = "map") -> None:
        """The map of an estimate for the Rerun viewer: `rerun FILE.rrd`. Needs rerun-sdk."""
        from ._rerun import write_map

        graph, labels = self.map(estimate), self.labels(estimate)
        write_map(path, graph, self.detections.positions, labels)


def _restored(saved: bytes, detections: Detections) -> Sample:
    return Sample(_topometric.Sampled.restored(saved, detections._inner), detections)


def exact(
    detections: Any,
    tolerance: float | None = None,
    max_draws: float | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """The posterior of at most twelve detections by enumeration, as `ptm exact --json` writes it.

    "partitions" are by falling probability; "accuracy" says how far they may be off. Up to ten
    detections take seconds to minutes; Ctrl-C ends it.
    """
    data = as_detections(detections)
    tolerance, max_draws = positive("tolerance", tolerance), positive("max_draws", max_draws)
    return _topometric.exact(data._inner, tolerance, max_draws, settings_texts(settings))


def tune(
    detections: Any,
    model: str = "metric",
    sensor_noise: float | None = None,
    simulate: bool = True,
    seed: int = 1,
) -> dict[str, Any]:
    """Settings for detections of unknown truth, as `ptm tune --json` writes them.

    `sample(detections, **tune(detections)["settings"])` uses them. sensor_noise: what a single
    detection errs by at least, m. `simulate=False` is faster; Ctrl-C ends it.
    """
    sensor_noise, seed = positive("sensor_noise", sensor_noise, " (m)"), whole("seed", seed, 0)
    return _topometric.tune(as_detections(detections)._inner, model, sensor_noise, simulate, seed)


def evaluate(
    data: Mapping[str, Any] | list[Any], tune: bool = False, **settings: Any
) -> dict[str, Any]:
    """The posterior on detections of known truth beside plain clusterings, as in evaluation.json.

    data: detections by name, or a list of them: one for each window or world. tune: take σ_o, σ_t,
    radius and height of each from `tune`.
    """
    if isinstance(data, (Detections, str, os.PathLike)):
        data = [data]
    named = data.items() if isinstance(data, Mapping) else enumerate(data, start=1)
    sets = [(str(name), as_detections(own)._inner) for name, own in named]
    if not sets:
        raise refuse("data", "none", "detections of at least one window or world")
    return _topometric.evaluate(sets, tune, settings_texts(settings))
