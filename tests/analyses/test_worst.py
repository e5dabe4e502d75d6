"""Worst case of any mechanism: against search, its certificate through `given`, first order, shares,
shrinking clearances."""

from itertools import product

import numpy as np
import pytest

import jointplay as jp
from helpers.layouts import DEGENERATE, KINDS
from helpers.oracles import brute
from helpers.oracles.linkage import Linkage
from helpers.oracles.reading import read
from helpers.orders import NEAR, order
from helpers.strategies import given_offsets, mechanism

SEEDS = range(2)
EXTREMES = tuple(brute.MEASURES)


def figures(result, k: int, suffix: str = "") -> dict[str, float]:
    """The eight extremes at configuration k, positive the way brute.MEASURES counts, in mm and degrees."""
    at = result.isel(configuration=k)
    values = {
        "position": at[f"worst_position{suffix}"].item(),
        "rotation": at[f"worst_rotation{suffix}"].item(),
    }
    for component in ("x", "y", "angle"):
        span = at[f"worst_component{suffix}"].sel(component=component)
        values[f"{component} low"] = -span.sel(side="low").item()
        values[f"{component} high"] = span.sel(side="high").item()
    return values


def unit(extreme: str) -> float:
    return np.rad2deg(1.0) if extreme.startswith(("rotation", "angle")) else 1.0


def offsets_of(link: Linkage, result, k: int, extreme: str) -> dict[str, float]:
    """The certificate of one extreme, by label, in the oracle's units."""
    row = result.worst_offset.isel(configuration=k).sel(extreme=extreme)
    values = dict(zip(row.parameter.values.tolist(), row.values.tolist(), strict=True))
    return {label: values[label] * link.scale(label) for label in link.labels}


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS), *product(DEGENERATE, range(6))])
def test_worst_against_search(kind: str, seed: int) -> None:
    """No admissible point found by chance, at corners or by IPOPT is worse."""
    text = mechanism(kind, seed, configurations=1)
    link, result = read(text), jp.worst(jp.loads(text))
    q, drives = link.nominal(link.configurations[0]), link.configurations[0]
    exact, rng = figures(result, 0), np.random.default_rng(seed)
    for extreme in EXTREMES:
        search = brute.worst(link, q, drives, extreme, rng)
        # Without this a search that comes to nothing would agree with everything.
        assert search.open == 0, extreme
        assert len(search.lost) <= search.starts // 6, (extreme, search.lost)
        found = search.value * unit(extreme)
        # That `exact` is not too large is what its certificate shows, below.
        assert exact[extreme] >= found - 1e-9 * max(1.0, found), extreme


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_certificates(kind: str, seed: int) -> None:
    """The offsets of every extreme lie in their sets, and `given` makes of them what was claimed."""
    text = mechanism(kind, seed)
    link, m = read(text), jp.loads(text)
    result = jp.worst(m)
    assert (result.status == "ok").all()
    for k in range(result.sizes["configuration"]):
        claimed = figures(result, k)
        for extreme in EXTREMES:
            u = offsets_of(link, result, k, extreme)
            for source in link.sources:
                values = np.array([u[label] for label in source.labels])
                assert source.inside(values, 1e-12 * link.length), (extreme, source)
            error = jp.given(m, given_offsets(link, u)).error[k].values * [1, 1, np.deg2rad(1.0)]
            attained = float(brute.MEASURES[extreme](error)) * unit(extreme)
            slack = 1e-10 * link.length if unit(extreme) == 1.0 else np.rad2deg(1e-10)
            assert attained == pytest.approx(claimed[extreme], rel=0, abs=slack), extreme


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_first_order_is_the_support_function(kind: str, seed: int) -> None:
    """Support functions of the sets over complex-step sensitivities; the sources' shares add up to it."""
    text = mechanism(kind, seed)
    link, result = read(text), jp.worst(jp.loads(text))
    for k, q in enumerate(link.follow()):
        linear = brute.first_order(link, q, link.configurations[k])
        ours = figures(result, k, "_first_order")
        for extreme in EXTREMES:
            expected = linear[extreme] * unit(extreme)
            assert ours[extreme] == pytest.approx(expected, rel=1e-8, abs=1e-10), extreme
            shares = result.contribution.isel(configuration=k).sel(extreme=extreme)
            assert abs(shares.sum().item()) == pytest.approx(expected, rel=1e-9, abs=1e-10), extreme


@pytest.mark.parametrize("kind", KINDS)
def test_the_remainder_is_of_second_order_in_the_clearances(kind: str) -> None:
    """Exact minus first order goes as the square of the clearances, and first order as themselves."""
    assert sum(fitted_orders(kind, seed) for seed in (5, 6))


def fitted_orders(kind: str, seed: int) -> int:
    """How many extremes of one mechanism have an order that could be fitted; it was two in all of them."""
    plays = 0.004 / 2.0 ** np.arange(4)
    texts = [mechanism(kind, seed, play=float(play), configurations=1) for play in plays]
    results = [jp.worst(jp.loads(text)) for text in texts]
    exact, linear = ([figures(r, 0, suffix) for r in results] for suffix in ("", "_first_order"))
    # What the certificates are good for, with room for a fit.
    noise = 1e-10 * read(texts[0]).length
    checked = 0
    for extreme in EXTREMES:
        first = np.array([figure[extreme] for figure in linear])
        np.testing.assert_allclose(first / plays, first[0] / plays[0], rtol=1e-9, atol=1e-12 / plays[-1])
        remainder = np.array([figure[extreme] for figure in exact]) - first
        if np.abs(remainder[-1]) < noise:
            assert np.abs(remainder).max() < 1e-3 * max(first[0], 1e3 * noise), extreme
            continue  # straight in the clearances: nothing to fit
        shares = np.abs(results[0].contribution.isel(configuration=0).sel(extreme=extreme).values) / first[0]
        if shares[shares > 0].min() < np.abs(remainder[0]) / first[0]:
            continue  # a joint that matters less than the remainder is turned around by it: not yet small clearances
        assert order(plays, remainder) == pytest.approx(2.0, abs=NEAR), extreme
        checked += 1
    return checked


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_worst_is_no_smaller_than_loaded(kind: str, seed: int) -> None:
    text = mechanism(kind, seed, tolerances=False)
    m = jp.loads(text)
    worst, loaded = jp.worst(m), jp.loaded(m)
    error = loaded.error.values
    reach = 1e-9 + worst.worst_position.values
    assert (np.hypot(error[:, 0], error[:, 1]) <= reach).all()
    assert (np.abs(error[:, 2]) <= worst.worst_rotation.values + 1e-9).all()
    spans = worst.worst_component.values
    assert (spans[..., 0] - 1e-9 <= error).all()
    assert (error <= spans[..., 1] + 1e-9).all()


def test_more_clearance_is_never_better() -> None:
    figure = [jp.worst(jp.loads(mechanism("watt", 7, play=p))).worst_position.values for p in (0.001, 0.002, 0.003)]
    assert (np.diff(figure, axis=0) > 0).all()


def test_no_source_no_error() -> None:
    """All clearances and tolerances zero: every extreme is zero, to rounding."""
    result = jp.worst(jp.loads(mechanism("four_bar", 1, play=0.0)))
    assert (result.status == "ok").all()
    np.testing.assert_allclose(result.worst_position, 0.0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(result.worst_component, 0.0, rtol=0, atol=1e-11)
