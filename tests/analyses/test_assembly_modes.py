"""The same assembly mode all along: across a change point, not across a gap, and away from the end of a range.

Circles tell both modes of a four-bar and of a five-bar, and how far the links reach.
"""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.builders import planar
from helpers.oracles.fourbar import FourBar
from helpers.strategies import four_bar_text

Floats = NDArray[np.float64]


def four_bar(fb: FourBar, angles: Floats, extra: str = "") -> jp.Mechanism:
    first = angles[0]
    start = tuple(np.rad2deg([first, fb.coupler_angle(first), fb.rocker_angle(first)]))
    text = four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, np.rad2deg(angles).tolist(), start=start, extra=extra)
    return jp.loads(text)


def with_a_gap(rng: np.random.Generator) -> tuple[FourBar, Floats]:
    """A four-bar whose crank cannot pass a small range about 0, and rows on both sides of it."""
    while True:
        ground, half = rng.uniform(120, 300), 10 ** rng.uniform(-3, -1)
        # At the edge coupler and rocker are folded: the law of cosines.
        folded = math.hypot(ground - 100, 2 * math.sqrt(100 * ground) * math.sin(half / 2))
        rocker = max(rng.uniform(0.3, 3) * ground, 1.1 * (100 + ground - folded) / 2)
        links = [rocker + folded, rocker]
        rng.shuffle(links)
        step, part = np.deg2rad(rng.uniform(1, 30)), rng.uniform(0.05, 0.95)
        angles = step * (np.arange(-3, 4) - part)
        fb = FourBar(100.0, *links, D=complex(ground), branch=int(rng.choice([-1, 1])))
        if min(part, 1 - part) * step > half and np.isfinite(fb.rocker_pin(angles[0])):
            return fb, angles


@pytest.mark.parametrize("seed", range(60))
def test_a_gap_between_two_modes_is_not_stepped_over(seed: int) -> None:
    """However small it is beside the step, and however little is missing for the crank to pass."""
    fb, angles = with_a_gap(np.random.default_rng(seed))
    path = jp.solve(four_bar(fb, angles))
    reached = angles < 0
    assert (path.status.values == np.where(reached, "ok", "not_assembled")).all()
    pin = fb.rocker_pin(angles[reached])
    found = path.nominal.values[reached, :2]
    np.testing.assert_allclose(found, np.stack([pin.real, pin.imag], axis=1), rtol=0, atol=1e-7)


def test_the_nearest_singular_place_is_this_side_of_a_gap() -> None:
    for seed in range(5):
        fb, angles = with_a_gap(np.random.default_rng(seed))
        found = jp.singularities(four_bar(fb, angles))
        there = np.deg2rad(found.singularity_at.values[: int((angles < 0).sum()), 0])
        folded = abs(fb.l2 - fb.l3)
        edge = math.acos((fb.l1**2 + fb.D.real**2 - folded**2) / (2 * fb.l1 * fb.D.real))
        np.testing.assert_allclose(there, -edge, rtol=0, atol=1e-6)


def five_bar(lengths: tuple[float, ...], drives: Floats) -> jp.Mechanism:
    left, right, left_rod, right_rod, ground = lengths
    both = modes(lengths, drives[:1])[0, 0]
    pins = [left * np.exp(1j * drives[0, 0]), ground + right * np.exp(1j * drives[0, 1])]
    build = planar(length="m", angle="rad")
    build.revolute("A", ground=(0, 0), left=(0, 0))
    build.revolute("B", left=(left, 0), left_rod=(0, 0))
    build.revolute("C", left_rod=(left_rod, 0), right_rod=(right_rod, 0))
    build.revolute("D", right=(right, 0), right_rod=(0, 0))
    build.revolute("E", ground=(ground, 0), right=(0, 0))
    for body, at, angle in (
        ("left", 0, drives[0, 0]),
        ("right", ground, drives[0, 1]),
        ("left_rod", pins[0], np.angle(both - pins[0])),
        ("right_rod", pins[1], np.angle(both - pins[1])),
    ):
        build.start(body, x=float(np.real(at)), y=float(np.imag(at)), angle=float(angle))
    build.drive("left", joint="A", values=drives[:, 0].tolist())
    build.drive("right", joint="E", values=drives[:, 1].tolist())
    build.output(body="left_rod", at=(left_rod, 0))
    return build.mechanism()


def modes(lengths: tuple[float, ...], drives: Floats) -> NDArray[np.complex128]:
    """The pin between the rods in both modes, shape (mode, row); not a number out of reach."""
    left, right, left_rod, right_rod, ground = lengths
    far = ground + right * np.exp(1j * drives[:, 1])
    return np.array([FourBar(left, left_rod, right_rod, D=far, branch=s).rocker_pin(drives[:, 0]) for s in (1, -1)])


