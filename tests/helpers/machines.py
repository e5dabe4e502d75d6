"""Machines that rub and wear, whose forces and lives have closed forms or are known from an independent program."""

import math

import jointplay as jp

PLANE = 'format = 1\nspace = "planar"\nunits = { length = "mm", angle = "deg", force = "N" }\n'

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


LEVER = """
format = 1
space = "planar"
units = {{ length = "mm", angle = "deg", force = "N" }}
[joints.pin]
type = "revolute"
on = {{ ground = [0, 0], lever = [0, 0] }}
clearance = {{ radial = {radial} }}
friction = {{ coefficient = {mu}, diameter = 40, torque = {torque} }}
[drives.q]
joint = "pin"
values = [0]
[output]
body = "lever"
at = [100, 0]
[[loads]]
force = [0, -50]
"""


DRAWER = """
format = 1
space = "planar"
units = {{ length = "mm", angle = "deg", force = "N" }}
[joints.guide]
type = "prismatic"
on = {{ ground = {{ at = [0, 0], axis = [1, 0] }}, drawer = [0, 0] }}
clearance = {{ gap = 1e-7, length = 80 }}
friction = {{ coefficient = {mu}, height = 30 }}
[joints.rail]
type = "prismatic"
on = {{ ground = {{ at = [0, {push}], axis = [1, 0] }}, hand = [0, 0] }}
[joints.grip]
type = "pin_in_slot"
on = {{ hand = {{ at = [0, 0], axis = [0, 1] }}, drawer = [0, {push}] }}
[drives.q]
joint = "rail"
values = [10, 20]
[output]
body = "drawer"
[[loads]]
at = [0, {load}]
force = [-10, 0]
"""


WEDGE = """
format = 1
space = "planar"
units = {{ length = "mm", angle = "deg", force = "N" }}
[joints.bed]
type = "prismatic"
on = {{ ground = {{ at = [0, 0], axis = [1, 0] }}, wedge = [0, 0] }}
friction = {{ coefficient = {mu}, length = 400 }}
[joints.face]
type = "pin_in_slot"
on = {{ wedge = {{ at = [0, 10], axis = [{cosine}, {sine}] }}, block = [0, 0] }}
friction = {mu}
[joints.post]
type = "prismatic"
on = {{ ground = {{ at = [0, 10], axis = [0, 1] }}, block = {{ at = [0, 0], axis = [0, 1] }} }}
friction = {{ coefficient = {mu}, length = 400 }}
[drives.q]
joint = "bed"
values = [1]
[output]
body = "block"
[[loads]]
force = [0, -100]
"""


def wedge(slope: float, mu: float) -> str:
    """A wedge that lifts a block by a slope in degrees, the same friction on its three faces."""
    angle = math.radians(slope)
    return WEDGE.format(mu=mu, cosine=math.cos(angle), sine=math.sin(angle))


UNITS = 'format = 1\nspace = "{}"\nunits = {{ length = "mm", angle = "deg", force = "N" }}\n'


def wheels(mesh: str, *, apart: float, torque: float = 700.0) -> str:
    """Two wheels on fixed pins, the first driven, the second loaded."""
    text = UNITS.format("planar")
    for name, x in (("a", 0.0), ("b", apart)):
        text += f'[joints.{name}]\ntype = "revolute"\non = {{ ground = [{x}, 0], wheel_{name} = [0, 0] }}\n'
    text += f"[joints.m]\non = {{ wheel_a = [0, 0], wheel_b = [0, 0] }}\n{mesh}\n"
    text += f'[drives.q]\njoint = "a"\nvalues = [20]\n[output]\nbody = "wheel_b"\n[[loads]]\nmoment = {torque}\n'
    return text


GEAR = 'type = "gear"\nteeth = [20, 50]\nmodule = 2'
PAIRS = {
    "gear": (GEAR, 70.0, -0.4),
    "ring": (GEAR + "\ninternal = true", 30.0, 0.4),
    "nearly as large": ('type = "gear"\nteeth = [49, 50]\nmodule = 2\ninternal = true', 1.0, 0.98),
    "belt": ('type = "belt"\nradii = [20, 20]', 100.0, 1.0),
    "crossed belt": ('type = "belt"\nradii = [10, 25]\ncrossed = true', 100.0, -0.4),
}


def planetary(efficiency: float) -> str:
    text = UNITS.format("planar")
    text += '[joints.a]\ntype = "revolute"\non = { ground = [0, 0], sun = [0, 0] }\n'
    text += '[joints.b]\ntype = "revolute"\non = { ground = [0, 0], arm = [0, 0] }\n'
    text += '[joints.c]\ntype = "revolute"\non = { arm = [18, 0], planet = [0, 0] }\n'
    text += '[joints.inner]\ntype = "gear"\non = { sun = [0, 0], planet = [0, 0] }\nteeth = [20, 16]\nmodule = 1\n'
    text += f"efficiency = {efficiency}\n"
    text += '[joints.outer]\ntype = "gear"\non = { planet = [0, 0], ground = [0, 0] }\nteeth = [16, 52]\nmodule = 1\n'
    text += f"internal = true\nefficiency = {efficiency}\n"
    text += '[start]\nplanet = { x = 18 }\n[drives.q]\njoint = "a"\nvalues = [0]\n[output]\nbody = "arm"\n'
    return text + "[[loads]]\nmoment = -1000\n"


SCREW = """
[joints.turns]
type = "screw"
lead = {lead}
{more}
[joints.turns.on]
ground = {{ at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }}
screw = {{ at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }}
[drives.q]
joint = "turns"
values = [0]
[output]
body = "screw"
[[loads]]
force = [0, 0, {force}]
"""


def screw(lead: float, force: float, more: str) -> jp.Mechanism:
    return jp.loads(UNITS.format("spatial") + SCREW.format(lead=lead, force=force, more=more))


#: a shaft that a force which stands still presses down in its bush, and that turns once
BUSH = f"""{PLANE}
[joints.J]
type = "revolute"
on = {{ ground = [0, 0], shaft = [0, 0] }}
clearance = {{ radial = 0.02 }}
wear = {{ rate = 1e-4, length = 20, diameter = 30 }}
[drives.q]
joint = "J"
from = 0
to = 360
count = 73
[output]
body = "shaft"
at = [50, 0]
[[loads]]
at = [0, 0]
force = [0, -100]
"""
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
