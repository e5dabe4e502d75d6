"""The slider-crank for which independent programs have reference values, of speed, friction and wear."""

from collections.abc import Mapping
from typing import Any

import jointplay as jp
from helpers.builders import planar


def slider_crank(
    joints: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    drive: str = "theta",
    driven: Mapping[str, Any] | None = None,
    on_rod: bool = True,
    **head: Any,
) -> jp.Builder:
    """It, with further keys of its joints, of its drive and of the whole, and a second load on its rod or without."""
    more: dict[str, Any] = {name: {} for name in ("shaft", "pin", "wrist", "guide")} | dict(joints or {})
    b = planar(**head)
    b.revolute("shaft", ground=(0, 0), crank=(0, 0), clearance=jp.radial(0.02), **more["shaft"])
    b.revolute("pin", crank=(40, 0), rod=(0, 0), clearance=jp.radial(0.02), **more["pin"])
    b.revolute("wrist", rod=(120, 0), ram=(0, 0), clearance=jp.radial(0.02), **more["wrist"])
    line, gap = {"at": [0, -10], "axis": [1, 0]}, jp.gap(0.03, length=60)
    b.prismatic("guide", ground=line, ram=(0, 0), clearance=gap, **more["guide"])
    b.start("crank", angle=30)
    b.start("rod", angle=-12)
    b.drive(drive, joint="shaft", values=[30, 75, 120], **(driven or {}))
    b.output(body="ram", at=(50, -20))
    b.load(force=(-200, 30))
    if on_rod:
        b.load(body="rod", at=(60, 0), force=(0, -80))
    return b
