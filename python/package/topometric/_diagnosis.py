"""The verdict for chains of partitions that any program drew."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _topometric
from ._arrays import path_text, refuse, whole
from ._labelled import chain_by_draw, label_array
from ._results import Found

#: Steps that a draw can stand for.
MAX_WEIGHT = 1e12


def diagnose(
    labels: Any,
    weights: Any = None,
    ln_target: Any = None,
    burn_in: int | str = "auto",
    max_topologies: int = 100_000,
    variable: str | None = None,
) -> Diagnosis:
    """Judges chains of label vectors: have they converged, and to what?

    labels: an array (chain, draw, item) or (draw, item); a list of arrays (draw, item), which may
    differ in length; or the path of a CSV, JSON or Parquet file, or several. Items with one label
    share a set; labels are whole numbers or texts and need not be canonical. Or what ArviZ holds:
    a DataTree, Dataset or DataArray of xarray (or InferenceData), dimensions chain, draw and item.
    variable: its name there; `labels`, or the only one of such dimensions, if nothing is said.
    weights: how many steps each draw stands for, (chain, draw) or a list of (draw,).
    ln_target: ln of the target density, in the same form.
    burn_in: draws left out of each chain, or "auto" (MSER).
    """
    labels = label_array(labels, variable)
    weights, ln_target = chain_by_draw(weights), chain_by_draw(ln_target)
    if isinstance(labels, (str, os.PathLike)):
        labels = [labels]
    max_topologies = whole("max_topologies", max_topologies, 1)
    if isinstance(labels, (list, tuple)) and any(
        isinstance(own, (str, os.PathLike)) for own in labels
    ):
        files = [path_text("labels", file) for file in labels]
        if weights is not None or ln_target is not None:
            given = "weights" if weights is not None else "ln_target"
            raise refuse(
                given, "a value beside files", f"the column {given.removesuffix('s')} in them"
            )
        return Diagnosis(_topometric.diagnose_files(files, str(burn_in), max_topologies), files[0])
    chains = [_whole(own, number) for number, own in enumerate(_by_chain(labels), start=1)]
    weights = _beside("weights", weights, chains, np.uint64)
    ln_target = _beside("ln_target", ln_target, chains, np.float64)
    inner = _topometric.diagnose(
        list(zip(chains, weights, ln_target)), str(burn_in), max_topologies
    )
    return Diagnosis(inner, f"{len(chains)} chains")


class Diagnosis(Found):
    """Chains of partitions, judged."""

    def __init__(self, inner: Any, title: str) -> None:
        self._inner = inner
        self._title = title

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._inner.saved(), self.n_left_out, self._title)

    def _summary(self) -> str:
        return self._inner.summary()

    def html(self, title: str | None = None) -> str:
        """A page with all of it: one file that needs no network."""
        return self._inner.page(title or self._title)

    @property
    def n_left_out(self) -> int:
        """Draws at the ends of longer chains that were left out."""
        return self._inner.n_left_out


def _restored(saved: bytes, n_left_out: int, title: str) -> Diagnosis:
    return Diagnosis(_topometric.Diagnosed.restored(saved, n_left_out), title)


def _by_chain(labels: Any) -> Sequence[Any]:
    expected = "(chain, draw, item), (draw, item), or a list of arrays (draw, item)"
    if isinstance(labels, (list, tuple)) and labels and np.ndim(labels[0]) == 2:
        return labels
    try:
        array = labels if isinstance(labels, np.ma.MaskedArray) else np.asarray(labels)
    except ValueError as wrong:
        raise refuse("labels", f"no array ({wrong})", expected) from None
    if array.ndim == 2:
        return [array]
    if array.ndim == 3:
        return list(array)
    raise refuse("labels", f"shape {array.shape}", expected)


def _whole(labels: Any, number: int) -> np.ndarray:
    name, expected = f"labels of chain {number}", "whole numbers or texts"
    if np.ma.is_masked(labels):
        raise refuse(name, "masked labels", "a label for every item")
    array = np.asarray(labels)
    if array.ndim != 2:
        raise refuse(name, f"shape {array.shape}", "(draw, item)")
    if 0 in array.shape:
        raise refuse(name, f"shape {array.shape}", "at least one draw of at least one item")
    if array.dtype.kind in "iu":
        return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))
    if array.dtype == bool:
        return array.astype(np.int8)
    if array.dtype.kind == "f":
        if np.isnan(array).any():
            raise refuse(name, "NaN", "a label for every item")
        # Above 2^53 neighbouring whole numbers are one float.
        if np.all(np.mod(array, 1) == 0) and np.all(np.abs(array) <= 2**53):
            return np.ascontiguousarray(array, dtype=np.int64)
        raise refuse(name, f"numbers of dtype {array.dtype} that are not whole", expected)
    if array.dtype.kind in "US":
        _, codes = np.unique(array, return_inverse=True)
        return np.ascontiguousarray(codes.reshape(array.shape), dtype=np.int64)
    if array.dtype == object:
        codes_of: dict[Any, int] = {}
        if any(value is None or value != value for value in array.flat):
            raise refuse(name, "None or NaN", "a label for every item")
        numbers = [codes_of.setdefault(value, len(codes_of)) for value in array.flat]
        return np.array(numbers, dtype=np.int64).reshape(array.shape)
    raise refuse(name, f"dtype {array.dtype}", expected)


def _beside(name: str, values: Any, chains: list[np.ndarray], dtype: Any) -> list[Any]:
    if values is None:
        return [None] * len(chains)
    if np.ndim(values) == 0 and not isinstance(values, (list, tuple)):
        raise refuse(name, repr(values), "an array (chain, draw), or a list of arrays (draw,)")
    if len(chains) == 1 and np.ndim(values) == 1:
        values = [values]
    if len(values) != len(chains):
        raise refuse(name, f"{len(values)} chains", f"{len(chains)}")
    found = []
    for number, (own, chain) in enumerate(zip(values, chains), start=1):
        array, of = np.asarray(own), f"{name} of chain {number}"
        if array.shape != (len(chain),):
            raise refuse(of, f"shape {array.shape}", f"({len(chain)},)")
        if dtype is np.uint64:
            fits = array.dtype.kind in "iuf" and np.all(np.mod(array, 1) == 0)
            if not (fits and np.all(array >= 1) and np.all(array <= MAX_WEIGHT)):
                low, high = (array.min(), array.max()) if array.dtype.kind in "iuf" else ("?", "?")
                raise refuse(of, f"values from {low} to {high}", "whole numbers from 1 to 1e12")
        elif array.dtype.kind not in "iuf":
            raise refuse(of, f"dtype {array.dtype}", "numbers")
        found.append(np.ascontiguousarray(array, dtype=dtype))
    return found
