"""What a foreign format does not know: where the output is, which joints are driven, how large clearances are."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Options:
    """The options of an import, as `jointplay.read` takes them."""

    #: link, body or site whose origin is the output
    output: str | None = None
    #: driven joints, each with its value, its values, or None for a proposal
    drives: Mapping[str, object] | None = None
    #: clearance tables of the mechanism file by joint or by kind of joint
    clearance: Mapping[str, object] = field(default_factory=dict)
    #: whether the mechanism is projected to its plane
    planar: bool = False
    #: joint tables of the mechanism file, by name: joints that close loops and that the format cannot hold
    loops: Mapping[str, object] = field(default_factory=dict)
    #: the link that is fixed
    ground: str | None = None
    #: lost motion of drives by joint or by kind of joint
    backlash: Mapping[str, object] = field(default_factory=dict)
    #: whether joints that look like lost motion of the joint beside them stay joints
    keep_joints: bool = False
    #: fit of pins that are drawn with the diameter of their holes
    fit: str | None = None
    #: kg/m^3 by the name of a part; by nothing for all others
    density: Mapping[str, float] = field(default_factory=dict)
    #: mm up to which points of a drawing coincide
    within: float = 0.0
