"""What a foreign format does not know: where the output is, which joints are driven, how large clearances are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Options:
    """The options of an import, as `jointplay.read` takes them.

    Attributes
    ----------
    output : str or None
        Link, body or site whose origin is the output.
    drives : mapping or None
        Driven joints, each with its value, its values, or None for a proposal.
    clearance : mapping
        Clearance tables of the mechanism file by joint or by kind of joint.
    planar : bool
        Whether the mechanism is projected to its plane.
    loops : mapping
        Joint tables of the mechanism file, by name: joints that close loops and that the format cannot hold.
    ground : str or None
        The link that is fixed.
    backlash : mapping
        Lost motion of drives by joint or by kind of joint.
    keep_joints : bool
        Whether joints that look like lost motion of the joint beside them stay joints.
    fit : str or None
        Fit of pins that are drawn with the diameter of their holes.
    density : mapping
        kg/m^3 by the name of a part; by nothing for all others.
    """

    output: str | None = None
    drives: Mapping[str, object] | None = None
    clearance: Mapping[str, object] = field(default_factory=dict)
    planar: bool = False
    loops: Mapping[str, object] = field(default_factory=dict)
    ground: str | None = None
    backlash: Mapping[str, object] = field(default_factory=dict)
    keep_joints: bool = False
    fit: str | None = None
    density: Mapping[str, float] = field(default_factory=dict)
