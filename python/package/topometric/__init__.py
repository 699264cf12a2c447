"""Posteriors over set partitions of landmark detections, and a verdict for any chain of partitions.

    >>> import numpy as np, topometric as tm
    >>> positions = np.array([[0, 0], [0.8, 0.3], [9, 0.1], [9.4, -0.5]])  # metres
    >>> found = tm.sample(positions, penalty_radius=3, samples=2000)
    >>> found.labels("map").tolist()
    [0, 0, 1, 1]
    >>> found.converged
    True

Settings have the names, units and defaults of the program `ptm`; `tm.settings()` lists them.
Lengths are metres, angles radians, times seconds. Whatever is wrong raises `topometric.Error` with
the program's words.
"""

from ._detections import Detections, import_recording, simulate
from ._diagnosis import Diagnosis, diagnose
from ._report import Report, Solution, load, solve, sweep
from ._sample import Sample, evaluate, exact, sample, settings, tune
from ._topometric import Error, __version__

__all__ = [
    "Detections",
    "Diagnosis",
    "Error",
    "Report",
    "Sample",
    "Solution",
    "__version__",
    "diagnose",
    "evaluate",
    "exact",
    "import_recording",
    "load",
    "sample",
    "settings",
    "simulate",
    "solve",
    "sweep",
    "tune",
]
