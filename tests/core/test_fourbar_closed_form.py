"""Four-bar linkages against circle intersection: nominal, given play, whole turns, limits, the published
trajectory."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from helpers.oracles.fourbar import FourBar, paper_four_bar
from helpers.oracles.rotatability import pin_boundary
from helpers.strategies import PAPER_ANGLES, four_bar_text, paper_text, random_four_bar, turn

SEEDS = range(12)


def text_of(fb: FourBar, degrees: list[float], radii=(0.0, 0.0, 0.0, 0.0), **options) -> str:
    """The file of a closed-form four-bar, started from its pose at the first drive value."""
    theta = math.radians(degrees[0])
    start = (degrees[0], math.degrees(fb.coupler_angle(theta)), math.degrees(fb.rocker_angle(theta)))
    return four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, degrees, radii, start=start, **options)


@pytest.mark.parametrize("seed", SEEDS)
def test_nominal_positions_are_circle_intersections(seed: int) -> None:
    fb, theta = random_four_bar(seed)
    degrees = np.rad2deg(theta + np.linspace(-0.1, 0.1, 5))
    result = jp.solve(jp.loads(text_of(fb, degrees.tolist())))
    pin, angle = fb.rocker_pin(np.deg2rad(degrees)), fb.rocker_angle(np.deg2rad(degrees))
    assert (result.status == "ok").all()
    np.testing.assert_allclose(result.nominal.sel(component="x"), pin.real, rtol=0, atol=1e-10 * fb.l1)
    np.testing.assert_allclose(result.nominal.sel(component="y"), pin.imag, rtol=0, atol=1e-10 * fb.l1)
    np.testing.assert_allclose(turn(result.nominal.sel(component="angle"), np.rad2deg(angle)), 0, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_given_play_moves_the_circles(seed: int) -> None:
    fb, theta = random_four_bar(seed)
    rng = np.random.default_rng(seed)
    radii = tuple(rng.uniform(0.05, 1.0, 4))
    degrees = np.rad2deg([theta, theta + 0.05])
    mechanism = jp.loads(text_of(fb, degrees.tolist(), radii))
    d = [r * np.sqrt(rng.uniform()) * np.exp(1j * rng.uniform(0, math.tau)) for r in radii]
    result = jp.given(mechanism, {f"J{k + 1}": [z.real, z.imag] for k, z in enumerate(d)})
    shift = fb.rocker_pin(np.deg2rad(degrees), d) - fb.rocker_pin(np.deg2rad(degrees))
    angle = fb.rocker_angle(np.deg2rad(degrees), d) - fb.rocker_angle(np.deg2rad(degrees))
    np.testing.assert_allclose(result.error.sel(component="x"), shift.real, rtol=0, atol=1e-10 * fb.l1)
    np.testing.assert_allclose(result.error.sel(component="y"), shift.imag, rtol=0, atol=1e-10 * fb.l1)
    np.testing.assert_allclose(turn(result.error.sel(component="angle"), np.rad2deg(angle)), 0, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_coupler_point_with_given_play_and_given_lengths(seed: int) -> None:
    fb, theta = random_four_bar(seed)
    rng = np.random.default_rng(seed)
    at, deviation = complex(*rng.uniform(-40, 80, 2)), rng.uniform(-0.5, 0.5)
    d = rng.uniform(-0.4, 0.4, 4) + 1j * rng.uniform(-0.4, 0.4, 4)
    extra = '[dimensions.l2]\nbody = "coupler"\nbetween = ["J2", "J3"]\n'
    extra += f"tolerance = 0.6\ndeviation = {deviation!r}\n"
    text = text_of(fb, [math.degrees(theta)], (0.6,) * 4, body="coupler", at=(at.real, at.imag), extra=extra)
    result = jp.given(jp.loads(text), {f"J{k + 1}": [z.real, z.imag] for k, z in enumerate(d)})

    def coupler_point(linkage: FourBar, play) -> tuple[complex, float]:
        angle = linkage.coupler_angle(theta, play)
        return linkage.crank_pin(theta) + play[0] + play[1] + at * np.exp(1j * angle), angle

    # The file's deviation is in the actual mechanism only: the nominal one has the nominal length.
    (moved, turned), (still, angle) = (
        coupler_point(fb.with_coupler(fb.l2 + deviation), d),
        coupler_point(fb, [0j] * 4),
    )
    expected = [(moved - still).real, (moved - still).imag]
    np.testing.assert_allclose(result.error[0, :2], expected, rtol=0, atol=1e-10 * fb.l1)
    np.testing.assert_allclose(turn(result.error[0, 2], math.degrees(turned - angle)), 0, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("count", [37, 9])
def test_whole_crank_turns_keep_the_branch(seed: int, count: int) -> None:
    """Grashof crank-rockers: two whole turns, in small and in very large steps, stay on one branch."""
    rng = np.random.default_rng(1000 + seed)
    while True:
        l1, l2, l3, ground = rng.uniform(20, 100, 4)
        links = sorted([l1, l2, l3, ground])
        # A margin on Grashof's rule keeps the linkage away from its change points.
        if links[0] == l1 and links[0] + links[3] < links[1] + links[2] - 4.0:
            break
    fb = FourBar(l1, l2, l3, 0j, complex(ground), branch=int(rng.choice([-1, 1])))
    degrees = rng.uniform(-180, 180) + np.linspace(0, 720, 2 * count - 1)
    result = jp.solve(jp.loads(text_of(fb, degrees.tolist())))
    pin = fb.rocker_pin(np.deg2rad(degrees))
    assert (result.status == "ok").all()
    np.testing.assert_allclose(result.nominal[:, 0], pin.real, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.nominal[:, 1], pin.imag, rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_drives_beyond_the_links_reach_are_not_assembled(seed: int) -> None:
    """A non-Grashof four-bar turns only so far: |B - D| = l2 + l3; beyond, no pose and no number."""
    rng = np.random.default_rng(2000 + seed)
    l1, ground = rng.uniform(60, 100, 2)
    limit = rng.uniform(1.2, 2.2)
    reach = abs(l1 * np.exp(1j * limit) - ground)
    l2 = reach * rng.uniform(0.4, 0.6)
    fb = FourBar(l1, l2, reach - l2, 0j, complex(ground), branch=int(rng.choice([-1, 1])))
    degrees = np.rad2deg([limit - 0.3, limit - 0.1, limit - 0.01, limit + 0.01, limit + 0.3, limit - 0.2])
    result = jp.solve(jp.loads(text_of(fb, degrees.tolist())))
    assert result.status.values.tolist() == ["ok"] * 3 + ["not_assembled"] * 2 + ["ok"]
    assert np.isnan(result.nominal[3:5]).all()
    pin = fb.rocker_pin(np.deg2rad(degrees))
    np.testing.assert_allclose(result.nominal[[0, 1, 2, 5], 0], pin.real[[0, 1, 2, 5]], rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.nominal[[0, 1, 2, 5], 1], pin.imag[[0, 1, 2, 5]], rtol=0, atol=1e-8)


def stretched() -> FourBar:
    """Coupler and rocker in line at a crank angle of 90 deg: the drive has lost its hold on the rocker."""
    return FourBar(100.0, math.hypot(100, 200) - 100.0, 100.0, 0j, 200 + 0j)


@pytest.mark.parametrize(("degrees", "limit"), [(90.0, 1e-6), (90.0, 1e-3), (89.9999, 1e-3)])
def test_the_stretched_four_bar_is_singular(degrees: float, limit: float) -> None:
    """There the coupler and the rocker can move at once with the crank still; every question says so."""
    fb = stretched()
    angle = math.degrees(math.atan2(100, -200))
    extra = f"[limits]\nsingular_value = {limit}\n[[loads]]\nforce = [3, 4]\n"
    start = (90.0, angle - 180.0, angle)
    text = four_bar_text(fb.l1, fb.l2, fb.l3, 200.0, [degrees], (0.1,) * 4, start=start, extra=extra)
    mechanism = jp.loads(text)
    for question in (jp.solve, jp.worst, jp.loaded):
        assert question(mechanism).status.item() == "singular"
    assert jp.random(mechanism, samples=1000).status.item() == "singular"


def test_near_singular_is_flagged_by_the_limit_of_the_file() -> None:
    fb = stretched()
    degrees = [60.0, 75.0, 85.0, 89.0, 89.9]
    plain = jp.solve(jp.loads(text_of(fb, degrees)))
    assert (plain.status == "ok").all()
    sigma = plain.singular_value.values
    assert (np.diff(sigma) < 0).all()
    assert sigma[-1] < 0.1 * sigma[0]
    limit = math.sqrt(float(sigma[2] * sigma[3]))
    strict = jp.solve(jp.loads(text_of(fb, degrees, extra=f"[limits]\nsingular_value = {limit!r}")))
    assert strict.status.values.tolist() == ["ok"] * 3 + ["singular"] * 2


@pytest.mark.parametrize("degrees", [90.0, 89.9999])
def test_the_singular_direction_turns_coupler_and_rocker_against_each_other(degrees: float) -> None:
    """The crank is still; P moves across the line of coupler and rocker: l2 w2 = -l3 w3."""
    fb = stretched()
    angle = math.degrees(math.atan2(100, -200))
    extra = "[limits]\nsingular_value = 0.001"
    start = (90.0, angle - 180.0, angle)
    text = four_bar_text(fb.l1, fb.l2, fb.l3, 200.0, [degrees], start=start, extra=extra)
    result = jp.solve(jp.loads(text)).isel(configuration=0)
    assert result.status.item() == "singular"
    motion = result.singular_motion
    assert np.abs(motion.sel(body="crank")).max() < 0.2  # mm and degrees, beside many degrees of the others
    turns = motion.sel(component="angle")
    coupler, rocker = turns.sel(body="coupler").item(), turns.sel(body="rocker").item()
    assert max(abs(coupler), abs(rocker)) > 20.0
    assert fb.l2 * coupler == pytest.approx(-fb.l3 * rocker, rel=2e-2)


def test_the_flat_parallelogram_is_a_change_point() -> None:
    """All links on one line: from here the linkage may go on as parallelogram or as antiparallelogram."""
    text = four_bar_text(50.0, 120.0, 50.0, 120.0, [0.0], start=(0.0, 0.0, 0.0))
    assert jp.solve(jp.loads(text)).status.item() == "singular"


@pytest.mark.parametrize("degrees", [[20.0, 10.0, -10.0, -20.0], [150.0, 179.5, 180.7, 200.0, 340.0]])
def test_a_path_across_the_change_point_goes_straight_on(degrees: list[float]) -> None:
    """A parallelogram driven past its flat position stays one: the rocker keeps turning as the crank does."""
    result = jp.solve(jp.loads(four_bar_text(50.0, 120.0, 50.0, 120.0, degrees, start=(degrees[0], 0.0, degrees[0]))))
    assert (result.status == "ok").all()
    np.testing.assert_allclose(turn(result.nominal[:, 2], degrees), 0.0, atol=1e-8)


def test_a_path_that_stops_on_the_change_point_is_not_lost_there() -> None:
    """The flat position itself is singular; those beyond it are within the links' reach and say so."""
    degrees = [20.0, 10.0, 0.0, -10.0, -20.0]
    result = jp.solve(jp.loads(four_bar_text(50.0, 120.0, 50.0, 120.0, degrees, start=(20.0, 0.0, 20.0))))
    assert result.status[2].item() == "singular"
    assert "not_assembled" not in result.status.values.tolist()
    np.testing.assert_allclose(result.nominal[2, :2], [170.0, 0.0], rtol=0, atol=1e-6)


