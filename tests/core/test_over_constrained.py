"""Over-constrained mechanisms with clearances: assembly, the pose under load, prestress; against other programs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize, root

import jointplay as jp
from helpers.oracles.truss import Truss, square
from helpers.orders import NEAR, order
from helpers.trusses import RADIAL, mechanism, random_square


@pytest.mark.parametrize("seed", range(6))
def test_the_clearance_factor_is_that_of_a_linear_program_and_of_the_self_stress(seed: int) -> None:
    truss = random_square(seed)
    found = jp.loaded(mechanism(truss), exact=False)
    (stress,) = truss.self_stresses()
    formula = abs(stress @ truss.gaps()) / (np.abs(stress) @ truss.loose())
    assert truss.factor() == pytest.approx(formula, rel=1e-9)
    assert found.clearance_factor[0].item() == pytest.approx(formula, rel=1e-9)
    assert (found.status[0].item() == "not_assemblable") == (formula > 1.0)


@pytest.mark.parametrize("seed", range(3))
def test_it_goes_together_just_when_the_factor_says_so(seed: int) -> None:
    truss = random_square(seed)
    for factor, together in ((0.999, False), (1.001, True)):
        radial = {node: factor * truss.factor() * r for node, r in RADIAL.items()}
        found = jp.loaded(mechanism(random_square(seed, radial=radial)), exact=False)
        assert (found.status[0].item() != "not_assemblable") == together
        assert np.isfinite(found.error.values).all() == together
        # What cannot be assembled still says how far it is from that.
        assert found.clearance_factor[0].item() == pytest.approx(1.0 / factor, rel=1e-9)


def test_a_bar_between_two_pins_is_unstressed_in_its_dead_band() -> None:
    r1, r2, k = 0.03, 0.05, 2500.0
    for g in (-0.3, -0.09, -0.05, 0.0, 0.07, 0.081, 0.4):
        truss = Truss(
            {"A": (0.0, 0.0), "B": (100.0, 0.0)},
            ("A", "B"),
            (("A", "B"),),
            {"A": r1, "B": r2},
            {"AB": g},
            {"AB": k},
        )
        found = jp.loaded(mechanism(truss))
        tension = -k * math.copysign(1.0, g) * max(0.0, abs(g) - r1 - r2)
        assert found.member_force.values.item() == pytest.approx(tension, rel=1e-9, abs=1e-9)
        assert found.member_elongation.values.item() == pytest.approx(tension / k, rel=1e-9, abs=1e-12)
        assert found.clearance_factor.values.item() == pytest.approx(abs(g) / (r1 + r2), rel=1e-9)
        assert (found.status[0].item() == "strained") == (abs(g) > r1 + r2)
        # The ground holds the bar's ends apart with the same force.
        push = found.reaction.sel(wrench="fx").values[0]
        assert sorted(push[np.abs(push) > 1e-6]) == pytest.approx(
            [] if tension == 0 else sorted([-tension, tension, -tension]), rel=1e-9
        )


@pytest.mark.parametrize("seed", range(4))
def test_without_clearance_it_is_the_direct_stiffness_method(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stiffness = {name: float(k) for name, k in zip(square().names, rng.uniform(500, 5000, 5), strict=True)}
    truss = random_square(seed, radial={}, stiffness=stiffness)
    displacement, tension = truss.direct_stiffness()
    found = jp.loaded(mechanism(truss), exact=False)
    assert found.status[0].item() == "strained"
    assert found.clearance_factor[0].item() == math.inf
    np.testing.assert_allclose(found.member_force[0], tension, rtol=1e-9)
    np.testing.assert_allclose(found.member_elongation[0], tension / np.array(list(stiffness.values())), rtol=1e-9)
    at = 2 * truss.free.index("C")
    np.testing.assert_allclose(found.error[0, :2], displacement[at : at + 2], rtol=1e-9)
    # The prestress is that without load.
    _, own = random_square(seed, radial={}, stiffness=stiffness, load=(0.0, 0.0)).direct_stiffness()
    members = found.prestress.sel(wrench=["fx", "fy"]).values[0]
    sizes = np.linalg.norm(members, axis=1)
    for value in np.abs(own):
        assert np.isclose(sizes, value, rtol=1e-9).any()


def test_stiff_bars_are_rigid_ones() -> None:
    """A truss that its clearances just absorb, under a load that takes up all of them."""
    base = random_square(3)
    radial = {node: 1.5 * base.factor() * r for node, r in RADIAL.items()}
    rigid = jp.loaded(mechanism(random_square(3, radial=radial)), exact=False)
    assert rigid.status[0].item() in ("ok", "undetermined")
    last = math.inf
    for k in (1e4, 1e6, 1e8):
        stiffness = dict.fromkeys(base.names, k)
        found = jp.loaded(mechanism(random_square(3, radial=radial, stiffness=stiffness)), exact=False)
        away = np.abs(found.error.values[0, :2] - rigid.error.values[0, :2]).max()
        assert away < 0.02 * last
        last = away
    assert last < 1e-5


def test_small_clearances_are_exact_to_first_order() -> None:
    """The exact pose differs from the linear one by a square of the clearances."""
    base = random_square(4)
    sizes, remainders = 0.5 ** np.arange(5), []
    for size in sizes:
        factor = size * 1.5 * base.factor()
        radial = {node: factor * r for node, r in RADIAL.items()}
        deviation = {name: size * d for name, d in base.deviation.items()}
        found = jp.loaded(mechanism(random_square(4, radial=radial, deviation=deviation)))
        # One bar carries nothing, as a once over-constrained rigid truss leaves it; nodes do not feel it.
        assert found.status[0].item() == "undetermined"
        assert (found.undetermined.values[0, :2] < 1e-9).all()
        remainders.append((found.error.values - found.error_first_order.values)[0, :2])
    assert np.abs(remainders[0]).max() < 0.05 * np.abs(found.error_first_order.values[0, :2]).max() / sizes[-1]
    assert order(sizes, remainders) == pytest.approx([2.0, 2.0], abs=NEAR)


def test_offsets_of_the_pose_close_the_mechanism_and_others_do_not() -> None:
    base = random_square(5)
    radial = {node: 1.5 * base.factor() * r for node, r in RADIAL.items()}
    m = mechanism(random_square(5, radial=radial))
    loaded = jp.loaded(m)
    assert loaded.status[0].item() in ("ok", "undetermined")
    given = jp.given(m, loaded)
    assert given.status[0].item() == "ok"
    np.testing.assert_allclose(given.error, loaded.error, rtol=1e-9, atol=1e-12)
    apart = jp.given(m)
    assert apart.status[0].item() == "not_assemblable"
    assert np.isnan(apart.error.values).all()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [1.0, 20.0])
def test_the_exact_pose_has_the_least_energy(seed: int, size: float) -> None:
    """Bars as springs with a dead band between the nodes: their energy needs neither joints nor small displacements."""
    radial = {node: size * r for node, r in RADIAL.items()}
    stiffness = {name: 400.0 + 300.0 * k for k, name in enumerate(square().names)}
    truss = random_square(seed, radial=radial, stiffness=stiffness)
    truss = replace(truss, deviation={name: size * d for name, d in truss.deviation.items()})
    names = truss.free

    k, drawn = np.array(list(stiffness.values())), np.linalg.norm([truss.vector(bar) for bar in truss.bars], axis=1)

    # How much every bar is stretched beyond its dead band, and the forces that are left on the nodes.
    def bars(moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = {node: np.array(place) for node, place in truss.nodes.items()}
        at |= {node: at[node] + moved[2 * i : 2 * i + 2] for i, node in enumerate(names)}
        apart = np.array([at[b] - at[a] for a, b in truss.bars])
        beyond = np.linalg.norm(apart, axis=1) - drawn - truss.gaps()
        stretched = np.sign(beyond) * np.maximum(0.0, np.abs(beyond) - truss.loose())
        pull = (k * stretched / np.linalg.norm(apart, axis=1))[:, None] * apart
        left = -truss.forces()
        for i, node in enumerate(names):
            ends = np.array([(node == b) - (node == a) for a, b in truss.bars], dtype=float)
            left[2 * i : 2 * i + 2] += ends @ pull
        return stretched, left

    def energy(moved: np.ndarray) -> float:
        return float(0.5 * k @ bars(moved)[0] ** 2 - truss.forces() @ moved)

    found = jp.loaded(mechanism(truss))
    assert found.status[0].item() in ("ok", "undetermined", "strained")
    best = minimize(energy, np.zeros(4), jac=lambda moved: bars(moved)[1], method="BFGS", options={"gtol": 1e-6})
    sharp = root(lambda moved: bars(moved)[1], best.x, tol=1e-14).x
    np.testing.assert_allclose(sharp, best.x, atol=1e-5 * size)
    assert np.abs(bars(sharp)[1]).max() < 1e-9
    at = 2 * names.index("C")
    np.testing.assert_allclose(found.error[0, :2], sharp[at : at + 2], atol=1e-9 * size)
    np.testing.assert_allclose(found.member_elongation[0], bars(sharp)[0], atol=1e-9 * size)


def test_two_structures_without_drives_are_compared_where_they_stand() -> None:
    stiff, soft = (mechanism(random_square(2, stiffness=dict.fromkeys(square().names, k))) for k in (4000.0, 400.0))
    found = jp.compare(stiff, soft, "loaded")
    for k, m in enumerate((stiff, soft)):
        np.testing.assert_allclose(found.error.isel(mechanism=k).values, jp.loaded(m).error.values, rtol=1e-12)
