"""Data that several tests use, and the program that the package brings."""

import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

PAIRS = np.array(
    [
        [0.0, 0.0],
        [0.8, 0.3],
        [9.0, 0.1],
        [9.4, -0.5],
        [9.1, 8.8],
        [8.7, 9.4],
        [0.1, 9.2],
        [-0.4, 9.0],
    ]
)


@pytest.fixture
def pairs() -> np.ndarray:
    """Four corners, each seen twice, metres."""
    return PAIRS.copy()


@pytest.fixture
def ptm(tmp_path):
    """Runs the program in the test's folder; returns what it printed."""

    def run(*arguments: str) -> str:
        command = [sys.executable, "-m", "topometric", *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def needs(module: str):
    """The module, or a skip that says what is missing."""
    return pytest.importorskip(module, reason=f"{module} is not installed")


def interrupted(code: str) -> str:
    """What Python says of code that is ended by Ctrl-C a second after it has printed "begun"."""
    running = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert running.stdout is not None and running.stdout.readline() == "begun\n"
    time.sleep(1.0)
    assert running.poll() is None, "it is still at work"
    running.send_signal(signal.SIGINT)
    return running.communicate(timeout=60)[1]
