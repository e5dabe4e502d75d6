"""The Delta robot: three driven arms carry a platform by pairs of rods, which keep it from turning."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.file.toml import number, numbers

from .template import Template, around

#: where the arms are, in degrees
ARMS = (0.0, 120.0, 240.0)


@dataclass(frozen=True)
class Delta(Template):
    """Sizes of a Delta robot."""

    name: ClassVar[str] = "delta"

    base_radius: float = 150
    platform_radius: float = 50
    arm_length: float = 200
    rod_length: float = 450
    rod_spacing: float = 80
    height: float = 400
    radial: float = 0.01
    axial: float = 0.02
    shaft_length: float = 60
    pin_length: float = 15
    ball_radial: float = 0.01

    may_vanish: ClassVar[tuple[str, ...]] = ("radial", "axial", "ball_radial")

    def text(self) -> str:
        """The file."""
        arms = "\n".join(self._arm(k + 1, angle) for k, angle in enumerate(ARMS))
        drives = "\n\n".join(f'[drives.q{k + 1}]\njoint = "shaft{k + 1}"' for k in range(len(ARMS)))
        low, aside = -self.height, self.arm_length / 4
        return f"""\
# Three arms, driven at the base, carry a platform below it by two rods each. The two rods of an arm are parallel, and
# stay so: the platform moves without turning, as long as nothing is off. Every rod has a universal joint at its arm and
# a ball at the platform; with two balls it could spin about its own line.
#
{self.command()}
#
# writes this file. All bodies are described as they are drawn: assembled, with the platform {number(self.height)} mm
# below the base, their axes along those of the ground. The drives turn the arms; their angles count from the drawing.

format = 1
title  = "Delta robot with universal joints and balls"
space  = "spatial"
units  = {{ length = "mm", angle = "deg", force = "N" }}

{arms}
# The drives follow the output: the arms' angles are solved for these positions.
[path]
x = {numbers([0, aside, aside, -aside])}
y = {numbers([0, 0, aside, aside])}
z = {numbers([low, low, low - aside, low])}

{drives}

[output]
body = "platform"
at   = {numbers([0, 0, low])}

[[loads]]
force  = [5, 3, -20]
moment = [100, 200, 50]       # N mm: force times length
"""

    def _arm(self, k: int, angle: float) -> str:
        outwards, tangent = around(angle)
        shoulder = self.base_radius * outwards
        wrist = self.platform_radius * outwards - np.array([0, 0, self.height])
        elbow = self._elbow(shoulder, wrist, outwards)
        rods = "\n".join(
            self._rod(k, side, elbow + shift, wrist + shift, tangent)
            for side, shift in (("a", self.rod_spacing / 2 * tangent), ("b", -self.rod_spacing / 2 * tangent))
        )
        return f"""\
# Arm {k}, at {number(angle)} degrees, and its two rods.

[joints.shaft{k}]
type   = "revolute"
bodies = ["ground", "arm{k}"]
at     = {numbers(shoulder)}
axis   = {numbers(tangent)}
clearance = {{ radial = {self.radial}, axial = {self.axial}, length = {self.shaft_length} }}

{rods}"""

    def _rod(self, k: int, side: str, elbow: Floats, wrist: Floats, tangent: Floats) -> str:
        across = np.cross(tangent, wrist - elbow)
        across /= np.linalg.norm(across)
        return f"""\
[joints.elbow{k}{side}]
type   = "universal"
bodies = ["arm{k}", "rod{k}{side}"]
at     = {numbers(elbow)}
axes   = [{numbers(tangent)}, {numbers(across)}]
clearance = {{ radial = {self.radial}, axial = {self.axial}, length = {self.pin_length} }}

[joints.wrist{k}{side}]
type   = "spherical"
bodies = ["rod{k}{side}", "platform"]
at     = {numbers(wrist)}
clearance = {{ radial = {self.ball_radial} }}
"""

    def _elbow(self, shoulder: Floats, wrist: Floats, outwards: Floats) -> Floats:
        """The outer of the two places where arm and rod meet, in the upright plane of the arm."""
        gap = wrist - shoulder
        distance = float(np.linalg.norm(gap))
        along = gap / distance
        foot = (distance**2 + self.arm_length**2 - self.rod_length**2) / (2 * distance)
        if abs(foot) >= self.arm_length:
            problem = f"arm and rod cannot reach the platform, {number(distance)} mm from the arm's shaft"
            raise self.refuse("height", problem)
        across = outwards - (outwards @ along) * along
        across /= np.linalg.norm(across)
        return np.asarray(shoulder + foot * along + math.sqrt(self.arm_length**2 - foot**2) * across)
