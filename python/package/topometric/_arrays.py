"""What a user gives, as arrays and texts of the types that the library takes."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np

from ._topometric import Error


def refuse(name: str, got: str, expected: str) -> Error:
    """One line: what, got, expected."""
    return Error(f"{name}: got {got}, expected {expected}")


def floats(name: str, values: Any, shape: tuple[int | None, ...], words: str) -> np.ndarray:
    """An array of float64 with this shape; None stands for any length."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", np.exceptions.ComplexWarning)
            array = np.ascontiguousarray(values, dtype=np.float64)
    except np.exceptions.ComplexWarning:
        raise refuse(name, "complex numbers", words) from None
    except (TypeError, ValueError) as wrong:
        raise refuse(name, f"no array of numbers ({wrong})", words) from None
    if np.ndim(values) == 0:
        raise refuse(name, repr(values), words)
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape)
    )
    if not fits:
        raise refuse(name, f"shape {array.shape}", words)
    return array


def whole(name: str, value: Any, least: int) -> int:
    """A whole number of at least so much."""
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and value >= least:
        return int(value)
    raise refuse(name, repr(value), f"a whole number from {least}")


def positive(name: str, value: float | None, unit: str = "") -> float | None:
    """A number above 0, or None."""
    if value is None:
        return None
    number = isinstance(value, (int, float, np.integer, np.floating))
    if number and np.isfinite(value) and value > 0:
        return float(value)
    raise refuse(name, repr(value), f"a number > 0{unit}")


def path_text(name: str, value: Any) -> str:
    """A path as a text."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    raise refuse(name, f"a {type(value).__name__}", "a path")


def settings_texts(settings: dict[str, Any]) -> list[tuple[str, str]]:
    """Settings by name as the program reads them."""
    return [(name, _text(name, value)) for name, value in settings.items()]


def flags(options: dict[str, Any]) -> list[str]:
    """Options as flags of the program: `range_noise=0.1` is `--range-noise 0.1`."""
    given: list[str] = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            given.append(flag)
        elif value is not None and value is not False:
            given.append(f"{flag}={_text(name, value)}")
    return given


def _text(name: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "on" if value else "off"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise refuse(name, f"a {type(value).__name__}", "a number or a text")


def frame(columns: dict[str, Any], library: str) -> Any:
    """Columns as a table of Polars, or of pandas through Arrow."""
    if library == "polars":
        import polars

        return polars.DataFrame(columns)
    import pyarrow

    # Arrow takes NumPy's memory as it is.
    return pyarrow.table(columns).to_pandas()
