"""`plan`: which readings of one machine tell most about the error that its deviations leave.

    minimise  tr Q C,   C = (P' P + sum G_i' G_i)^-1,   Q = mean over the path of (J S)' (J S)

over the readings i, with G_i = W_i H_i S: H their derivatives by all unknowns, W what whitens noise and play, S the
root of the covariance of the priors, P = 1 where there is a prior, and J the derivatives of the output's position.
tr Q C is the mean square of the position error that is left along the path (I-optimality: it depends on no choice of
units, and priors make it regular from the first reading on). Readings are added one by one, each time that which takes
most away; then each is exchanged for another one as long as that helps. With a reading of m cells more

    tr Q C  falls by  tr (I + G C G')^-1 G C Q C G'
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.calibrate import fitter_of, freed, several
from jointplay.analyses.calibrate.fit import Fitter
from jointplay.analyses.calibrate.unknowns import Unknowns, unknowns_of
from jointplay.analyses.map import compute as map_nodes
from jointplay.analyses.nominal import Progress, at_drives, nominal
from jointplay.analyses.readings import APPROACH, LOAD_CASE, Channel, channel, names_of, readings
from jointplay.analyses.recorded import recorded
from jointplay.basics.arrays import Floats
from jointplay.basics.progress import counting
from jointplay.basics.typed import typed
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, in_range, not_known, shown
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder, Variable, to_dataset

if TYPE_CHECKING:
    import xarray as xr

#: readings that are planned at most, and rows that they are chosen from
MOST, MOST_ROWS = 1000, 5000
#: variance of what has no prior, where one is what all rows leave that determine it
OPEN = 1e10
#: a choice that is better by less than this part of what is left is rounding
SAME = 1e-9
#: part of the error that a reading takes away, below which more of them do not help
HELPS = 0.02


@typed
def plan(
    m: Mechanism,
    count: int,
    *,
    columns: Sequence[str] | None = None,
    sigma: Mapping[str, float] | None = None,
    measured: str | os.PathLike[str] | Mapping[str, Any] | Any = None,
    free: Mapping[str, Any] | Sequence[str] | None = None,
    fix: Sequence[str] | None = None,
    frame: str = "known",
    zeroed: Sequence[str] | None = None,
    sizes: bool = False,
    contact: str | None = None,
) -> xr.Dataset:
    """Find which readings of one machine tell most about the position error that its deviations leave.

    Parameters
    ----------
    m : Mechanism
        With tolerances, and a path or a grid: readings are chosen from its configurations, without any load and in
        every load case.
    count : int
        How many readings are wanted.
    columns : sequence of str, optional
        What is read each time, as columns of the table are called: ``x``, ``jaw.y``, ``distance:A-B``, ``dial:tip:z``;
        all components of all outputs if left out.
    sigma : mapping
        Standard deviations of single readings, as for `calibrate`.
    measured : path or mapping, optional
        Readings that are there already, as for `calibrate`.
    free, fix, frame, zeroed, sizes, contact
        As for `calibrate`.

    Returns
    -------
    xarray.Dataset
        Over `choice`, the reading that brings most first: `configuration` (its number along the path; -1 in a grid),
        `drive_value` (by drive), `load_case` (empty: none acts), `position_after` (rms over the path of the position
        error that is left with this reading and those before it, by what is unknown), `gain` (part of it that this
        reading takes away). And `position_before` (without any of them), `position_evenly` (with as many that are
        spread evenly), `position_all` (with every row once), `enough` (how many of them take away two per cent or more
        each).

    Raises
    ------
    InputError
        When a column or a name is not known, nothing is unknown, or nothing tells an unknown without a prior.

    Notes
    -----
    It rests on the derivatives at the nominal pose. Where play scatters, where one reads hardly matters: compare
    `position_evenly`.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("five-bar")).with_({"loads": None, "load_cases": None})
    >>> found = jp.plan(m, 4, columns=["x", "y"], sigma={"length": 0.002})
    >>> bool(found.position_after[-1] < found.position_evenly)
    True
    """
    names = None if columns is None else several(columns)
    return to_dataset(
        compute(
            m,
            count,
            columns=names,
            sigma=sigma,
            measured=measured,
            free=freed(free),
            fix=several(fix),
            frame=frame,
            zeroed=several(zeroed),
            sizes=sizes,
            contact=contact,
        )
    )


@recorded
def compute(
    m: Mechanism,
    count: int,
    *,
    columns: tuple[str, ...] | None = None,
    sigma: Mapping[str, float] | None = None,
    measured: Any = None,
    free: Mapping[str, float | None] | None = None,
    fix: tuple[str, ...] = (),
    frame: str = "known",
    zeroed: tuple[str, ...] = (),
    sizes: bool = False,
    contact: str | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `plan`."""
    in_range(count, "count", "a number of readings", 1, MOST)
    unknowns = unknowns_of(m, free or {}, fix, sizes=sizes)
    places = _places(unknowns.m)
    rows = _rows(unknowns.m, places)
    if len(rows) > MOST_ROWS:
        problem = (
            f"{len(rows):,} rows to choose from, configurations times load cases; at most {MOST_ROWS:,} are looked at"
        )
        raise InputError(problem, file=m.file, key="drives")
    names = columns or tuple(names_of(unknowns.m))
    for k, name in enumerate(names):
        if name in names[:k]:
            raise InputError(f"{shown(name)} is there twice; a number of readings says how often", key="columns")
        if channel(unknowns.m, name) is None:
            forms = "; or distance:POINT-POINT, dial:POINT:DIRECTION"
            raise InputError(not_known(name, "something that is measured", names_of(unknowns.m)) + forms, key="columns")
    options: dict[str, Any] = {"frame": frame, "zeroed": zeroed, "sizes": sizes, "contact": contact}
    table = readings(unknowns.m, _table(unknowns.m, places.drives, rows, names), sigma)
    fitter = fitter_of(unknowns, table, **options)
    known = None
    if measured is not None:
        own = readings(unknowns.m, measured, sigma)
        known = fitter_of(unknowns, own, **(options | {"zeroed": tuple(n for n in zeroed if n in own.names)}))
    # Each is chosen, exchanged and put in its order.
    search = _Search(fitter, known, _wanted(unknowns, places), counting(progress, 3 * count))
    chosen = search.chosen(count)
    return _told(m, search, chosen, places, rows, names)


