"""The bundled mechanisms with gears, rack, belt and screw against numbers by hand.

Tooth forces and lost motions are those of the drawn pose; the exact closure moves the bodies by their play, about 1e-4
of their size, and pressure angles by about backlash / module. The tolerances say how much of that there is.
"""

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import example

TAN20 = np.tan(np.radians(20.0))
#: nominal poses are solved to rounding
EXACT = {"rtol": 1e-11, "atol": 1e-9}


def turned(m: jp.Mechanism, body: str) -> np.ndarray:
    """The angle of a body on the nominal path, degrees, without jumps of whole turns."""
    angles = np.radians(jp.solve(m).pose.sel(body=body, component="angle").values)
    return np.degrees(np.unwrap(angles))


def force(result: xr.Dataset, joint: str) -> np.ndarray:
    return result.reaction.sel(joint=joint, wrench=["fx", "fy"]).values


def moment(result: xr.Dataset, joint: str, component: str = "moment") -> np.ndarray:
    return result.reaction.sel(joint=joint, wrench=component).values


class TestGearedFiveBar:
    m = example("geared-five-bar")

    def test_the_right_crank_turns_half_as_far_the_other_way(self) -> None:
        left = np.linspace(0.0, 720.0, 25)
        steps = np.diff(turned(self.m, "right"))
        np.testing.assert_allclose(steps, -0.5 * np.diff(left), **EXACT)

    def test_the_curve_of_the_pin_closes_after_two_turns(self) -> None:
        output = jp.solve(self.m).nominal.sel(component=["x", "y"]).values
        np.testing.assert_allclose(output[0], output[-1], **EXACT)
        assert np.linalg.norm(output[0] - output[12]) > 10.0, "after one turn it is elsewhere"

    def test_the_drive_feels_the_load_by_virtual_work(self) -> None:
        """Torque of the motor times its step is the work of the force on the pin along the nominal path."""
        step = 0.01
        fine = self.m.with_({"drives.motor": {"joint": "A", "values": [130.0 - step, 130.0, 130.0 + step]}})
        y = jp.solve(fine).nominal.sel(component="y").values
        by_work = 30.0 * (y[2] - y[0]) / np.radians(2.0 * step)
        perfect = fine.with_({"joints.*.clearance": {"radial": 0}} | {"joints.mesh.clearance": {"backlash": 0}})
        np.testing.assert_allclose(moment(jp.loaded(perfect), "A")[1], by_work, rtol=1e-6)

    def test_the_flank_that_carries_has_the_sign_of_the_torque(self) -> None:
        """What the rod turns the right gear by about E, that is what the force of the teeth holds."""
        result = jp.loaded(self.m)
        angle = np.radians(turned(self.m, "right"))
        arm = 25.0 * np.stack([np.cos(angle), np.sin(angle)])
        fx, fy = force(result, "D").T  # on the rod
        by_rod, by_teeth = -(arm[0] * fy - arm[1] * fx), moment(result, "mesh")
        # The crank of 25 mm is turned by play of 0.1 mm and less.
        np.testing.assert_allclose(by_teeth, -by_rod, atol=25.0 * 0.1)
        flank = result.offset.sel(parameter="mesh.flank").values
        carries = np.abs(by_teeth) > 1e-6
        np.testing.assert_allclose(flank[carries], -0.04 * np.sign(by_teeth[carries]), rtol=1e-9)
        assert len(set(np.sign(by_teeth[carries]))) == 2, "the sides change along the path"
        # Where the torque passes through zero within the play, the teeth rest between their flanks.
        assert (np.abs(flank[~carries]) < 0.04).all()


