"""The verdict for chains of partitions that any program drew."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _topometric
from ._arrays import refuse
from ._results import Found


def diagnose(
    labels: Any,
    weights: Any = None,
    ln_target: Any = None,
    burn_in: int | str = "auto",
    max_topologies: int = 100_000,
) -> Diagnosis:
    """Judges chains of label vectors: have they converged, and to what?

    labels: an array (chain, draw, item) or (draw, item); a list of arrays (draw, item), which may
    differ in length; or the path of a CSV, JSON or Parquet file, or several. Items with one label
    share a set; labels are whole numbers or texts and need not be canonical.
    weights: how many steps each draw stands for, (chain, draw) or a list of (draw,).
    ln_target: ln of the target density, in the same form.
    burn_in: draws left out of each chain, or "auto" (MSER).
    """
    if isinstance(labels, (str, os.PathLike)):
        labels = [labels]
    if isinstance(labels, (list, tuple)) and labels and isinstance(labels[0], (str, os.PathLike)):
        files = [os.fspath(file) for file in labels]
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

    def _summary(self) -> str:
        return self._inner.summary()

    def html(self, title: str | None = None) -> str:
        """A page with all of it: one file that needs no network."""
        return self._inner.page(title or self._title)

    @property
    def n_left_out(self) -> int:
        """Draws at the ends of longer chains that were left out."""
        return self._inner.n_left_out


def _by_chain(labels: Any) -> Sequence[Any]:
    if isinstance(labels, (list, tuple)) and labels and np.ndim(labels[0]) == 2:
        return labels
    array = np.asarray(labels)
    if array.ndim == 2:
        return [array]
    if array.ndim == 3:
        return list(array)
    expected = "(chain, draw, item), (draw, item), or a list of arrays (draw, item)"
    raise refuse("labels", f"shape {array.shape}", expected)


def _whole(labels: Any, number: int) -> np.ndarray:
    array = np.asarray(labels)
    if array.dtype.kind in "iu":
        return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))
    if array.dtype == bool:
        return array.astype(np.int8)
    if array.dtype.kind == "f" and np.all(np.mod(array, 1) == 0):
        return np.ascontiguousarray(array, dtype=np.int64)
    if array.dtype.kind in "US" or array.dtype == object:
        _, codes = np.unique(array.astype(str), return_inverse=True)
        return np.ascontiguousarray(codes.reshape(array.shape), dtype=np.int64)
    raise refuse(f"labels of chain {number}", f"dtype {array.dtype}", "whole numbers or texts")


def _beside(name: str, values: Any, chains: list[np.ndarray], dtype: Any) -> list[Any]:
    if values is None:
        return [None] * len(chains)
    if len(chains) == 1 and np.ndim(values) == 1:
        values = [values]
    if len(values) != len(chains):
        raise refuse(name, f"{len(values)} chains", f"{len(chains)}")
    found = []
    for number, (own, chain) in enumerate(zip(values, chains), start=1):
        array = np.asarray(own)
        if array.shape != (len(chain),):
            raise refuse(f"{name} of chain {number}", f"shape {array.shape}", f"({len(chain)},)")
        if dtype is np.uint64 and not (np.all(np.mod(array, 1) == 0) and np.all(array >= 1)):
            raise refuse(f"{name} of chain {number}", "others", "whole numbers from 1")
        found.append(np.ascontiguousarray(array, dtype=dtype))
    return found
