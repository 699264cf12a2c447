"""Sweeps with their reports, and whole missions."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _topometric
from ._arrays import flags, path_text, positive, refuse


def run_program(arguments: list[str]) -> None:
    """Runs `ptm` in a process of its own; what it complains of is raised."""
    command = [sys.executable, "-m", "topometric", *arguments]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    said = done.stderr.strip()
    if done.returncode == 0:
        if said:
            warnings.warn(said, stacklevel=3)
        return
    last = said.splitlines()[-1] if said else f"ptm ended with exit code {done.returncode}"
    raise _topometric.Error(last.removeprefix("ptm: "))


class _Bar:
    """A line that says how far a sweep is: in notebooks and on terminals it is overwritten."""

    def __call__(self, done: int, chains: int, failed: int, note: str | None) -> None:
        if note is not None:
            print(f"\r{note}", file=sys.stderr)
            return
        words = f"\r{done} of {chains} chains" + (f", {failed} failed" if failed else "")
        print(words, end="\n" if done == chains else "", file=sys.stderr, flush=True)


def sweep(
    file: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    data: str | os.PathLike[str] | None = None,
    force: bool = False,
    all_cells: bool = False,
    max_seconds: float | None = None,
    progress: Callable[[int, int, int, str | None], None] | bool = True,
) -> Report:
    """Runs a sweep file and writes its report; what the folder holds already is not run again.

    out: the folder [default: reports/NAME]. data: a detections CSV in place of the file's worlds.
    force: replace what another sweep left there. all_cells: draw the chains of every cell.
    max_seconds: end a chain that takes longer, as one that failed. progress: True for a line on
    standard error, or a function of (chains done, chains to run, chains failed, note or None).
    Ctrl-C ends it; what is finished is kept, and the same call goes on.
    """
    max_seconds = positive("max_seconds", max_seconds, " (s)")
    hears = _Bar() if progress is True else (progress or None)
    index, _ = _topometric.sweep(
        path_text("file", file), _path(data), _path(out), force, all_cells, max_seconds, hears
    )
    return load(Path(index).parent)


def _path(given: str | os.PathLike[str] | None) -> str | None:
    return None if given is None else path_text("path", given)


def load(folder: str | os.PathLike[str]) -> Report:
    """The report of a sweep that was run."""
    return Report(Path(path_text("folder", folder)))


class Report:
    """The report of a sweep: its tables and pages."""

    def __init__(self, folder: Path) -> None:
        #: The folder.
        self.folder = folder
        run = folder / "run.json"
        if not run.is_file():
            raise _topometric.Error(
                f"{folder}: got no run.json, expected the folder of a sweep; run topometric.sweep"
            )
        self.run: dict[str, Any] = json.loads(run.read_text(encoding="utf-8"))

    @property
    def index(self) -> Path:
        """The page that opens the report."""
        return self.folder / "index.html"

    @property
    def tables(self) -> list[str]:
        """The names of its tables."""
        return sorted(path.stem for path in self.folder.glob("*.parquet"))

    @cached_property
    def cells(self) -> Any:
        """A row for each cell, as a Polars or pandas table."""
        return self.table("cells")

    @cached_property
    def chains(self) -> Any:
        """A row for each chain."""
        return self.table("chains")

    def table(self, name: str, library: str | None = None) -> Any:
        """A table by name: Polars if it is installed, pandas otherwise, or as `library` says."""
        if library not in (None, "polars", "pandas"):
            raise refuse("library", repr(library), "polars or pandas")
        path = self.folder / f"{name}.parquet"
        if not path.is_file():
            known = ", ".join(self.tables)
            raise _topometric.Error(
                f"{self.folder}: got no table {name!r}, expected one of {known}"
            )
        if library != "pandas":
            try:
                import polars

                return polars.read_parquet(path)
            except ImportError:
                if library == "polars":
                    raise
        import pandas

        return pandas.read_parquet(path)

    @property
    def figures(self) -> list[Path]:
        """The pictures of its first page, PNG."""
        return sorted((self.folder / "figures").glob("*.png"))

    def __repr__(self) -> str:
        return f"Report({str(self.folder)!r}, {self.run.get('chains_done')} chains)"

    def _repr_markdown_(self) -> str:
        return (
            (self.folder / "report.md")
            .read_text(encoding="utf-8")
            .replace("](figures/", f"]({self.folder}/figures/")
        )


def solve(
    recording: str | os.PathLike[str], out: str | os.PathLike[str], **options: Any
) -> Solution:
    """Solves a whole mission: which sightings are of one landmark, poses and map, as a graph.

    Options are the flags of `ptm solve`, as in `solve("graph.g2o", "solved", sweeps=50)`. The
    program does the work and writes the folder `out`; Ctrl-C ends it.
    """
    run_program(["-q", "solve", os.fspath(recording), "--out", os.fspath(out), *flags(options)])
    return Solution(Path(out))


class Solution:
    """The folder of a solved mission."""

    def __init__(self, folder: Path) -> None:
        #: The folder: graph.g2o, trajectory.tum, sightings.csv and maps.
        self.folder = folder
        #: summary.json: poses, sightings, landmarks, log posterior, χ².
        self.summary: dict[str, Any] = json.loads(
            (folder / "summary.json").read_text(encoding="utf-8")
        )

    @cached_property
    def trajectory(self) -> Any:
        """(poses, 8): time (s), x, y, z (m), quaternion."""
        import numpy

        return numpy.loadtxt(self.folder / "trajectory.tum", ndmin=2)

    def map(self) -> Any:
        """The map as a networkx.Graph."""
        import networkx

        return networkx.read_graphml(self.folder / "map.graphml")

    def to_rerun(self, path: str | os.PathLike[str]) -> None:
        """Way and landmarks for the Rerun viewer: `rerun FILE.rrd`. Needs rerun-sdk."""
        from ._rerun import write_mission

        places = [(float(node["x"]), float(node["y"])) for _, node in self.map().nodes(data=True)]
        write_mission(path, self.trajectory, places)

    def __repr__(self) -> str:
        words = ", ".join(
            f"{self.summary[key]} {key}" for key in ("poses", "sightings", "landmarks")
        )
        return f"Solution({str(self.folder)!r}: {words})"