# -- the 4R of Jaiswal et al. -------------------------------------


def test_published_trajectory() -> None:
    """Table 2 of the paper, nominal columns, to the last printed digit or so."""
    published = [
        (22.015, 87.248),
        (17.851, 92.796),
        (13.5, 98.071),
        (8.944, 103.108),
        (4.186, 107.913),
        (-0.773, 112.49),
        (-5.942, 116.846),
        (-11.303, 120.967),
        (-16.871, 124.858),
        (-22.647, 128.517),
        (-28.615, 131.925),
    ]
    result = jp.solve(jp.loads(paper_text()))
    assert (result.status == "ok").all()
    np.testing.assert_allclose(result.nominal[:, :2], published, rtol=0, atol=0.02)
    pin = paper_four_bar().rocker_pin(np.deg2rad(PAPER_ANGLES))
    np.testing.assert_allclose(result.nominal[:, 0], pin.real, rtol=0, atol=1e-9)
    np.testing.assert_allclose(result.nominal[:, 1], pin.imag, rtol=0, atol=1e-9)


def test_the_start_needs_only_be_rough() -> None:
    """Angles alone, ten degrees off, are enough; the positions follow."""
    result = jp.solve(jp.loads(paper_text(start=(22.7, 119.0, 44.0))))
    pin = paper_four_bar().rocker_pin(np.deg2rad(PAPER_ANGLES))
    np.testing.assert_allclose(result.nominal[:, 0], pin.real, rtol=0, atol=1e-9)


