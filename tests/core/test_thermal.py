"""Thermal growth, against hand calculation and against mechanisms drawn with the warm lengths."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointplay as jp
from helpers.answers import OVER_CONSTRAINED, example, refusal
from helpers.builders import planar
from helpers.oracles import brute
from helpers.oracles.forces import grown
from helpers.oracles.reading import read
from helpers.strategies import given_offsets, mechanisms, searching, turn

SEARCH = searching(10)


@SEARCH
@given(mechanisms(), st.integers(0, 10_000))
def test_a_warm_mechanism_is_the_one_with_the_warm_lengths(text: str, seed: int) -> None:
    """Random coefficients for every body and the ground: `given` is the closure of the mechanism drawn warm."""
    link, rng = read(text), np.random.default_rng(seed)
    bodies = ["ground", *link.bodies]
    expansion = dict(zip(bodies, rng.uniform(-2e-5, 3e-5, len(bodies)).tolist(), strict=True))
    difference = float(rng.uniform(-100, 100))
    m = jp.loads(text).with_({"temperature": difference} | {f"bodies.{b}.expansion": e for b, e in expansion.items()})
    u = brute.draw(link, rng, 1, False)[0]
    offsets = dict(zip(link.labels, u.tolist(), strict=True))
    result = jp.given(m, given_offsets(link, offsets))
    warm = grown(link, difference, expansion)
    for k, q in enumerate(link.follow()):
        poses, good = warm.solve(q, link.configurations[k], u)
        assert good.all()
        expected = warm.out(poses, u) - link.out(q, dict.fromkeys(link.labels, 0.0))
        np.testing.assert_allclose(result.error[k, :2], expected[:2], rtol=0, atol=1e-10 * link.length)
        assert abs(turn(result.error[k, 2], np.rad2deg(expected[2]))) < 1e-8


def test_when_everything_grows_alike_the_figure_grows() -> None:
    """Angles stay, and every place is as much farther from the ground's origin."""
    for name in ("four-bar", "six-bar", "stewart-gough", "rssr"):
        m = example(name, temperature=100, expansion=1e-5)
        linear = [k for k, joint in enumerate(m.drive_joints) if m.joint_kinds[joint] not in ("revolute", "universal")]
        if linear:
            continue  # a commanded length does not grow
        perfect = m.with_({"joints.*.clearance": None} if name == "four-bar" else {})
        found = jp.given(perfect)
        lengths = [c for c in found.component.values if c in ("x", "y", "z")]
        grown = 1e-3 * found.nominal.sel(component=lengths)
        np.testing.assert_allclose(found.error.sel(component=lengths), grown, rtol=0, atol=1e-9)
        turns = [c for c in found.component.values if c not in lengths]
        np.testing.assert_allclose(found.error.sel(component=turns), 0, atol=1e-9)


def test_a_slider_crank_by_hand() -> None:
    """x = r cos q + sqrt(l^2 - r^2 sin^2 q), with the crank of steel and the rod of aluminium, 60 K warmer."""
    b = planar(temperature=60, expansion=12e-6)
    b.revolute("A", ground=(0, 0), crank=(0, 0))
    b.revolute("B", crank=(40, 0), rod=(0, 0))
    b.revolute("C", rod=(120, 0), slider=(0, 0))
    b.prismatic("D", ground={"at": (0, 0), "axis": (1, 0)}, slider={"at": (0, 0), "axis": (1, 0)})
    b.body("rod", expansion=23.5e-6)
    b.start("slider", x=150)
    b.drive("q", joint="A", from_=10, to=170, count=5)
    b.output(body="slider", at="C")
    m = b.mechanism()
    q = np.deg2rad(np.linspace(10, 170, 5))
    x = lambda r, rod: r * np.cos(q) + np.sqrt(rod**2 - (r * np.sin(q)) ** 2)  # noqa: E731
    expected = x(40 * (1 + 12e-6 * 60), 120 * (1 + 23.5e-6 * 60)) - x(40, 120)
    np.testing.assert_allclose(jp.given(m).error.sel(component="x"), expected, rtol=0, atol=1e-11)
    # Everything that the temperature does is its contribution.
    worst = jp.worst(m.with_({"temperature": {"deviation": 60, "tolerance": 15}}))
    ends = [x(40 * (1 + 12e-6 * t), 120 * (1 + 23.5e-6 * t)) - x(40, 120) for t in (45, 75)]
    sides = worst.worst_component.sel(component="x")
    np.testing.assert_allclose(sides, np.sort(np.array(ends), axis=0).T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        worst.worst_offset.sel(parameter="temperature.difference", extreme="position"), 75, rtol=1e-12
    )
    assert worst.source.values.tolist() == ["temperature"]
    assert worst.source_kind.values.tolist() == ["thermal"]


