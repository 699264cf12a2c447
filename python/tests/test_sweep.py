"""Sweeps, reports, recordings and the notebooks."""

import pathlib
import pickle
import subprocess
import sys

import numpy as np
import pytest
import topometric as tm
from conftest import needs

SWEEP = """
title = "Small"
[data]
noise = 0.3
replicates = 2
[run]
samples = 300
chains = 2
[design]
kind = "grid"
[design.factors]
penalty_radius = [1, 10]
"""


def test_a_sweep_is_run_watched_and_loaded(tmp_path):
    (tmp_path / "small.toml").write_text(SWEEP)
    seen = []
    report = tm.sweep(
        tmp_path / "small.toml", tmp_path / "out", progress=lambda *now: seen.append(now)
    )
    assert seen[-1][:3] == (8, 8, 0)
    assert report.index.is_file() and report.figures
    assert {"cells", "chains", "topologies"} <= set(report.tables)
    needs("polars")
    assert report.cells.height == 2 and report.chains.height == 8
    needs("pandas"), needs("pyarrow")
    assert len(report.table("cells", library="pandas")) == 2
    assert "Small" in report._repr_markdown_()
    again = pickle.loads(pickle.dumps(report))
    assert again.run == report.run and again.folder == report.folder
    # Again: nothing is left to run.
    seen.clear()
    tm.sweep(tmp_path / "small.toml", tmp_path / "out", progress=lambda *now: seen.append(now))
    assert not any(now[1] for now in seen)
    with pytest.raises(tm.Error, match="got no table 'nothing'"):
        report.table("nothing")


