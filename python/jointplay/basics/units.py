"""Units of the file and their size in SI. The one place where the program knows of any other unit.

A number of the file times its factor is in SI (radians for angles); a result over the factor is in the file's unit.
Moments are in the file's force times its length; masses are in kg and gravity in m/s^2 whatever the units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

LengthUnit = Literal["mm", "cm", "m", "um", "in"]
AngleUnit = Literal["deg", "rad"]
ForceUnit = Literal["N", "kN", "lbf"]

LENGTHS: Mapping[str, float] = MappingProxyType({"mm": 1e-3, "cm": 1e-2, "m": 1.0, "um": 1e-6, "in": 0.0254})
ANGLES: Mapping[str, float] = MappingProxyType({"deg": math.pi / 180.0, "rad": 1.0})
# A pound is 0.45359237 kg and standard gravity 9.80665 m/s^2, both exact by definition.
FORCES: Mapping[str, float] = MappingProxyType({"N": 1.0, "kN": 1e3, "lbf": 0.45359237 * 9.80665})


@dataclass(frozen=True)
class Units:
    """The units of one file.

    Parameters
    ----------
    length_name, angle_name, force_name : str
        Names as in the file.

    Examples
    --------
    >>> Units("mm", "deg", "N").length
    0.001
    >>> Units("mm", "deg", "kN").moment_name
    'kN mm'
    """

    length_name: LengthUnit = "mm"
    angle_name: AngleUnit = "deg"
    force_name: ForceUnit = "N"

    @property
    def length(self) -> float:
        """Metres per unit of length."""
        return LENGTHS[self.length_name]

    @property
    def angle(self) -> float:
        """Radians per unit of angle."""
        return ANGLES[self.angle_name]

    @property
    def force(self) -> float:
        """Newtons per unit of force."""
        return FORCES[self.force_name]

    @property
    def temperature(self) -> float:
        """Kelvin per unit of temperature, which is the kelvin whatever the units."""
        return 1.0

    @property
    def temperature_name(self) -> str:
        """Name of the unit of temperature."""
        return "K"

    @property
    def pressure(self) -> float:
        """Pascals per unit of pressure, which is the megapascal whatever the units."""
        return 1e6

    @property
    def pressure_name(self) -> str:
        """Name of the unit of pressure."""
        return "MPa"

    @property
    def wear(self) -> float:
        """Square metres per newton per unit of specific wear rate, which is mm3/(N m) whatever the units."""
        return 1e-9

    @property
    def moment(self) -> float:
        """Newton metres per unit of moment, which is force times length."""
        return self.force * self.length

    @property
    def moment_name(self) -> str:
        """Name of the unit of moment."""
        return f"{self.force_name} {self.length_name}"

    @property
    def stiffness(self) -> float:
        """Newtons per metre per unit of stiffness, which is force over length."""
        return self.force / self.length

    @property
    def stiffness_name(self) -> str:
        """Name of the unit of stiffness."""
        return f"{self.force_name}/{self.length_name}"

    @property
    def turning_stiffness(self) -> float:
        """Newton metres per radian per unit of stiffness against turning, which is moment over angle."""
        return self.moment / self.angle

    @property
    def turning_stiffness_name(self) -> str:
        """Name of the unit of stiffness against turning."""
        return f"{self.moment_name}/{self.angle_name}"