class TestRackSlider:
    m = example("rack-slider")

    def test_travel_is_radius_times_angle(self) -> None:
        x = jp.solve(self.m).nominal.sel(component="x").values
        np.testing.assert_allclose(x, 18.0 * np.radians(np.linspace(0.0, 180.0, 13)), **EXACT)

    def test_tooth_force_and_bearing_by_hand(self) -> None:
        """150 N along the pitch line, 150 tan 20 deg across it, which the bearing takes up, and 150 * 18 N mm."""
        result = jp.loaded(self.m).isel(configuration=0)
        # The slider tilts by 0.019 deg, which turns the line of action.
        np.testing.assert_allclose(force(result, "mesh"), [-150.0, 150.0 * TAN20], rtol=2e-3)
        np.testing.assert_allclose(force(result, "bearing"), [150.0, -150.0 * TAN20], rtol=2e-3)
        np.testing.assert_allclose(moment(result, "bearing"), 150.0 * 18.0, rtol=2e-4)

    def test_lost_motion_when_the_force_turns_round(self) -> None:
        """Backlash, twice the shift of the bearing over cos 20 deg, and twice the tilt times the height of the tool."""
        push, pull = (jp.loaded(self.m.with_({"loads.0.force": [f, 0]})) for f in (150, -150))
        x = [result.error.sel(component="x").values[0] for result in (push, pull)]
        by_hand = 0.05 + 2.0 * 0.01 / np.cos(np.radians(20.0)) + 2.0 * (40.0 + 12.0) * 0.02 / 60.0
        # What the tilt does to the line of action is of second order.
        np.testing.assert_allclose(x[0] - x[1], by_hand, rtol=1e-3)
        flanks = [float(result.offset.sel(parameter="mesh.flank")[0]) for result in (push, pull)]
        np.testing.assert_allclose(flanks, [-0.025, 0.025], rtol=1e-9)


class TestBeltArm:
    m = example("belt-arm")

    def test_the_elbow_folds_twice_as_fast_and_the_tool_moves_straight(self) -> None:
        motor = np.linspace(60.0, 10.0, 11)
        output = jp.solve(self.m).nominal
        np.testing.assert_allclose(output.sel(component="x"), 500.0 * np.cos(np.radians(motor)), **EXACT)
        np.testing.assert_allclose(output.sel(component="y"), 0.0, atol=1e-9)
        # Relative to the upper arm: half of what the pulley turns relative to it, -3 - 1.
        elbow = turned(self.m, "forearm") - turned(self.m, "upper")
        np.testing.assert_allclose(np.diff(elbow), 0.5 * (-3.0 - 1.0) * np.diff(motor), **EXACT)

    def test_the_strand_carries_the_moment_about_the_elbow(self) -> None:
        result = jp.loaded(self.m).isel(configuration=0)
        radius = 48 * 5 / (2.0 * np.pi)
        # 20 N at 125 mm; the arm hangs by 0.5 mm because of its play, which changes the lever.
        lever = 125.0 + float(result.error.sel(component="x"))
        np.testing.assert_allclose(moment(result, "belt"), 20.0 * lever, rtol=2e-3)
        np.testing.assert_allclose(np.linalg.norm(force(result, "belt")), 20.0 * lever / radius, rtol=2e-3)

    def test_the_motor_feels_both_joints(self) -> None:
        """One torque for both: that on the shoulder and three times that on the pulley, by virtual work."""
        rigid = {f"joints.{name}.clearance.radial": 0 for name in ("shoulder", "motor", "elbow")}
        result = jp.loaded(self.m.with_(rigid | {"joints.belt.clearance.slack": 0}))
        torque = moment(result, "shoulder") - 3.0 * moment(result, "motor")
        # The tool moves level, so that its weight does no work.
        np.testing.assert_allclose(torque, 0.0, atol=1e-6)
        assert (np.abs(moment(result, "shoulder")) > 3000.0).all()

    def test_slack_at_the_elbow(self) -> None:
        """Without any other play the forearm turns by the slack over its pulley's radius."""
        names = ("shoulder", "motor", "elbow")
        alone = self.m.with_({f"joints.{name}.clearance.radial": 0 for name in names})
        angle = jp.loaded(alone).error.sel(component="angle").values
        np.testing.assert_allclose(angle, -np.degrees(0.05 / (48 * 5 / (2.0 * np.pi))), rtol=1e-6)


class TestBallScrew:
    m = example("ball-screw")

    def test_travel_is_lead_times_turns(self) -> None:
        x = jp.solve(self.m).nominal.sel(component="x").values
        np.testing.assert_allclose(x, 50.0 + 5.0 * np.linspace(0.0, 20.0, 11), **EXACT)

    def test_lead_error_and_axial_play_reach_the_stage_as_they_are(self) -> None:
        upright = self.m.with_({"output.at": [0, 0, 0], "drives.motor.error": 0, "joints.guide.clearance.gap": 0})
        worst = jp.worst(upright)
        # Lead error 0.01, play of the nut 0.005, of the bearing 0.003.
        np.testing.assert_allclose(worst.worst_position, 0.01 + 0.005 + 0.003, rtol=1e-6)

    def test_a_drive_error_moves_it_by_the_lead(self) -> None:
        off = jp.given(self.m, {"motor": 0.1})
        np.testing.assert_allclose(off.error.sel(component="x"), -5.0 * 0.1 / 360.0, rtol=1e-9)

    def test_the_torque_of_the_motor(self) -> None:
        """80 N * 5 mm / 2 pi; the nut and the bearing are pushed to the end of their axial play."""
        result = jp.loaded(self.m)
        np.testing.assert_allclose(moment(result, "bearing", "mx"), -80.0 * 5.0 / (2.0 * np.pi), rtol=1e-6)
        np.testing.assert_allclose(result.offset.sel(parameter="nut.along"), -0.005, rtol=1e-9)
        np.testing.assert_allclose(result.offset.sel(parameter="bearing.along"), -0.003, rtol=1e-9)


