"""An arm with a slider, of which a test says what scatters."""

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
