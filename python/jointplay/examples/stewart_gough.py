"""The Stewart-Gough platform: six telescopic legs, each with a universal joint below and a ball above."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointplay.file.toml import number, numbers

from .template import Template, around

#: where pairs of neighbouring legs meet, in degrees: on the base, and between them on the platform
BASE_PAIRS = (0.0, 120.0, 240.0)
PLATFORM_PAIRS = (60.0, 180.0, 300.0)
LEGS = range(6)


@dataclass(frozen=True)
class StewartGough(Template):
    """Sizes of a Stewart-Gough platform."""

    name: ClassVar[str] = "stewart-gough"

    base_radius: float = 300
    platform_radius: float = 200
    base_spread: float = 30
    platform_spread: float = 30
    height: float = 400
    radial: float = 0.01
    axial: float = 0.02
    pin_length: float = 40
    ball_radial: float = 0.01
    gap: float = 0.01
    guide_length: float = 80
    guide_width: float = 30

    may_vanish: ClassVar[tuple[str, ...]] = ("radial", "axial", "gap", "ball_radial")

    def text(self) -> str:
        """The file."""
        for key in ("base_spread", "platform_spread"):
            if getattr(self, key) >= 120:
                raise self.refuse(
                    key, f"the pairs are 120 deg apart; less than that is needed, not {getattr(self, key)}"
                )
        legs = "\n".join(self._leg(k) for k in LEGS)
        drives = "\n\n".join(f'[drives.l{k + 1}]\njoint = "leg{k + 1}"' for k in LEGS)
        rise, aside = self.height, self.platform_radius / 10
        return f"""\
# A platform on six telescopic legs, each of them driven: it takes any position and any attitude. Every leg has a
# universal joint on the base, a prismatic joint, and a ball on the platform (6-UPS), so that nothing is held twice.
#
{self.command()}
#
# writes this file. All bodies are described as they are drawn: assembled, with the platform {number(self.height)} mm
# above the base, their axes along those of the ground. Legs stand in pairs: two neighbours are base_spread degrees
# apart on the base; on the platform, each meets its other neighbour, platform_spread degrees apart.
#
# The coordinate of a leg is the distance between the centres of its universal joint and its ball.

format = 1
title  = "Stewart-Gough platform, 6-UPS"
space  = "spatial"
units  = {{ length = "mm", angle = "deg", force = "N" }}

{legs}
# The drives follow the output: leg lengths are solved for these poses. The attitude is a rotation vector in degrees.
[path]
x  = {numbers([0, aside, aside, 0])}
y  = {numbers([0, 0, aside, 0])}
z  = {numbers([rise, rise, rise + aside, rise + aside])}
rx = [0, 0, 5, 0]
ry = [0, 5, 0, 0]
rz = [0, 0, 0, 10]

{drives}

[output]
body = "platform"
at   = {numbers([0, 0, rise])}

[[loads]]
force  = [20, 10, -100]
moment = [500, 1000, 300]     # N mm: force times length
"""

    def _leg(self, k: int) -> str:
        # Legs 1 and 6 are a pair on the base, legs 1 and 2 one on the platform.
        side = 1 if k % 2 == 0 else -1
        foot, _ = around(BASE_PAIRS[(k + 1) // 2 % 3] + side * self.base_spread / 2)
        head, _ = around(PLATFORM_PAIRS[k // 2] - side * self.platform_spread / 2)
        bottom, top = self.base_radius * foot, self.platform_radius * head + [0, 0, self.height]
        along = top - bottom
        if math.hypot(along[0], along[1]) < 1e-6 * self.height:
            raise self.refuse(
                "platform_radius", "with these sizes a leg stands upright, and its lower pin has no direction"
            )
        first = np.cross([0, 0, 1], along)
        first /= np.linalg.norm(first)
        second = np.cross(first, along)
        second /= np.linalg.norm(second)
        n = k + 1
        frame = f"axis = {numbers(along)}, side = {numbers(first)}"
        return f"""\
# Leg {n}: its lower pin is level and across the leg.

[joints.base{n}]
type   = "universal"
bodies = ["ground", "lower{n}"]
at     = {numbers(bottom)}
axes   = [{numbers(first)}, {numbers(second)}]
clearance = {{ radial = {self.radial}, axial = {self.axial}, length = {self.pin_length} }}

[joints.leg{n}]
type = "prismatic"
clearance = {{ gap = {self.gap}, length = {self.guide_length}, width = {self.guide_width} }}

[joints.leg{n}.on]
lower{n} = {{ at = {numbers(bottom)}, {frame} }}
upper{n} = {{ at = {numbers(top)}, {frame} }}

[joints.ball{n}]
type   = "spherical"
bodies = ["upper{n}", "platform"]
at     = {numbers(top)}
clearance = {{ radial = {self.ball_radial} }}
"""
