"""`diagnose`: which joints of a machine are worn, from readings at the same places under different loads or sides.

    reading = place + sum_j D_j (f_j - 1) + G v + noise,   D_j = what a relative change of clearance j does where the
                                                           load presses it,  G v = what deviations add

A clearance lies where its reaction presses it, so that a load that pushes and one that pulls move the output by what
the play is, times what is known: the ratios f of the sizes to those of the file. What a place has in common, whatever
acts (the frame of the device, the zero of a dial, most of what deviations do), is an unknown of its own for every
column, and so drops out. What a deviation does to the play does not: where a small length turns a joint's reaction, it
moves the output otherwise under each load. Deviations are therefore unknown as well, with their laws as the prior.
Bodies that carry two forces press both of their joints by the same one: of such clearances only a sum is
determined. The equations are those of first order; what is read with the sizes and deviations that they give is found
on the exact closure, and what is missed then is fitted again.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.calibrate.system import EXACT, Combination, Weights, combinations, weights
from jointplay.analyses.calibrate.unknowns import Unknowns, is_play, unknowns_of
from jointplay.analyses.nominal import Progress
from jointplay.analyses.readings import ReadingModel, Readings, readings, require_whole
from jointplay.analyses.recorded import recorded
from jointplay.basics.arrays import Flags, Floats
from jointplay.basics.progress import counting
from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.model.gaps import travel
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings
from jointplay.result import Result, ResultBuilder, Variable, to_dataset
from jointplay.result.build import Labels

if TYPE_CHECKING:
    import xarray as xr

#: standard errors from which on a size is another one than that of the file, 95 %, where the deviations are given
SURE = 1.96
#: probability that any of the cells that are right is taken for a wrong one; part that may be left out
WRONG, MOST_LEFT_OUT = 0.01, 0.1
#: probability of a larger sum of squares from which on the sizes are doubted
DOUBT = 1e-3
#: how often what is missed on the exact closure is fitted again, and the part of a standard error that no longer counts
ROUNDS, NEAR = 4, 0.01
#: cells times places that are compared at once
MOST_NUMBERS = 40_000_000
WORN, TIGHT, SAME, VAGUE, OPEN = "worn", "tight", "as in the file", "not exact enough", "not determined"


@typed
def diagnose(
    m: Mechanism,
    measured: str | os.PathLike[str] | Mapping[str, Any] | Any,
    *,
    sigma: str | Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Find which joints of a machine are worn, from readings at the same places under different loads or sides.

    Parameters
    ----------
    m : Mechanism
        With load cases.
    measured : path or mapping
        A table, or columns by name, as for `calibrate`. Places are read under a `load_case` that pushes and one that
        pulls; or with the drives coming from either `side`, which takes up the backlash of all of them.
    sigma : mapping or "auto", optional
        Standard deviations of single readings, as for `calibrate`.

    Returns
    -------
    xarray.Dataset
        Over `group`, clearances of which only the sum is determined, or single ones: `group_size` (the sum of their
        sizes, as the file measures them), `group_standard_error`, `group_lowest` and `group_highest` (by the file),
        `state`: ``worn`` (larger than the file allows, with 95 % confidence), ``tight``, ``as in the file``,
        ``not exact enough`` (twice as much would not be seen) or ``not determined``. Over `group` and `clearance`,
        `part`: the coefficients of the sum. Over `clearance`: `size_lowest` and `size_highest` (by the file). Over
        `reading`, labelled by the row of the table, and `channel`: `measured`, `residual_before` (from what the place
        has in common, with the sizes of the file) and `residual_after`; `alone` (its place is read under one load only)
        and `left_out`. The attributes `chi_square`, `degrees_of_freedom`, `p_value`, `coverage_factor` (standard errors
        that 5 % of the sums exceed: 1.96, and more where repeated readings say how exact they are), `rank` (how many
        sums are determined), and `status`: ``ok``, or ``doubtful`` where the readings do not fit.

    Raises
    ------
    InputError
        When no place is read under two loads, no clearance changes a reading, or a value is not valid.

    Notes
    -----
    Sizes are found on the exact closure. What a machine may deviate by, within the tolerances of the file, is part of
    the standard errors; a deviation without a tolerance is not.

    Examples
    --------
    >>> import jointplay as jp
    >>> loads = {"push": [{"force": [300, -500]}], "pull": [{"force": [-300, 500]}]}
    >>> m = jp.loads(jp.examples.text("five-bar")).with_({"loads": None, "gravity": None, "load_cases": loads})
    >>> cases = {name: jp.loaded(m).sel(load_case=name) for name in loads}
    >>> table = {"configuration": [*range(5)] * 2, "load_case": ["push"] * 5 + ["pull"] * 5}
    >>> for name in ("x", "y"):
    ...     table[name] = [
    ...         value
    ...         for case in cases.values()
    ...         for value in (case.nominal + case.error).sel(component=name).values[:5].tolist()
    ...     ]
    >>> found = jp.diagnose(m, table, sigma={"length": 0.001})
    >>> set(found.state.values.tolist())
    {'as in the file'}
    """
    return to_dataset(compute(m, measured, sigma=sigma))


