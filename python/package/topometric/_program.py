"""The program `ptm`, as this package brings it."""

import sys

from . import _topometric


def main() -> None:
    """Runs `ptm` on the command line of this process."""
    sys.exit(_topometric.program(["ptm", *sys.argv[1:]]))
