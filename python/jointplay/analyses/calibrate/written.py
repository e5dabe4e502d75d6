"""The file of a machine as it was built: deviations and sizes as they were found, and what is left open of them.

What is left open scatters in `random`: every tolerance becomes the standard error, and the correlations of the
estimates are those of a Gaussian copula, of which the file has the correlations of ranks, (6 / pi) asin(rho / 2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings
from jointplay.result import Result
from jointplay.result.dataset import from_dataset

from .unknowns import deviation_key, places_of

if TYPE_CHECKING:
    import xarray as xr

#: digits of a standard error to which its estimate is written
DIGITS = 3
#: standard errors from the middle to the boundary of a zone
SIGMAS = 3.0
#: more sources than one group of correlations has
MOST_CORRELATED = 200


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
        With its patterns written out, because copies have deviations of their own.

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
    return base.with_(writer.changes())


class _Writer:
    """Collects changes of a file."""

    def __init__(self, m: Mechanism, sources: Mapping[str, Sizing], found: Result, posterior: bool) -> None:
        self.m, self.sources, self.found, self.posterior = m, sources, found, posterior
        self.names = found.labels("unknown")
        self.keys = found.labels("unknown_key")
        self.values, self.errors = found.get("fitted"), found.get("standard_error")

    def changes(self) -> dict[str, object]:
        m = self.m
        changes: dict[str, object] = {"title": f"{m.title}, calibrated" if m.title else "calibrated"}
        by_key: dict[str, list[int]] = {}
        for k, key in enumerate(self.keys):
            by_key.setdefault(key, []).append(k)
        known = {deviation_key(sizing): sizing for sizing in self.sources.values()}
        sizes = {sizing.key: sizing for sizing in self.sources.values()}
        single: list[int] = []
        for key, own in by_key.items():
            if key in known:
                changes |= self._deviation(known[key], key, own)
                single += own if len(own) == 1 and not self._is_zone(known[key]) else []
            elif key in sizes:
                changes |= sizes[key].resized(max(self._rounded(own[0]), 0.0))
            elif key.startswith("drives."):
                # A drive that had no error in the file.
                changes[key] = self._rounded(own[0])
                if self.posterior:
                    changes[key.replace(".deviation", ".error")] = {"sigma": self._error(own[0])}
                    single.append(own[0])
            else:
                raise InputError(f"the mechanism has no {key}; the result is of another one", key="result")
        return changes | (self._correlations(single) if self.posterior else {})

    def _is_zone(self, sizing: Sizing) -> bool:
        source = self.m.compiled_sources[self.m.sources.index(sizing.sources[0])]
        return source.shape != "interval"

    def _deviation(self, sizing: Sizing, key: str, own: list[int]) -> dict[str, object]:
        """The changes of one source: its table gets the deviation, and what is left open of it."""
        values = [self._rounded(k) for k in own]
        told: Any = values if self._is_zone(sizing) else values[0]
        if self._is_zone(sizing):
            told = self._with_known(sizing, own, values)
        entry = self._value(sizing.key)
        is_table = isinstance(entry, Mapping) or entry is None
        left = self._left_open(sizing, own)
        if sizing.key.endswith(".error"):
            stem = sizing.key.removesuffix(".error")
            law = {f"{stem}.law": None} if left and self._value(f"{stem}.law") is not None else {}
            return {key: told, **({sizing.key: left["tolerance"]} if left else {}), **law}
        if is_table and not left:
            return {key: told}
        table = dict(entry) if isinstance(entry, Mapping) else {sizing.measure: entry}
        if left:
            table = {name: value for name, value in table.items() if name != "law"} | left
        return {sizing.key: {**table, "deviation": told}}

    def _with_known(self, sizing: Sizing, own: list[int], values: list[float]) -> list[float]:
        """All components of a zone, of which some may have been held."""
        m = self.m
        s = m.sources.index(sizing.sources[0])
        places = [k for k, place in places_of(m, [*self.sources.values()]).items() if place[0].key == sizing.key]
        whole = [float(m.centre[k] / m.parameter_factors[k]) for k in places]
        labels = [m.parameters[k] if len(places) > 1 else m.sources[s] for k in places]
        for k, value in zip(own, values, strict=True):
            whole[labels.index(self.names[k])] = value
        return whole

    def _left_open(self, sizing: Sizing, own: list[int]) -> dict[str, Any]:
        if not self.posterior:
            return {}
        error = max(self._error(k) for k in own)
        if not self._is_zone(sizing):
            return {"tolerance": {"sigma": error}}
        return {sizing.measure: SIGMAS * error * (2.0 if sizing.measure == "diameter" else 1.0)}

    def _value(self, key: str) -> Any:
        try:
            return self.m.value(key)
        except InputError:
            return None

    def _rounded(self, k: int) -> float:
        """An estimate with the digits that its standard error gives it."""
        error, value = float(self.errors[k]), float(self.values[k])
        if not (math.isfinite(error) and error > 0.0):
            return float(f"{value:.6g}")
        return round(value, min(15, max(0, DIGITS - math.floor(math.log10(error)))))

    def _error(self, k: int) -> float:
        return float(f"{float(self.errors[k]):.6g}")

    def _correlations(self, single: list[int]) -> dict[str, object]:
        """The correlations of what is left open, in the place of those that the sources had."""
        names = [self.names[k] for k in single]
        kept = [
            dict(group) for group in self.m.raw.get("correlations", []) if not {*group.get("sources", ())} & {*names}
        ]
        if len(single) > MOST_CORRELATED:
            problem = f"{len(single)} unknowns hang together; the file can have at most {MOST_CORRELATED} in one group"
            raise InputError(problem, key="posterior")
        covariance = self.found.get("covariance")[np.ix_(single, single)]
        if len(single) > 1:
            kept.append({"sources": names, "ranks": _ranks(covariance)})
        return {"correlations": kept} if kept or "correlations" in self.m.raw else {}


def _ranks(covariance: Floats) -> list[list[float]]:
    errors = np.sqrt(np.diagonal(covariance))
    rho = np.clip(covariance / np.outer(errors, errors), -1.0, 1.0)
    ranks = 6.0 / np.pi * np.arcsin(rho / 2.0)
    np.fill_diagonal(ranks, 1.0)
    both = np.round((ranks + ranks.T) / 2.0, 12)
    return [list(map(float, row)) for row in both]
