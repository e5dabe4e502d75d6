"""What a cycle is: along the configurations and there again.

closed          the path ends where it began, or one more of its equal steps away from there
back-and-forth  it ends elsewhere, so that the mechanism goes back the same way
one-way         it goes back without load, or does not go back
"""

from dataclasses import dataclass

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import ANGULAR
from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism

CYCLES = ("closed", "back-and-forth", "one-way")
#: parts of the mechanism's length, and of a radian, within which two poses are the same
SAME = 1e-6
#: fewer equal steps are no sampled turn
FEWEST = 6


@dataclass(frozen=True)
class Cycle:
    """Which way the configurations are gone along."""

    #: one of `CYCLES`
    name: str
    #: configurations in the order in which they are passed, the first one again at the end of a sampled turn
    order: np.ndarray[tuple[int], np.dtype[np.intp]]
    #: how often the way is passed in a cycle
    times: float


def cycle_of(m: Mechanism, at: Nominal, given: str | None = None) -> Cycle:
    """The cycle of a path.

    Parameters
    ----------
    at : Nominal
        All its configurations, which have poses.
    given : {"closed", "back-and-forth", "one-way"}, optional
        What it is; found from the poses if left out.

    Raises
    ------
    InputError
        When there is no such cycle, the path is none, or it does not end where it began and shall be closed.
    """
    if given is not None and given not in CYCLES:
        raise InputError(not_known(given, "a cycle", CYCLES), key="cycle")
    count = len(at)
    if count < 2:
        problem = "the path has one configuration, and nothing slides; give the drives a range: from, to and count"
        raise InputError(problem, file=m.file, key="drives")
    order = np.arange(count)
    ends = _is_same(at.poses[0], at.poses[-1], m.length)
    if not ends and _goes_on(m, at.drives):
        order, ends = np.append(order, 0), True
    if given == "closed" and not ends:
        problem = "the path does not end where it began, nor one more of equal steps before it"
        raise InputError(f"{problem}; it is back-and-forth or one-way", file=m.file, key="cycle")
    if given is None:
        given = "closed" if ends else "back-and-forth"
    if given != "closed":
        order = np.arange(count)
    return Cycle(given, order, 2.0 if given == "back-and-forth" else 1.0)


def _is_same(first: Floats, last: Floats, length: float) -> bool:
    """Whether all bodies are at the same place, whatever their turns."""
    far = np.abs(poses.position(first) - poses.position(last)).max(initial=0.0) / length
    return bool(max(far, np.abs(poses.matrix(first) - poses.matrix(last)).max(initial=0.0)) <= SAME)


def _goes_on(m: Mechanism, drives: Floats) -> bool:
    """Whether one more of equal steps brings every drive to where it began, and one of them all the way round."""
    steps = np.diff(drives, axis=0)
    if len(drives) < FEWEST or np.abs(steps - steps[0]).max(initial=0.0) > SAME * max(np.abs(steps).max(), 1e-300):
        return False
    turns = False
    for k, moves in enumerate(m.drive_moves):
        whole = steps[0, k] * len(drives)
        if all(m.joint_kinds[joint] in ANGULAR for joint, _ in moves):
            round_ = [whole * coefficient / (2.0 * np.pi) for _, coefficient in moves]
            if any(abs(one - round(one)) > SAME for one in round_):
                return False
            turns |= any(round(one) != 0 for one in round_)
        elif abs(whole) > SAME * m.length:
            return False
    return turns
