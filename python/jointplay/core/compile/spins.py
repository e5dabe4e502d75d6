"""Spins that move nothing of interest: a rod between two balls turns about the line through their centres.

Taken apart at its balls, a mechanism falls into groups of bodies. A group that hangs on two centres can turn about the
line through them as one rigid body, whatever the play in the balls and wherever the rest is. If neither the output nor
a load is off this line, no result depends on that turn. It is held: one of the balls gets a further equation, which
says that the group's rotation relative to the neighbour, less the swing of its line, stays what it is at the start.
This equation carries no reaction, because nothing turns the group. Inertia of moving bodies does not turn it, either,
where their centres of mass are on the line and their moments of inertia about any direction across it are equal: the
group then keeps the spin it has, which is none.
"""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import LoadSpec

from .frames import AxisAndSide, default_side, vector
from .graph import GROUND_INDEX, CompiledJoint, Graph, Point

#: distances from the line below this share of its length are rounding
ON_LINE = 1e-9
#: differences of moments of inertia below this share of the largest are rounding
ROUND = 1e-6
#: joints inside a group that keep a line through both of them where it is, when they lie along it
STRAIGHT = ("prismatic", "fixed")


@dataclass(frozen=True)
class Spin:
    """A turn of bodies about the line through two ball centres."""

    #: the bodies that turn, pieces of elastic ones among them
    bodies: tuple[int, ...]
    #: a ball joint at either end; the first one holds the spin
    joints: tuple[int, int]
    #: the line, and a direction across it that is held, on the first and the second body of that joint
    frames: tuple[AxisAndSide, AxisAndSide]
    #: what loads the bodies so that they turn, by its key in the file; then the spin is not held
    load: str | None


def find_spins(
    graph: Graph,
    guess: Floats,
    outputs: Container[int],
    loads: Sequence[tuple[str, LoadSpec]],
    inertias: Mapping[int, tuple[str, Floats]],
) -> list[Spin]:
    """The spins of a mechanism in space.

    Parameters
    ----------
    graph : Graph
        Bodies (pieces of elastic ones, too), joints and points.
    guess : ndarray
        Where the bodies are; a rod that points away from its other ball is turned towards it, in place.
    outputs : container of int
        Bodies whose pose is asked.
    loads : sequence of tuple
        What acts on the bodies, each with its key in the file.
    inertias : mapping
        Of bodies that move, by their index, the key of their moments of inertia in the file and the matrix, body axes.
    """
    if guess.shape[1] != poses.SPATIAL:
        return []
    found: list[Spin] = []
    for group in _groups(graph, len(guess)):
        if GROUND_INDEX in group or any(body in outputs for body in group):
            continue
        ends = _ends(graph, group)
        if len(ends) == 2:
            spin = _Line(graph, guess, group, ends).spin(loads, inertias)
            if spin is not None:
                found.append(spin)
    return found


def _groups(graph: Graph, bodies: int) -> Iterator[tuple[int, ...]]:
    """Bodies that hang together by other joints than balls."""
    groups: dict[int, tuple[int, ...]] = {body: (body,) for body in range(GROUND_INDEX, bodies)}
    for joint in graph.joints:
        one, other = (groups[body] for body in _bodies(graph, joint))
        if joint.kind != "spherical" and one is not other:
            both = (*one, *other)
            groups |= dict.fromkeys(both, both)
    # In the order of the file.
    yield from dict.fromkeys(tuple(sorted(group)) for group in groups.values())


def _bodies(graph: Graph, joint: CompiledJoint) -> tuple[int, int]:
    return graph.points[joint.first].body, graph.points[joint.second].body


def _ends(graph: Graph, group: tuple[int, ...]) -> list[tuple[int, bool]]:
    """A ball joint at every centre by which a group hangs on others, and whether the group is its second body."""
    ends: dict[tuple[object, ...], tuple[int, bool]] = {}
    for k, joint in enumerate(graph.joints):
        inside = [body in group for body in _bodies(graph, joint)]
        if joint.kind == "spherical" and inside[0] != inside[1]:
            point = graph.points[joint.second if inside[1] else joint.first]
            ends.setdefault((point.body, point.at), (k, inside[1]))
    return list(ends.values())


