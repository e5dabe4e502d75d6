"""Displaced mechanisms as they are drawn: their output is where the questions say, whatever gives way and deviates."""

import numpy as np
import pytest

import jointplay as jp
from jointplay.analyses import loaded, worst
from jointplay.analyses.displaced import Displaced, at_offsets, shifts, under_load
from jointplay.analyses.nominal import nominal
from jointplay.basics.poses import ground
from jointplay.result import size
from jointplay.show.viewer import DisplacedScene, scene

#: pins alone, known deviations, elastic members and legs, flanks that press against each other, over-constrained ones
NAMES = (
    *("slider-crank", "antenna-support", "redundant-bar", "x-braced-square", "four-legged-platform"),
    *("planetary-gear", "sarrus", "belt-arm", "stewart-gough"),
)


def of_example(name: str) -> jp.Mechanism:
    return jp.loads(jp.examples.text(name))


def check(m: jp.Mechanism, moved: Displaced, wanted: np.ndarray) -> None:
    at = nominal(m)
    found = shifts(m, at, moved)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * m.length / m.units.length)
    if "relative_to" in m.core_spec["output"]:
        return
    # The drawing on pages has the same numbers, four digits of the largest.
    drawn = scene(m, at, displaced=[DisplacedScene("moved", *moved)])
    moves = np.array(drawn["states"][0]["moves"], dtype=float)
    np.testing.assert_allclose(
        np.linalg.norm(moves[:, drawn["output"]], axis=1), wanted, atol=2e-4 * float(np.abs(moves).max())
    )


@pytest.mark.parametrize("name", NAMES)
def test_under_load_the_output_is_where_the_load_pushes_it(name: str) -> None:
    m = of_example(name)
    check(m, under_load(m, nominal(m)), size(loaded.compute(m), "error", "position"))


@pytest.mark.parametrize("name", NAMES)
def test_at_the_worst_offsets_the_output_is_at_its_largest_error(name: str) -> None:
    m = of_example(name)
    found = worst.compute(m)
    offsets = found.get("worst_offset", extreme="position")
    check(m, at_offsets(m, nominal(m), offsets), found.get("worst_position"))


@pytest.mark.parametrize("case", ["feed", "retract"])
def test_an_output_that_another_body_sees(case: str) -> None:
    """The crank pin as the slider sees it, in each of the load cases."""
    m = of_example("slider-crank-cases").only("pin", case)
    check(m, under_load(m, nominal(m)), size(loaded.compute(m), "error", "position"))
    found = worst.compute(m)
    check(m, at_offsets(m, nominal(m), found.get("worst_offset", extreme="position")), found.get("worst_position"))


def test_every_configuration_has_its_own_loads() -> None:
    values = [30.0, 45.0, 60.0]
    forces = [[0.0, -10.0], [10.0, 0.0], [0.0, 10.0]]
    base = of_example("four-bar").with_({"drives.theta1.values": values})
    m = base.with_({"loads.0.force": forces})
    moved = under_load(m, nominal(m)).poses
    for k, force in enumerate(forces):
        alone = base.with_({"drives.theta1.values": [values[k]], "loads.0.force": force})
        np.testing.assert_allclose(moved[k], under_load(alone, nominal(alone)).poses[0], atol=1e-12)


def test_a_joint_without_clearance_stays_closed_where_lengths_deviate() -> None:
    """Both of its points are at one place, as the deviation has moved them within their bodies."""
    m = of_example("redundant-bar").with_({"joints.P.clearance": None})
    at = nominal(m)
    poses, points = under_load(m, at)
    every = np.vstack([poses[0], ground(3)])
    joint = m.core_spec["joints"][m.joints.index("P")]
    places = []
    for end in (joint["first"], joint["second"]):
        x, y, angle = every[m.core_spec["points"][end]["body"]]
        turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        places.append(np.array([x, y]) + turned @ points[0, end, :2])
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)
