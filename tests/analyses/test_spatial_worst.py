"""The worst case in space: no direction is missed, certificates hold, no sample goes beyond."""

import json

import numpy as np
import pytest
from numpy.typing import NDArray

from helpers.answers import EXAMPLES, example
from helpers.geometry import unit_vectors
from helpers.oracles.supports import support
from jointplay import _core
from jointplay.analyses.nominal import nominal
from jointplay.model.mechanism import Mechanism

Array = NDArray[np.float64]
SPATIAL = [name for name in EXAMPLES if example(name).pose_size == 7]
DIRECTIONS = 200_000


def few(m: Mechanism) -> tuple[Array, Array]:
    """Drives and nominal poses of the first and the last configuration."""
    at = nominal(m)
    ends = [0, len(at) - 1]
    return at.drives[ends], at.poses[ends]


@pytest.mark.parametrize("name", SPATIAL)
def test_no_direction_is_missed(name: str) -> None:
    """The support of the error along 200 000 directions: two of them are 0.8 degrees apart at most."""
    m = example(name)
    drives, poses = few(m)
    found = m.core.worst(drives[-1:], poses[-1:], 1)
    slopes = m.core.sensitivity(drives[-1:], poses[-1:])["source"][0]
    u = unit_vectors(DIRECTIONS)
    for key, rows in (("position", slice(3)), ("rotation", slice(3, 6))):
        sampled = max(support(m.spec(), part @ slopes[rows]).max() for part in np.array_split(u, 10))
        largest, bound = found[f"{key}_first_order"][0], found[f"{key}_bound"][0]
        assert sampled <= largest * (1 + 1e-12)
        assert largest <= sampled * (1 + 1e-3)
        assert largest <= bound * (1 + 1e-12)
        assert bound <= largest * (1 + 1e-3)


@pytest.mark.parametrize("name", SPATIAL)
def test_certificates_hold_and_no_unit_is_worse(name: str) -> None:
    m = example(name)
    drives, poses = few(m)
    found = m.core.worst(drives, poses)
    for k in range(len(drives)):
        values = [found["position"][k], found["rotation"][k], *found["component"][k].ravel()]
        offsets = found["offset"][k]
        assert len(offsets) == len(values) == 14
        n = len(offsets)
        given = m.core.given(np.repeat(drives[k : k + 1], n, 0), np.repeat(poses[k : k + 1], n, 0), offsets)
        errors = given["error"]
        reached = [np.linalg.norm(errors[0, :3]), np.linalg.norm(errors[1, 3:])]
        reached += [errors[2 + i, i // 2] for i in range(12)]
        scale = np.array([m.length, 1.0, *np.repeat([m.length, 1.0], 6)])
        np.testing.assert_allclose(np.array(reached) / scale, np.array(values) / scale, rtol=0, atol=1e-12)
        # 20 000 units, and as many with all play at its boundary.
        for law in (None, "boundary"):
            largest = m.core.random(drives[k : k + 1], poses[k : k + 1], 20_000, 7, np.array([0.5]), None, law)
            assert largest["failures"][0, 1:].sum() == 0
            bounds = np.array([*np.abs(found["component"][k]).max(axis=1), values[0], values[1]])
            assert (largest["largest"][0] <= bounds * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", SPATIAL)
def test_the_worst_tends_to_its_first_order(name: str) -> None:
    spec = example(name).spec()
    for source in spec["sources"]:
        ((_, size),) = source["set"].items()
        size |= {key: 1e-4 * size[key] for key in ("radius", "axial", "gap", "low", "high") if key in size}
    m = example(name)
    drives, poses = few(m)
    found = _core.Mechanism(json.dumps(spec)).worst(drives, poses, 4)
    for key in ("position", "rotation", "component"):
        np.testing.assert_allclose(found[key], found[f"{key}_first_order"], rtol=2e-5)
