"""The bundled mechanisms in space: where their bodies are and how they move, against pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from answers import EXAMPLES, OVER_CONSTRAINED, example
from jointplay.analyses.nominal import nominal
from oracles.loops import matrices
from oracles.pin import Tree

Array = NDArray[np.float64]
SPATIAL = [name for name in EXAMPLES if example(name).pose_size == 7]
SPATIAL_OVER_CONSTRAINED = [name for name in OVER_CONSTRAINED if example(name).pose_size == 7]


def followed(tree: Tree, q: Array, start: Array, end: Array) -> Array:
    """The loops closed on the way from drive values to others, so that Newton's method keeps to the branch."""
    for part in np.linspace(0, 1, 9)[1:]:
        q = tree.close(q, (1 - part) * start + part * end)
    return q


#: rods between balls spin, and the other engine holds their spins in another way
SPINNING = ("delta-by-hand",)


@pytest.mark.parametrize("name", [name for name in SPATIAL if name not in SPINNING])
def test_poses_and_output_jacobian(name: str) -> None:
    m = example(name)
    at = nominal(m)
    assert (at.status == 0).all()
    tree = Tree(m.spec())
    q = tree.close(tree.start, at.drives[0])
    slopes = m.core.sensitivity(at.drives, at.poses)["drive"]
    for k, drives in enumerate(at.drives):
        q = followed(tree, q, at.drives[max(k - 1, 0)], drives)
        frames = tree.bodies()
        np.testing.assert_allclose(at.poses[k, :, :3], [f.translation for f in frames], rtol=0, atol=1e-10 * m.length)
        np.testing.assert_allclose(matrices(at.poses[k]), [f.rotation for f in frames], rtol=0, atol=1e-10)
        output = tree.at(tree.output)
        np.testing.assert_allclose(at.output[k, :3], output.translation, rtol=0, atol=1e-10 * m.length)
        jacobian = tree.jacobian(q)
        np.testing.assert_allclose(slopes[k], jacobian, rtol=0, atol=1e-10 * np.abs(jacobian).max())


@pytest.mark.parametrize("name", SPATIAL_OVER_CONSTRAINED)
def test_an_over_constrained_mechanism_is_assembled_all_the_same(name: str) -> None:
    m = example(name)
    tree = Tree(m.spec())
    assert m.drive_values is not None
    for drives in m.drive_values[:3]:
        poses = m.core.assemble(drives)["poses"]
        tree.close(tree.start, drives)
        np.testing.assert_allclose(poses[:, :3], [f.translation for f in tree.bodies()], rtol=0, atol=1e-9 * m.length)