def test_force_on_the_rocker_pin_takes_it_to_the_lowest_point_of_its_region() -> None:
    """(0, -10) N: of all points within the pin's reach, the lowest; printed figures and a dense search."""
    fb = paper_four_bar()
    result = jp.loaded(jp.loads(paper_text(loads="[[loads]]\nforce = [0, -10]\n")))
    for k, printed in ((0, (0.9505, -3.1031)), (5, (1.4962, -2.6909)), (10, (1.9960, -2.2475))):
        error = result.error[k, :2].values
        np.testing.assert_allclose(error, printed, rtol=0, atol=6e-5)
        theta = math.radians(PAPER_ANGLES[k])
        region = pin_boundary(fb, theta, (1.0,) * 4) - fb.rocker_pin(theta)
        lowest = region[region.imag.argmin()]
        np.testing.assert_allclose(error, [lowest.real, lowest.imag], rtol=0, atol=1e-4)
        assert error[1] <= lowest.imag + 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_loaded_pin_is_the_farthest_point_of_its_region_along_the_force(seed: int) -> None:
    fb, theta = random_four_bar(seed)
    rng = np.random.default_rng(seed)
    radii, phi = tuple(rng.uniform(0.1, 0.6, 4)), rng.uniform(-math.pi, math.pi)
    load = f"[[loads]]\nforce = [{10 * math.cos(phi)!r}, {10 * math.sin(phi)!r}]\n"
    result = jp.loaded(jp.loads(text_of(fb, [math.degrees(theta)], radii, extra=load)))
    region = pin_boundary(fb, theta, radii) - fb.rocker_pin(theta)
    along = (region * np.exp(-1j * phi)).real
    best = region[along.argmax()]
    error = complex(*result.error[0, :2].values)
    assert abs((error * np.exp(-1j * phi)).real - along.max()) < 1e-7
    assert abs(error - best) < 2e-3


