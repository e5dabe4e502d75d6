"""Clearances whose gap scatters with the sizes of their parts: hole and pin, or one size of the clearance itself."""

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

import jointplay as jp
from helpers.answers import example
from jointplay import _core
from jointplay.analyses.nominal import nominal

LEVELS = np.array([0.5, 0.9])
#: hole and pin of the first clearance, metres: half limits, and the law of each
HOLE, PIN = 2.0e-4, 1.2e-4


def core(spec: Any) -> _core.Mechanism:
    return _core.Mechanism(json.dumps(spec))


def clearances(spec: Any) -> list[int]:
    return [s for s, source in enumerate(spec["sources"]) if source["kind"] == "clearance"]


def gap_of(source: Any) -> float:
    (size,) = source["set"].values()
    return size.get("radius", size.get("gap", size.get("high")))


def with_gap(source: Any, gap: float) -> Any:
    ((shape, size),) = source["set"].items()
    new = {"radius": gap} if "radius" in size else {"gap": gap} if "gap" in size else {"low": -gap, "high": gap}
    return {**source, "set": {shape: {**size, **new}}}


def size_of(joint: int, factor: float, half: float, law: str = "normal", centre: float = 0.0) -> Any:
    limits = {"interval": {"low": -half, "high": half}}
    return {"kind": "size", "joint": joint, "factor": factor, "set": limits, "centre": [centre], "law": law}


def sized(spec: Any, which: int, *sizes: Any, gap: float | None = None) -> Any:
    """A mechanism whose clearance `which` has sizes behind all other sources."""
    sources = list(spec["sources"])
    if gap is not None:
        sources[which] = with_gap(sources[which], gap)
    joint = sources[which]["joint"]
    return {**spec, "sources": [*sources, *({**size, "joint": joint} for size in sizes)]}


def fixed(spec: Any, which: int, gap: float) -> Any:
    sources = list(spec["sources"])
    sources[which] = with_gap(sources[which], gap)
    return {**spec, "sources": sources}


def rows(m: jp.Mechanism, count: int = 1) -> tuple[Any, Any]:
    at = nominal(m)
    return at.drives[:count], at.poses[:count]


CASES = [
    ("four-bar", None),
    ("slider-crank", None),
    ("x-braced-square", None),
    ("four-legged-platform", None),
    ("redundant-bar", None),
    ("serial-6r", None),
]


def found_names() -> list[str]:
    return [name for name, _ in CASES if name in jp.examples.names()]


