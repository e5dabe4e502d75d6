"""The bundled mechanisms in space: where their bodies are and how they move, against pinocchio."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.answers import EXAMPLES, OVER_CONSTRAINED, example
from helpers.oracles.loops import matrices
from helpers.oracles.pin import Tree
from jointplay.analyses.nominal import nominal

Array = NDArray[np.float64]
SPATIAL = [name for name in EXAMPLES if example(name).pose_size == 7]
SPATIAL_OVER_CONSTRAINED = [name for name in OVER_CONSTRAINED if example(name).pose_size == 7]


def followed(tree: Tree, q: Array, start: Array, end: Array) -> Array:
    """The loops closed on the way from drive values to others, so that Newton's method keeps to the branch."""
    for part in np.linspace(0, 1, 9)[1:]:
        q = tree.close(q, (1 - part) * start + part * end)
    return q


def joint_places(m: jp.Mechanism, position: Array, rotation: Array) -> Array:
    """Where the bodies have their joints, ground axes."""
    spec = m.spec()
    points = [spec["points"][joint[end]] for joint in spec["joints"] for end in ("first", "second")]
    places = [position[p["body"]] + rotation[p["body"]] @ p["at"] for p in points if p["body"] >= 0]
    return np.array(places)


@pytest.mark.parametrize("name", SPATIAL)
def test_poses_and_output_jacobian(name: str) -> None:
    """Balls leave open how a rod turns about its own line; there the other engine takes steps of least size."""
    m = example(name)
    still = np.array([all(body not in spin.bodies for spin in m.spins) for body in range(len(m.bodies))])
    assert still.all() == (name != "delta-by-hand")
    at = nominal(m)
    assert (at.status == 0).all()
    tree = Tree(m.spec())
    q = tree.close(tree.start, at.drives[0])
    slopes = m.core.sensitivity(at.drives, at.poses)["drive"]
    for k, drives in enumerate(at.drives):
        q = followed(tree, q, at.drives[max(k - 1, 0)], drives)
        position, rotation = (np.array([getattr(f, of) for f in tree.bodies()]) for of in ("translation", "rotation"))
        found, turned = at.poses[k, :, :3], matrices(at.poses[k])
        np.testing.assert_allclose(found[still], position[still], rtol=0, atol=1e-10 * m.length)
        np.testing.assert_allclose(turned[still], rotation[still], rtol=0, atol=1e-10)
        places = joint_places(m, position, rotation)
        np.testing.assert_allclose(joint_places(m, found, turned), places, rtol=0, atol=1e-10 * m.length)
        output = tree.at(tree.output)
        np.testing.assert_allclose(at.output[k, :3], output.translation, rtol=0, atol=1e-10 * m.length)
        jacobian = tree.jacobian(q)
        np.testing.assert_allclose(slopes[k], jacobian, rtol=0, atol=1e-10 * np.abs(jacobian).max())


def test_rods_keep_their_turn_relative_to_their_arms_less_the_swing_of_their_line() -> None:
    m = example("delta-by-hand")
    at, spec = nominal(m), m.spec()
    start, turned = matrices(np.array(spec["guess"])), [matrices(poses) for poses in at.poses]
    assert len(m.spins) == 6
    for spin in m.spins:
        (rod,) = spin.bodies
        ends = [spec["points"][spec["joints"][j][end]] for j in spin.joints for end in ("first", "second")]
        (arm,) = {p["body"] for p in ends[:2]} - {rod}
        one, other = (np.array(p["at"]) for p in ends if p["body"] == rod)
        line = (other - one) / np.linalg.norm(other - one)
        before = start[arm].T @ start[rod]
        for axes in turned:
            now = axes[arm].T @ axes[rod]
            swing, _ = Rotation.align_vectors(now @ line, before @ line)
            twist = Rotation.from_matrix(swing.as_matrix().T @ now @ before.T).as_rotvec()
            np.testing.assert_allclose(twist, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", SPATIAL_OVER_CONSTRAINED)
def test_an_over_constrained_mechanism_is_assembled_all_the_same(name: str) -> None:
    m = example(name)
    tree = Tree(m.spec())
    assert m.drive_values is not None
    for drives in m.drive_values[:3]:
        poses = m.core.assemble(drives)["poses"]
        tree.close(tree.start, drives)
        np.testing.assert_allclose(poses[:, :3], [f.translation for f in tree.bodies()], rtol=0, atol=1e-9 * m.length)
