"""Lost motion and wind-up of drives, against closed forms, gears, and least energy computed here."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize, minimize_scalar

import jointplay as jp
from helpers.arms import leg
from helpers.builders import planar, spatial
from helpers.oracles.primal import Primal
from helpers.oracles.reading import read
from jointplay.analyses.friction import REST, SIDES
from jointplay.cli import run
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables

#: the hip is pushed back and the knee forth by the weights
LEG = leg(-45, -90)
HIP, KNEE = math.radians(-45.0), math.radians(-90.0)
G = 9.81


def link(value: float = 0.0, force: Any = (0, -20), angle: str = "deg", **drive: Any) -> jp.Mechanism:
    b = planar(angle=angle)
    b.revolute("pivot", ground=(0, 0), arm=(0, 0))
    b.drive("q", joint="pivot", values=[value], **drive)
    b.output(body="arm", at=(200, 0))
    b.load(force=force)
    return b.mechanism()


def foot(hip: float, knee: float) -> np.ndarray:
    """Place and angle (degrees) of the calf's end."""
    place = 213.0 * np.exp(1j * hip) + 213.0 * np.exp(1j * (hip + knee))
    return np.array([place.real, place.imag, np.rad2deg(hip + knee)])


def moments(hip: float, knee: float) -> np.ndarray:
    """What the weights do about both joints, N mm."""
    calf = -0.2 * G * 100.0 * math.cos(hip + knee)
    return np.array([calf - 0.5 * G * 100.0 * math.cos(hip) - 0.2 * G * 213.0 * math.cos(hip), calf])


def error_at(offsets: np.ndarray) -> np.ndarray:
    return foot(HIP + offsets[0], KNEE + offsets[1]) - foot(HIP, KNEE)


def guide(**drive: Any) -> jp.Mechanism:
    """A ram in an inclined guide, which a force draws aside."""
    b = planar()
    b.prismatic("guide", ground={"at": [0, 0], "axis": 30}, ram=(0, 0))
    b.drive("s", joint="guide", values=[100], **drive)
    b.output(body="ram", at=(0, 0))
    b.load(force=(100, 0))
    return b.mechanism()


class TestLoaded:
    def test_an_arm_falls_onto_its_flank(self) -> None:
        """Half a degree from end to middle: b times the lever, on a circle."""
        result = jp.loaded(link(backlash=1))
        b = math.radians(0.5)
        expected = [200 * (math.cos(b) - 1), -200 * math.sin(b), -0.5]
        np.testing.assert_allclose(result.error[0], expected, rtol=1e-12)
        assert result.status[0] == "ok"
        assert result.offset[0].item() == pytest.approx(-0.5, rel=1e-14)

    @pytest.mark.parametrize(("side", "force"), [("plus", 20.0), ("minus", -20.0)])
    def test_one_flank_may_be_where_it_was_homed(self, side: str, force: float) -> None:
        other = {"plus": "minus", "minus": "plus"}[side]
        for size in (0.0, 0.7):
            lost = {side: size, other: 0.2}
            turned = jp.loaded(link(backlash=lost, force=(0, force))).error[0, 2].item()
            assert turned == pytest.approx(math.copysign(size, force), abs=1e-14)

    def test_a_length_is_lost_along_a_guide(self) -> None:
        result = jp.loaded(guide(backlash=0.4, stiffness=500))
        way = 0.2 + 100 * math.cos(math.radians(30)) / 500
        expected = [way * math.cos(math.radians(30)), way * math.sin(math.radians(30)), 0]
        np.testing.assert_allclose(result.error[0], expected, rtol=1e-10, atol=1e-13)

    def test_a_leg_has_the_flanks_that_its_weights_press(self) -> None:
        hip, knee = moments(HIP, KNEE)
        assert hip < 0.0 < knee
        result = jp.loaded(LEG.mechanism())
        np.testing.assert_allclose(result.error[0], error_at(np.radians([-0.5, 1.0])), atol=1e-10)
        assert result.error[0, 1] == pytest.approx(-2.617202554, abs=1e-9)

    @pytest.mark.parametrize("lost", [0.0, 1.0])
    def test_a_leg_winds_up(self, lost: float) -> None:
        """Wind-up in series with the lost motion: moments at the settled pose, found by fixed-point steps."""
        m = LEG.mechanism().with_(
            {
                "drives.q1.backlash": lost,
                "drives.q2.backlash": 2 * lost,
                "drives.q1.stiffness": 2000.0,
                "drives.q2.stiffness": 400.0,
            }
        )
        turned = np.zeros(2)
        for _ in range(50):
            now = moments(HIP + turned[0], KNEE + turned[1])
            turned = np.radians(np.sign(now) * [lost / 2, lost] + now / [2000.0, 400.0])
        result = jp.loaded(m)
        np.testing.assert_allclose(result.error[0], error_at(turned), atol=1e-7)
        np.testing.assert_allclose(
            result.deformation[0], moments(HIP + turned[0], KNEE + turned[1]) / [2000, 400], rtol=1e-8
        )
        assert result.elastic.values.tolist() == ["q1", "q2"]
        reference = [-0.407926031, -3.509871627, 0.594911047] if lost else [-0.408065039, -0.908552527, 0.095744254]
        np.testing.assert_allclose(result.error[0], reference, atol=2e-8)

    def test_wind_up_turns_with_the_lever(self) -> None:
        """1e6 e = -4000 cos e."""
        result = jp.loaded(link(stiffness=1e6, angle="rad"))
        expected = brentq(lambda e: 1e6 * e + 4000 * math.cos(e), -0.1, 0.1, xtol=1e-15)
        assert result.error[0, 2].item() == pytest.approx(expected, rel=1e-9)

    def test_an_arm_that_no_torque_holds_is_anywhere_between_its_flanks(self) -> None:
        """The load goes through the pivot and pulls outwards or inwards; a hanging one floats in its play."""
        upright = jp.loaded(link(backlash=1, force=(-20, 0)))
        assert upright.status[0] == "undetermined"
        assert upright.undetermined[0, 2].item() == pytest.approx(0.5, rel=1e-6)
        off = 0.3
        hanging = jp.loaded(link(backlash=2, value=-90 + off))
        assert hanging.error[0, 2].item() == pytest.approx(-off, rel=1e-9)
        beyond = jp.loaded(link(backlash=0.4, value=-90 + off))
        assert beyond.error[0, 2].item() == pytest.approx(-0.2, rel=1e-12)

    def test_contributions_add_up(self) -> None:
        result = jp.loaded(LEG.mechanism())
        np.testing.assert_allclose(result.contribution[0].sum("source"), result.error_first_order[0], atol=1e-12)
        assert result.source.values.tolist() == ["q1.backlash", "q2.backlash"]
        assert result.source_kind.values.tolist() == ["backlash"] * 2