class TestPlanetaryGear:
    m = example("planetary-gear")
    sun, planet, ring = 24, 18, 60
    pin = 1.5 * (24 + 18) / 2.0

    def test_willis(self) -> None:
        """sun = (1 + ring / sun) carrier, and planet - carrier = -(sun / planet) (sun - carrier)."""
        drive = np.linspace(0.0, 360.0, 5)
        carrier = drive / (1.0 + self.ring / self.sun)
        np.testing.assert_allclose(turned(self.m, "carrier"), carrier, **EXACT)
        planet = carrier - self.sun / self.planet * (drive - carrier)
        for name in ("planet1", "planet2", "planet3"):
            np.testing.assert_allclose(np.diff(turned(self.m, name)), np.diff(planet), **EXACT)

    @pytest.mark.parametrize("turns", [25, 100, 900])
    def test_as_many_turns_at_once_are_followed(self, turns: int) -> None:
        """No configuration lies between; 25 turns once ended as if the links could not reach the pose."""
        m = self.m.with_({"drives.sun": {"joint": "sun_bearing", "values": [0.0, 360.0 * turns]}})
        carrier = 360.0 * turns / (1.0 + self.ring / self.sun)
        first, last = jp.solve(m).pose.sel(body="carrier", component="angle").values
        assert last - first == pytest.approx(carrier, rel=1e-11)

    def test_more_turns_at_once_than_are_followed_are_refused(self) -> None:
        problem = r"drives\.sun: from one configuration to the next, .* 1,001 times; at most 1000 turns are followed"
        with pytest.raises(jp.InputError, match=problem):
            self.m.with_({"drives.sun": {"joint": "sun_bearing", "values": [0.0, 360.0 * 1001]}})

    def test_two_constraints_are_redundant(self) -> None:
        assert jp.check(self.m).attrs["redundancy"] == 2

    def test_lost_motion_of_the_carrier(self) -> None:
        """Half of the backlash at sun and ring and the pin's play, at the radius of the pins: from flank to flank."""
        by_hand = np.degrees((0.06 / 2.0 + 0.06 / 2.0 + 2.0 * 0.01) / self.pin)
        there, back = (jp.loaded(self.m.with_({"loads.0.moment": s * 20000.0})) for s in (1.0, -1.0))
        lost = (there.error - back.error).sel(component="angle")
        # Pins shift along the line of action, and backlash widens with the distance of the centres: 1e-4 of it.
        np.testing.assert_allclose(lost, by_hand, rtol=1e-3)

    def test_torques_and_tooth_forces(self) -> None:
        alone = self.m.with_({"loads.0.force": [0, 0]})
        result = jp.loaded(alone).isel(configuration=0)
        np.testing.assert_allclose(moment(result, "sun_bearing"), 20000.0 / 3.5, rtol=1e-9)
        share = 20000.0 / 3.0
        for k in "123":
            np.testing.assert_allclose(np.linalg.norm(force(result, f"pin{k}")), share / self.pin, rtol=2e-3)
            tooth = share / self.pin / 2.0 / np.cos(np.radians(20.0))
            for mesh in ("sun", "ring"):
                np.testing.assert_allclose(np.linalg.norm(force(result, mesh + k)), tooth, rtol=2e-3)

    def test_a_radial_force_makes_the_planets_carry_differently(self) -> None:
        result = jp.loaded(self.m)
        pins = np.stack([force(result, f"pin{k}") for k in "123"])
        assert (np.ptp(np.linalg.norm(pins, axis=-1), axis=0) > 10.0).all()
        # The carrier in equilibrium: its pins and its bearing hold the load (a reaction acts on the second body).
        total = force(result, "carrier_bearing") - pins.sum(axis=0)
        np.testing.assert_allclose(total, [[0.0, 50.0]] * 5, atol=1e-5)
