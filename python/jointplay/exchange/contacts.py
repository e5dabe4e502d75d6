"""A planar mechanism as a model of MuJoCo, with its clearances as gaps between solids: for a study of its dynamics.

Every body slides along x and y and turns about z against the ground; joints are contacts. A hole with a pin is a ring
of N boxes around a capsule. Their faces are the sides of a regular polygon, so that the centre of the pin stays in

    n_k . d <= c,    n_k = (cos 2 pi k / N, sin 2 pi k / N),

which holds the disc |d| <= c of the clearance and exceeds it by c pi^2 / (2 N^2) at most; a load in any direction finds
a corner within the angle pi / N. The radii of pin and hole have no influence, only their difference. A guide is two
boxes around two balls at the ends of the slider, which gives |d_n| + (length / 2) |sin tau| <= gap.

Contact in MuJoCo is soft. With the stiffest one it has, the penetration at rest under a force F on a mass m is of the
order 4e-4 (F / m) dt^2; the time step dt is a small part of the period in which a pin swings in its hole under the
load, 2 pi / w with w^2 = F / (m c), so that the penetration is some 1e-7 of c whatever the units. Drag proportional to
mass with the rate 2 w lets the model come to rest; a study of dynamics takes it away (the attributes `damping`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import InputError, in_range, listed, one_line
from jointplay.model import Mechanism
from jointplay.spec import ENDS, JointSpec, LoadSpec, PointSpec

Floats = NDArray[np.float64]

#: boxes of a ring: the corner that a load finds is at most a degree beside it
PIECES = 180
#: radius of a pin and thickness of a ring as parts of the size of the mechanism; neither has an influence
PIN, WALL = 0.03, 0.02
#: height from one joint to the next, in radii of pins: capsules are four radii high with their round ends
LAYER = 5.0
#: mass of a body without one: that of a steel bar of this section, m^2
BAR = 1e-4 * 7850.0
#: the same as a part of the largest mass: the solver loses digits with their ratio
LEAST = 0.01
#: time step as a part of 1 / w
STEP = 0.02
#: the stiffest contact
HARDEST = "0.9999 0.9999 0.001 0.5 2"
#: what MuJoCo takes for a joint of two bodies in the plane
CARRIED = ("revolute", "prismatic", "pin_in_slot", "fixed")
GRAVITY = 9.81
#: name of the ground in MuJoCo
WORLD = "world"


def to_mjcf(m: Mechanism, configuration: int = 0) -> str:
    """The text of a model.

    Parameters
    ----------
    m : Mechanism
        A planar one of rigid bodies.
    configuration : int
        Number of the configuration in which its drives are held, from 0.

    Raises
    ------
    InputError
        When it has something that the model cannot have.
    """
    _check(m)
    values = np.ascontiguousarray(m.drive_values)
    in_range(configuration, "configuration", "the number of a configuration", 0, len(values) - 1)
    poses = m.core.solve(values)["poses"][configuration]
    if not np.isfinite(poses).all():
        raise InputError(f"configuration {configuration} cannot be assembled", file=m.file)
    return _Model(m.under_loads_of(configuration), poses, configuration).text()


def _check(m: Mechanism) -> None:
    """Refuse what cannot be exported."""
    problem = None
    others = sorted({kind for kind in m.joint_kinds if kind not in CARRIED})
    if m.data.space != "planar":
        problem = "is in space; the model for MuJoCo is that of a planar mechanism"
    elif m.drive_values is None:
        problem = "needs drives with values"
    elif others:
        problem = f"has joints that the model for MuJoCo cannot have: {listed(others)}"
    elif m.members:
        problem = "has elastic bodies, which the model for MuJoCo cannot have"
    elif m.core_spec["torsions"] or any(not spring["stiffness"] for spring in m.core_spec["springs"]):
        problem = "has torsion springs or constant springs, which the model for MuJoCo cannot have"
    elif m.outputs or m.load_cases:
        problem = "has several outputs or load cases; name one of them"
    elif WORLD in m.bodies:
        problem = f"has a body '{WORLD}', which is MuJoCo's name of the ground; give it another name"
    elif any(joint.get("compliance") for joint in m.core_spec["joints"]):
        problem = "has elastic joints, which the model for MuJoCo cannot have"
    if problem:
        raise InputError(problem, file=m.file)


def _text(values: object) -> str:
    """Numbers with blanks between them."""
    return " ".join(f"{float(x):.12g}" for x in np.atleast_1d(np.asarray(values, dtype=np.float64)))


def _turned(angle: float, vector: Floats) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


class _Model:
    """One mechanism on its way to a model."""

    def __init__(self, m: Mechanism, poses: Floats, configuration: int) -> None:
        self.m, self.poses, self.configuration = m, poses, configuration
        self.spec = m.core_spec
        self.size = m.length
        self.radius, self.wall = PIN * self.size, WALL * self.size
        self.plays = {s["joint"]: s["set"] for s in self.spec["sources"] if s["kind"] == "clearance" and "joint" in s}
        self.given = [m.data.bodies[name].mass if name in m.data.bodies else 0.0 for name in m.bodies]
        least = LEAST * max(self.given, default=0.0)
        self.masses = [mass or max(least, BAR * self._length(k)) for k, mass in enumerate(self.given)]
        self.rate = self._rate()
        self.root = ET.Element("mujoco", model=one_line(m.title) or "mechanism")
        self.world = self.equality = self.root
        self.bodies: list[Element] = []

    # --- sizes ------------------------------------------------------------------------------------------------------

    def _points(self, body: int) -> Floats:
        return np.array([point["at"][:2] for point in self.spec["points"] if point["body"] == body])

    def _length(self, body: int) -> float:
        return max(float(np.ptp(self._points(body), axis=0).max()), 0.1 * self.size)

    def _rate(self) -> float:
        """w of a pin in the smallest hole that all forces press with all masses."""
        gravity = float(np.linalg.norm(self.m.data.gravity or (0.0, 0.0)))
        force = sum(float(np.linalg.norm(load["force"])) for load in self._loads()) + gravity * sum(self.given)
        sizes = [size for play in self.plays.values() for shape in play.values() for size in shape.values()]
        plays = [size for size in sizes if size > 0]
        mass = sum(self.masses)
        return math.sqrt((force or GRAVITY * mass) / mass / min(plays, default=1e-3 * self.size))

    def _loads(self) -> list[LoadSpec]:
        """Loads without weights, which follow from masses here."""
        weights = sum(mass > 0 for mass in self.given) if any(self.m.data.gravity or ()) else 0
        loads = self.spec["loads"]
        return loads[: len(loads) - weights]

    # --- the model --------------------------------------------------------------------------------------------------

    def text(self) -> str:
        """The whole of it."""
        root = self.root
        for sentence in self._remarks():
            # Two hyphens would end it.
            root.append(ET.Comment(f" {one_line(sentence).replace('--', '- -')} "))
        SubElement(root, "compiler", angle="radian", autolimits="true")
        gravity = [*(self.m.data.gravity or (0.0, 0.0)), 0.0]
        step = STEP / self.rate
        SubElement(
            root, "option", timestep=_text(step), gravity=_text(gravity), integrator="implicitfast", tolerance="1e-14"
        )
        default = SubElement(root, "default")
        hard = {"solref": _text([2 * step, 1.0]), "solimp": HARDEST}
        SubElement(default, "geom", {"condim": "1", "contype": "0", "conaffinity": "0", "mass": "0", **hard})
        SubElement(default, "equality", hard)
        # A pin touches rings, and nothing else touches anything.
        for name, kind, mask, colour in (("pin", "1", "0", "0.8 0.5 0.2 1"), ("hole", "0", "1", "0.5 0.6 0.7 0.6")):
            inner = SubElement(default, "default", {"class": name})
            SubElement(inner, "geom", contype=kind, conaffinity=mask, rgba=colour)
        self.world = SubElement(root, "worldbody")
        SubElement(self.world, "light", pos=_text([0, 0, 10 * self.size]))
        SubElement(self.world, "site", name="ground")
        self.bodies = [self._body(k) for k in range(len(self.m.bodies))]
        self.equality = SubElement(root, "equality")
        held = {move["joint"] for drive in self.spec["drives"] for move in (drive, *drive.get("also", ()))}
        for number, joint in enumerate(self.spec["joints"]):
            self._joint(number, joint, number in held)
        self._springs()
        self._loads_on_sites()
        output = self.spec["points"][self.spec["output"]["point"]]
        self._site(output["body"], "output", output["at"])
        sensor = SubElement(root, "sensor")
        SubElement(sensor, "framepos", name="output", objtype="site", objname="output")
        empty = [e for e in root if e.tag in ("equality", "tendon", "actuator") and not len(e)]
        for element in empty:
            root.remove(element)
        ET.indent(root)
        return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"

    def _remarks(self) -> Iterator[str]:
        assert self.m.drive_values is not None
        held = self.m.drive_values[self.configuration] / self.m.drive_factors
        drives = ", ".join(f"{name} = {value:.10g}" for name, value in zip(self.m.drives, held, strict=True))
        yield f"Exported from {self.m.file}: lengths in m, masses in kg, times in s."
        if drives:
            yield f"Drives are held at {drives}."
        yield "Every joint has a layer of its own. The damping lets it come to rest; take it away to study dynamics."
        light = [name for name, mass in zip(self.m.bodies, self.given, strict=True) if not mass]
        if light:
            yield f"No mass is given for {listed(light)}: that of a steel bar of 10 mm x 10 mm or more, without weight."
        if any(any(source["centre"]) for source in self.spec["sources"]):
            yield "Known deviations are left out."

    def _body(self, k: int) -> Element:
        x, y, angle = self.poses[k]
        name, mass = self.m.bodies[k], self.masses[k]
        body = SubElement(self.world, "body", name=name, pos=_text([x, y, 0]), euler=_text([0, 0, angle]))
        if not self.given[k]:
            body.set("gravcomp", "1")
        centre = np.zeros(2)
        if name in self.m.data.bodies and self.given[k]:
            centre = np.array(self.m.data.bodies[name].centre[:2]) * self.m.units.length
        elif len(self._points(k)):
            centre = self._points(k).mean(axis=0)
        # A bar about its middle, and as thick as high.
        spin = mass * self._length(k) ** 2 / 12
        pos = _text([*centre, 0])
        SubElement(body, "inertial", pos=pos, mass=_text(mass), diaginertia=_text([spin, spin, spin]))
        for axis, direction in (("x", [1.0, 0.0]), ("y", [0.0, 1.0])):
            along = [*_turned(-angle, np.array(direction)), 0.0]
            drag = _text(2 * self.rate * mass)
            SubElement(body, "joint", name=f"{name}-{axis}", type="slide", axis=_text(along), damping=drag)
        about = 2 * self.rate * (spin + mass * float(centre @ centre))
        SubElement(body, "joint", name=f"{name}-angle", type="hinge", axis="0 0 1", damping=_text(about))
        return body

    def _on(self, body: int) -> Element:
        return self.world if body < 0 else self.bodies[body]

    def _site(self, body: int, name: str, at: list[float]) -> None:
        SubElement(self._on(body), "site", name=name, pos=_text([at[0], at[1], 0]))

    # --- joints -----------------------------------------------------------------------------------------------------

    def _joint(self, number: int, joint: JointSpec, is_held: bool) -> None:
        name, kind = self.m.joints[number], joint["kind"]
        first, second = (self.spec["points"][joint[end]] for end in ENDS)
        height = LAYER * self.radius * number
        if kind in ("revolute", "fixed"):
            play = self.plays.get(number)
            if play is None:
                self._connected(name, first, second)
            else:
                self._pin(name, play["disc"]["radius"], first, second, height)
            if is_held or kind == "fixed":
                self._locked(name, first["body"], second["body"])
        else:
            self._guide(name, number, height, is_held)

    def _pin(self, name: str, clearance: float, first: PointSpec, second: PointSpec, height: float) -> None:
        """A capsule on the first body in a ring of boxes on the second."""
        at = _text([*first["at"][:2], height])
        size = _text([self.radius, self.radius])
        self._geom(first["body"], "pin", name=f"{name}-pin", type="capsule", size=size, pos=at)
        hole = self.radius + clearance
        # Their ends overlap outside of the hole.
        half = [self.wall / 2, (hole + self.wall) * math.tan(math.pi / PIECES), self.radius]
        for k in range(PIECES):
            angle = 2 * math.pi * k / PIECES
            middle = np.array(second["at"][:2]) + _turned(angle, np.array([hole + self.wall / 2, 0.0]))
            self._box(second["body"], middle, angle, half, height)

    def _geom(self, body: int, kind: str, **attributes: str) -> None:
        SubElement(self._on(body), "geom", {"class": kind, **attributes})

    def _box(self, body: int, middle: Floats, angle: float, half: list[float], height: float) -> None:
        pos, turn = _text([*middle, height]), _text([0, 0, angle])
        self._geom(body, "hole", type="box", size=_text(half), pos=pos, euler=turn)

    def _connected(self, name: str, first: PointSpec, second: PointSpec) -> None:
        """A pin without clearance."""
        for point, end in ((first, "first"), (second, "second")):
            self._site(point["body"], f"{name}-{end}", point["at"])
        SubElement(self.equality, "connect", name=name, site1=f"{name}-first", site2=f"{name}-second")

    def _locked(self, name: str, first: int, second: int) -> None:
        """Two bodies that keep the angle between them, by the angles that they have turned since the start."""
        turned = [f"{self.m.bodies[body]}-angle" for body in (second, first) if body >= 0]
        joints = {f"joint{k}": joint for k, joint in enumerate(turned, 1)}
        law = "0 1 0 0 0" if len(turned) > 1 else "0 0 0 0 0"
        SubElement(self.equality, "joint", {"name": f"{name}-angle", "polycoef": law, **joints})

    def _guide(self, name: str, number: int, height: float, is_held: bool) -> None:
        """Boxes along the axis on the first body, balls on the second; where it is driven, boxes ahead and behind."""
        joint = self.spec["joints"][number]
        first, second = (self.spec["points"][joint[end]] for end in ENDS)
        gap, half = 0.0, 0.25 * self.size
        for sizes in self.plays.get(number, {}).values():
            gap, half = sizes.get("gap", sizes.get("high", 0.0)), sizes.get("half_length", half)
        axis, at = np.array(joint["axis_first"][:2]), np.array(first["at"][:2])
        turn = math.atan2(axis[1], axis[0])
        travel = axis @ (self._in_axes_of(first["body"], second) - at)
        middle = at + travel * axis
        wide = [half + 2 * self.size, self.wall / 2, self.radius]
        for side in (1.0, -1.0):
            across = _turned(turn, np.array([0.0, side * (self.radius + gap + self.wall / 2)]))
            self._box(first["body"], middle + across, turn, wide, height)
        own = np.array(joint["axis_second"][:2])
        ends = [0.0] if joint["kind"] == "pin_in_slot" else [half, -half]
        if is_held:
            ends = list(dict.fromkeys([*ends, 0.0]))
            for side in (1.0, -1.0):
                ahead = middle + side * (self.radius + self.wall / 2) * axis
                self._box(first["body"], ahead, turn, [self.wall / 2, 0.5 * self.radius, self.radius], height)
        for k, end in enumerate(ends):
            pos = _text([*(np.array(second["at"][:2]) + end * own), height])
            self._geom(second["body"], "pin", name=f"{name}-slider{k}", type="sphere", size=_text(self.radius), pos=pos)

    def _in_axes_of(self, body: int, point: PointSpec) -> Floats:
        """A point in the nominal pose, in the axes of a body."""
        x, y, angle = self.poses[point["body"]] if point["body"] >= 0 else (0.0, 0.0, 0.0)
        there = np.array([x, y]) + _turned(angle, np.array(point["at"][:2]))
        x, y, angle = self.poses[body] if body >= 0 else (0.0, 0.0, 0.0)
        return _turned(-angle, there - np.array([x, y]))

    # --- forces -----------------------------------------------------------------------------------------------------

    def _springs(self) -> None:
        tendons = SubElement(self.root, "tendon")
        for k, spring in enumerate(self.spec["springs"]):
            length = spring["free_length"] - spring["preload"] / spring["stiffness"]
            if length < 0:
                raise InputError(f"spring {k + 1} has more preload than its free length gives", file=self.m.file)
            tendon = SubElement(
                tendons, "spatial", name=f"spring{k}", stiffness=_text(spring["stiffness"]), springlength=_text(length)
            )
            for end in ENDS:
                point = self.spec["points"][spring[end]]
                self._site(point["body"], f"spring{k}-{end}", point["at"])
                SubElement(tendon, "site", site=f"spring{k}-{end}")

    def _loads_on_sites(self) -> None:
        """Loads as actuators that always act: a constant bias, in axes of the ground or of a body."""
        actuators = SubElement(self.root, "actuator")
        for k, load in enumerate(self._loads()):
            point = self.spec["points"][load["point"]]
            self._site(point["body"], f"load{k}", point["at"])
            gear = _text([*load["force"][:2], 0, 0, 0, load["moment"][2]])
            axes = load.get("axes", -1)
            more = {} if axes == point["body"] else {"refsite": "ground"}
            if axes not in (-1, point["body"]):
                raise InputError(f"load {k} is in the axes of a third body", file=self.m.file, key=f"loads.{k}.axes")
            SubElement(
                actuators,
                "general",
                {"name": f"load{k}", "site": f"load{k}", "gear": gear, **more},
                gaintype="fixed",
                gainprm="0",
                biastype="affine",
                biasprm="1 0 0",
            )
