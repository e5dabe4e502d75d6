"""Exact worst case of four-bars: the rotatability bound, the arcs that bound the pin, brute force, the
printed figures."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.oracles import brute
from helpers.oracles.fourbar import FourBar, paper_four_bar
from helpers.oracles.reading import read
from helpers.oracles.rotatability import pin_boundary, rotation_range
from helpers.strategies import PAPER_ANGLES, four_bar_text, paper_text, random_four_bar

PRINTED = {0: (3.245, 1.532, 3.224), 5: (3.297, 1.541, 3.295), 10: (3.848, 1.668, 3.839)}


def text_of(fb: FourBar, theta: float, radii) -> str:
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    return four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], radii, start=start)


@pytest.fixture(scope="module")
def paper_worst():
    return jp.worst(jp.loads(paper_text()))


@pytest.mark.parametrize("position", PRINTED)
def test_figures_of_the_4r(position: int, paper_worst) -> None:
    """Radial clearance 1 mm in all joints, drive held: printed figures, arcs, a dense search."""
    displacement, rotation, first_order = PRINTED[position]
    at = paper_worst.isel(configuration=position)
    assert at.worst_position.item() == pytest.approx(displacement, abs=5.1e-4)
    assert at.worst_rotation.item() == pytest.approx(rotation, abs=5.1e-4)
    assert at.worst_position_first_order.item() == pytest.approx(first_order, abs=5.1e-4)

    fb, theta = paper_four_bar(), math.radians(PAPER_ANGLES[position])
    searched, _ = brute.four_bar_extreme(fb, theta, (1.0,) * 4, lambda shift, _: np.abs(shift))
    turned, _ = brute.four_bar_extreme(fb, theta, (1.0,) * 4, lambda _, turn: np.abs(turn))
    assert at.worst_position.item() == pytest.approx(searched, abs=1e-8)
    assert at.worst_rotation.item() == pytest.approx(math.degrees(turned), abs=1e-8)

    link = read(paper_text())
    linear = brute.first_order(link, link.follow()[position], link.configurations[position])
    assert at.worst_position_first_order.item() == pytest.approx(linear["position"], abs=1e-7)
    assert at.worst_rotation_first_order.item() == pytest.approx(math.degrees(linear["rotation"]), abs=1e-7)


@pytest.mark.parametrize("seed", range(20))
def test_worst_rotation_is_the_rotatability_bound(seed: int) -> None:
    """The extremes are two four-bars with couplers l2 -+ the sum of the radial clearances."""
    fb, theta = random_four_bar(seed)
    radii = tuple(np.random.default_rng(seed).uniform(0.05, 1.2, 4))
    result = jp.worst(jp.loads(text_of(fb, theta, radii))).isel(configuration=0)
    low, high = (math.degrees(a) for a in rotation_range(fb, theta, sum(radii)))
    angle = result.worst_component.sel(component="angle")
    assert angle.sel(side="low").item() == pytest.approx(low, abs=1e-9)
    assert angle.sel(side="high").item() == pytest.approx(high, abs=1e-9)
    assert result.worst_rotation.item() == pytest.approx(max(-low, high), abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_worst_pin_displacement_is_the_farthest_point_between_the_arcs(seed: int) -> None:
    fb, theta = random_four_bar(seed)
    radii = tuple(np.random.default_rng(seed).uniform(0.05, 1.2, 4))
    result = jp.worst(jp.loads(text_of(fb, theta, radii))).isel(configuration=0)
    region = pin_boundary(fb, theta, radii) - fb.rocker_pin(theta)
    assert result.worst_position.item() == pytest.approx(np.abs(region).max(), abs=1e-6)
    assert result.worst_position.item() >= np.abs(region).max() - 1e-10
    for component, part in (("x", region.real), ("y", region.imag)):
        span = result.worst_component.sel(component=component)
        assert span.sel(side="low").item() == pytest.approx(part.min(), abs=1e-6)
        assert span.sel(side="high").item() == pytest.approx(part.max(), abs=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_only_the_sum_of_the_clearances_counts_for_rotation(seed: int) -> None:
    """Ting: clearances in the loop contribute alike to the direction error, wherever they are."""
    fb, theta = random_four_bar(seed)
    shares = np.random.default_rng(seed).dirichlet([1.0] * 4)
    figures = []
    for radii in ((1.0, 0, 0, 0), (0, 0, 1.0, 0), (0.25,) * 4, tuple(shares)):
        radii = tuple(float(r) for r in radii)
        figures.append(jp.worst(jp.loads(text_of(fb, theta, radii))).worst_rotation.item())
    np.testing.assert_allclose(figures, figures[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("radial", [0.1, 0.01])
def test_published_band_narrows_in_proportion(radial: float) -> None:
    """theory B.4: at 43.83 deg, r = .1 / .01 in each joint gives +-.1532 / +-.01532 deg."""
    result = jp.worst(jp.loads(paper_text(radial))).isel(configuration=4)
    assert result.worst_rotation.item() == pytest.approx(1.532159 * radial, rel=2e-4 + 1e-2 * radial)


def test_clearance_that_lets_the_links_go_flat_is_flagged() -> None:
    """Links 0.5 mm short of their limit with 4 mm of play: somewhere in between the rocker is let go."""
    l1, ground, theta = 80.0, 150.0, 1.6
    reach = float(abs(l1 * np.exp(1j * theta) - ground))
    fb = FourBar(l1, 70.0, reach - 70.0 + 0.5, 0j, complex(ground))
    assert np.isnan(rotation_range(fb, theta, 4.0)).any()
    m = jp.loads(text_of(fb, theta, (1.0,) * 4))
    assert jp.solve(m).status.item() == "ok"
    assert jp.worst(m).status.item() == "singular"
