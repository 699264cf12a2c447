"""What a user gives, as arrays and texts of the types that the library takes."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ._topometric import Error


def refuse(name: str, got: str, expected: str) -> Error:
    """One line: what, got, expected."""
    return Error(f"{name}: got {got}, expected {expected}")


def floats(name: str, values: Any, shape: tuple[int | None, ...], words: str) -> np.ndarray:
    """An array of float64 with this shape; None stands for any length."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as wrong:
        raise refuse(name, f"no array of numbers ({wrong})", words) from None
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape)
    )
    if not fits:
        raise refuse(name, f"shape {array.shape}", words)
    return array


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
