"""The robot as jointplay knows it: the file that `jointplay new 3-upu` writes, 13 bodies and 15 joints with play."""

from typing import Any

import numpy as np

import jointplay as jp

from .closed_form import Floats

#: the end pins and the guides, as dotted keys of the file
PINS = tuple(f"joints.{end}{k}.clearance" for end in ("base", "top") for k in (1, 2, 3))
GUIDES = tuple(f"joints.leg{k}.clearance" for k in (1, 2, 3))
POSITION, ROTATION = ["x", "y", "z"], ["rx", "ry", "rz"]


def robot(**sizes: float) -> jp.Mechanism:
    """The example with other sizes."""
    return jp.loads(jp.examples.text("3-upu", {name: repr(float(value)) for name, value in sizes.items()}))


def at(m: jp.Mechanism, positions: Any, force: Any, moment: Any) -> jp.Mechanism:
    """The robot along a path of positions, [n, 3] in mm, under a load in N and N mm on the middle of its platform."""
    x, y, z = np.atleast_2d(np.asarray(positions, dtype=float)).T
    return m.with_({"path": {"x": x, "y": y, "z": z}, "loads": [{"force": list(force), "moment": list(moment)}]})


def radians(error: Floats) -> Floats:
    """Errors with their rotations in radians, as those of the closed form."""
    return np.concatenate([error[..., :3], np.radians(error[..., 3:])], axis=-1)


def sizes_of(error: Floats) -> tuple[Floats, Floats]:
    """Sizes of displacement and rotation."""
    return np.linalg.norm(error[..., :3], axis=-1), np.linalg.norm(error[..., 3:], axis=-1)
