"""Recordings for the Rerun viewer (`rerun FILE.rrd`), through its own package."""

from __future__ import annotations

import os
from typing import Any

import numpy as np


def write_map(path: str | os.PathLike[str], graph: Any, positions: Any, labels: Any) -> None:
    """Detections in the colours of their sets, landmarks with their doubt, and the edges."""
    import rerun

    recording = rerun.RecordingStream("topometric")
    recording.save(os.fspath(path))
    classes = np.asarray(labels, dtype=np.uint16)
    recording.log("detections", rerun.Points2D(positions, class_ids=classes), static=True)
    nodes = sorted(graph.nodes(data=True))
    recording.log(
        "map/landmarks",
        rerun.Points2D(
            [node["pos"] for _, node in nodes],
            # One standard deviation of the place, on average over directions, m.
            radii=[
                np.sqrt((node["covariance"][0] + node["covariance"][2]) / 2) for _, node in nodes
            ],
            labels=[f"{number}: {node['probability']:.2f}" for number, node in nodes],
        ),
        static=True,
    )
    edges = [(a, b, edge["support"]) for a, b, edge in graph.edges(data=True)]
    recording.log(
        "map/edges",
        rerun.LineStrips2D(
            [[graph.nodes[a]["pos"], graph.nodes[b]["pos"]] for a, b, _ in edges],
            labels=[f"{support:.2f}" for _, _, support in edges],
            show_labels=False,
        ),
        static=True,
    )
    recording.flush()


def write_mission(path: str | os.PathLike[str], trajectory: np.ndarray, landmarks: Any) -> None:
    """The way of the robot, pose by pose in time, and the landmarks."""
    import rerun

    recording = rerun.RecordingStream("topometric")
    recording.save(os.fspath(path))
    recording.log("landmarks", rerun.Points2D(landmarks), static=True)
    recording.log("way", rerun.LineStrips2D([trajectory[:, 1:3]]), static=True)
    for time, x, y in trajectory[:, :3]:
        recording.set_time("time", duration=float(time))
        recording.log("robot", rerun.Points2D([[x, y]]))
    recording.flush()