class TestDriveTorque:
    def test_the_motor_holds_what_the_weights_do(self) -> None:
        """At the flanks that they press: the weights' moments there, the other way round."""
        result = jp.loaded(LEG.mechanism())
        expected = -moments(HIP + math.radians(-0.5), KNEE + math.radians(1.0))
        np.testing.assert_allclose(result.drive_torque[0], expected, rtol=1e-9)
        np.testing.assert_allclose(result.drive_torque[0], [499.191783, -137.518398], atol=1e-6)
        assert result.drive_torque.attrs["units"] == "N mm"
        assert result.drive_flank.values.tolist() == [[-1, 1]]
        wound = LEG.mechanism().with_({"drives.q1.stiffness": 2000.0, "drives.q2.stiffness": 400.0})
        np.testing.assert_allclose(jp.loaded(wound).drive_torque[0], [496.609893, -137.286397], atol=1e-5)

    @pytest.mark.parametrize("exact", [True, False])
    def test_many_configurations_have_what_each_has_alone(self, exact: bool) -> None:
        turns = np.linspace(-80, 80, 70).tolist()
        m = LEG.mechanism().with_({"drives.q1.values": turns})
        together = jp.loaded(m, exact=exact)
        for k in (0, 33, 69):
            alone = jp.loaded(m.with_({"drives.q1.values": [turns[k]]}), exact=exact)
            np.testing.assert_allclose(together.drive_torque[k], alone.drive_torque[0], rtol=1e-10)
            np.testing.assert_array_equal(together.drive_flank[k], alone.drive_flank[0])

    def test_a_slider_is_held_by_a_force(self) -> None:
        result = jp.loaded(guide(backlash={"plus": 0, "minus": 0.4}))
        assert result.drive_torque.item() == pytest.approx(-100 * math.cos(math.radians(30)), rel=1e-12)
        assert (result.drive_torque.attrs["units"], result.drive_flank.item()) == ("N", 1)

    def test_a_motor_of_several_joints_bears_the_sum(self) -> None:
        """Weighted by its coefficients; a gearbox of the elbow at the other end is seen from the motor's side."""
        result = jp.loaded(COUPLED.mechanism().with_({"drives.motor.stiffness": None}))
        place = result.nominal[0, :2].values + result.error[0, :2].values
        elbow = 200 * np.exp(1j * math.radians(40 - 0.3))
        shoulder_moment, elbow_moment = -30 * place[0], -30 * (place[0] - elbow.real)
        expected = -(shoulder_moment - 0.5 * elbow_moment)
        assert result.drive_torque.item() == pytest.approx(expected, rel=1e-9)
        assert result.drive_flank.item() == 0

    def test_a_strained_mechanism_shares_the_load(self) -> None:
        """The drive's part is what its wind-up tells."""
        result = jp.loaded(cranks(0.0))
        wound = result.deformation.sel(elastic="q").item()
        assert result.drive_torque.item() == pytest.approx(-4e6 * wound, rel=1e-9)

    def test_where_a_self_stress_runs_through_the_drive_nothing_decides_it(self) -> None:
        """Rigid bars without play beside a drive that cannot move."""
        result = jp.loaded(loose_cranks(0).mechanism().with_({"joints.*.clearance": None}))
        assert np.isfinite(result.drive_torque).all()