@dataclass(frozen=True, eq=False)
class _Places:
    """Where the machine may be read: drive values, SI, and the number of the configuration of the path."""

    drives: Floats
    numbers: NDArray[np.int64]


def _places(m: Mechanism) -> _Places:
    """The configurations of the path, or of the grid, at which the machine can stand."""
    whole = m.without_load_cases().first
    if whole.drive_values is None and whole.targets is None and m.data.grid is not None:
        drives = _nodes(whole)
        return _Places(drives, np.full(len(drives), -1))
    at = nominal(whole)
    good = np.flatnonzero((at.status == 0) & at.counts)
    if not good.size:
        raise InputError(
            "the machine can be at no configuration; `jointplay solve` says why", file=m.file, key="drives"
        )
    return _Places(at.drives[good], good)


def _nodes(m: Mechanism) -> Floats:
    """Drive values at the nodes of the grid."""
    found = map_nodes(m, "solve")
    assert found is not None
    status = found.data["status"]
    columns = []
    for variable, factor in zip(found.drives.values(), m.drive_factors, strict=True):
        shape = [n if dim in variable.dims else 1 for dim, n in zip(status.dims, status.values.shape, strict=True)]
        columns.append(np.broadcast_to(variable.values.reshape(shape), status.values.shape).ravel() * factor)
    good = status.values.ravel() == "ok"
    if not good.any():
        raise InputError("the machine can be at no node of the grid", file=m.file, key="grid")
    return np.asarray(np.column_stack(columns)[good])


def _rows(m: Mechanism, places: _Places) -> list[tuple[int, str]]:
    """What may be read: a place without any load, and in every load case."""
    return [(k, case) for case in ("", *m.load_cases) for k in range(len(places.drives))]


def _table(m: Mechanism, drives: Floats, rows: Sequence[tuple[int, str]], names: Sequence[str]) -> dict[str, Any]:
    """These rows as a table in which nothing is read yet."""
    table: dict[str, Any] = {name: [0.0] * len(rows) for name in names}
    for k, name in enumerate(m.drives):
        table[name] = [float(drives[place, k] / m.drive_factors[k]) for place, _ in rows]
    # Each is a reading of its own, though all read the same here.
    return table | {LOAD_CASE: [case for _, case in rows], APPROACH: list(range(len(rows)))}