def test_a_dead_centre_is_singular_and_what_lies_beyond_it_is_not_assembled() -> None:
    """A slider that drives the crank: at 30 + 100 mm crank and rod are stretched, at 131 mm they do not reach."""
    b = planar()
    b.revolute("A", ground=(0, 0), crank=(0, 0))
    b.revolute("B", crank=(30, 0), rod=(0, 0))
    b.revolute("C", rod=(100, 0), slider=(0, 0))
    b.prismatic("S", ground={"at": (0, 0), "axis": (1, 0)}, slider=(0, 0))
    b.start("crank", angle=40)
    b.start("rod", angle=-10)
    b.start("slider", x=120)
    b.drive("s", joint="S", values=(120, 129, 130, 131, 129))
    b.output(body="crank", at="B")
    m = b.mechanism()
    path = jp.solve(m)
    assert path.status.values.tolist() == ["ok", "ok", "singular", "not_assembled", "ok"]
    # A crank at the end of its range is found to the square root of rounding.
    np.testing.assert_allclose(path.nominal.values[2, :2], [30.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(path.nominal.values[4], path.nominal.values[1], atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_where_a_crank_can_turn_no_farther(seed: int) -> None:
    """Coupler and rocker are stretched or folded there: the law of cosines tells the angle, from near and from far."""
    rng = np.random.default_rng(seed)
    while True:
        l1, l2, l3, ground = rng.uniform(20, 120, 4)
        stretched = bool(rng.integers(2))
        reach = l2 + l3 if stretched else abs(l2 - l3)
        cosine = (l1**2 + ground**2 - reach**2) / (2 * l1 * ground)
        back = 10 ** rng.uniform(-3, 0) * (-1 if stretched else 1)
        fb = FourBar(l1, l2, l3, D=complex(ground), branch=int(rng.choice([-1, 1])))
        if abs(cosine) < 1 and np.isfinite(fb.rocker_pin(np.arccos(cosine) + back)):
            break
    limit = float(np.arccos(cosine))
    angles = [limit + back * part for part in (1, 0, 1, 1e-9, 1, -1e-3, 1, -0.3, 1, -3, 1)]
    path = jp.solve(jp.loads(text_of(fb, np.rad2deg(angles).tolist())))
    beyond = ["not_assembled", "ok"]
    assert path.status.values.tolist() == ["ok", "singular", "ok", "singular", "ok", *3 * beyond]
    # At the end of its range a crank is found to the square root of rounding.
    line = fb.crank_pin(limit) - fb.D
    end = fb.D + (l3 if stretched or l3 > l2 else -l3) * line / abs(line)
    found = path.nominal.values[1, :2]
    np.testing.assert_allclose(found, [end.real, end.imag], rtol=0, atol=1e-4 * l1)
