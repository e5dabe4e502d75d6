"""Scatter: laws, moments, quantiles, seeds, threads, failures and memory, against an independent Monte
Carlo."""

import json
import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from helpers.dead_centre import at_dead_centre, moved_from_dead_centre
from helpers.oracles import statistics
from helpers.oracles.fourbar import FourBar
from helpers.oracles.reading import read
from helpers.oracles.sets import Source
from helpers.processes import digests
from helpers.strategies import four_bar_text, mechanism, random_four_bar

LAWS = ("uniform", "boundary", "normal")
RADII = (0.3, 0.5, 0.4, 0.6)
QUANTITIES = ("x", "y", "angle", "position", "rotation")


def text_of(fb: FourBar, theta: float, radii=RADII, **options) -> str:
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    return four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], radii, at="J3", start=start, **options)


def lengths(law: str) -> str:
    return "".join(
        f'[dimensions.{n}]\nbody = "{b}"\nbetween = ["{i}", "{j}"]\ntolerance = {t}\nlaw = "{law}"\n'
        for n, b, i, j, t in (("l2", "coupler", "J2", "J3", 0.4), ("l3", "rocker", "J4", "J3", 0.3))
    )


def quantities(errors: np.ndarray) -> np.ndarray:
    """x, y, angle, position, rotation of errors (n, 3)."""
    return np.column_stack([errors, np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_first_order_spread_is_the_closed_form(law: str, seed: int) -> None:
    fb, theta = random_four_bar(seed)
    text = text_of(fb, theta, extra=lengths("uniform"))
    link, result = read(text), jp.random(jp.loads(text), samples=2000, law=law).isel(configuration=0)
    laws = {s.name: (law if s.kind == "disc" else "uniform") for s in link.sources}
    expected = statistics.covariance(link, link.nominal(link.configurations[0]), link.configurations[0], laws)
    expected *= np.outer([1, 1, np.rad2deg(1)], [1, 1, np.rad2deg(1)])
    np.testing.assert_allclose(result.error_covariance_first_order, expected, rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(result.error_std_first_order, np.sqrt(np.diag(expected)), rtol=1e-9)
    np.testing.assert_allclose(result.contribution.sum("source"), np.diag(expected), rtol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_moments_and_quantiles_of_the_four_bar(law: str) -> None:
    """Against 4e5 samples of numpy on circles: within five standard errors of the difference."""
    fb, theta = random_four_bar(1)
    n = 400_000
    m = jp.loads(text_of(fb, theta, extra=lengths("uniform")))
    result = jp.random(m, samples=n, seed=5, law=law).isel(configuration=0)
    errors = statistics.four_bar_errors(fb, theta, RADII, law, n, 99, (0.4, 0.3)) * [1, 1, np.rad2deg(1)]
    assert result.failures.sum() - result.failures.sel(outcome="ok") == 0
    std = errors.std(axis=0)
    np.testing.assert_allclose(result.error_mean, errors.mean(axis=0), rtol=0, atol=(5 * std * math.sqrt(2 / n)).max())
    scale = np.outer(std, std)
    assert np.abs(result.error_covariance / scale - np.cov(errors.T) / scale).max() < 5 * 2 / math.sqrt(n) * 1.5
    np.testing.assert_allclose(result.error_std, std, rtol=5 * 1.5 / math.sqrt(n))

    sample = np.sort(quantities(errors), axis=0)
    for p in result.probability.values:
        for k, quantity in enumerate(QUANTITIES):
            ours = result.error_quantile.sel(probability=p, quantity=quantity).item()
            # Statistical error of a quantile: the ranks within 5 sqrt(2 n p (1 - p)), in values.
            margin = 5 * math.sqrt(2 * n * p * (1 - p)) + 2
            low, high = (sample[int(np.clip(p * n + s * margin, 0, n - 1)), k] for s in (-1, 1))
            resolution = result.quantile_resolution.sel(quantity=quantity).item()
            assert low - resolution <= ours <= high + resolution, (p, quantity)


@pytest.mark.parametrize("law", LAWS)
def test_samples_stay_in_their_sets(law: str) -> None:
    """Every law is truncated to its set: the largest error is below the worst; on the boundary, near it."""
    fb, theta = random_four_bar(2)
    m = jp.loads(text_of(fb, theta))
    worst, drawn = (
        jp.worst(m).isel(configuration=0),
        jp.random(m, samples=200_000, law=law).isel(configuration=0),
    )
    position = drawn.largest.sel(quantity="position").item()
    rotation = drawn.largest.sel(quantity="rotation").item()
    assert position <= worst.worst_position.item() * (1 + 1e-12)
    assert rotation <= worst.worst_rotation.item() * (1 + 1e-12)
    if law == "boundary":
        assert rotation > 0.9 * worst.worst_rotation.item()


def test_one_pin_on_a_slider_arm_has_exactly_its_law() -> None:
    """A single pinned link: the output error is the pin's play, so the law itself is seen."""
    b = planar()
    b.revolute("J", ground=(0, 0), arm=(0, 0), clearance=jp.radial(2.0))
    b.drive("q", joint="J", values=[30.0])
    b.output(body="arm", at=(0, 0))
    m, n = b.mechanism(), 100_000
    for law, variance in (("uniform", 1.0), ("boundary", 2.0)):
        result = jp.random(m, samples=n, law=law, seed=3).isel(configuration=0)
        np.testing.assert_allclose(result.error_std[:2] ** 2, variance, rtol=5 * math.sqrt(2 / n))
        assert abs(result.error_covariance[0, 1].item()) < 5 * variance / math.sqrt(n)
        assert result.error_std[2].item() < 1e-12
    uniform = jp.random(m, samples=n, law="uniform", seed=4).isel(configuration=0)
    for p in uniform.probability.values:
        # Uniform in a disc: P(rho < r) = (r / R)^2.
        quantile = uniform.error_quantile.sel(probability=p, quantity="position").item()
        error = 5 * math.sqrt(p * (1 - p) / n) * 2.0 / (2 * math.sqrt(p)) + uniform.quantile_resolution[3].item()
        assert quantile == pytest.approx(2.0 * math.sqrt(p), abs=error)


#: of a normal law cut at three sigma: its standard deviation over sigma
CUT = math.sqrt(statistics.variance(Source("", "interval", (".length",), (-3.0, 3.0), (0.0,)), "normal")[0])


@pytest.mark.parametrize(
    ("tolerance", "mean", "std", "low", "high"),
    [
        ({"tolerance": 0.3}, 0.0, 0.1 * CUT, -0.3, 0.3),
        ({"tolerance": 0.3, "law": "uniform"}, 0.0, 0.3 / math.sqrt(3), -0.3, 0.3),
        ({"tolerance": {"plus": 0.3, "minus": 0.1}}, 0.1, 0.4 / 6 * CUT, -0.1, 0.3),
        ({"tolerance": {"plus": 0.3, "minus": 0.1}, "law": "uniform"}, 0.1, 0.2 / math.sqrt(3), -0.1, 0.3),
        ({"tolerance": {"sigma": 0.1}}, 0.0, 0.1, -0.3, 0.3),
        ({"tolerance": 0.3, "deviation": 0.5}, 0.5, 0.1 * CUT, 0.2, 0.8),
        ({"deviation": -0.5}, -0.5, 0.0, -0.5, -0.5),
    ],
)
def test_forms_of_a_tolerance(tolerance: dict[str, Any], mean: float, std: float, low: float, high: float) -> None:
    """The reach of one arm: its error is the error of the reach, whatever its law, and its extremes are the limits."""
    b = planar()
    b.revolute("J", ground=(0, 0), arm=(0, 0))
    b.drive("q", joint="J", values=[0.0])
    b.output(body="arm", at=(100, 0))
    b.dimension("reach", body="arm", between=["J", "output"], **tolerance)
    m, n = b.mechanism(), 200_000
    result = jp.random(m, samples=n).isel(configuration=0)
    assert result.error_mean[0].item() == pytest.approx(mean, abs=1e-12 + 5 * std / math.sqrt(n))
    assert result.error_std[0].item() == pytest.approx(std, rel=5 * math.sqrt(2 / n), abs=1e-12)
    assert result.error_mean_first_order[0].item() == pytest.approx(mean, abs=1e-12)
    assert result.error_std_first_order[0].item() == pytest.approx(std, rel=1e-6, abs=1e-12)
    span = jp.worst(m).worst_component.isel(configuration=0).sel(component="x").values
    np.testing.assert_allclose(span, [low, high], rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", ["four_bar", "slider_crank", "scotch_yoke", "welded", "three_rrr"])
def test_monte_carlo_agrees_with_first_order(kind: str) -> None:
    """Small play: sampled and first-order spread agree, over guides, slots and welds as over pins."""
    text = mechanism(kind, 2, play=0.0005, configurations=1)
    link = read(text)
    n = 200_000
    result = jp.random(jp.loads(text), samples=n).isel(configuration=0)
    first, sampled = result.error_std_first_order.values, result.error_std.values
    np.testing.assert_allclose(sampled, first, rtol=5e-3 + 5 / math.sqrt(n), atol=1e-12 * link.length)
    assert (np.abs(result.error_mean.values) < 6 * first / math.sqrt(n) + 2e-2 * first + 1e-12).all()


def test_seeds_matter_and_repeat() -> None:
    m = jp.loads(mechanism("slider_crank", 4))
    one, again, other = (jp.random(m, samples=5000, seed=s) for s in (1, 1, 2))
    assert one.identical(again)
    assert (one.error_mean != other.error_mean).any("component").all()


def test_bit_identical_for_any_number_of_threads_and_width_of_registers() -> None:
    assert len(digests(mechanism("stephenson", 2, configurations=2), 30_000)) == 1


def near_its_limit() -> tuple[FourBar, float]:
    """Coupler and rocker nearly in line: 0.5 mm short of it, with 1 mm of play in each joint."""
    l1, ground, theta = 80.0, 150.0, 1.6
    reach = abs(l1 * np.exp(1j * theta) - ground)
    return FourBar(l1, 70.0, float(reach) - 70.0 + 0.5, 0j, complex(ground)), theta


def test_failures_are_counted_by_status() -> None:
    """Samples whose links cannot meet are counted, in the closed form's share, and not averaged away."""
    fb, theta = near_its_limit()
    n, radii = 60_000, (1.0,) * 4
    result = jp.random(jp.loads(text_of(fb, theta, radii)), samples=n, seed=1).isel(configuration=0)
    errors = statistics.four_bar_errors(fb, theta, radii, "uniform", n, 11)
    failed = np.isnan(errors).any(axis=1)
    share = failed.mean()
    assert 0.05 < share < 0.5
    counts = {str(o): int(c) for o, c in zip(result.outcome.values, result.failures.values, strict=True)}
    assert sum(counts.values()) in (n, n - counts["ok"])
    bad = sum(c for name, c in counts.items() if name != "ok")
    assert bad / n == pytest.approx(share, abs=5 * math.sqrt(2 * share * (1 - share) / n))
    expected = np.nanmean(errors, axis=0) * [1, 1, np.rad2deg(1)]
    spread = np.nanstd(errors, axis=0) * [1, 1, np.rad2deg(1)]
    np.testing.assert_allclose(result.error_mean, expected, rtol=0, atol=(6 * spread * math.sqrt(2 / n)).max())


def test_outside_is_the_share_beyond_the_limits() -> None:
    fb, theta = random_four_bar(1)
    n = 200_000
    errors = quantities(statistics.four_bar_errors(fb, theta, RADII, "uniform", n, 3) * [1, 1, np.rad2deg(1)])
    position, rotation = (float(np.quantile(errors[:, k], 0.95)) for k in (3, 4))
    limits = f"[limits]\nposition = {position!r}\nrotation = {rotation!r}\n"
    result = jp.random(jp.loads(text_of(fb, theta, extra=limits)), samples=n).isel(configuration=0)
    beyond = ((errors[:, 3] > position) | (errors[:, 4] > rotation)).mean()
    assert result.outside.item() == pytest.approx(beyond, abs=5 * math.sqrt(2 * beyond * (1 - beyond) / n))


MEMORY = """
import json, resource, sys, jointplay as jp
text = sys.stdin.read()
peak = []
for samples in (100_000, 100_000, 2_000_000):
    jp.random(jp.loads(text), samples=samples)
    peak.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(json.dumps(peak))
"""


def test_memory_does_not_grow_with_the_samples() -> None:
    """Peak resident size after 1e5 and after 2e6 samples: 2e6 stored errors alone would be 46 MB."""
    fb, theta = random_four_bar(1)
    run = subprocess.run(
        [sys.executable, "-c", MEMORY], input=text_of(fb, theta), capture_output=True, text=True, check=True
    )
    _, small, large = json.loads(run.stdout)
    assert large - small < 8_000  # kB


@pytest.mark.parametrize("guides", [1, 2])
def test_quantiles_are_where_first_order_sees_nothing(guides: int) -> None:
    """Histograms covered what first order reaches, and all that is beyond was in their last bin."""
    found = jp.random(at_dead_centre(guides, 0.0), samples=1 << 15)
    moved = moved_from_dead_centre(0.0, np.linspace(-5.0, 5.0, 100_001))
    for quantity, values in (("x", moved), ("position", -moved)):
        told = found.sel(quantity=quantity)
        wanted = np.quantile(values, found.probability.values)
        assert told.error_quantile.values[0] == pytest.approx(wanted, abs=2e-3)
        assert 0.0 < told.quantile_resolution.item() < 1e-3


def test_a_few_specimens_that_go_far_leave_the_others_their_bins() -> None:
    """With a wide normal law of the drive the slider goes much farther in some specimens than in most."""
    law = {"drives.q.law": "normal", "drives.q.error": 60}
    found = jp.random(at_dead_centre(1, 0.0).with_(law), samples=1 << 14, keep=1 << 14)
    x = found.specimen_error.sel(component="x").values.ravel()
    wanted = np.nanquantile(x, found.probability.values)
    assert found.error_quantile.sel(quantity="x").values[0] == pytest.approx(wanted, abs=5e-3 * np.nanstd(x))


@pytest.mark.parametrize("seed", range(3))
def test_specimens_of_an_arm_hang_where_the_play_of_its_drive_lets_them(seed: int) -> None:
    """They were left beside the middle of the play, undetermined, where the arm hangs straight down within it."""
    rng = np.random.default_rng(seed)
    length, lost, force = 10 ** rng.uniform([1, -2, 0], [3, 1, 3])
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0))
    values = -90 + lost * np.array([-2, -0.4, -0.2, 0, 0.1, 0.4, 2])
    b.drive("q", joint="pivot", values=values.tolist(), error=0.05 * lost, backlash=lost)
    b.output(body="arm", at=(length, 0))
    b.load(force=(0, -force))
    found = jp.random(b.mechanism(), samples=100, keep=100, contact="loaded")
    assert (found.failures.sel(outcome="ok") == 100).all()
    drawn = values[:, None] + found.specimen_offset.sel(parameter="q.value").values
    angle = np.radians(np.clip(-90, drawn - 0.5 * lost, drawn + 0.5 * lost))
    nominal = np.radians(values)[:, None]
    x, y = length * (np.cos(angle) - np.cos(nominal)), length * (np.sin(angle) - np.sin(nominal))
    wanted = np.stack([x, y, np.degrees(angle - nominal)], axis=-1)
    np.testing.assert_allclose(found.specimen_error, wanted, rtol=0, atol=1e-9 * length)


@pytest.mark.parametrize("seed", range(3))
def test_specimens_of_a_link_hang_where_its_slot_lets_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length, force = 10 ** rng.uniform([1, 0], [3, 3])
    gap = 0.01 * length
    for aside in gap * rng.uniform(-1.5, 1.5, 6):
        b = planar()
        b.revolute("A", ground=(0, 0), link=(0, 0))
        b.pin_in_slot("S", ground={"at": (aside, -length), "axis": (0, 1)}, link=(length, 0), clearance={"gap": gap})
        b.dimension("l", body="link", between=("A", "output"), tolerance=0.1 * gap)
        b.start("link", angle=-90)
        b.output(body="link", at=(1.5 * length, 0))
        b.load(force=(0, -force))
        found = jp.random(b.mechanism(), samples=20, keep=20, contact="loaded").isel(configuration=0)
        assert found.failures.sel(outcome="ok") == 20
        longer = found.specimen_offset.sel(parameter="l.length").values
        # The pin is straight under the pivot, or as near as the slot lets it.
        sine = np.array([aside, aside - np.clip(aside, -gap, gap)]) / length
        along = np.stack([sine, -np.sqrt(1 - sine**2)], axis=1)
        wanted = np.outer(1.5 * length + longer, along[1]) - 1.5 * length * along[0]
        np.testing.assert_allclose(found.specimen_error[:, :2], wanted, rtol=0, atol=1e-8 * length)
