"""What the page has sliders for: sizes of clearances and tolerances, loads, drives, and offsets that are given."""

import copy
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.core.compile import ANGULAR
from jointplay.errors import InputError
from jointplay.model.gaps import centre
from jointplay.model.mechanism import Mechanism
from jointplay.model.patterns import written_out
from jointplay.model.sizing import Sizing, plays, sizings
from jointplay.result import axes_of

#: the far end of a slider, as a multiple of what the file has
FAR = 3.0
#: by what part of its path a drive can go beyond it
BEYOND = 0.25
#: digits of a value that a slider sets: what is behind them is rounding
DIGITS = 12


@dataclass(frozen=True)
class Knob:
    """A number of the file that a slider changes."""

    #: where the file has it
    key: str
    #: what it is the size of
    name: str
    #: ``clearances``, ``tolerances`` or ``loads``
    group: str
    #: which of its numbers it is, such as ``radial``
    measure: str
    unit: str
    #: `value`, `low`, `high`: what the file says, and the ends of the slider
    value: float
    low: float
    high: float
    #: changes for `Mechanism.with_` that give it a value
    changes: Callable[[float], Mapping[str, Any]]
    #: where it is a fit: the fits that it can be, with their least and largest play; its value is the number of one
    fits: tuple[tuple[str, float, float], ...] = ()

    def told(self) -> dict[str, Any]:
        """As the page has it."""
        return {key: value for key, value in vars(self).items() if key != "changes"}


def knobs(m: Mechanism) -> list[Knob]:
    """All sizes and loads of a file that can be changed by one number, in the order of results."""
    return [*_sizes(m), *_loads(m)]


def _sizes(m: Mechanism) -> Iterator[Knob]:
    base, sources = sizings(m)
    sources = [source for source in sources if not source.fixed]
    largest = {kind: max((s.size for s in sources if s.kind == kind), default=0.0) for kind in ("length", "angle")}
    if base is not m:
        sources = list(_of_patterns(m, sources))
    for source in sources:
        fit = _fit(m, source)
        if fit is not None:
            yield fit
            continue
        group = "tolerances" if source.measure in ("tolerance", "diameter", "angle") else "clearances"
        far = source.size or largest.get(source.kind, 0.0) or 1.0
        unit = getattr(m.units, f"{source.kind}_name")
        yield Knob(
            source.key,
            source.name,
            group,
            source.measure,
            unit,
            _rounded(source.size),
            0.0,
            _rounded(FAR * far),
            lambda value, source=source: _rounded(source.resized(value)),  # type: ignore[misc]
        )


def _fit(m: Mechanism, source: Sizing) -> Knob | None:
    """The slider of a fit, which steps through fits, so that it stays one; None of what is none."""
    try:
        own = m.value(source.key)
    except InputError:
        return None
    if not isinstance(own, Mapping) or not isinstance(own.get("fit"), str) or source.diameter is None:
        return None
    fits = plays(source.diameter, m.units.length, own["fit"])
    names = [name for name, _, _ in fits]
    if own["fit"] not in names:
        return None
    last = len(names) - 1

    def changes(value: float) -> dict[str, Any]:
        return {f"{source.key}.fit": names[min(max(round(value), 0), last)]}

    unit, at = m.units.length_name, float(names.index(own["fit"]))
    return Knob(source.key, source.name, "clearances", "fit", unit, at, 0.0, float(last), changes, tuple(fits))


def _of_patterns(m: Mechanism, sources: list[Sizing]) -> Iterator[Sizing]:
    """Sources of copies once, with the key of their pattern; those that differ from copy to copy are left out."""
    origins = written_out(dict(m.raw), m.file).origins
    found: dict[str, list[Sizing]] = {}
    for source in sources:
        found.setdefault(_original(source.key, origins), []).append(source)
    for key, alike in found.items():
        first = alike[0]
        if key == first.key:
            yield first
        elif len({source.size for source in alike}) == 1:
            moved = _Moved(first, key)
            try:
                m.with_(moved.resized(first.size))
            except InputError:
                # Its key has a name that differs from copy to copy.
                continue
            yield replace(first, key=key, name=f"{key.split('.')[3]} (all copies)", _changes=moved.resized)