@recorded
def compute(m: Mechanism, measured: Any, *, sigma: Any = None, progress: Progress | None = None) -> Result:
    """The light form of `diagnose`."""
    require_whole(m)
    base, sources = sizings(m)
    own = [one for one in sources if is_play(base, one)]
    if not own:
        raise InputError(
            "no joint has a clearance and no drive backlash that could be found", file=m.file, key="joints"
        )
    fit = _Fit(base, own, readings(base, measured, sigma), counting(progress, 2 * ROUNDS))
    return _told(m, own, fit, fit.solved())


def holds(result: Result) -> bool:
    """Whether the readings fit, and no clearance may be another one than the file allows, as far as they tell."""
    return str(result.get("status")) == "ok" and not np.isin(result.get("state"), (WORN, TIGHT, VAGUE)).any()


@dataclass(frozen=True, eq=False)
class _Diagnosis:
    """What the readings tell."""

    #: rows that were not left out
    used: Flags
    #: clearances of which only a sum is determined, or single ones: index and coefficient of each
    groups: tuple[tuple[tuple[int, float], ...], ...]
    #: of every group whether the readings determine its sum
    determined: Flags
    #: `change`, `error`: of every sum how far it is from that of the sizes in the file, SI, and the standard error
    change: Floats
    error: Floats
    #: `chi`, `free`: sum of squares, and degrees of freedom
    chi: float
    free: int
    rank: int
    #: what deviations are, in standard deviations of their priors
    deviations: Floats

    def of_each(self, sizes: Floats) -> Floats:
        """The smallest change of every single clearance that gives the sums and takes no size below zero, SI."""
        found = np.zeros(len(sizes))
        for parts, determined, change in zip(self.groups, self.determined, self.change, strict=True):
            free = list(parts) if determined else []
            while free:
                square = sum(coefficient**2 for _, coefficient in free)
                rest = change - sum(coefficient * found[k] for k, coefficient in parts if (k, coefficient) not in free)
                for k, coefficient in free:
                    found[k] = max(rest * coefficient / square, -sizes[k])
                above = [(k, coefficient) for k, coefficient in free if found[k] > -sizes[k]]
                if len(above) == len(free):
                    break
                free = above
        return found


