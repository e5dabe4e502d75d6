"""The nominal mechanism along its drive values or its path: what every question starts from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.arrays import Codes, Floats, Texts
from jointplay.basics.progress import TellStep
from jointplay.basics.units import Units
from jointplay.core.answers import Reached
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import held_spins, misfit_words, require_determinate, spin_bodies
from jointplay.result import STATUSES, Result, ResultBuilder, counted
from jointplay.result.verdict import PLAY_ALONE

from .ideal import strays
from .ranges import leaving

OK, UNASSEMBLED, SINGULAR, OUTSIDE = map(STATUSES.tolist().index, ("ok", "not_assembled", "singular", "outside_limits"))
#: outcomes of configurations that have a pose and no error
WITHOUT_ERRORS = ("singular", "other_branch", "outside_limits")
#: share of the mechanism's length within which a target is reached
REACHED = 1e-9
#: called with how many steps are done and how many there are
Progress = TellStep


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during long work, with what was done until then.

    Attributes
    ----------
    partial : Result
        The steps that were finished; its attribute `incomplete` says so.
    """

    def __init__(self, partial: Result) -> None:
        super().__init__()
        self.partial = partial


@contextmanager
def within_another() -> Iterator[None]:
    """A question that another one asks: part of its answer is no answer to the other.

    Raises
    ------
    KeyboardInterrupt
        In place of `Interrupted`.
    """
    try:
        yield
    except Interrupted:
        raise KeyboardInterrupt from None


