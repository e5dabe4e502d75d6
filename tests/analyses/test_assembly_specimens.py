"""Random units through an assembly: the units that `random` draws, solved as built units are."""

import itertools

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.nominal import nominal

DEVIATIONS = {"DF": 0.3, "DI": -0.4, "BD": 0.2}


@pytest.mark.parametrize("law", [None, "uniform", "boundary", "normal"])
@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "3-upu"])
def test_units_are_those_that_random_solves(name: str, law: str | None) -> None:
    m = example(name)
    at = nominal(m)
    kept = m.core.random(at.drives[:1], at.poses[:1], 500, 7, np.array([0.5]), None, law, 1, True)
    np.testing.assert_array_equal(m.core.specimens(500, 7, law), kept["kept_parameters"])


def test_a_unit_of_many_is_the_unit_that_a_file_describes() -> None:
    m = example("antenna-support").with_({"joints.*.clearance.radial": 0.04})
    at = nominal(m)
    u = np.array([m.centre, m.centre])
    for name, deviation in DEVIATIONS.items():
        u[1, m.parameters.index(f"{name}.length")] = deviation * m.units.length
    found = m.core.loaded_specimens(at.drives[:1], at.poses[:1], u)
    for k, built in enumerate((m, m.with_({f"dimensions.{n}.deviation": d for n, d in DEVIATIONS.items()}))):
        alone = built.core.loaded(at.drives[:1], at.poses[:1], True)
        assert found["clearance_factor"][k] == pytest.approx(alone["clearance_factor"][0], rel=1e-7)
        np.testing.assert_allclose(found["force"][k], alone["force"][0], rtol=1e-6, atol=1e-5)
        decided = np.repeat(alone["decided"][0], [len(s["centre"]) for s in m.core_spec["sources"]])
        np.testing.assert_allclose(found["offset"][k][decided], alone["offset"][0][decided], atol=1e-9)


def test_errors_of_the_centres_are_those_of_the_built_unit() -> None:
    """What is found from poses and deviations is what the core says of every centre as an output."""
    from jointplay.analyses.assemble.forces import Members
    from jointplay.analyses.assemble.report import place
    from jointplay.analyses.assemble.specimens import solve
    from jointplay.analyses.assemble.state import Held, state
    from jointplay.analyses.assemble.steps import steps

    changes = {f"dimensions.{name}.deviation": deviation for name, deviation in DEVIATIONS.items()}
    m = example("antenna-support").with_(changes | {"joints.*.clearance.radial": 0.03})
    members = Members(m)
    for step in steps(m, place(m, 0).poses):
        alone, units = state(step, members), solve(Held(step), members, m.centre[None])
        for end, expected, left in ((0, alone.shaft, alone.shaft_open), (1, alone.bearing, alone.bearing_open)):
            # In determinate steps a unit has its offsets, which are zero; a load pushes the built one.
            if step.freedom.redundancy == 0:
                continue
            sizes, slack = np.linalg.norm(expected[:, :2], axis=1), np.linalg.norm(left[:, :2], axis=1)
            np.testing.assert_array_less(
                np.abs(units.centres[end, :, 0] - sizes), slack + 1e-8, err_msg=str(step.members)
            )
            np.testing.assert_array_equal(np.isnan(units.centres[end, :, 0]), np.isnan(sizes))


def test_corners_of_many_tolerances_are_climbed_to_the_worst_of_all() -> None:
    m = example("antenna-support").with_({"dimensions.*.deviation": 0.0})
    sizes = dict(zip(m.data.dimensions, (0.9, 0.3, 1.1, 1.3, 1.0, 0.9, 0.7, 0.8), strict=True))
    m = m.with_({f"dimensions.{name}.tolerance": size for name, size in sizes.items()})
    # Both latched angles as well: ten tolerances, more than are tried one by one.
    m = m.with_({"joints.A.angle.tolerance": 0.05, "joints.F.angle.tolerance": 0.05})
    found = jp.assemble(m, "worst").worst_clearance_factor[-1].item()
    at = nominal(m)
    own = [k for k, s in enumerate(m.parameter_source) if m.source_kinds[int(s)] != "clearance"]
    high = np.array([m.core_spec["sources"][int(m.parameter_source[k])]["set"]["interval"]["high"] for k in own])
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=len(own))))[: 2 ** (len(own) - 1)]
    u = np.repeat(m.centre[None], len(corners), 0)
    u[:, own] += corners * high
    best = m.core.loaded_specimens(at.drives[:1], at.poses[:1], u)["clearance_factor"].max()
    assert found == pytest.approx(best, rel=0.02)
