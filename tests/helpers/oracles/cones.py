"""The load-determined pose in space as a cone program, solved by Clarabel.

    maximise  <w, xi>   over twists xi of the bodies and offsets delta of the joints,
    subject to  B xi = delta  (locked components of every joint),  0 = driven components,  delta_j in C_j

B is written down from the relative velocity of two bodies at the joint; every set from its definition; the multipliers
of the first constraint are what the joints transmit.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .loops import LOCKED, matrices

Array = NDArray[np.float64]
#: variables are counted in these metres and radians, so that they are of the order of one
UNIT = 1e-5
TRANSLATIONS = ("along", "side", "normal", "x", "y", "z")
DIRECTIONS = {"along": 0, "side": 1, "normal": 2, "x": 0, "y": 1, "z": 2, "tilt_side": 1, "tilt_normal": 2}
DIRECTIONS |= {"roll": 0, "angle": 0}
#: the coordinate that a drive holds
COORDINATES = {"revolute": "angle", "cylindrical": "along", "prismatic": "along"}


def cross(v: Array) -> Array:
    """The matrix of v x."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


@dataclass(frozen=True)
class Best:
    """The optimum: work, twists [body, 6] and reactions [joint, 6] on the second bodies in ground axes."""

    work: float
    twists: Array
    reactions: Array


class Linearised:
    """A spatial mechanism at poses [body, 7], to first order."""

    def __init__(self, spec: dict[str, Any], poses: Array) -> None:
        self.spec = spec
        self.position = np.vstack([poses[:, :3], np.zeros(3)])  # the ground has index -1
        self.rotation = np.concatenate([matrices(poses), np.eye(3)[None]])
        self.axes = [self._axes(joint) for joint in spec["joints"]]
        self.locked = [(j, name) for j, joint in enumerate(spec["joints"]) for name in LOCKED[joint["kind"]]]
        self.rows = np.array([self._row(j, name) for j, name in self.locked])
        self.drives = [(d["joint"], d.get("component") or COORDINATES[self._kind(d["joint"])]) for d in spec["drives"]]
        self.driven = np.array([self._row(j, name) for j, name in self.drives]).reshape(-1, self.rows.shape[1])

    def _kind(self, joint: int) -> str:
        return str(self.spec["joints"][joint]["kind"])

    def place(self, point: int) -> tuple[int, Array]:
        """A point's body and where it is."""
        body = self.spec["points"][point]["body"]
        return body, self.position[body] + self.rotation[body] @ np.array(self.spec["points"][point]["at"])

    def _axes(self, joint: dict[str, Any]) -> Array:
        """Unit vectors of a joint as rows: those of the ground for a ball, else along, side, normal."""
        if joint["kind"] == "spherical":
            return np.eye(3)
        along, side = np.array(joint["axis_first"]), np.array(joint["side_first"])
        side = side - (side @ along) * along
        side /= np.linalg.norm(side)
        body = self.spec["points"][joint["first"]]["body"]
        return np.array([along, side, np.cross(along, side)]) @ self.rotation[body].T

    def at(self, point: Array, body: int) -> Array:
        """Velocity at a place and angular velocity of a body, [6, twists of all bodies]."""
        found = np.zeros((6, 6 * self.spec["n_bodies"]))
        if body >= 0:
            own = found[:, 6 * body : 6 * body + 6]
            own[:] = np.eye(6)
            own[:3, 3:] = -cross(point - self.position[body])
        return found

    def _row(self, j: int, name: str) -> Array:
        """Displacement of the second body from the first at the second's point, seen from the first."""
        joint = self.spec["joints"][j]
        body, point = self.place(joint["second"])
        relative = self.at(point, body) - self.at(point, self.spec["points"][joint["first"]]["body"])
        direction = self.axes[j][DIRECTIONS[name]]
        return np.asarray(direction @ (relative[:3] if name in TRANSLATIONS else relative[3:]))

    def output(self) -> Array:
        """Displacement of the output, [6, twists of all bodies]."""
        body, point = self.place(self.spec["output"]["point"])
        return self.at(point, body)

    def load(self) -> Array:
        """What the loads do along the twists of all bodies."""
        total = np.zeros(6 * self.spec["n_bodies"])
        for load in self.spec["loads"]:
            body, point = self.place(load["point"])
            total += np.concatenate([load["force"], load["moment"]]) @ self.at(point, body)
        return total

    def maximise(self, weights: Array) -> Best:
        """The largest work of a load on the twists, over all offsets that the clearances allow."""
        n, m, d = self.rows.shape[1], len(self.rows), len(self.driven)
        sizes = {s["joint"]: s["set"] for s in self.spec["sources"] if s["kind"] == "clearance"}
        lost = {s["drive"]: s["set"]["interval"] for s in self.spec["sources"] if s["kind"] == "backlash"}
        rigid = [k for k, (j, _) in enumerate(self.locked) if j not in sizes]
        rigid += [m + k for k in range(d) if k not in lost]
        # Twists, then what every locked component and every drive gives way.
        equal = np.hstack([np.vstack([self.rows, self.driven]), -np.eye(m + d)])
        equal = np.concatenate([equal, np.eye(n + m + d)[n + np.array(rigid, dtype=int)]])
        a, b, cones = [-equal], [np.zeros(len(equal))], [clarabel.ZeroConeT(len(equal))]
        for j, set_ in sizes.items():
            names = LOCKED[self._kind(j)]
            columns = {name: n + self.locked.index((j, name)) for name in names}
            for left, bound, round_ in limits(set_):
                row = np.zeros((1 + len(left), n + m + d))
                for i, terms in enumerate(left):
                    for name, factor in terms.items():
                        row[1 + i, columns[name]] = factor
                # (bound, left) lies in the second-order cone, or bound - left is not negative.
                if not round_:
                    row = -row[1:]
                a.append(row)
                b.append(np.array([bound / UNIT] + [0.0] * len(left) if round_ else [bound / UNIT]))
                cones.append(clarabel.SecondOrderConeT(len(row)) if round_ else clarabel.NonnegativeConeT(1))
        for k, ends in lost.items():
            way = np.eye(n + m + d)[n + m + k]
            a.append(np.array([-way, way]))
            b.append(np.array([ends["high"], -ends["low"]]) / UNIT)
            cones.append(clarabel.NonnegativeConeT(2))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-13
        scale = np.abs(weights).max()
        cost = np.concatenate([-weights / scale, np.zeros(m + d)])
        matrix = sparse.csc_matrix(-np.concatenate(a))
        quadratic = sparse.csc_matrix((n + m + d, n + m + d))
        solution = clarabel.DefaultSolver(quadratic, cost, matrix, np.concatenate(b), cones, settings).solve()
        # Where the last digits are not reached it says so; the tests compare what was reached.
        assert str(solution.status) in ("Solved", "AlmostSolved", "InsufficientProgress"), solution.status
        x, dual = np.array(solution.x), np.array(solution.z)
        reactions = self._wrenches(-scale * dual[: m + d])
        return Best(-scale * UNIT * float(cost @ x), UNIT * x[:n].reshape(-1, 6), reactions)

    def _wrenches(self, transmitted: Array) -> Array:
        """What locked and driven components transmit, as force and moment on the second body at its point."""
        found = np.zeros((len(self.axes), 6))
        for (j, name), value in zip(self.locked + self.drives, transmitted, strict=True):
            part = slice(0, 3) if name in TRANSLATIONS else slice(3, 6)
            found[j, part] += value * self.axes[j][DIRECTIONS[name]]
        return found


