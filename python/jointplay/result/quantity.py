"""Quantities of a result: the sizes of its pose errors, and what tables compare and maps are coloured by.

A pose error has the components (x, y, angle), or (x, y, z, rx, ry, rz); its position is a length and its rotation an
angle.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, not_known
from jointplay.questions import QUESTIONS, Figure

from .dataset import from_dataset
from .structure import Result, Variable, own_unit

if TYPE_CHECKING:
    import xarray as xr

#: relative difference of numbers of which none is the larger one
ALIKE = 1e-9
#: part of the largest drive value, or of one, that is rounding
ROUNDING = 1e-9
#: share of the specimens below the value that stands for the scatter
TYPICAL = 0.95
WORDS = {"position": "position error", "rotation": "rotation", "singular_value": "smallest singular value"}
#: variables that the limits of errors are about
ERRORS = (
    *("error", "friction_position", "friction_rotation"),
    *("worst_component", "worst_position", "worst_rotation", "error_quantile"),
)


def split(components: list[str]) -> tuple[list[str], list[str]]:
    """The components that are lengths, and those that are angles.

    Examples
    --------
    >>> split(["x", "y", "angle"])
    (['x', 'y'], ['angle'])
    """
    return [c for c in components if c in LENGTHS], [c for c in components if c not in LENGTHS]


def size(result: Result, name: str, quantity: str, **at: Any) -> Array:
    """Size of the position or of the rotation of a variable that has components.

    Parameters
    ----------
    **at
        Labels along its other dimensions.
    """
    parts = [result.get(name, component=component, **at) for component in _chosen(result, quantity)]
    return np.asarray(np.linalg.norm(np.stack(parts), axis=0))


def commanded(drive: Variable, configuration: int) -> float:
    """The value of a drive to be read: without what rounding leaves of zero.

    Examples
    --------
    >>> angle = Variable(("configuration",), np.array([5.3e-15, 30.0]), "deg")
    >>> commanded(angle, 0), commanded(angle, 1)
    (0.0, 30.0)
    """
    value = float(drive.values[configuration])
    return 0.0 if abs(value) <= ROUNDING * max(1.0, float(np.nanmax(np.abs(drive.values)))) else value


def unit_of(result: Result, quantity: str, name: str = "nominal") -> str:
    """Unit of the position or of the rotation of a variable that has components."""
    return result.unit(name, component=_chosen(result, quantity)[0])


def _chosen(result: Result, quantity: str) -> list[str]:
    lengths, angles = split(result.labels("component"))
    return lengths if quantity == "position" else angles


def typical(result: Result, probability: float = TYPICAL) -> float:
    """The one of the probabilities of a scatter that is nearest to one."""
    return float(min(result.labels("probability"), key=lambda level: abs(level - probability)))


def figures(result: Result | xr.Dataset) -> Mapping[str, Figure]:
    """By quantity the figures of its question, the most telling one first; none where several are merged."""
    asked = str(result.attrs.get("question", ""))
    return QUESTIONS[asked].figures if asked in QUESTIONS else {}


def figure(result: Result, name: str) -> tuple[Array, str]:
    """The values of a quantity, and their unit."""
    found = quantity(result, name)
    return found.values, found.units


def quantity(result: Result | xr.Dataset, name: str | None = None) -> Variable:
    """Values of a quantity, or of a variable at labels.

    Parameters
    ----------
    result : Result or xarray.Dataset
        Of any question. Of a dataset on disk only what is needed is read.
    name : str, optional
        ``position`` (size of the displacement) or ``rotation`` (of the turn); ``singular_value``; or a variable with a
        label for each of its other dimensions, such as ``error.x`` or ``undetermined.angle``. The first quantity of
        the question if left out.

    Raises
    ------
    InputError
        When there is no such variable, or its labels do not pick one number per node.
    """
    behind = _behind(result)
    name = name or next(iter(behind))
    variable, *labels = name.split(".")
    source = behind.get(name, variable)
    light = _only(result, source, [*behind, name])
    if name in behind:
        return _of_quantity(light, source, name)
    grid = str(light.attrs.get("grid", "configuration")).split(", ")
    found = light.data[source]
    for dim in [dim for dim in found.dims if dim not in grid]:
        known = [str(label) for label in light.labels(dim)] if dim in light.coords else []
        if not labels or labels[0] not in known:
            given = labels[0] if labels else ""
            problem = not_known(given, f"a label of {source} along {dim}", known)
            raise InputError(problem, key=name)
        at = known.index(labels.pop(0))
        unit = light.coords.get(f"{dim}_unit")
        units = own_unit(found, unit, at) if unit is not None else found.units
        values = np.take(found.values, at, axis=found.dims.index(dim))
        found = Variable(tuple(d for d in found.dims if d != dim), values, units, f"{found.long_name}, {known[at]}")
    if labels or found.values.dtype.kind not in "fiub":
        raise InputError(f"{name} is not one number per node", key=name)
    return Variable(found.dims, found.values.astype(float), found.units, found.long_name)


def bounds(result: Result | xr.Dataset, name: str | None = None) -> tuple[float, ...]:
    """The limits of the file on what `quantity` gives, the lowest first; none where it has none.

    Parameters
    ----------
    name : str, optional
        As of `quantity`.
    """
    behind = _behind(result)
    name = name or next(iter(behind))
    variable, *labels = name.split(".")
    if behind.get(name, variable) == "used":
        return (1.0,)
    if behind.get(name, variable) not in ERRORS or "limit" not in _names(result):
        return ()
    light = result if isinstance(result, Result) else from_dataset(result[["limit"]])
    label = name if name in behind else (labels or [variable.removeprefix("worst_")])[0]
    found = light.get("limit", quantity=label)
    return tuple(sorted(found[np.isfinite(found)].tolist()))


def _names(result: Result | xr.Dataset) -> list[str]:
    return list(result.data) if isinstance(result, Result) else [str(v) for v in result.data_vars]


def _only(result: Result | xr.Dataset, source: str, known: list[str]) -> Result:
    names = _names(result)
    if source not in names:
        raise InputError(not_known(source, "a variable of this result", [*known[:-1], *names]), key="variable")
    if isinstance(result, Result):
        return result
    return from_dataset(result[[source]])


def _behind(result: Result | xr.Dataset) -> dict[str, str]:
    """The variable behind each quantity; at rest what friction can hold."""
    names = _names(result)
    held = {name: f"friction_{name}" for name in WORDS if f"friction_{name}" in names}
    return {name: one.variable for name, one in figures(result).items()} | held


def _of_quantity(result: Result, source: str, name: str) -> Variable:
    found = result.data[source]
    if source == "error_quantile":
        level = typical(result)
        values, unit = result.get(source, probability=level, quantity=name), result.unit(source, quantity=name)
        words = f"{name}, {100 * level:g} % of the specimens below"
        return _without(found, ("probability", "quantity"), values, unit, words)
    if "component" not in found.dims:
        return found
    return _without(found, ("component",), size(result, source, name), unit_of(result, name, source), WORDS[name])


def _without(found: Variable, dims: tuple[str, ...], values: Array, units: str, words: str) -> Variable:
    return Variable(tuple(d for d in found.dims if d not in dims), values, units, words)


def first_largest(values: Array) -> Array:
    """Along the last axis the place of the largest value, the first one where several are as large to rounding."""
    top = values.max(axis=-1, keepdims=True)
    room = ALIKE * np.where(np.isfinite(top), np.abs(top), 0.0)
    return np.asarray((values >= top - room).argmax(axis=-1))