@dataclass(frozen=True)
class Nominal:
    """Solved configurations, SI and radians; nan where a configuration is not assembled."""

    #: shape (configuration, drive): as commanded, or as solved from the path
    drives: Floats
    #: shape (configuration, body, pose): as the core has them, in space with a quaternion
    poses: Floats
    #: pose of the output point, shape (configuration, component)
    output: Floats
    #: the core's codes
    status: Codes
    #: units that results are asked in, when not those of the mechanism's file
    units: Units | None = None
    #: with ranges in the file: the drive or joint that leaves its range, by its name, for every configuration
    leaves: Texts | None = None
    #: what stays open of parts that are not drawn to fit, in a sentence
    misfit: str = ""
    #: with a target of the output's pose: nominal less ideal pose, shape (configuration, component), nan where nothing
    #: is asked
    strays: Floats | None = None
    #: whether the configurations are a path: else a target that compares the whole of it does not count
    is_path: bool = True

    def __len__(self) -> int:
        return len(self.drives)

    def first(self, count: int) -> Nominal:
        """The first configurations only."""
        return self.chosen(np.arange(len(self))[:count])

    def at(self, configuration: int) -> Nominal:
        """One configuration only."""
        return self.chosen(np.array([configuration]))

    def chosen(self, places: NDArray[np.intp]) -> Nominal:
        """Some configurations only."""
        return replace(self, **{name: value[places] for name, value in _arrays(self)})

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Whether the machine can stand at each configuration."""
        return counted(STATUSES[self.status])

    @property
    def with_errors(self) -> Nominal:
        """The same without poses where no error can be given.

        The machine cannot stand there, or it is singular there: the free motion is then as large as the axes of the
        bodies make it, and so would be all numbers.
        """
        poses = self.poses.copy()
        poses[np.isin(STATUSES[self.status], WITHOUT_ERRORS)] = np.nan
        return replace(self, poses=poses)

    def worse(self, status: NDArray[Any], places: NDArray[np.intp] | slice = slice(None)) -> Codes:
        """Status of an analysis at some configurations, that of the nominal one where this is not ok already."""
        own = self.status[places]
        return np.where(own != 0, own, status)


def nominal(m: Mechanism) -> Nominal:
    """Solve the nominal mechanism for its drive values, or its drives for its path.

    Raises
    ------
    InputError
        When the mechanism has too few or too many drives, or only has a grid.
    """
    misfit = require_determinate(m, over_constrained=True).misfit
    at = straying(m, _nominal(m))
    return at if misfit is None else replace(at, misfit=misfit_words(m, misfit))


def straying(m: Mechanism, at: Nominal) -> Nominal:
    """The same with how far it is from the target."""
    if m.ideal is not None and m.ideal.is_of_path and not at.is_path:
        return replace(at, strays=None)
    off = strays(m, at.drives, at.poses, at.output, at.status == OK)
    return replace(at, strays=None if off is None else off.component)


def _nominal(m: Mechanism) -> Nominal:
    if m.targets is not None and m.leader is not m:
        return bounded(m, carried(nominal(m.leader), m.leader, m), path=True)
    return bounded(m, _given(m), path=True)


def _given(m: Mechanism) -> Nominal:
    if m.drive_values is not None:
        # A drive has its commanded value also where the links cannot follow.
        return at_drives(m, m.drive_values)
    if m.targets is None:
        problem = "the file has a [grid] for `map`; for anything else give the drives values, or the output a [path]"
        raise InputError(problem, file=m.file, key="drives")
    return follow(m, m.targets, m.target_components)


def bounded(m: Mechanism, at: Nominal, *, path: bool = False) -> Nominal:
    """The same with the outcome `outside_limits` where a drive or a joint would have to leave its range.

    Parameters
    ----------
    path : bool
        Whether the configurations follow one another.
    """
    if not (m.limits.joints or m.limits.drives):
        return at
    leaves = leaving(m, at.drives, at.poses, path=path)
    outside = (at.status == OK) & (leaves != "")
    return replace(at, status=np.where(outside, OUTSIDE, at.status).astype(np.uint8), leaves=leaves)


def at_drives(m: Mechanism, drives: Floats) -> Nominal:
    """Solve the nominal mechanism for drive values, SI, shape (configuration, drive)."""
    found = m.core.trace(np.ascontiguousarray(drives))
    return Nominal(drives, found["poses"], found["output"], found["status"])


def carried(at: Nominal, known: Mechanism, m: Mechanism) -> Nominal:
    """Configurations of a mechanism as those of the same with another output or in another load case."""
    # Pieces of an elastic body that only one of them has move with the body.
    own = [known.bodies.index(name if name in known.bodies else m.owners[k]) for k, name in enumerate(m.bodies)]
    poses = np.ascontiguousarray(at.poses[:, own])
    return straying(m, replace(at, poses=poses, output=m.core.output(poses)))


def follow(m: Mechanism, targets: Floats, components: tuple[str, ...], beside: Floats | None = None) -> Nominal:
    """Solve the drives for target poses of the output, least squares over some components.

    An angle counts as the length of its arc at the characteristic length. Each target is reached from the one before.
    With drive values `beside` the targets, SI, the pose is taken that is nearest to the one at these. Where a target
    is nan, nothing is assembled.
    """
    weight = {c: 1.0 if c in LENGTHS else m.length for c in components}
    weights = np.array([weight.get(c, 0.0) for c in m.components])
    given = np.asarray(np.isfinite(targets[:, weights > 0.0]).all(axis=1))
    if not given.all():
        return _with_gaps(follow(m, targets[given], components, None if beside is None else beside[given]), given)
    found = _of(m.core.inverse(targets, weights, m.start_drives))
    if beside is None:
        return found
    there = at_drives(m, beside)
    missed = np.abs((there.output - targets) * weights).max(axis=1)
    for k in np.flatnonzero(there.status == 0).tolist():
        ways = [there.at(k)]
        if not missed[k] <= REACHED * m.length:
            near = _of(m.core.inverse(targets[k : k + 1], weights, beside[k]))
            ways = [way for way in (found.at(k), near) if way.status[0] == 0]
        if ways:
            best = min(ways, key=lambda way: _apart(way.poses[0], there.poses[k], m.length))
            for name, values in _arrays(found):
                values[k] = getattr(best, name)[0]
    return found


def _apart(some: Floats, others: Floats, length: float) -> float:
    """How far poses of bodies are from each other, as parts of a length and of a radian; turns are none."""
    far = np.abs(poses.position(some) - poses.position(others)).max(initial=0.0) / length
    return float(max(far, np.abs(poses.matrix(some) - poses.matrix(others)).max(initial=0.0)))


def _arrays(at: Nominal) -> list[tuple[str, Any]]:
    return [(name, values) for name, values in vars(at).items() if isinstance(values, np.ndarray)]


def _with_gaps(at: Nominal, given: NDArray[np.bool_]) -> Nominal:
    """Configurations at some places of a longer row, of which the others are not assembled."""
    whole: dict[str, Any] = {}
    for name, values in _arrays(at):
        nothing = UNASSEMBLED if name == "status" else np.nan
        whole[name] = np.full((len(given), *values.shape[1:]), nothing, dtype=values.dtype)
        whole[name][given] = values
    return replace(at, **whole)


def _of(found: Reached) -> Nominal:
    return Nominal(found["drives"], found["poses"], found["output"], found["status"])


#: how results are obtained, in the attribute `obtained`
ON_CLOSURE = "on the exact loop closure"
TO_FIRST_ORDER = "to first order at the nominal pose"


def report(m: Mechanism, question: str, at: Nominal, **attrs: str | int | float) -> ResultBuilder:
    """A result that says at which drive values and nominal poses it was found."""
    builder = ResultBuilder(m, question, at.units, **attrs)
    builder.attrs["length"] = m.length / builder.units.length
    if at.misfit:
        builder.attrs["misfit"] = at.misfit
    spins = held_spins(m)
    if spins:
        builder.attrs["held_spins"] = ", ".join("-".join(spin_bodies(m, spin)) for spin in spins)
    builder.drives(at.drives)
    builder.add("nominal", ("configuration", "component"), at.output, "nominal pose of the output", "component")
    if at.strays is not None:
        words = "nominal less ideal pose of the output"
        builder.add("structural_deviation", ("configuration", "component"), at.strays, words, "component")
    elif m.ideal is not None and not at.is_path:
        builder.attrs[PLAY_ALONE] = 1
    if at.leaves is not None:
        builder.add("leaves_range", "configuration", at.leaves, "drive or joint that leaves its range; empty: none")
    return builder


#: arrays by name, the status among them
AnyColumns = TypeVar("AnyColumns", bound=Mapping[str, Any])


def without_singular(found: AnyColumns) -> AnyColumns:
    """What was found, without the errors of configurations that become singular within their clearances.

    How far an error was followed towards a singular pose depends on the axes of the bodies, and on the steps. What is
    of first order follows from the nominal pose, which is regular.
    """
    singular = found["status"] == SINGULAR
    for name, values in found.items():
        is_linear = name.startswith("contribution") or name.endswith(("_first_order", "_bound"))
        if not is_linear and isinstance(values, np.ndarray) and values.dtype.kind == "f":
            values[singular] = np.nan
    return found


def batched(
    count: int,
    size: int,
    run: Callable[[slice], AnyColumns],
    progress: Progress | None,
) -> tuple[AnyColumns, int]:
    """Run over configurations in batches; after Ctrl-C a batch may give fewer than it was asked for.

    Returns
    -------
    joined : dict
        The arrays of all batches, joined.
    done : int
        How many configurations they cover: fewer than `count` after Ctrl-C, never none.
    """
    parts: list[AnyColumns] = []
    done = 0
    try:
        while done < count or not parts:
            end = min(done + size, count)
            part = run(slice(done, end))
            parts.append(part)
            done += len(part["status"])
            if progress is not None:
                progress(done, count)
            # Ctrl-C came in the middle of the batch.
            if done < end:
                break
    except KeyboardInterrupt:
        if not parts:
            raise
    done = sum(len(part["status"]) for part in parts)
    if len(parts) == 1:
        return parts[0], done
    columns = {name: [part[name] for part in parts] for name in parts[0]}
    # What is of no configuration is counted.
    joined = {name: np.concatenate(c) if np.ndim(c[0]) else sum(c) for name, c in columns.items()}
    return cast("AnyColumns", joined), done


def finished(builder: ResultBuilder, done: int, count: int, unfinished: str = "") -> Result:
    """The result of batches; `unfinished` says what the last configuration lacks.

    Raises
    ------
    Interrupted
        When not all of them were done.
    """
    if done < count or unfinished:
        builder.attrs["incomplete"] = f"interrupted after {done} of {count} configurations{unfinished}"
        raise Interrupted(builder.result())
    return builder.result()
