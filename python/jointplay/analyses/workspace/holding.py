"""Where a mechanism holds what is asked of it: at nodes of a grid, and on the way from one to the next.

What keeps it from a place is a word: the end of a range (``drives.q1.high``), ``not_assembled``, ``singular`` (on a
singularity or behind one), a limit of the file (``limits.position``), or ``not_shown`` where it is not known whether
limits hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.analyses.map.answering import MapQuestion, leading
from jointplay.analyses.map.lattice import Lattice
from jointplay.analyses.map.reach import BEYOND, GridFollower, Seeds
from jointplay.analyses.nominal import OK, Nominal, Progress
from jointplay.analyses.ranges import rooms
from jointplay.basics.arrays import Array, Flags, Floats, Ints, Texts
from jointplay.core.compile import Grid, limit_key
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.questions import QUESTIONS
from jointplay.result import STATUSES, Result
from jointplay.result.verdict import HELD, MISSED, of_nodes

NOT_ASSEMBLED, SINGULAR, NOT_SHOWN, EDGE = "not_assembled", "singular", "not_shown", "edge"
#: characters of a word
WIDTH = "<U120"
#: ways that are followed at a time, so that Ctrl-C and progress do not wait
AT_ONCE = 4096


@dataclass(frozen=True)
class HeldPlaces:
    """What was found at some configurations."""

    #: what keeps the mechanism from being there; empty where nothing does
    why: Texts
    #: how far the drives and joints are from the nearest end of a range, as a part of the range, negative beyond it;
    #: nan where it does not decide
    room: Floats
    #: on ways, the part up to which the mechanism follows; nan where it gets to the place
    ends: Floats | None = None

    @property
    def inside(self) -> Flags:
        """Where nothing keeps it away."""
        return np.asarray(self.why == "")


class OneOrientation:
    """A mechanism over a grid with the orientation of its output held.

    Parameters
    ----------
    whole : Mechanism
        With a grid, all outputs and load cases.
    asks : sequence of MapQuestion
        Whose limits have to hold, one after the other.
    """

    def __init__(self, whole: Mechanism, asks: Sequence[MapQuestion]) -> None:
        self.m = leading(whole)
        self.asks = asks
        assert self.m.grid is not None
        self.grid: Grid = self.m.grid
        self.follower = GridFollower(self.m, self.grid)
        self.lattice = Lattice(self.grid, int(np.prod(self.grid.shape)))
        self.rows = self.follower.commands(self.lattice, 0)
        self.poses = np.zeros((0, 0, 0))

    def commands_at(self, positions: Floats) -> Floats:
        """Commands at positions along the axes, file units, of which they are linear functions."""
        rows = self.rows.reshape(*self.grid.shape, -1)
        start = rows[(0,) * len(self.grid.shape)]
        found = np.tile(start, (len(positions), 1))
        for k, along in enumerate(self.grid.labels):
            end = rows[tuple(-1 if k == j else 0 for j in range(len(self.grid.shape)))]
            part = (positions[:, k] - along[0]) / (along[-1] - along[0])
            found += part[:, None] * (end - start)
        return found

    def nodes(self, progress: Progress | None = None) -> HeldPlaces:
        """What is found at all nodes that are reached from the start without a singularity."""
        starts = self.follower.starts(self.lattice)
        at = self.follower.solve(self.lattice, 0, starts.get(0, self.follower.no_seeds)).at
        self.poses = at.poses
        return self.held(at, progress)

    def on_the_way(self, rows: Floats, poses: Floats, to: Floats) -> tuple[HeldPlaces, Floats]:
        """What is found at rows of commands, each reached on a straight way from a pose; and the poses there."""
        parts, there, ends = [], [], []
        for low in range(0, len(rows), AT_ONCE):
            some = slice(low, low + AT_ONCE)
            count = len(rows[some])
            seeds = Seeds(np.arange(count), rows[some], poses[some], np.zeros(count, bool))
            at, end = self.follower.straight(seeds, np.ascontiguousarray(to[some]))
            parts.append(self.held(at))
            there.append(at.poses)
            ends.append(np.where(at.status == OK, np.nan, end))
        why, room = (np.concatenate([getattr(part, name) for part in parts]) for name in ("why", "room"))
        return HeldPlaces(why, room, np.concatenate(ends)), np.concatenate(there)

    def held(self, at: Nominal, progress: Progress | None = None) -> HeldPlaces:
        """What is found at configurations that are solved."""
        status = STATUSES[at.status]
        why = np.full(len(at), NOT_ASSEMBLED, dtype=WIDTH)
        why[np.isin(status, ("singular", BEYOND))] = SINGULAR
        why[at.status == OK] = ""
        room = np.where(at.status == OK, np.inf, np.nan)
        ends, left = rooms(self.m, at.drives, at.poses, path=False)
        if ends:
            spans = [span[1] - span[0] for span in (*self.m.limits.drives.values(), *self.m.limits.joints.values())]
            left = left / np.repeat([span or 1.0 for span in spans], 2)
            least = np.nanargmin(np.where(np.isnan(left), np.inf, left), axis=1)
            beyond = (at.status == OK) & (left.min(axis=1) < 0.0)
            why[beyond] = np.array([str(end) for end in ends])[least[beyond]]
            room = np.where(at.status == OK, left.min(axis=1), np.nan)
        for k, ask in enumerate(self.asks):
            places = np.flatnonzero(why == "")
            why[places] = self._limits(ask, at, places, progress and _part_of(progress, k, len(self.asks)))
        return HeldPlaces(why, np.where(np.isfinite(room), room, np.nan))

    def _limits(self, ask: MapQuestion, at: Nominal, places: Ints, progress: Progress | None) -> Texts:
        """Which limit is missed at some configurations; empty where all hold."""
        found = np.full(len(places), "", dtype=WIDTH)
        size = QUESTIONS[ask.question].chunk
        for low in range(0, len(places), size):
            some = places[low : low + size]
            result = ask(at.chosen(some))
            judged = of_nodes(result)
            if judged is None:
                problem = f"no limit that {ask.question} can be judged by; such as limits.position"
                if ask.question == "random":
                    problem = "random needs a limit such as limits.position, and limits.probability"
                raise InputError(problem, file=self.m.file, key="limits")
            found[low : low + size] = _missed(result, judged[0])
            if progress is not None:
                progress(min(low + size, len(places)), len(places))
        return found


def _part_of(progress: Progress, k: int, count: int) -> Progress:
    """The progress of one of several steps."""
    return lambda done, of: progress(k * of + done, count * of)


def _missed(result: Result, outcomes: Array) -> Texts:
    """The limit that is missed most, ``not_shown``, or nothing where all limits hold."""
    beside = tuple(range(1, outcomes.ndim))
    why = np.full(len(outcomes), NOT_SHOWN, dtype=WIDTH)
    why[(outcomes == HELD).all(axis=beside)] = ""
    missed = (outcomes == MISSED).any(axis=beside)
    if "margin" not in result.data:
        why[missed] = "limits.probability"
        return why
    limit = result.get("limit")
    sizes = np.nanmax(np.abs(np.where(np.isfinite(limit), limit, 0.0)), axis=-1)
    part = result.get("margin") / np.where(sizes > 0.0, sizes, 1.0)
    part = np.where(np.isfinite(part), part, np.inf).min(axis=tuple(range(1, part.ndim - 1)))
    names = np.array([limit_key(name) for name in result.labels("quantity")])
    why[missed] = names[part.argmin(axis=1)][missed]
    return why
