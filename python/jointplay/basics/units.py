"""Units of the file and their size in SI. The one place where the program knows of any other unit.

A number of the file times its factor is in SI (radians for angles); a result over the factor is in the file's unit.
Moments are in the file's force times its length; masses are in kg, gravity in m/s^2, times in s and powers in W,
whatever the units.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

LengthUnit = Literal["mm", "cm", "m", "um", "in"]
AngleUnit = Literal["deg", "rad"]
ForceUnit = Literal["N", "kN", "lbf"]
TurningSpeedUnit = Literal["1/min", "1/s", "deg/s", "rad/s"]

LENGTHS: Mapping[str, float] = MappingProxyType({"mm": 1e-3, "cm": 1e-2, "m": 1.0, "um": 1e-6, "in": 0.0254})
ANGLES: Mapping[str, float] = MappingProxyType({"deg": math.pi / 180.0, "rad": 1.0})
# A pound is 0.45359237 kg and standard gravity 9.80665 m/s^2, both exact by definition.
FORCES: Mapping[str, float] = MappingProxyType({"N": 1.0, "kN": 1e3, "lbf": 0.45359237 * 9.80665})
#: speeds of drives that turn, in radians per second; 1/min are revolutions per minute
TURNING_SPEEDS: Mapping[str, float] = MappingProxyType(
    {"1/min": 2.0 * math.pi / 60.0, "1/s": 2.0 * math.pi, "deg/s": ANGLES["deg"], "rad/s": 1.0}
)


@dataclass(frozen=True)
class Units:
    """The units of one file.

    Examples
    --------
    >>> Units("mm", "deg", "N").length
    0.001
    >>> Units("mm", "deg", "kN").moment_name
    'kN mm'
    """

    #: `length_name`, `angle_name`, `force_name`: names as in the file
    length_name: LengthUnit = "mm"
    angle_name: AngleUnit = "deg"
    force_name: ForceUnit = "N"
    #: the same of the speeds of drives that turn; the angle per second if left out
    turning_speed_name: str = ""

    def __post_init__(self) -> None:
        if not self.turning_speed_name:
            object.__setattr__(self, "turning_speed_name", f"{self.angle_name}/s")

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

    @property
    def turning_speed(self) -> float:
        """Radians per second per unit of the speed of a drive that turns."""
        return TURNING_SPEEDS[self.turning_speed_name]

    @property
    def speed(self) -> float:
        """Metres per second per unit of speed, which is length per second."""
        return self.length

    @property
    def speed_name(self) -> str:
        """Name of the unit of speed."""
        return f"{self.length_name}/s"

    @property
    def acceleration(self) -> float:
        """Metres per second squared per unit of acceleration."""
        return self.length

    @property
    def acceleration_name(self) -> str:
        """Name of the unit of acceleration."""
        return f"{self.length_name}/s^2"

    @property
    def angular_velocity(self) -> float:
        """Radians per second per unit of angular velocity, which is angle per second."""
        return self.angle

    @property
    def angular_velocity_name(self) -> str:
        """Name of the unit of angular velocity."""
        return f"{self.angle_name}/s"

    @property
    def angular_acceleration(self) -> float:
        """Radians per second squared per unit of angular acceleration."""
        return self.angle

    @property
    def angular_acceleration_name(self) -> str:
        """Name of the unit of angular acceleration."""
        return f"{self.angle_name}/s^2"

    @property
    def power(self) -> float:
        """Watts per unit of power, which is the watt whatever the units."""
        return 1.0

    @property
    def power_name(self) -> str:
        """Name of the unit of power."""
        return "W"

    @property
    def time(self) -> float:
        """Seconds per unit of time, which is the second whatever the units."""
        return 1.0

    @property
    def time_name(self) -> str:
        """Name of the unit of time."""
        return "s"
