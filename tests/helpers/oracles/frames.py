"""The file of an elastic mechanism as a frame of finite elements in Pynite, and its contacts as a cone program.

    forces on the ends of an element      f = K (d + delta)    d: its nodes, delta: by how much its ends are off them
    least energy over the offsets         minimise  u' H u / 2 + R' u   with  |u_j| <= r_j

A body is a chain of elements along its line, or a star of them; a joint is a node on which the end of one element
rides, with its releases. That end is off its node by the offset in the joint, by the angle at which it is locked, and
by the deviations of the dimensions that end there. Pynite gives R, the forces in the joints, and H, how they change
with each offset. Everything is linear, about the file as drawn.

There are no rigid elements: what is rigid is so many times as stiff as what is not (`STIFFER`), and the answers are
extrapolated. Only what the tests use is read: drawn as assembled; millimetres, degrees and newtons.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from Pynite import FEModel3D

from .least_energy import contacts

Array = NDArray[np.float64]
Place = tuple[float, float, float]
Seat = tuple[str, Place]
GROUND = "ground"
STIFFER = (500.0, 1000.0, 2000.0, 4000.0)
DIRECTIONS = ("X", "Y", "Z")
#: what the end of an element is free in, in its own axes: x is along it
RELEASES = {
    "planar": {"revolute": ("Rz",), "fixed": ()},
    "spatial": {"prismatic": ("Dx",), "universal": ("Ry", "Rz"), "spherical": ("Rx", "Ry", "Rz"), "fixed": ()},
}
#: where a radial clearance is a disc or a ball, and all there is
ROUND = ("revolute", "fixed", "spherical")
KNOWN = {
    "": {"format", "title", "space", "units", "joints", "bodies", "dimensions", "output", "loads", "assembly"},
    "joints": {"type", "bodies", "at", "on", "axis", "axes", "clearance", "angle"},
    "bodies": {"stiffness", "E", "area", "inertia", "G", "torsion"},
}


def is_known(data: Mapping[str, Any]) -> bool:
    """Whether there is anything elastic, and nothing that is not read."""
    if not set(data) <= KNOWN[""] or "bodies" not in data:
        return False
    kinds, joints = RELEASES[data.get("space", "planar")], data["joints"].values()
    plain = all(set(joint) <= KNOWN["joints"] and joint["type"] in kinds for joint in joints)
    gaps = [joint for joint in joints if "clearance" in joint]
    round_ = all(set(joint["clearance"]) == {"radial"} and joint["type"] in ROUND for joint in gaps)
    return plain and round_ and all(body and set(body) <= KNOWN["bodies"] for body in data["bodies"].values())


class End(NamedTuple):
    """An end of an element: 0 where it begins, 1 where it stops."""

    element: int
    end: int


@dataclass(frozen=True)
class Pair:
    """Two bodies in a joint: the end that rides, and by which sign it is displaced as the second from the first."""

    name: str
    rides: End
    sign: float
    radial: float
    angle: float


@dataclass(frozen=True)
class Loaded:
    """Displacement of the output [6], wrench on the second body of every pair [6], tension of every element."""

    output: Array
    reactions: dict[str, Array]
    tensions: dict[tuple[str, frozenset[Place]], float]


@dataclass
class Frame:
    """The elements between the seats of the bodies, and the joints."""

    data: Mapping[str, Any]
    #: body and the two places
    elements: list[tuple[str, Place, Place]] = field(default_factory=list)
    #: node of every seat; seats that ride have the node of another body
    nodes: dict[Seat, Seat] = field(default_factory=dict)
    pairs: list[Pair] = field(default_factory=list)
    released: dict[End, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.space = self.data.get("space", "planar")
        self.joints = {name: _joint(joint) for name, joint in self.data["joints"].items()}
        seats: dict[str, list[Place]] = {}
        for bodies, at in self.joints.values():
            for body in bodies:
                seats.setdefault(body, []).append(at)
        middle = {body: _place(np.mean([*dict.fromkeys(places)], axis=0)) for body, places in seats.items()}
        for body, at in (self.output, *((body, at) for body, at, _ in self.loads())):
            seats[body].append(at)
        for body, places in seats.items():
            self.nodes |= {(body, at): (body, at) for at in places}
            if body != GROUND:
                ends = _elements([*dict.fromkeys(places)], middle[body], body in self.data["bodies"])
                self.elements += [(body, a, b) for a, b in ends]
        self.nodes |= {(body, at): (body, at) for body, *ends in self.elements for at in ends}
        for name in self.joints:
            self._join(name)

    def _join(self, name: str) -> None:
        bodies, at = self.joints[name]
        joint = self.data["joints"][name]
        first, *others = bodies
        for other in others:
            # The end of a single element rides; the pin is on the other body.
            rider, holder = (other, first) if len(self.ends((other, at))) == 1 else (first, other)
            (end,) = self.ends((rider, at))
            assert holder == first or len(others) == 1
            assert end not in self.released
            self.nodes[rider, at] = holder, at
            self.released[end] = RELEASES[self.space][joint["type"]]
            self.pairs.append(
                Pair(
                    name if len(others) == 1 else f"{name}/{other}",
                    end,
                    1.0 if rider == other else -1.0,
                    joint.get("clearance", {}).get("radial", 0.0),
                    math.radians(joint.get("angle", {}).get("deviation", 0.0)),
                )
            )
            self._check(joint, end)

    def _check(self, joint: Mapping[str, Any], end: End) -> None:
        """The releases are in the axes of the element: those of the joint have to be as well."""
        _, a, b = self.elements[end.element]
        along = np.subtract(b, a) / math.dist(a, b)
        if "axes" in joint:
            np.testing.assert_allclose(joint["axes"] @ along, 0.0, atol=1e-12)
        elif "axis" in joint:
            np.testing.assert_allclose(np.cross(joint["axis"], along), 0.0, atol=1e-12)

    @property
    def output(self) -> Seat:
        return self._seat(self.data["output"])

    def _seat(self, entry: Mapping[str, Any]) -> Seat:
        body, at = entry.get("body", self.data["output"]["body"]), entry.get("at", self.data["output"]["at"])
        return body, self.joints[at][1] if isinstance(at, str) else _place(at)

    def loads(self) -> list[tuple[str, Place, Array]]:
        """Forces and moments on bodies, at places."""
        found = []
        for load in self.data.get("loads", []):
            force, moment = np.zeros(3), np.zeros(3)
            force[: len(load.get("force", ()))] = load.get("force", ())
            moment[-np.size(load.get("moment", 0.0)) :] = load.get("moment", 0.0)
            found.append((*self._seat(load), np.concatenate([force, moment])))
        return found

    def ends(self, seat: Seat) -> list[End]:
        """The ends of the elements of a body that are at a place."""
        return [
            End(k, e) for k, (body, *places) in enumerate(self.elements) for e in (0, 1) if (body, places[e]) == seat
        ]

    def rigidities(self, stiffer: float) -> dict[str, tuple[float, float, float]]:
        """Of every body EA, EI and GJ: N, N mm^2."""
        size = max(math.dist(a, b) for _, a, b in self.elements)
        given = {body: self._rigidities(body, values) for body, values in self.data["bodies"].items()}
        # Springs that are comparable: an axial stiffness, and that of bending over the size.
        springs = [ea / size for ea, _, _ in given.values() if ea]
        springs += [ei / size**3 for _, *turns in given.values() for ei in turns if ei]
        found = {}
        for body in dict.fromkeys(body for body, *_ in self.elements):
            own = given.get(body, np.zeros(3))
            reach = max(math.dist(a, b) for other, a, b in self.elements if other == body)
            bent = 1.0 if self._is_bar(body) else stiffer
            rigid = max(springs) * np.array([stiffer * reach, bent * reach**3, bent * reach**3])
            found[body] = tuple(np.where(own, own, rigid))
        return found

    def _is_bar(self, body: str) -> bool:
        """Whether it is only pulled or pressed; then it does not matter how stiff it is against being bent."""
        joints = [name for name, (bodies, _) in self.joints.items() if body in bodies]
        ends = {self.joints[name][1] for name in joints} == {at for other, at in self.nodes if other == body}
        pins = all("Rz" in RELEASES[self.space][self.data["joints"][name]["type"]] for name in joints)
        return ends and pins and len(joints) == 2 and not any(w[3:].any() for b, _, w in self.loads() if b == body)

    def _rigidities(self, body: str, values: Mapping[str, float]) -> Array:
        """Zero is what is rigid."""
        e, g = values.get("E", 0.0), values.get("G", 0.0)
        places = [at for bodies, at in self.joints.values() if body in bodies]
        whole = max(math.dist(a, b) for a in places for b in places)
        stretched = values["stiffness"] * whole if "stiffness" in values else e * values.get("area", 0.0)
        return np.array([stretched, e * values.get("inertia", 0.0), g * values.get("torsion", 0.0)])

    def model(self, stiffer: float) -> FEModel3D:
        model = FEModel3D()
        model.add_material("unit", 1.0, 1.0, 0.0, 0.0)
        self.names = {node: f"N{k}" for k, node in enumerate(dict.fromkeys(self.nodes.values()))}
        for (body, at), name in self.names.items():
            model.add_node(name, *at)
            still = [body == GROUND] * 6
            if self.space == "planar":
                still = list(np.logical_or(still, [False, False, True, True, True, False]))
            model.def_support(name, *map(bool, still))
        for body, (ea, ei, gj) in self.rigidities(stiffer).items():
            model.add_section(body, ea, ei, ei, gj)
        for k, (body, a, b) in enumerate(self.elements):
            model.add_member(f"E{k}", *(self.names[self.nodes[body, at]] for at in (a, b)), "unit", body)
        for k in range(len(self.elements)):
            free = {f"{name}{'ij'[e]}": True for e in (0, 1) for name in self.released.get(End(k, e), ())}
            model.def_releases(f"E{k}", **free)
        return model

    def displaced(self) -> tuple[Array, Array]:
        """What the file says of how far ends are off their nodes [element, end, 6]: in the joint, and of the body."""
        in_joint, own = np.zeros((len(self.elements), 2, 6)), np.zeros((len(self.elements), 2, 6))
        for pair in self.pairs:
            in_joint[pair.rides][5] += pair.sign * pair.angle
        for entry in self.data.get("dimensions", {}).values():
            start, at = (self.joints[name][1] for name in entry["between"])
            shift = entry.get("deviation", 0.0) * np.subtract(at, start) / math.dist(at, start)
            body = entry["body"]
            for end in self.ends((body, at)):
                own[end][:3] -= shift
            if body == GROUND:
                for pair in self.pairs:
                    rider, *places = self.elements[pair.rides.element]
                    if self.nodes[rider, places[pair.rides.end]] == (GROUND, at):
                        in_joint[pair.rides][:3] += shift
        return in_joint, own

    def solve(self, clearances: bool) -> Loaded:
        """Under the loads and deviations of the file, with the clearances or without any."""
        loose = [pair for pair in self.pairs if pair.radial and clearances]
        axes = 2 if self.space == "planar" else 3
        # Compliances are inverse to stiffness: the polynomial in the inverse through all of them, where it is zero.
        weights = np.linalg.solve(np.vander(1.0 / np.array(STIFFER), increasing=True).T, np.eye(len(STIFFER))[0])
        answers = sum(w * self._responses(s, loose, axes) for w, s in zip(weights, STIFFER, strict=True))
        own, columns = answers[0], answers[1:]
        if loose:
            where = [6 + 6 * self.pairs.index(pair) + i for pair in loose for i in range(axes)]
            own = own + contacts(columns[:, where], own[where], [pair.radial for pair in loose]) @ columns
        first = 6 + 6 * len(self.pairs)
        return Loaded(
            own[:6],
            {pair.name: own[6 + 6 * k : 12 + 6 * k] for k, pair in enumerate(self.pairs)},
            {(body, frozenset(places)): own[first + k] for k, (body, *places) in enumerate(self.elements)},
        )

    def _responses(self, stiffer: float, loose: list[Pair], axes: int) -> Array:
        """Output, reactions and tensions, [1 + offsets, all of them]: of the file, and of every offset of size one."""
        model = self.model(stiffer)
        matrices = [model.members[f"E{k}"].Ke() for k in range(len(self.elements))]
        loads = np.zeros((len(self.elements), 2, 6))
        for body, at, wrench in self.loads():
            end = self.ends((body, at))[0]
            assert end not in self.released or not wrench[3:].any()
            loads[end] += wrench
        in_joint, own = self.displaced()
        cases = [(loads, in_joint, own)]
        for pair in loose:
            for i in range(axes):
                unit = np.zeros_like(own)
                unit[pair.rides][i] = pair.sign
                cases.append((np.zeros_like(own), unit, np.zeros_like(own)))
        for c, (force, *off) in enumerate(cases):
            model.add_load_combo(f"C{c}", {f"C{c}": 1.0})
            for k, (body, *places) in enumerate(self.elements):
                left = force[k] - (matrices[k] @ (off[0] + off[1])[k].ravel()).reshape(2, 6)
                for at, wrench in zip(places, left, strict=True):
                    for name, value in zip([f"{x}{y}" for x in "FM" for y in DIRECTIONS], wrench, strict=True):
                        if value:
                            model.add_node_load(self.names[self.nodes[body, at]], name, value, f"C{c}")
        model.analyze_linear(sparse=False)
        assert all(len(member.sub_members) == 1 for member in model.members.values()), "a node lies on an element"
        return np.array([self._response(model, f"C{c}", matrices, *case) for c, case in enumerate(cases)])

    def _response(
        self, model: FEModel3D, case: str, matrices: list[Array], loads: Array, in_joint: Array, own: Array
    ) -> Array:
        ends = np.array([[self._moved(model, case, body, at) for at in places] for body, *places in self.elements])
        forces = np.reshape(
            [matrix @ d.ravel() for matrix, d in zip(matrices, ends + in_joint + own, strict=True)], (-1, 2, 6)
        )
        reactions = [pair.sign * (forces - loads)[pair.rides] for pair in self.pairs]
        along = [np.subtract(b, a) / math.dist(a, b) for _, a, b in self.elements]
        tensions = np.sum(forces[:, 1, :3] * along, axis=1)
        end = self.ends(self.output)[0]
        seat = (ends + in_joint)[end]
        if end in self.released:
            seat[3:] = self._turn(end, (ends + in_joint + own)[end.element])
        return np.concatenate([seat, *reactions, tensions])

    def _moved(self, model: FEModel3D, case: str, body: str, at: Place) -> Array:
        node = model.nodes[self.names[self.nodes[body, at]]]
        return np.array([getattr(node, f"{x}{y}")[case] for x in "DR" for y in DIRECTIONS])

    def _turn(self, end: End, moved: Array) -> Array:
        """Rotation of an end without a moment: of the straight line, and half as much again less half the other's."""
        _, a, b = self.elements[end.element]
        along = np.subtract(b, a) / math.dist(a, b)
        line = np.cross(along, moved[1, :3] - moved[0, :3]) / math.dist(a, b)
        other = End(end.element, 1 - end.end)
        if self.released.get(other):
            return np.asarray(line)
        far = moved[other.end, 3:] - along * (along @ moved[other.end, 3:])
        return np.asarray(1.5 * line - 0.5 * far)