def test_the_tolerance_of_the_temperature_scatters_all_lengths_together() -> None:
    """One standard deviation of 5 K moves the figure as one: not the root of a sum over lengths."""
    m = example("four-bar", temperature={"deviation": 40, "tolerance": 15}, expansion=12e-6)
    m = m.with_({"joints.*.clearance.radial": 0.0, "dimensions": None})
    drawn = jp.random(m, samples=200_000)
    place = drawn.nominal.sel(component=["x", "y"])
    std = np.sqrt(np.diagonal(drawn.error_covariance, axis1=1, axis2=2))[:, :2]
    np.testing.assert_allclose(std, np.abs(place) * 12e-6 * 5, rtol=0.02)
    mean = drawn.error_mean.sel(component=["x", "y"])
    np.testing.assert_allclose(mean, place * 12e-6 * 40, rtol=0.005, atol=1e-5)
    parts = drawn.contribution.sum("source") - drawn.error_std_first_order**2
    np.testing.assert_allclose(parts, 0, atol=1e-12)


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "serial-6r"])
def test_lanes_are_as_warm_as_the_plain_solver(name: str) -> None:
    m = example(name, temperature=50, expansion=15e-6).with_({"bodies.ground.expansion": 0})
    few = jp.loaded(m)
    last = {drive: few[drive].values[-1:] for drive in m.drives}
    values = {f"drives.{drive}.values": np.repeat(last[drive], 80) for drive in m.drives}
    many = m.with_({"grid": None, "path": None} | values)
    np.testing.assert_allclose(jp.loaded(many).error[-1], few.error[-1], rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("question", ["given", "loaded", "worst", "random", "compensate"])
@pytest.mark.parametrize("name", ["four-bar", "stewart-gough", "bennett", "antenna-support", "redundant-bar"])
def test_every_question_knows_the_temperature(name: str, question: str) -> None:
    """The figures are those of the cold mechanism when nothing expands; otherwise the temperature contributes."""
    cold = example(name)
    still, warm = (cold.with_({"temperature": 20, "expansion": e}) for e in (0.0, 10e-6))
    if question == "compensate" and not cold.drives:
        pytest.skip("nothing to correct")
    ask: Any = {"random": lambda m: jp.random(m, samples=300)}.get(question, getattr(jp, question))
    variable = {"worst": "worst_component", "random": "error_mean"}.get(question, "error")
    reference, same, other = (ask(m) for m in (cold, still, warm))
    tolerance = 1e-9 if name not in OVER_CONSTRAINED else 1e-6
    size = float(np.nanmax(np.abs(reference[variable]))) or 1.0
    if question != "random":  # a further source draws other numbers
        np.testing.assert_allclose(same[variable], reference[variable], rtol=0, atol=tolerance * size + 1e-9)
    assert float(np.nanmax(np.abs(other[variable] - reference[variable]))) > 1e-6
    assert other.status.values.tolist() == reference.status.values.tolist() or name in OVER_CONSTRAINED


def test_a_bar_between_fixed_pins_is_pressed_as_it_grows() -> None:
    """A bar of 200 mm between pins of a cold frame: its growth less the play of both pins, times its stiffness."""
    bar = example("redundant-bar", dimensions=None, loads=[{"force": [0, -1e-3]}])
    bar = bar.with_({"temperature": 100, "bodies.bar.expansion": 2e-5})
    found = jp.loaded(bar)
    np.testing.assert_allclose(found.member_force.values.ravel(), -20000 * (200 * 2e-5 * 100 - 0.2), rtol=1e-3)
    assert found.status.item() == "strained"


def test_a_clearance_grows_with_its_hole() -> None:
    """A bronze bushing on a steel pin of 20 mm, 50 K warmer: radius + (18e-6 - 12e-6) x 50 x 10."""
    m = example("four-bar", temperature=50, expansion=12e-6)
    m = m.with_({"joints.J2.clearance": {"radial": 0.05, "diameter": 20}, "bodies.coupler.expansion": 18e-6})
    grown = 0.05 + 6e-6 * 50 * 10
    assert jp.check(m).size.sel(source="J2").item() == pytest.approx(grown, rel=1e-12)
    # The pin is on the first body: with the materials exchanged the play becomes smaller.
    other = m.with_({"bodies.coupler.expansion": None, "bodies.crank.expansion": 18e-6})
    assert jp.check(other).size.sel(source="J2").item() == pytest.approx(0.05 - 6e-6 * 50 * 10, rel=1e-12)
    drawn = m.with_({"joints.J2.clearance": {"radial": grown}})
    np.testing.assert_allclose(jp.worst(m).worst_position, jp.worst(drawn).worst_position, rtol=1e-12)


def test_a_warm_assembly_is_the_warm_mechanism() -> None:
    steps = {"base": "ground", "steps": [["crank"], ["coupler", "rocker"]]}
    m = example("four-bar", assembly=steps, temperature=80, expansion=2e-5, drives__theta1__values=[40])
    np.testing.assert_allclose(jp.assemble(m).error[-1], jp.loaded(m).error[0], rtol=0, atol=1e-9)
    # On another base the same lengths have grown: the distance from its shaft to the others is what the body says.
    away = m.with_({"assembly.base": "crank", "assembly.steps": [["ground"], ["coupler", "rocker"]], "loads": []})
    first = jp.assemble(away.with_({"joints.*.clearance.radial": 0.0}))
    crank = first.error_shaft.sel(joint="J2")[0, :2]
    along = np.deg2rad(40)
    np.testing.assert_allclose(crank, 75 * 2e-5 * 80 * np.array([np.cos(along), np.sin(along)]), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("temperature = 40", "temperature: no body expands: expansion = 12e-6 (1/K) for all of them"),
        (
            'temperature = "warm"\nexpansion = 1e-5',
            "temperature: a table such as 40, or { deviation = 40, tolerance = 15 }",
        ),
        ("temperature = 1e4\nexpansion = 1e-5", "temperature: is off by up to 1e+04 K, more than 5000 K"),
        ("temperature = 40\nexpansion = 12", "expansion: must be at most 0.01: 12"),
        (
            "temperature = { tolerence = 4 }\nexpansion = 1e-5",
            "temperature: 'tolerence' is not a key here; did you mean",
        ),
        ("temprature = 40", "'temprature' is not a key here; did you mean 'temperature'?"),
        ("bodies.ground.mass = 3", "bodies.ground: 'ground' is fixed; it has no key but expansion"),
        (
            "temperature = -100\nbodies.arm.expansion = 1e-3",
            "joints.J.clearance: at -100 K the pin has become larger than its hole: radial clearance -0.98 mm",
        ),
        (
            "temperature = { deviation = 1, tolerance = 5 }\nbodies.arm.expansion = 1e-5",
            "joints.J.clearance: the clearance changes with a temperature that has a tolerance",
        ),
    ],
)
def test_what_is_said_of_a_temperature_that_does_not_do(text: str, told: str) -> None:
    said = refusal(
        f"""
        format = 1
        {text.replace(chr(10), chr(10) + "        ")}
        units = {{ length = "mm", angle = "deg", force = "N" }}
        [joints.J]
        type = "revolute"
        on = {{ ground = [0, 0], arm = [0, 0] }}
        clearance = {{ radial = 0.02, diameter = 20 }}
        [drives.q]
        joint = "J"
        values = [10]
        [output]
        body = "arm"
        at = [50, 0]
        """
    )
    assert said.startswith(f"file.toml: {told}"), said


def test_wheels_on_bodies_that_grow_are_refused() -> None:
    said = refusal("temperature = 10\nexpansion = 1e-5\n" + jp.examples.text("geared-five-bar"))
    assert "the thermal growth of wheels and threads is not computed" in said


def test_temperature_is_swept() -> None:
    m = example("four-bar", temperature=0, expansion=12e-6)
    swept = jp.sweep(m, "temperature", [0, 20, 40], "given")
    assert swept.temperature.attrs["units"] == "K"
    place = swept.nominal.sel(component=["x", "y"])
    expected = place * 12e-6 * swept.temperature
    np.testing.assert_allclose(swept.error.sel(component=["x", "y"]), expected.transpose(*place.dims), atol=1e-9)
