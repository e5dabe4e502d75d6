"""Wear of joints: how fast their clearances grow, from the load and the sliding in them or as it was measured.

    worn volume = rate * force * sliding distance        Archard, J. Appl. Phys. 24 (1953) 981

The rate of both faces together takes all of the wear to be at one place: the load does not move on the part that wears.
A pin and its hole can have a rate each; what the load goes round then wears all round.

Its sizes are those of the faces that slide on each other; what the clearance says of them is not said again.
"""

from typing import Any, ClassVar, Self

from pydantic import ConfigDict, JsonValue, model_validator

from .clearances import BearingKeys, SleeveClearance
from .sliding import SlidingKeys
from .values import NonNegative, Omittable, Positive, omitted, problem

#: what the key `wear` is, for all kinds of joints
WORN = "how fast its clearance grows"
RATE = "specific wear rate of both faces together, in mm3/(N m) whatever the units of the file"
OF_ONE = "instead of rate, with rate_{}: specific wear rate of the {}, on whose surface the load may wander"
GROWTH = "instead: growth per cycle that was measured, in the measure in which the clearance is given"
DIAMETER = "diameter of the {}, for pressure and sliding distance; that of the clearance if left out"

FaceSize = Omittable[Positive]


class Wear(SlidingKeys):
    """What a clearance wears by."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["rate"]}, {"required": ["growth"]}]})

    rate: Omittable[NonNegative] = omitted(RATE)
    growth: Omittable[NonNegative] = omitted(GROWTH)

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        both = self.of_both
        given = ["rate"] * (self.rate is not None) + ["rate_hole and rate_pin"] * (both is not None)
        given += ["growth"] * (self.growth is not None)
        if len(given) > 1:
            raise problem(f"give {' or '.join(given)}, not both")
        if not given:
            raise problem(
                "say how fast it wears: rate (specific wear rate, mm3/(N m)) or growth (of the clearance per cycle, as"
                " measured)"
            )
        if both is not None and None in both:
            missing = "rate_hole" if both[0] is None else "rate_pin"
            raise problem(f"'{missing}' is missing (rate_hole and rate_pin belong together; 0 for one that wears not)")
        return self

    @property
    def of_both(self) -> tuple[float | None, float | None] | None:
        """The rates of hole and pin; None where neither is given."""
        both = (getattr(self, "rate_hole", None), getattr(self, "rate_pin", None))
        return None if both == (None, None) else both

    def check(self, play: Any) -> None:
        """Refuse what is not enough, with the clearance, to say how it wears.

        Raises
        ------
        ValueError
            When a size is missing, or nothing slides.
        """
        if isinstance(play, SleeveClearance) and play.length is None:
            raise problem("wear: the clearance needs 'length' (length of the pin inside its hole), by which it tilts")
        if self.growth is not None:
            return
        if isinstance(play, BearingKeys) and play.bearing is not None:
            raise problem(
                "wear: the balls of a bearing roll, and a specific wear rate says nothing of them; give growth, as"
                " measured"
            )
        self.require(play, "wear", "a specific wear rate")


def _needing(*keys: str, of_pins: bool = False) -> dict[str, JsonValue]:
    """The JSON Schema of wear whose rate needs sizes of its own."""
    ways = [["rate", *keys], *([["rate_hole", "rate_pin", *keys]] * of_pins), ["growth"]]
    return {"oneOf": [{"required": [*way]} for way in ways]}


class RoundWear(Wear):
    """Wear of a pin and its hole, which may have rates of their own."""

    rate_hole: Omittable[NonNegative] = omitted(OF_ONE.format("pin", "hole"))
    rate_pin: Omittable[NonNegative] = omitted(OF_ONE.format("hole", "pin"))


class PinWear(RoundWear):
    """Wear of a pin and its hole, in the plane."""

    model_config = ConfigDict(json_schema_extra=_needing("length", of_pins=True))
    example: ClassVar[str] = "{ rate = 1e-6, length = 20 }"
    needed: ClassVar[tuple[str, ...]] = ("length",)

    length: FaceSize = omitted("length of the pin inside its hole")
    diameter: FaceSize = omitted(DIAMETER.format("pin"))


class SliderWear(Wear):
    """Wear of a slider in its guide, in the plane."""

    model_config = ConfigDict(json_schema_extra=_needing("width"))
    example: ClassVar[str] = "{ rate = 1e-6, width = 25 }"
    needed: ClassVar[tuple[str, ...]] = ("width",)

    width: FaceSize = omitted("width of the faces that slide, across the plane")


class BlockWear(Wear):
    """Wear of a block that slides in a slot and carries the pin."""

    model_config = ConfigDict(json_schema_extra=_needing("length", "width"))
    example: ClassVar[str] = "{ rate = 1e-6, length = 15, width = 10 }"
    needed: ClassVar[tuple[str, ...]] = ("length", "width")

    length: FaceSize = omitted("length of the block along the slot")
    width: FaceSize = omitted("width of the faces that slide, across the plane")


class JournalWear(RoundWear):
    """Wear of a pin and its hole, in space."""

    model_config = ConfigDict(json_schema_extra=_needing(of_pins=True))
    example: ClassVar[str] = "{ rate = 1e-6 }"

    diameter: FaceSize = omitted(DIAMETER.format("pin"))


class SleeveWear(JournalWear):
    """Wear of a pin that turns and slides in its hole."""

    example: ClassVar[str] = "{ rate = 1e-6, diameter = 12 }"
    needed: ClassVar[tuple[str, ...]] = ("diameter",)


class GuideWear(Wear):
    """Wear of a slider of rectangular section in its guide."""

    example: ClassVar[str] = "{ rate = 1e-6 }"


class BallWear(Wear):
    """Wear of a ball and its socket."""

    example: ClassVar[str] = "{ rate = 1e-6, diameter = 15 }"
    needed: ClassVar[tuple[str, ...]] = ("diameter",)

    diameter: FaceSize = omitted("diameter of the ball; that of the clearance if left out")


class PlateWear(Wear):
    """Wear of a plate between two planes."""

    example: ClassVar[str] = "{ rate = 1e-6 }"
