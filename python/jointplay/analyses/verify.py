"""`verify`: whether a machine keeps to its limits where it was measured, with which risk, and how well it repeats.

    error = reading - pose that was commanded,   s = sigma / sqrt(readings of the same approach)
    risk  = P(true error beyond a limit),   every component normal about what was read, independent of the others

The limits are accepted where the sum of the risks over all poses, which no risk of missing one anywhere exceeds, is
small; rejected where one of them is certain; and undecided in between (the rule of ISO 14253-1, with a risk in place of
a guard band).

    accuracy       AP = |mean - commanded|                       ISO 9283
    repeatability  RP = mean(l) + 3 s(l),   l the distance from the mean
    of a column    B, R, E, M and A                              ISO 230-2, from both sides
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.analyses.readings import OUTPUT, ReadingModel, Readings, nearest_frame, readings, require_whole
from jointplay.analyses.recorded import recorded
from jointplay.basics.arrays import Flags, Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, shown
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder, Variable, to_dataset

if TYPE_CHECKING:
    import xarray as xr

ACCEPTED, REJECTED, UNDECIDED, NO_LIMIT = "accepted", "rejected", "undecided", "no_limit"
#: risk with which limits are accepted
RISK = 0.05
#: what ISO 230-2 takes: standard deviations of positions to either side
COVERED = 2.0
#: standard deviations beyond which nothing is integrated, and values at which an integrand is taken
FAR, NODES = 9.0, 64


@typed
def verify(
    m: Mechanism,
    measured: str | os.PathLike[str] | Mapping[str, Any] | Any,
    *,
    sigma: str | Mapping[str, float] | None = None,
    risk: float = RISK,
) -> xr.Dataset:
    """Find whether a machine keeps to its limits where it was measured, and how well it repeats.

    Parameters
    ----------
    m : Mechanism
        With limits.
    measured : path or mapping
        A table, or columns by name, as for `calibrate`. What was commanded is the nominal pose of the `configuration`,
        or at the drive values of the row: of drives that were corrected give the configuration. Readings of one
        `approach` are averaged. With a `side`, forward or backward, reversal is evaluated, too.
    sigma : mapping or "auto", optional
        Standard deviations of single readings, as for `calibrate`.
    risk : float
        With which limits are accepted, or rejected.

    Returns
    -------
    xarray.Dataset
        Over `visit`, every approach, labelled by its first row: `error` (by `channel`), and by `limited`, what has a
        limit and is read: `risk` (that the limit is missed there), `used` (part of the limit) and `judged` (false where
        not all that it is made of was read: the others are lower bounds then). Over `place` and
        `point`: `accuracy` and `repeatability` of position (ISO 9283), nan with a single visit; over `place`: `visits`.
        Over `point`: `position_rms`, the rms of the position error, and `best_fit_rms`, what the best fit of a frame
        leaves of it: that of a measuring device is hardly known to such accuracy.
        Over `channel`, where every place is read twice or more from both sides (ISO 230-2): `reversal` (B),
        `bidirectional_repeatability` (R), `systematic_deviation` (E), `mean_deviation` (M) and
        `bidirectional_accuracy` (A). And `total_risk`, which no risk that a limit is missed exceeds, and `status`:
        ``accepted``, ``rejected``, ``undecided`` or ``no_limit``.

    Raises
    ------
    InputError
        When a column or a value is not valid, or nothing that is limited is read.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 1.0})
    >>> poses = jp.solve(m).nominal.sel(component=["x", "y"])
    >>> table = {"configuration": [0, 1, 2], "x": poses[:3, 0].values + 0.3, "y": poses[:3, 1].values}
    >>> jp.verify(m, table, sigma={"length": 0.01}).status.item()
    'accepted'
    """
    return to_dataset(compute(m, measured, sigma=sigma, risk=risk))


@recorded
def compute(
    m: Mechanism, measured: Any, *, sigma: Any = None, risk: float = RISK, progress: Progress | None = None
) -> Result:
    """The light form of `verify`."""
    if not 0.0 < risk < 0.5:
        raise InputError(f"{shown(risk)} is no risk between 0 and 0.5", key="risk")
    require_whole(m)
    visits = _Visits(m, readings(m, measured, sigma))
    return visits.result(risk, progress)


def holds(result: Result) -> bool:
    """Whether the limits are accepted."""
    return str(result.get("status")) in (ACCEPTED, NO_LIMIT)


@dataclass(frozen=True)
class _Limited:
    """A quantity that has a limit and is read."""

    #: ``x``, ``jaw.position``
    name: str
    #: of what it is made
    columns: tuple[int, ...]
    #: `low`, `high`: SI
    low: float
    high: float

    def judged(self, error: Floats) -> Flags:
        """Of every visit whether all that it is made of was read."""
        return np.asarray(np.isfinite(error[:, self.columns]).all(axis=1))

    def risk(self, error: Floats, sigma: Floats) -> Floats:
        """Probability that the true value is beyond a limit; what was not read adds nothing to it."""
        from scipy.special import ndtr

        own, spread = error[:, self.columns], sigma[:, self.columns]
        if len(self.columns) == 1:
            value, along = own[:, 0], spread[:, 0]
            return np.asarray(ndtr((value - self.high) / along) + ndtr((self.low - value) / along))
        # Components that are read more exactly are integrated first, so that all integrands are smooth.
        orders = [order[np.isfinite(own[k, order])] for k, order in enumerate(np.argsort(spread, axis=1))]
        each = zip(own, spread, orders, strict=True)
        high = np.array(self.high)
        return np.array([_beyond(one[order], by[order], high) if order.size else np.nan for one, by, order in each])

    def used(self, error: Floats) -> Floats:
        """Part of the limit that is used, more than one where it is missed."""
        own = error[:, self.columns]
        if len(self.columns) > 1:
            return np.asarray(np.sqrt(np.nansum(own**2, axis=1)) / self.high)
        half, middle = 0.5 * (self.high - self.low), 0.5 * (self.high + self.low)
        if np.isfinite(half):
            return np.asarray(np.abs(own[:, 0] - middle) / half)
        return np.asarray(own[:, 0] / (self.high if np.isfinite(self.high) else self.low))


@cache
def _rule() -> tuple[Floats, Floats]:
    """Gauss and Legendre's."""
    return np.polynomial.legendre.leggauss(NODES)


