"""Numbers of the core, in SI, become labelled variables in the units of the file."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np

from jointplay import _core
from jointplay.basics.arrays import Array
from jointplay.basics.units import Units
from jointplay.core.compile import TURNS
from jointplay.model.gaps import known_deviations
from jointplay.model.mechanism import Mechanism

from .names import coordinate_names
from .quantity import split
from .structure import Attribute, Result, Variable

SIDES = ("low", "high")
#: components of a reaction, and how many of them are forces
WRENCH = {"planar": (("fx", "fy", "moment"), 2), "spatial": (("fx", "fy", "fz", "mx", "my", "mz"), 3)}
STATUSES = np.array(_core.STATUSES)
#: what belongs to a quantity, by the word in front of the dimension along which it differs: what does work along it,
#: and its derivatives by time
BELONGS: Mapping[str, Mapping[str, str]] = {
    "work": {"length": "force", "angle": "moment"},
    "speed": {"length": "speed", "angle": "turning_speed"},
    "rate1": {"length": "speed", "angle": "angular_velocity"},
    "rate2": {"length": "acceleration", "angle": "angular_acceleration"},
}
#: attribute of results that say nothing of forces, which the file limits; and the variable of those that do
FORCES_APART, FORCES_JUDGED = "forces_apart", "forces_outcome"
#: decimal digits that every double precision number can hold
SHORT = 15
#: as many units are written out in a row; more are only in the coordinate beside the dimension
FEW = 5


@functools.cache
def version() -> str:
    """Version of the installed package."""
    try:
        return metadata.version("jointplay")
    except metadata.PackageNotFoundError:
        return "unknown"


@dataclass(frozen=True)
class Labels:
    """Labels along a dimension, and what kind of quantity each of them is."""

    labels: tuple[str, ...]
    kinds: tuple[str, ...] = ()


def axes_of(m: Mechanism) -> dict[str, Labels]:
    """The dimensions that results of a mechanism can have, `configuration` apart."""

    drives = tuple(map(m.coordinate_kind, m.drive_joints))

    def parameter_kind(index: int) -> str:
        component = m.parameters[index].rpartition(".")[2]
        source = int(m.parameter_source[index])
        if m.source_kinds[source] in ("drive", "backlash"):
            return m.coordinate_kind(m.driven_joint(source))
        if m.source_kinds[source] == "thermal":
            return "temperature"
        return "angle" if component in TURNS else "length"

    # Those that give way, in the order of the deformations; several drives may move one joint.
    drives_of: dict[int, list[str]] = {}
    for k, (name, moves) in enumerate(zip(m.drives, m.drive_moves, strict=True)):
        for (joint, _), gives in zip(moves, m.gives_way(k), strict=True):
            if gives:
                drives_of.setdefault(joint, []).append(name if len(moves) == 1 else f"{name}.{m.joints[joint]}")

    def gives_way(joint: int, component: str) -> str:
        # What a joint itself lets free gives way in its drive.
        free = component == ("angle" if m.coordinate_kind(joint) == "angle" else "along")
        return drives_of[joint].pop(0) if free and drives_of.get(joint) else f"{m.joints[joint]}.{component}"

    lengths, _ = split(list(m.components))
    components = tuple("length" if name in lengths else "angle" for name in m.components)
    sizes, both = ("position", "rotation"), ("length", "angle")
    sides = [(f"{name} {side}", kind) for name, kind in zip(m.components, components, strict=True) for side in SIDES]
    wrench, forces = WRENCH[m.data.space]
    deformations = m.core.deformations
    return {
        "component": Labels(m.components, components),
        "component_other": Labels(m.components, components),
        "quantity": Labels(m.quantities, (*components, *both)),
        "extreme": Labels((*sizes, *(name for name, _ in sides)), (*both, *(kind for _, kind in sides))),
        "wrench": Labels(wrench, tuple("force" if k < forces else "moment" for k in range(len(wrench)))),
        "parameter": Labels(m.parameters, tuple(parameter_kind(k) for k in range(len(m.parameters)))),
        "drive": Labels(m.drives, drives),
        "source": Labels(m.sources),
        "joint": Labels(m.joints),
        "body": Labels(m.bodies),
        "elastic": Labels(
            tuple(gives_way(joint, component) for joint, component in deformations),
            tuple("angle" if component in TURNS else "length" for _, component in deformations),
        ),
        "member": Labels(tuple(member.name for member in m.members)),
        "side": Labels(SIDES),
        "axis": Labels(tuple(lengths)),
        "outcome": Labels(tuple(_core.STATUSES)),
    }


class ResultBuilder:
    """Collects the variables of one result.

    Parameters
    ----------
    m : Mechanism
        Gives names and units.
    question : str
        Goes into the attributes.
    units : Units, optional
        Units of the result; those of the mechanism's file if left out.
    **attrs
        Further attributes.
    """

    def __init__(self, m: Mechanism, question: str, units: Units | None = None, **attrs: Attribute) -> None:
        self.units = units or m.units
        self.axes = axes_of(m)
        self.m = m
        self.coords: dict[str, Variable] = {}
        self.data: dict[str, Variable] = {}
        self._drives: dict[str, Variable] = {}
        self.attrs: dict[str, Attribute] = {
            "title": m.title,
            "question": question,
            "file": Path(m.file).name,
            "jointplay": version(),
            **attrs,
        }
        if m.limits.forces and "forces" not in (question, attrs.get("asked")):
            self.attrs[FORCES_APART] = 1

    def labels(self, dim: str, values: Sequence[object] | Array, long_name: str, units: str = "") -> None:
        """Label a dimension that is not a mechanism's own."""
        self.coords[dim] = Variable((dim,), np.asarray(values), units, long_name)

    def drives(self, values: Array) -> None:
        """Drive values as coordinates along `configuration`."""
        self._drives = {
            drive: Variable(
                ("configuration",),
                _divided(values[:, k], self.factor(kind)),
                self.name(kind),
                f"value of drive {drive}",
            )
            for k, (drive, kind) in enumerate(zip(self.axes["drive"].labels, self.axes["drive"].kinds, strict=True))
        }

    def add(
        self,
        name: str,
        dims: str | Sequence[str],
        values: Array,
        long_name: str,
        unit: str | tuple[str, str] = "",
        power: int = 1,
        per: str = "",
    ) -> None:
        """Add a variable.

        Parameters
        ----------
        dims : str or sequence of str
            Dimensions; those of the mechanism get their labels.
        values : ndarray
            In SI and radians.
        unit : str or pair of str
            `length`, `angle`, `force`, `moment`; or a dimension along which the unit differs; or two of them, when the
            values are products. `work:drive` is what does work along that dimension: a moment on an angle, a force on a
            length. `rate1:component` and `rate2:component` are first and second derivatives by time.
        power : int
            2 for squares of that unit.
        per : str
            The same where values are for one such unit: derivatives.
        """
        dims = (dims,) if isinstance(dims, str) else tuple(dims)
        for dim in dims:
            self._label(dim)
        values = np.asarray(values)
        if values.dtype.kind == "u":
            values = values.astype(np.int64)  # the difference of two counts may be negative
        along = [unit] if isinstance(unit, str) else list(unit)
        if per:
            values = values * self._factors(per, dims)
        for key in filter(None, along):
            values = _divided(values, self._factors(key, dims) ** power)
        units = self._unit_name(along, power) + (
            f" per {self._unit_name([per], 1).removeprefix('see ')}" if per else ""
        )
        self.data[name] = Variable(dims, values, units, long_name)

    def _factors(self, key: str, dims: tuple[str, ...]) -> float | Array:
        """SI per unit of a kind of quantity, or of each entry along a dimension."""
        dim, kinds = self._along(key)
        if not dim:
            return self.factor(key)
        return np.array([self.factor(kind) for kind in kinds]).reshape([-1 if d == dim else 1 for d in dims])

    def _along(self, key: str) -> tuple[str, tuple[str, ...]]:
        """The dimension along which a unit differs, if it does, and the kinds of quantity there."""
        word, _, dim = key.rpartition(":")
        if dim not in self.axes:
            return "", ()
        kinds = self.axes[dim].kinds
        return dim, tuple(BELONGS[word][kind] for kind in kinds) if word else kinds

    def status(self, codes: Array, long_name: str = "outcome") -> None:
        """Add the status of every configuration from the core's codes."""
        self.data["status"] = Variable(("configuration",), STATUSES[codes], "", long_name)

    def result(self) -> Result:
        """All that was added, with the configurations counted from zero."""
        sizes = Result(self._drives, self.data).sizes
        coords: dict[str, Variable] = {}
        if "configuration" in sizes:
            numbers = np.arange(sizes["configuration"])
            coords["configuration"] = Variable(("configuration",), numbers, "", "number of the configuration, from 0")
        # No variable is lost to a drive that has its name.
        several = (*(("output",) if self.m.data.outputs else ()), *(("load_case",) if self.m.data.load_cases else ()))
        taken = {*sizes, *self.coords, *self.data, *coords, *self.attrs, *several}
        drives = dict(zip(coordinate_names(self._drives, taken), self._drives.values(), strict=True))
        attrs = {**self.attrs, "drives": ", ".join(drives)} if drives else self.attrs
        return Result({**coords, **drives, **self.coords}, self.data, attrs)

    def factor(self, kind: str) -> float:
        """SI per unit of a kind of quantity."""
        return float(getattr(self.units, kind)) if kind else 1.0

    def name(self, kind: str) -> str:
        """Name of the unit of a kind of quantity."""
        return str(getattr(self.units, f"{kind}_name")) if kind else ""

    def _unit_name(self, along: list[str], power: int) -> str:
        suffix = "" if power == 1 else f"^{power}"
        if len(along) > 1:
            return "product of the units of both components"
        key = along[0]
        dim, kinds = self._along(key)
        if not dim:
            return self.name(key) + suffix if key else ""
        names = [self.name(kind) + suffix for kind in kinds]
        if len(set(names)) == 1:
            return names[0]
        if key != dim:
            return ", ".join(names)
        return ", ".join(names) if len(names) <= FEW else f"see {key}_unit"

    def _label(self, dim: str) -> None:
        if dim in self.coords or dim not in self.axes:
            return
        axis = self.axes[dim]
        self.coords[dim] = Variable((dim,), np.array(axis.labels, dtype=str))
        if axis.kinds:
            units = np.array([self.name(kind) for kind in axis.kinds], dtype=str)
            self.coords[f"{dim}_unit"] = Variable((dim,), units, "", f"unit along {dim}")
        if dim == "body" and self.m.members:
            owners = np.array(self.m.owners, dtype=str)
            self.coords["owner"] = Variable((dim,), owners, "", "body of the file that it is, or is a piece of")
        if dim == "source":
            kinds = np.array(self.m.source_kinds, dtype=str)
            self.coords["source_kind"] = Variable((dim,), kinds, "", "what the source is")
            self.attrs |= known_deviations(self.m)
        if dim == "parameter":
            sources = np.array([self.m.sources[int(k)] for k in self.m.parameter_source], dtype=str)
            self.coords["parameter_source"] = Variable((dim,), sources, "", "source of the parameter")


def _divided(values: Array, factor: float | Array) -> Array:
    """Values in other units, and short where a short number means the same: 59.43 deg, not 59.43000000000001."""
    quotient: Array = np.asarray(values / factor)
    sizes = np.abs(quotient)
    largest = sizes.max(initial=0.0)
    if not np.isfinite(largest):
        largest = np.max(sizes, where=np.isfinite(sizes), initial=0.0)
    if largest == 0.0 or (factor == 1.0 if isinstance(factor, float) else (factor == 1.0).all()):
        return quotient
    # Powers of ten are exact up to here.
    scale = 10.0 ** min(max(SHORT - np.ceil(np.log10(largest)), 0), 22)
    short = np.rint(quotient * scale) / scale
    return np.where(short * factor == values, short, quotient)
