"""The clearances of a mechanism at given sizes of their parts.

gap = gap in the middle + sum of factor * size, not below zero     size: difference from the middle of its limits
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointplay import _core
from jointplay.basics.arrays import Floats
from jointplay.core.compile import CompiledSource
from jointplay.core.sets import grown, play_of
from jointplay.core.spec import SourceSpec
from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism

#: share of the mechanism's length by which rounding may make a play of zero negative
ROUNDED = 1e-12
#: which sizes a question can take
SIZES = ("middle", "largest", "smallest")


def clearance_of(m: Mechanism, source: int, u: Floats | None = None) -> tuple[str, dict[str, Any]]:
    """Shape and sizes of the set of a source; of a clearance with those sizes of its parts that `u` has.

    Parameters
    ----------
    source : int
        Its index.
    u : ndarray, optional
        All parameters, SI, shape (parameter,) or (configuration, parameter); the known deviations if left out.
    """
    own = m.compiled_sources[source]
    shape, size, parts = own.shape, own.size, _parts(m, own)
    if not parts:
        return shape, size
    values = m.centre if u is None else u
    return shape, grown(size, sum(factor * values[..., column] for column, factor in parts), least=0.0)


def _parts(m: Mechanism, clearance: CompiledSource) -> list[tuple[int, float]]:
    """The sizes that make a clearance: the parameter of each, and its factor; none of other sources."""
    return m.sizes_of_joints.get(clearance.spec.get("joint", -1), []) if clearance.kind == "clearance" else []


def travel(m: Mechanism, source: int) -> tuple[float, float] | None:
    """Least and most of the radius or gap of a clearance, SI; None where it does not scatter."""
    own = m.compiled_sources[source]
    size, parts = own.size, _parts(m, own)
    if not parts:
        return None
    middle = play_of(size) + sum(factor * m.centre[column] for column, factor in parts)
    half = sum(abs(factor) * _half(m, column) for column, factor in parts)
    return float(middle - half), float(middle + half)


def _half(m: Mechanism, column: int) -> float:
    return m.compiled_sources[int(m.parameter_source[column])].size["high"]


def centre(m: Mechanism, sizes: str) -> Floats:
    """The known deviations of all parameters, with the sizes at the middle of their limits, or where play is extreme.

    Raises
    ------
    InputError
        When there is no such choice.
    """
    if sizes not in SIZES:
        raise InputError(not_known(sizes, "a choice of sizes", SIZES), key="sizes")
    u = m.centre.copy()
    for k, source in enumerate(m.compiled_sources):
        if source.kind == "size" and sizes != "middle":
            grows = (source.spec["factor"] > 0.0) == (sizes == "largest")
            u[m.parameter_source == k] += source.size["high" if grows else "low"]
    return u


def core_with(m: Mechanism, sizes: str) -> _core.Mechanism:
    """The mechanism in the core with a choice of sizes."""
    return core_at(m, centre(m, sizes))


def core_at(m: Mechanism, u: Floats) -> _core.Mechanism:
    """The mechanism in the core with those sizes that some parameters have."""
    if np.array_equal(u, m.centre):
        return m.core
    sources: list[SourceSpec] = [
        {**source, "centre": u[m.parameter_source == k].tolist()} if source["kind"] == "size" else source
        for k, source in enumerate(own.as_spec for own in m.compiled_sources)
    ]
    return m.varied(sources=sources)


def known_deviations(m: Mechanism) -> dict[str, str]:
    """What a result says of sources that the file says are off and have no size: nothing to tighten about them."""
    off = {int(s) for s in m.parameter_source[np.flatnonzero(m.centre)]}
    known = [source.name for s, source in enumerate(m.compiled_sources) if s in off and source.limits == (0.0, 0.0)]
    return {"known_deviations": ", ".join(known)} if known else {}


def attributes(m: Mechanism, sizes: str = "middle") -> dict[str, str]:
    """What a result says of the sizes that were taken; nothing where no clearance scatters."""
    some = tight(m)
    return ({"sizes": sizes} if "size" in m.source_kinds else {}) | (
        {"some_without_play": ", ".join(some)} if some else {}
    )


def tight(m: Mechanism) -> list[str]:
    """The clearances of which some pairs have interference, and no play."""
    return [m.sources[k] for k, (least, _) in scattering(m).items() if least < -ROUNDED * m.length]


def scattering(m: Mechanism) -> Mapping[int, tuple[float, float]]:
    """Least and most of the radius or gap of every clearance that scatters, by the index of its source."""
    found = {k: travel(m, k) for k in range(len(m.sources))}
    return {k: limits for k, limits in found.items() if limits is not None}
