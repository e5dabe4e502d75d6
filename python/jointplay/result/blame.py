"""The share of every cause in the first-order error of every configuration.

Causes are the sources and, where it bends something, the load.

    loaded, given    share_s = c_s . e / e . e      the cause's part c_s of the error e = sum of all c_s
    worst            share_s = c_s / sum of all     the source's part of the extreme
    random           share_s = v_s / sum of all     the cause's part of the variance

The shares of a configuration add up to one. With a load, a cause may have a negative share: it makes the error
smaller. A cause that only the other mechanism of a comparison has is nan and adds nothing. Where first order tells less
than half of the error, what it does not tell is a cause of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.arrays import Array

from .quantity import split
from .structure import Result

if TYPE_CHECKING:
    import xarray as xr

#: quantities that are the sizes of others
SIZES = ("position", "rotation")
#: the name of the load among the causes
LOAD = "load"
#: the name of what first order does not tell, and the share from which on it is a cause
HIGHER, MOST_OF_IT = "higher order", 0.5
#: shares of the mechanism's length, and radians, that are rounding: an error of that size misses no limit
ROUNDING = 1e-10
#: shares that differ by less than this are alike
ALIKE = 1e-3


#: causes of the same share, and that share
Shared = tuple[list[str], float]


@dataclass(frozen=True)
class Blame:
    """Shares of the causes in the position error and in the rotation, each (configuration, cause)."""

    causes: tuple[str, ...]
    position: Array
    rotation: Array

    def largest(self, which: str, configuration: int) -> Shared | None:
        """The causes with the largest share and that share; None where nothing is off.

        They are several when their shares are equal to rounding.
        """
        return largest(self.causes, getattr(self, which)[configuration])


def largest(causes: Sequence[str], row: Array) -> Shared | None:
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


def is_of_variance(result: Result) -> bool:
    """Whether shares are those of a variance: what scatters may be a small part of the error."""
    return "random" in (result.attrs.get("question"), result.attrs.get("asked"))


def blamed_for(result: Result) -> str:
    """What stands in front of the causes with the largest shares."""
    return "of the variance" if is_of_variance(result) else "to blame"


def blame(result: Result) -> Blame:
    """Shares of every cause in a result that has contributions.

    Parameters
    ----------
    result : Result
        Over `configuration` only: one step of a sweep, one mechanism of a comparison.
    """
    if "extreme" in result.data["contribution"].dims:
        causes = tuple(result.labels("source"))
        found = [shares(result.get("contribution", extreme=e)) for e in SIZES]
    else:
        causes, values = parts_by_cause(result)
        components = result.labels("component")
        chosen = [values[:, :, [components.index(c) for c in kind]] for kind in split(components)]
        if is_of_variance(result):
            found = [shares(part.sum(axis=2)) for part in chosen]
        else:
            found = [shares(np.einsum("nsc,nc->ns", part, np.nansum(part, axis=1))) for part in chosen]
    untold = [untold_share(result, name) for name in SIZES]
    if not any(row.any() for row in untold):
        return Blame(causes, *found)
    return Blame((*causes, HIGHER), *(_with_untold(own, row) for own, row in zip(found, untold, strict=True)))


def _with_untold(own: Array, untold: Array) -> Array:
    told = np.where(untold[:, None] > 0.0, np.nan_to_num(own) * (1.0 - untold[:, None]), own)
    return np.concatenate([told, untold[:, None]], axis=1)


def share_of(result: Result, causes: tuple[str, ...], parts: Array, name: str, side: str, at: int) -> Shared | None:
    """The causes with the largest share in one end of a quantity, and that share, by the parts of all causes."""
    row, untold = shares(parts[None]), untold_share(result, name, side)[at : at + 1]
    if untold.any():
        return largest((*causes, HIGHER), _with_untold(row, untold)[0])
    return largest(causes, row[0])


def untold_share(result: Result, name: str, side: str = "high") -> Array:
    """What share of an error, or of a variance, first order does not tell, by configuration; zero unless most of it.

    Parameters
    ----------
    name : str
        A size or a component of the error.
    side : str
        The end of a component of `worst`.
    """
    exact, untold = untold_part(result, name, side)
    return np.divide(untold, exact, out=np.zeros(len(exact)), where=untold > 0.0)


def untold_part(result: Result, name: str, side: str = "high") -> tuple[Array, Array]:
    """An error or a variance, and what first order does not tell of it; the square of an error that has a direction."""
    components = result.labels("component")
    chosen = split(components)[SIZES.index(name)] if name in SIZES else [name]
    ends, power = ("", "_first_order"), 1
    if f"worst_{name}" in result.data:
        exact, first = (result.get(f"worst_{name}{end}") for end in ends)
        unit = result.unit(f"worst_{name}")
    elif "worst_component" in result.data:
        exact, first = (result.get(f"worst_component{end}", component=name, side=side) for end in ends)
        exact, first = np.abs(exact), first * np.sign(exact)
        unit = result.unit("worst_component", component=name)
    else:
        kind, power = ("error_std", 2) if "error_std" in result.data else ("error", 2)
        if kind not in result.data or f"{kind}_first_order" not in result.data or not chosen:
            nothing = np.zeros(len(result.get("status")))
            return nothing, nothing
        each, told = (np.stack([result.get(f"{kind}{end}", component=c) for c in chosen]) for end in ends)
        exact, first = (each * each).sum(axis=0), (told * (told if kind == "error_std" else each)).sum(axis=0)
        unit = result.unit(kind, component=chosen[0])
    known = np.isfinite(exact) & np.isfinite(first) & (exact > rounding(result, unit) ** power)
    untold = np.where(known, np.clip(exact - first, 0.0, exact), 0.0)
    return exact, np.where(untold > MOST_OF_IT * exact, untold, 0.0)


def rounding(result: Result | xr.Dataset, unit: str) -> float:
    """What of a length or an angle is rounding, in its unit."""
    if unit == "rad":
        return ROUNDING
    return ROUNDING * (57.3 if unit == "deg" else float(result.attrs.get("length", 0.0)))


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
    # Parts that cancel to fewer digits are rounding: backlash takes up what the drive beside it is off by.
    defined = np.abs(total) > 1e-9 * size
    found: Array = np.divide(values, total, out=np.full(values.shape, np.nan), where=defined)
    return found
