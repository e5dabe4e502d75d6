"""Units: every number is converted once on its way in and once on its way out, and nothing is lost."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointplay import examples
from jointplay.basics.units import ANGLES, FORCES, LENGTHS, AngleUnit, ForceUnit, LengthUnit, Units
from jointplay.model.mechanism import Mechanism, loads

LENGTH_NAMES, ANGLE_NAMES, FORCE_NAMES = get_args(LengthUnit), get_args(AngleUnit), get_args(ForceUnit)


def test_every_unit_of_the_file_has_a_size() -> None:
    assert set(LENGTHS) == set(LENGTH_NAMES)
    assert set(ANGLES) == set(ANGLE_NAMES)
    assert set(FORCES) == set(FORCE_NAMES)


@pytest.mark.parametrize(
    ("amount", "unit", "table", "si"),
    [
        (25.4, "mm", LENGTHS, 0.0254),
        (1, "in", LENGTHS, 0.0254),
        (2.54, "cm", LENGTHS, 0.0254),
        (25400, "um", LENGTHS, 0.0254),
        (0.0254, "m", LENGTHS, 0.0254),
        (180, "deg", ANGLES, math.pi),
        (math.pi, "rad", ANGLES, math.pi),
        (1000, "lbf", FORCES, 4448.2216152605),
        (4.4482216152605, "kN", FORCES, 4448.2216152605),
        (4448.2216152605, "N", FORCES, 4448.2216152605),
    ],
)
def test_sizes(amount: float, unit: str, table: dict[str, float], si: float) -> None:
    assert amount * table[unit] == pytest.approx(si, rel=1e-15)


def test_a_moment_is_a_force_times_a_length() -> None:
    units = Units("in", "deg", "lbf")
    assert units.moment == pytest.approx(0.1129848290276167)
    assert units.moment_name == "lbf in"


@given(
    st.floats(-1e12, 1e12),
    st.sampled_from(LENGTH_NAMES),
    st.sampled_from(ANGLE_NAMES),
    st.sampled_from(FORCE_NAMES),
)
def test_there_and_back(value: float, length: LengthUnit, angle: AngleUnit, force: ForceUnit) -> None:
    units = Units(length, angle, force)
    for factor in (units.length, units.angle, units.force, units.moment):
        assert value * factor / factor == pytest.approx(value, rel=1e-15, abs=1e-300)


FULL = """
format = 1
units = {{ length = "{length}", angle = "{angle}", force = "{force}" }}
gravity = [0, -9.81]
[joints.A]
type = "revolute"
on = {{ ground = [{a}, 0], crank = [0, 0] }}
clearance = {{ radial = {r} }}
[joints.P]
type = "prismatic"
on = {{ crank = {{ at = [{a}, 0], axis = {turn} }}, slide = [0, {a}] }}
clearance = {{ gap = {r}, length = {a} }}
[start]
crank = {{ angle = {turn} }}
[drives.q]
joint = "A"
values = [{turn}]
error = {turn}
[drives.s]
joint = "P"
values = [{a}]
error = {r}
[output]
body = "slide"
at = [{a}, {a}]
[[loads]]
force = [{f}, -{f}]
moment = {m}
[bodies.slide]
mass = 2.0
centre = [{r}, 0]
[dimensions.d]
body = "crank"
between = ["A", "P"]
tolerance = {r}
deviation = {r}
[limits]
position = {r}
rotation = {turn}
drives = {{ q = [0, {turn}], s = [0, {a}] }}
joints = {{ A = [0, {turn}] }}
"""


def same_machine(length: LengthUnit, angle: AngleUnit, force: ForceUnit) -> Mechanism:
    """One machine, told in any units."""
    per_length, per_angle, per_force = 1 / LENGTHS[length], 1 / ANGLES[angle], 1 / FORCES[force]
    numbers = {"a": 0.2 * per_length, "r": 1e-4 * per_length, "turn": 0.3 * per_angle, "f": 5 * per_force}
    text = FULL.format(length=length, angle=angle, force=force, m=0.7 * per_force * per_length, **numbers)
    return loads(text)


def flat(node: object) -> list[object]:
    if isinstance(node, dict):
        return [x for key, value in sorted(node.items()) for x in (key, *flat(value))]
    if isinstance(node, list):
        return [x for value in node for x in flat(value)]
    return [pytest.approx(node, rel=1e-12, abs=1e-15) if isinstance(node, float) else node]


@pytest.mark.parametrize("force", FORCE_NAMES)
@pytest.mark.parametrize("angle", ANGLE_NAMES)
@pytest.mark.parametrize("length", LENGTH_NAMES)
def test_a_machine_is_the_same_in_any_units(length: LengthUnit, angle: AngleUnit, force: ForceUnit) -> None:
    one, other = same_machine("m", "rad", "N"), same_machine(length, angle, force)
    assert flat(one.spec()) == flat(other.spec())
    np.testing.assert_allclose(one.drive_values, other.drive_values, rtol=1e-12)
    np.testing.assert_allclose(one.centre, other.centre, rtol=1e-12)
    assert flat(one.limits.bounds(one.quantities).tolist()) == flat(other.limits.bounds(other.quantities).tolist())
    for name in ("drives", "joints"):
        a, b = getattr(one.limits, name), getattr(other.limits, name)
        assert {k: pytest.approx(v) for k, v in a.items()} == dict(b)


def test_factors_take_parameters_back_to_the_file() -> None:
    m = same_machine("in", "deg", "lbf")
    factors = dict(zip(m.parameters, m.parameter_factors, strict=True))
    assert factors == {
        **dict.fromkeys(("A.x", "A.y", "P.normal", "d.length", "s.value"), 0.0254),
        **dict.fromkeys(("P.angle", "q.value"), math.pi / 180),
    }
    np.testing.assert_allclose(m.component_factors, [0.0254, 0.0254, math.pi / 180])
    np.testing.assert_allclose(m.drive_factors, [math.pi / 180, 0.0254])
    assert m.centre[list(m.parameters).index("d.length")] / factors["d.length"] == pytest.approx(1e-4 / 0.0254)


def test_an_example_rewritten_in_metres_and_radians_moves_alike() -> None:
    m = loads(examples.text("slider-crank"))
    assert m.drive_values is not None
    base = m.core.trace(m.drive_values)["output"]
    rewritten = loads(_in_metres(m))
    assert rewritten.drive_values is not None
    np.testing.assert_allclose(rewritten.core.trace(rewritten.drive_values)["output"], base, atol=1e-12)


def _in_metres(m: Mechanism) -> str:
    """The slider-crank by hand in metres and radians (the nominal part)."""
    assert m.drive_values is not None
    return f"""
format = 1
units = {{ length = "m", angle = "rad", force = "N" }}
[joints]
main = {{ type = "revolute", on = {{ ground = [0, 0], crank = [0, 0] }} }}
crankpin = {{ type = "revolute", on = {{ crank = [0.05, 0], rod = [0, 0] }} }}
wristpin = {{ type = "revolute", on = {{ rod = [0.16, 0], slider = [0, 0] }} }}
guide = {{ type = "prismatic", on = {{ ground = {{ at = [0, 0], axis = 0 }}, slider = [0, 0] }} }}
[start]
crank = {{ angle = 0.26 }}
rod = {{ angle = -0.09 }}
[drives]
theta = {{ joint = "main", values = {m.drive_values[:, 0].tolist()} }}
[output]
body = "slider"
at = [0.025, 0.008]
"""
