"""The file of a machine as it was built: deviations and sizes as they were found, and what is left open of them.

What is left open scatters in `random`: every tolerance becomes the standard error, and the correlations of the
estimates are those of a Gaussian copula, of which the file has the correlations of ranks, (6 / pi) asin(rho / 2). A
zone, which scatters by itself, becomes components along the axes of its body. A run-out stays a zone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import CompiledSource
from jointplay.core.sets import SHIFTS_ACROSS
from jointplay.errors import InputError
from jointplay.file.schema.correlations import MOST_SOURCES
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings
from jointplay.result import Result
from jointplay.result.dataset import from_dataset

from .patterned import in_patterns
from .unknowns import deviation_key, places_of

if TYPE_CHECKING:
    import xarray as xr

#: digits of a standard error to which its estimate is written
DIGITS = 3
#: standard errors from the middle to the boundary of a zone
SIGMAS = 3.0
#: of a direction, below which it has no part along an axis
SMALL = 1e-9
AXES = ("x", "y", "z")


@typed
def as_built(m: Mechanism, result: Result | xr.Dataset, *, posterior: bool = False) -> Mechanism:
    """Give a mechanism the deviations and sizes that `calibrate` found.

    Parameters
    ----------
    m : Mechanism
        The one that was calibrated.
    result : Dataset
        Of `calibrate`.
    posterior : bool
        Whether tolerances of what was unknown become what is left open of it: standard errors, with their correlations
        in ``[[correlations]]``. If not, tolerances stay as they are, about the new deviations.

    Returns
    -------
    Mechanism
        Copies of a pattern have deviations of their own in its table of values. Where they cannot, such as components
        along axes that do not turn with the copies, patterns are written out.

    Raises
    ------
    InputError
        When the result is of another question or of another mechanism.
    """
    found = result if isinstance(result, Result) else from_dataset(result)
    if "unknown" not in found.coords or "fitted" not in found.data:
        raise InputError("is not a result of calibrate", key="result")
    base, sources = sizings(m)
    writer = _Writer(base, {name: sizing for sizing in sources for name in sizing.sources}, found, posterior)
    changes = writer.changes()
    built = base.with_(changes)
    return in_patterns(m, changes, built) or built if base is not m else built


@dataclass(frozen=True)
class _Left:
    """A source of one number, of which something is left open: its name, and what it is made of by unknown."""

    name: str
    parts: Mapping[int, float]


class _Writer:
    """Collects changes of a file."""

    def __init__(self, m: Mechanism, sources: Mapping[str, Sizing], found: Result, posterior: bool) -> None:
        self.m, self.sources, self.found, self.posterior = m, sources, found, posterior
        self.names = found.labels("unknown")
        self.values, self.covariance = found.get("fitted"), found.get("covariance")
        self.places = places_of(m, [*{id(one): one for one in sources.values()}.values()])
        #: what hangs together
        self.left: list[_Left] = []

    def changes(self) -> dict[str, object]:
        """Changes for `with_`."""
        m = self.m
        changes: dict[str, object] = {"title": f"{m.title}, calibrated" if m.title else "calibrated"}
        by_key: dict[str, list[int]] = {}
        for k, key in enumerate(self.found.labels("unknown_key")):
            by_key.setdefault(key, []).append(k)
        deviating = {deviation_key(sizing): sizing for sizing in self.sources.values()}
        sizes = {sizing.key: sizing for sizing in self.sources.values()}
        for key, own in by_key.items():
            if key in deviating and self._is_zone(deviating[key]):
                changes |= self._zone(deviating[key], own)
            elif key in deviating:
                changes |= self._number(deviating[key], key, own[0])
            elif key in sizes:
                changes |= sizes[key].resized(max(self._rounded(own[0]), 0.0))
            elif key.startswith("drives.") and key.endswith(".deviation"):
                # A drive that had no error in the file.
                changes |= self._drive(key.removesuffix(".deviation"), own[0])
            elif self._value(key) is not None:
                changes[key] = self._rounded(own[0])
            else:
                raise InputError(f"the mechanism has no {key}; the result is of another one", key="result")
        return changes | (self._correlations() if self.posterior else {})

    def _is_zone(self, sizing: Sizing) -> bool:
        return self._source(sizing).limits is None

    def _source(self, sizing: Sizing) -> CompiledSource:
        return self.m.compiled_sources[self.m.sources.index(sizing.sources[0])]

    def _drive(self, key: str, k: int) -> dict[str, object]:
        changes: dict[str, object] = {f"{key}.deviation": self._rounded(k)}
        if self.posterior:
            changes[f"{key}.error"] = self._open(self.names[k], {k: 1.0})
            if self._value(f"{key}.law") is not None:
                changes[f"{key}.law"] = None
        return changes

    def _number(self, sizing: Sizing, key: str, k: int) -> dict[str, object]:
        """The changes of one number: its table gets the deviation, and what is left open of it."""
        if sizing.key.endswith(".error"):
            return self._drive(sizing.key.removesuffix(".error"), k)
        entry = self._value(sizing.key)
        left = {"tolerance": self._open(sizing.sources[0], {k: 1.0})} if self.posterior else {}
        if not isinstance(entry, Mapping):
            return {sizing.key: {sizing.measure: entry, **left, "deviation": self._rounded(k)}}
        changes: dict[str, object] = {f"{sizing.key}.{word}": value for word, value in left.items()}
        if left and "law" in entry:
            changes[f"{sizing.key}.law"] = None
        return {**changes, key: self._rounded(k)}

    def _zone(self, sizing: Sizing, own: list[int]) -> dict[str, object]:
        """The changes of a zone; what is left open of it hangs together with others, so that it becomes components."""
        labels = {self.m.parameters[k]: place for k, (one, place, _) in self.places.items() if one.key == sizing.key}
        known = [
            float(self.m.centre[k] / self.m.parameter_factors[k])
            for k, one in self.places.items()
            if one[0].key == sizing.key
        ]
        for k in own:
            known[labels[self.names[k]]] = self._rounded(k)
        kind, source = self.m.source_kinds[self.m.sources.index(sizing.sources[0])], self._source(sizing)
        entry = self._value(sizing.key)
        table = dict(entry) if isinstance(entry, Mapping) else {sizing.measure: entry}
        if not self.posterior:
            return {sizing.key: {**table, "deviation": known}}
        if kind not in ("position", "direction") or len(source.components) > len(known):
            error = max(math.sqrt(self.covariance[k, k]) for k in own)
            size = SIGMAS * error * (2.0 if sizing.measure == "diameter" else 1.0)
            return {
                sizing.key: {
                    **{name: value for name, value in table.items() if name != "law"},
                    sizing.measure: size,
                    "deviation": known,
                }
            }
        ways = np.array(source.spec["ways"])[:, 0] if kind == "position" else np.eye(2)
        axes = [axis for axis in AXES if axis in self.m.components] if kind == "position" else SHIFTS_ACROSS
        components: dict[str, Any] = {}
        for axis, row in zip(axes, ways.T, strict=False):
            parts = {k: float(row[labels[self.names[k]]]) for k in own}
            if np.abs(row).max() > SMALL:
                # As many digits as the numbers that it is made of.
                deviation = float(f"{float(row @ np.array(known)):.9g}")
                components[axis] = {
                    "tolerance": self._open(f"{sizing.sources[0]}.{axis}", parts),
                    "deviation": deviation,
                }
        return {sizing.key: components}

    def _open(self, name: str, parts: Mapping[int, float]) -> dict[str, float]:
        """What is left open of a number, as its tolerance; it hangs together with all others."""
        self.left.append(_Left(name, parts))
        row = self._row(parts)
        return {"sigma": float(f"{math.sqrt(max(float(row @ np.nan_to_num(self.covariance) @ row), 0.0)):.6g}")}

    def _row(self, parts: Mapping[int, float]) -> Floats:
        row = np.zeros(len(self.names))
        for k, part in parts.items():
            row[k] = part
        return row

    def _value(self, key: str) -> Any:
        try:
            return self.m.value(key)
        except InputError:
            return None

    def _rounded(self, k: int) -> float:
        """An estimate with the digits that its standard error gives it."""
        error, value = math.sqrt(self.covariance[k, k]), float(self.values[k])
        if not (math.isfinite(error) and error > 0.0):
            return float(f"{value:.6g}")
        return round(value, min(15, max(0, DIGITS - math.floor(math.log10(error)))))

    def _correlations(self) -> dict[str, object]:
        """The correlations of what is left open, in the place of those that the sources had."""
        names = [left.name for left in self.left]
        given = self.m.raw.get("correlations", [])
        replaced = {*names, *self.names}
        kept = [dict(group) for group in given if not {*group.get("sources", ())} & replaced]
        if len(names) > MOST_SOURCES:
            problem = f"{len(names)} numbers hang together; the file can have at most {MOST_SOURCES} in one group"
            raise InputError(problem, key="posterior")
        rows = np.array([self._row(left.parts) for left in self.left])
        if len(names) > 1:
            kept.append({"sources": names, "ranks": _ranks(rows @ np.nan_to_num(self.covariance) @ rows.T)})
        return {"correlations": kept} if kept or given else {}


def _ranks(covariance: Floats) -> list[list[float]]:
    errors = np.sqrt(np.diagonal(covariance))
    rho = np.clip(covariance / np.outer(errors, errors), -1.0, 1.0)
    ranks = 6.0 / np.pi * np.arcsin(rho / 2.0)
    np.fill_diagonal(ranks, 1.0)
    both = np.round((ranks + ranks.T) / 2.0, 12)
    return [list(map(float, row)) for row in both]