def test_an_error_of_the_progress_function_ends_the_sweep_and_keeps_what_is_done(tmp_path):
    (tmp_path / "long.toml").write_text(SWEEP.replace("samples = 300", "samples = 300000"))

    def fails(*_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        tm.sweep(tmp_path / "long.toml", tmp_path / "out", progress=fails)
    assert (tmp_path / "out" / "journal.jsonl").is_file()


def test_what_is_wrong_with_a_sweep(tmp_path):
    (tmp_path / "bad.toml").write_text(SWEEP.replace("penalty_radius", "penalty_radios"))
    with pytest.raises(tm.Error, match="did you mean penalty_radius"):
        tm.sweep(tmp_path / "bad.toml", tmp_path / "out")
    with pytest.raises(tm.Error, match="got no run.json"):
        tm.load(tmp_path)


def recording(path: pathlib.Path) -> None:
    """A robot that drives along four landmarks and back, and sees each from both sides."""
    rng = np.random.default_rng(6)
    marks = np.array([[2.0, 1.5], [5.0, -1.5], [8.0, 1.5], [11.0, -1.5]])
    rows = ["t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id"]
    for step, x in enumerate([*np.arange(0, 13, 0.5), *np.arange(13, 0, -0.5)]):
        theta = 0.0 if step < 26 else np.pi
        near = [k for k, mark in enumerate(marks) if np.hypot(*(mark - [x, 0])) < 3]
        for k in near:
            dx, dy = marks[k] - [x, 0]
            bearing = np.arctan2(dy, dx) - theta
            bearing = np.arctan2(np.sin(bearing), np.cos(bearing)) + 0.01 * rng.normal()
            rows.append(
                f"{step},{x},0,{theta},{np.hypot(dx, dy) + 0.03 * rng.normal()},{bearing},{k}"
            )
        if not near:
            rows.append(f"{step},{x},0,{theta},,,")
    path.write_text("\n".join(rows) + "\n")


def test_recordings_are_imported_and_solved(tmp_path):
    recording(tmp_path / "log.csv")
    options = {
        "range_noise": 0.05,
        "bearing_noise": 0.02,
        "odometry_noise": 0.02,
        "heading_noise": 0.01,
    }
    detections = tm.import_recording(tmp_path / "log.csv", **options)
    assert len(detections) >= 4 and set(detections.landmarks) <= {-1, 0, 1, 2, 3}
    solved = tm.solve(tmp_path / "log.csv", tmp_path / "solved", **options)
    assert solved.summary["landmarks"] == 4 and solved.trajectory.shape[1] == 8
    assert pickle.loads(pickle.dumps(solved)).summary == solved.summary
    needs("networkx")
    assert solved.map().number_of_nodes() == 4
    with pytest.raises(tm.Error, match="robot"):
        tm.import_recording(tmp_path / "log.csv", robot=3)
    needs("rerun")
    solved.to_rerun(tmp_path / "mission.rrd")
    assert (tmp_path / "mission.rrd").read_bytes()[:3] == b"RRF"


STAMPED = """std_msgs/Header header
{fields}
===
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
===
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
===
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
===
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
===
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
ODOMETRY = (
    STAMPED.format(fields="string child_frame_id\ngeometry_msgs/PoseWithCovariance pose")
    + """===
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
"""
)


def mcap(path: pathlib.Path, frame: str) -> None:
    """A robot that drives 1 m a second to the north and sees two posts beside its way."""
    writer = needs("mcap_ros2.writer").Writer(str(path))
    odometry = writer.register_msgdef("nav_msgs/msg/Odometry", ODOMETRY)
    poses = writer.register_msgdef(
        "geometry_msgs/msg/PoseArray", STAMPED.format(fields="geometry_msgs/Pose[] poses")
    )
    turned = {"x": 0.0, "y": 0.0, "z": np.sqrt(0.5), "w": np.sqrt(0.5)}
    upright = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    for step in range(40):
        stamp = {"sec": 1000 + step // 4, "nanosec": step % 4 * 250_000_000}
        north = 0.25 * step
        place = {"position": {"x": 2.0, "y": north, "z": 0.0}, "orientation": turned}
        message = {
            "header": {"stamp": stamp, "frame_id": "odom"},
            "child_frame_id": "base_link",
            "pose": {"pose": place, "covariance": [0.0] * 36},
        }
        writer.write_message("/odom", odometry, message, log_time=2 * step, sequence=step)
        # One post at (1, 3) and one at (4, 7): ahead is north, left is west.
        near = [(y - north, 2.0 - x) for x, y in ((1, 3), (4, 7)) if abs(y - north) < 2]
        seen = [
            {"position": {"x": ahead, "y": left, "z": 0.3}, "orientation": upright}
            for ahead, left in near
        ]
        message = {"header": {"stamp": stamp, "frame_id": frame}, "poses": seen}
        writer.write_message("/posts", poses, message, log_time=2 * step + 1, sequence=step)
    writer.finish()


def test_a_recording_of_ros_2_becomes_scans_and_detections(tmp_path):
    needs("mcap_ros2")
    script = pathlib.Path(__file__).parent.parent / "examples" / "from_mcap.py"
    command = [sys.executable, str(script), "drive.mcap", "/odom", "/posts"]

    def converted() -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    mcap(tmp_path / "drive.mcap", "base_link")
    done = converted()
    assert done.returncode == 0, done.stderr
    (tmp_path / "scans.csv").write_text(done.stdout)
    found = tm.import_recording(tmp_path / "scans.csv", range_noise=0.05, bearing_noise=0.02)
    assert np.allclose(found.positions, [[1, 3], [4, 7]], atol=0.01), found.positions
    mcap(tmp_path / "drive.mcap", "map")
    done = converted()
    assert done.returncode == 1 and "got the frame 'map', expected 'base_link'" in done.stderr


NOTEBOOKS = sorted((pathlib.Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebooks_run(path, tmp_path):
    nbformat, nbclient = needs("nbformat"), needs("nbclient")
    needs("ipykernel"), needs("polars"), needs("networkx")
    notebook = nbformat.read(path, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()
    kinds = {
        kind
        for cell in notebook.cells
        for out in cell.get("outputs", [])
        for kind in out.get("data", {})
    }
    assert "image/png" in kinds, "a notebook shows a picture"
