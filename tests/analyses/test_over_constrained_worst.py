"""The worst case of over-constrained mechanisms against programs on all bodies, and against poses that are met."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.dead_centre import at_dead_centre, moved_from_dead_centre
from helpers.oracles.cones import Linearised
from helpers.platforms import mechanism as platform_mechanism
from helpers.platforms import platform, primal
from helpers.trusses import RADIAL, mechanism, random_square
from jointplay.analyses.nominal import nominal


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("sliders", [0, 3])
def test_first_order_extremes_are_those_of_a_program_on_all_bodies(seed: int, sliders: int) -> None:
    text, _ = platform(seed, sliders=sliders)
    program = primal(text, {})
    found = jp.worst(platform_mechanism(text, {}))
    if found.status[0].item() == "not_assemblable":
        assert not program.solve().solved
        return
    for k, component in enumerate(("x", "y", "angle")):
        wanted = program.extremes(k)
        got = found.worst_component_first_order.sel(component=component).values[0]
        np.testing.assert_allclose(got, wanted, atol=1e-6 * np.abs(wanted).max())
    fan = [
        float(np.hypot(*program.solve(math.cos(a) * program.output[0] + math.sin(a) * program.output[1]).error[:2]))
        for a in np.linspace(0, math.tau, 90)
    ]
    largest, bound = found.worst_position_first_order[0].item(), found.worst_position_first_order_bound[0].item()
    assert max(fan) * (1 - 1e-6) <= largest <= bound <= 1.001 * largest


@pytest.mark.parametrize("seed", range(3))
def test_certificates_are_admissible_and_give_the_extremes(seed: int) -> None:
    base = random_square(seed)
    radial = {node: 2.0 * base.factor() * r for node, r in RADIAL.items()}
    m = mechanism(random_square(seed, radial=radial))
    worst = jp.worst(m)
    assert worst.status[0].item() == "ok"
    for extreme, value in (("position", worst.worst_position), ("x low", None), ("angle high", None)):
        given = jp.given(m, worst.worst_offset.sel(extreme=extreme, drop=True))
        assert given.status[0].item() == "ok"
        assert given.admissible.values.all()
        error = given.error.values[0]
        if value is not None:
            assert np.hypot(*error[:2]) == pytest.approx(value[0].item(), rel=1e-9)
        else:
            component, side = extreme.split()
            wanted = worst.worst_component.sel(component=component, side=side)[0].item()
            assert given.error.sel(component=component)[0].item() == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_no_load_pushes_it_beyond_the_worst(seed: int) -> None:
    base = random_square(seed)
    radial = {node: 2.0 * base.factor() * r for node, r in RADIAL.items()}
    text = random_square(seed, radial=radial)
    worst = jp.worst(mechanism(text))
    largest = 0.0
    for angle in np.linspace(0, math.tau, 36, endpoint=False):
        load = (100 * math.cos(angle), 100 * math.sin(angle))
        pushed = jp.loaded(mechanism(random_square(seed, radial=radial, load=load)))
        error = pushed.error.values[0]
        low, high = worst.worst_component.values[0].T
        slack = 1e-9 + 1e-9 * np.abs(error)
        assert (low - slack <= error).all()
        assert (error <= high + slack).all()
        largest = max(largest, float(np.hypot(*error[:2])))
    # Among that many loads one is nearly the worst.
    assert 0.98 * worst.worst_position[0].item() <= largest <= worst.worst_position[0].item() * (1 + 1e-9)


def test_tolerances_count_as_far_as_members_go_together() -> None:
    """A diagonal with a tolerance wider than the play: only units that go together are counted."""
    radial = dict.fromkeys("ABCD", 0.01)
    truss = random_square(0, radial=radial, deviation={"AC": 0.0})
    m = mechanism(truss).with_({"dimensions.long_AC.tolerance": 1.0})
    worst = jp.worst(m)
    (stress,) = truss.self_stresses()
    share = abs(stress[truss.names.index("AC")])
    longest = float(np.abs(stress) @ truss.loose()) / share
    offsets = worst.worst_offset.sel(parameter="long_AC.length").values
    assert np.abs(offsets).max() <= longest * 1.01
    assert longest < 0.1


def test_a_sarrus_linkage_in_space() -> None:
    m = example("sarrus").with_({"drives.q.values": [10.0], **{f"drives.q.{k}": None for k in ("from", "to", "count")}})
    at = nominal(m)
    found = m.core.worst(at.drives, at.poses, 6)
    closure = Linearised(m.spec(), at.poses[0])
    for k, weights in enumerate(closure.output()):
        wanted = closure.maximise(weights).work
        np.testing.assert_allclose(found["component_first_order"][0, k], [-wanted, wanted], rtol=1e-7)
    np.testing.assert_allclose(found["component"], found["component_first_order"], rtol=0.02)
    assert found["position"][0] == pytest.approx(found["position_first_order"][0], rel=0.01)
    assert found["position_first_order"][0] <= found["position_bound"][0] <= 1.05 * found["position_first_order"][0]
    assert found["rotation_first_order"][0] <= found["rotation_bound"][0] <= 1.05 * found["rotation_first_order"][0]


PIN = 'type = "revolute", clearance.radial = 0.02'


def cranks(count: int) -> jp.Mechanism:
    """Parallel cranks of 100 mm at a right angle, whose coupler is moved up by the square of the drive's error only."""
    text = """
        format = 1
        units = { length = "mm", angle = "deg", force = "N" }
        drives.q = { joint = "A0", values = [90], error = 5 }
        output = { body = "p", at = [60, 0] }
    """
    for k in range(count):
        text += f"""
            start.c{k}.angle = 90
            joints.A{k} = {{ {PIN}, on = {{ ground = [{60 * k}, 0], c{k} = [0, 0] }} }}
            joints.B{k} = {{ {PIN}, on = {{ c{k} = [100, 0], p = [{60 * k}, 0] }} }}
        """
    return jp.loads(text)


