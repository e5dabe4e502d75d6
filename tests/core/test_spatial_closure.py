"""Mechanisms in space: the closure, its derivatives and its statics, over random mechanisms of all joint kinds."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from helpers.oracles import loops
from jointplay import _core

Array = NDArray[np.float64]
#: seeds of mechanisms that are not near a singularity, where samples could not be assembled
CASES = [(loops.loop, seed) for seed in (2, 4, 5, 6, 10, 11)]
CASES += [(loops.platform, seed) for seed in (1, 4, 5, 7, 11, 13)]
SIZE = 0.3  # metres


def core_of(spec: dict[str, Any]) -> _core.Mechanism:
    return _core.Mechanism(json.dumps(spec))


def start(core: _core.Mechanism, spec: dict[str, Any]) -> tuple[Array, Array]:
    """Drive values, all zero in the reference configuration but for a little, and the nominal poses there."""
    drives = np.full((1, len(spec["drives"])), 2e-3)
    solved = core.trace(drives)
    assert _core.STATUSES[solved["status"][0]] == "ok"
    return drives, solved["poses"]


def draw(core: _core.Mechanism, drives: Array, poses: Array, n: int) -> tuple[Array, Array]:
    """Admissible parameters and the errors that Monte Carlo found for them."""
    kept = core.random(drives, poses, n, 5, np.array([0.5]), None, None, 1, True)
    assert not kept["failures"][0, 1:].any()
    return kept["kept_parameters"], kept["kept_errors"]


@pytest.mark.parametrize(("make", "seed"), CASES)
def test_joints_are_displaced_by_their_offsets(make: Callable[[int, float], dict[str, Any]], seed: int) -> None:
    """The displacements, told a second time from the solved poses, are those asked for."""
    spec = make(seed, 2e-4)
    core = core_of(spec)
    drives, poses = start(core, spec)
    parameters, _ = draw(core, drives, poses, 8)
    for u in parameters:
        given = core.given(drives, poses, u[None])
        assert _core.STATUSES[given["status"][0]] == "ok"
        moved: dict[int, Array] = {}
        want = [np.zeros(len(loops.LOCKED[joint["kind"]])) for joint in spec["joints"]]
        at = 0
        for source in spec["sources"]:
            values = u[at : at + len(source["centre"])]
            at += len(values)
            if source["kind"] == "clearance":
                want[source["joint"]] = values
            elif source["kind"] == "angle":
                want[source["joint"]] = np.array([0, 0, 0, values[0], 0, 0])
            elif source["kind"] == "dimension":
                ends = [np.array(spec["points"][source[end]]["at"]) for end in ("from", "to")]
                line = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
                moved[source["to"]] = ends[1] + values[0] * line
        for found, wanted in zip(loops.offsets(spec, given["poses"][0], moved), want, strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize(("make", "seed"), CASES)
def test_first_order_is_the_derivative_of_the_closure(make: Callable[[int, float], dict[str, Any]], seed: int) -> None:
    spec = make(seed, 1e-4)
    core = core_of(spec)
    drives, poses = start(core, spec)
    map_ = core.sensitivity(drives, poses)["source"][0]
    n = map_.shape[1]
    step = 1e-6
    for p in range(n):
        ends = []
        for sign in (1.0, -1.0):
            u = np.zeros((1, n))
            u[0, p] = sign * step
            ends.append(core.given(drives, poses, u)["error"][0])
        # Central differences: the third derivative, of the order of the map over the size squared, is left.
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step), map_[:, p], atol=1e-6 * np.abs(map_).max())


@pytest.mark.parametrize(("make", "seed"), CASES)
def test_batch_samples_are_those_of_the_plain_closure(make: Callable[[int, float], dict[str, Any]], seed: int) -> None:
    spec = make(seed, 1e-4)
    core = core_of(spec)
    drives, poses = start(core, spec)
    parameters, errors = draw(core, drives, poses, 96)
    given = core.given(np.repeat(drives, 96, 0), np.repeat(poses, 96, 0), parameters)
    np.testing.assert_allclose(errors, given["error"], atol=1e-13 * max(1.0, np.abs(errors).max() / SIZE))
    before = _core.simd()
    try:
        assert _core.simd("plain") == "plain"
        np.testing.assert_array_equal(draw(core, drives, poses, 96)[1], errors)
    finally:
        _core.simd(before)


@pytest.mark.parametrize(("make", "seed"), CASES)
def test_loads_and_reactions_do_work_as_one(make: Callable[[int, float], dict[str, Any]], seed: int) -> None:
    """Reactions hold the output: over any small offsets the load's work is that of the reactions (virtual work)."""
    spec = make(seed, 1e-4)
    core = core_of(spec)
    drives, poses = start(core, spec)
    loaded = core.loaded(drives, poses)
    load = np.concatenate([spec["loads"][0]["force"], spec["loads"][0]["moment"]])
    # The support point of every set along the reaction: the load's work is the largest over samples.
    work = loaded["error_first_order"][0] @ load
    map_ = core.sensitivity(drives, poses)["source"][0]
    parameters, _ = draw(core, drives, poses, 256)
    clearance = np.concatenate([
        np.full(len(s["centre"]), s["kind"] == "clearance") for s in spec["sources"]
    ])  # fmt: skip
    samples = (parameters * clearance) @ map_.T @ load
    assert samples.max() <= work * (1 + 1e-12)
    # Balance of every body in ground axes: reactions on it and the load add up to zero.
    position = np.vstack([poses[0, :, :3], np.zeros(3)])
    rotation = np.concatenate([loops.matrices(poses[0]), np.eye(3)[None]])

    def place(point: int) -> tuple[int, Array]:
        body = spec["points"][point]["body"]
        return body, position[body] + rotation[body] @ np.array(spec["points"][point]["at"])

    small = make(seed, 1e-9)  # reactions are told at the displaced pose
    reactions = core_of(small).loaded(drives, poses)["reaction"][0]
    total = np.zeros((spec["n_bodies"] + 1, 6))
    body, at = place(spec["output"]["point"])
    total[body] += [*load[:3], *(load[3:] + np.cross(at, load[:3]))]
    for joint, reaction in zip(spec["joints"], reactions, strict=True):
        (first, _), (second, at) = place(joint["first"]), place(joint["second"])
        wrench = np.concatenate([reaction[:3], reaction[3:] + np.cross(at, reaction[:3])])
        total[second] += wrench
        total[first] -= wrench
    scale = np.abs(reactions).max()
    driven = {drive["joint"] for drive in spec["drives"]}
    loose = {place(spec["joints"][j][end])[0] for j in driven for end in ("first", "second")}
    for body in set(range(spec["n_bodies"])) - loose:
        np.testing.assert_allclose(total[body], 0.0, atol=1e-6 * scale)