def test_modes_that_come_near_each_other_are_told_apart() -> None:
    """On the straight way between two rows the rods are stretched but for 3e-7 of their length."""
    lengths = (0.8952867990041304, 0.5797191511388855, 1.3582746255647995, 0.4011565174232, 0.33123774286735197)
    drives = np.array([[-2.617576378085687, 0.6625789626445385], [-1.9230128285785713, 0.04212647866774666]])
    way = drives[0] + np.linspace(0, 1, 100_001)[:, None] * (drives[1] - drives[0])
    assert np.isfinite(modes(lengths, way)).all()
    path = jp.solve(five_bar(lengths, drives))
    assert (path.status == "ok").all()
    there = path.nominal.values[:, 0] + 1j * path.nominal.values[:, 1]
    np.testing.assert_allclose(there, modes(lengths, drives)[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("often", sorted(np.linspace(0.5, 2, 13), key=lambda often: 8 * often % 3 != 1))
def test_a_path_that_leaves_the_reach_comes_back_in_its_mode(often: float) -> None:
    lengths = (1.4108365172982196, 1.8922948560444737, 1.578758173609239, 1.9328578501194316, 1.046458052048105)
    around = np.linspace(0, 2 * np.pi, 1500)
    turns = 1.5 * np.stack([np.sin(around + 1) - np.sin(1), np.sin(often * around + 0.3) - np.sin(0.3)], axis=1)
    drives = np.array([1.1381069194328894, 1.0165914628352883]) + turns
    both = modes(lengths, drives)
    path = jp.solve(five_bar(lengths, drives))
    solved = (path.status == "ok").values
    assert not solved[~np.isfinite(both[0])].any()
    lost = np.flatnonzero(~solved)
    assert solved[: lost[0] if len(lost) else None].all()
    there = path.nominal.values[:, 0] + 1j * path.nominal.values[:, 1]
    np.testing.assert_allclose(there[solved], both[0][solved], rtol=0, atol=1e-7)


@pytest.mark.parametrize("seed", range(30))
def test_from_far_to_the_end_of_a_range_and_back(seed: int) -> None:
    """A row hardly before the end is found from far away, and leads back: it is no end of the list."""
    rng = np.random.default_rng(seed)
    while True:
        l1, l2, l3, ground = rng.uniform(20, 120, 4)
        cosine = (l1**2 + ground**2 - (l2 + l3) ** 2) / (2 * l1 * ground)
        fb = FourBar(l1, l2, l3, D=complex(ground), branch=int(rng.choice([-1, 1])))
        back = rng.uniform(0.5, 1.2)
        if abs(cosine) < 0.95 and np.isfinite(fb.rocker_pin(np.arccos(cosine) - back)):
            break
    end = float(np.arccos(cosine))
    near = [10.0**-k for k in (5.0, 6.0, 6.5, 6.8, 7.0, 7.2, 8.0, 9.0)]
    angles = np.array([end - back, *itertools.chain.from_iterable([end - d, end - back] for d in near)])
    path = jp.solve(four_bar(fb, angles, extra="[limits]\nsingular_value = 1e-5"))
    sigma, status = path.singular_value.values, path.status.values
    assert (status == np.where(sigma < 1e-5, "singular", "ok")).all(), status
    pin = fb.rocker_pin(angles)
    # To rounding, and by the root of it at the end.
    close = 1e-9 * l1 / np.maximum(np.sqrt(end - angles), 1e-4)
    assert (np.abs(path.nominal.values[:, 0] + 1j * path.nominal.values[:, 1] - pin) < close).all()


def test_a_range_that_was_followed_to_one_end_only_is_told() -> None:
    """Within a turn of the pinion a crank behind 20 : 400 gears gets to one end of its range only."""
    fb, first = FourBar(80.0, 110.0, 67.0, D=163 + 0j), math.radians(80)
    build = planar()
    build.revolute("P", ground=(-105, 0), pinion=(0, 0))
    build.revolute("J1", ground=(0, 0), crank=(0, 0))
    build.gear("G", pinion=(0, 0), crank=(0, 0), teeth=[20, 400], radii=[5, 100])
    build.revolute("J2", crank=(80, 0), coupler=(0, 0))
    build.revolute("J3", coupler=(110, 0), rocker=(67, 0))
    build.revolute("J4", ground=(163, 0), rocker=(0, 0))
    pin = complex(fb.crank_pin(first))
    build.start("pinion", angle=0.0)
    build.start("crank", angle=80.0)
    build.start("coupler", x=pin.real, y=pin.imag, angle=math.degrees(float(fb.coupler_angle(first))))
    build.start("rocker", x=163.0, y=0.0, angle=math.degrees(float(fb.rocker_angle(first))))
    build.drive("q", joint="P", values=[0, -60, -100, -120, -140, -180])
    build.output(body="coupler", at=(55, 10))
    path = jp.solve(build.mechanism())
    assert path.status.values.tolist() == ["ok"] * 4 + ["not_assembled"] * 2
    # The crank ends at 86.3947 deg, that is 20 times 6.3947 deg of the pinion.
    assert "can be assembled for q from -127.89 deg" in path.attrs["failure"]


@pytest.mark.parametrize("asymmetry", [0.0, 1e-14, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("middle", [[], [0.0], [-1 / 3, 1 / 3]])
@pytest.mark.parametrize("links", [(141, 165, 163, 187), (127, 141, 161, 175), (50, 120, 50, 120), (60, 60, 100, 100)])
def test_where_a_step_begins_and_ends_does_not_matter_at_a_change_point(
    links: tuple[float, ...], middle: list[float], asymmetry: float
) -> None:
    """Both links in line with the ground (l1 + D = l2 + l3): parts of a step may hit that pose, or hardly miss it."""
    l1, l2, l3, ground = links
    parts = np.array([-1.0, *middle, 1 + asymmetry])
    angles = math.pi + math.radians(20) * parts
    fb = FourBar(l1, l2, l3, D=complex(ground))
    # The modes change places there: of the sides of the line that the links are on each keeps its own.
    behind = FourBar(l1, l2, l3, D=complex(ground), branch=-1)
    path = jp.solve(four_bar(fb, angles))
    status = path.status.values.tolist()
    assert status == ["singular" if part == 0 else "ok" for part in parts]
    pin = np.where(parts <= 0, fb.rocker_pin(angles), behind.rocker_pin(angles))
    regular = parts != 0
    found = path.nominal.values[:, 0] + 1j * path.nominal.values[:, 1]
    np.testing.assert_allclose(found[regular], pin[regular], rtol=0, atol=1e-6)
