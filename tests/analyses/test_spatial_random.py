"""Scatter in space: variances of all sets, first order and exact, and what is told of the samples."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from helpers.answers import EXAMPLES, example
from helpers.oracles import loops, variances
from helpers.orders import NEAR, order
from jointplay import _core
from jointplay.analyses.nominal import nominal

Array = NDArray[np.float64]
SPATIAL = [name for name in EXAMPLES if example(name).pose_size == 7]
LEVELS = np.array([0.1, 0.5, 0.9, 0.99])
SAMPLES = 20_000


def draw(core: _core.Mechanism, drives: Array, poses: Array, **options: Any) -> dict[str, Array]:
    samples = options.pop("samples", SAMPLES)
    return core.random(drives, poses, samples, 11, LEVELS, keep=True, sampling="plain", **options)


def configuration(name: str) -> tuple[Array, Array]:
    at = nominal(example(name))
    return at.drives[-1:], at.poses[-1:]


def check_first_order(spec: dict[str, Any], drives: Array, poses: Array) -> None:
    core = _core.Mechanism(json.dumps(spec))
    slopes = core.sensitivity(drives, poses)["source"][0]
    found = core.random(drives, poses, 2, 1, LEVELS, None, "uniform")
    parts = [variances.variance(source) for source in spec["sources"]]
    want = (slopes * np.concatenate(parts)) @ slopes.T
    scale = np.sqrt(np.outer(np.diag(want), np.diag(want))) + 1e-30
    np.testing.assert_allclose(found["covariance_first_order"][0] / scale, want / scale, rtol=0, atol=1e-9)
    at = 0
    for part, own in zip(parts, found["contribution"][0], strict=True):
        mine = slopes[:, at : at + len(part)]
        at += len(part)
        np.testing.assert_allclose(own, (mine**2) @ part, rtol=1e-9, atol=1e-12 * want.max())


@pytest.mark.parametrize("name", SPATIAL)
def test_first_order_covariance_of_examples(name: str) -> None:
    check_first_order(example(name).spec(), *configuration(name))


def test_first_order_covariance_of_all_sets() -> None:
    spec = loops.platform(5, 1e-5)
    drives = np.full((1, len(spec["drives"])), 2e-3)
    check_first_order(spec, drives, _core.Mechanism(json.dumps(spec)).trace(drives)["poses"])


@pytest.mark.parametrize("name", SPATIAL)
def test_samples_tend_to_first_order_as_clearances_shrink(name: str) -> None:
    drives, poses = configuration(name)
    factors, gaps = 0.25 ** np.arange(3), []
    for factor in factors:
        spec = example(name).spec()
        for source in spec["sources"]:
            ((_, size),) = source["set"].items()
            size |= {key: factor * size[key] for key in ("radius", "axial", "gap", "low", "high") if key in size}
        core = _core.Mechanism(json.dumps(spec))
        found = draw(core, drives, poses)
        linear = found["kept_parameters"] @ core.sensitivity(drives, poses)["source"][0].T
        size = np.abs(linear).max(axis=0)
        gaps.append(np.abs(found["kept_errors"] - linear).max(axis=0) / np.where(size > 1e-15, size, np.inf))
        exact, first = np.diag(found["covariance"][0]), np.diag(found["covariance_first_order"][0])
        # Five standard errors of a variance, and what is of second order.
        np.testing.assert_allclose(exact, first, rtol=5 * np.sqrt(2 / SAMPLES) + 4 * gaps[-1].max(), atol=1e-25)
    # The difference is of second order. Nothing moves the first components of some errors to first order.
    assert (gaps[0] < 0.2).all()
    moved = gaps[0] > 1e-9
    assert order(factors, np.array(gaps)[:, moved]) == pytest.approx(1.0, abs=NEAR)


@pytest.mark.parametrize("name", SPATIAL)
def test_what_is_told_of_the_samples(name: str) -> None:
    m = example(name)
    drives, poses = configuration(name)
    first = draw(m.core, drives, poses)
    errors = first["kept_errors"]
    assert first["failures"][0].tolist() == [SAMPLES] + [0] * (len(_core.STATUSES) - 1)
    distances, turns = np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1)
    quantities = np.column_stack([errors, distances, turns])
    np.testing.assert_allclose(first["mean"][0], errors.mean(axis=0), rtol=1e-9, atol=1e-9 * np.abs(errors).max())
    np.testing.assert_allclose(first["covariance"][0], np.cov(errors.T), rtol=1e-8, atol=1e-9 * errors.var())
    np.testing.assert_allclose(first["largest"][0], np.abs(quantities).max(axis=0), rtol=1e-12, atol=1e-16)
    for q, values in enumerate(quantities.T):
        edges, counts = first["edges"][0, q], first["histogram"][0, q]
        assert counts.sum() == SAMPLES
        if np.ptp(values) < 1e-12:
            continue  # the rocker of the RSSR turns about x only
        own, _ = np.histogram(values, edges)
        # A value at an edge may be counted on either side of it.
        assert np.abs(own - counts).sum() <= 4
        np.testing.assert_allclose(
            first["quantile"][0, :, q],
            np.quantile(values, LEVELS),
            rtol=0,
            atol=first["quantile_resolution"][0, q] + 1e-3 * np.ptp(values),
        )
    limits = (float(np.quantile(distances, 0.9)), float(np.quantile(turns, 0.95)))
    outside = (distances > limits[0]) | (turns > limits[1])
    free = [[-np.inf, np.inf]] * errors.shape[1]
    most = np.array([*free, [-np.inf, limits[0]], [-np.inf, limits[1]]])
    again = draw(m.core, drives, poses, limits=most)
    assert again["outside"][0] == pytest.approx(outside.mean(), abs=1.5 / SAMPLES)


def test_units_that_cannot_be_assembled_are_counted() -> None:
    """A ball with 60 mm of play, beside a coupler of 176 mm: some units do not close."""
    m = example("rssr").with_({"joints.ball.clearance.radial": 60})
    at = nominal(m)
    found = draw(m.core, at.drives[:1], at.poses[:1], samples=1000)
    failures, ok = found["failures"][0], found["kept_status"] == 0
    assert failures.sum() == 1000
    assert 0 < failures[0] < 1000
    assert failures[0] == ok.sum()
    assert np.isfinite(found["kept_errors"][ok]).all()
    assert np.isnan(found["kept_errors"][~ok]).all()
    assert (found["histogram"][0].sum(axis=1) == failures[0]).all()
    # With the crank at zero the coupler spans from (30, 0, 0) to the tip of the rocker, less the play of the ball.
    ball = [m.parameters.index(f"ball.{axis}") for axis in "xyz"]
    offsets = found["kept_parameters"][:, None, ball]
    angle = np.linspace(0, 2 * np.pi, 721)
    tips = np.column_stack([0.13 + 0 * angle, -0.1 * np.sin(angle), -0.06 + 0.1 * np.cos(angle)]) - [0.03, 0.0, 0.0]
    slack = 1e-3  # of the other joints' play, the tolerance and the steps of the angle
    # The branch of a unit is followed while its deviations grow. Some units fit by themselves although it ends on the
    # way, where the offset would need a longer coupler.
    surely = np.ones(len(ok), dtype=bool)
    for part in np.linspace(0.0, 1.0, 41):
        spans = np.linalg.norm(tips - part * offsets, axis=2)
        surely &= (spans.min(axis=1) < 0.176 - slack) & (spans.max(axis=1) > 0.176 + slack)
    never = (spans.min(axis=1) > 0.176 + slack) | (spans.max(axis=1) < 0.176 - slack)
    assert surely.sum() > 600
    assert never.sum() > 100
    assert ok[surely].all()
    assert not ok[never].any()
