"""The sets of admissible offsets as the core has them, each declared once; SI units and radians.

An offset v is admissible where it meets all conditions of its set; R, w are rows of numbers and of sizes of the parts:

    radius          |R v| <= radius            something round in something round, at both ends if it may tilt
    gap             sum |w_k v_k| <= gap       all corners between two faces
    axial, high     low <= w v <= high         one number
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.spec import SetSpec
from jointplay.file.schema import (
    BallClearance,
    GuideClearance,
    JournalClearance,
    PlateClearance,
    PrismaticClearance,
    RevoluteClearance,
    SizedClearance,
    SleeveClearance,
    SlotClearance,
)

SHIFTS_ACROSS = ("side", "normal")
TILTS = ("tilt_side", "tilt_normal")
#: sizes that grow with the radius or the gap of a pair, and by how much
PLAY = MappingProxyType({"radius": 1.0, "gap": 1.0, "high": 1.0, "low": -1.0})
#: sizes that bound how far something is off; the others are halves of lengths of the parts
BOUNDS = (*PLAY, "axial")
#: these lengths, of a clearance in the file
WHOLE: Mapping[str, Callable[[Any], float | None]] = MappingProxyType(
    {
        "half_length": lambda play: play.length,
        "half_width": lambda play: play.width,
        "half_height": lambda play: play.width if play.height is None else play.height,
        "half_side": lambda play: play.size[0],
        "half_normal": lambda play: play.size[1],
    }
)
#: sizes of a set by name; numbers, or of bounds arrays over configurations where sizes scatter
SetSizes = Mapping[str, Any]


@dataclass(frozen=True)
class Condition:
    """One condition on offsets; of what is flat the signs of its row are those of one corner."""

    rows: Floats
    low: Any
    high: Any
    is_flat: bool

    def beyond(self, away: Floats) -> Floats:
        """How far outside offsets are; not above zero inside. Shape (configuration,)."""
        moved = np.abs(away) @ np.abs(self.rows.T) if self.is_flat else away @ self.rows.T
        if len(self.rows) > 1:
            return np.asarray(np.linalg.norm(moved, axis=1) - self.high)
        return np.asarray(np.maximum(moved[:, 0] - self.high, self.low - moved[:, 0]))


@dataclass(frozen=True)
class OffsetSet:
    """A kind of set."""

    #: the clearance of the file that has it, and the kind of joint
    of: type[SizedClearance]
    joint: str
    #: what rubs as a law of friction says; empty where none does
    rubs: str
    slides: Literal["pin", "block", "ball", "guide", "plate"]
    #: in the order of the joint's locked directions
    components: tuple[str, ...]
    #: of every condition the size that bounds it, and its rows: numbers, and sizes with their signs
    bounded: Sequence[tuple[Any, ...]]

    @property
    def sizes(self) -> list[str]:
        """Its sizes as the core has them."""
        named = [one for bound, *rows in self.bounded for one in (bound, *chain(*rows)) if isinstance(one, str)]
        return [*(["low"] if "high" in named else []), *dict.fromkeys(one.removeprefix("-") for one in named)]

    @property
    def is_planar(self) -> bool:
        """Whether it is of the plane, where a joint locks two directions at most."""
        return len(self.components) < 3

    @property
    def is_round(self) -> bool:
        """Whether it is the same in every direction."""
        return self.sizes == ["radius"]

    def conditions(self, size: SetSizes) -> list[Condition]:
        """What offsets have to meet, with these sizes."""
        signed = {**size, **{f"-{key}": -value for key, value in size.items()}}
        found = []
        for bound, *rows in self.bounded:
            low = {"radius": 0.0, "high": size.get("low")}.get(bound, -size[bound])
            matrix = np.array([[signed.get(entry, entry) for entry in row] for row in rows], dtype=float)
            found.append(Condition(matrix, low, size[bound], bound == "gap"))
        return found


PIN, BAR = (*SHIFTS_ACROSS, *TILTS), (*SHIFTS_ACROSS, "roll", *TILTS)
#: both ends of a pin: a tilt about the side moves the far one along -normal, one about the normal along the side
PIN_ENDS = [
    ("radius", (1, 0, 0, "half_length"), (0, 1, "-half_length", 0)),
    ("radius", (1, 0, 0, "-half_length"), (0, 1, "half_length", 0)),
]
SHOULDERED = [("axial", (1, 0, 0, 0, 0)), *((bound, (0, *a), (0, *b)) for bound, a, b in PIN_ENDS)]
FACES = [("gap", (1, 0, "half_height", 0, "half_length")), ("gap", (0, 1, "half_width", "-half_length", 0))]
RISE = [("gap", (1, "half_normal", "half_side"))]
CENTRE = [("radius", (1, 0, 0), (0, 1, 0), (0, 0, 1))]
#: every set by its name in the core, a clearance before those from which it is derived
SETS: Mapping[str, OffsetSet] = MappingProxyType(
    {
        "disc": OffsetSet(RevoluteClearance, "revolute", "pin", "pin", ("x", "y"), [("radius", (1, 0), (0, 1))]),
        "ball": OffsetSet(BallClearance, "spherical", "ball", "ball", ("x", "y", "z"), CENTRE),
        "interval": OffsetSet(SlotClearance, "pin_in_slot", "slot", "block", ("normal",), [("high", (1,))]),
        "diamond": OffsetSet(
            PrismaticClearance, "prismatic", "guide", "block", ("normal", "angle"), [("gap", (1, "half_length"))]
        ),
        "journal": OffsetSet(JournalClearance, "revolute", "journal", "pin", ("along", *PIN), SHOULDERED),
        "sleeve": OffsetSet(SleeveClearance, "cylindrical", "", "pin", PIN, PIN_ENDS),
        "guide": OffsetSet(GuideClearance, "prismatic", "rail", "guide", BAR, FACES),
        "plate": OffsetSet(PlateClearance, "planar", "", "plate", ("along", *TILTS), RISE),
    }
)
#: that of one number
SINGLE = SETS["interval"]


def of_clearance(play: Any, gap: float, unit: float, length: float) -> tuple[tuple[str, ...], SetSpec]:
    """Components and set of a clearance of the file, in whose unit lengths are; `length` is that of the mechanism.

    The radius or gap in the middle of its sizes may be negative, where most pairs have no play. A pin without radial
    play does not tilt, however long it is.
    """

    def size(key: str) -> float:
        if key in BOUNDS:
            return PLAY[key] * gap if key in PLAY else float(play.axial * unit)
        whole = WHOLE[key](play)
        return length if whole is None else whole / 2.0 * unit

    name, own = next((name, own) for name, own in SETS.items() if isinstance(play, own.of))
    return own.components, {name: {key: size(key) for key in own.sizes}}


def between(low: float, high: float) -> SetSpec:
    """The set of one number."""
    return {"interval": {"low": low, "high": high}}


def within(radius: float, components: int) -> SetSpec:
    """A disc or a ball."""
    return {"disc" if components == 2 else "ball": {"radius": radius}}


def cylinder(radius: float, half_length: float) -> SetSpec:
    """Within which an axis shifts and tilts."""
    return {"sleeve": {"radius": radius, "half_length": half_length}}


def beyond(shape: str, size: SetSizes, away: Floats) -> Floats:
    """How far outside a set offsets are, in metres; not above zero inside. Shape (configuration,)."""
    return np.asarray(np.max([one.beyond(away) for one in SETS[shape].conditions(size)], axis=0))


def play_of(size: SetSizes) -> Any:
    """Radius or gap of a pair; of other sets the upper limit."""
    return next(size[key] for key in PLAY if key in size)


def furthest(size: SetSizes, keys: Iterable[str] = BOUNDS) -> float:
    """The largest of some sizes, as how far something may be off."""
    return float(max(abs(size[key]) for key in keys if key in size))


def grown(size: SetSizes, by: Any, least: float = -np.inf) -> dict[str, Any]:
    """The sizes with a radius or gap that has grown, on either side, but not below a least one."""
    return {
        key: PLAY[key] * np.maximum(PLAY[key] * value + by, least) if key in PLAY else value
        for key, value in size.items()
    }
