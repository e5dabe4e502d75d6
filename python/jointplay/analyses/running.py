"""The machine as it runs: how the bodies move, what the drives give, and whether contact follows the reactions."""

from __future__ import annotations

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.inertia import Kinematics, kinematics
from jointplay.model.mechanism import Mechanism

from .nominal import Nominal


def rates_of(m: Mechanism, count: int) -> Floats:
    """Speeds, accelerations and their derivatives of the drives in so many configurations.

    Raises
    ------
    InputError
        When they change along the path of the file, and other configurations are asked for.
    """
    assert m.motion is not None
    rates = m.motion.rates
    if m.motion.is_steady:
        return np.repeat(rates[:, :1], count, axis=1)
    if rates.shape[1] != count:
        problem = "speeds that change along the path are those of its configurations; elsewhere drives need constant ones"
        raise InputError(problem, file=m.file, key="drives")
    return rates


def moving(m: Mechanism, at: Nominal) -> Kinematics:
    """How the bodies move in configurations that are solved."""
    return kinematics(m, at.drives, at.poses, rates_of(m, len(at)))
