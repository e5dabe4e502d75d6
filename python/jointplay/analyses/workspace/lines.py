"""The boundary of a workspace in the plane as lines, by what bounds it."""

import itertools

import numpy as np

from jointplay.basics.arrays import Floats, Ints
from jointplay.result import Result


def lines(result: Result) -> list[tuple[str, Floats]]:
    """The boundary in the plane, by what bounds it: lines through its points, from bound to bound.

    The line between two points belongs to the bound of the first one, as one goes around counterclockwise.
    """
    points, bounds = result.get("vertex"), result.get("vertex_bound")
    found = []
    for loop in loops(result.get("facet")):
        words = bounds[loop]
        changes = np.flatnonzero(words != np.roll(words, 1))
        first = int(changes[0]) if changes.size else 0
        turned = np.roll(loop, -first)
        cuts = [*(changes - first).tolist(), len(loop)] if changes.size else [0, len(loop)]
        closed = np.append(turned, turned[0])
        found += [(str(bounds[turned[a]]), points[closed[a : b + 1]]) for a, b in itertools.pairwise(cuts)]
    return found


def loops(facets: Ints) -> list[Ints]:
    """Closed lines, each by its points in their order."""
    following = dict(facets.tolist())
    found = []
    while following:
        start, point = following.popitem()
        line = [start]
        while point != start:
            line.append(point)
            point = following.pop(point)
        found.append(np.array(line))
    return found
