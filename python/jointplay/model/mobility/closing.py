"""Bringing bodies together where Newton's method of the core finds no pose: least squares, from many starts.

With r the length-scaled residuals of joints and drives and W weights, Levenberg's and Marquardt's steps

    (J' W^2 J + mu diag) dx = -J' W^2 r

end in a minimum of the squared gaps, whether that is zero or not. A heavy weight holds a row, none opens it.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS, TURNS
from jointplay.core.spec import Changes, PointSpec
from jointplay.model.mechanism import Mechanism

#: largest residual, in characteristic lengths and radians, of what is closed
CLOSED = 1e-9
#: steps of one search
STEPS = 80
#: a step that lowers the sum of squares by a smaller share is the last
STILL = 1e-10
#: the largest step, in characteristic lengths and radians
LARGEST_STEP = 0.5
#: unknowns up to which the core's dense steps are the faster ones
SMALL = 48
#: weight of rows that are held while another joint is open
HELD = 1e3


class Closing:
    """Searches for poses of a mechanism, or of one with other points.

    Parameters
    ----------
    m : Mechanism
    points : list of PointSpec, optional
        Other points, see `Mechanism.moved`.
    """

    def __init__(self, m: Mechanism, points: list[PointSpec] | None = None) -> None:
        self.m = m
        self._changes: Changes = {} if points is None else {"points": points}
        self.core = m.core if points is None else m.varied(points=points)
        self.rows = self.core.rows
        self.joints = np.array([joint for joint, _ in self.rows])
        turns = np.array([component in TURNS for _, component in self.rows])
        #: units of the rows, and of the unknowns
        self.units = np.where(turns, 1.0, m.length)
        self.unknowns = np.tile(np.where(np.isin(m.components, LENGTHS), m.length, 1.0), len(m.bodies))

    def gaps(self, drives: Floats, placed: Floats) -> Floats:
        """Residuals of all rows, in characteristic lengths and radians."""
        return np.asarray(self.core.gaps(drives, placed) / self.units)

    def least(self, drives: Floats, start: Floats, weights: Floats | None = None) -> tuple[Floats, Floats]:
        """The nearest minimum of the squared gaps: poses and gaps."""
        weight = np.ones(len(self.rows)) if weights is None else weights
        at, gaps = start, self.gaps(drives, start)
        value, damping = float(np.square(weight * gaps).sum()), 1e-3
        for _ in range(STEPS):
            if float(np.abs(weight * gaps).max(initial=0.0)) < CLOSED * 1e-2:
                break
            jacobian = weight[:, None] * self.core.jacobian(at) / self.units[:, None] * self.unknowns
            normal, slope = jacobian.T @ jacobian, jacobian.T @ (weight * gaps)
            better = False
            for _ in range(12):
                step = -np.linalg.solve(normal + damping * np.diag(1e-9 + np.diag(normal)), slope)
                step *= min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
                trial = poses.moved(at, (step * self.unknowns).reshape(len(at), -1), self.core.origins)
                found = self.gaps(drives, trial)
                next_value = float(np.square(weight * found).sum())
                if next_value < value:
                    better, still = True, value - next_value < STILL * value
                    at, gaps, value = trial, found, next_value
                    damping = max(0.1 * damping, 1e-14)
                    break
                damping *= 6.0
            if not better or still:
                break
        return at, gaps

    def closed(self, drives: Floats, start: Floats) -> Floats | None:
        """Poses in which everything is closed, found from a start; None where the core finds none."""
        if not self.is_small:
            found_poses, gaps = self.least(drives, start)
            return found_poses if is_closed(gaps) else None
        near: Changes = {**self._changes, "guess": start.tolist(), "sources": [], "loads": []}
        found = self.m.varied(**near).assemble(np.ascontiguousarray(drives))
        return found["poses"] if found["converged"] else None

    @property
    def is_small(self) -> bool:
        """Whether many searches take little time."""
        return len(self.unknowns) <= SMALL

    def opened(self, joint: int) -> Floats:
        """Weights that hold everything but one joint."""
        return np.where((self.joints == joint) & (np.arange(len(self.rows)) < self.joint_rows), 1.0, HELD)

    @property
    def joint_rows(self) -> int:
        """Number of rows of the joints; those of the drives follow."""
        return len(self.rows) - sum(len(moves) for moves in self.m.drive_moves)


def is_closed(gaps: Floats) -> bool:
    """Whether gaps are rounding."""
    return float(np.abs(gaps).max(initial=0.0)) < CLOSED


def starts(m: Mechanism, start: Floats, count: int, size: float = 1.0) -> Iterator[Floats]:
    """Starts around one, the same ones each time: bodies moved by up to a size and turned by half a turn times it."""
    rng = np.random.default_rng(0)
    lengths = np.isin(m.components, LENGTHS)
    for _ in range(count):
        turned = np.where(lengths, m.length * rng.uniform(-1.0, 1.0, (len(start), len(lengths))), 0.0)
        angles = np.where(lengths, 0.0, np.pi * rng.uniform(-1.0, 1.0, (len(start), len(lengths))))
        yield poses.moved(start, size * (turned + angles), m.core.origins)


def in_order(edges: Sequence[tuple[int, int]], names: Sequence[int]) -> list[int] | None:
    """Joints that form one loop in the order along it, from the ground (-1) where it is on it; None otherwise."""
    ends = dict(zip(names, edges, strict=True))
    bodies = [body for pair in edges for body in pair]
    if any(bodies.count(body) != 2 for body in bodies) or not names:
        return None
    body = -1 if -1 in bodies else bodies[0]
    order: list[int] = []
    while len(order) < len(names):
        joint = next((k for k in names if k not in order and body in ends[k]), None)
        if joint is None:
            return None
        order.append(joint)
        one, other = ends[joint]
        body = other if body == one else one
    return order
