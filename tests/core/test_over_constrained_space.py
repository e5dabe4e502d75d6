"""Over-constrained mechanisms in space against cone programs on the twists of all bodies."""

import json

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.oracles.cones import Linearised
from helpers.stacks import stack
from jointplay import _core
from jointplay.analyses.nominal import nominal

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


@pytest.mark.parametrize("seed", range(10))
def test_bodies_held_by_joints_of_all_kinds(seed: int) -> None:
    spec = stack(seed)
    core = _core.Mechanism(json.dumps(spec))
    assert len(core.rows) > 15
    solved = core.trace(np.zeros((1, 0)))
    assert _core.STATUSES[solved["status"][0]] == "ok"
    closure = Linearised(spec, solved["poses"][0])
    best = closure.maximise(closure.load())
    found = core.loaded(np.zeros((1, 0)), solved["poses"], False)
    assert _core.STATUSES[found["status"][0]] in ("ok", "undetermined")
    load = np.concatenate([spec["loads"][0]["force"], spec["loads"][0]["moment"]])
    error = found["error"][0]
    assert error @ load == pytest.approx(best.work, rel=1e-8)
    want = closure.output() @ best.twists.ravel()
    size = np.repeat([np.abs(want[:3]).max(), np.abs(want[3:]).max()], 3)
    assert (np.abs(error - want) <= found["undetermined"][0] + 1e-5 * size).all()
    # Whatever the joints share: they carry the load.
    ends = [closure.place(joint["second"])[1] for joint in spec["joints"]]
    force, moment = found["reaction"][0, 4:, :3], found["reaction"][0, 4:, 3:]
    at = closure.place(spec["output"]["point"])[1]
    np.testing.assert_allclose(force.sum(axis=0), np.negative(load[:3]), rtol=1e-9)
    lever = np.cross(np.array(ends[4:]) - at, force).sum(axis=0)
    np.testing.assert_allclose(lever + moment.sum(axis=0), np.negative(load[3:]), rtol=1e-7, atol=1e-7)
    # On the exact closure, of play so small, nothing changes.
    exact = core.loaded(np.zeros((1, 0)), solved["poses"], True)
    assert (np.abs(exact["error"][0] - error) <= found["undetermined"][0] + 2e-3 * size).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_worst_of_bodies_held_by_joints_of_all_kinds(seed: int) -> None:
    spec = stack(seed)
    core = _core.Mechanism(json.dumps(spec))
    poses = core.trace(np.zeros((1, 0)))["poses"]
    found = core.worst(np.zeros((1, 0)), poses, 6)
    closure = Linearised(spec, poses[0])
    for k, weights in enumerate(closure.output()):
        wanted = closure.maximise(weights).work
        np.testing.assert_allclose(found["component_first_order"][0, k], [-wanted, wanted], rtol=1e-7)
    np.testing.assert_allclose(found["component"], found["component_first_order"], rtol=5e-3)