def _wanted(unknowns: Unknowns, places: _Places) -> Floats:
    """Derivatives of the positions of all outputs along the path by the unknowns, shape (equation, unknown)."""
    base = unknowns.m.without_load_cases()
    own = [k for k, one in enumerate(unknowns.unknowns) if not one.of_file]
    columns = [unknowns.unknowns[k].parameter for k in own]
    found = []
    for name in base.outputs or (None,):
        part = base.only(output=name)
        at = at_drives(part, places.drives)
        slopes = part.core.sensitivity(at.drives, at.with_errors.poses)["source"]
        lengths = [k for k, component in enumerate(part.components) if component in LENGTHS]
        slopes = slopes[np.isfinite(slopes).all(axis=(1, 2))][:, lengths][:, :, columns]
        whole = np.zeros((*slopes.shape[:2], len(unknowns)))
        whole[:, :, own] = slopes
        # The mean over the path, summed over outputs.
        found.append(whole.reshape(-1, len(unknowns)) / np.sqrt(max(len(slopes), 1)))
    return np.concatenate(found)


class _Search:
    """Chooses rows of a table that is not read yet.

    Parameters
    ----------
    fitter : Fitter
        Of the table.
    known : Fitter, optional
        Of readings that are there already.
    wanted : ndarray
        Derivatives of what is to be known, shape (equation, unknown).
    step : callable
        Called at each choice.
    """

    def __init__(self, fitter: Fitter, known: Fitter | None, wanted: Floats, step: Callable[[], None]) -> None:
        self.step = step
        count = len(fitter.unknowns) + len(fitter.frame_columns)
        every = np.ones(len(fitter.readings), dtype=bool)
        system = fitter.system(every)
        fitter.require_determined(system)
        information = np.zeros((fitter.width, fitter.width))
        if known is not None:
            information[:count, :count] = _information(known, count)
        # Of independent numbers those of the priors are of size one, and of the others nothing is known.
        unknowns = system.scale[:, None] * system.basis
        independent = system.root.shape[1]
        self.prior = np.diag(np.where(np.arange(unknowns.shape[1]) < independent, 1.0, 1.0 / OPEN))
        self.prior += unknowns.T @ information @ unknowns
        #: of every row what it adds
        self.rows = [system.a[block] @ system.basis for block in system.weights.blocks]
        self.order = [int(system.weights.rows[block.start]) for block in system.weights.blocks]
        equations = np.zeros((len(wanted), fitter.width))
        equations[:, : wanted.shape[1]] = wanted
        self.q = _squared(equations @ unknowns)

    def covariance(self, chosen: Iterable[int]) -> Floats:
        """Covariance of the scaled unknowns with some rows."""
        total = self.prior.copy()
        for k in chosen:
            total += _squared(self.rows[k])
        return np.asarray(np.linalg.inv(total))

    def left(self, chosen: Iterable[int]) -> float:
        """Mean square of the error that some rows leave."""
        return float(np.sum(self.q * self.covariance(chosen)))

    def best(self, covariance: Floats, among: Sequence[int]) -> tuple[int, float]:
        """Which of some rows takes most away, and how much; of equal ones the first."""
        self.step()
        gains = np.array([self._gain(covariance, k) for k in among])
        most = float(gains.max())
        k = int(np.flatnonzero(gains >= most - SAME * abs(most))[0])
        return among[k], float(gains[k])

    def _gain(self, covariance: Floats, k: int) -> float:
        row = self.rows[k]
        moved = covariance @ row.T
        middle = np.eye(len(row)) + row @ moved
        return float(np.trace(np.linalg.solve(middle, moved.T @ self.q @ moved)))

    def chosen(self, count: int) -> list[int]:
        """The best rows that exchanging finds, that which brings most first."""
        every = range(len(self.rows))
        found: list[int] = []
        for _ in range(count):
            found.append(self.best(self.covariance(found), every)[0])
        changed = True
        while changed:
            changed = False
            for place in range(count):
                others = found[:place] + found[place + 1 :]
                covariance = self.covariance(others)
                better, gain = self.best(covariance, every)
                if gain > self._gain(covariance, found[place]) + SAME * float(np.sum(self.q * covariance)):
                    found[place], changed = better, True
        ordered: list[int] = []
        rest = found.copy()
        while rest:
            k, _ = self.best(self.covariance(ordered), rest)
            rest.remove(k)
            ordered.append(k)
        return ordered