def _joint(joint: Mapping[str, Any]) -> tuple[list[str], Place]:
    if "at" in joint:
        return list(joint["bodies"]), _place(joint["at"])
    (at,) = {_place(place) for place in joint["on"].values()}
    return list(joint["on"]), at


def _place(at: Any) -> Place:
    x, y, *z = map(float, at)
    return x, y, z[0] if z else 0.0


def _elements(places: list[Place], middle: Place, elastic: bool) -> list[tuple[Place, Place]]:
    """Along the line of an elastic body; of a rigid one from its middle, beside such a line, so that none is short."""
    points = np.array(places)
    spread = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(spread)
    straight = len(places) < 3 or sizes[1] < 1e-9 * sizes[0]
    if elastic or len(places) < 3:
        assert straight
        order = np.argsort(spread @ axes[0])
        return [(places[a], places[b]) for a, b in itertools.pairwise(order)]
    if straight:
        beside = np.cross(axes[0], [0.0, 0.0, 1.0] if abs(axes[0][2]) < 0.9 else [1.0, 0.0, 0.0])
        middle = _place(middle + sizes[0] * beside)
    nearest = min(places, key=lambda at: math.dist(at, middle))
    if math.dist(nearest, middle) < sizes[0] / 4:
        middle = nearest
    places = [middle, *(at for at in places if at != middle)]
    return [(_last_before(at, places), at) for at in places[1:]]


def _last_before(at: Place, places: list[Place]) -> Place:
    """The place that is next on the way to the first of them; Pynite ties whatever lies on an element to it."""
    way = math.dist(at, places[0])
    between = [b for b in places if b != at and math.dist(places[0], b) + math.dist(b, at) < (1 + 1e-12) * way]
    return max(between, key=lambda b: math.dist(places[0], b))
