"""Random mechanisms near a singularity, where answers grow as one over the smallest singular value and Newton's method
has the least room: the same questions as elsewhere, with the rounding that belongs there."""

import math
from itertools import product

import numpy as np
import pytest

import jointplay as jp
from helpers.oracles import brute, statistics
from helpers.oracles.linkage import Linkage
from helpers.oracles.load_optimiser import load_pose
from helpers.oracles.reading import read
from helpers.strategies import NEAR_SINGULAR, given_offsets, near_singular
from jointplay import _core
from jointplay.analyses.nominal import nominal

LEAST = (0.05, 0.02, 5e-3, 1e-3)
CASES = [(kind, seed, least) for seed, kind in enumerate(NEAR_SINGULAR) for least in LEAST]
EPS = float(np.finfo(float).eps)
#: first one of each kind
IN_TURN = [(kind, NEAR_SINGULAR.index(kind), least) for kind, least in [*product(NEAR_SINGULAR, LEAST)]]
cases = pytest.mark.parametrize(("kind", "seed", "least"), CASES)


def rounding(link: Linkage, q: np.ndarray) -> float:
    """What rounding leaves uncertain of a pose: that of the closure, over the smallest singular value."""
    reach = max(link.length, float(np.abs(q).max()))
    return 64 * EPS * reach / link.smallest_singular_value(q, link.configurations[0])


@cases
def test_given_is_the_closure(kind: str, seed: int, least: float) -> None:
    text = near_singular(kind, seed, least)
    link, m = read(text), jp.loads(text)
    q = link.nominal(link.configurations[0])
    for u in brute.draw(link, np.random.default_rng(seed), 5):
        result = jp.given(m, given_offsets(link, dict(zip(link.labels, u.tolist(), strict=True))))
        assert result.status.item() == "ok"
        expected = brute.errors(link, q, link.configurations[0], u[None])[0]
        np.testing.assert_allclose(result.error[0, :2], expected[:2], rtol=0, atol=rounding(link, q))
        turned = math.degrees(expected[2])
        np.testing.assert_allclose(
            result.error[0, 2], turned, rtol=0, atol=math.degrees(rounding(link, q) / link.length)
        )


@cases
def test_samples_equal_the_plain_solver_on_every_width(kind: str, seed: int, least: float) -> None:
    """Where lanes hand samples over, because a pivot has become small or Newton's method does not settle, too."""
    text = near_singular(kind, seed, least)
    link, m = read(text), jp.loads(text)
    at, widest, found = nominal(m), _core.simd(), []
    try:
        for width in ("plain", "avx2", "avx512"):
            _core.simd(width)
            found.append(m.core.random(at.drives, at.poses, 200, 3, np.array([0.5]), keep=True))
    finally:
        _core.simd(widest)
    for other in found[1:]:
        for key, value in found[0].items():
            assert np.array_equal(value, other[key], equal_nan=True), key
    drives, poses = (np.repeat(values, 200, 0) for values in (at.drives, at.poses))
    given = m.core.given(drives, poses, found[0]["kept_parameters"])
    q = link.nominal(link.configurations[0])
    apart = np.abs(given["error"] - found[0]["kept_errors"]) / [m.length, m.length, 1.0]
    assert apart.max() <= rounding(link, q) / link.length


@cases
def test_first_order_spread(kind: str, seed: int, least: float) -> None:
    text = near_singular(kind, seed, least)
    link, result = read(text), jp.random(jp.loads(text), samples=64)
    q, drives = link.nominal(link.configurations[0]), link.configurations[0]
    toleranced = (".length", ".angle")
    laws = {
        s.name: "normal" if s.kind == "interval" and s.labels[0].endswith(toleranced) else "uniform"
        for s in link.sources
    }
    std = np.sqrt(np.diag(statistics.covariance(link, q, drives, laws))) * [1, 1, np.rad2deg(1)]
    # Slopes are as large as the inverse of the Jacobian, the rounding of which goes with its square.
    np.testing.assert_allclose(result.error_std_first_order[0], std, rtol=rounding(link, q) / link.length / least)


@cases
def test_loaded_is_the_pose_of_largest_work(kind: str, seed: int, least: float) -> None:
    text = near_singular(kind, seed, least, tolerances=False)
    link, result = read(text), jp.loaded(jp.loads(text)).isel(configuration=0)
    q = link.nominal(link.configurations[0])
    assert result.status.item() == "ok"
    best = load_pose(link, q, link.configurations[0])
    size = float(np.abs(best.error[:2]).max())
    np.testing.assert_allclose(result.error[:2], best.error[:2], rtol=0, atol=1e-5 * size + rounding(link, q))


@pytest.mark.parametrize(("kind", "seed", "least"), IN_TURN)
def test_worst_against_search(kind: str, seed: int, least: float) -> None:
    """No admissible point is worse, and the offsets that are told make what is claimed."""
    text = near_singular(kind, seed, least)
    link, m = read(text), jp.loads(text)
    q, drives, rng = link.nominal(link.configurations[0]), link.configurations[0], np.random.default_rng(seed)
    result, slack = jp.worst(m), rounding(link, q)
    assert result.status.item() == "ok"
    for extreme in ("position", "rotation", "x low", "angle high"):
        row = result.worst_offset[0].sel(extreme=extreme)
        offsets = dict(zip(row.parameter.values.tolist(), row.values.tolist(), strict=True))
        u = np.array([offsets[label] * link.scale(label) for label in link.labels])
        claimed = float(brute.MEASURES[extreme](brute.errors(link, q, drives, u[None])[0]))
        name, _, side = extreme.partition(" ")
        unit = np.rad2deg(1.0) if name in ("rotation", "angle") else 1.0
        told = abs(result.worst_component[0].sel(component=name, side=side)) if side else result[f"worst_{name}"][0]
        assert told.item() == pytest.approx(claimed * unit, rel=0, abs=slack * unit)
        search = brute.worst(link, q, drives, extreme, rng, starts=4)
        assert search.open == 0
        assert len(search.lost) <= search.starts // 4, search.lost
        assert claimed >= search.value * (1 - 1e-9) - slack