def _beyond(mean: Floats, sigma: Floats, radius: Floats) -> Floats:
    """Probability that a normal vector, of independent components in the last axis, is longer than a radius.

    A component x leaves sqrt(radius^2 - x^2) to the others, which is smooth in t with x = radius sin t. No term is
    negative, so that small probabilities keep their digits.

    Examples
    --------
    >>> bool(np.isclose(_beyond(np.zeros(2), np.ones(2), np.array(6.0)), np.exp(-18.0), rtol=1e-12))
    True
    """
    from scipy.special import ndtr

    own, spread = mean[..., 0], sigma[..., 0]
    beyond = np.asarray(ndtr((own - radius) / spread) + ndtr((-radius - own) / spread))
    if mean.shape[-1] == 1:
        return beyond
    ends = [np.arcsin(np.clip((own + side * FAR * spread) / radius, -1.0, 1.0)) for side in (-1.0, 1.0)]
    nodes, weights = _rule()
    half = 0.5 * (ends[1] - ends[0])[..., None]
    t = half * nodes + 0.5 * (ends[0] + ends[1])[..., None]
    left = radius[..., None] * np.cos(t)
    away = (radius[..., None] * np.sin(t) - own[..., None]) / spread[..., None]
    density = np.exp(-0.5 * away**2) / (np.sqrt(2.0 * np.pi) * spread[..., None])
    others = _beyond(mean[..., None, 1:], sigma[..., None, 1:], left)
    return np.asarray(beyond + np.sum(half * weights * left * density * others, axis=-1))