def _squared(rows: Floats) -> Floats:
    return np.asarray(rows.T @ rows)


def _information(fitter: Fitter, count: int) -> Floats:
    """What readings say of the first unknowns, SI, with what only they have made up for."""
    system = fitter.system(np.ones(len(fitter.readings), dtype=bool))
    a = system.a / system.scale
    own, rest = a[:, :count], a[:, count:]
    if rest.size:
        basis = np.linalg.qr(rest)[0]
        own = own - basis @ (basis.T @ own)
    return _squared(own)


def _told(
    m: Mechanism,
    search: _Search,
    chosen: Sequence[int],
    places: _Places,
    rows: Sequence[tuple[int, str]],
    names: Sequence[str],
) -> Result:
    builder = ResultBuilder(m, "plan", columns=", ".join(names), rows=len(rows))
    picked = [rows[search.order[k]] for k in chosen]
    where = np.array([place for place, _ in picked])
    left = np.sqrt([search.left(chosen[: n + 1]) for n in range(len(chosen))])
    before = float(np.sqrt(search.left(())))
    earlier = np.array([before, *left[:-1]])
    gain = np.where(earlier > 0.0, 1.0 - left / np.where(earlier > 0.0, earlier, 1.0), 0.0)
    builder.labels("choice", np.arange(len(chosen)), "number of the reading, from 0")
    builder.add("drive_value", ("choice", "drive"), places.drives[where], "drive value", "drive")
    numbers = places.numbers[where]
    builder.data["configuration"] = Variable(("choice",), numbers, "", "number of the configuration; -1: of a grid")
    if m.load_cases:
        cases = np.array([case for _, case in picked], dtype=str)
        builder.data["load_case"] = Variable(("choice",), cases, "", "load case that acts; empty: none")
    words = "rms of the position over the path that is left with this reading and those before it"
    builder.add("position_after", "choice", left, words, "length")
    builder.data["gain"] = Variable(("choice",), gain, "", "part of it that the reading takes away")
    evenly = np.linspace(0, len(search.rows) - 1, len(chosen)).round().astype(int)
    for name, value, words in (
        ("position_before", before, "the same without any of them"),
        ("position_evenly", np.sqrt(search.left(evenly)), "the same with as many that are spread evenly"),
        ("position_all", np.sqrt(search.left(range(len(search.rows)))), "the same with every row once"),
    ):
        builder.add(name, (), np.array(value), words, "length")
    few = np.flatnonzero(gain < HELPS)
    enough = int(few[0]) if few.size else len(chosen)
    builder.data["enough"] = Variable((), np.array(enough), "", "readings before the first that hardly helps")
    builder.data["status"] = Variable((), np.array("ok"), "", "whether readings are found")
    return builder.result()


def sheet_of(m: Mechanism, result: Result) -> str:
    """A table in which the readings of a plan are written: a CSV with empty columns, rows in the order of the path."""
    columns = str(result.attrs["columns"]).split(", ")
    values = result.get("drive_value")
    cases = result.get("load_case") if "load_case" in result.data else None
    numbers = result.get("configuration")
    order = sorted(range(len(values)), key=lambda k: (cases[k] if cases is not None else "", numbers[k], *values[k]))
    kinds = [channel(m, name) for name in columns]
    units = result.labels("drive_unit") if values.shape[1] else []
    heads = [f"{name} [{unit}]" for name, unit in zip(result.labels("drive"), units, strict=True)]
    heads += [LOAD_CASE] * (cases is not None)
    heads += [
        f"{name} [{result_unit}]" for name, result_unit in zip(columns, (_unit(m, one) for one in kinds), strict=True)
    ]
    lines = [heads]
    for k in order:
        case = [str(cases[k])] if cases is not None else []
        lines.append([*(f"{value:.9g}" for value in values[k].tolist()), *case, *[""] * len(columns)])
    return "".join(",".join(line) + "\n" for line in lines)


def _unit(m: Mechanism, one: Channel | None) -> str:
    assert one is not None
    return str(getattr(m.units, f"{one.kind}_name"))
