"""Loops in space with clearances of up to some percent of their size: what `loaded` gives is what `given` makes of its
offsets, also where the steps to the contacts pass a singular pose."""

import json

import numpy as np
import pytest

from helpers.oracles import loops
from jointplay import _core

OK = _core.STATUSES.index("ok")


def loaded_loop(number: int) -> tuple[_core.Mechanism, np.ndarray, np.ndarray]:
    """A loop under a random load of about 100 N and 100 N times its length, and configurations of it."""
    rng = np.random.default_rng(number)
    spec = loops.loop(30_000 + number, 10 ** rng.uniform(-5, -2.6))
    force, moment = (100 * rng.normal(size=6)).reshape(2, 3)
    spec["loads"] = [
        {"point": spec["output"]["point"], "force": force.tolist(), "moment": (moment * spec["length"]).tolist()}
    ]
    core = _core.Mechanism(json.dumps(spec))
    is_angle = np.array([spec["joints"][drive["joint"]]["kind"] == "revolute" for drive in spec["drives"]])
    drives = rng.uniform(-1, 1, (70, len(spec["drives"]))) * np.where(is_angle, 0.05, 0.05 * spec["length"] * 0.3)
    solved = core.trace(drives)
    assembled = np.asarray(solved["status"]) == OK
    return core, drives[assembled], np.asarray(solved["poses"])[assembled]


# In the loops 10 and 56 the steps end on another branch in some configurations.
@pytest.mark.parametrize("number", [10, 4, 2, 56])
def test_what_is_ok_is_what_given_makes_of_the_offsets(number: int) -> None:
    core, drives, poses = loaded_loop(number)
    found = core.loaded(drives, poses)
    ok = np.flatnonzero(np.asarray(found["status"]) == OK)
    for row in ok:
        one = slice(row, row + 1)
        given = core.given(drives[one], poses[one], np.asarray(found["offset"])[one])
        assert np.asarray(given["status"])[0] == OK
        np.testing.assert_allclose(np.asarray(given["error"])[0], np.asarray(found["error"])[row], rtol=1e-6, atol=1e-9)
