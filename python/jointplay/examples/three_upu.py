"""The 3-UPU robot: a platform on three telescopic legs with a universal joint at each end."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.file.toml import number, numbers

from .template import Template, around

#: where the legs are, in degrees
LEGS = (0.0, 120.0, 240.0)


@dataclass(frozen=True)
class ThreeUpu(Template):
    """Sizes of a 3-UPU robot."""

    name: ClassVar[str] = "3-upu"
    words: ClassVar[Mapping[str, tuple[str, ...]]] = {"layout": ("tsai", "snu")}

    base_radius: float = 300
    platform_radius: float = 150
    height: float = 400
    layout: str = "tsai"
    radial: float = 0.01
    axial: float = 0.02
    pin_length: float = 40
    gap: float = 0.01
    guide_length: float = 80
    guide_width: float = 30

    def text(self) -> str:
        """The file."""
        away = (self.base_radius / 6, -self.base_radius / 10)
        # On its axis the SNU layout is singular: a drawing there would leave open how the platform turns from it.
        ends = [(0.0, 0.0), away] if self.layout == "tsai" else [away, (away[0] / 2, away[1] / 2)]
        centre = np.array([*ends[0], self.height])
        legs = "\n".join(self._leg(k + 1, angle, centre) for k, angle in enumerate(LEGS))
        lies = "along the circle through the joints" if self.layout == "tsai" else "towards the middle of the base"
        layout = {"tsai": "Tsai", "snu": "SNU"}[self.layout]
        return f"""\
# A platform on three telescopic legs with a universal joint at each end. It moves without turning as long as nothing
# is off; play lets it turn.
#
{self.command()}
#
# writes this file. All bodies are described as they are drawn: assembled, the middle of the platform at
# {numbers(centre)}, their axes along those of the ground. The pin in the base, and the parallel one in the platform,
# lies {lies} ({layout} layout).
#
# The coordinate of a leg is the distance between the centres of its two universal joints, because these are the points
# of its prismatic joint. The clearance of the guide is measured at the upper one. Where the guide itself sits along the
# leg makes no difference to first order: the leg carries a force along its line and a couple, no force across it.

format = 1
title  = "3-UPU translational parallel robot, {layout} layout"
space  = "spatial"
units  = {{ length = "mm", angle = "deg", force = "N" }}

{legs}
# The drives follow the output: leg lengths are solved for these positions.
[path]
x = {numbers(x for x, _ in ends)}
y = {numbers(y for _, y in ends)}
z = {numbers([self.height, self.height])}

[drives.l1]
joint = "leg1"

[drives.l2]
joint = "leg2"

[drives.l3]
joint = "leg3"

[output]
body = "platform"
at   = {numbers(centre)}

[[loads]]
force  = [0, 0, -100]
moment = [0, 0, 0]            # N mm: force times length

[limits]
position = 6                  # acceptable at the output
"""

    def _leg(self, k: int, angle: float, centre: Floats) -> str:
        outwards, tangent = around(angle)
        bottom = self.base_radius * outwards
        top = self.platform_radius * outwards + centre
        along = top - bottom
        first = tangent if self.layout == "tsai" else outwards
        second = np.cross(first, along) / np.linalg.norm(np.cross(first, along))
        pins = f"{{ radial = {self.radial}, axial = {self.axial}, length = {self.pin_length} }}"
        guide = f"{{ gap = {self.gap}, length = {self.guide_length}, width = {self.guide_width} }}"
        frame = f"axis = {numbers(along)}, side = {numbers(second)}"
        return f"""\
# Leg {k}, at {number(angle)} degrees. The sides of its guide face along the second pins and across them.

[joints.base{k}]
type   = "universal"
bodies = ["ground", "lower{k}"]
at     = {numbers(bottom)}
axes   = [{numbers(first)}, {numbers(second)}]
clearance = {pins}

[joints.leg{k}]
type = "prismatic"
clearance = {guide}

[joints.leg{k}.on]
lower{k} = {{ at = {numbers(bottom)}, {frame} }}
upper{k} = {{ at = {numbers(top)}, {frame} }}

[joints.top{k}]
type   = "universal"
bodies = ["upper{k}", "platform"]
at     = {numbers(top)}
axes   = [{numbers(second)}, {numbers(first)}]
clearance = {pins}
"""
