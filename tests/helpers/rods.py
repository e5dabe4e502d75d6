"""A rod between two balls: with a rocker, as the text of its file, and with a slider."""

import jointplay as jp

RSSR = """
format = 1
space  = "spatial"
units  = { length = "mm", angle = "deg", force = "N" }

[joints.crank]
type = "revolute"
on.ground = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }
on.crank  = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }

[joints.hook]
type = "spherical"
on   = { crank = [30, 0, 0], coupler = [0, 0, 0] }
clearance = { radial = 0.2 }

[joints.ball]
type = "spherical"
on   = { coupler = [176, 0, 0], rocker = [0, 0, 100] }
clearance = { radial = 0.1 }

[joints.rocker]
type = "revolute"
on.ground = { at = [130, 0, -60], axis = [1, 0, 0], side = [0, 0, 1] }
on.rocker = { at = [0, 0, 0], axis = [1, 0, 0], side = [0, 0, 1] }

[start]
rocker = { rotation = [20, 0, 0] }

[drives.theta]
joint = "crank"
from  = 0
to    = 330
count = 12

[output]
body = "rocker"
at   = "ball"

[[loads]]
force = [2, 5, -10]

[dimensions.coupler]
body = "coupler"
between = ["hook", "ball"]
tolerance = 0.05
"""


def rod_and_slider(drive: str, b: jp.Builder, **driven: object) -> jp.Builder:
    """A crank about z, a rod between two balls, a slider along x beside and below; mm, degrees and N."""
    b.revolute(
        "shaft",
        ground={"at": [0, 0, 0], "axis": [0, 0, 1]},
        crank={"at": [0, 0, 0], "axis": [0, 0, 1]},
        clearance=jp.radial(0.02, axial=0.03, length=30),
    )
    b.spherical("A", crank=(40, 0, 10), rod=(0, 0, 0), clearance=jp.radial(0.015))
    b.spherical("B", rod=(120, 0, 0), slider=(0, 0, 0), clearance=jp.radial(0.015))
    b.prismatic(
        "guide",
        ground={"at": [0, 15, -30], "axis": [1, 0, 0], "side": [0, 1, 0]},
        slider={"at": [0, 0, 0], "axis": [1, 0, 0], "side": [0, 1, 0]},
        clearance=jp.gap(0.03, length=60, width=30, height=20),
    )
    b.start("slider", x=150, y=15, z=-30)
    b.drive(drive, joint="shaft", values=[30, 75], **driven)
    b.output(body="slider", at=(50, -20, 10))
    b.load(force=(-200, 30, 40))
    return b
