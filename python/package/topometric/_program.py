"""The program `ptm`, as this package brings it."""

import signal
import sys

from . import _topometric


def main() -> None:
    """Runs `ptm` on the command line of this process."""
    # The program deals with Ctrl-C itself, and ends at once where it does not.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_topometric.program(["ptm", *sys.argv[1:]]))
