"""Arms of which a test says what scatters, or where they are."""

import jointplay as jp
from helpers.builders import planar


def _arm() -> jp.Mechanism:
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0), clearance=jp.radial(0.0))
    b.prismatic("guide", arm={"at": [0, 0], "axis": [1, 0]}, rod=(0, 0))
    b.drive("angle", joint="pivot", values=[0])
    b.drive("reach", joint="guide", values=[100])
    b.output(body="rod", at=(50, 0))
    b.dimension("size", body="rod", between=["guide", "output"], tolerance={"sigma": 0.01})
    return b.mechanism()


#: clearance of its pivot, length and drive errors move the output one to one; the length alone scatters, normally
ARM = _arm()
#: with play in its pivot
PLAYED = ARM.with_({"joints.pivot.clearance.radial": 0.1})


def _pushed() -> jp.Mechanism:
    b = planar()
    b.revolute("J", ground=(0, 0), arm=(0, 0), clearance=jp.radial(0.01))
    b.drive("q", joint="J", values=(0, 1))
    b.output(body="arm", at=(100, 0))
    b.load("push", force=(10, 0))
    b.load("pull", force=(-10, 0))
    return b.mechanism()


#: with play in its pivot; loads press it to either side
PUSHED = _pushed()


def leg(hip: float, knee: float) -> jp.Builder:
    """Thigh and calf of 213 mm with weights, and with backlash of both drives, at their angles."""
    b = planar(gravity=(0, -9.81))
    b.revolute("hip", ground=(0, 0), thigh=(0, 0))
    b.revolute("knee", thigh=(213, 0), calf=(0, 0))
    b.body("thigh", mass=0.5, centre=(100, 0))
    b.body("calf", mass=0.2, centre=(100, 0))
    b.drive("q1", joint="hip", values=[hip], backlash=1)
    b.drive("q2", joint="knee", values=[knee], backlash=2)
    b.output(body="calf", at=(213, 0))
    return b