@pytest.mark.parametrize("name", found_names())
def test_worst_takes_the_largest_gap_and_the_sizes_what_they_add(name: str) -> None:
    m = example(name)
    at = rows(m)
    which = clearances(m.core_spec)[0]
    gap = gap_of(m.core_spec["sources"][which])
    hole, pin = 0.4 * gap, 0.6 * gap
    spec = sized(m.core_spec, which, size_of(0, 0.5, hole), size_of(0, -0.5, pin))
    largest = gap + 0.5 * hole + 0.5 * pin
    found, expected = core(spec).worst(*at, 6), core(fixed(m.core_spec, which, largest)).worst(*at, 6)
    for key in ("position", "component", "position_first_order", "component_first_order", "rotation", "status"):
        np.testing.assert_allclose(found[key], expected[key], rtol=1e-9, atol=1e-15)
    n = len(m.core_spec["sources"])
    np.testing.assert_array_equal(
        found["offset"][..., -2:], np.broadcast_to([hole, -pin], found["offset"][..., -2:].shape)
    )
    parts, whole = found["contribution"], expected["contribution"]
    np.testing.assert_allclose(parts[..., :which], whole[..., :which], rtol=1e-9, atol=1e-15)
    together = parts[..., which] + parts[..., n] + parts[..., n + 1]
    np.testing.assert_allclose(together, whole[..., which], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(parts[..., n] * pin, parts[..., n + 1] * hole, rtol=1e-12, atol=1e-20)
    if "journal" not in m.core_spec["sources"][which]["set"]:
        np.testing.assert_allclose(parts[..., which] * largest, whole[..., which] * gap, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("name", found_names())
def test_what_is_known_of_the_sizes_is_a_gap_like_any_other(name: str) -> None:
    """`loaded` takes the middle of the sizes with their known deviations; `worst` what is left above it."""
    m = example(name)
    at = rows(m)
    which = clearances(m.core_spec)[0]
    gap = gap_of(m.core_spec["sources"][which])
    spec = sized(m.core_spec, which, size_of(0, 0.5, 0.0, centre=0.4 * gap), size_of(0, -0.5, 0.0, centre=0.1 * gap))
    other = fixed(m.core_spec, which, gap + 0.5 * 0.4 * gap - 0.5 * 0.1 * gap)
    for ask in ("loaded", "worst"):
        if ask == "loaded" and not m.has_loads:
            continue
        found = getattr(core(spec), ask)(*at)
        expected = getattr(core(other), ask)(*at)
        key = "error" if ask == "loaded" else "component"
        np.testing.assert_allclose(found[key], expected[key], rtol=1e-12, atol=1e-16)


def test_interference_is_no_play() -> None:
    m = example("four-bar")
    at = rows(m)
    tight = core(sized(m.core_spec, 0, size_of(0, 1.0, 1e-5), gap=-3e-5))
    none = core(fixed(m.core_spec, 0, 0.0))
    for ask, key in (("loaded", "error"), ("worst", "component")):
        np.testing.assert_array_equal(getattr(tight, ask)(*at)[key], getattr(none, ask)(*at)[key])
    found = tight.random(*at, 1000, 1, LEVELS, keep=True)
    n = len(m.core_spec["sources"])
    assert found["interference"].tolist() == [[1.0, *[0.0] * n]]
    offsets = found["kept_parameters"][:, :2]
    assert (offsets == 0.0).all()
    np.testing.assert_array_equal(found["contribution"][0, [0, n]], 0.0)


def law_of(law: str, half: float) -> Any:
    if law == "uniform":
        return stats.uniform(-half, 2 * half)
    sigma = half / 3
    return stats.truncnorm(-3, 3, scale=sigma) if law == "normal" else stats.norm(0, sigma)


def moments_with_play(gap: float, parts: list[tuple[float, Any]]) -> tuple[float, float]:
    """Mean and variance of max(0, gap + sum of factor * size), by quadrature of one distribution."""

    def mean_of(power: int, base: float, left: Any) -> float:
        if not left:
            return max(0.0, base) ** power
        (f, law), *others = left
        bounds = (max(law.ppf(0.0), -10 * law.std()), min(law.ppf(1.0), 10 * law.std()))
        kink = [x for x in [-base / f] if bounds[0] < x < bounds[1]] if not others else None
        return integrate.quad(
            lambda x: law.pdf(x) * mean_of(power, base + f * x, others), *bounds, points=kink, epsabs=1e-16, limit=200
        )[0]

    first_moment, second = mean_of(1, gap, parts), mean_of(2, gap, parts)
    return first_moment, second - first_moment**2


@pytest.mark.parametrize(
    ("gap", "laws"),
    [
        (5e-4, ("normal", "uniform")),
        (5e-4, ("gauss",)),
        (0.5e-4, ("normal", "uniform")),
        (0.0, ("normal", "normal")),
        (-0.3e-4, ("uniform",)),
        (0.2e-4, ("gauss", "normal")),
    ],
)
def test_the_variance_of_a_gap_is_what_its_sizes_contribute(gap: float, laws: tuple[str, ...]) -> None:
    """Var(offset) = (E[g]^2 + Var g) Var(unit offset), the second part by the sizes' own variances."""
    m = example("four-bar")
    at, unit = rows(m), core(fixed(m.core_spec, 0, 1e-4))
    arguments = (1000, 1, LEVELS)
    n = len(m.core_spec["sources"])
    of_unit = unit.random(*at, *arguments)["contribution"][0, 0] / 1e-8
    sizes = [size_of(0, f, half, law) for f, half, law in zip((0.5, -0.5), (HOLE, PIN), laws, strict=False)]
    found = core(sized(m.core_spec, 0, *sizes, gap=gap)).random(*at, *arguments)
    parts = [
        (size["factor"], law_of(law, size["set"]["interval"]["high"])) for size, law in zip(sizes, laws, strict=True)
    ]
    mean, variance = moments_with_play(gap, parts)
    # The numbers of the core are exact where there is no interference, else a sum over a grid of scores.
    np.testing.assert_allclose(found["contribution"][0, 0], mean**2 * of_unit, rtol=3e-4)
    np.testing.assert_allclose(found["contribution"][0, n:].sum(axis=0), variance * of_unit, rtol=3e-4)
    own = np.array([f * f * law.var() for f, law in parts])
    share = found["contribution"][0, n:, 0] / found["contribution"][0, n:, 0].sum()
    np.testing.assert_allclose(share, own / own.sum(), rtol=1e-9)


def test_every_specimen_has_its_sizes_and_lies_within_their_gap() -> None:
    m = example("four-bar")
    at = rows(m)
    n, gap, samples = len(m.core_spec["sources"]), 0.4e-4, 40_000
    sizes = [size_of(0, 0.5, HOLE, centre=1e-5), size_of(0, -0.5, PIN, "uniform")]
    spec = sized(m.core_spec, 0, *sizes, gap=gap)
    found = core(spec).random(*at, samples, 3, LEVELS, keep=True)
    drawn = found["kept_parameters"]
    hole, pin, offsets = drawn[:, -2], drawn[:, -1], drawn[:, :2]
    raw = gap + 0.5 * hole - 0.5 * pin
    np.testing.assert_allclose(found["interference"][0, 0], (raw < 0).mean(), rtol=1e-12)
    assert (found["interference"][0, 1:] == 0).all()
    own = np.maximum(raw, 0.0)
    assert (np.hypot(*offsets.T) <= own * (1 + 1e-12)).all()
    # Within its gap an offset is uniform, whatever the gap: r^2 / g^2 is uniform from 0 to 1.
    with_play = own > 1e-9
    part = (np.hypot(*offsets.T)[with_play] / own[with_play]) ** 2
    assert stats.kstest(part, "uniform").pvalue > 1e-3
    assert abs(stats.spearmanr(part, own[with_play]).statistic) < 5 / math.sqrt(len(part))
    assert stats.kstest(hole - 1e-5, law_of("normal", HOLE).cdf).pvalue > 1e-3
    assert stats.kstest(pin, law_of("uniform", PIN).cdf).pvalue > 1e-3
    # First order is the covariance of the samples, to their statistical error and to what is not linear.
    first, sampled = found["covariance_first_order"][0], found["covariance"][0]
    np.testing.assert_allclose(np.diag(sampled), np.diag(first), rtol=5 * math.sqrt(3 / samples) + 0.02)
    np.testing.assert_allclose(found["contribution"][0].sum(axis=0), np.diag(first), rtol=1e-12)
    assert found["contribution"].shape[1] == n + 2


@pytest.mark.parametrize("name", ["redundant-bar", "x-braced-square"])
@pytest.mark.parametrize("loaded", [False, True])
def test_specimens_of_over_constrained_mechanisms_have_their_own_gaps(name: str, loaded: bool) -> None:
    """The scatter with a size of two values is that of the two mechanisms with these gaps."""
    m = example(name)
    if loaded and not m.has_loads:
        pytest.skip("nothing loads it")
    at, samples = rows(m), 4000
    which = clearances(m.core_spec)[0]
    gap = gap_of(m.core_spec["sources"][which])
    step = 0.6 * gap
    both = core(sized(m.core_spec, which, size_of(0, 1.0, step, "boundary")))
    arguments = (LEVELS,)
    found = both.random(*at, samples, 2, *arguments, keep=True, loaded=loaded)
    assert found["failures"][0].sum() == samples
    drawn = found["kept_parameters"]
    assert set(np.round(drawn[:, -1] / step, 9)) == {-1.0, 1.0}
    for sign in (-1.0, 1.0):
        one = core(fixed(m.core_spec, which, gap + sign * step))
        alone = one.random(*at, samples, 7, *arguments, keep=True, loaded=loaded)
        ours = found["kept_errors"][drawn[:, -1] * sign > 0]
        theirs = alone["kept_errors"]
        for k in range(theirs.shape[1]):
            a, b = ours[:, k], theirs[:, k]
            a, b = a[np.isfinite(a)], b[np.isfinite(b)]
            assert abs(len(a) / len(ours) - len(b) / len(theirs)) < 5 / math.sqrt(samples)
            if max(np.ptp(a), np.ptp(b)) > 1e-12:
                assert stats.ks_2samp(a, b).pvalue > 1e-4
    total = found["contribution"][0].sum(axis=0) + found.get("contribution_elastic", np.zeros((1, 1, 1)))[0].sum(axis=0)
    np.testing.assert_allclose(total, np.diag(found["covariance_first_order"][0]), rtol=1e-9, atol=1e-24)


def test_given_specimens_have_the_gaps_of_their_sizes() -> None:
    m = example("x-braced-square")
    at = rows(m)
    which = clearances(m.core_spec)[0]
    gap = gap_of(m.core_spec["sources"][which])
    one = core(sized(m.core_spec, which, size_of(0, 1.0, gap)))
    # Clearances in the middle, everything else as drawn.
    specimens = one.specimens(3, 0)
    for s, (source, _) in enumerate(one.parameters):
        if source in clearances(m.core_spec):
            specimens[:, s] = 0.0
    specimens[:, -1] = np.array([-0.5, 0.0, 0.5]) * gap
    found = one.loaded_specimens(*at, specimens)
    for k, value in enumerate(specimens[:, -1]):
        expected = core(fixed(m.core_spec, which, gap + value)).loaded_specimens(*at, specimens[k : k + 1, :-1])
        np.testing.assert_allclose(found["clearance_factor"][k], expected["clearance_factor"][0], rtol=1e-9)
        np.testing.assert_allclose(found["poses"][k], expected["poses"][0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"joint": 99}, "no clearance with sizes"),
        ({"factor": 0.0}, "a size is one number"),
        ({"set": {"disc": {"radius": 1.0}}, "centre": [0.0, 0.0]}, "a size is one number"),
    ],
)
def test_sizes_of_nothing_are_refused(change: dict[str, Any], says: str) -> None:
    m = example("four-bar")
    spec = sized(m.core_spec, 0, size_of(0, 1.0, 1e-5))
    spec["sources"][-1] = {**spec["sources"][-1], **change}
    with pytest.raises(ValueError, match=says):
        core(spec)


def test_more_sizes_than_hole_and_pin_are_refused() -> None:
    m = example("four-bar")
    with pytest.raises(ValueError, match="at most 2 sizes"):
        core(sized(m.core_spec, 0, *[size_of(0, 1.0, 1e-5)] * 3))


def test_the_numbers_do_not_depend_on_threads() -> None:
    m = example("four-bar")
    at = rows(m)
    one = core(sized(m.core_spec, 0, size_of(0, 0.5, HOLE), size_of(0, -0.5, PIN), gap=0.4e-4))
    answers = [one.random(*at, 30_000, 3, LEVELS, None, None, threads) for threads in (1, 2)]
    for key in ("mean", "covariance", "quantile", "interference"):
        np.testing.assert_array_equal(answers[0][key], answers[1][key])
