"""Offsets that a user gives, by name, as the vector u of all parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.core.sets import beyond
from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.schema.values import LARGEST
from jointplay.model.gaps import centre, clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.result import axes_of

if TYPE_CHECKING:
    import xarray as xr

Offsets = Mapping[str, Any] | NDArray[np.float64]
#: how far outside its set an offset is that rounding may have put there
SLACK = 1e-9


def parameters(
    m: Mechanism,
    count: int,
    offsets: Offsets | xr.DataArray | xr.Dataset,
    deviations: Mapping[str, Any],
    sizes: str = "middle",
) -> Floats:
    """The vector u of every configuration, SI, shape (configuration, parameter).

    What is not named stays at its known deviation, zero for clearances; sizes where `sizes` says.
    """
    if not isinstance(offsets, Mapping) or hasattr(offsets, "data_vars"):
        return _from_array(m, count, offsets, deviations)
    u = np.tile(centre(m, sizes), (count, 1))
    named: set[int] = set()
    for name, value in offsets.items():
        _put(m, u, _columns(m, str(name), "offsets"), value, str(name), named)
    for name, value in deviations.items():
        columns = _columns(m, str(name), "deviations")
        if any(m.source_kinds[int(m.parameter_source[k])] in LOOSE for k in columns):
            raise InputError(
                "is a clearance or backlash, not a deviation; give it among the offsets", file=m.file, key=str(name)
            )
        _put(m, u, columns, value, str(name), named)
    return u


def _columns(m: Mechanism, name: str, what: str) -> list[int]:
    """Parameters that a label (`J1.x`) or a source (`J1`) means."""
    if name in m.parameters:
        return [m.parameters.index(name)]
    if name in m.sources:
        source = m.sources.index(name)
        return [k for k, owner in enumerate(m.parameter_source) if owner == source]
    if name in m.joints:
        problem = f"this joint has no clearance or tolerance in the file; sources: {listed(m.sources)}"
        raise InputError(problem, file=m.file, key=f"{what}.{name}")
    known = [*m.sources, *m.parameters]
    raise InputError(not_known(name, "a source or a parameter", known), file=m.file, key=what)


def _put(m: Mechanism, u: Floats, columns: list[int], value: Any, name: str, named: set[int]) -> None:
    count = len(u)
    labels = [m.parameters[k] for k in columns]
    if named & set(columns):
        raise InputError("is given twice", file=m.file, key=name)
    named |= set(columns)
    array = array_of(value, m.file, name)
    if len(columns) == 1 and array.shape in ((), (1,), (count,), (count, 1)):
        u[:, columns[0]] = array.reshape(-1) * m.parameter_factors[columns[0]]
    elif len(columns) > 1 and array.shape in ((len(columns),), (count, len(columns))):
        u[:, columns] = array * m.parameter_factors[columns]
    else:
        one = "one number" if len(columns) == 1 else f"{len(columns)} numbers ({listed(labels)})"
        problem = (
            f"needs {one}, or as many for each of the {count} configurations; here is an array of shape {array.shape}"
        )
        raise InputError(problem, file=m.file, key=name)


def _from_array(m: Mechanism, count: int, offsets: Any, deviations: Mapping[str, Any]) -> Floats:
    """From a Dataset with `offset`, a DataArray along `parameter`, or a plain array in the order of the parameters."""
    if deviations:
        raise InputError("an array of offsets holds the deviations as well; give one or the other", file=m.file)
    if hasattr(offsets, "data_vars"):
        if "offset" not in offsets:
            raise InputError(
                "the dataset has no variable 'offset'; take one out of it, such as worst_offset", file=m.file
            )
        offsets = offsets["offset"]
    if hasattr(offsets, "dims"):
        extra = [str(dim) for dim in offsets.dims if dim not in ("configuration", "parameter")]
        if "parameter" not in offsets.dims or extra:
            problem = (
                f"needs the dimensions configuration and parameter; here are {listed(str(d) for d in offsets.dims)}"
            )
            raise InputError(problem, file=m.file, key="offsets")
        if offsets["parameter"].values.tolist() != list(m.parameters):
            raise InputError("the parameters are not those of this mechanism", file=m.file, key="offsets")
        offsets = offsets.transpose(..., "parameter").values
    # nan stands where another result has none
    array = array_of(offsets, m.file, "offsets", gaps=True)
    if array.shape not in ((len(m.parameters),), (count, len(m.parameters))):
        shape = f"({count}, {len(m.parameters)})"
        problem = f"needs the shape {shape}, configurations by parameters; here it is {array.shape}"
        raise InputError(problem, file=m.file, key="offsets")
    return np.ascontiguousarray(np.broadcast_to(array * m.parameter_factors, (count, len(m.parameters))))


def array_of(value: Any, file: str, key: str, *, gaps: bool = False) -> Floats:
    """A number or an array of numbers as an array; with `gaps`, nan may be among them.

    Raises
    ------
    InputError
        When it is something else, not finite, or larger than any number of a file may be.
    """
    limit = f"is too large; numbers go up to {LARGEST:.0e}"
    try:
        array = np.asarray(value, dtype=np.float64)
    except OverflowError:
        raise InputError(limit, file=file, key=key) from None
    except (TypeError, ValueError):
        raise InputError(f"{shown(value)} is not a number or an array of numbers", file=file, key=key) from None
    if not (np.isfinite(array) | (np.isnan(array) if gaps else False)).all():
        raise InputError("has values that are not finite", file=file, key=key)
    if (largest := float(np.fmax.reduce(np.abs(array), axis=None, initial=0.0))) > LARGEST:
        raise InputError(f"{largest:.4g} {limit}", file=file, key=key)
    return array


def admissible(m: Mechanism, u: Floats) -> NDArray[np.bool_]:
    """Whether every source's offset lies in its set, shape (configuration, source)."""
    inside = np.ones((len(u), len(m.sources)), dtype=bool)
    for s in range(len(m.sources)):
        columns = np.flatnonzero(m.parameter_source == s)
        away = u[:, columns] - m.centre[columns]
        shape, size = clearance_of(m, s, u)
        slack = SLACK * m.length
        slack = SLACK if axes_of(m)["parameter"].kinds[columns[0]] == "angle" else slack
        inside[:, s] = beyond(shape, size, away) <= slack
    return inside
