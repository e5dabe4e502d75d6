"""The extendible support structure of a SAR antenna: two panels, held by three locked links against a satellite."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from jointplay.file.toml import number

from .template import Template


@dataclass(frozen=True)
class AntennaSupport(Template):
    """What is not published of the structure, and which of its two forms it is."""

    name: ClassVar[str] = "antenna-support"
    words: ClassVar[Mapping[str, tuple[str, ...]]] = {"elastic": ("redundant", "DF", "DI", "none")}
    may_vanish: ClassVar[tuple[str, ...]] = ("radial",)
    signed: ClassVar[tuple[str, ...]] = ("angle_a", "angle_f")

    locked: bool = True
    elastic: str = "redundant"
    stiffness: float = 20000
    radial: float = 0.5
    angle_a: float = 0.05
    angle_f: float = -0.05

    def text(self) -> str:
        """The file."""
        # A pin belongs to a body that is there when others come to it.
        riders = ("BD", "ED", "DF", "DI") if self.locked else ("DF", "ED", "BD", "DI")
        return f"""\
# The extendible support structure of a SAR antenna (Zhao et al., J. Mech. Sci. Technol. 32 (2018) 3395): the cabin
# AB of a satellite carries the inner panel AF and the outer panel FI; BD, ED, DF and DI hold them in place. All of it
# was folded: BD, DF and DI unfolded as two bars each, which locked together in C, G and H and are one link since.
#
{self.command()}
#
# writes this file. {self._form()}

format = 1
title  = "Extendible support structure of a SAR antenna, {"over-constrained" if self.locked else "determinate"}"
space  = "planar"
units  = {{ length = "mm", angle = "deg", force = "N" }}

# All bodies are described as drawn, unfolded: A is the origin, x along the panels, y along the cabin. The places follow
# from the published lengths; ED comes to 218.75 then, not to the 218.71 of the publication.
#
# Who carries the pin follows the published names: the cabin carries those in A and B, the inner panel those in E and F,
# the outer panel the one in I, and {riders[0]} the one in D, on which {riders[1]}, {riders[2]} and {riders[3]} ride.

{self._hinge("A", ("ground", "AF"), (0, 0), self.angle_a)}
{self._pin("B", ("ground", "BD"), (0, 125))}
{self._pin("E", ("AF", "ED"), (14, 0))}
{self._hinge("F", ("AF", "FI"), (212, 0), self.angle_f)}
{self._pin("F_DF", ("AF", "DF"), (212, 0))}
{self._pin("D", riders, (212, 93))}
{self._pin("I", ("FI", "DI"), (422, 0))}
# The deviations of one built specimen, as published.

{self._dimension("AB", "ground", ("A", "B"), 0.94)}
{self._dimension("AE", "AF", ("A", "E"), -0.35)}
{self._dimension("AF", "AF", ("A", "F"), 1.10)}
{self._dimension("FI", "FI", ("F", "I"), -1.26)}
{self._dimension("BD", "BD", ("B", "D"), 1.03)}
{self._dimension("ED", "ED", ("E", "D"), 0.94)}
{self._dimension("DF", "DF", ("D", "F_DF"), -0.75)}
{self._dimension("DI", "DI", ("D", "I"), -0.86)}
{self._members()}# The tip of the antenna. The load is assumed: the publication has none.

[output]
body = "FI"
at   = "I"

[[loads]]
force = [2, -10]

{self._assembly()}"""

    def _form(self) -> str:
        if self.locked:
            return """\
The hinges A and F are latched at 90 and 180 degrees, which makes the structure over-constrained
# twice: DF is one link more than needed as soon as the inner panel stands, and so is DI for the outer one. The errors
# of the latched angles are not known to us and assumed here. `--set locked=false` leaves A and F free to turn: then it
# is just determinate, as the structure is often simplified."""
        return """\
The hinges A and F are free to turn, which makes the structure just determinate. In the real one they
# are latched at 90 and 180 degrees; `--set locked=true` writes that, over-constrained twice."""

    def _pin(self, name: str, bodies: tuple[str, ...], at: tuple[float, float]) -> str:
        names = ", ".join(f'"{body}"' for body in bodies)
        return f"""\
[joints.{name}]
type   = "revolute"
bodies = [{names}]
at     = [{number(at[0])}, {number(at[1])}]
clearance = {{ radial = {number(self.radial)} }}
"""

    def _hinge(self, name: str, bodies: tuple[str, ...], at: tuple[float, float], angle: float) -> str:
        pin = self._pin(name, bodies, at)
        if not self.locked:
            return pin
        # The pin keeps its play in the latched hinge.
        return pin.replace('"revolute"', '"fixed"') + f"angle  = {{ deviation = {number(angle)} }}   # assumed\n"

    def _dimension(self, name: str, body: str, between: tuple[str, str], deviation: float) -> str:
        return f"""\
[dimensions.{name}]
body = "{body}"
between = ["{between[0]}", "{between[1]}"]
deviation = {number(deviation)}
"""

    def _assembly(self) -> str:
        if self.locked:
            return """\
# The order of assembly on the cabin, as published: the inner panel is fixed, BD and ED are connected, DF is redundant
# and has to be inserted, then the same on the outer panel.

[assembly]
base  = "ground"
steps = [["AF"], ["BD", "ED"], ["DF"], ["FI"], ["DI"]]
"""
        return """\
# The order of assembly on the inner panel, as published: DF and ED are connected over it and make a triangle, BD and
# the cabin are connected to that, and then DI and the outer panel.

[assembly]
base  = "AF"
steps = [["DF", "ED"], ["BD", "ground"], ["DI", "FI"]]
"""

    def _members(self) -> str:
        """Which links give, and how much."""
        if self.elastic == "none" or (self.elastic == "redundant" and not self.locked):
            return ""
        names = ("DF", "DI") if self.elastic == "redundant" else (self.elastic,)
        elastic = f"The link {names[0]} is" if len(names) == 1 else "The two redundant links are"
        tables = [f"[bodies.{name}]\nstiffness = {number(self.stiffness)}\n" for name in names]
        lines = [f"# {elastic} elastic, all other bodies are rigid. The stiffness (N/mm) is assumed.\n", *tables]
        return "\n".join([*lines, ""])
