"""Every derivative against finite differences and against complex steps of an independent closure."""

from itertools import pairwise, product

import numpy as np
import pytest

import jointplay as jp
from helpers.layouts import KINDS
from helpers.oracles import brute
from helpers.oracles.reading import read
from helpers.strategies import given_offsets, mechanism, turn

SEEDS = range(2)
RADIAN = np.array([1.0, 1.0, np.rad2deg(1.0)])


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_output_by_every_source(kind: str, seed: int) -> None:
    """One source at a time: first order is linear, the central difference of error, and the oracle's."""
    text = mechanism(kind, seed, configurations=1)
    link, m = read(text), jp.loads(text)
    expected, _ = link.sensitivity(link.nominal(link.configurations[0]), link.configurations[0])
    for k, label in enumerate(link.labels):
        # 1e-4 of a length, or of a radian: truncation 1e-8, rounding 1e-11 of the derivative.
        h = 1e-4 if label.endswith((".angle",)) or _angular(link, label) else 1e-4 * link.length
        up = jp.given(m, given_offsets(link, {label: h}))
        down = jp.given(m, given_offsets(link, {label: -h}))
        slope = (up.error[0].values - down.error[0].values) / (2 * h) / RADIAN
        linear = up.error_first_order[0].values / h / RADIAN
        size = max(1.0, float(np.abs(expected[:, k]).max()))
        np.testing.assert_allclose(linear, expected[:, k], rtol=0, atol=1e-9 * size, err_msg=label)
        np.testing.assert_allclose(slope, linear, rtol=0, atol=2e-6 * size, err_msg=label)
        np.testing.assert_allclose(down.error_first_order[0] / RADIAN, -linear * h, rtol=0, atol=1e-9 * size * h)


def _angular(link, label: str) -> bool:
    return link.scale(label) != 1.0


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_output_by_every_drive(kind: str, seed: int) -> None:
    """Central differences of the nominal pose over each drive against the oracle's column."""
    text = mechanism(kind, seed, configurations=1, tolerances=False)
    link = read(text)
    drives = link.configurations[0]
    _, expected = link.sensitivity(link.nominal(drives), drives)
    for k, (name, _, _) in enumerate(link.drives):
        angular = link.driven_angle[k]
        h = 1e-4 if angular else 1e-4 * link.length
        value = np.rad2deg(drives[k]) if angular else drives[k]
        step = np.rad2deg(h) if angular else h
        m = jp.loads(text)
        poses = [
            jp.solve(m.with_({f"drives.{name}.values": [float(value + s * step)]})).nominal[0].values for s in (1, -1)
        ]
        slope = np.array([*(poses[0] - poses[1])[:2], turn(poses[0][2], poses[1][2])]) / (2 * h) / RADIAN
        size = max(1.0, float(np.abs(expected[:, k]).max()))
        np.testing.assert_allclose(slope, expected[:, k], rtol=0, atol=2e-6 * size, err_msg=name)


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_remainder_of_given_falls_fourfold_when_offsets_halve(kind: str, seed: int) -> None:
    """All sources moved at once: error minus its first order goes as the square of the offsets."""
    text = mechanism(kind, seed, configurations=1)
    link, m = read(text), jp.loads(text)
    whole = brute.draw(link, np.random.default_rng(seed), 1)[0]
    remainders = []
    for share in (1.0, 0.5, 0.25):
        u = dict(zip(link.labels, (share * whole).tolist(), strict=True))
        result = jp.given(m, given_offsets(link, u))
        remainders.append((result.error[0].values - result.error_first_order[0].values) / RADIAN)
    size = np.abs(remainders[0]).max()
    if size < 1e-9 * link.length:
        return  # straight in the offsets
    # Third-order parts leave a few per cent; components that nearly vanish are compared to the largest.
    np.testing.assert_allclose(4 * remainders[1], remainders[0], rtol=0, atol=0.1 * size)
    np.testing.assert_allclose(4 * remainders[2], remainders[1], rtol=0, atol=0.1 * size / 4)


@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_of_the_closure(kind: str) -> None:
    """Against complex steps, joint by joint; as J^T J, since rows may stand in other axes than the oracle's."""
    text = mechanism(kind, 1, configurations=1)
    link, core = read(text), jp.loads(text).core
    drives = link.configurations[0]
    q = link.nominal(drives)
    expected = link.jacobian(q, drives)
    metres = np.where(np.arange(q.size) % 3 == 2, 1.0, 1e-3)
    ours = core.jacobian((q * metres).reshape(-1, 3)) * metres
    ours *= [[1.0 if component == "angle" else 1e3] for _, component in core.rows]
    sizes = [{"revolute": 2, "pin_in_slot": 1}.get(j.kind, 3 if j.kind == "fixed" else 2) for j in link.joints]
    ends = np.cumsum([0, *sizes, *(1 for _ in link.drives)])
    order = {body: i for i, body in enumerate(jp.loads(text).bodies)}
    assert list(order) == link.bodies
    for first, last in pairwise(ends):
        a, b = ours[first:last], expected[first:last]
        np.testing.assert_allclose(a.T @ a, b.T @ b, rtol=0, atol=1e-9 * max(1.0, float(np.abs(b).max()) ** 2))
