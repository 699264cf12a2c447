"""Detections: arrays, CSV files, simulated missions, recordings."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _topometric
from ._arrays import flags, floats, path_text, refuse, settings_texts, whole


class Detections:
    """Detections of landmarks, in the order of the mission; checked once, never changed.

    positions: (n, 2), metres. covariances: (n, 2, 2) of the positions, m². times: (n,) or (n, 2),
    seconds, of the first and the last sighting of each. landmarks: (n,) the true landmark of each,
    whole numbers or names; -1, None or NaN where it is not known. It is never used to sample.
    corners: (n,) "open", "closed" or None.
    """

    def __init__(
        self,
        positions: Any,
        covariances: Any = None,
        times: Any = None,
        landmarks: Any = None,
        corners: Sequence[str | None] | None = None,
    ) -> None:
        positions = floats("positions", positions, (None, 2), "an array (n, 2), metres")
        n = len(positions)
        if covariances is not None:
            words = f"an array ({n}, 2, 2), m²"
            covariances = floats("covariances", covariances, (n, 2, 2), words)
            if not np.array_equal(covariances[:, 0, 1], covariances[:, 1, 0]):
                raise refuse("covariances", "a matrix that is not symmetric", words)
        if times is not None:
            words = f"an array ({n},) or ({n}, 2), seconds"
            if np.ndim(times) == 1:
                once = floats("times", times, (n,), words)
                times = np.stack([once, once], axis=1)
            times = floats("times", times, (n, 2), words)
        names: list[str] = []
        if landmarks is not None:
            landmarks, names = _landmarks(landmarks, n)
        if corners is not None and len(corners) != n:
            raise refuse("corners", f"{len(corners)}", f"{n}, one for each detection")
        kinds = None if corners is None else [_kind(kind) for kind in corners]
        self._inner = _topometric.Detections(positions, covariances, times, landmarks, names, kinds)

    @classmethod
    def _of(cls, inner: _topometric.Detections) -> Detections:
        self = cls.__new__(cls)
        self._inner = inner
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._inner.saved(),)

    @classmethod
    def read_csv(cls, path: str | os.PathLike[str]) -> Detections:
        """Those of a detections CSV; what its reader put up with is warned of."""
        inner, notes = _topometric.Detections.read(path_text("path", path))
        for note in notes:
            warnings.warn(f"{os.fspath(path)}: {note}", stacklevel=2)
        return cls._of(inner)

    def to_csv(self) -> str:
        """The text of a detections CSV."""
        return self._inner.csv()

    def __len__(self) -> int:
        return len(self._inner)

    @property
    def positions(self) -> np.ndarray:
        """Where each is: (n, 2), metres."""
        return self._inner.positions

    @property
    def covariances(self) -> np.ndarray | None:
        """Covariances of the positions: (n, 2, 2), m²; None without."""
        return self._inner.covariances

    @property
    def times(self) -> np.ndarray:
        """Of the first and the last sighting of each: (n, 2), seconds; NaN if not known."""
        return self._inner.times

    @property
    def landmarks(self) -> np.ndarray:
        """The true landmark of each: (n,); -1 where it is not known."""
        return self._inner.landmarks

    @property
    def landmark_names(self) -> list[str]:
        """The names of landmarks 0, 1, …"""
        return self._inner.landmark_names

    @property
    def corners(self) -> list[str | None]:
        """What each corner looked like: "open", "closed", or None where it is not known."""
        return self._inner.corners

    def png(self, title: str | None = None) -> bytes:
        """A picture of them, with the world that they were simulated in."""
        return self._inner.png(title or repr(self))

    def __repr__(self) -> str:
        n_landmarks = len(set(self.landmarks.tolist()) - {-1})
        truth = f" of {n_landmarks} known landmarks" if n_landmarks else ""
        return f"{len(self)} detections{truth}"

    def _repr_png_(self) -> bytes:
        return self.png()


def _restored(saved: bytes) -> Detections:
    return Detections._of(_topometric.Detections.restored(saved))


def _kind(kind: Any) -> str | None:
    if kind is None or kind == "" or kind != kind:
        return None
    if isinstance(kind, str):
        return str(kind)
    raise refuse("corners", repr(kind), "open, closed or None")


def _landmarks(landmarks: Any, n: int) -> tuple[np.ndarray, list[str]]:
    expected = f"{n} whole numbers or names, one for each detection"
    if np.ndim(landmarks) != 1:
        raise refuse("landmarks", f"an array of {np.ndim(landmarks)} dimensions", expected)
    values = [None if _unknown(value) else value for value in landmarks]
    if len(values) != n:
        raise refuse("landmarks", f"{len(values)}", expected)
    known = [value for value in values if value is not None]
    if any(isinstance(value, str) for value in known):
        names: dict[str, int] = {}
        numbers = [
            -1 if value is None else names.setdefault(str(value), len(names)) for value in values
        ]
        return np.array(numbers, dtype=np.int64), list(names)
    if any(int(value) != value for value in known):
        raise refuse("landmarks", "numbers that are not whole", expected)
    if any(value >= 2**63 for value in known):
        raise refuse("landmarks", "numbers of 2^63 or more", expected)
    numbers = [-1 if value is None else int(value) for value in values]
    return np.array(numbers, dtype=np.int64), []


def _unknown(value: Any) -> bool:
    if value is None:
        return True
    if isinstance(value, str):
        return value == ""
    return bool(value != value or value < 0)


def as_detections(data: Any) -> Detections:
    """Detections as they are, of a CSV, or of an array of positions."""
    if isinstance(data, Detections):
        return data
    if isinstance(data, (str, os.PathLike)):
        return Detections.read_csv(data)
    return Detections(data)


def simulate(replicate: int = 1, **settings: Any) -> Detections:
    """The detections of one simulated mission in a polygonal world, with their true landmarks.

    Settings are those of `ptm simulate`, as in `simulate(world="office", noise=0.5, seed=3)`;
    `replicate` says which of the worlds that a sweep of this seed would simulate, from 1.
    """
    return Detections._of(
        _topometric.simulate(settings_texts(settings), whole("replicate", replicate, 1))
    )


def import_recording(path: str | os.PathLike[str], **options: Any) -> Detections:
    """The detections of a recording (MRCLAM folder, g2o graph, range-bearing CSV).

    Options are the flags of `ptm import`, as in `import_recording("log.csv", range_noise=0.1,
    align=True)`. The program does the work; it is ended by Ctrl-C.
    """
    from ._report import run_program

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "detections.csv")
        run_program(["-q", "import", os.fspath(path), "--out", os.fspath(out), *flags(options)])
        return Detections.read_csv(out)
