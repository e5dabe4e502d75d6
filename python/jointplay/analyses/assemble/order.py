"""The best order of the steps of an assembly.

What is assembled does not depend on the order of its steps, so every set of steps has one state, and the best way to it
is the best way to a set with one step less, and that step: 2^n states decide which of n! orders is best. An order is
better the fewer freedoms have to be held on its way, all steps together; among equals, the smaller the largest value of
the criterion on its way.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.basics.progress import watched
from jointplay.basics.typed import typed
from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism

from .forces import Members
from .freedom import examine
from .part import cut
from .report import place
from .state import Held, state
from .steps import Step, name, order

CRITERIA = ("force", "error")
#: steps whose orders are searched; their states double with every further one
MOST_STEPS = 10
#: of values in newtons or metres, below which they are rounding
DIGITS = 10
#: outcomes that no order may pass through
IMPASSABLE = ("not_assemblable", "singular", "not_assembled")


@typed
@watched
def best_order(
    m: Mechanism, criterion: str = "force", *, configuration: int = 0, progress: Progress | None = None
) -> Mechanism:
    """Find the order of the steps of an assembly with the smallest forces or errors on the way.

    Steps keep their members; without friction their order does not change the state in the end. The best order needs
    the fewest freedoms held on its way and, among those that need as few, has the smallest largest value of the
    criterion after any of its steps.

    Parameters
    ----------
    m : Mechanism
        With an order of assembly of up to ten steps.
    criterion : {"force", "error"}
        The largest force of any member, or the largest position error of any joint's centre with its
        indeterminacy.
    configuration : int
        At which of its configurations it is assembled.
    progress : callable, optional
        Called with how many states are solved and how many there are.

    Returns
    -------
    Mechanism
        A copy with its steps in the best order; the file's own order where none is better.

    Raises
    ------
    InputError
        When the file has no order of assembly, or there are too many steps.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> m = m.with_({"assembly.steps": [["coupler"], ["rocker"], ["crank"]]})
    >>> jp.best_order(m).value("assembly.steps")
    [['crank'], ['coupler'], ['rocker']]
    """
    if criterion not in CRITERIA:
        raise InputError(not_known(str(criterion), "a criterion", CRITERIA), key="criterion")
    if m.load_cases:
        problem = f"forces and errors depend on the load case; choose one with only(): {listed(m.load_cases)}"
        raise InputError(problem, file=m.file, key="load_cases")
    base, every = order(m)
    if len(every) > MOST_STEPS:
        problem = f"{len(every)} steps have too many orders to search; up to {MOST_STEPS} are possible"
        raise InputError(problem, file=m.file, key="assembly.steps")
    at, members = place(m, configuration), Members(m)
    if not at.is_assembled:
        return m
    sets = [chosen for size in range(1, len(every) + 1) for chosen in combinations(range(len(every)), size)]
    # Of every set: freedoms held on the best way to it, the largest value on it, and the way.
    ways: dict[tuple[int, ...], tuple[int, float, tuple[int, ...]]] = {(): (0, 0.0, ())}
    for k, chosen in enumerate(sets):
        held, value = _cost(m, at.poses, base, [body for step in chosen for body in every[step]], criterion, members)
        before = [(last, ways[tuple(step for step in chosen if step != last)]) for last in chosen]
        ways[chosen] = min((h + held, max(v, value), (*way, last)) for last, (h, v, way) in before)
        if progress is not None:
            progress(k + 1, len(sets))
    best = ways[tuple(range(len(every)))][2]
    return m.with_({"assembly.steps": [[name(m, body) for body in every[step]] for step in best]})


def _cost(
    m: Mechanism,
    nominal: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    base: int,
    bodies: list[int],
    criterion: str,
    members: Members,
) -> tuple[int, float]:
    """Freedoms that are held in a state, and the value of the criterion; infinite where it cannot be assembled."""
    part = cut(m, nominal, base, bodies)
    freedom = examine(part)
    step = Step((), (), part, freedom, "")
    if criterion == "error":
        found = state(step, members)
        sizes = [
            np.linalg.norm(np.abs(error[:, : part.lengths]) + open_[:, : part.lengths], axis=1)
            for error, open_ in ((found.shaft, found.shaft_open), (found.bearing, found.bearing_open))
        ]
        value, status = float(np.nanmax(np.nan_to_num(sizes))), found.status
    else:
        held = Held(step)
        answer = held.loaded()
        forces = members.forces(part, held.core(), answer["reaction"], answer.get("force"))
        value = float(np.max(np.abs(np.nan_to_num(forces)), initial=0.0))
        status = held.status(answer)
    # Values that differ by rounding alone are equal, so that the order of the file counts.
    return freedom.mobility, np.inf if status in IMPASSABLE else round(value, DIGITS)
