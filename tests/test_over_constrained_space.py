"""Over-constrained mechanisms in space against cone programs on the twists of all bodies."""

from __future__ import annotations

import numpy as np
import pytest

import jointplay as jp
from answers import example
from jointplay.analyses.nominal import nominal
from oracles.cones import Linearised

LOADS = [([8.0, -5.0, -100.0], [300.0, 900.0, -400.0]), ([-20.0, 35.0, 60.0], [-500.0, 200.0, 900.0])]


def sarrus(load: int, **changes: object) -> jp.Mechanism:
    force, moment = LOADS[load]
    return example("sarrus").with_({"loads": [{"force": force, "moment": moment}], **changes})


@pytest.mark.parametrize("load", range(len(LOADS)))
def test_the_load_does_as_much_work_as_it_can(load: int) -> None:
    """The optimum over twists and offsets is the same; and so is the pose, as far as the load decides it."""
    m = sarrus(load)
    at = nominal(m)
    found = m.core.loaded(at.drives, at.poses, False)
    for k in range(len(at)):
        closure = Linearised(m.spec(), at.poses[k])
        best = closure.maximise(closure.load())
        error, open_ = found["error"][k], found["undetermined"][k]
        weights = np.concatenate([m.spec()["loads"][0]["force"], m.spec()["loads"][0]["moment"]])
        assert error @ weights == pytest.approx(best.work, rel=1e-9)
        want = closure.output() @ best.twists.ravel()
        size = np.repeat([np.abs(want[:3]).max(), np.abs(want[3:]).max()], 3)
        assert (np.abs(error - want) <= open_ + 1e-6 * size).all()


def test_reactions_are_in_equilibrium_with_the_load() -> None:
    m = sarrus(0)
    found = jp.loaded(m)
    force = found.reaction.sel(wrench=["fx", "fy", "fz"])
    # Two chains carry the table; each pushes it where its last hinge is.
    total = force.sel(joint=["a3", "b3"]).sum("joint").values
    np.testing.assert_allclose(total, np.broadcast_to(np.negative(LOADS[0][0]), total.shape), rtol=1e-9)
    # Links without weight hand on what they get.
    for chain in "ab":
        first = force.sel(joint=f"{chain}1").values
        for other in "23":
            np.testing.assert_allclose(force.sel(joint=f"{chain}{other}").values, first, rtol=1e-9, atol=1e-9)


def test_perfect_hinges_fit() -> None:
    m = sarrus(0, **{f"joints.*.clearance.{key}": 0.0 for key in ("radial", "axial")})
    found = jp.loaded(m)
    assert (found.status == "ok").all()
    assert (found.clearance_factor == 0.0).all()
    np.testing.assert_allclose(found.lack_of_fit, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.error, 0.0, atol=1e-12)
    # Rigid hinges share the load in a way that nothing decides.
    assert np.isnan(found.reaction.values).any()


def test_lengths_of_links_are_not_what_is_redundant() -> None:
    """Either chain stands where the other wants it, whatever its links measure: the redundant constraint is a turn."""
    deviation = {"body": "lower_b", "between": ["b1", "b2"], "deviation": 0.05}
    assert (jp.loaded(sarrus(0, dimensions={"long": deviation})).clearance_factor < 1e-9).all()
