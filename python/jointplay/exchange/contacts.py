"""A mechanism as a model of MuJoCo, with its clearances as gaps between solids: for a study of its dynamics."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from jointplay.analyses.nominal import nominal
from jointplay.errors import InputError, in_range
from jointplay.model.mechanism import Mechanism

from .contact_model import PIECES, WORLD
from .contact_planar import PlanarModel
from .contact_spatial import Spatial

#: why a joint has no solids
REFUSED: Mapping[str, str] = MappingProxyType(
    {
        "gear": "a gear pair, whose flanks are no convex pieces",
        "crossed_gear": "a crossed gear pair, whose flanks are no convex pieces",
        "rack": "a rack, whose flanks are no convex pieces",
        "belt": "a belt, which pulls and winds and is no solid",
        "screw": "a screw, whose thread is no convex piece",
        "follower": "a coordinate that follows another one",
    }
)


def to_mjcf(m: Mechanism, configuration: int = 0, pieces: int = PIECES) -> str:
    """The text of a model.

    Parameters
    ----------
    m : Mechanism
        One of rigid bodies.
    configuration : int
        Number of the configuration in which its drives are held, from 0.
    pieces : int
        Number of boxes of a ring around a pin.

    Raises
    ------
    InputError
        When it has something that the model cannot have.
    """
    _check(m)
    at = nominal(m)
    in_range(configuration, "configuration", "the number of a configuration", 0, len(at.poses) - 1)
    drives, poses = at.drives[configuration], at.poses[configuration]
    if not np.isfinite(poses).all():
        raise InputError(f"configuration {configuration} cannot be assembled", file=m.file)
    kind = PlanarModel if m.data.space == "planar" else Spatial
    return kind(m.at_rest_under(configuration), drives, poses, pieces).text()


def _check(m: Mechanism) -> None:
    """Refuse what cannot be exported."""
    problem = None
    for name, kind in zip(m.joints, m.joint_kinds, strict=True):
        if kind in REFUSED:
            key = f"followers.{name}" if kind == "follower" else f"joints.{name}"
            raise InputError(f"is {REFUSED[kind]}; the model for MuJoCo cannot have it", file=m.file, key=key)
    if m.members:
        problem = "has elastic bodies, which the model for MuJoCo cannot have"
    elif any(spring.on is None or not spring.stiffness for spring in m.data.springs.values()):
        problem = "has torsion springs or constant springs, which the model for MuJoCo cannot have"
    elif m.outputs or m.load_cases:
        problem = "has several outputs or load cases; name one of them"
    elif WORLD in m.bodies:
        problem = f"has a body '{WORLD}', which is MuJoCo's name of the ground; give it another name"
    if problem:
        raise InputError(problem, file=m.file)
    for k, name in enumerate(m.joints):
        if (given := m.compliance(k)) is not None and given.any():
            problem = "has a stiffness, and the model for MuJoCo has rigid joints only"
            raise InputError(problem, file=m.file, key=f"joints.{name}")
    for name, drive in m.data.drives.items():
        for key in ("backlash", "stiffness"):
            if getattr(drive, key) is not None:
                problem = f"has {key}, and the model for MuJoCo holds its drives at their values"
                raise InputError(problem, file=m.file, key=f"drives.{name}.{key}")