def shaft(first: dict[str, Any], second: dict[str, Any], **path: Any) -> jp.Mechanism:
    """Two motors on one shaft with an arm, or on two that gears tie."""
    b = planar(angle="rad")
    b.revolute("pivot", ground=(0, 0), arm=(0, 0))
    b.drive("a", joint="pivot", **first)
    b.drive("b", joint="pivot", **second)
    if path:
        b.path(**path)
    b.output(body="arm", at=(100, 0))
    b.load(moment=3000)
    return b.mechanism()


class TestTwoDrives:
    @pytest.mark.parametrize("moment", [3000.0, -500.0, 100.0])
    @pytest.mark.parametrize("apart", [0.0, 0.004, -0.02])
    @pytest.mark.parametrize("lost", [0.0, 0.006])
    def test_share_by_their_stiffness(self, moment: float, apart: float, lost: float) -> None:
        """k_a (x - q_a) + the spring of b behind its backlash = moment, a monotone equation of one unknown."""
        ka, kb = 2e5, 5e4
        second = {"values": [0.3 + apart], "stiffness": kb, "backlash": lost}
        m = shaft({"values": [0.3], "stiffness": ka}, second).with_({"loads.0.moment": moment})
        result = jp.loaded(m)

        def of_b(x: float) -> float:
            return kb * (max(x - apart - lost / 2, 0.0) + min(x - apart + lost / 2, 0.0))

        turned = brentq(lambda x: ka * x + of_b(x) - moment, -1, 1, xtol=1e-15)
        assert result.error[0, 2].item() == pytest.approx(turned, rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(result.drive_torque[0], [-ka * turned, -of_b(turned)], atol=2e-3)
        np.testing.assert_allclose(result.deformation[0], [turned, of_b(turned) / kb], atol=1e-8)
        assert result.elastic.values.tolist() == ["a", "b"]

    def test_more_than_half_a_turn_apart_are_refused(self) -> None:
        """The second one would be taken to the nearest turn."""
        jp.loaded(shaft({"values": [0], "stiffness": 1e5}, {"values": [3.1], "stiffness": 1e5}))
        with pytest.raises(
            jp.InputError, match=r"drives\.b: .*'pivot' that are 183\.346 deg apart; at most half a turn"
        ):
            jp.loaded(shaft({"values": [0], "stiffness": 1e5}, {"values": [3.2], "stiffness": 1e5}))

    @pytest.mark.parametrize("seed", range(4))
    def test_random_ones_store_the_least_energy(self, seed: int) -> None:
        """A four-bar whose crank and rocker are both driven: energy over its one freedom."""
        rng = np.random.default_rng([11, seed])
        k = rng.uniform(1e6, 5e6, 2)
        off, fx, fy = float(rng.uniform(-2e-3, 2e-3)), *(float(v) for v in rng.uniform(-300, 300, 2))
        crank, coupler, rocker, base = (float(v) for v in (60, 140, 110, 150) * rng.uniform(0.95, 1.05, 4))

        def pose(turn: float) -> tuple[complex, float, float]:
            pin = crank * np.exp(1j * turn)
            far = base - pin
            inner = math.acos((abs(far) ** 2 + coupler**2 - rocker**2) / (2 * abs(far) * coupler))
            lean = float(np.angle(far)) + inner
            end = pin + coupler * np.exp(1j * lean)
            return pin, lean, float(np.angle(end - base))

        start = 1.1
        told = pose(start)[2] + off
        b = planar(angle="rad")
        b.revolute("A", ground=(0, 0), crank=(0, 0))
        b.revolute("B", crank=(crank, 0), coupler=(0, 0))
        b.revolute("C", coupler=(coupler, 0), rocker=(rocker, 0))
        b.revolute("D", ground=(base, 0), rocker=(0, 0))
        b.drive("a", joint="A", values=[start], stiffness=float(k[0]))
        b.drive("b", joint="D", values=[told], stiffness=float(k[1]))
        b.output(body="coupler", at=(50, 20))
        b.load(force=(fx, fy))
        b.start("coupler", angle=pose(start)[1])
        b.start("rocker", angle=pose(start)[2])
        m = b.mechanism()

        def place(turn: float) -> complex:
            pin, lean, _ = pose(turn)
            return pin + (50 + 20j) * np.exp(1j * lean)

        def energy(change: float) -> float:
            stored = 0.5 * k[0] * change**2 + 0.5 * k[1] * (pose(start + change)[2] - told) ** 2
            return stored - float((place(start + change) * (fx - 1j * fy)).real)

        best = minimize_scalar(energy, bounds=(-0.02, 0.02), method="bounded", options={"xatol": 1e-11})
        moved = place(start + best.x) - place(start)
        result = jp.loaded(m)
        # The minimum is flat: its place is known to the root of rounding.
        np.testing.assert_allclose(result.error[0, :2], [moved.real, moved.imag], atol=2e-5)
        assert jp.check(m).attrs["decided"]

    def test_a_joint_names_both(self) -> None:
        """The table of the check had the last one only."""
        checked = jp.check(shaft({"values": [0], "stiffness": 1}, {"values": [0], "stiffness": 2}))
        (driven,) = (column for column in tables(from_dataset(checked))[0].columns if column.name == "driven by")
        assert driven.cells == ("a, b",)

    def test_a_path_has_values_of_both(self) -> None:
        m = shaft({"stiffness": 2e5}, {"stiffness": 5e4}, angle=[0.2, 0.3])
        solved = jp.solve(m)
        np.testing.assert_allclose([solved.a, solved.b], [[0.2, 0.3], [0.2, 0.3]], atol=1e-12)
        turned = jp.loaded(m).error.sel(component="angle")
        np.testing.assert_allclose(turned, 3000 / 2.5e5, rtol=1e-6)
        slopes = jp.sensitivity(m).drive_jacobian.sel(component="angle")
        np.testing.assert_allclose(slopes, [[0.8, 0.2]] * 2, rtol=1e-9)

    def test_a_rigid_one_among_them_is_refused(self) -> None:
        with pytest.raises(jp.InputError, match=r"already driven by 'a'; both can .* and b has none"):
            shaft({"values": [0], "stiffness": 1}, {"values": [0]})
        both = shaft({"values": [0], "stiffness": 1}, {"values": [0], "stiffness": 2})
        with pytest.raises(jp.InputError, match="'a' and 'b' share a motion by their stiffness, which this question"):
            jp.singularities(both)
        tied = gears(0.3, 0.5).with_({"drives.second": {"joint": "C", "values": [20], "stiffness": 1e5}})
        with pytest.raises(
            jp.InputError, match="take away 1 of them; drives share a motion where each has a stiffness"
        ):
            jp.loaded(tied)


class TestOtherQuestions:
    def test_given(self) -> None:
        m = link(backlash=1)
        result = jp.given(m, {"q.backlash": 0.4})
        assert result.error[0, 2].item() == pytest.approx(0.4, rel=1e-12)
        assert result.admissible.all()
        assert not jp.given(m, {"q.backlash": 0.6}).admissible.any()
        with pytest.raises(jp.InputError, match="backlash, not a deviation"):
            jp.given(m, deviations={"q.backlash": 0.1})

    def test_worst_adds_the_error_of_the_command(self) -> None:
        m = LEG.mechanism().with_({"drives.q1.error": 0.1, "drives.q2.error": 0.2})
        worst = jp.worst(m, certify=True)
        # The distance is convex along each coordinate, nearly: all of a grid of both intervals, its corners among them.
        sides = np.radians(np.linspace(-1, 1, 41))
        reach = max(float(np.hypot(*error_at(np.array([0.6 * a, 1.2 * b]))[:2])) for a in sides for b in sides)
        assert worst.worst_position[0].item() == pytest.approx(reach, rel=1e-9)
        assert worst.worst_position[0].item() == pytest.approx(7.075417509, abs=1e-8)
        assert worst.certified.all()
        offset = worst.worst_offset.sel(extreme="position")[0]
        assert np.abs(offset.sel(parameter=["q1.backlash.value", "q2.backlash.value"])).values == pytest.approx(
            [0.5, 1.0]
        )

    @pytest.mark.parametrize(("law", "std"), [("uniform", 1 / math.sqrt(12)), ("boundary", 0.5)])
    def test_random(self, law: str, std: float) -> None:
        result = jp.random(link(backlash=1, backlash_law=law), samples=40_000, seed=3)
        assert result.error_std.sel(component="angle")[0].item() == pytest.approx(std, rel=0.01)

    def test_random_under_load(self) -> None:
        """The command scatters, the flank does not."""
        result = jp.random(link(backlash=1, error=0.1), samples=20_000, seed=3, contact="loaded")
        angle = result.error_mean.sel(component="angle")[0].item(), result.error_std.sel(component="angle")[0].item()
        assert angle == pytest.approx((-0.5, 0.1 / math.sqrt(3)), rel=0.02)

    def test_a_correction_takes_it_back(self) -> None:
        result = jp.compensate(LEG.mechanism(), question="loaded")
        np.testing.assert_allclose(result.correction[0], [0.5, -1.0], atol=1e-9)

    def test_allowed_size(self) -> None:
        """The flank is half of the width away."""
        m = link(backlash=1).with_({"limits.rotation": 0.3})
        result = jp.allow(m, question="loaded")
        assert result.source_measure.values.tolist() == ["backlash"]
        assert result.allowed[0].item() == pytest.approx(0.6, rel=1e-6)

    def test_no_clearance_is_said_to_be_needed_where_there_is_none(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        """An arm whose gearbox winds up was said to be strained, whatever the size of its clearances."""
        path = tmp_path / "arm.toml"
        path.write_text(
            LEG.text().replace("backlash = 2", "backlash = 2\nstiffness = 400") + "[limits]\nposition = 12\n"
        )
        assert run(["allow", str(path)]) == 0
        assert "strain" not in capsys.readouterr().out

    def test_allocated_size(self) -> None:
        m = link(backlash=1).with_(
            {
                "limits.rotation": 0.3,
                "costs": {"q.backlash": {"model": "reciprocal", "a": 0, "b": 1, "from": 0.1, "to": 2}},
            }
        )
        result = jp.allocate(m, question="worst")
        assert result.size.sel(source="q.backlash").item() == pytest.approx(0.6, rel=1e-4)

    def test_a_sweep(self) -> None:
        swept = jp.sweep(link(backlash=1), "drives.q.backlash", [0.0, 1.0, 2.0], "loaded")
        assert swept.backlash.attrs["units"] == "deg"
        np.testing.assert_allclose(swept.error.sel(component="angle").values.ravel(), [0, -0.5, -1], atol=1e-12)

    def test_a_map_shows_where_the_flank_changes(self) -> None:
        """The torque changes its sign where the arm is upright."""
        m = link(backlash=1).with_({"grid.q": {"from": 65, "to": 115, "count": 6}})
        result = jp.map(m, question="loaded")
        angle = np.radians(result.q.values)
        sides = -np.sign(np.cos(angle))
        np.testing.assert_allclose(result.error.sel(component="angle"), 0.5 * sides, rtol=1e-9)
        assert result.contact_change.values.ravel().tolist() == [False, False, True, False, False, False]


def gears(first: float, second: float) -> jp.Mechanism:
    """Two pairs of wheels in a row between a motor and an arm, 1:1 each, with angles of backlash."""
    b = planar()
    b.drive("motor", joint="A", values=[20])
    b.output(body="arm", at=(200, 0))
    b.load(force=(0, -20))
    for name, at, body, turned in (("A", 0, "a", 20), ("B", 100, "b", -20), ("C", 200, "arm", 20)):
        b.revolute(name, on={"ground": [at, 0], body: [0, 0]})
        b.start(body, angle=turned)
    for name, pair, lost in (("M", ("a", "b"), first), ("N", ("b", "arm"), second)):
        teeth = {"teeth": [50, 50], "module": 2, "pressure_angle": 20}
        b.gear(name, on={body: [0, 0] for body in pair}, clearance={"backlash_angle": lost}, **teeth)
    return b.mechanism()


def test_two_pairs_of_wheels_lose_the_sum() -> None:
    geared = jp.loaded(gears(0.3, 0.5))
    alone = jp.loaded(link(backlash=0.8, value=20.0))
    np.testing.assert_allclose(geared.error[0], alone.error[0], rtol=1e-6)


#: a motor moves a shoulder and, by half as much the other way, an elbow
COUPLED = planar()
COUPLED.revolute("shoulder", ground=(0, 0), upper=(0, 0))
COUPLED.revolute("elbow", upper=(200, 0), lower=(0, 0))
COUPLED.drive(
    "motor",
    joints={"shoulder": 1, "elbow": -0.5},
    values=[40],
    error=0.2,
    backlash={"shoulder": 0.6, "elbow": {"plus": 1, "minus": 0.4}},
    stiffness={"elbow": 100000.0},
)
COUPLED.output(body="lower", at=(150, 0))
COUPLED.load(force=(0, -30))


def test_every_joint_of_a_motor_has_its_own_gearbox() -> None:
    m = COUPLED.mechanism()
    assert m.sources == ("motor", "motor.backlash.shoulder", "motor.backlash.elbow")
    result = jp.loaded(m)

    def turned(elbow: float) -> tuple[float, float]:
        return math.radians(40 - 0.3), math.radians(-20 - 0.4 + elbow)

    def moment(elbow: float) -> float:
        shoulder, relative = turned(elbow)
        return -30 * 150 * math.cos(shoulder + relative)

    wound = brentq(lambda e: moment(e) / 1e5 - e, -1, 1, xtol=1e-14)
    shoulder, relative = turned(wound)
    place = 200 * np.exp(1j * shoulder) + 150 * np.exp(1j * (shoulder + relative))
    nominal = 200 * np.exp(1j * math.radians(40)) + 150 * np.exp(1j * math.radians(20))
    expected = [(place - nominal).real, (place - nominal).imag, math.degrees(shoulder + relative) - 20]
    np.testing.assert_allclose(result.error[0], expected, atol=1e-7)
    assert result.elastic.values.tolist() == ["motor.elbow"]
    by_motor = jp.given(m, {"motor": 0.2}).error[0, 2].item()
    assert by_motor == pytest.approx(0.1, rel=1e-9)


def cranks(lost: float) -> jp.Mechanism:
    """A coupler on three parallel cranks, of which the last one does not fit: its pins give, and so does the drive."""
    b = planar(angle="rad")
    b.drive("q", joint="A0", values=[1.2], backlash={"plus": lost, "minus": lost / 2}, stiffness=4e6)
    b.output(body="coupler", at=(100, 0))
    b.load(force=(60, -30))
    b.start("coupler", angle=0)
    for k in range(3):
        b.revolute(f"A{k}", on={"ground": [100 * k, 0], f"crank{k}": [0, 0]})
        b.revolute(f"B{k}", on={f"crank{k}": [80, 0], "coupler": [100 * k, 0]}, stiffness={"radial": 2e4})
    b.dimension("last", body="crank2", between=["A2", "B2"], deviation=CRANKS[2] - 80)
    return b.mechanism()


CRANKS = (80.0, 80.0, 80.05)


@pytest.mark.parametrize("lost", [0.0, 0.003])
def test_an_over_constrained_mechanism_stores_the_least_energy(lost: float) -> None:
    """Minimum over the poses of cranks and coupler; lost motion is a dead band of the drive's spring."""

    def energy(x: np.ndarray) -> float:
        turns, at, angle = x[:3], x[3] + 1j * x[4], x[5]
        ends = 100 * np.arange(3) + CRANKS * np.exp(1j * turns)
        stored = 0.5 * 2e4 * float((np.abs(ends - at - 100 * np.arange(3) * np.exp(1j * angle)) ** 2).sum())
        wound = max(turns[0] - 1.2 - lost, 0.0) - max(1.2 - lost / 2 - turns[0], 0.0)
        output = at + 100 * np.exp(1j * angle)
        return stored + 0.5 * 4e6 * wound**2 - float((output * (60 + 30j)).real)

    end = 80 * np.exp(1.2j)
    start = np.array([1.2, 1.2, 1.2, end.real, end.imag, 0.0])
    scale = np.array([1e-3, 1e-3, 1e-3, 0.1, 0.1, 1e-3])
    found = minimize(
        lambda z: energy(start + z * scale), np.zeros(6), method="BFGS", options={"gtol": 1e-9, "maxiter": 5000}
    )
    best = start + found.x * scale
    output = best[3] + 1j * best[4] + 100 * np.exp(1j * best[5])
    result = jp.loaded(cranks(lost))
    assert result.status[0] in ("ok", "strained")
    expected = [(output - end - 100).real, (output - end - 100).imag, best[5]]
    np.testing.assert_allclose(result.nominal[0] + result.error[0], [output.real, output.imag, best[5]], atol=2e-6)
    assert expected[1] != 0.0


def loose_cranks(seed: int) -> jp.Builder:
    """A coupler on three parallel cranks, all pins with play, under a random load; one crank is driven."""
    rng = np.random.default_rng([7, seed])
    length, turn = float(rng.uniform(60, 100)), float(rng.uniform(0.6, 2.5))
    low, high = (float(v) for v in rng.uniform(0.001, 0.003, 2))
    fx, fy, moment = (float(v) for v in rng.normal(0, 100, 3) * [1, 1, 20])
    end = length * np.exp(1j * turn)
    b = planar(angle="rad")
    b.drive("q", joint="A0", values=[turn], backlash={"plus": high, "minus": low})
    b.start("coupler", x=end.real, y=end.imag, angle=0.0)
    b.output(body="coupler", at=(70, 30))
    b.load(force=(fx, fy), moment=moment)
    for k in range(3):
        b.start(f"crank{k}", x=100.0 * k, angle=turn)
        ends = {"ground": [100 * k, 0], f"crank{k}": [0, 0]}
        b.revolute(f"A{k}", on=ends, clearance=jp.radial(rng.uniform(0.02, 0.06)))
        ends = {f"crank{k}": [length, 0], "coupler": [100 * k, 0]}
        b.revolute(f"B{k}", on=ends, clearance=jp.radial(rng.uniform(0.02, 0.06)))
    return b


@pytest.mark.parametrize("seed", range(6))
def test_an_over_constrained_mechanism_goes_where_the_load_does_most_work(seed: int) -> None:
    """A cone program on the displacements of all bodies, with the lost motion as bounds."""
    cranks = loose_cranks(seed)
    m, link = cranks.mechanism(), read(cranks.text())
    found = jp.loaded(m, exact=False)
    best = Primal(link, link.start, link.configurations[0], {}, 0.01).solve()
    assert best.solved
    (load,) = m.raw["loads"]
    weights = np.array([*load["force"], load["moment"]])
    assert found.error.values[0] @ weights == pytest.approx(-best.value, rel=1e-7)
    assert (np.abs(found.error.values[0] - best.error) <= found.undetermined.values[0] + [1e-6, 1e-6, 1e-8]).all()
    exact = jp.loaded(m)
    assert np.abs(exact.error - found.error).max() < 1e-2 * np.abs(found.error).max()
    worst, drawn = jp.worst(m), jp.random(m, samples=2000, seed=seed)
    assert (drawn.largest.sel(quantity="position") <= worst.worst_position).all()
    assert worst.worst_position.item() >= float(np.hypot(*exact.error.values[0, :2])) * (1 - 1e-6)


def test_many_configurations_are_what_each_is_alone() -> None:
    m = LEG.mechanism().with_(
        {"drives.q1.values": np.linspace(-80, 80, 21).tolist(), "drives.q2.values": np.linspace(-120, 100, 21).tolist()}
    )
    together = jp.loaded(m)
    for k in range(21):
        alone = jp.loaded(
            m.with_(
                {
                    f"drives.{q}.values": [float(m.drive_values[k, i] / m.drive_factors[i])]
                    for i, q in ((0, "q1"), (1, "q2"))
                }
            )
        )
        np.testing.assert_allclose(together.error[k], alone.error[0], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(together.offset[k], alone.offset[0])


class TestMessages:
    @pytest.mark.parametrize(
        ("drive", "said"),
        [
            ({"backlash": -1}, "q.backlash: must not be negative: -1"),
            ({"backlash": {"plus": 1}}, "'minus' is missing"),
            ({"backlash": {"plus": 1, "minus": -1}}, "must not be negative"),
            ({"backlash": {"pivot": 1}}, "backlash is a number (the drive moves one joint)"),
            ({"stiffness": 0}, "must be greater than zero"),
            ({"backlash_law": "uniform"}, "'backlash_law' goes with backlash"),
            ({"backlash": 800}, "more than a full turn"),
        ],
    )
    def test_of_a_drive(self, drive: dict[str, Any], said: str) -> None:
        with pytest.raises(jp.InputError) as refused:
            link(**drive)
        assert said in str(refused.value)

    def test_of_a_motor_of_several_joints(self) -> None:
        with pytest.raises(jp.InputError, match="a table by joint"):
            COUPLED.mechanism().with_({"drives.motor.backlash": 1.0})
        with pytest.raises(jp.InputError, match="not a joint that this drive moves"):
            COUPLED.mechanism().with_({"drives.motor.stiffness": {"wrist": 1.0}})

    def test_of_a_joint(self) -> None:
        with pytest.raises(jp.InputError, match=r"\[drives\.NAME\]"):
            link().with_({"joints.pivot.clearance": {"backlash": 1}})

    def test_lost_motion_that_is_counted_twice_is_said(self) -> None:
        assert "lost motion counts once" in jp.check(link(backlash=1, error=0.5)).attrs["hints"]
        assert "hints" not in jp.check(link(backlash=1, error=0.1)).attrs


#: an arm that gravity turns neither way about its upright axis, in which a pin has play
UPRIGHT = spatial(gravity=(0, 0, -9.81))
UPRIGHT.revolute(
    "J", bodies=["ground", "arm"], at=(0, 0, 0), axis=(0, 0, 1), clearance=jp.radial(0.005, axial=0.01, length=60)
)
UPRIGHT.drive("q", joint="J", values=(0, 30), backlash=0.02)
UPRIGHT.body("arm", mass=10, centre=(300, 50, 100))
UPRIGHT.output(body="arm", at=(500, 0, 0))


def test_an_arm_on_an_upright_axis_stands_as_firmly_at_every_angle() -> None:
    """The axis tilts with the arm in the play of its pin, so that no angle is lower than another."""
    result = jp.loaded(UPRIGHT.mechanism())
    assert list(result.status) == ["undetermined"] * 2
    np.testing.assert_allclose(result.undetermined.sel(component="rz"), 0.01, rtol=1e-6)
    pose = result.error.sel(component=["rx", "ry"])
    # The tilt goes with the arm: play from end to end over the length, about the moment of the weight.
    tilt = math.degrees(2 * 0.005 / 60)
    about = np.radians(np.array([0.0, 30.0])) + math.atan2(50, 300) + math.pi / 2
    np.testing.assert_allclose(pose, tilt * np.stack([np.cos(about), np.sin(about)], axis=1), atol=1e-5 * tilt)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_push_decides_the_side_of_an_upright_axis(side: float) -> None:
    result = jp.loaded(UPRIGHT.mechanism().with_({"loads": [{"force": [0, side * 5, 0]}]}))
    assert list(result.status) == ["ok"] * 2
    np.testing.assert_allclose(result.error.sel(component="rz"), side * 0.01, rtol=1e-3)


@pytest.mark.parametrize(("push", "middle", "outcome"), [(0.0, 0.0, "undetermined"), (5.0, 0.01, "ok")])
def test_specimens_of_an_arm_on_an_upright_axis_scatter_by_its_drive(push: float, middle: float, outcome: str) -> None:
    loads = [{"force": [0, push, 0]}] if push else None
    mechanism = UPRIGHT.mechanism().with_({"drives.q.error": 0.005, "loads": loads})
    found = jp.random(mechanism, contact="loaded", samples=400)
    turned = found.sel(component="rz")
    assert found.failures.sel(outcome="undetermined").values.tolist() == [400 if outcome == "undetermined" else 0] * 2
    # The drive's own error scatters evenly beside what its lost motion does.
    np.testing.assert_allclose(turned.error_mean, middle, atol=5 * 0.005 / math.sqrt(3 * 400))
    np.testing.assert_allclose(turned.error_std, 0.005 / math.sqrt(3), rtol=0.1)


def test_long_paths_of_an_arm_on_an_upright_axis_say_the_same() -> None:
    result = jp.loaded(
        UPRIGHT.mechanism().with_({"drives.q": {"joint": "J", "backlash": 0.02, "from": 0, "to": 90, "count": 100}})
    )
    assert set(result.status.values) == {"undetermined"}
    np.testing.assert_allclose(result.undetermined.sel(component="rz"), 0.01, rtol=1e-6)


def test_an_arm_on_an_upright_axis_that_winds_up_is_in_the_middle_of_its_play() -> None:
    """Springs that draw the search to its rest must not leave the base at a flank, with the other one untold."""
    more = {
        "drives.q.stiffness": 1e7,
        "joints.K": {"type": "revolute", "bodies": ["arm", "upper"], "at": [100, 0, 250], "axis": [0, 1, 0]},
        "drives.k": {"joint": "K", "values": [10, 40], "backlash": 0.1, "stiffness": 1e7},
        "bodies.upper": {"mass": 18, "centre": [100, 30, 450]},
    }
    result = jp.loaded(UPRIGHT.mechanism().with_(more))
    assert list(result.status) == ["undetermined"] * 2
    np.testing.assert_allclose(result.error.sel(component="rz"), 0, atol=1e-5)
    np.testing.assert_allclose(result.undetermined.sel(component="rz"), 0.01, rtol=1e-3)


STAGE = planar()
STAGE.prismatic(
    "P",
    bodies=["ground", "a"],
    at=(0, 0),
    axis=(1, 0),
    clearance=jp.gap(0.001, length=50),
    friction={"coefficient": 0.1},
)
STAGE.drive("x", joint="P", values=[0], backlash={"plus": 1, "minus": 0})
STAGE.output(body="a", at=(0, 0))
STAGE.load(force=(0, -10))
STAGE.limits(x=0.2)


@pytest.mark.parametrize("minus", [0.0, 0.2, 1.0])
def test_to_first_order_play_on_one_side_is_in_its_middle_where_nothing_pushes(minus: float) -> None:
    """It was put where no error is, and first order was said to explain nothing of a mechanism that is linear."""
    m = STAGE.mechanism().with_({"drives.x.backlash.minus": minus})
    result, quick = jp.loaded(m), jp.loaded(m, exact=False, details=False)
    middle = 0.5 * (1.0 - minus)
    for found in (result.error, result.error_first_order, quick.error):
        np.testing.assert_allclose(found.sel(component="x"), middle, atol=1e-12)
    np.testing.assert_allclose(result.contribution.sel(source="x.backlash", component="x"), middle, atol=1e-12)


def test_what_is_to_blame_is_what_makes_the_value_that_is_told() -> None:
    """The guide was, of a value that the play of the drive makes."""
    m = STAGE.mechanism()
    said = {way: conclude(from_dataset(jp.loaded(m, approach=way))).sentences[0].text for way in (None, *SIDES, REST)}
    assert said[None].endswith("; to tighten first: x.backlash 100 %.")
    assert "what the load leaves open" in said[None]
    there, other = sorted((said[side] for side in SIDES), key=lambda text: "other side" in text)
    assert there.endswith("; to tighten first: x.backlash 100 %.")
    for text in (other, said[REST]):
        assert "to tighten" not in text


def test_quantiles_under_a_load_are_as_fine_as_what_scatters() -> None:
    """They were as coarse as the play that the load holds, and beyond what is possible."""
    m = STAGE.mechanism().with_(
        {"drives.x": {"joint": "P", "values": [0], "error": 0.003, "law": "uniform", "backlash": 1}}
    )
    m = m.with_({"joints.P.friction": None, "loads.0.force": [-3, -10]})
    result = jp.random(m, samples=16384, contact="loaded")
    found = result.error_quantile.sel(quantity="x")
    ends = -0.5 + 0.003 * (2.0 * found.probability - 1.0)
    np.testing.assert_allclose(found, np.broadcast_to(ends, found.shape), atol=1e-5)
