"""How fast every clearance grows with the sizes that the clearances have.

    growth per cycle = rate * integral of p ds         see `sliding`; or as it was measured

Reactions are those of `loaded` with the clearances as they are by then. Of several load cases each is passed as often
as the others. Of several bodies on one pin, both ends of it and all faces, the one that wears most counts: the set of
a clearance has one size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.analyses.loaded import loads_of, require_loads
from jointplay.analyses.nominal import Nominal
from jointplay.analyses.several import places_of
from jointplay.basics.arrays import Codes, Floats
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.wearing import Wearing
from jointplay.result import STATUSES
from jointplay.result.verdict import READABLE

from .cycle import Cycle, cycle_of
from .sliding import Faces, Order, faces_of, joined, slide_of


@dataclass(frozen=True)
class Rates:
    """What a cycle does to the clearances, SI; nan where the loads do not say how joints share them."""

    #: growth of the radius or gap per cycle
    growth: Floats
    #: the same with every second configuration
    coarse: Floats
    #: `sliding`, `pressure`: sliding distance per cycle, and largest mean pressure; nan where they are not known
    sliding: Floats
    pressure: Floats


class Duty:
    """A mechanism that runs through its path again and again.

    Parameters
    ----------
    m : Mechanism
        With its patterns written out.
    worn : sequence of Wearing
        What wears.
    cycle : str, optional
        See `cycle_of`.

    Raises
    ------
    InputError
        When nothing loads a mechanism in which clearances grow by what loads do, or the path is no cycle.
    """

    def __init__(self, m: Mechanism, worn: Sequence[Wearing], cycle: str | None) -> None:
        self.m, self.worn = m, worn
        self.by_load = not all(one.is_measured for one in worn)
        cases = m.load_cases or (None,)
        first = m.outputs[0] if m.outputs else None
        self.cases = [m.only(first, case) for case in cases]
        if self.by_load:
            for case in self.cases:
                require_loads(case)
        self.at: list[Nominal] = places_of(self.cases)
        #: configurations without a pose or without forces, with why
        self.without = _unreadable(self.at[0].status) if self.by_load else {}
        self.cycle: Cycle | None = None
        #: clearances change neither the nominal motion nor what loads it
        self.loads: list[Floats | None] = []
        if self.by_load and not self.without:
            self.cycle = cycle_of(m, self.at[0], cycle)
            self.loads = [loads_of(case, at) for case, at in zip(self.cases, self.at, strict=True)]

    def rates(self, grown: Floats) -> Rates:
        """Rates with clearances that have grown.

        Parameters
        ----------
        grown : ndarray
            By how much the radius or gap of each has grown, SI.
        """
        measured = np.array([one.growth for one in self.worn])
        nothing = np.full(len(self.worn), np.nan)
        if not self.by_load:
            return Rates(measured, measured, nothing, nothing)
        assert self.cycle is not None
        each = zip(self.worn_at(grown), self.loads, strict=True)
        passed = [_Passed(copy, at.poses, self._reaction(copy, at, loads)) for (copy, at), loads in each]
        return Rates(*np.array([self._one(passed, own, self.cycle) for own in self.worn]).T)

    def worn_at(self, grown: Floats) -> list[tuple[Mechanism, Nominal]]:
        """The mechanism in each load case, with clearances that have grown, and its configurations."""
        worn = [part.worn(changes(part, self.m, self.worn, grown)) for part in self.cases]
        return list(zip(worn, self.at, strict=True))

    def _reaction(self, copy: Mechanism, at: Nominal, loads: Floats | None) -> Floats:
        """Force and moment of every joint in one load case, ground axes; nan where they cannot be read."""
        found = copy.core.loaded(at.drives, at.poses, True, False, True, partly=True, loads=loads)
        if len(found["status"]) < len(at):
            raise KeyboardInterrupt
        reaction: Floats = found["reaction"].copy()
        if failed := _unreadable(found["status"]):
            reaction[list(failed)] = np.nan
            self.without = self.without or failed
        return reaction

    def _one(self, passed: Sequence[_Passed], own: Wearing, cycle: Cycle) -> tuple[float, float, float, float]:
        """Growth, the same with every second configuration, sliding distance and pressure of one clearance."""
        if own.is_measured:
            return own.growth, own.growth, np.nan, np.nan
        often = cycle.times / len(passed)
        every = []
        for source, joint in zip(own.sources, own.joints, strict=True):
            found = []
            for order in (cycle.order, _every_second(cycle.order)):
                each = [case.faces(own, self.m.sources[source], self.m.joints[joint], order) for case in passed]
                faces = joined(each)
                found.append((often * faces.worn(own), often * faces.slid, faces.pressure.max()))
            (growth, slid, pressure), (coarse, *_) = found
            every.append((growth, coarse, slid, pressure))
        growth, coarse, slid, pressure = np.max(every, axis=0)
        known = np.isfinite(own.diameter) or np.isfinite(own.width) or not _is_pin(self.m, own)
        return growth, coarse, slid if known else np.nan, pressure if known else np.nan


@dataclass(frozen=True)
class _Passed:
    """One load case: its part of the mechanism, poses of all bodies, and reactions."""

    m: Mechanism
    at: Floats
    reaction: Floats

    def faces(self, own: Wearing, source: str, joint: str, order: Order) -> Faces:
        """What presses and slides in a joint along the path."""
        at_joint = self.m.joints.index(joint)
        slide = slide_of(self.m, at_joint, self.at, order)
        return faces_of(self.m, own, self.m.sources.index(source), slide, self.reaction[order, at_joint])


def _unreadable(status: Codes) -> dict[int, str]:
    """Configurations whose numbers cannot be read, with their outcome."""
    return {k: str(STATUSES[s]) for k, s in enumerate(status) if STATUSES[s] not in READABLE}


def _every_second(order: Order) -> Order:
    """Every second of the configurations, with the last one."""
    chosen = order[::2]
    return chosen if len(order) % 2 else np.append(chosen, order[-1])


def _is_pin(m: Mechanism, own: Wearing) -> bool:
    return m.joint_kinds[m.joints.index(m.joints[own.joints[0]])] in ("revolute", "cylindrical")


def changes(part: Mechanism, whole: Mechanism, worn: Sequence[Wearing], grown: Floats) -> dict[int, float]:
    """By how much the sources of a part of a mechanism have grown, by their indices there.

    Parameters
    ----------
    part : Mechanism
        With one output, in one load case.
    whole : Mechanism
        In which `worn` has its indices.
    grown : ndarray
        Of each.
    """
    return {
        part.sources.index(whole.sources[k]): float(by)
        for own, by in zip(worn, grown, strict=True)
        for k in own.sources
    }


def require_cycle(duty: Duty) -> None:
    """Refuse a path that has no configuration with a pose at all."""
    if len(duty.without) == len(duty.at[0]):
        problem = "no configuration can be assembled; `jointplay solve` says why"
        raise InputError(problem, file=duty.m.file, key="drives")
