"""Machines that rub and wear, whose forces and lives have closed forms or are known from an independent program."""

import math
from collections.abc import Mapping
from typing import Any

import jointplay as jp
from helpers.builders import planar, spatial

#: of a four-bar from a paper: crank angle, rotation of the rocker forward and backward, holes on the second bodies and
#: on the first
PAPER = {
    22.70: ((-1.143475, -1.208384), (-1.221339, -1.134377)),
    48.98: ((-1.075795, -1.142138), (-1.153917, -1.068246)),
    76.39: ((-1.045593, -1.112965), (-1.124198, -1.039453)),
}


def four_bar(*, holes: str) -> jp.Mechanism:
    """The bundled four-bar with friction, its bodies exchanged where the holes are on the first ones."""
    m = jp.loads(jp.examples.text("four-bar"))
    sign = 1.0 if holes == "second" else -1.0
    changes = {"drives.theta1.values": [sign * angle for angle in PAPER], "drives.theta1.error": None}
    for name, joint in m.raw["joints"].items():
        bodies = list(joint["on"].items())
        changes[f"joints.{name}.on"] = dict(bodies[:: int(sign)])
        changes[f"joints.{name}.friction"] = {"coefficient": 0.1, "diameter": 20}
    return m.with_(changes)


def lever(radial: float, mu: float, torque: float) -> jp.Mechanism:
    b = planar()
    b.revolute(
        "pin",
        ground=(0, 0),
        lever=(0, 0),
        clearance=jp.radial(radial),
        friction={"coefficient": mu, "diameter": 40, "torque": torque},
    )
    b.drive("q", joint="pin", values=[0])
    b.output(body="lever", at=(100, 0))
    b.load(force=(0, -50))
    return b.mechanism()


def drawer(mu: float, *, push: float, load: float) -> jp.Mechanism:
    """A drawer that is pushed and loaded beside its guide."""
    b = planar()
    b.prismatic(
        "guide",
        ground={"at": [0, 0], "axis": [1, 0]},
        drawer=(0, 0),
        clearance=jp.gap(1e-7, length=80),
        friction={"coefficient": mu, "height": 30},
    )
    b.prismatic("rail", ground={"at": [0, push], "axis": [1, 0]}, hand=(0, 0))
    b.pin_in_slot("grip", hand={"at": [0, 0], "axis": [0, 1]}, drawer=(0, push))
    b.drive("q", joint="rail", values=[10, 20])
    b.output(body="drawer")
    b.load(at=(0, load), force=(-10, 0))
    return b.mechanism()


def wedge(slope: float, mu: float) -> jp.Mechanism:
    """A wedge that lifts a block by a slope in degrees, the same friction on its three faces."""
    angle = math.radians(slope)
    rubs = {"coefficient": mu, "length": 400}
    b = planar()
    b.prismatic("bed", ground={"at": [0, 0], "axis": [1, 0]}, wedge=(0, 0), friction=rubs)
    face = {"at": [0, 10], "axis": [math.cos(angle), math.sin(angle)]}
    b.pin_in_slot("face", wedge=face, block=(0, 0), friction=mu)
    b.prismatic("post", ground={"at": [0, 10], "axis": [0, 1]}, block={"at": [0, 0], "axis": [0, 1]}, friction=rubs)
    b.drive("q", joint="bed", values=[1])
    b.output(body="block")
    b.load(force=(0, -100))
    return b.mechanism()


def wheels(mesh: Mapping[str, Any], *, apart: float, torque: float = 700.0) -> jp.Mechanism:
    """Two wheels on fixed pins, the first driven, the second loaded."""
    b = planar()
    b.revolute("a", ground=(0, 0), wheel_a=(0, 0))
    b.revolute("b", ground=(apart, 0), wheel_b=(0, 0))
    kind = b.belt if "radii" in mesh else b.gear
    kind("m", wheel_a=(0, 0), wheel_b=(0, 0), **mesh)
    b.drive("q", joint="a", values=[20])
    b.output(body="wheel_b")
    b.load(moment=torque)
    return b.mechanism()


GEAR: dict[str, Any] = {"teeth": [20, 50], "module": 2}
PAIRS: dict[str, tuple[dict[str, Any], float, float]] = {
    "gear": (GEAR, 70.0, -0.4),
    "ring": (GEAR | {"internal": True}, 30.0, 0.4),
    "nearly as large": ({"teeth": [49, 50], "module": 2, "internal": True}, 1.0, 0.98),
    "belt": ({"radii": [20, 20]}, 100.0, 1.0),
    "crossed belt": ({"radii": [10, 25], "crossed": True}, 100.0, -0.4),
}


def planetary(efficiency: float) -> jp.Mechanism:
    b = planar()
    b.revolute("a", ground=(0, 0), sun=(0, 0))
    b.revolute("b", ground=(0, 0), arm=(0, 0))
    b.revolute("c", arm=(18, 0), planet=(0, 0))
    b.gear("inner", sun=(0, 0), planet=(0, 0), teeth=[20, 16], module=1, efficiency=efficiency)
    b.gear("outer", planet=(0, 0), ground=(0, 0), teeth=[16, 52], module=1, internal=True, efficiency=efficiency)
    b.start("planet", x=18)
    b.drive("q", joint="a", values=[0])
    b.output(body="arm")
    b.load(moment=-1000)
    return b.mechanism()


def screw(lead: float, force: float, **more: Any) -> jp.Mechanism:
    b = spatial()
    place = {"at": [0, 0, 0], "axis": [0, 0, 1], "side": [1, 0, 0]}
    b.screw("turns", ground=place, screw=place, lead=lead, **more)
    b.drive("q", joint="turns", values=[0])
    b.output(body="screw")
    b.load(force=(0, 0, force))
    return b.mechanism()


def _bush() -> jp.Mechanism:
    b = planar()
    wear = {"rate": 1e-4, "length": 20, "diameter": 30}
    b.revolute("J", ground=(0, 0), shaft=(0, 0), clearance=jp.radial(0.02), wear=wear)
    b.drive("q", joint="J", from_=0, to=360, count=73)
    b.output(body="shaft", at=(50, 0))
    b.load(at=(0, 0), force=(0, -100))
    return b.mechanism()


#: a shaft that a force which stands still presses down in its bush, and that turns once
BUSH = _bush()
TURN = {"drives.theta": {"joint": "shaft", "from": 0.25, "to": 359.75, "count": 720}}
WEAR = {
    "shaft": {"rate": 1e-5, "length": 20},
    "pin": {"rate": 1e-5, "length": 15},
    "wrist": {"rate": 1e-5, "length": 12},
    "guide": {"rate": 1e-5, "width": 25},
}
#: nm per turn; and after 112,503.57 turns with these rates the limit of 0.2 mm is reached at 30 deg, with these sizes
GROWTH = {"shaft": 0.325414555, "pin": 0.433886073, "wrist": 0.120562300, "guide": 0.093354173}
LIFE, SIZES = 112503.57, [0.0566103, 0.0688137, 0.0335637, 0.0405027]