Limit = tuple[list[dict[str, float]], float, bool]


def limits(set_: dict[str, Any]) -> list[Limit]:
    """A set as what is bounded: linear forms by name of the component, the bound, and whether it bounds their norm."""
    ((kind, size),) = set_.items()
    found: list[Limit] = []
    if kind in ("journal", "sleeve"):
        # Both ends of the pin, at -+ its half length along the axis: th x axis = (th_normal, -th_side).
        for end in (size["half_length"], -size["half_length"]):
            ends = [{"side": 1.0, "tilt_normal": end}, {"normal": 1.0, "tilt_side": -end}]
            found.append((ends, size["radius"], True))
        if kind == "journal":
            found += [([{"along": sign}], size["axial"], False) for sign in (1.0, -1.0)]
    elif kind == "ball":
        found.append(([{"x": 1.0}, {"y": 1.0}, {"z": 1.0}], size["radius"], True))
    else:
        faces = {
            "guide": (
                {"side": 1.0, "tilt_normal": size.get("half_length"), "roll": size.get("half_height")},
                {"normal": 1.0, "tilt_side": size.get("half_length"), "roll": size.get("half_width")},
            ),
            "plate": ({"along": 1.0, "tilt_side": size.get("half_normal"), "tilt_normal": size.get("half_side")},),
        }[kind]
        for face in faces:
            for signs in itertools.product((1.0, -1.0), repeat=3):
                terms = {name: sign * float(f) for (name, f), sign in zip(face.items(), signs, strict=True)}
                found.append(([terms], size["gap"], False))
    return found
