"""The slider-crank for which independent programs have reference values, of speed, friction and wear."""

from collections.abc import Mapping

TEXT = """
format = 1
space = "planar"
units = {{ length = "mm", angle = "deg", force = "N"{units} }}
{head}
[joints.shaft]
type = "revolute"
on = {{ ground = [0, 0], crank = [0, 0] }}
clearance = {{ radial = 0.02 }}
{shaft}
[joints.pin]
type = "revolute"
on = {{ crank = [40, 0], rod = [0, 0] }}
clearance = {{ radial = 0.02 }}
{pin}
[joints.wrist]
type = "revolute"
on = {{ rod = [120, 0], ram = [0, 0] }}
clearance = {{ radial = 0.02 }}
{wrist}
[joints.guide]
type = "prismatic"
on = {{ ground = {{ at = [0, -10], axis = [1, 0] }}, ram = [0, 0] }}
clearance = {{ gap = 0.03, length = 60 }}
{guide}
[start]
crank = {{ angle = 30 }}
rod = {{ angle = -12 }}
[drives.{drive}]
joint = "shaft"
values = [30, 75, 120]
{driven}
[output]
body = "ram"
at = [50, -20]
[[loads]]
force = [-200, 30]
"""
ON_ROD = """[[loads]]
body = "rod"
at = [60, 0]
force = [0, -80]
"""


def slider_crank(
    joints: Mapping[str, str] | None = None,
    *,
    drive: str = "theta",
    driven: str = "",
    units: str = "",
    head: str = "",
    on_rod: bool = True,
    more: str = "",
) -> str:
    """Its file, with further lines of its joints, of its drive, units, before its tables, and at its end."""
    own = dict.fromkeys(("shaft", "pin", "wrist", "guide"), "") | dict(joints or {})
    text = TEXT.format(drive=drive, driven=driven, units=units, head=head, **own)
    return text + (ON_ROD if on_rod else "") + more