class _Line:
    """The line through the two ball centres of a group, on the group and as the neighbours place it."""

    def __init__(self, graph: Graph, guess: Floats, group: tuple[int, ...], ends: list[tuple[int, bool]]) -> None:
        self.graph, self.guess, self.group = graph, guess, group
        self.joints = tuple(k for k, _ in ends)
        self.second = ends[0][1]
        joints = [(graph.joints[k], second) for k, second in ends]
        self.own = [graph.points[j.second if second else j.first] for j, second in joints]
        self.others = [graph.points[j.first if second else j.second] for j, second in joints]
        #: whether all of the group has the same axes: it is one body, elastic or not
        self.is_one = self.own[0].body == self.own[1].body or self._same_axes()

    def _same_axes(self) -> bool:
        inner = [j for j in self.graph.joints if all(body in self.group for body in _bodies(self.graph, j))]
        return all(j.kind == "fixed" and j.compliance is not None and j.axis_first == j.axis_second for j in inner)

    def spin(self, loads: Sequence[tuple[str, LoadSpec]], inertias: Mapping[int, tuple[str, Floats]]) -> Spin | None:
        """The spin; None where the two centres are one."""
        own, others = ([self._placed(point) for point in points] for points in (self.own, self.others))
        line = own[1] - own[0]
        size = float(np.linalg.norm(line))
        if size <= ON_LINE * max(float(np.abs(own).max()), self.graph.span()):
            return None
        line /= size
        asked = others[1] - others[0]
        distance = float(np.linalg.norm(asked))
        there = asked / distance if distance > ON_LINE * size else line
        if self.is_one and line @ there < 0.0:
            self._turn(_swing(line, there), others[0])
            line = there
        body, neighbour = self.own[0].body, self.others[0].body
        turn, beside = (self._axes(b) for b in (body, neighbour))
        axis = vector((turn.T @ line).tolist())
        side = default_side(axis)
        across = _swing(line, there) @ turn @ np.array(side)
        turned = (key for key, load in loads if self._is_turned_by(load))
        swung = (inertias[k][0] for k in self.group if k in inertias and not self._is_round(k, inertias[k][1], line))
        frames = (vector((beside.T @ there).tolist()), vector((beside.T @ across).tolist())), (axis, side)
        return Spin(
            bodies=self.group,
            joints=(self.joints[0], self.joints[1]),
            frames=frames if self.second else (frames[1], frames[0]),
            load=next(iter((*turned, *swung)), None),
        )

    def _axes(self, body: int) -> Floats:
        return np.eye(3) if body == GROUND_INDEX else np.asarray(poses.matrix(self.guess[body]))

    def _placed(self, point: Point) -> Floats:
        at = np.array(point.at)
        return at if point.body == GROUND_INDEX else poses.place(self.guess[point.body], at)

    def _turn(self, turn: Floats, towards: Floats) -> None:
        """Turn a rod that points away from its other ball about its first one."""
        at = np.array(self.own[0].at)
        for body in self.group:
            axes = turn @ self._axes(body)
            self.guess[body] = [*(towards - axes @ at), *poses.from_axes(axes)]

    def _is_turned_by(self, load: LoadSpec) -> bool:
        """Whether a load does work when the group spins, here or elsewhere."""
        point = self.graph.points[load["point"]]
        if point.body not in self.group:
            return False
        if any(load["moment"]):
            return True
        if not any(load["force"]) or point in self.own:
            return False
        places = [self._placed(p) for p in (*self.own, point)]
        return not (self._is_straight() and _on_line(places[2], places[0], places[1] - places[0]))

    def _is_round(self, body: int, inertia: Floats, line: Floats) -> bool:
        """Whether a body has the same moment of inertia about every direction across the line, and no others."""
        along = self._axes(body).T @ line
        both = np.outer(along, along)
        about = along @ inertia @ along
        off = inertia - about * both - 0.5 * (np.trace(inertia) - about) * (np.eye(3) - both)
        return bool(np.abs(off).max() <= ROUND * np.abs(inertia).max())

    def _is_straight(self) -> bool:
        """Whether the line stays where it is on every body of the group."""
        if self.is_one:
            return True
        start, end = (self._placed(point) for point in self.own)
        for joint in self.graph.joints:
            bodies = _bodies(self.graph, joint)
            if not all(body in self.group for body in bodies):
                continue
            axis = self._axes(bodies[0]) @ np.array(joint.axis_first)
            at = self._placed(self.graph.points[joint.first])
            along = _on_line(at, start, end - start) and _on_line(at + axis, start, end - start)
            if joint.kind not in STRAIGHT or not (along or joint.kind == "fixed"):
                return False
        return True


def _on_line(at: Floats, start: Floats, along: Floats) -> bool:
    size = float(np.linalg.norm(along))
    return float(np.linalg.norm(np.cross(at - start, along))) <= ON_LINE * size * size


def _swing(line: Floats, there: Floats) -> Floats:
    """The rotation that takes one direction to another the shortest way; of opposite ones, one of half a turn."""
    axis, cosine = np.cross(line, there), float(line @ there)
    if cosine < ON_LINE - 1.0:
        half = np.array(default_side(vector(line.tolist())))
        return np.asarray(2.0 * np.outer(half, half) - np.eye(3))
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + cosine))
