"""Which source is to blame: its share in the first-order error of every configuration.

    loaded, given    share_s = c_s . e / e . e      the source's part c_s of the error e = sum of all c_s
    worst            share_s = c_s / sum of all     the source's part of the support function at the extreme
    random           share_s = v_s / sum of all     the source's part of the variance

The shares of a configuration add up to one. With a load, a source may have a negative share: it makes the error
smaller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .quantity import split
from .structure import Array, Result

#: shares that differ by less than this are alike
ALIKE = 1e-3


@dataclass(frozen=True)
class Blame:
    """Shares of the sources in the position error and in the rotation, each (configuration, source)."""

    sources: tuple[str, ...]
    position: Array
    rotation: Array

    def largest(self, which: str, configuration: int) -> tuple[list[str], float] | None:
        """The sources with the largest share and that share; None where nothing is off.

        They are several when their shares cannot be told apart.
        """
        row = getattr(self, which)[configuration]
        if not len(row) or not np.isfinite(row).any():
            return None
        top = float(np.nanmax(row))
        return [source for source, share in zip(self.sources, row, strict=True) if share > top - ALIKE], top


def blame(result: Result) -> Blame:
    """Shares of every source of a result that has contributions.

    Parameters
    ----------
    result : Result
        Over `configuration` only: one step of a sweep, one mechanism of a comparison.
    """
    contribution = result.data["contribution"]
    sources = tuple(result.labels("source"))
    if "extreme" in contribution.dims:
        position, rotation = (result.get("contribution", extreme=e) for e in ("position", "rotation"))
        return Blame(sources, _share(position), _share(rotation))
    values = np.moveaxis(contribution.values, contribution.dims.index("source"), 1)
    components = result.labels("component")
    parts = (values[:, :, [components.index(c) for c in chosen]] for chosen in split(components))
    if str(result.attrs.get("question", "")) == "random":
        return Blame(sources, *(_share(part.sum(axis=2)) for part in parts))
    return Blame(sources, *(_share(np.einsum("nsc,nc->ns", part, part.sum(axis=1))) for part in parts))


def _share(parts: Array) -> Array:
    """Parts over their sum; nan where they add up to nothing."""
    total = parts.sum(axis=1, keepdims=True)
    size = np.abs(parts).sum(axis=1, keepdims=True)
    defined = np.abs(total) > 1e-12 * size
    shares: Array = np.divide(parts, total, out=np.full(parts.shape, np.nan), where=defined)
    return shares
