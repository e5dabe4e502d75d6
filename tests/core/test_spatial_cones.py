"""The load-determined pose and the supports of all sets in space against cone programs."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from helpers.answers import EXAMPLES, example
from helpers.oracles import loops
from helpers.oracles.cones import Linearised
from jointplay import _core
from jointplay.analyses.nominal import nominal

Array = NDArray[np.float64]
SPATIAL = [name for name in EXAMPLES if example(name).pose_size == 7]
RANDOM = [(loops.loop, seed) for seed in (2, 5, 10)] + [(loops.platform, seed) for seed in (1, 5, 11)]


def shrunk(spec: dict[str, Any], factor: float) -> dict[str, Any]:
    """The same mechanism with all clearances multiplied."""
    spec = json.loads(json.dumps(spec))
    for source in spec["sources"]:
        if source["kind"] in ("clearance", "backlash"):
            ((_, size),) = source["set"].items()
            size |= {key: factor * size[key] for key in ("radius", "axial", "gap", "low", "high") if key in size}
    return spec


def check(spec: dict[str, Any], drives: Array, poses: Array) -> None:
    """First-order work, error and reactions of `loaded` at one configuration."""
    found = _core.Mechanism(json.dumps(spec)).loaded(drives[None], poses[None])
    closure = Linearised(spec, poses)
    best = closure.maximise(closure.load())
    error, want = found["error_first_order"][0], closure.output() @ best.twists.ravel()
    for part in (slice(3), slice(3, 6)):
        np.testing.assert_allclose(error[part], want[part], rtol=0, atol=1e-7 * np.linalg.norm(want[part]))
    if len(spec["loads"]) == 1:
        load = np.concatenate([spec["loads"][0]["force"], spec["loads"][0]["moment"]])
        assert error @ load == pytest.approx(best.work, rel=1e-9)
    # Reactions are told at the displaced pose, here of play a hundred-thousandth as wide.
    small = _core.Mechanism(json.dumps(shrunk(spec, 1e-5))).loaded(drives[None], poses[None])["reaction"][0]
    force = np.linalg.norm(best.reactions[:, :3], axis=1).max()
    scale = np.repeat([force, force * spec["length"]], 3)
    np.testing.assert_allclose(small / scale, best.reactions / scale, rtol=0, atol=2e-6)


@pytest.mark.parametrize("name", SPATIAL)
def test_examples_are_pushed_where_the_load_does_most_work(name: str) -> None:
    m = example(name)
    rng = np.random.default_rng(5)
    at = nominal(m)
    for k in {0, len(at) - 1}:
        # A load of its own, so that no reaction vanishes.
        load = {"force": 50 * rng.normal(size=3), "moment": 2e3 * rng.normal(size=3)}
        check(m.with_({"loads": [load]}).spec(), at.drives[k], at.poses[k])


@pytest.mark.parametrize("name", SPATIAL)
def test_examples_under_their_own_loads(name: str) -> None:
    """With gravity on several bodies, or along an axis: the work is decided even where the pose is not."""
    m = example(name)
    at, spec = nominal(m), m.spec()
    found = m.core.loaded(at.drives[:1], at.poses[:1])
    if _core.STATUSES[found["status"][0]] == "ok":
        check(spec, at.drives[0], at.poses[0])
        return
    assert name == "3-upu"
    closure = Linearised(spec, at.poses[0])
    load = np.concatenate([spec["loads"][0]["force"], spec["loads"][0]["moment"]])
    assert found["error_first_order"][0] @ load == pytest.approx(closure.maximise(closure.load()).work, rel=1e-9)


@pytest.mark.parametrize(("make", "seed"), RANDOM)
def test_random_mechanisms_of_all_joints(make: Callable[..., dict[str, Any]], seed: int) -> None:
    spec = make(seed, 1e-5, lost=seed > 2)
    drives = np.full((1, len(spec["drives"])), 2e-3)
    solved = _core.Mechanism(json.dumps(spec)).trace(drives)
    check(spec, drives[0], solved["poses"][0])


@pytest.mark.parametrize("seed", [1, 5])
def test_supports_of_every_set(seed: int) -> None:
    """One loosened joint at a time: the largest error of each component is the support of that joint's set."""
    spec = loops.platform(seed, 1e-5)
    drives = np.full((1, len(spec["drives"])), 2e-3)
    poses = _core.Mechanism(json.dumps(spec)).trace(drives)["poses"]
    kinds = {}
    for source in spec["sources"]:
        if source["kind"] == "clearance":
            kinds.setdefault(next(iter(source["set"])), source)
    assert set(kinds) == {"journal", "sleeve", "ball", "guide", "plate"}
    for source in kinds.values():
        one = {**spec, "sources": [source]}
        found = _core.Mechanism(json.dumps(one)).worst(drives, poses, 1)["component_first_order"][0]
        closure = Linearised(one, poses[0])
        for component, weights in enumerate(closure.output()):
            want = closure.maximise(weights).work
            assert found[component] == pytest.approx([-want, want], rel=1e-8, abs=1e-13)