class _Fit:
    """Least squares of all readings, with what each place has in common."""

    def __init__(self, m: Mechanism, sources: Sequence[Sizing], table: Readings, step: Callable[[], None]) -> None:
        self.m, self.sources, self.table, self.step = m, sources, table, step
        unknowns = unknowns_of(m, {}, (), sizes=True)
        self.mean = unknowns.of_parameters(np.array([one.mean for one in unknowns.unknowns]))
        self.root = _root(unknowns)
        model = ReadingModel(m, table)
        if not any(load.moves_play for load in model.loads):
            problem = "nothing moves the joints through their play: a column 'load_case' says which load cases act, or"
            raise table.sheet.refuse(f"{problem} 'side' from which side the drives came")
        places: dict[bytes, int] = {}
        self.place = np.array([places.setdefault(row.tobytes(), len(places)) for row in table.drives])
        each = list(zip(self.place.tolist(), table.cases, table.sides.tolist(), strict=True))
        several = np.bincount([place for place, *_ in set(each)])
        self.paired = several[self.place] > 1
        if not self.paired.any():
            problem = "no place is read twice: the same drive values in two rows, with two load cases or sides"
            raise table.sheet.refuse(problem)
        read = model.read(self.mean, of_nominal=False)
        self.residual = model.compare(table.values, read)
        #: by the deviations, with the sizes and deviations that were found last
        self.lean = read.by_parameter @ self.root
        self.play = model.play(read)
        self.sizes = np.array([_sizes(m, one) for one in sources])
        #: by the sizes, SI
        self.slopes = model.by_size([[m.sources.index(name) for name in one.sources] for one in sources])
        self.slopes = self.slopes / self.sizes[:, 0]

    def solved(self) -> _Diagnosis:
        """The sums that are determined; rows that do not fit are left out, that which fits worst first."""
        from scipy.special import ndtri

        used, rows, residual = self.paired.copy(), int(self.paired.sum()), self.residual
        found, studentized = self._solve(used, residual)
        for _ in range(ROUNDS):
            residual, last = self._missed(found), found.change
            while True:
                found, studentized = self._solve(used, residual)
                bound = float(ndtri(1.0 - 0.5 * WRONG / len(studentized)))
                worst = int(studentized.argmax())
                few = rows - int(used.sum()) < int(MOST_LEFT_OUT * rows)
                if not few or studentized[worst] <= bound:
                    break
                used[weights(self.table, self.play, used).rows[worst]] = False
            if (np.abs(found.change - last) <= NEAR * found.error).all():
                break
        return found

    def _missed(self, found: _Diagnosis) -> Floats:
        """What sizes and deviations have to explain, those that were found among them."""
        model, u = self._built(found)
        read = model.read(u, of_nominal=False)
        self.lean = read.by_parameter @ self.root
        explained = self.slopes @ found.of_each(self.sizes[:, 0]) + self.lean @ found.deviations
        return np.asarray(model.compare(self.table.values, read) + explained)

    def residual_of(self, found: _Diagnosis) -> Floats:
        """What is missed with the sizes and deviations that were found, on the exact closure."""
        model, u = self._built(found)
        return model.compare(self.table.values, model.read(u, derivatives=False))

    def _built(self, found: _Diagnosis) -> tuple[ReadingModel, Floats]:
        """The machine with the sizes that were found, and its deviations."""
        self.step()
        changes: dict[str, object] = {}
        sizes = self.sizes[:, 0]
        for one, part in zip(self.sources, (found.of_each(sizes) / sizes).tolist(), strict=True):
            changes |= one.resized(max(one.size * (1.0 + part), 0.0))
        return ReadingModel(self.m.with_(changes), self.table), self.mean + self.root @ found.deviations

    def _common(self, cells: Weights) -> Floats:
        """Which cells have their place and column in common, shape (cell, place and column)."""
        number = self.place[cells.rows] * len(self.table.channels) + cells.columns
        names, column = np.unique(number, return_inverse=True)
        if len(cells) * len(names) > MOST_NUMBERS:
            problem = f"{len(cells):,} readings at {len(names):,} places are too many to be compared at once"
            raise self.table.sheet.refuse(problem)
        common = np.zeros((len(cells), len(names)))
        common[np.arange(len(cells)), column] = 1.0
        return common

    def _solve(self, used: Flags, residual: Floats) -> tuple[_Diagnosis, Floats]:
        """The fit of some rows, and how far every cell is from it, in its standard deviations."""
        self.step()
        cells = weights(self.table, self.play, used)
        at = (cells.rows, cells.columns)
        common = self._common(cells)
        count = self.root.shape[1]
        # Below the cells are the priors of the deviations.
        beside = np.block(
            [
                [cells.whitened(common), cells.whitened(self.lean[at])],
                [np.zeros((count, common.shape[1])), np.eye(count)],
            ]
        )
        basis, triangle = np.linalg.qr(beside)
        told, moved = (
            np.pad(cells.whitened(values[at]), [(0, count), (0, 0)]) for values in (residual[..., None], self.slopes)
        )
        read, slopes = (np.asarray(values - basis @ (basis.T @ values)) for values in (told[:, 0], moved))
        sizes = np.linalg.norm(slopes, axis=0)
        if not sizes.max() > 0.0:
            raise self.table.sheet.refuse("no clearance changes a difference of these readings")
        sums = combinations(slopes)
        groups = _groups(sums, len(sizes))
        blind = {k for one in sums if not one.alike for k, _ in one.parts}
        determined = np.array([not blind & {k for k, _ in parts} for parts in groups])
        columns = np.column_stack([slopes[:, parts[0][0]] for parts in groups])
        left, singular, right = np.linalg.svd(columns, full_matrices=False)
        rank = int((singular > EXACT * singular[0]).sum())
        inverse = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
        change = inverse @ read
        after = read - columns @ change
        hat = (np.sum(left[:, :rank] ** 2, axis=1) + np.sum(basis**2, axis=1))[: len(cells)]
        # A cell that alone says what its place has in common is missed by nothing.
        free = hat < 1.0 - EXACT
        studentized = np.where(free, np.abs(after[: len(cells)]) / np.sqrt(np.where(free, 1.0 - hat, 1.0)), 0.0)
        error = np.sqrt(np.sum(inverse**2, axis=1))
        chi, open_ = float(after @ after), len(cells) - common.shape[1] - rank
        found = _Diagnosis(used.copy(), groups, determined, change, error, chi, open_, rank, np.zeros(count))
        rest = told[:, 0] - moved @ found.of_each(self.sizes[:, 0])
        deviations = np.linalg.solve(triangle, basis.T @ rest)[common.shape[1] :]
        return replace(found, deviations=deviations), np.asarray(studentized)

    def apart(self, residual: Floats, used: Flags) -> Floats:
        """Residuals of all rows, SI, from what their places have in common; nan where nothing was read."""
        cells = weights(self.table, self.play, used)
        at, common = (cells.rows, cells.columns), self._common(cells)
        shift = np.linalg.lstsq(cells.whitened(common), cells.whitened(residual[at]), rcond=None)[0]
        whole = np.full(self.residual.shape, np.nan)
        whole[at] = residual[at] - common @ shift
        return whole


