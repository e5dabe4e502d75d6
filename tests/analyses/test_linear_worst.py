"""`worst` to first order is what the exact question finds on its way, and its errors belong to its offsets."""

import numpy as np
import pytest

import jointplay as jp
from jointplay import examples
from jointplay.analyses.nominal import nominal
from jointplay.analyses.region import around

DETERMINATE = [name for name in examples.names() if jp.loads(examples.text(name)).core.isostatic]
#: several outputs; too long
LEFT_OUT = ("slider-crank-cases", "delta-by-hand")


@pytest.mark.parametrize("name", [name for name in DETERMINATE if name not in LEFT_OUT])
def test_it_is_the_first_order_of_the_exact_question(name: str) -> None:
    m = jp.loads(examples.text(name))
    exact, linear = jp.worst(m), jp.worst(m, exact=False)
    for word in ("worst_position", "worst_rotation", "worst_component"):
        wanted = exact[f"{word}_first_order"].values
        # Both climb until steps give no more than some 1e-9 of the size.
        slack = 1e-7 * float(np.nanmax(np.abs(wanted)))
        np.testing.assert_allclose(linear[word], wanted, atol=slack)
        np.testing.assert_allclose(linear[f"{word}_first_order"], wanted, atol=slack)
    # Shares are those of the extreme; where two are equally large the other one may be found.
    sums = linear.contribution.sum("source")
    np.testing.assert_allclose(sums.sel(extreme="position"), linear.worst_position, rtol=1e-9)
    ends = [name for name in exact.extreme.values if name not in ("position", "rotation")]
    wanted = exact.contribution.sel(extreme=ends)
    np.testing.assert_allclose(
        linear.contribution.sel(extreme=ends), wanted, rtol=1e-7, atol=1e-7 * float(np.abs(wanted).max())
    )


@pytest.mark.parametrize("name", ["four-bar", "four-bar-fits", "3-upu", "antenna-support"])
def test_the_region_reaches_as_far_as_the_exact_question_says_to_first_order(name: str) -> None:
    m = jp.loads(examples.text(name))
    at = nominal(m)
    axes = sum(component in "xyz" for component in m.components)
    towards = around(axes, 12)
    exact = jp.region(m, directions=12).extent_first_order.values * m.units.length
    errors = m.core.region(at.drives, at.poses, towards, 0)["error"][..., :axes]
    np.testing.assert_allclose(np.sum(errors * towards, axis=2), exact, rtol=1e-9)


@pytest.mark.parametrize("name", ["four-bar", "four-bar-fits", "3-upu"])
def test_the_offsets_of_the_first_order_have_its_errors(name: str) -> None:
    m = jp.loads(examples.text(name))
    at = nominal(m)
    linear = m.core.worst(at.drives, at.poses, 0)
    slopes = m.core.sensitivity(at.drives, at.poses)["source"]
    ends = linear["component"].reshape(len(at), -1)
    moved = np.einsum("nkp,ncp->nkc", linear["offset"][:, 2:], slopes)
    np.testing.assert_allclose(
        moved[:, range(ends.shape[1]), np.arange(ends.shape[1]) // 2], ends, atol=1e-12 * np.abs(ends).max()
    )


def test_over_constrained_mechanisms_are_asked_to_first_order_as_well() -> None:
    m = jp.loads(examples.text("antenna-support"))
    exact, linear = jp.worst(m), jp.worst(m, exact=False)
    np.testing.assert_allclose(linear.worst_position, exact.worst_position_first_order, rtol=1e-9)
    assert abs(float(linear.worst_position[0]) / float(exact.worst_position[0]) - 1.0) > 1e-9


def test_where_there_is_no_pose_nothing_is_known() -> None:
    m = jp.loads(examples.text("four-bar")).with_({"drives.theta1.values": [40.0, 300.0]})
    linear = jp.worst(m, exact=False)
    assert linear.status.values.tolist() == jp.worst(m).status.values.tolist()
    assert np.isfinite(linear.worst_position.values).tolist() == [True, False]
