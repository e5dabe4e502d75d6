"""Random over-constrained planar mechanisms against a cone program on the displacements of all bodies."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.platforms import mechanism, platform, primal
from helpers.trusses import RADIAL, random_square


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("sliders", [0, 2, 4])
def test_a_rigid_platform_goes_where_the_load_does_most_work(seed: int, sliders: int) -> None:
    text, _ = platform(seed, sliders=sliders)
    found = jp.loaded(mechanism(text, {}), exact=False)
    program = primal(text, {})
    best = program.solve()
    together = found.status[0].item() != "not_assemblable"
    assert together == best.solved
    if not together:
        assert found.clearance_factor[0].item() > 1.0
        return
    assert found.clearance_factor[0].item() < 1.0
    (load,) = mechanism(text, {}).raw["loads"]
    weights = np.array([*load["force"], load["moment"]])
    # The load acts at the output; its own work is what the pose maximises.
    assert found.error.values[0] @ weights == pytest.approx(-best.value, rel=1e-8, abs=1e-9)
    open_ = found.undetermined.values[0]
    size = np.array([0.05, 0.05, 5e-4])
    assert (np.abs(found.error.values[0] - best.error) <= open_ + 1e-5 * size).all()


@pytest.mark.parametrize("seed", range(6))
def test_an_elastic_platform_has_the_least_energy(seed: int) -> None:
    text, stiffness = platform(seed, elastic=True, sliders=0)
    found = jp.loaded(mechanism(text, stiffness), exact=False)
    best = primal(text, stiffness).solve()
    assert best.solved
    want = np.array([best.elongation[f"l{k}.length"] for k in range(6)])
    np.testing.assert_allclose(found.member_elongation.values[0], want, atol=1e-6 * np.abs(want).max())
    np.testing.assert_allclose(
        found.member_force.values[0], want * np.array(list(stiffness.values())), atol=1e-6 * 2000 * np.abs(want).max()
    )
    open_ = found.undetermined.values[0]
    size = np.abs(best.error).max() * np.array([1.0, 1.0, 0.01])
    assert (np.abs(found.error.values[0] - best.error) <= open_ + 1e-5 * size).all()


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_what_the_load_leaves_open_is_what_poses_of_most_work_reach(seed: int) -> None:
    """A bar of a rigid truss that carries nothing turns in its pins; the output sits on one like that or moves on."""
    base = random_square(seed)
    radial = {node: 1.5 * base.factor() * r for node, r in RADIAL.items()}
    truss = random_square(seed, radial=radial)
    for name, bar in zip(truss.names, truss.bars, strict=True):
        node = next(end for end in bar if end in truss.free)
        text = truss.text().replace(f'body = "{truss.carrier("C")}"\nat = "C"', f'body = "{name}"\nat = "{node}"')
        # The load stays where it was.
        text = text.replace("\nforce =", f'\nbody = "{truss.carrier("C")}"\nat = "C"\nforce =')
        found = jp.loaded(jp.loads(text, "truss.toml"), exact=False)
        program = primal(text, {}, 0.1)
        work = -program.solve().value
        for k in range(3):
            low, high = program.extremes(k, work - 1e-9 * abs(work))
            unit = math.degrees(1.0) if k == 2 else 1.0
            reach = found.undetermined.values[0, k] / unit
            middle = found.error.values[0, k] / unit
            # The poses of nearly that work reach a little farther, on discs by the root of what they lack.
            scale = 0.1 if k < 2 else 1e-3
            assert reach == pytest.approx(max(high - middle, middle - low), rel=1e-3, abs=1e-3 * scale)
            assert low - 1e-3 * scale <= middle <= high + 1e-3 * scale