class _Visits:
    """All approaches of a table: their errors, and where they are."""

    def __init__(self, m: Mechanism, table: Readings) -> None:
        self.m = m
        model = ReadingModel(m, table, scattered=True)
        every = model.compare(table.values, model.commanded())
        names, first, owner = np.unique(table.approaches, return_index=True, return_inverse=True)
        counts = np.zeros((len(names), len(table.channels)))
        np.add.at(counts, owner, np.isfinite(every))
        error, variance = np.zeros_like(counts), np.zeros_like(counts)
        np.add.at(error, owner, np.nan_to_num(every))
        np.add.at(variance, owner, np.where(np.isfinite(every), table.sigma**2, 0.0))
        known = counts > 0
        size = np.where(known, counts, 1.0)
        #: mean over the readings of the approach, and its standard deviation
        self.error = np.where(known, error / size, np.nan)
        self.sigma = np.where(known, np.sqrt(variance) / size, np.nan)
        self.table = table.chosen(first)
        keys: dict[tuple[bytes, str], int] = {}
        rows = zip(self.table.drives, self.table.cases, strict=True)
        self.place = np.array([keys.setdefault((drives.tobytes(), case), len(keys)) for drives, case in rows])
        self.commanded = model.commanded().values[first]
        self.points = [point for point in m.outputs or (OUTPUT,) if self._of(point, self._parts(lengths=True))]

    def _parts(self, *, lengths: bool) -> list[str]:
        """The components of a position, or of a rotation."""
        return [name for name in self.m.components if (name in LENGTHS) == lengths]

    def _of(self, point: str, components: Sequence[str]) -> tuple[int, ...]:
        """The columns of some components of a point; none where one of them is not read."""
        channels = enumerate(self.table.channels)
        known = self.m.components
        own = {known[one.component]: k for k, one in channels if one.form == "component" and one.points[0] == point}
        return tuple(own[name] for name in components) if components and set(components) <= set(own) else ()

    def limited(self) -> tuple[list[_Limited], list[str]]:
        """What has a limit: read, and not read."""
        found, missing = [], []
        for name in self.m.outputs or (None,):
            part = self.m.only(output=name)
            bounds = part.limits.bounds(part.quantities).tolist()
            for quantity, (low, high) in zip(part.quantities, bounds, strict=True):
                if not (np.isfinite(low) or np.isfinite(high)):
                    continue
                title = f"{name}.{quantity}" if name else quantity
                point = name or OUTPUT
                if quantity in part.components:
                    columns = self._of(point, [quantity])
                else:
                    columns = self._of(point, self._parts(lengths=quantity == "position"))
                    # A size of one component is on both sides of zero.
                    low = -high
                one = _Limited(title, columns, low, high)
                if columns and one.judged(self.error).any():
                    found.append(one)
                else:
                    missing.append(title)
        return found, missing

    def result(self, risk: float, progress: Progress | None = None) -> Result:
        m, table = self.m, self.table
        limited, missing = self.limited()
        if missing and not limited:
            raise table.sheet.refuse(f"nothing is read that has a limit: {', '.join(missing)}")
        builder = ResultBuilder(m, "verify", measured=table.sheet.name, risk=risk)
        if missing:
            builder.attrs["not_read"] = ", ".join(missing)
        builder.axes["channel"] = table.axis
        builder.labels("visit", table.lines, "first row of the approach")
        builder.add("error", ("visit", "channel"), self.error, "reading - what was commanded", "channel")
        status = self._risks(builder, limited, risk, progress)
        self._sizes(builder)
        self._both_sides(builder)
        builder.data["status"] = Variable((), np.array(status), "", "whether the limits are accepted")
        return builder.result()

    def _risks(
        self, builder: ResultBuilder, limited: Sequence[_Limited], risk: float, progress: Progress | None
    ) -> str:
        """Add the risks; what becomes of the limits."""
        if not limited:
            return NO_LIMIT
        columns = []
        for k, one in enumerate(limited):
            columns.append(one.risk(self.error, self.sigma))
            if progress is not None:
                progress(k + 1, len(limited))
        each = np.nan_to_num(np.column_stack(columns))
        builder.labels("limited", [one.name for one in limited], "quantity with a limit")
        words = "risk that the limit is missed there"
        builder.data["risk"] = Variable(("visit", "limited"), each, "", words)
        total = float(min(each.sum(), 1.0))
        builder.data["total_risk"] = Variable((), np.array(total), "", "no risk that a limit is missed is larger")
        used = np.column_stack([one.used(self.error) for one in limited])
        builder.data["used"] = Variable(("visit", "limited"), used, "", "part of the limit that is used")
        judged = np.column_stack([one.judged(self.error) for one in limited])
        builder.data["judged"] = Variable(("visit", "limited"), judged, "", "whether all that it is made of was read")
        if total <= risk:
            return ACCEPTED
        return REJECTED if each.max() >= 1.0 - risk else UNDECIDED

    def _sizes(self, builder: ResultBuilder) -> None:
        """Add accuracy and repeatability of position."""
        count = int(self.place.max()) + 1
        first = [int(np.flatnonzero(self.place == k)[0]) for k in range(count)]
        builder.labels("place", [self.table.lines[k] for k in first], "first row of the place")
        visits = np.bincount(self.place)
        builder.data["visits"] = Variable(("place",), visits, "", "approaches of the place")
        if not self.points:
            return
        builder.labels("point", self.points, "output")
        found = np.full((2, count, len(self.points)), np.nan)
        for k, point in enumerate(self.points):
            own = self.error[:, self._of(point, self._parts(lengths=True))]
            for place in range(count):
                rows = own[(self.place == place) & np.isfinite(own).all(axis=1)]
                if not len(rows):
                    continue
                found[0, place, k] = np.linalg.norm(rows.mean(axis=0))
                if len(rows) > 1:
                    away = np.linalg.norm(rows - rows.mean(axis=0), axis=1)
                    found[1, place, k] = away.mean() + 3.0 * away.std(ddof=1)
        for name, values, words in (
            ("accuracy", found[0], "distance of the mean from what was commanded (AP of ISO 9283)"),
            ("repeatability", found[1], "mean + 3 standard deviations of the distance from the mean (RP of ISO 9283)"),
        ):
            builder.add(name, ("place", "point"), values, words, "length")
        sizes = np.array([self._best_fit(point) for point in self.points])
        for k, (name, words) in enumerate(
            (
                ("position_rms", "rms of the position error over all approaches"),
                ("best_fit_rms", "the same after the best fit of a frame; nan with too few places"),
            )
        ):
            builder.add(name, "point", sizes[:, k], words, "length")

    def _best_fit(self, point: str) -> tuple[float, float]:
        """Root of the mean square of the position error, and what the best fit of a frame leaves of it."""
        columns = self._of(point, self._parts(lengths=True))
        known = np.isfinite(self.error[:, columns]).all(axis=1)
        error, commanded = (values[known][:, columns] for values in (self.error, self.commanded))
        if not known.any():
            return np.nan, np.nan
        rms = float(np.sqrt((error**2).sum(axis=1).mean()))
        if len(np.unique(self.place[known])) <= len(columns):
            return rms, np.nan
        left = commanded + error - nearest_frame(commanded, commanded + error).places(commanded)
        return rms, float(np.sqrt((left**2).sum(axis=1).mean()))

    def _both_sides(self, builder: ResultBuilder) -> None:
        """Add what ISO 230-2 evaluates, where every place is read twice or more from both sides."""
        count = int(self.place.max()) + 1
        sides = self.table.sides
        rows = [[np.flatnonzero((self.place == k) & (sides == side)) for side in (1, -1)] for k in range(count)]
        if any(len(own) < 2 for both in rows for own in both):
            return
        mean, std = (np.empty((2, count, len(self.table.channels))) for _ in range(2))
        for k, both in enumerate(rows):
            for side, own in enumerate(both):
                mean[side, k], std[side, k] = self.error[own].mean(axis=0), self.error[own].std(axis=0, ddof=1)
        reversal = mean[0] - mean[1]
        alone = 2.0 * COVERED * std
        together = COVERED * (std[0] + std[1]) + np.abs(reversal)
        low, high = (mean - COVERED * std).min(axis=(0, 1)), (mean + COVERED * std).max(axis=(0, 1))
        middle = mean.mean(axis=0)
        for name, values, words in (
            ("reversal", np.abs(reversal).max(axis=0), "largest reversal error (B)"),
            ("bidirectional_repeatability", np.max([*alone, together], axis=(0, 1)), "from both sides (R)"),
            ("systematic_deviation", mean.max(axis=(0, 1)) - mean.min(axis=(0, 1)), "range of the means (E)"),
            ("mean_deviation", middle.max(axis=0) - middle.min(axis=0), "range of the means of both sides (M)"),
            ("bidirectional_accuracy", high - low, "range of the means -+ 2 standard deviations (A)"),
        ):
            builder.add(name, "channel", values, f"{words}, ISO 230-2", "channel")