def _root(unknowns: Unknowns) -> Floats:
    """Of the covariance of the priors of all deviations, shape (parameter, independent number)."""
    own = [one for one in unknowns.unknowns if not one.of_file]
    spread = np.zeros((len(unknowns.m.parameters), len(own)))
    spread[[one.parameter for one in own], np.arange(len(own))] = [one.sigma for one in own]
    values, vectors = np.linalg.eigh(unknowns.correlation[: len(own), : len(own)])
    return np.asarray(spread @ (vectors * np.sqrt(np.maximum(values, 0.0))))


def _groups(found: Sequence[Combination], count: int) -> tuple[tuple[tuple[int, float], ...], ...]:
    """All clearances in groups that act alike, in their order."""
    alike = [one.parts for one in found if one.alike]
    members = {k for parts in alike for k, _ in parts}
    return tuple(sorted([*alike, *(((k, 1.0),) for k in range(count) if k not in members)]))


def _sizes(m: Mechanism, one: Sizing) -> tuple[float, float, float]:
    """Size of a clearance in the middle, the smallest and the largest of its limits, SI, as the file measures it."""
    largest = one.size * float(getattr(m.units, one.kind))
    limits = travel(m, m.sources.index(one.sources[0]))
    if limits is None:
        return largest, largest, largest
    least, most = (max(limit, 0.0) for limit in limits)
    return largest * 0.5 * (least + most) / most, largest * least / most, largest


def _told(m: Mechanism, sources: Sequence[Sizing], fit: _Fit, found: _Diagnosis) -> Result:
    from scipy.special import chdtrc, stdtrit

    repeats = fit.table.repeats
    sure = float(stdtrit(repeats, 0.975)) if repeats else SURE
    builder = ResultBuilder(m, "diagnose", measured=fit.table.sheet.name, rank=found.rank)
    p = float(chdtrc(found.free, found.chi)) if found.free > 0 else 1.0
    builder.attrs |= {"chi_square": found.chi, "degrees_of_freedom": found.free, "p_value": p, "coverage_factor": sure}
    names = tuple(one.name for one in sources)
    builder.axes["clearance"] = Labels(names, tuple(one.kind for one in sources))
    for k, end in ((1, "lowest"), (2, "highest")):
        builder.add(f"size_{end}", "clearance", fit.sizes[:, k], f"{end} size by the file", "clearance")
    parts = np.zeros((len(found.groups), len(sources)))
    for row, group in enumerate(found.groups):
        for k, coefficient in group:
            parts[row, k] = coefficient
    kinds = tuple(sources[group[0][0]].kind for group in found.groups)
    builder.axes["group"] = Labels(tuple(str(k) for k in range(len(parts))), kinds)
    builder.add("part", ("group", "clearance"), parts, "coefficient of the clearance in the sum")
    low, high = parts @ fit.sizes[:, 1], parts @ fit.sizes[:, 2]
    low, high = np.minimum(low, high), np.maximum(low, high)
    size = np.where(found.determined, parts @ fit.sizes[:, 0] + found.change, np.nan)
    error = np.where(found.determined, found.error, np.nan)
    near = sure * error
    is_vague = near > np.abs(parts) @ fit.sizes[:, 2]
    state = np.select(
        [~found.determined, size - near > high, size + near < low, is_vague], [OPEN, WORN, TIGHT, VAGUE], SAME
    )
    for name, values, words in (
        ("group_size", size, "sum of the sizes, as the file measures them"),
        ("group_standard_error", error, "standard error of the sum"),
        ("group_lowest", low, "lowest sum by the file"),
        ("group_highest", high, "highest sum by the file"),
    ):
        builder.add(name, "group", values, words, "group")
    builder.data["state"] = Variable(("group",), state.astype(str), "", "what the readings say of the clearances")
    builder.axes["channel"] = fit.table.axis
    builder.labels("reading", fit.table.lines, "row of the table")
    for name, values, words in (
        ("measured", fit.table.values, "what was read"),
        (
            "residual_before",
            fit.apart(fit.residual, found.used),
            "from what the place has in common, with the sizes of the file",
        ),
        ("residual_after", fit.apart(fit.residual_of(found), found.used), "the same with the sizes that were found"),
    ):
        builder.add(name, ("reading", "channel"), values, words, "channel")
    builder.add("alone", "reading", ~fit.paired, "whether the place is read under one load only")
    builder.add("left_out", "reading", fit.paired & ~found.used, "whether the row is left out because it does not fit")
    status = "ok" if p >= DOUBT else "doubtful"
    builder.data["status"] = Variable((), np.array(status), "", "whether the sizes explain the readings")
    return builder.result()
