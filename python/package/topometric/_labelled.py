"""Label vectors out of what xarray and ArviZ hold; neither needs to be installed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ._arrays import refuse

#: What label vectors are called where nothing is said.
DEFAULT = "labels"


def label_array(labels: Any, variable: str | None) -> Any:
    """The values (chain, draw, item) or (draw, item) of a DataTree, Dataset or DataArray.

    Anything else is given back as it is.
    """
    if _is_array(labels):
        return _values(labels, "labels")
    if not _is_held(labels):
        if variable is not None:
            got = f"{variable!r} beside a {type(labels).__name__}"
            raise refuse("variable", got, "a DataTree or Dataset of xarray")
        return labels
    held = list(_datasets(labels))
    name = DEFAULT if variable is None else variable
    for dataset in held:
        if name in dataset.data_vars:
            return _values(dataset[name], name)
    fitting = [dataset[own] for dataset in held for own in dataset.data_vars if _fits(dataset[own])]
    if variable is None and len(fitting) == 1:
        return _values(fitting[0], str(fitting[0].name))
    known = ", ".join(str(own) for dataset in held for own in dataset.data_vars) or "none"
    raise refuse("labels", f"no variable {name!r}", f"variable= one of those held ({known})")


def chain_by_draw(values: Any) -> Any:
    """The values (chain, draw) or (draw,) of a DataArray; anything else as it is."""
    if not _is_array(values):
        return values
    order = [dim for dim in ("chain", "draw") if dim in values.dims]
    if len(order) != len(values.dims) or "draw" not in order:
        raise refuse(str(values.name), f"dimensions {values.dims}", "chain and draw")
    return values.transpose(*order).values


def _is_of_xarray(what: Any, *names: str) -> bool:
    kinds = type(what).__mro__
    return any(own.__name__ in names and own.__module__.startswith("xarray.") for own in kinds)


def _is_array(what: Any) -> bool:
    return _is_of_xarray(what, "DataArray")


def _is_held(what: Any) -> bool:
    # ArviZ before 1.0 has a class of its own.
    is_inference_data = type(what).__name__ == "InferenceData" and hasattr(what, "groups")
    return is_inference_data or _is_of_xarray(what, "DataTree", "Dataset")


def _datasets(held: Any) -> Iterator[Any]:
    """Its groups, the posterior first."""
    if _is_of_xarray(held, "Dataset"):
        groups = {"": held}
    elif _is_of_xarray(held, "DataTree"):
        groups = {node.path.strip("/"): node.to_dataset() for node in held.subtree}
    else:
        groups = {name.strip("/"): held[name] for name in held.groups()}
    for _, dataset in sorted(groups.items(), key=lambda own: own[0] != "posterior"):
        yield dataset


def _fits(array: Any) -> bool:
    return len(array.dims) == 3 and {"chain", "draw"} < set(array.dims)


def _values(array: Any, name: str) -> Any:
    dims = [str(dim) for dim in array.dims]
    order = [dim for dim in ("chain", "draw") if dim in dims]
    items = [dim for dim in dims if dim not in order]
    if "draw" not in order or len(items) != 1:
        got = f"dimensions ({', '.join(dims)})"
        raise refuse(name, got, "chain, draw and one dimension of items")
    return array.transpose(*order, items[0]).values
