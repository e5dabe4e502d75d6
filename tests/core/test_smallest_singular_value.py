"""The smallest singular value of more than a few bodies, found by iteration on sparse factors."""

import numpy as np

import jointplay as jp
from jointplay.analyses.nominal import nominal


def test_it_is_that_of_the_dense_matrix() -> None:
    m = jp.loads(jp.examples.text("delta"))
    at = nominal(m)
    found = m.core.measure(at.drives, at.poses)
    moves = np.tile([True] * 3 + [False] * 3, len(m.bodies))
    for k, jacobian in enumerate(m.core.jacobian(at.poses)):
        assert len(jacobian) > 60
        # Rows of lengths are those that translations of bodies change.
        is_length = np.abs(jacobian[:, moves]).max(axis=1) > 0
        scaled = jacobian * np.where(moves, m.length, 1.0) / np.where(is_length, m.length, 1.0)[:, None]
        value, motion = found["singular_value"][k], found["singular_motion"][k].ravel() / np.where(moves, m.length, 1.0)
        assert np.isclose(value, np.linalg.svd(scaled, compute_uv=False)[-1], rtol=1e-9)
        # Two of the mechanism are alike: their motions are any in a plane.
        assert np.isclose(np.linalg.norm(scaled @ motion), value * np.linalg.norm(motion), rtol=1e-9)
