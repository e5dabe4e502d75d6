"""The share of every cause in the first-order error of every configuration.

Causes are the sources and, where it bends something, the load.

    loaded, given    share_s = c_s . e / e . e      the cause's part c_s of the error e = sum of all c_s
    worst            share_s = c_s / sum of all     the source's part of the extreme
    random           share_s = v_s / sum of all     the cause's part of the variance

The shares of a configuration add up to one. With a load, a cause may have a negative share: it makes the error
smaller. A cause that only the other mechanism of a comparison has is nan and adds nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Array

from .quantity import split
from .structure import Result

#: the name of the load among the causes
LOAD = "load"
#: shares that differ by less than this are alike
ALIKE = 1e-3


@dataclass(frozen=True)
class Blame:
    """Shares of the causes in the position error and in the rotation, each (configuration, cause)."""

    causes: tuple[str, ...]
    position: Array
    rotation: Array

    def largest(self, which: str, configuration: int) -> tuple[list[str], float] | None:
        """The causes with the largest share and that share; None where nothing is off.

        They are several when their shares are equal to rounding.
        """
        return largest(self.causes, getattr(self, which)[configuration])


def largest(causes: Sequence[str], row: Array) -> tuple[list[str], float] | None:
    """The causes with the largest share and that share; None where there is none."""
    if not len(row) or not np.isfinite(row).any():
        return None
    top = float(np.nanmax(row))
    return [cause for cause, share in zip(causes, row, strict=True) if share > top - ALIKE], top


def in_words(sources: Sequence[str], share: float) -> str:
    """Sources of the same share.

    Examples
    --------
    >>> in_words(["J1"], 0.41), in_words(["J1", "J2"], 0.3), in_words(["J1", "J2", "J3", "J4"], 0.25)
    ('J1 41 %', 'J1, J2 30 % each', 'J1 + 3 more 25 % each')
    """
    names = ", ".join(sources) if len(sources) <= 3 else f"{sources[0]} + {len(sources) - 1} more"
    return f"{names} {100 * share:.0f} %" + (" each" if len(sources) > 1 else "")


def blame(result: Result) -> Blame:
    """Shares of every cause in a result that has contributions.

    Parameters
    ----------
    result : Result
        Over `configuration` only: one step of a sweep, one mechanism of a comparison.
    """
    if "extreme" in result.data["contribution"].dims:
        position, rotation = (result.get("contribution", extreme=e) for e in ("position", "rotation"))
        return Blame(tuple(result.labels("source")), shares(position), shares(rotation))
    causes, values = parts_by_cause(result)
    components = result.labels("component")
    chosen = (values[:, :, [components.index(c) for c in kind]] for kind in split(components))
    if str(result.attrs.get("question", "")) == "random":
        return Blame(causes, *(shares(part.sum(axis=2)) for part in chosen))
    return Blame(causes, *(shares(np.einsum("nsc,nc->ns", part, np.nansum(part, axis=1))) for part in chosen))


def parts_by_cause(result: Result) -> tuple[tuple[str, ...], Array]:
    """The causes of an error or of a variance, and their parts of every component: (..., cause, component)."""
    causes = tuple(result.labels("source"))
    values = _by_component(result, "contribution", "source")
    is_loaded = "loaded" in (result.attrs.get("question"), result.attrs.get("contact"))
    if not is_loaded or "contribution_elastic" not in result.data:
        return causes, values
    # The parts of the deformations are those of the load, shared out among what is elastic.
    bent = _by_component(result, "contribution_elastic", "joint").sum(axis=-2, keepdims=True)
    return (*causes, LOAD), np.concatenate([values, bent], axis=-2)


def _by_component(result: Result, name: str, dim: str) -> Array:
    variable = result.data[name]
    moved: Array = np.moveaxis(variable.values, [variable.dims.index(d) for d in (dim, "component")], [-2, -1])
    return moved


def shares(values: Array) -> Array:
    """Parts over their sum, row by row; nan where they add up to nothing."""
    total = np.nansum(values, axis=1, keepdims=True)
    size = np.nansum(np.abs(values), axis=1, keepdims=True)
    defined = np.abs(total) > 1e-12 * size
    found: Array = np.divide(values, total, out=np.full(values.shape, np.nan), where=defined)
    return found
