"""Mechanisms with couplings for tests, written as the core takes them."""

import json

import numpy as np

from jointplay import _core

GROUND = -1
#: outcomes by their code
OK, NOT_ASSEMBLED, SINGULAR, UNDERCONSTRAINED, UNDETERMINED, STRAINED, NOT_ASSEMBLABLE = range(7)


class Machine:
    """A mechanism that is put together joint by joint; lengths in metres, angles in radians."""

    def __init__(self, space="planar", length=0.1):
        self.space, self.length = space, length
        self.guess, self.points, self.joints, self.drives, self.loads, self.sources = [], [], [], [], [], []
        self.displacements = []
        self.output_point = None

    def body(self, *pose):
        """A body at a pose: x, y, angle or x, y, z (and a quaternion)."""
        if self.space == "spatial":
            pose = (*pose, 1.0, 0.0, 0.0, 0.0)[:7] if len(pose) == 3 else pose
        self.guess.append([float(x) for x in (*pose, 0.0)[:3]] if self.space == "planar" else list(map(float, pose)))
        return len(self.guess) - 1

    def point(self, body, at=(0.0, 0.0)):
        self.points.append({"body": body, "at": [float(x) for x in (*at, 0.0)[:3]]})
        return len(self.points) - 1

    def joint(self, kind, first, second, axis=None, side=None, compliance=None, **coupling):
        """A joint between two (body, place in it); axis and side are the same in both bodies."""
        axis = axis or ((1.0, 0.0, 0.0) if self.space == "planar" else (0.0, 0.0, 1.0))
        side = side or (1.0, 0.0, 0.0)
        told = {"kind": kind, "first": self.point(*first), "second": self.point(*second)}
        told |= {"axis_first": axis, "axis_second": axis, "side_first": side, "side_second": side}
        if coupling:
            told["coupling"] = coupling
        if compliance is not None:
            told["compliance"] = compliance
        self.joints.append(told)
        return len(self.joints) - 1

    def drive(self, joint, component=None, coefficient=1.0, also=()):
        named = {} if component is None else {"component": component}
        also = [{"joint": j, "coefficient": c} for j, c in also]
        self.drives.append({"joint": joint, **named, "coefficient": coefficient, "also": also})
        return len(self.drives) - 1

    def load(self, body, at=(0.0, 0.0), force=(0.0, 0.0), moment=0.0):
        moment = moment if isinstance(moment, tuple) else (0.0, 0.0, moment)
        self.loads.append({"point": self.point(body, at), "force": [*force, 0.0][:3], "moment": list(moment)})

    def source(self, kind, bounds, centre=None, law="uniform", **target):
        """What can be off: `bounds` is a half-width, two bounds, or a set; gives the number of its first parameter."""
        if isinstance(bounds, (int, float)):
            bounds = (-bounds, bounds)
        if isinstance(bounds, tuple):
            bounds = {"interval": {"low": bounds[0], "high": bounds[1]}}
        sizes = {"interval": 1, "disc": 2, "diamond": 2, "ball": 3, "plate": 3, "sleeve": 4, "journal": 5, "guide": 5}
        centre = centre if centre is not None else [0.0] * sizes[next(iter(bounds))]
        first = sum(len(s["centre"]) for s in self.sources)
        self.sources.append({"kind": kind, "set": bounds, "centre": centre, "law": law, **target})
        return first

    def runout(self, joint, radius, second):
        """A wheel whose centre is off its place, in its plane; axis, side and normal are the same in both bodies."""
        end = "second" if second else "first"
        wheel, axis, side = (self.joints[joint][f"{of}{end}"] for of in ("", "axis_", "side_"))
        self.displacements.append({"points": [wheel], "about": self.points[wheel]["at"]})
        planar = self.space == "planar"
        plane = [axis, np.cross([0.0, 0.0, 1.0], axis)] if planar else [side, np.cross(axis, side)]
        told = {"displacement": len(self.displacements) - 1, "components": ["x", "y"] if planar else ["side", "normal"]}
        ways = [[[float(v) for v in way], [0.0] * 3] for way in plane]
        return self.source("place", {"disc": {"radius": radius}}, ways=ways, **told)

    def output(self, body, at=(0.0, 0.0)):
        self.output_point = self.point(body, at)

    def spec(self):
        """As the core reads it."""
        return {
            "space": self.space,
            "n_bodies": len(self.guess),
            "guess": self.guess,
            "length": self.length,
            "singular_value": 1e-9,
            "points": self.points,
            "joints": self.joints,
            "drives": self.drives,
            "output": {"point": self.output_point},
            "loads": self.loads,
            "displacements": self.displacements,
            "sources": self.sources,
        }

    def core(self):
        return _core.Mechanism(json.dumps(self.spec()))


def pair(teeth=(20, 40), module=1e-3, internal=False, apart=1.0, angle=0.0, pressure=20.0, torque=0.0, **more):
    """Two gears on fixed bearings, the first driven, the second loaded by a torque; its turn is the output."""
    r1, r2 = (module * z / 2 for z in teeth)
    distance = apart * (r2 - r1 if internal else r1 + r2)
    # A ring's centre lies on the other side of the tooth contact.
    at = (distance * np.cos(angle), distance * np.sin(angle))
    m = Machine(length=distance)
    m.body(0.0, 0.0)
    m.body(*at)
    m.joint("revolute", (GROUND, (0.0, 0.0)), (0,))
    m.joint("revolute", (GROUND, at), (1,))
    told = {
        "radii": [r1, r2],
        "teeth": list(teeth),
        "pressure_angle": float(np.radians(pressure)),
        "internal": internal,
    }
    m.joint("gear", (0,), (1,), **told, **more)
    m.drive(0)
    if torque:
        m.load(1, moment=torque)
    m.output(1)
    return m


def planetary(teeth=(20, 16, 52), planets=3, torque=0.0, plays=(), floating=0.0):
    """A planetary gear, the sun driven and the ring fixed; play in the meshes with the sun and in its bearing."""
    sun_teeth, planet_teeth, ring_teeth = teeth
    sun_radius, planet_radius, ring_radius = (0.0005 * z for z in teeth)
    arm_radius = sun_radius + planet_radius
    assert ring_teeth == sun_teeth + 2 * planet_teeth
    m = Machine(length=arm_radius)
    sun, arm = m.body(0, 0), m.body(0, 0)
    bearing = m.joint("revolute", (GROUND,), (sun,))
    m.joint("revolute", (GROUND,), (arm,))
    meshes = []
    for k in range(planets):
        at = (arm_radius * np.cos(2 * np.pi * k / planets), arm_radius * np.sin(2 * np.pi * k / planets))
        planet = m.body(*at)
        m.joint("revolute", (arm, at), (planet,))
        told = {"radii": [sun_radius, planet_radius], "teeth": [sun_teeth, planet_teeth]}
        meshes.append(m.joint("gear", (sun,), (planet,), pressure_angle=float(np.radians(20.0)), **told))
        told = {"radii": [planet_radius, ring_radius], "teeth": [planet_teeth, ring_teeth], "internal": True}
        m.joint("gear", (planet,), (GROUND,), pressure_angle=float(np.radians(20.0)), **told)
    m.drive(bearing)
    m.output(arm)
    if torque:
        m.load(arm, moment=torque)
    for mesh, play in zip(meshes, plays, strict=False):
        m.source("clearance", play, joint=mesh)
    if floating:
        m.source("clearance", {"disc": {"radius": floating}}, joint=bearing)
    return m
