"""What samples and diagnoses have in common: verdict, estimates, pictures."""

from __future__ import annotations

import base64
from functools import cached_property
from typing import Any

import numpy as np

from ._arrays import refuse


class Found:
    """Chains of partitions, judged."""

    _inner: Any
    _title: str

    @cached_property
    def result(self) -> dict[str, Any]:
        """All of it, as the program writes it as JSON."""
        return self._inner.result()

    @property
    def convergence(self) -> dict[str, Any] | None:
        """The verdict with its numbers; None if nothing is left after the burn-in."""
        return self.result["convergence"]

    @property
    def verdict(self) -> str:
        """ "mixes", "at-rest", "exact" or "not-shown"."""
        return self.convergence["verdict"] if self.convergence else "not-shown"

    @property
    def converged(self) -> bool:
        """Whether the verdict is that the chains have converged."""
        return self.verdict != "not-shown"

    @property
    def doubts(self) -> list[str]:
        """What speaks against it, in sentences."""
        return list(self.convergence["doubts"]) if self.convergence else []

    @property
    def topologies(self) -> list[dict[str, Any]]:
        """Topologies by falling count: "labels", "count", "frequency"."""
        return self.result["topologies"]

    @property
    def representatives(self) -> list[dict[str, Any]]:
        """Topologies that stand for the posterior together: "labels", "n_sets", "weight", …"""
        return self.result["representatives"]

    def labels(self, estimate: str = "map") -> np.ndarray:
        """One topology that stands for the posterior: (n,) labels from 0.

        "map" is the topology drawn most, "binder" and "vi" are those of least expected loss.
        """
        for own in self.result["estimates"]:
            if own["kind"] == estimate:
                return np.array(own["labels"], dtype=np.int64)
        known = ", ".join(own["kind"] for own in self.result["estimates"])
        raise refuse("estimate", repr(estimate), f"one of {known}")

    @cached_property
    def co_clustering(self) -> np.ndarray:
        """(n, n): the probability that two items share a set."""
        return self._inner.co_clustering()

    @property
    def expected_number_of_sets(self) -> float:
        """The mean of M."""
        return self.result["expected_number_of_sets"]

    def png(self, title: str | None = None) -> bytes:
        """The picture as PNG."""
        return bytes(self._inner.figure(title or self._title, False))

    def svg(self, title: str | None = None) -> str:
        """The picture as SVG."""
        return bytes(self._inner.figure(title or self._title, True)).decode()

    def __str__(self) -> str:
        return self._summary().rstrip()

    def __repr__(self) -> str:
        return str(self)

    def _summary(self) -> str:
        raise NotImplementedError

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        png = base64.b64encode(self.png()).decode()
        return {"text/plain": str(self), "image/png": png}