def _original(key: str, origins: Mapping[tuple[str, ...], tuple[str, int]]) -> str:
    """The key that the user wrote."""
    steps = tuple(key.split("."))
    for length in range(len(steps), 0, -1):
        if steps[:length] in origins:
            return ".".join((origins[steps[:length]][0], *steps[length:]))
    return key


@dataclass(frozen=True)
class _Moved:
    """Changes of a copy as those of its pattern."""

    source: Sizing
    key: str

    def resized(self, size: float) -> dict[str, object]:
        own = self.source.key
        end = len(own.rpartition(".")[2])
        head, moved = own[:-end], self.key[:-end]
        return {moved + key.removeprefix(head): value for key, value in self.source.resized(size).items()}


def _loads(m: Mechanism) -> Iterator[Knob]:
    places = [(f"loads.{k}", f"load {k + 1}") for k in range(len(m.raw.get("loads", ())))]
    for case, loads in m.raw.get("load_cases", {}).items():
        places += [(f"load_cases.{case}.{k}", f"{case} {k + 1}") for k in range(len(loads))]
    for key, name in places:
        table = m.value(key)
        for word, unit in (("force", m.units.force_name), ("moment", m.units.moment_name)):
            yield from _load(f"{key}.{word}", name, word, unit, table.get(word))


def _load(key: str, name: str, word: str, unit: str, value: Any) -> Iterator[Knob]:
    """The components of a force or of a moment; where they are not plain numbers, what they are multiplied with."""
    if value is None:
        return
    components = value if isinstance(value, list) else [value]
    if all(isinstance(one, int | float) for one in components) and len(components) <= len("xyz"):
        far = 2.0 * max(map(abs, components), default=0.0) or 10.0
        for k, one in enumerate(components):
            place, axis = (f"{key}.{k}", f" {'xyz'[k]}") if isinstance(value, list) else (key, "")
            yield Knob(place, name, "loads", word + axis, unit, one, -far, far, lambda new, at=place: {at: new})  # type: ignore[misc]
        return

    def scaled(factor: float) -> dict[str, Any]:
        return {key: _times(copy.deepcopy(value), factor)}

    yield Knob(key, name, "loads", f"{word}, times", "", 1.0, 0.0, FAR, scaled)


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, list):
        return [_times(one, factor) for one in value]
    return f"{factor:.{DIGITS}g} * ({value})" if isinstance(value, str) else value * factor


def _rounded(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    # Zero has no sign in a file.
    return float(f"{value:.{DIGITS}g}") + 0.0 if isinstance(value, float) else value


def drives(m: Mechanism, at: Nominal) -> list[dict[str, Any]]:
    """The drives with their ends: those of the limits of the file, else somewhat beyond the path."""
    found = []
    for k, name in enumerate(m.drives):
        turns = m.joint_kinds[m.drive_joints[k]] in ANGULAR
        factor, values = m.drive_factors[k], at.drives[:, k]
        known = values[np.isfinite(values)] if np.isfinite(values).any() else np.zeros(1)
        low, high = float(known.min()), float(known.max())
        wide = BEYOND * (high - low) or (math.radians(10.0) if turns else 0.05 * m.length)
        low, high = m.limits.drives.get(name, (low - wide, high + wide))
        unit = m.units.angle_name if turns else m.units.length_name
        found.append({"name": name, "unit": unit, "low": float(low / factor), "high": float(high / factor)})
    return found


def offsets(m: Mechanism) -> list[dict[str, Any]]:
    """All parameters that can be given, with the ends of their sets."""
    if not m.parameters:
        return []
    unit = np.eye(len(m.parameters))
    at = np.tile(centre(m, "largest"), (len(unit), 1))
    ends = (m.core.at_supports(at, sign * unit, all=True) for sign in (-1.0, 1.0))
    low, high = (np.diagonal(end) / m.parameter_factors for end in ends)
    kinds = axes_of(m)["parameter"].kinds
    units = [getattr(m.units, f"{kind}_name") for kind in kinds]
    return [
        {"name": name, "unit": unit, "low": a, "high": b}
        for name, unit, a, b in zip(m.parameters, units, low.tolist(), high.tolist(), strict=True)
    ]
