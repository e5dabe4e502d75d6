"""Clearances as gaps between solids in MuJoCo: where a mechanism comes to rest under its load."""

from helpers.answers import example
from helpers.oracles.contact import Settling
from jointplay.exchange.contacts import to_mjcf

from .subject import OK, Check, Found, Subject

#: examples that come to rest within a minute; others have motions that the load hardly drives
RESTING = (
    *("four-bar", "slider-crank", "five-bar", "3-rrr", "six-bar", "serial-2r", "four-bar-fits", "press"),
    *("rssr", "stewart-gough", "delta-by-hand", "bennett"),
)
#: boxes of a ring: a corner is up to a quarter of a degree beside the load, a pin so 0.4 % of its clearance aside
PIECES = 720
#: what the output may still move, as a part of the smallest clearance
STILL = 1e-6


def smallest_clearance(s: Subject) -> float:
    """In metres."""
    shapes = [shape for x in s.spec["sources"] if x["kind"] == "clearance" for shape in x["set"].values()]
    sizes = [shape.get(gap, 0.0) for shape in shapes for gap in ("radius", "axial", "gap")]
    return min(size for size in sizes if size > 0)


def at_rest(s: Subject) -> Found:
    """Position of the output."""
    parts, m, play = [], example(s.name), smallest_clearance(s)
    axes = 2 if s.planar else 3
    for k in s.few:
        found = s.core.loaded(*s.one(k))
        if found["status"][0] == OK:
            rest = Settling(to_mjcf(m, k, PIECES), STILL * play).rest()
            parts.append(Found.of(found["error"][0, :axes], rest[:axes], play))
    return Found.all(parts)


CHECKS = [
    Check(
        "loaded pose",
        "MuJoCo, contacts",
        ("mujoco-core",),
        "of the smallest clearance",
        0.02,
        "corners of rings, and contacts extrapolated from three softnesses",
        lambda s: s.name in RESTING,
        at_rest,
    ),
]
