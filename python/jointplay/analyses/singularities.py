"""`singularities`: how near to a singularity every configuration is, of which kind, and how far away along the path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import LARGEST_RATIO
from jointplay.errors import InputError, not_known, shown
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import RANK, require_determinate
from jointplay.result import Result, ResultBuilder, to_dataset

from .nominal import OK, Interrupted, Nominal, Progress, batched, finished, nominal, report
from .recorded import recorded
from .several import of_each
from .singular_path import DrivePath, Nearest
from .singular_values import KINDS, Scaled, kind

if TYPE_CHECKING:
    import xarray as xr

#: configurations by which it is judged whether the output's position alone shows all motions
LOOKS = 16
WORDS = {
    "constraint": "motion that the joints hold least, beyond those that they allow",
    "actuation": "motion that the joints allow and the drives hold least",
    "output": "motion that the joints allow and the output shows least",
}


@typed
def singularities(
    m: Mechanism, *, length: float | None = None, components: Sequence[str] | None = None, path: bool = True
) -> xr.Dataset:
    """Find how near to a singularity a mechanism is.

    Parameters
    ----------
    m : Mechanism
        With drive values or a path of the output.
    length : float, optional
        Length that counts as much as a radian, in the unit of the file; the size of the mechanism if left out.
    components : sequence of str, optional
        Components of the output's pose that count for its own singularities. If left out, those that the path asks
        for, else the position where it shows every motion of the mechanism, else all.
    path : bool
        Whether to look for singularities between the configurations, too.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `constraint_singular_value` (zero where the joints no longer constrain a motion),
        `actuation_singular_value` (zero where the joints allow a motion that the drives do not hold),
        `output_singular_value` (zero where the mechanism moves and the output does not), `singular_value` (of the
        whole closure, zero where one of the first two is); of the first three the motion of all bodies,
        `constraint_motion` and so on, and of the output, `constraint_twist` and so on; `kind` (the singularities that
        the configuration is at, else the one that it is nearest to), `determinant_sign` (configurations with
        different signs are separated by a singularity), `singularity_distance` (travel of the output point to the
        nearest place of the path where the closure is singular; inf where there is none), `singularity_at` (drive
        values there), `singularity_kind`, `nominal` and `status`.

    Raises
    ------
    InputError
        When the mechanism has too few or too many drives, or is over-constrained; when an option is not valid.

    Examples
    --------
    A crank and its coupler in one line: the slider has no velocity while the crank turns.

    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("slider-crank")).with_({"drives.theta.values": [0, 60, 180]})
    >>> jp.singularities(m).output_singular_value.values.round(3)
    array([0.   , 0.577, 0.   ])
    """
    return to_dataset(compute(m, length=length, components=components, path=path))


@recorded
@of_each(lambda _: False)
def compute(
    m: Mechanism,
    *,
    length: float | None = None,
    components: Sequence[str] | None = None,
    path: bool = True,
    progress: Progress | None = None,
) -> Result:
    """The light form of `singularities`."""
    scaled = Scaled(m, _length(m, length))
    # Constraints that are held already have no determinant that could vanish.
    require_determinate(m)
    at = nominal(m)
    counted = _components(m, scaled, at, components)
    limit = m.limits.singular_value
    total = len(at)

    def judged(part: slice) -> dict[str, NDArray[Any]]:
        return _judged(scaled, at, part, counted, limit)

    found, done = batched(len(at), scaled.chunk, judged, progress)
    builder = report(m, "singularities", at.first(done))
    builder.attrs["length"] = scaled.length / m.units.length
    builder.attrs["limit"] = limit
    builder.attrs["output_components"] = ", ".join(m.components[c] for c in counted)
    _add_values(builder, found)
    if done < total or not path:
        return finished(builder, done, total)
    between = DrivePath(scaled, at, found["closure"], limit)
    steps = 0

    def advance(count: int) -> None:
        nonlocal steps
        steps += count
        if progress is not None:
            progress(total + steps, max(total + between.steps, total + steps))

    try:
        nearest = between.nearest(advance)
    except KeyboardInterrupt:
        builder.attrs["incomplete"] = "interrupted before the path was searched"
        raise Interrupted(builder.result()) from None
    _add_nearest(builder, nearest)
    return builder.result()


def _judged(scaled: Scaled, at: Nominal, part: slice, counted: Sequence[int], limit: float) -> dict[str, NDArray[Any]]:
    """All figures of some configurations, nan where one is not assembled."""
    known = np.asarray(np.isfinite(at.poses[part]).all(axis=(1, 2)))
    measures = scaled.measure(at.poses[part][known], counted)

    def full(values: Floats) -> Floats:
        table = np.full((len(known), *values.shape[1:]), np.nan)
        table[known] = values
        return table

    values, closure = full(measures["values"]), full(measures["closure"])
    with np.errstate(invalid="ignore"):
        singular = closure < limit
    codes = np.where(singular, _core.STATUSES.index("singular"), _core.STATUSES.index("ok"))
    return {
        "values": values,
        "closure": closure,
        "sign": np.where(singular | ~known, 0.0, full(measures["sign"])).astype(np.int8),
        "motions": full(measures["motions"]) * scaled.units,
        "twists": full(measures["twists"]) * scaled.units,
        "kind": np.array([kind(row, limit) for row in values], dtype=object),
        # A regular pose may still be one where the machine cannot stand.
        "status": np.where(known & ((codes != OK) | at.counts[part]), codes, at.status[part]),
    }


def _add_values(builder: ResultBuilder, found: dict[str, NDArray[Any]]) -> None:
    for k, name in enumerate(KINDS):
        words = f"nearness to a singularity: {WORDS[name].replace('motion', 'rate of the motion', 1)}"
        builder.add(f"{name}_singular_value", "configuration", found["values"][:, k], words)
    words = "smallest singular value of the scaled Jacobian of joints and drives"
    builder.add("singular_value", "configuration", found["closure"], words)
    for k, name in enumerate(KINDS):
        dims = ("configuration", "body", "component")
        builder.add(f"{name}_motion", dims, found["motions"][:, k], WORDS[name], "component")
        words = f"what the motion does to the output: {WORDS[name]}"
        builder.add(f"{name}_twist", ("configuration", "component"), found["twists"][:, k], words, "component")
    words = "singularities that the configuration is at, else the nearest"
    builder.add("kind", "configuration", found["kind"].astype(str), words)
    words = "sign of the determinant of the Jacobian; 0 at a singularity"
    builder.add("determinant_sign", "configuration", found["sign"], words)
    builder.status(found["status"])


def _add_nearest(builder: ResultBuilder, nearest: Nearest) -> None:
    words = "travel of the output point to the nearest singularity of the path"
    builder.add("singularity_distance", "configuration", nearest.distance, words, "length")
    words = "drive values at the nearest singularity of the path"
    builder.add("singularity_at", ("configuration", "drive"), nearest.drives, words, "drive")
    words = "kind of the nearest singularity of the path"
    builder.add("singularity_kind", "configuration", np.array(nearest.kind, dtype=str), words)


def _length(m: Mechanism, length: float | None) -> float:
    if length is None:
        return m.length
    asked = float(length) * m.units.length
    # Beyond that singular values lose the shorter lengths in rounding.
    low, high = m.length / LARGEST_RATIO, m.length * LARGEST_RATIO
    if not low <= asked <= high:
        unit = m.units.length
        problem = f"{shown(length)} is not a number of {m.units.length_name} from {low / unit:.4g} to {high / unit:.4g}"
        raise InputError(problem, key="length")
    return asked


def _components(m: Mechanism, scaled: Scaled, at: Nominal, asked: Sequence[str] | None) -> list[int]:
    """The components of the output's twist that count."""
    if asked is None and m.targets is not None:
        asked = m.target_components
    if asked is not None:
        asked = (asked,) if isinstance(asked, str) else tuple(asked)
        for name in asked:
            if name not in m.components:
                raise InputError(not_known(str(name), "a component of the output", m.components), key="components")
        if not asked:
            raise InputError(f"name at least one of {', '.join(m.components)}", key="components")
        return [k for k, name in enumerate(m.components) if name in asked]
    everything = list(range(len(m.components)))
    known = np.flatnonzero(np.isfinite(at.poses).all(axis=(1, 2)))
    if len(m.drives) > len(scaled.positions) or not known.size:
        return everything
    some = known[np.linspace(0, known.size - 1, min(LOOKS, known.size)).round().astype(int)]
    positions = scaled.positions.tolist()
    shown_by_position = scaled.measure(at.poses[some], positions)["values"][:, KINDS.index("output")]
    return positions if bool((shown_by_position > RANK).any()) else everything