def test_what_moves_the_output_by_the_square_only_counts() -> None:
    fall = 100.0 * (1.0 - math.cos(math.radians(5.0)))
    two, three = (jp.worst(cranks(count)).worst_component.sel(component="y").values[0] for count in (2, 3))
    # All pins of a crank let the coupler down together.
    assert three[0] <= -(fall + 0.04) * (1.0 - 1e-9)
    assert three[0] >= two[0] - 1e-9


@pytest.mark.parametrize("angle", [0, 180])
@pytest.mark.parametrize("guides", [1, 2])
def test_a_slider_at_its_dead_centre_goes_by_the_square_however_many_guides_it_has(guides: int, angle: float) -> None:
    """The drive moves no component to first order, and nothing else moves the slider at all."""
    found = jp.worst(at_dead_centre(guides, angle))
    moved = float(moved_from_dead_centre(angle, 5.0))
    ends = found.worst_component.sel(component="x").values[0]
    assert sorted(ends) == pytest.approx(sorted([0.0, moved]), abs=1e-9)
    assert found.worst_position.item() == pytest.approx(abs(moved), rel=1e-9)


@pytest.mark.parametrize("guides", [1, 2])
def test_a_position_is_at_least_as_far_off_as_each_of_its_components(guides: int) -> None:
    """To first order the clearance of the pin decides; the drive goes farther, by its square."""
    play = {f"joints.G{k}.clearance": {"gap": 0.02, "length": 50} for k in range(guides)}
    changes = {"joints.B.clearance": {"radial": 0.02}, "drives.q.error": 1, "output.at": [0, 40]}
    found = jp.worst(at_dead_centre(guides, 0.0).with_(changes | play))
    ends = np.abs(found.worst_component.sel(component=["x", "y"]).values).max()
    assert ends > 1.1 * found.worst_position_first_order.item()
    assert found.worst_position.item() >= ends * (1.0 - 1e-9)


def test_a_turn_about_two_pins_has_their_tilt_as_well() -> None:
    """A turn and a tilt about an axis across it: the cosine of half of the whole is the product of both."""
    place = "{{ at = {0}, axis = [0, 0, 1] }}"
    pin = f'type = "revolute", on = {{{{ ground = {place}, arm = {place} }}}}'
    found = jp.worst(
        jp.loads(f"""
        format = 1
        space = "spatial"
        units = {{ length = "mm", angle = "deg" }}
        joints.P0 = {{ {pin.format([0, 0, 0])}, clearance = {{ radial = 0.05, axial = 0.05, length = 20 }} }}
        joints.P1 = {{ {pin.format([0, 0, 40])}, clearance = {{ radial = 0.05, axial = 0, length = 20 }} }}
        drives.q = {{ joint = "P0", values = [0], error = 1 }}
        output = {{ body = "arm", at = [50, 0, 20] }}
        """)
    )
    tilt = math.atan(0.05 / 30)
    whole = 2.0 * math.acos(math.cos(math.radians(0.5)) * math.cos(0.5 * tilt))
    assert found.worst_rotation.item() >= math.degrees(whole) * (1.0 - 1e-6)


@pytest.mark.parametrize("elastic", ["joints.A.stiffness", "drives.q.stiffness"])
def test_what_is_elastic_and_determinate_reaches_as_far_as_what_is_rigid(elastic: str) -> None:
    arm = jp.loads("""
        format = 1
        units = { length = "mm", angle = "deg", force = "N" }
        joints.A = { type = "revolute", on = { ground = [0, 0], arm = [0, 0] }, clearance = { radial = 0.01 } }
        drives.q = { joint = "A", values = [0], error = 5 }
        output = { body = "arm", at = [100, 0] }
    """)
    soft = arm.with_({elastic: {"radial": 1e4} if "joints" in elastic else 1e6})
    lowest = jp.worst(soft).worst_component.sel(component="x").values[0, 0]
    assert lowest == pytest.approx(-100.0 * (1.0 - math.cos(math.radians(5.0))) - 0.01, abs=1e-9)
