"""`life`: growth of clearances by hand, by independent programs, and the number of cycles for which limits hold."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import jointplay as jp
from helpers.builders import planar, spatial
from helpers.machines import BUSH, GROWTH, LIFE, SIZES, TURN, WEAR
from helpers.slider_crank import slider_crank
from helpers.strategies import mechanisms
from jointplay.analyses.life import compute, holds
from jointplay.analyses.life.course import FLOOR, Course
from jointplay.analyses.life.sliding import Slide, _guide, _pin, _plate
from jointplay.analyses.nominal import Interrupted
from jointplay.basics.arrays import Floats
from jointplay.cli import run
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables

#: the slider-crank whose growth and life were found by a program that shares nothing with this one: without friction,
#: reactions at the nominal poses, 720 midpoints of a turn, 1e-5 mm3/(N m) everywhere
CRANK = slider_crank().mechanism().with_({"limits.position": 0.2})


def worn(wear: dict[str, dict[str, float]]) -> dict[str, object]:
    """Changes that give joints their wear."""
    return {f"joints.{name}.wear": dict(table) for name, table in wear.items()}


def grows(m: jp.Mechanism, **options: Any) -> Any:
    """Growth, and what else is known without any age."""
    return jp.life(m, "loaded", cycles=[0], **options)


# --- growth ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("diameter", [None, 10.0, 60.0])
def test_a_bush_grows_as_by_hand_whatever_its_diameter(diameter: float | None) -> None:
    wear = {"rate": 1e-4, "length": 20} | ({} if diameter is None else {"diameter": diameter})
    result = grows(BUSH.with_({"joints.J.wear": wear}))
    # 1.5708 nm a turn: k F 2 pi / (2 w).
    assert result.growth.item() == pytest.approx(1e-4 * 1e-3 * 100 * 2 * math.pi / (2 * 20), rel=1e-12)
    assert (result.attrs["cycle"], result.status.item()) == ("closed", "no_limit")
    if diameter is None:
        assert np.isnan(result.pressure.item())
        return
    # The volume of a crescent that a shift leaves of equal circles is D w h, and Archard's law k F s.
    sliding = math.pi * diameter
    assert result.sliding.item() == pytest.approx(sliding, rel=1e-12)
    assert result.pressure.item() == pytest.approx(100 / (diameter * 20), rel=1e-12)
    assert diameter * 20 * result.growth.item() == pytest.approx(1e-4 * 100 * sliding * 1e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("length", "force", "per"), [("m", "kN", (1e3, 1e-3)), ("in", "lbf", (1 / 25.4, 1 / 4.4482216152605))]
)
def test_the_rate_is_in_its_own_unit_whatever_those_of_the_file(
    length: str, force: str, per: tuple[float, float]
) -> None:
    mm, newton = (1e-3 if length == "m" else 1 / 25.4), per[1]
    changes: dict[str, Any] = {
        "units": {"length": length, "angle": "deg", "force": force},
        "joints.J.clearance.radial": 0.02 * mm,
        "joints.J.wear": {"rate": 1e-4, "length": 20 * mm, "diameter": 30 * mm},
        "output.at": [50 * mm, 0.0],
        "loads.0.force": [0.0, -100 * newton],
    }
    result = grows(BUSH.with_(changes))
    assert result.growth.item() / mm == pytest.approx(math.pi * 1e-4 * 1e-3 * 100 / 20, rel=1e-9)
    assert result.pressure.item() == pytest.approx(100 / 600, rel=1e-9)
    assert (result.growth.units, result.pressure.units) == (length, "MPa")


@pytest.mark.parametrize(
    ("hole", "pin", "share"), [(1e-4, 0.0, 1 / math.pi), (0.0, 1e-4, 1.0), (2e-4, 1e-4, 1 + 2 / math.pi)]
)
def test_what_the_load_goes_round_wears_all_round(hole: float, pin: float, share: float) -> None:
    """The force stands still in the ground, which carries the pin; the hole turns under it."""
    wear = {"rate_hole": hole, "rate_pin": pin, "length": 20}
    result = grows(BUSH.with_({"joints.J.wear": wear, "drives.q.count": 721}))
    # 720 places round the hole, and angles a quarter of a degree apart.
    assert result.growth.item() == pytest.approx(share * math.pi * 1e-4 * 1e-3 * 100 / 20, rel=2e-5)


def test_a_load_that_turns_with_the_hole_wears_the_hole_at_one_place() -> None:
    wear = {"rate_hole": 1e-4, "rate_pin": 0.0, "length": 20}
    changes = {"joints.J.wear": wear, "loads.0.axes": "body"}
    result = grows(BUSH.with_(changes))
    assert result.growth.item() == pytest.approx(math.pi * 1e-4 * 1e-3 * 100 / 20, rel=2e-5)


def test_growth_and_life_of_the_reference() -> None:
    m = CRANK
    tiny = {f"joints.{name}.clearance.{'gap' if name == 'guide' else 'radial'}": 1e-9 for name in GROWTH}
    result = grows(m.with_(TURN | worn(WEAR) | tiny | {"limits": None}))
    # What the trapezoid of 720 chords and 720 midpoints differ by where the sliding turns round.
    assert dict(zip(GROWTH, 1e6 * result.growth.values, strict=True)) == pytest.approx(GROWTH, rel=2e-5)
    measured = {name: {"growth": nanometres * 1e-6} for name, nanometres in GROWTH.items()}
    life = jp.life(m.with_(worn(measured)), "loaded", tolerance=1e-9)
    assert life.life.item() == pytest.approx(LIFE, abs=0.01)
    assert life.size_worn.values == pytest.approx(SIZES, abs=6e-8)
    assert (life.binding_quantity.item(), life.binding_configuration.item()) == ("position", 0)
    assert (life.life_low.item(), life.life_high.item()) == (life.life.item() / 2, life.life.item() * 2)


def test_growth_of_the_reference_while_it_runs() -> None:
    """At 50 rad/s inertia and weight press the joints as well; the figures are of the same independent program."""
    heavy = {"crank": (0.8, [15, 0], 900), "rod": (0.5, [50, 4], 800), "ram": (1.2, [5, -3], 600)}
    bodies = {
        f"bodies.{name}": {"mass": mass, "centre": centre, "rotational_inertia": inertia}
        for name, (mass, centre, inertia) in heavy.items()
    }
    tiny = {f"joints.{name}.clearance.{'gap' if name == 'guide' else 'radial'}": 1e-9 for name in GROWTH}
    speed = {"units.turning_speed": "rad/s", "drives.theta.speed": 50, "gravity": [0, -9.81]}
    result = grows(CRANK.with_(TURN | worn(WEAR) | tiny | {"limits": None}).with_(bodies | speed))
    known = [0.371024650, 0.405137963, 0.114522622, 0.102800238]
    assert 1e6 * result.growth.values == pytest.approx(known, rel=2e-5)
    assert result.attrs["speeds"] == "theta 50 rad/s"


def fourbar(rng: np.random.Generator) -> Iterator[Any]:
    """A random crank-rocker with loads, as a file; and the growth of its pins by a program of its own."""
    ground, crank, coupler, rocker = 100.0, rng.uniform(20, 35), rng.uniform(80, 110), rng.uniform(60, 90)
    force, at = rng.uniform(-100, 100, 2), rng.uniform(-30, 60, 2)
    width = rng.uniform(5, 30, 4)
    count = 180
    b = planar()
    b.revolute("A", ground=(0, 0), crank=(0, 0))
    b.revolute("B", crank=(crank, 0), coupler=(0, 0))
    b.revolute("C", coupler=(coupler, 0), rocker=(rocker, 0))
    b.revolute("D", ground=(ground, 0), rocker=(0, 0))
    b.start("coupler", angle=20)
    b.start("rocker", angle=80)
    b.drive("q", joint="A", from_=0, to=360, count=count + 1)
    b.output(body="coupler")
    b.load(at=at, force=force)
    changes: dict[str, Any] = {}
    for k, name in enumerate("ABCD"):
        changes[f"joints.{name}.clearance"] = {"radial": 1e-9}
        changes[f"joints.{name}.wear"] = {"rate": 1e-6 * (k + 1), "length": float(width[k])}
    yield b.mechanism().with_(changes)

    def links(theta: float) -> tuple[float, float]:
        b = crank * np.array([math.cos(theta), math.sin(theta)])
        d = np.array([ground, 0.0])
        along = d - b
        far = float(np.linalg.norm(along))
        x = (far**2 + coupler**2 - rocker**2) / (2 * far)
        y = math.sqrt(coupler**2 - x**2)
        unit = along / far
        c = b + x * unit + y * np.array([-unit[1], unit[0]])
        return math.atan2(*(c - b)[::-1]), math.atan2(*(c - d)[::-1])

    def turned(angle: float, v: Any) -> Floats:
        return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ np.asarray(v)

    def crossed(a: Floats, b: Floats) -> float:
        return float(a[0] * b[1] - a[1] * b[0])

    angles, sizes = [], []
    for theta in np.linspace(0, 2 * np.pi, count + 1):
        phi, psi = links(theta)
        # The coupler in equilibrium: forces in B and C and the load; the force in C lies along the rocker.
        to_c, to_load = turned(phi, [coupler, 0]), turned(phi, at)
        along = np.array([math.cos(psi), math.sin(psi)])
        f = -crossed(to_load, force) / crossed(to_c, along)
        in_c = f * along
        sizes.append([np.linalg.norm(force + in_c), np.linalg.norm(force + in_c), abs(f), abs(f)])
        angles.append([theta, phi - theta, psi - phi, psi])
    rolled = np.abs(np.remainder(np.diff(angles, axis=0) + np.pi, 2 * np.pi) - np.pi)
    mean = 0.5 * (np.array(sizes)[1:] + np.array(sizes)[:-1])
    yield 1e-9 * np.arange(1, 5) * (mean * rolled).sum(axis=0) / (2 * width)


@pytest.mark.parametrize("seed", range(30))
def test_a_random_four_bar_wears_as_by_a_program_of_its_own(seed: int) -> None:
    m, growth = fourbar(np.random.default_rng(seed))
    result = grows(m)
    assert (result.attrs["cycle"], result.status.item()) == ("closed", "no_limit")
    # Clearances of a billionth of a millimetre; the closure is solved to about as much.
    assert result.growth.values == pytest.approx(growth, rel=1e-6)


def test_a_path_that_ends_elsewhere_is_gone_back() -> None:
    half = {"drives.q": {"joint": "J", "from": 0, "to": 180, "count": 19}}
    m = BUSH.with_(half)
    both, once = grows(m), grows(m, cycle="one-way")
    assert (both.attrs["cycle"], once.attrs["cycle"]) == ("back-and-forth", "one-way")
    assert both.growth.item() == pytest.approx(2 * once.growth.item(), rel=1e-14)
    assert both.growth.item() == pytest.approx(grows(BUSH).growth.item(), rel=1e-12)
    with pytest.raises(jp.InputError, match="cycle: the path does not end where it began"):
        grows(m, cycle="closed")
    with pytest.raises(jp.InputError, match="'there' is not a cycle"):
        grows(m, cycle="there")


def test_a_turn_may_end_one_step_before_its_beginning() -> None:
    turn = {"drives.q": {"joint": "J", "from": 0, "to": 350, "count": 36}}
    result = grows(BUSH.with_(turn))
    assert result.attrs["cycle"] == "closed"
    assert result.growth.item() == pytest.approx(grows(BUSH).growth.item(), rel=1e-12)


def test_both_ends_of_a_pin_in_space_by_hand() -> None:
    """A force 30 mm beyond the middle of a pin 40 mm long: F (1/2 + 30/40) at one end, which has half of the length."""
    b = spatial()
    b.revolute(
        "J",
        ground={"at": [0, 0, 0], "axis": [0, 0, 1]},
        crank={"at": [0, 0, 0], "axis": [0, 0, 1]},
        clearance=jp.radial(1e-9, axial=0.01, length=40),
        wear={"rate": 1e-5, "diameter": 20},
    )
    b.drive("q", joint="J", from_=0, to=360, count=37)
    b.output(body="crank", at=(50, 0, 30))
    b.load(at=(0, 0, 30), force=(0, -100, 0))
    m = b.mechanism()
    result = grows(m)
    most = 100 * (0.5 + 30 / 40)
    assert result.growth.item() == pytest.approx(1e-5 * 1e-3 * most * 2 * math.pi / 40, rel=1e-9)
    assert result.pressure.item() == pytest.approx(most / (20 * 20), rel=1e-9)
    own = {"rate_hole": 1e-5, "rate_pin": 0.0, "diameter": 20}
    around = grows(m.with_({"joints.J.wear": own, "drives.q.count": 361}))
    assert around.growth.item() == pytest.approx(result.growth.item() / math.pi, rel=1e-4)
    along = grows(m.with_({"joints.J.wear": own, "loads.0.axes": "body"}))
    assert along.growth.item() == pytest.approx(result.growth.item(), rel=1e-4)
    # Each load case wears another end most; the other one has F (30/40 - 1/2) then.
    above, below = ([{"at": [0, 0, z], "force": [0, -100, 0]}] for z in (30, -30))
    each = grows(m.with_({"loads": None, "load_cases": {"above": above, "below": below}}))
    mean = 0.5 * (most + 100 * (30 / 40 - 0.5))
    assert each.growth.item() == pytest.approx(result.growth.item() * mean / most, rel=1e-9)
    assert each.pressure.item() == pytest.approx(result.pressure.item(), rel=1e-9)


def test_a_pin_that_slides_and_turns_goes_along_its_helix() -> None:
    moved = slide(2)
    moved.turns[:, 0], moved.shifts[:, 0] = [0.3, 0.0], [0.004, 0.001]
    force = np.array([[0.0, 6.0, 8.0]] * 3)
    faces = _pin(force, np.zeros((3, 3)), moved, 0.02, 0.01, 0.04)
    slid = math.hypot(0.005 * 0.3, 0.004) + 0.001
    assert faces.slid == pytest.approx(slid, rel=1e-12)
    # Each end has half of the force and half of the length.
    assert faces.pressure == pytest.approx(np.full((3, 2), 10 / (0.01 * 0.04)))


def test_a_ball_rolls_across_its_force() -> None:
    """A rod between two balls pushes a slider: the ball turns by what the direction of the rod does."""
    b = spatial()
    b.revolute("J", ground={"at": [0, 0, 0], "axis": [0, 0, 1]}, crank={"at": [0, 0, 0], "axis": [0, 0, 1]})
    b.spherical("A", crank=(40, 0, 10), rod=(0, 0, 0), clearance=jp.radial(1e-9), wear={"rate": 1e-5, "diameter": 18})
    b.spherical("B", rod=(120, 0, 0), slider=(0, 0, 0), clearance=jp.radial(1e-9, diameter=18), wear={"rate": 1e-5})
    b.prismatic("G", ground={"at": [0, 15, -30], "axis": [1, 0, 0]}, slider={"at": [0, 0, 0], "axis": [1, 0, 0]})
    b.start("slider", x=150)
    b.drive("q", joint="J", from_=0, to=360, count=361)
    b.output(body="slider")
    b.load(force=(-200, 30, 40))
    result = grows(b.mechanism())
    theta = np.linspace(0, 2 * np.pi, 361)
    a = np.stack([40 * np.cos(theta), 40 * np.sin(theta), np.full(361, 10.0)], axis=1)
    across = np.array([0.0, 15.0, -30.0]) - a
    x = a[:, 0] + np.sqrt(120**2 - across[:, 1] ** 2 - across[:, 2] ** 2)
    rod = np.stack([x - a[:, 0], across[:, 1], across[:, 2]], axis=1) / 120
    force = 200 / np.abs(rod[:, 0])
    c, s = np.cos(theta), np.sin(theta)
    in_crank = np.stack([c * rod[:, 0] + s * rod[:, 1], c * rod[:, 1] - s * rod[:, 0], rod[:, 2]], axis=1)
    for name, direction in (("A", in_crank), ("B", rod)):
        turns = np.linalg.norm(np.cross(direction[1:], direction[:-1]), axis=1)
        growth = 1e-5 * 1e-3 * (0.5 * (force[1:] + force[:-1]) * turns).sum() / (math.pi * 9)
        # Steps of a degree: a chord for an arc, of which only the part across the force slides.
        assert result.growth.sel(source=name).item() == pytest.approx(growth, rel=2e-4)
        assert result.pressure.sel(source=name).item() == pytest.approx(force.max() / (math.pi * 81), rel=1e-6)


def slide(steps: int, turn: Any = (0, 0, 0), shift: Any = (0, 0, 0)) -> Slide:
    """Steps of one kind along an axis x."""
    still = np.broadcast_to(np.eye(3), (steps + 1, 3, 3))
    along, side, normal = np.eye(3)
    return Slide(
        np.tile(np.array(turn, float), (steps, 1)),
        np.tile(np.array(shift, float), (steps, 1)),
        still,
        along,
        side,
        normal,
    )


@pytest.mark.parametrize("seed", range(6))
def test_normal_forces_of_a_guide_are_the_smallest_that_balance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length, width, height = rng.uniform(0.01, 0.05, 3)
    force, moment = np.array([0.0, *rng.normal(size=2) * 100]), rng.normal(size=3) * [60, 3, 3]
    size = {"half_length": length, "half_width": width, "half_height": height}
    faces = _guide(force[None], moment[None], slide(0), size, np.zeros(0))
    sums = faces.pressure[0] * 4 * length * np.array([height, width])
    columns, pairs = [], []
    for x in (-length, length):
        for place in (-1, 1):
            for sign in (-1, 1):
                for pair, at, n in (
                    (0, [x, sign * width, place * height], [0, sign, 0]),
                    (1, [x, place * width, sign * height], [0, 0, sign]),
                ):
                    columns.append([*n[1:], *np.cross(at, n)])
                    pairs.append(pair)
    balance = np.array(columns).T
    best = linprog(np.ones(len(pairs)), A_eq=balance, b_eq=[*force[1:], *moment])
    assert sums.sum() == pytest.approx(best.fun, rel=1e-9)
    # And so they can be shared between the pairs of faces.
    shared = np.vstack([balance, np.array(pairs) == 0, np.array(pairs) == 1])
    assert linprog(np.ones(len(pairs)), A_eq=shared, b_eq=[*force[1:], *moment, *sums]).status == 0


def test_a_slider_in_space_by_hand() -> None:
    """A tilting moment of 5000 N mm needs 5000 / 30 on the upright pair, one of 4000 N mm 4000 / 30 on the other."""
    b = spatial()
    b.prismatic(
        "G",
        bodies=["ground", "slider"],
        at=(0, 0, 0),
        axis=(1, 0, 0),
        side=(0, 1, 0),
        clearance=jp.gap(1e-9, length=60, width=30, height=20),
        wear={"rate": 1e-5},
    )
    b.drive("q", joint="G", from_=0, to=100, count=3)
    b.output(body="slider")
    b.load(at=(50, 0, 0), force=(0, 80, -100))
    result = grows(b.mechanism())
    assert result.sliding.item() == pytest.approx(200)
    worst = max(5000 / 30 / (60 * 30), 4000 / 30 / (60 * 20))
    assert result.growth.item() == pytest.approx(1e-5 * 1e-3 * 200 * worst, rel=1e-6)


def test_a_slider_on_an_arm_that_turns_slides_along_the_arm() -> None:
    """The arm turns by 90 degrees while the slider goes 50 mm along it, under a load that turns with it."""
    b = planar()
    b.revolute("J", ground=(0, 0), arm=(0, 0))
    b.prismatic(
        "G",
        arm={"at": [0, 0], "axis": [1, 0]},
        slider=(0, 0),
        clearance=jp.gap(1e-9, length=20),
        wear={"rate": 1e-5, "width": 10},
    )
    b.drive("q", joint="J", from_=0, to=90, count=11)
    b.drive("r", joint="G", from_=30, to=80, count=11)
    b.output(body="slider")
    b.load(force=(0, -100), axes="body")
    result = grows(b.mechanism(), cycle="one-way")
    assert result.sliding.item() == pytest.approx(50, rel=1e-9)
    assert result.growth.item() == pytest.approx(1e-5 * 1e-3 * 100 * 50 / (20 * 10), rel=1e-6)


def test_a_plate_that_turns_slides_by_its_mean_distance_from_the_middle() -> None:
    """Mean distance of the points of a square from its middle: (sqrt 2 + asinh 1) / 6 of its side."""
    size = {"half_normal": 0.05, "half_side": 0.05}
    faces = _plate(np.array([[100.0, 0, 0]] * 2), np.zeros((2, 3)), slide(1, turn=(0.01, 0, 0)), size)
    mean = 0.1 * (math.sqrt(2) + math.asinh(1)) / 6
    # Ten nodes to a side across a function with a tip in the middle.
    assert faces.slid == pytest.approx(0.01 * mean, rel=2e-3)
    assert faces.pressure[:, 0] == pytest.approx(100 / 0.01)
    tilted = _plate(np.array([[100.0, 0, 0]] * 2), np.array([[0, 9.0, 0]] * 2), slide(1, shift=(0, 3e-3, 4e-3)), size)
    assert tilted.slid == pytest.approx(5e-3)
    assert tilted.pressure[:, 0] == pytest.approx(9 / 0.05 / 0.01)


def test_both_ends_of_a_pin_balance_its_wrench() -> None:
    rng = np.random.default_rng(3)
    force, moment = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)) * 0.02
    faces = _pin(force, moment, slide(4), 0.02, 0.01, 0.04)
    ends = faces.pressure * 0.01 * 0.02
    assert faces.towards is not None
    forces = np.stack([ends * np.cos(faces.towards), ends * np.sin(faces.towards)], axis=-1)
    assert forces.sum(axis=1) == pytest.approx(force[:, 1:])
    # A force at +l along x has the moment (0, -l Fz, l Fy).
    apart = 0.02 * (forces[:, 0] - forces[:, 1])
    assert np.stack([-apart[:, 1], apart[:, 0]], axis=1) == pytest.approx(moment[:, 1:])


# --- the course ------------------------------------------------------------------------------------------------------


def test_the_course_of_a_linear_law_is_that_of_its_exponentials() -> None:
    """dc/dN = g0 - c / T, of which the solution is g0 T (1 - exp(-N / T))."""
    g, t = np.array([1e-7, 4e-7]), np.array([2e5, 5e4])
    course = Course(lambda grown: g - grown / t, g, 0.02)
    for cycles in (1e3, 1e5, 4e5):
        exact = g * t * (1 - np.exp(-cycles / t))
        # A step of first order may be off by a thousandth of a clearance; those of second order are off by less.
        assert course.at(cycles) == pytest.approx(exact, abs=1e-3 * 0.02)
    assert course.at(1e3).tolist() == course.at(1e3).tolist()


def slots() -> jp.Mechanism:
    """A block on three pins in slots, of which the middle one has more play."""
    b = planar()
    for name, x, gap in (("A", -50, 0.01), ("B", 0, 0.02), ("C", 50, 0.01)):
        slot, wear = {"at": [0, 0], "axis": [1, 0]}, {"rate": 1e-5, "length": 20, "width": 10}
        b.pin_in_slot(name, ground=slot, block=(x, 0), clearance=jp.gap(gap), wear=wear)
    b.drive("q", joint="B", from_=0, to=100, count=5)
    b.output(body="block")
    b.limits(position=0.05)
    b.load(force=(0, -100))
    return b.mechanism()


SLOTS = slots()


def test_in_an_over_constrained_mechanism_the_tightest_joints_carry_first() -> None:
    """The outer slots carry half each until they have worn as far as the middle one; then all three a third."""
    rate = 1e-5 * 1e-3 * 200 / (20 * 10)
    until = 0.01 / (rate * 50)
    ages = [0.0, until / 2, until, 2 * until, 4 * until]
    result = jp.life(SLOTS, "loaded", cycles=ages)
    assert result.growth.values == pytest.approx([50 * rate, 0.0, 50 * rate], abs=1e-12 * rate)
    after = [0.02 + (age - until) * rate * 100 / 3 for age in ages[2:]]
    expected = np.array([[0.01, 0.02, 0.01], [0.015, 0.02, 0.015], *([one] * 3 for one in after)])
    # Where the load jumps, steps have a floor: a part of the clearances.
    assert result.clearance.values == pytest.approx(expected, abs=1.5 * FLOOR * expected.max())
    assert result.attrs["steps"] == "shortest"
    exact = until + (0.05 - 0.02) / (rate * 100 / 3)
    assert result.life.item() == pytest.approx(exact, rel=0.01)


def test_elastic_slots_share_the_load_as_they_wear() -> None:
    """The middle one carries k (w - its gap), the outer ones k (w - theirs): an exponential towards a third each."""
    k = 2e3
    m = SLOTS.with_({f"joints.{n}.stiffness": {"normal": k} for n in "ABC"})
    rate = 1e-5 * 1e-3 * 200 / (20 * 10)
    # All carry from the start: the sum is 100 N, the difference of gaps 0.01 mm is 20 N.
    first = [100 / 3 + 20 / 3, 100 / 3 - 40 / 3, 100 / 3 + 20 / 3]
    time = 1 / (rate * k)
    result = jp.life(m, "loaded", cycles=[0.0, time, 3 * time])
    assert result.growth.values == pytest.approx(np.array(first) * rate, rel=1e-4)
    gap = result.clearance.sel(source="B").values - result.clearance.sel(source="A").values
    assert gap == pytest.approx(0.01 * np.exp([0.0, -1.0, -3.0]), abs=2e-5)


# --- the life --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("question", ["worst", "loaded", "random"])
def test_the_limits_hold_up_to_the_life_and_no_longer(question: str) -> None:
    m = CRANK.with_(worn({"pin": {"growth": 1e-7}, "guide": {"growth": 2e-8}}))
    options: dict[str, Any] = {"samples": 2000} if question == "random" else {}
    result = jp.life(m, question, **options)
    assert result.status.item() == "ok"
    ages = [0.5, 1.0, 1.001]
    used = jp.life(m, question, cycles=[age * result.life.item() for age in ages], **options).used.values
    # A specimen in two thousand is a step of what is used of a yield.
    assert used[0] < 1.0
    assert used[1] <= 1.0
    assert used[2] > 1.0 or question == "random"
    # What it says of the sizes is what a file with them says.
    sizes = dict(zip(result.source.values.tolist(), result.size_worn.values.tolist(), strict=True))
    copy = m.with_({"joints.pin.clearance.radial": sizes["pin"], "joints.guide.clearance.gap": sizes["guide"]})
    if question != "random":
        asked = getattr(jp, question)(copy)
        largest = asked.worst_position if question == "worst" else np.hypot(*asked.error.values[:, :2].T)
        assert float(largest.max()) == pytest.approx(0.2, rel=2e-4)
        assert float(largest.max()) == pytest.approx(float(result.position.values[-1].max()), rel=1e-9)


@settings(max_examples=4, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(mechanisms(), st.sampled_from(["worst", "loaded"]))
def test_limits_hold_up_to_the_life_of_random_mechanisms(text: str, question: str) -> None:
    m = jp.loads(text)
    sizes = {"revolute": {"length": 10.0}, "prismatic": {"width": 10.0}, "pin_in_slot": {"length": 10.0, "width": 10.0}}
    wear = {
        f"joints.{name}.wear": {"rate": 1e-6, **sizes[joint["type"]]}
        for name, joint in m.raw["joints"].items()
        if "clearance" in joint
    }
    limit = 1.5 * float(jp.worst(m).worst_position.max())
    m = m.with_({**wear, "limits": {"position": limit}} | ({} if m.has_loads else {"loads": [{"force": [0, -10.0]}]}))
    result = jp.life(m, question)
    assert result.status.item() in ("ok", "unlimited")
    if result.status.item() == "ok":
        used = jp.life(m, question, cycles=[result.life.item(), 1.001 * result.life.item()]).used.values
        assert used[0] <= 1.0 < used[1]


def test_rates_of_twice_the_size_halve_the_life() -> None:
    m = CRANK.with_(TURN | worn(WEAR) | {"drives.theta.count": 36, "drives.theta.to": 350, "drives.theta.from": 0})
    twice = {name: {**table, "rate": 2e-5} for name, table in WEAR.items()}
    once, fast = jp.life(m, "loaded"), jp.life(m.with_(worn(twice)), "loaded")
    assert fast.life.item() == pytest.approx(once.life_low.item(), rel=2e-4)
    assert fast.size_worn.values == pytest.approx(once.size_worn.values, rel=2e-4)
    assert once.used_without.values.argmin() == 1
    assert "wear of pin counts most" in conclude(compute(m, "loaded")).sentences[1].text


def test_measures_and_tolerances_of_the_file_are_kept() -> None:
    """A diametral clearance grows by its own measure; what scatters does so about the larger play."""
    base = BUSH
    diametral = base.with_({"joints.J.clearance": {"diametral": 0.04}})
    one, two = jp.life(base), jp.life(diametral)
    assert two.growth.item() == pytest.approx(2 * one.growth.item(), rel=1e-12)
    assert (two["size"].item(), two.source_measure.item()) == (pytest.approx(0.04), "diametral")
    measured = {"joints.J.wear": {"growth": 1e-6}, "limits.position": 0.1}
    assert jp.life(diametral.with_(measured)).life.item() == pytest.approx(
        2 * jp.life(base.with_(measured)).life.item(), rel=1e-3
    )
    fits = {
        "joints.J.clearance": {
            "hole": {"diameter": 30.1, "tolerance": 0.02},
            "pin": {"diameter": 30, "tolerance": 0.01},
        }
    }
    scattering = base.with_(fits | measured)
    # The largest play is (0.1 + 0.03) / 2 at the start.
    assert jp.life(scattering).life.item() == pytest.approx((0.1 - 0.065) / 1e-6, rel=2e-4)
    assert jp.life(scattering)["size"].item() == pytest.approx(0.05)


def test_copies_of_a_pattern_and_riders_of_a_pin_wear() -> None:
    """Two rods on one pin: the clearance has one size in the file, and the rod that wears it more decides."""
    b = planar()
    wear = {"rate": 1e-5, "length": 10}
    b.revolute("J", ground=(0, 0), left=(0, 0), right=(0, 0), clearance=jp.radial(1e-9), wear=wear)
    b.output(body="left", at=(50, 0))
    for rod, force in (("left", -100), ("right", -300)):
        b.drive(rod, joint=f"J/{rod}", from_=0, to=360, count=37)
        b.load(body=rod, at=(0, 0), force=(0, force))
    result = jp.life(b.mechanism())
    assert result.source.values.tolist() == ["J"]
    assert result.growth.item() == pytest.approx(1e-5 * 1e-3 * 300 * math.pi / 10, rel=1e-9)


# --- what cannot be ---------------------------------------------------------------------------------------------------


def said(m: jp.Mechanism, question: str = "worst", **options: Any) -> tuple[str, str, bool]:
    """The status, the first sentence, and whether the command says that it is good."""
    result = compute(m, question, **options)
    assert tables(result)
    return str(result.get("status")), conclude(result).sentences[0].text, holds(result)


def test_without_limits_there_is_growth_and_no_life() -> None:
    status, first, good = said(BUSH, "loaded", cycles=[0, 1e6])
    assert (status, good) == ("no_limit", True)
    assert first == "No limit is set, so that there is no life: [limits] of the file says what is acceptable."
    result = jp.life(BUSH, "loaded", cycles=[0, 1e6])
    assert result.clearance.values[:, 0] == pytest.approx([0.02, 0.02 + math.pi / 2])
    assert "used" not in result
    assert result.position.values[:, 0] == pytest.approx([0.02, 0.02 + math.pi / 2], rel=1e-6)
    assert np.isnan(result.life.item())


def test_limits_that_are_missed_already() -> None:
    status, first, good = said(BUSH.with_({"limits.position": 0.01}))
    assert (status, good) == ("missed", False)
    missed = "The limits are missed in the worst case before anything wears"
    assert first == f"{missed}; the limit of position at configuration 0 comes first."


def test_what_does_not_slide_or_is_not_pressed_does_not_wear() -> None:
    still = BUSH.with_({"loads.0.force": [0, 0], "loads.0.moment": 5.0, "limits.position": 1})
    assert said(still)[0] == "no_wear"
    assert jp.life(still).life.item() == math.inf
    assert said(still)[1] == "Nothing wears: no joint with `wear` slides under a force."


def test_a_limit_that_wear_does_not_reach() -> None:
    status, first, good = said(BUSH.with_({"limits.angle": 360}))
    assert (status, good) == ("unlimited", True)
    assert first.startswith("The limits hold in the worst case for more than ")


def test_a_cycle_needs_all_configurations() -> None:
    m = CRANK.with_(worn(WEAR) | {"joints.wrist.on.rod": [30, 0], "limits": None})
    m = m.with_({"drives.theta.values": [0, 10, 90]})
    status, first, good = said(m)
    assert (status, good) == ("no_pose", False)
    assert first == (
        "Not shown: for how long the limits hold; a cycle needs all configurations, and configuration 2 is not"
        " assembled."
    )


def test_shares_that_nothing_determines_are_named() -> None:
    stiff = {f"joints.{name}.clearance": None for name in "AC"} | {f"joints.{name}.wear": None for name in "AC"}
    m = SLOTS.with_({**stiff, "joints.B.clearance.gap": 0.0})
    status, first, good = said(m, "loaded")
    assert (status, good) == ("undetermined", False)
    assert first == "Not shown: for how long the limits hold; the loads do not say what is carried by B."


def test_ages_beyond_the_life_are_told_and_end_with_one() -> None:
    m = BUSH.with_({"limits.position": 0.1})
    result = compute(m, cycles=[0, 10_000, 200_000])
    assert not holds(result)
    assert next(s.text for s in conclude(result).sentences if s.is_alarm).startswith("After 200,000 cycles")
    assert holds(compute(m, cycles=[0, 10_000]))


REFUSED = {
    "no wear": ({"joints.J.wear": None}, "joints: no joint has `wear`"),
    "both": ({"joints.J.wear": {"rate": 1e-5, "growth": 1e-6}}, "joints.J.wear: give rate or growth, not both"),
    "none": ({"joints.J.wear": {"length": 20}}, "joints.J.wear: say how fast it wears"),
    "no length": ({"joints.J.wear": {"rate": 1e-5}}, "joints.J: wear: 'length' is missing"),
    "half": ({"joints.J.wear": {"rate_pin": 1e-5, "length": 20}}, "joints.J.wear: 'rate_hole' is missing"),
    "no clearance": ({"joints.J.clearance": None}, "joints.J: wear: it goes with clearance"),
    "bearing": ({"joints.J.clearance": {"bearing": "CN", "bore": 20}}, "joints.J: wear: the balls of a bearing roll"),
    "negative": ({"joints.J.wear.rate": -1.0}, "joints.J.wear.rate"),
    "fixed": ({"joints.J.type": "fixed", "drives": {}}, "nothing slides in a fixed joint"),
    "one pose": ({"drives.q": {"joint": "J", "values": [0]}}, "drives: the path has one configuration"),
    "no load": ({"loads": None}, "loads: nothing loads the mechanism"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_refused_by_key_and_reason(case: str) -> None:
    changes, words = REFUSED[case]
    with pytest.raises(jp.InputError) as refused:
        jp.life(BUSH.with_(changes))
    assert words in str(refused.value)


def test_flanks_do_not_wear_by_this_law() -> None:
    m = jp.loads(jp.examples.text("geared-five-bar"))
    gear = next(name for name, joint in m.raw["joints"].items() if joint["type"] == "gear")
    with pytest.raises(jp.InputError, match="how flanks, belts and threads slide"):
        m.with_({f"joints.{gear}.wear": {"rate": 1e-5}})


@pytest.mark.parametrize("cycles", [[-1.0], [math.nan], [math.inf], []])
def test_ages_are_numbers_of_cycles(cycles: list[float]) -> None:
    with pytest.raises(jp.InputError, match="cycles: "):
        jp.life(BUSH, cycles=cycles)


@pytest.mark.parametrize("change", [{"loads": None}, {"drives.q": {"joint": "J", "values": [0]}}])
def test_measured_growth_needs_neither_a_load_nor_a_path(change: dict[str, Any]) -> None:
    m = BUSH.with_({"joints.J.wear": {"growth": 1e-6}, "limits.position": 0.1, **change})
    assert jp.life(m).life.item() == pytest.approx(0.08 / 1e-6, rel=2e-4)


def test_an_interrupt_between_ages_leaves_those_that_are_done() -> None:
    m = BUSH.with_({"limits.position": 0.1})
    seen: list[int] = []

    def stop(done: int, _: int) -> None:
        seen.append(done)
        if len(seen) == count - 3:
            raise KeyboardInterrupt

    def at_once(*_: int) -> None:
        raise KeyboardInterrupt

    count = 0
    compute(m, progress=lambda done, _: seen.append(done))
    count, seen = len(seen), []
    with pytest.raises(Interrupted) as stopped:
        compute(m, progress=stop)
    partial = stopped.value.partial
    assert partial.attrs["incomplete"] == "interrupted after 7 of 11 ages"
    assert partial.sizes["age"] == 7
    with pytest.raises(KeyboardInterrupt):
        compute(m, progress=at_once)


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def bush(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    BUSH.with_({"limits.position": 0.1}).write(tmp_path / "bush.toml")


@pytest.mark.usefixtures("bush")
def test_the_command_says_the_life_first(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["life", "bush.toml", "--cycles", "0:40000:3", "--plot", "life.png"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    # 0.08 mm at 1.5708 nm a turn.
    assert "The limits hold in the worst case for 50,900 cycles (25,400 to 101,000 with wear rates twice or half" in out
    assert "A cycle is once along the path, which ends where it began." in out
    assert "growth in" in out
    assert run(["life", "bush.toml", "--cycles", "100000"]) == 1
    assert run(["life", "bush.toml", "--cycle", "closed", "-q", "loaded", "-o", "life.nc"]) == 0
    assert run(["life", "bush.toml", "-s", "joints.J.wear.rate=0"]) == 0
    assert run(["life", "bush.toml", "--cycles", "a"]) == 2


@pytest.mark.usefixtures("bush")
@pytest.mark.parametrize("panel", ["used", "position", "rotation", "clearance"])
def test_every_panel_can_be_drawn(panel: str) -> None:
    assert run(["life", "bush.toml", "--plot", f"{panel}.png", "--panel", panel]) == 0


def test_figures_refuse_what_is_not_there() -> None:
    result = jp.life(BUSH)
    assert jp.plot.life(result).axes
    with pytest.raises(jp.InputError, match="'used' is not a quantity"):
        jp.plot.life(result, "used")
    with pytest.raises(jp.InputError, match="is not the result of life"):
        jp.plot.life(jp.worst(BUSH))


def test_load_cases_act_in_as_many_cycles_each() -> None:
    """Each of them presses the bush in half of the cycles; one can be asked for alone."""
    cases = {
        "loads": None,
        "load_cases": {"light": [{"at": [0, 0], "force": [0, -100]}], "heavy": [{"at": [0, 0], "force": [300, 0]}]},
    }
    m = BUSH.with_(cases)
    one = jp.life(BUSH).growth.item()
    both = jp.life(m, "loaded")
    assert both.growth.item() == pytest.approx(2 * one, rel=1e-12)
    assert both.pressure.item() == pytest.approx(300 / 600, rel=1e-12)
    assert both.attrs["load_cases"] == "light, heavy"
    assert jp.life(m.only(load_case="heavy")).growth.item() == pytest.approx(3 * one, rel=1e-12)


@pytest.mark.parametrize(("angle", "share"), [(0, 1.0), (90, math.sqrt(0.5)), (180, 0.5)])
def test_load_cases_wear_a_pin_where_each_of_them_presses(angle: float, share: float) -> None:
    """Two shifts of half the size, of which the sum is largest between them."""
    wear = {"rate_hole": 0.0, "rate_pin": 1e-4, "length": 20}
    turned = [-100 * math.cos(math.radians(angle)), -100 * math.sin(math.radians(angle))]
    forces = {"one": [-100, 0], "other": turned}
    cases = {name: [{"at": [0, 0], "force": force}] for name, force in forces.items()}
    both = grows(BUSH.with_({"joints.J.wear": wear, "loads": None, "load_cases": cases}))
    assert both.growth.item() == pytest.approx(share * math.pi * 1e-4 * 1e-3 * 100 / 20, rel=1e-9)


def test_a_clearance_of_nothing_wears_as_well() -> None:
    result = jp.life(BUSH.with_({"joints.J.clearance.radial": 0.0, "limits.position": 0.01}))
    assert result.life.item() == pytest.approx(0.01 / (math.pi * 1e-4 * 1e-3 * 100 / 20), rel=2e-4)


def test_clearances_that_stay_as_they_are_are_named() -> None:
    m = CRANK.with_(worn({"pin": {"growth": 1e-7}}))
    assert jp.life(m).attrs["without_wear"] == "shaft, wrist, guide"
    assert any(note.startswith("Without wear, as they are: shaft, wrist") for note in tables(compute(m))[0].notes)


def test_a_mechanism_that_cannot_be_assembled_has_no_life() -> None:
    """Two pins too far apart for the play that they have: rigid, so that nothing is known of forces."""
    status, first, good = said(SLOTS.with_({"joints.B.on.block": [0, 0.5]}), "loaded")
    assert (status, good) == ("no_pose", False)
    assert first.endswith("configurations 0, 1, 2, 3, 4 are not assemblable.")


def test_errors_are_at_their_configurations_where_the_machine_cannot_be_at_some() -> None:
    drives = {"drives.q": {"joint": "J", "values": [0, 30, 60, 90]}, "limits.joints.J": [20, 90]}
    m = BUSH.with_({**drives, "joints.J.wear": {"growth": 1e-6}, "limits.position": 0.1})
    result = jp.life(m)
    assert result.status.item() == "ok"
    assert np.isnan(result.position.values[:, 0]).all()
    assert result.position.values[0, 1:] == pytest.approx([0.02] * 3, rel=1e-6)
