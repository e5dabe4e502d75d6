"""The machine as it runs: accelerations, inertia as loads, drive torques and powers, and whether contact follows."""

import json
import math
import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.interpolate import BPoly

import jointplay as jp
from helpers.builders import planar, spatial
from helpers.graphs import graph
from helpers.oracles.moving import CutOpen, Part, differenced
from helpers.rods import rod_and_slider
from helpers.slider_crank import slider_crank
from jointplay import examples
from jointplay.analyses import loaded
from jointplay.analyses.nominal import nominal
from jointplay.analyses.running import _between, contact_rates, moving
from jointplay.basics import poses
from jointplay.file.schema import json_schema
from jointplay.model.inertia import kinematics
from jointplay.result.verdict import HELD, NOT_SHOWN, verdict

#: examples that have drives
DRIVEN = [name for name in examples.names() if "[drives" in examples.text(name)]

RUNNING = slider_crank(
    drive="crank",
    driven={"speed": 50, "acceleration": 17188.733853924696},
    on_rod=False,
    turning_speed="rad/s",
    gravity=(0, -9.81),
)
RUNNING.body("crank", mass=0.8, centre=(15, 0), rotational_inertia=900)
RUNNING.body("rod", mass=0.5, centre=(50, 4), rotational_inertia=800)
RUNNING.body("ram", mass=1.2, centre=(5, -3), rotational_inertia=600)
SLIDER_CRANK = RUNNING.mechanism()

IN_SPACE = spatial(turning_speed="rad/s", gravity=(0, 0, -9.81))
rod_and_slider("crank", IN_SPACE, speed=50, acceleration=17188.733853924696)
IN_SPACE.start("rod", x=34, y=20, z=10, rotation=[0, 20, 0])
IN_SPACE.body("crank", mass=0.8, centre=(15, 0, 4), rotational_inertia=[700, 800, 900])
IN_SPACE.body("rod", mass=0.5, centre=(50, 0, 0), rotational_inertia=[0, 800, 800])
IN_SPACE.body("slider", mass=1.2, centre=(5, -3, 2), rotational_inertia=[500, 650, 600])
RSSP = IN_SPACE.mechanism()


def wheel(angle: str, **drive: object) -> jp.Builder:
    """A body on a pin, turned by a drive."""
    b = planar(angle=angle)
    b.revolute("pin", ground=(0, 0), wheel=(0, 0), clearance=jp.radial(0.02))
    b.drive("q", joint="pin", **drive)
    b.output(body="wheel", at=(30, 0))
    b.body("wheel", mass=0.7, centre=(12, 0))
    return b


WHEEL = wheel("rad", from_=0, to=6, count=25, speed=80).mechanism()


def in_motion(m: jp.Mechanism, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and accelerations of the drives, some radians or characteristic lengths per second."""
    rng = np.random.default_rng([37, seed])
    unit = np.array([1.0 if m.coordinate_kind(j) == "angle" else m.length for j in m.drive_joints])
    return rng.uniform(-3.0, 3.0, (1, len(unit))) * unit, rng.uniform(-9.0, 9.0, (1, len(unit))) * unit


class TestMotion:
    """Velocities and accelerations of all bodies."""

    @pytest.mark.parametrize("name", DRIVEN)
    def test_they_are_differences_of_poses(self, name: str) -> None:
        """Every kind of joint, coupling and follower, over-constrained mechanisms, plane and space."""
        m = jp.loads(examples.text(name), f"{name}.toml")
        at = nominal(m)
        k = len(at) // 2
        check_differences(m, at.drives[k : k + 1], at.poses[k : k + 1])

    @pytest.mark.parametrize("seed", range(60))
    def test_of_random_mechanisms(self, seed: int) -> None:
        m = jp.loads(graph(seed))
        at = nominal(m)
        check_differences(m, at.drives, at.poses, seed)

    def test_held_drives_move_nothing(self) -> None:
        m = SLIDER_CRANK
        at = nominal(m)
        still = kinematics(m, at.drives, at.poses, np.zeros((2, 1, 1)))
        assert not still.velocity.any()
        assert not still.acceleration.any()

    def test_at_a_singular_pose_there_is_no_motion(self) -> None:
        """At its dead centre a slider-crank that is driven by its slider moves either way."""
        m = SLIDER_CRANK.with_(
            {"joints.guide.on.ground.at": [0, 0], "drives.crank.joint": "guide", "drives.crank.values": [140, 160]}
            | {"drives.crank.acceleration": None, "units.turning_speed": None}
        )
        result = jp.loaded(m)
        assert result.status.values.tolist() == ["ok", "singular"]
        assert np.isfinite(result.velocity.values[0]).all()
        assert np.isnan(result.velocity.values[1]).all()


def check_differences(m: jp.Mechanism, drives: np.ndarray, placed: np.ndarray, seed: int = 0) -> None:
    speeds, accelerations = in_motion(m, seed)
    found = kinematics(m, drives, placed, np.stack([speeds, accelerations]))
    velocity, acceleration = differenced(m, drives, placed, speeds, accelerations)
    unit = np.array([m.length] * 3 + [1.0] * 3)
    for ours, other in ((found.velocity[0], velocity), (found.acceleration[0], acceleration)):
        scale = max(1.0, float(np.abs(other / unit).max()))
        # Differences of fourth order over 2e-3 rad, of poses that are closed to 1e-12: 1e-6 of accelerations.
        assert np.abs((ours - other) / unit).max() < 2e-5 * scale


#: what an independent program of rigid-body dynamics finds for the slider-crank: angular velocity and acceleration of
#: the rod, velocity and acceleration of the ram (mm), torque of the drive, force of the wrist on the ram
PLANAR_FIGURES = np.array(
    [
        [-14.907120, 283.5112, -1447.2136, -109917.092, -609.41067, 68.099489, -12.830959],
        [-4.718601, 842.3200, -2161.3504, 1052.402, -8043.71525, 201.262882, -84.145678],
        [8.977666, 799.0531, -1331.2787, 66300.570, -7578.16497, 279.560684, -111.648895],
    ]
)
#: and the error under load there
PLANAR_ERRORS = np.array(
    [
        [-0.054608547, -0.049989992, -0.05729578],
        [-0.085126497, -0.049989992, -0.05729578],
        [-0.076610396, -0.03, 0.0],
    ]
)
#: of the mechanism in space: velocity and acceleration of the slider, torque, force of the ball on the slider
SPATIAL_FIGURES = np.array(
    [
        [-1076.621417, -117444.7786, -192.98620, 59.066266, 1.009955, -14.868171],
        [-2042.439036, -20032.9896, -6486.88860, 175.960412, -30.286944, -63.734188],
    ]
)


class TestInertia:
    """Forces of inertia as loads."""

    def test_figures_in_the_plane(self) -> None:
        m = SLIDER_CRANK
        result, linear = jp.loaded(m), jp.loaded(m, exact=False)
        velocity, acceleration = result.body_velocity, result.body_acceleration
        found = np.column_stack(
            [
                np.radians(velocity.sel(body="rod", component="angle")),
                np.radians(acceleration.sel(body="rod", component="angle")),
                velocity.sel(body="ram", component="x"),
                acceleration.sel(body="ram", component="x"),
                linear.drive_torque[:, 0],
                linear.reaction.sel(joint="wrist", wrench="fx"),
                linear.reaction.sel(joint="wrist", wrench="fy"),
            ]
        )
        assert found == pytest.approx(PLANAR_FIGURES, rel=1e-6)
        assert result.error.values == pytest.approx(PLANAR_ERRORS, abs=1e-8)
        assert result.velocity.sel(component="x").values == pytest.approx(PLANAR_FIGURES[:, 2], rel=1e-7)

    def test_figures_in_space(self) -> None:
        """A rod that has a moment of inertia about its line as well does not spin, and pushes in the same way."""
        for about in (0, 50):
            m = RSSP.with_({"bodies.rod.rotational_inertia": [about, 800, 800]})
            result = jp.loaded(m, exact=False)
            found = np.column_stack(
                [
                    result.velocity.sel(component="x"),
                    result.acceleration.sel(component="x"),
                    result.drive_torque[:, 0],
                    result.reaction.sel(joint="B", wrench=["fx", "fy", "fz"]),
                ]
            )
            assert found == pytest.approx(SPATIAL_FIGURES, rel=1e-6)

    @pytest.mark.parametrize("ball", [False, True])
    def test_it_takes_the_torque_and_the_force_that_pinocchio_finds(self, ball: bool) -> None:
        m = RSSP if ball else SLIDER_CRANK
        at = nominal(m)
        parts = [
            Part(body.mass, (*np.array([*body.centre, 0.0][:3]) * 1e-3,), (*np.diag(one.matrix),))
            for body, one in zip(m.data.bodies.values(), m.loads.inertial, strict=True)
        ]
        arm, line = ([0.04, 0, 0.01], [0, 0.015, -0.03]) if ball else ([0.04, 0, 0], [0, -0.01, 0])
        gravity = np.array([0, 0, -9.81] if ball else [0, -9.81, 0.0])
        cut = CutOpen(*parts, np.array(arm), np.array([0.12, 0, 0]), np.array(line), ball=ball, gravity=gravity)
        result = jp.loaded(m, exact=False)
        wrist = result.reaction.sel(joint="B" if ball else "wrist").values
        for k, theta in enumerate(at.drives[:, 0].tolist()):
            turn = [0.0, 0.3, -theta] if ball else [-theta]
            start = np.array([theta, *turn, at.output[k, 0]])
            torque, force = cut.solve(theta, 50.0, 300.0, np.array([-200.0, 30.0]), start)
            assert result.drive_torque.values[k, 0] / 1e3 == pytest.approx(torque, rel=1e-9)
            assert wrist[k, : len(force)] == pytest.approx(force, rel=1e-9)

    def test_loads_that_are_written_by_hand_give_the_same(self) -> None:
        """The forces of inertia of each configuration as lists of loads, weights apart."""
        m = SLIDER_CRANK
        at = nominal(m)
        motion = moving(m, at, m.motion)
        loads = [dict(m.raw["loads"][0])]
        for name, body in m.data.bodies.items():
            k = m.bodies.index(name)
            _, acceleration = motion.of_point(k, (*np.array(body.centre) * 1e-3, 0.0))
            force = -body.mass * acceleration[:, :2]
            moment = -body.rotational_inertia * acceleration[:, 5] * 1e-3
            loads.append({"body": name, "at": [*body.centre], "force": force.tolist(), "moment": moment.tolist()})
        rest = m.with_({"drives.crank.speed": None, "drives.crank.acceleration": None, "loads": loads})
        running, written = jp.loaded(m), jp.loaded(rest)
        assert "velocity" not in written
        for name in ("error", "reaction", "offset", "drive_torque", "undetermined"):
            assert running[name].values == pytest.approx(written[name].values, rel=1e-9, abs=1e-9), name

    @pytest.mark.parametrize("seed", range(40))
    def test_power_balance_of_random_mechanisms(self, seed: int) -> None:
        check_power(jp.loads(graph(seed)), seed)

    @pytest.mark.parametrize(
        "name", ["sarrus", "bennett", "planetary-gear", "ball-screw", "3-rrr-spherical", "belt-arm"]
    )
    def test_power_balance_of_over_constrained_and_coupled_mechanisms(self, name: str) -> None:
        """What shares the load between redundant joints does no work."""
        m = jp.loads(examples.text(name), f"{name}.toml")
        check_power(m, 3)

    def test_energy_over_a_turn(self) -> None:
        """At constant speed the drive does no work over a turn against inertia and weight alone."""
        turn = {"drives.crank.values": None, "drives.crank.from": 0, "drives.crank.to": 360, "drives.crank.count": 721}
        m = SLIDER_CRANK.with_({**turn, "drives.crank.acceleration": None, "loads": None})
        result = jp.loaded(m, exact=False)
        power, time = result.drive_power.values[:, 0], result.time.values
        assert time[-1] == pytest.approx(2 * math.pi / 50)
        # The trapezoidal rule is exact for periodic functions as smooth as this one.
        assert abs(np.trapezoid(power, time)) < 1e-9 * np.trapezoid(np.abs(power), time)

    def test_a_rotor_takes_moment_of_the_motor_only(self) -> None:
        m = SLIDER_CRANK
        before, after = jp.loaded(m), jp.loaded(m.with_({"drives.crank.rotor_inertia": 2000}))
        assert (after.error == before.error).all()
        assert (after.drive_torque == before.drive_torque).all()
        # 2000 kg mm^2 times 300 rad/s^2 are 0.6 N m.
        assert (after.motor_torque - after.drive_torque).values == pytest.approx(600.0)
        assert after.drive_power.values == pytest.approx(after.motor_torque.values / 1e3 * 50.0)
        assert "motor_torque" not in before

    def test_elastic_bodies_are_pieces_that_move_together(self) -> None:
        """A body that gives way moves as a rigid one does nominally; its inertia bends it."""
        m = SLIDER_CRANK
        elastic = m.with_(
            {"bodies.rod.E": 2e5, "bodies.rod.area": 100, "bodies.rod.inertia": 800, "bodies.rod.centre": [50, 0]}
        )
        rigid = m.with_({"bodies.rod.centre": [50, 0]})
        one, other = jp.loaded(rigid, exact=False), jp.loaded(elastic, exact=False)
        assert other.drive_torque.values == pytest.approx(one.drive_torque.values, rel=1e-6)
        assert np.abs(other.deformation).max() > 0.0
        assert "contact_rate" not in other, "judged of determinate mechanisms only"


def check_power(m: jp.Mechanism, seed: int) -> None:
    """What drives and loads do is the change of kinetic energy, found from poses alone."""
    rng = np.random.default_rng([41, seed])
    is_planar = m.data.space == "planar"
    at = nominal(m)
    at = at.chosen(np.array([len(at) // 2]))
    speeds, accelerations = in_motion(m, seed)
    changes: dict[str, Any] = {"gravity": [0.4, -9.81] if is_planar else [0.4, 2.0, -9.81], "path": None, "grid": None}
    size = m.length / m.units.length
    for k, drive in enumerate(m.drives):
        unit = m.drive_factors[k]
        told = {
            "values": [at.drives[0, k] / unit],
            "speed": speeds[0, k] / unit,
            "acceleration": accelerations[0, k] / unit,
        }
        told |= dict.fromkeys(("from", "to", "count", "csv", "column"))
        changes |= {f"drives.{drive}.{key}": value for key, value in told.items()}
    for body in dict.fromkeys(m.owners[k] for k in range(len(m.bodies)) if k not in m.crosses):
        moments = rng.uniform(0.05, 0.06, 3) * size**2
        changes[f"bodies.{body}.mass"] = float(rng.uniform(0.2, 2))
        changes[f"bodies.{body}.centre"] = rng.uniform(-size, size, 2 if is_planar else 3).tolist()
        changes[f"bodies.{body}.rotational_inertia"] = float(moments[0]) if is_planar else moments.tolist()
    running = m.with_(changes)
    at = nominal(running)
    velocity, acceleration = differenced(running, at.drives, at.poses, speeds, accelerations)

    def of_point(point: Any) -> tuple[np.ndarray, ...]:
        turn = poses.matrix(at.poses[0, point.body])
        arm = turn @ (np.array(point.at) - running.core.origins[point.body])
        (v, w), (a, turning) = (np.split(of[point.body], 2) for of in (velocity, acceleration))
        return v + np.cross(w, arm), w, a + np.cross(turning, arm) + np.cross(w, np.cross(w, arm)), turning, turn

    power = 0.0
    for inertial in running.loads.inertial:
        weight = running.loads.first[inertial.load]
        v, w, a, turning, turn = of_point(running.points[weight["point"]])
        matrix = turn @ inertial.matrix @ turn.T
        power += (inertial.mass * a - weight["force"]) @ v + (matrix @ turning + np.cross(w, matrix @ w)) @ w
    for load in running.loads.first[: len(running.data.loads)]:
        v, w, *_ = of_point(running.points[load["point"]])
        power -= np.array(load["force"]) @ v + np.array(load["moment"]) @ w
    result = jp.loaded(running, exact=False)
    scale = max(1e-3, float(np.abs(result.drive_power).max()))
    # Accelerations that are differenced are right to 1e-6 or so.
    assert float(result.drive_power.sum()) == pytest.approx(power, abs=1e-4 * scale)


class TestAtRest:
    """Without speed everything is as it was."""

    @pytest.mark.parametrize("m", [SLIDER_CRANK, RSSP])
    def test_speed_zero_is_no_speed(self, m: jp.Mechanism) -> None:
        still = m.with_({"drives.crank.speed": 0, "drives.crank.acceleration": None})
        plain = still.with_({"drives.crank.speed": None} | {f"bodies.{b}.rotational_inertia": None for b in m.bodies})
        one, other = jp.loaded(still), jp.loaded(plain)
        assert set(one) == set(other)
        for name in one:
            assert np.array_equal(one[name].values, other[name].values, equal_nan=one[name].dtype.kind == "f"), name
        assert "speeds" not in one.attrs

    def test_the_worst_case_does_not_depend_on_it(self) -> None:
        m = SLIDER_CRANK
        still = m.with_({"drives.crank.speed": None, "drives.crank.acceleration": None})
        for ask in (jp.worst, jp.solve):
            one, other = ask(m), ask(still)
            assert all(np.array_equal(one[n].values, other[n].values, equal_nan=one[n].dtype.kind == "f") for n in one)

    def test_a_machine_is_assembled_while_it_stands(self) -> None:
        m = jp.loads(examples.text("redundant-bar"))
        assert m.at_rest_under(0) is m

    def test_speed_alone_loads_nothing(self) -> None:
        m = WHEEL.with_({"bodies": None})
        with pytest.raises(jp.InputError, match="nothing loads the mechanism"):
            jp.loaded(m)
        result = jp.loaded(m.with_({"loads": [{"force": [0, -5]}]}))
        assert result.attrs["inertia"] == "none"
        assert result.velocity.values[0] == pytest.approx([0, 2400, 80])


class TestAsked:
    """What follows from the loads."""

    def test_specimens_that_do_not_scatter_are_where_the_load_has_them(self) -> None:
        m = SLIDER_CRANK
        exact = jp.loaded(m)
        scattered = jp.random(m, samples=16, contact="loaded")
        assert scattered.error_mean.values == pytest.approx(exact.error.values, abs=1e-12)
        assert scattered.attrs["speeds"] == exact.attrs["speeds"] == "crank 50 rad/s"

    def test_corrected_drives_bring_it_back_while_it_runs(self) -> None:
        m = SLIDER_CRANK
        result = jp.compensate(m)
        moved = m.with_({"drives.crank.values": result.drive_corrected.values[:, 0].tolist()})
        there = jp.loaded(moved).nominal.values[:, 0] + jp.loaded(moved).error.values[:, 0]
        # Of 0.05 to 0.09 mm; the inertia is that of the nominal motion, which moves with the drive by 1e-3 of itself.
        assert there == pytest.approx(jp.solve(m).nominal.values[:, 0], abs=1e-3)

    def test_a_map_has_the_errors_of_its_nodes(self) -> None:
        text = examples.text("serial-2r")
        m = jp.loads(text)
        one, other = m.drives
        changes: dict[str, Any] = {
            f"bodies.{body}": {"mass": 1 + k, "centre": [40, 5]} for k, body in enumerate(m.bodies)
        }
        changes |= {f"drives.{one}.speed": 300, f"drives.{other}.speed": -500}
        m = m.with_(changes)
        nodes = {one: {"from": 10, "to": 50, "count": 2}, other: {"from": 20, "to": 60, "count": 3}}
        found = jp.map(m, "loaded", grid=nodes)
        for i, p in enumerate((10, 50)):
            for k, q in enumerate((20, 40, 60)):
                alone = m.with_(
                    {f"drives.{d}.{key}": None for d in (one, other) for key in ("from", "to", "count")}
                    | {f"drives.{one}.values": [p], f"drives.{other}.values": [q], "path": None}
                )
                assert found.error.values[i, k] == pytest.approx(jp.loaded(alone).error.values[0], abs=1e-9)

    def test_nodes_of_a_map_are_no_path(self) -> None:
        """As many nodes as the file has configurations, at other places: nothing is passed from one to the next."""
        m = WHEEL
        found = jp.map(m, "loaded", grid={"q": {"from": 0, "to": 5, "count": 25}})
        assert "time" not in found
        assert found.contact_rate.values == pytest.approx(math.sqrt(0.02 / 12.0), rel=1e-4)

    def test_the_core_takes_all_loads_at_once(self) -> None:
        """It gives what it gives for the mechanism under the loads of each configuration."""
        for m in (SLIDER_CRANK, RSSP):
            at, result = nominal(m), jp.loaded(m)
            for k in range(len(at)):
                here = at.drives[k : k + 1], at.poses[k : k + 1]
                alone = m.running_under(k, *here).core.loaded(*here)["error"][0]
                # Results are divided into the units of the file.
                assert alone == pytest.approx(result.error.values[k] * m.component_factors, rel=1e-14, abs=1e-18)

    def test_a_map_needs_constant_speeds(self) -> None:
        m = SLIDER_CRANK.with_({"drives.crank.speed": [50, 60, 70]})
        with pytest.raises(jp.InputError, match="hold for its configurations only"):
            jp.map(m, "loaded", grid={"crank": {"from": 0, "to": 90, "count": 3}})
        with pytest.raises(jp.InputError, match="hold for its configurations only"):
            jp.map(m, "random", grid={"crank": {"from": 0, "to": 90, "count": 3}}, samples=16, contact="loaded")

    def test_inertia_acts_in_every_load_case(self) -> None:
        m = SLIDER_CRANK
        cases = m.with_(
            {
                "loads": None,
                "load_cases": {
                    "push": [{"body": "ram", "at": [50, -20], "force": [-200, 30]}],
                    "free": [{"body": "ram", "force": [0, 0]}],
                },
            }
        )
        found = jp.loaded(cases)
        alone = jp.loaded(m)
        assert found.error.sel(load_case="push").values == pytest.approx(alone.error.values, abs=1e-12)
        assert np.abs(found.error.sel(load_case="free") - found.error.sel(load_case="push")).max() > 1e-3

    def test_displaced_poses_are_those_of_the_machine_that_runs(self) -> None:
        from jointplay.analyses.displaced import under_load

        m = SLIDER_CRANK
        at = nominal(m)
        moved = under_load(m, at)
        shift = m.core.output(moved.poses) - at.output
        assert shift[:, :2] * 1e3 == pytest.approx(PLANAR_ERRORS[:, :2], abs=1e-7)


class TestLaws:
    """How drives move."""

    @pytest.mark.parametrize(
        ("law", "top", "most"),
        [("trapezoid", 1 / 0.75, 1 / (0.75 * 0.25)), ("cycloidal", 2.0, 2 * math.pi), ("poly5", 1.875, 5.7735027)],
    )
    def test_peaks_and_differences(self, law: str, top: float, most: float) -> None:
        """Largest speed and acceleration over stroke and duration; speeds are differences of values, and so on."""
        m = law_of_motion(law, 2001)
        assert m.motion is not None
        assert m.motion.times is not None
        values, (speed, acceleration, jerk), times = m.drive_values[:, 0], m.motion.rates[:, :, 0], m.motion.times
        stroke, duration = np.radians(90.0), 0.2
        assert (values[0], values[-1]) == (np.radians(10.0), np.radians(100.0))
        assert speed[[0, -1]] == pytest.approx(0.0, abs=1e-9)
        assert speed.max() == pytest.approx(top * stroke / duration, rel=1e-6)
        assert np.abs(acceleration).max() == pytest.approx(most * stroke / duration**2, rel=1e-5)
        within = np.diff(times) > 0.0
        for lower, upper in ((values, speed), (speed, acceleration), (acceleration, jerk)):
            mean = (upper[1:] + upper[:-1])[within] / 2
            slope = np.diff(lower)[within] / np.diff(times)[within]
            assert slope == pytest.approx(mean, abs=2e-6 * max(1.0, float(np.abs(upper).max())))

    def test_both_sides_of_a_corner_are_looked_at(self) -> None:
        m = law_of_motion("trapezoid", 5)
        # Equally spaced are 0, 50, 100, 150, 200 ms; the corners are at 50 and 150.
        assert m.motion.times.tolist() == pytest.approx([0, 0.05, 0.05, 0.1, 0.15, 0.15, 0.2])
        assert np.sign(m.motion.rates[1, :, 0]).tolist() == [1, 1, 0, 0, 0, -1, -1]
        result = jp.loaded(m)
        assert np.abs(np.diff(result.drive_torque.values[1:3, 0])) > 0.0

    def test_half_of_the_time_for_each_ramp(self) -> None:
        m = law_of_motion("trapezoid", 5, ramp=0.5)
        assert np.sign(m.motion.rates[1, :, 0]).tolist() == [1, 1, 1, -1, -1, -1]

    def test_values_at_times(self, tmp_path: Path) -> None:
        """A table of a cycloidal motion gives what its law gives; where it is sampled finely, to a part of 1e-4."""
        law = law_of_motion("cycloidal", 41)
        table = np.column_stack([1e3 * law.motion.times, np.degrees(law.drive_values[:, 0])])
        lines = ["t [ms];q [deg]", *(f"{t:.15g};{q:.15g}" for t, q in table.tolist())]
        (tmp_path / "motion.csv").write_text("\n".join(lines))
        text = wheel("deg", csv="motion.csv", column="q", time="t").text()
        (tmp_path / "wheel.toml").write_text(text)
        m = jp.load(tmp_path / "wheel.toml")
        assert m.motion.times == pytest.approx(law.motion.times)
        for order in range(2):
            ours, known = m.motion.rates[order, :, 0], law.motion.rates[order, :, 0]
            assert np.abs(ours - known).max() < 1e-4 * np.abs(known).max()
        m.write(tmp_path / "again.toml")
        assert jp.load(tmp_path / "again.toml") == m

    def test_a_table_with_few_digits_is_named(self) -> None:
        """Second differences of values with two decimals, 5 ms apart, are off by 4 * 0.005 / 0.005^2 at most."""
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset

        law = law_of_motion("cycloidal", 41)
        values = np.degrees(law.drive_values[:, 0])
        table = {"from": None, "to": None, "count": None, "motion": None, "duration": None}
        for digits in (2, 9):
            own = table | {"values": values.round(digits).tolist(), "times": law.motion.times.tolist()}
            m = law.with_({f"drives.q.{key}": value for key, value in own.items()})
            result = jp.loaded(m)
            said = [sentence.text for sentence in conclude(from_dataset(result)).sentences]
            assert any("Accelerations are uncertain: q by" in text for text in said) == (digits == 2)
        part = 4 * 0.005 / 0.005**2 / (2 * math.pi * 90 / 0.2**2)
        coarse = law.with_(
            {
                f"drives.q.{k}": v
                for k, v in (table | {"values": values.round(2).tolist(), "times": law.motion.times.tolist()}).items()
            }
        )
        assert coarse.motion.rounded["q"] == pytest.approx(part, rel=0.1)

    @pytest.mark.parametrize("last", [1e12, 5.0 + 1e-6])
    def test_a_table_between_whose_values_a_spline_swings_is_refused(self, last: float) -> None:
        """With a last time of 1e12 s the drive was followed over 1e31 degrees, without end."""
        table = {"from": None, "to": None, "count": None, "speed": None, "acceleration": None}
        own = table | {"values": [0, 1, 4, 9, 16, 25, 36], "times": [0, 1, 2, 3, 4, 5, last]}
        with pytest.raises(jp.InputError, match=r"drives.q.times: the spline through the values swings .* even steps"):
            WHEEL.with_({f"drives.q.{key}": value for key, value in own.items()})

    def test_when_configurations_are_passed(self) -> None:
        m = WHEEL
        assert jp.loaded(m).time.values == pytest.approx(np.linspace(0, 6, 25) / 80)
        back = m.with_({"drives.q.from": 6, "drives.q.to": 0})
        assert back.motion.times is None, "it does not run along its values at this speed"
        assert "time" not in jp.loaded(back)
        assert back.with_({"drives.q.speed": -80}).motion.times[-1] == pytest.approx(6 / 80)

    def test_drives_run_on_one_clock(self) -> None:
        """A drive of constant speed beside one with a law has its values when the law says."""
        arm = jp.loads(examples.text("serial-2r"))
        one, other = arm.drives
        law = {"from": 0, "to": 60, "count": 7, "motion": "cycloidal", "duration": 0.3, "values": None, "speed": None}
        pace = {"from": 10, "to": 40, "count": 7, "speed": 100, "values": None}
        changes = {f"drives.{one}.{k}": v for k, v in law.items()} | {f"drives.{other}.{k}": v for k, v in pace.items()}
        m = arm.with_({"path": None, **changes})
        assert m.motion.times == pytest.approx(np.linspace(0, 0.3, 7))
        with pytest.raises(jp.InputError, match=r"at this speed it takes 0\.15 s from its first value to its last"):
            m.with_({f"drives.{other}.speed": 200})
        with pytest.raises(jp.InputError, match="motions run on one clock"):
            m.with_({f"drives.{other}.speed": None, f"drives.{other}.motion": "poly5", f"drives.{other}.duration": 0.4})

    def test_revolutions_per_minute(self) -> None:
        m = WHEEL.with_({"units.turning_speed": "1/min", "drives.q.speed": 764.0})
        assert m.motion.rates[0, 0, 0] == pytest.approx(764 * 2 * math.pi / 60)
        result = jp.loaded(m)
        assert (result.drive_speed.values[0, 0], result.drive_speed.attrs["units"]) == (pytest.approx(764), "1/min")
        assert result.velocity.values[0, 2] == pytest.approx(764 * 2 * math.pi / 60), "of bodies in radians per second"
        assert result.attrs["speeds"] == "q 764 1/min"


def law_of_motion(law: str, count: int, **more: object) -> jp.Mechanism:
    return wheel("deg", from_=10, to=100, count=count, motion=law, duration=0.2, **more).mechanism()


class TestContact:
    """Whether contact follows the reactions."""

    def test_an_unbalanced_wheel(self) -> None:
        """R = m r w^2 turns with w, and the whole mass is behind the gap: kappa = sqrt(c / r), whatever the speed."""
        for speed in (1, 80, 5000):
            rate = jp.loaded(WHEEL.with_({"drives.q.speed": speed})).contact_rate.values
            # Between instants the reaction goes straight on: by chords of 6 rad / 720.
            assert rate == pytest.approx(math.sqrt(0.02 / 12.0), rel=1e-4)

    def test_a_balanced_wheel_under_a_steady_load(self) -> None:
        m = WHEEL.with_({"bodies.wheel.centre": [0, 0], "loads": [{"force": [3, -5], "at": [0, 0]}]})
        result = jp.loaded(m)
        assert (result.contact_rate == 0.0).all()
        assert (result.contact == "follows").all()
        assert result.transit_time.isnull().all()

    def test_a_pin_without_a_force_is_not_judged(self) -> None:
        """Nothing presses the pin of a balanced wheel; it was said to follow its reaction."""
        result = jp.loaded(WHEEL.with_({"bodies.wheel.centre": [0, 0]}))
        assert result.contact_rate.isnull().all()
        assert (result.contact == "").all()

    def test_a_load_that_goes_through_zero(self) -> None:
        """From 6 N to -6 N within 0.25 rad: the pin falls across its hole under a force that grows with time."""
        forces = [[6, 0]] * 12 + [[-6, 0]] * 13
        m = WHEEL.with_({"bodies.wheel.centre": [0, 0], "loads": [{"force": forces, "at": [0, 0]}]})
        result = jp.loaded(m)
        assert np.isinf(result.contact_rate.values[[11, 12], 0]).any()
        # One of the two is nearest to the crossing, which is half-way.
        assert set(result.contact.values[:, 0]) == {"follows", "lost"}
        growth = 12.0 / (0.25 / 80)
        tau = (12 * 0.7 * 0.02e-3 / growth) ** (1 / 3)
        times = result.transit_time.values[np.isinf(result.contact_rate.values[:, 0]), 0]
        assert times == pytest.approx(tau, rel=1e-6)
        # The distance that a mass falls from rest under growth * t is growth t^3 / (6 m).
        assert growth * tau**3 / (6 * 0.7) == pytest.approx(2 * 0.02e-3)

    def test_peaks_between_configurations_are_seen(self) -> None:
        """At 65 rad/s the wrist's reaction passes near zero at 32 deg; an independent program has 2.49 there."""
        rest = {f"joints.{j}.clearance": None for j in ("shaft", "pin", "guide")}
        turn = {"drives.crank.values": None, "drives.crank.from": 0, "drives.crank.to": 360, "drives.crank.count": 24}
        turn |= {"drives.crank.speed": 65, "drives.crank.acceleration": None, "loads": [{"force": [-200, 0]}]}
        result = jp.loaded(SLIDER_CRANK.with_(rest | turn), exact=False)
        k = int(result.contact_rate.values[:, 0].argmax())
        assert result.contact_rate.values[k, 0] == pytest.approx(2.49, abs=0.05)
        assert float(result.crank[k]) == pytest.approx(32.0, abs=360 / 23)
        assert str(result.contact.values[k, 0]) == "may be lost"

    def test_it_does_not_depend_on_how_the_path_is_known(self) -> None:
        """At single configurations reactions are differenced around them; along a path they are followed."""
        m = WHEEL
        path, at = contact_rates(m, nominal(m), m.motion)[0], nominal(m)
        single = m.with_({"drives.q.from": None, "drives.q.to": None, "drives.q.count": None, "drives.q.values": [2.0]})
        assert contact_rates(single, nominal(single), single.motion)[0] == pytest.approx(path[:1], rel=1e-4)
        assert len(at) == len(path)

    def test_between_configurations_drives_follow_polynomials(self) -> None:
        """Those of SciPy with the same values and derivatives at both ends."""
        rng = np.random.default_rng(7)
        states, spans, share = rng.normal(size=(3, 5, 2)), np.array([0.3, 1.2, 0.0, 0.7, 0.0]), np.arange(4) / 4
        found = _between(states[0], states[1:], spans, share)
        for k in (0, 1, 3):
            way = BPoly.from_derivatives([0.0, spans[k]], states[:, k : k + 2].transpose(1, 0, 2))
            for order in range(3):
                assert found[order, k] == pytest.approx(way(share * spans[k], order), rel=1e-9, abs=1e-9)

    @pytest.mark.parametrize("speed", [0.0, 1e-12, 1e-3])
    def test_a_reversal_is_no_loss_of_contact(self, speed: float) -> None:
        """Speeds of a list that rounding keeps from zero: their instants were seconds away, at other poses."""
        m = jp.loads(examples.text("press-running"))
        each = {"drives.crank.speed": [speed] * 37, "drives.crank.acceleration": [3000.0] * 37}
        rates = jp.loaded(m.with_(each)).contact_rate.values[:, :3]
        assert np.isfinite(rates).all()
        assert rates.max() < 1e-3

    def test_springs_press_as_well(self) -> None:
        m = WHEEL
        spring = {"on": {"ground": [-40, 0], "wheel": [0, 0]}, "stiffness": 2.0, "free_length": 10}
        pulled = m.with_({"springs.s": spring})
        at = nominal(pulled)
        reaction = jp.loaded(pulled, exact=False).reaction.values[:, 0, :2]
        turned = np.unwrap(np.arctan2(reaction[:, 1], reaction[:, 0]))
        speed = np.gradient(turned, pulled.motion.times)
        size = np.linalg.norm(reaction, axis=1)
        expected = np.abs(speed) * np.sqrt(0.7 * 0.02e-3 / size)
        found = contact_rates(pulled, at, pulled.motion)[0][:, 0]
        # The largest near each configuration, which is that there where it changes little.
        assert found[3:-3] == pytest.approx(expected[3:-3], rel=0.2)

    def test_a_ball_in_space(self) -> None:
        """The rod's balls of the crank in space carry what pinocchio finds; the rate is that of their reactions."""
        m = RSSP.with_(
            {
                "drives.crank.values": None,
                "drives.crank.from": 20,
                "drives.crank.to": 80,
                "drives.crank.count": 61,
                "drives.crank.acceleration": None,
            }
        )
        result = jp.loaded(m, exact=False)
        reaction = result.reaction.sel(joint="B").values[:, :3]
        turning = np.gradient(reaction, result.time.values, axis=0)
        size = np.linalg.norm(reaction, axis=1)
        theta = np.linalg.norm(np.cross(reaction, turning), axis=1) / size**2
        rate = result.contact_rate.sel(source="B").values
        mass = (rate / theta) ** 2 * size / 0.015e-3
        # The mass behind the gap is that of bodies that move: between parts of the rod and of everything.
        assert (mass > 0.05).all()
        assert (mass < 5.0).all()
        assert result.contact_rate.sel(source="guide").isnull().all(), "a guide is not judged"

    def test_what_has_no_mass_follows(self) -> None:
        m = SLIDER_CRANK.with_({"bodies.rod": None, "bodies.crank": None})
        assert (jp.loaded(m).contact_rate.sel(source="pin") >= 0.0).all()


#: the slider-crank with play in its wrist, where a tendon of limited length holds pin and hole together
TENDON = """<mujoco><option gravity="0 -9.81 0" timestep="2e-6" integrator="implicitfast"/>
<compiler angle="radian"/><worldbody>
<body><joint axis="0 0 1" armature="1e3"/>
  <inertial pos=".015 0 0" mass=".8" diaginertia="9e-4 9e-4 9e-4"/>
  <body pos=".04 0 0"><joint axis="0 0 1"/><inertial pos=".05 .004 0" mass=".5" diaginertia="8e-4 8e-4 8e-4"/>
    <site name="pin" pos=".12 0 0"/></body></body>
<body pos="0 -.01 0"><joint type="slide" axis="1 0 0"/>
  <inertial pos=".005 -.003 0" mass="1.2" diaginertia="6e-4 6e-4 6e-4"/><site name="hole"/></body>
</worldbody><tendon><spatial limited="true" range="0 2e-5" solreflimit="1e-5 1" solimplimit=".999 .9999 1e-7">
<site site="pin"/><site site="hole"/></spatial></tendon></mujoco>"""


FOUR_BAR = planar(turning_speed="rad/s")
FOUR_BAR.revolute("A", ground=(0, 0), crank=(0, 0))
FOUR_BAR.revolute("B", crank=(30, 0), coupler=(0, 0))
FOUR_BAR.revolute("C", coupler=(110, 0), rocker=(80, 0), clearance=jp.radial(0.02))
FOUR_BAR.revolute("D", ground=(100, 0), rocker=(0, 0))
FOUR_BAR.start("crank", angle=0)
FOUR_BAR.start("coupler", angle=46)
FOUR_BAR.start("rocker", angle=85)
FOUR_BAR.drive("q", joint="A", values=(60, 100, 140, 180, 220, 260, 300, 340), speed=30)
FOUR_BAR.load(body="rocker", moment=20000)
FOUR_BAR.output(body="coupler", at=(50, 20))
FOUR_BAR.body("coupler", mass=0.5, centre=(50, 5), rotational_inertia=800)
FOUR_BAR.body("rocker", mass=1, centre=(40, 0), rotational_inertia=900)
FOUR_BAR_TENDON = """<mujoco><option gravity="0 0 0" timestep="4e-6" integrator="implicitfast"/>
<compiler angle="radian"/><worldbody>
<body><joint axis="0 0 1" armature="1e3"/><inertial pos="0 0 0" mass=".1" diaginertia="1e-6 1e-6 1e-6"/>
  <body pos=".03 0 0"><joint axis="0 0 1"/><inertial pos=".05 .005 0" mass=".5" diaginertia="8e-4 8e-4 8e-4"/>
    <site name="pin" pos=".11 0 0"/></body></body>
<body pos=".1 0 0"><joint axis="0 0 1" name="rocker"/>
  <inertial pos=".04 0 0" mass="1" diaginertia="9e-4 9e-4 9e-4"/><site name="hole" pos=".08 0 0"/></body>
</worldbody><tendon><spatial limited="true" range="0 2e-5" solreflimit="1e-5 1" solimplimit=".999 .9999 1e-7">
<site site="pin"/><site site="hole"/></spatial></tendon>
<actuator><general joint="rocker" biastype="affine" biasprm="20 0 0" gainprm="0"/></actuator></mujoco>"""


class TestMuJoCo:
    """The motion itself, with contact and time: where contact follows the pin lies where `loaded` has it."""

    def test_the_pin_follows_its_reaction(self) -> None:
        """At 50 rad/s the contact rate is 0.004; the pin is pressed to the wall, within a degree of the reaction."""
        gaps, angles = swung(50.0)
        result = jp.loaded(turning(50.0))
        assert result.contact_rate.max() < 0.01
        size = np.linalg.norm(gaps, axis=1)
        assert size == pytest.approx(2e-5, rel=1e-3)
        for angle, offset in zip(np.radians(result.crank.values), result.offset.values, strict=True):
            # The mean over ten degrees, in which the pin swings several times: nothing damps what the start left.
            near = np.abs(angles - angle) < np.radians(5.0)
            mean = gaps[near].mean(axis=0)
            turn = np.angle((mean[0] + 1j * mean[1]) / (offset[0] + 1j * offset[1]))
            assert abs(np.degrees(turn)) < 1.0, np.degrees(angle)

    def test_it_leaves_the_wall_where_contact_may_be_lost(self) -> None:
        """At 65 rad/s the gap opens at 334 degrees, after the reaction has passed near zero between 320 and 330."""
        gaps, angles = swung(65.0, start=180.0)
        size = np.linalg.norm(gaps, axis=1)
        open_ = np.degrees(angles[size < 0.98 * 2e-5])
        result = jp.loaded(turning(65.0))
        doubtful = result.crank.values[result.contact.values[:, 0] != "follows"]
        assert doubtful.tolist() == [30, 40, 320, 330]
        assert 320 < open_.min() < 340

    def test_the_pin_of_a_four_bar_follows(self) -> None:
        """A crank-rocker with a heavy rocker and play between coupler and rocker."""
        m = FOUR_BAR.mechanism()
        result = jp.loaded(m)
        assert result.contact_rate.max() < 0.1
        model = mujoco.MjModel.from_xml_string(FOUR_BAR_TENDON)
        data = mujoco.MjData(model)
        # The rocker's turn and the coupler's at a crank angle of zero: two circles about its pins.
        start = jp.solve(m.with_({"drives.q.values": [0.0], "drives.q.speed": 30.0}))
        turn = np.radians(start.pose.sel(component="angle")[0])
        crank, coupler, rocker = (float(turn.sel(body=name)) for name in ("crank", "coupler", "rocker"))
        by_angles = np.array(
            [[-0.11 * np.sin(coupler), 0.08 * np.sin(rocker)], [0.11 * np.cos(coupler), -0.08 * np.cos(rocker)]]
        )
        rates = np.linalg.solve(by_angles, [0.0, -30.0 * 0.03])
        # The pin begins where it is pressed.
        pressed = jp.loaded(m.with_({"drives.q.values": [0.0]})).offset.values[0] * 1e-3
        turned = np.linalg.solve(by_angles, -pressed)
        coupler, rocker = coupler + turned[0], rocker + turned[1]
        data.qpos[:] = [crank, coupler - crank, rocker]
        data.qvel[:] = [30.0, rates[0] - 30.0, rates[1]]
        gaps, angles = [], []
        for _ in range(round(2.0 * math.pi / 30.0 / model.opt.timestep)):
            mujoco.mj_step(model, data)
            gaps.append(data.site("hole").xpos[:2] - data.site("pin").xpos[:2])
            angles.append(data.qpos[0])
        measured, angles_ = np.array(gaps), np.array(angles)
        assert np.linalg.norm(measured, axis=1) == pytest.approx(2e-5, rel=1e-2)
        for angle, offset in zip(np.radians(result.q.values), result.offset.values, strict=True):
            near = np.abs(angles_ - angle) < np.radians(5.0)
            mean = measured[near].mean(axis=0)
            side = np.angle((mean[0] + 1j * mean[1]) / (offset[0] + 1j * offset[1]))
            assert abs(np.degrees(side)) < 3.0, np.degrees(angle)


def turning(speed: float) -> jp.Mechanism:
    rest = {f"joints.{j}.clearance": None for j in ("shaft", "pin", "guide")}
    turn = {"drives.crank.values": None, "drives.crank.from": 20, "drives.crank.to": 350, "drives.crank.count": 34}
    turn |= {"drives.crank.speed": speed, "drives.crank.acceleration": None, "loads": [{"force": [-200, 0]}]}
    return SLIDER_CRANK.with_(rest | turn)


def swung(speed: float, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Gap of the wrist over a turn, and the angle of the crank."""
    model = mujoco.MjModel.from_xml_string(TENDON)
    data = mujoco.MjData(model)
    q = math.radians(start)
    rod = math.asin((-0.01 - 0.04 * math.sin(q)) / 0.12)
    rate = -0.04 * math.cos(q) * speed / (0.12 * math.cos(rod))
    along = -0.04 * math.sin(q) * speed - 0.12 * math.sin(rod) * rate
    data.qpos[:] = [q, rod - q, 0.04 * math.cos(q) + 0.12 * math.cos(rod) - 2e-5]
    data.qvel[:] = [speed, rate - speed, along]
    data.qfrc_applied[2] = -200.0
    gaps, angles = [], []
    for _ in range(round((2 * math.pi - q) / speed / model.opt.timestep)):
        mujoco.mj_step(model, data)
        gaps.append(data.site("hole").xpos[:2] - data.site("pin").xpos[:2])
        angles.append(data.qpos[0])
    return np.array(gaps), np.array(angles)


class TestSaid:
    """What is said of it."""

    def test_the_answer_names_the_speed_and_what_is_left_out(self, capsys: pytest.CaptureFixture[str]) -> None:
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset

        m = jp.loads(examples.text("press-running"))
        texts = [sentence.text for sentence in conclude(from_dataset(jp.loaded(m))).sentences]
        assert any(
            text.startswith("Contact follows the reactions: contact rate at most 0.086, in main") for text in texts
        )
        assert (
            "Quasi-static at crank 200 1/min: inertia acts at the nominal motion; impacts and vibrations are left out."
            in texts
        )
        fast = conclude(from_dataset(jp.loaded(m.with_({"drives.crank.speed": 1000})))).sentences
        (alarm,) = [sentence for sentence in fast if "Contact is lost" in sentence.text]
        assert alarm.is_alarm
        assert "goes through zero near configuration" in alarm.text
        assert "ms or more" in alarm.text

    def test_a_sweep_says_where_contact_may_be_lost(self) -> None:
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset
        from jointplay.result.table import tables

        m = jp.loads(examples.text("press-running")).with_({"limits": None})
        swept = from_dataset(jp.sweep(m, "drives.crank.speed", [200, 1000], question="loaded"))
        (alarm,) = [sentence for sentence in conclude(swept).sentences if "Contact" in sentence.text]
        assert alarm.text == "Contact may be lost at 1 of 2 values, first at speed = 1000 1/min."
        assert alarm.is_alarm
        loose = np.isin(swept.get("contact"), ["may be lost", "lost"]).any(axis=2).sum(axis=1)
        (cells,) = [column.cells for column in tables(swept)[0].columns if column.name == "contact may\nbe lost"]
        assert cells == tuple(map(str, loose.tolist()))

    def test_no_answer_holds_where_contact_is_lost(self) -> None:
        """Corrected drives of a press at 1,000 1/min were said to hold the limits, and nothing of lost contact."""
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset

        slow = jp.loads(examples.text("press-running")).with_({"limits.probability": 0.9})
        for m, is_held in ((slow, True), (slow.with_({"drives.crank.speed": 1000}), False)):
            for result in (
                jp.compensate(m),
                jp.random(m, samples=500, contact="loaded"),
                jp.random(m, samples=500),
                jp.life(m, "loaded", cycles=0),
                jp.allow(m, "loaded"),
            ):
                said = conclude(from_dataset(result)).sentences
                assert said[0].state == ("held" if is_held else "not shown"), said[0]
                assert (
                    is_held or "contact is lost in main near" in said[0].text or "contact may be lost" in said[0].text
                )

    def test_the_same_contact_is_judged_of_all_answers(self) -> None:
        """Each question judges the clearances of middle size at the nominal motion, life those that have grown."""
        m = jp.loads(examples.text("press-running")).with_({"drives.crank.speed": 600})
        known = jp.loaded(m, details=False)
        np.testing.assert_array_equal(jp.compensate(m).contact_rate, known.contact_rate)
        both = jp.random(m, samples=16)
        rank = [np.isin(known.contact, word).any(axis=-1) for word in ("may be lost", "lost")]
        words = np.select([rank[1], rank[0]], ["lost", "may be lost"], "follows")
        assert both.contact_loaded.values.tolist() == words.tolist()
        assert jp.allow(m, "loaded").contact_rate == known.contact_rate.max()
        worn = jp.life(m)
        grown = {
            f"joints.{name}.clearance.radial": float(worn.size_worn.sel(source=name)) for name in ("main", "wristpin")
        }
        grown["joints.crankpin.clearance.radial"] = float(worn.size_worn.sel(source="crankpin"))
        assert worn.contact_rate.item() == pytest.approx(jp.loaded(m.with_(grown)).contact_rate.max().item(), rel=1e-9)
        assert worn.contact_rate > known.contact_rate.max()

    def test_nodes_where_contact_may_be_lost_are_not_said_to_hold(self) -> None:
        """A map of a press at 1,000 1/min had its limits held at all nodes, with lost contact beside them."""
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset

        text = re.sub(r"force = \[\n.*?\n\]", "force = [0, 100]", examples.text("press-running"), flags=re.S)
        m, grid = jp.loads(text).with_({"drives.crank.speed": 1000}), {"crank": [95, 155, 333, 336]}
        result = jp.map(m, "loaded", grid=grid)
        loose = np.isin(result.contact, ["lost", "may be lost"]).any(axis=-1)
        assert loose[:2].tolist() == [False, False]
        assert loose[2:].any()
        first, *rest = [sentence.text for sentence in conclude(from_dataset(result)).sentences]
        assert first.startswith("Not shown: whether limits hold at ")
        assert any(text.startswith("Quasi-static at crank 1000 1/min") for text in rest)

    def test_a_machine_at_rest_says_nothing_of_it(self) -> None:
        from jointplay.result.conclusions import conclude
        from jointplay.result.dataset import from_dataset

        found = conclude(from_dataset(jp.loaded(jp.loads(examples.text("slider-crank")))))
        assert not any("Quasi-static" in sentence.text for sentence in found.sentences)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drives.q.motion": "poly5"}, "follows from one of speed, motion, times; here: speed, motion"),
        ({"drives.q.speed": None, "drives.q.acceleration": 3}, "'acceleration' goes with speed"),
        ({"drives.q.duration": 3}, "'duration' goes with motion"),
        ({"drives.q.speed": None, "drives.q.motion": "poly5"}, "'duration' is missing"),
        ({"drives.q.speed": None, "drives.q.motion": "poly7"}, "trapezoid"),
        (
            {"drives.q.speed": None, "drives.q.motion": "poly5", "drives.q.duration": 1, "drives.q.ramp": 0.2},
            "'ramp' goes with motion",
        ),
        ({"drives.q.speed": [1, 2]}, "2 values for 25 configurations"),
        ({"drives.q.speed": None, "drives.q.motion": "poly5", "drives.q.duration": 1e-300}, "at least 1e-09"),
        ({"drives.q.time": "t"}, "'time' goes with csv"),
        ({"drives.q.times": [1, 2, 3]}, "here: speed, times"),
        ({"drives.q.times": [1, 2, 3], "drives.q.speed": None}, "'times' goes with values"),
        ({"bodies.wheel.rotational_inertia": -1}, "must not be negative"),
        ({"bodies.wheel.inertia": 900}, "rotational_inertia"),
        ({"units.turning_speed": "rpm"}, "1/min"),
        (
            {"path": {"x": [30]}, "drives.q.from": None, "drives.q.to": None, "drives.q.count": None},
            "a path has no speed",
        ),
    ],
)
def test_messages(changes: dict[str, object], message: str) -> None:
    with pytest.raises(jp.InputError) as caught:
        jp.Mechanism(WHEEL.raw, "wheel.toml").with_(changes)
    assert message in str(caught.value)
    assert str(caught.value).startswith("wheel.toml: ")


@pytest.mark.parametrize(
    ("moments", "message"),
    [
        ([1, 2, 4], "no body has one that is larger than the two others together"),
        ([1, 2, 2, 3, 0, 0], "negative principal moment"),
        ([1, 2], "3"),
        ([1, 2, 2, 0], r"[Ixx, Iyy, Izz, Ixy, Ixz, Iyz] is needed"),
        (5, "list"),
    ],
)
def test_moments_of_inertia_that_no_body_has(moments: object, message: str) -> None:
    with pytest.raises(jp.InputError) as caught:
        jp.Mechanism(RSSP.raw, "rssp.toml").with_({"bodies.rod.rotational_inertia": moments})
    assert message in str(caught.value)
    assert "bodies.rod.rotational_inertia" in str(caught.value)


def test_a_rod_that_inertia_turns_about_its_line_is_named() -> None:
    """Its products of inertia, or a centre of mass beside the line, turn a rod between two balls."""
    for key, value in (("rotational_inertia", [50, 800, 790]), ("centre", [50, 1, 0])):
        with pytest.raises(jp.InputError, match=f"bodies.rod.{key} turns it"):
            jp.loaded(RSSP.with_({f"bodies.rod.{key}": value, "gravity": None}))
    still = RSSP.with_({"drives.crank.speed": None, "drives.crank.acceleration": None, "gravity": None})
    assert (jp.loaded(still.with_({"bodies.rod.centre": [50, 1, 0]})).status == "ok").all()


def test_limits_are_not_said_to_hold_where_contact_may_be_lost() -> None:
    """A press at 1,000 1/min was told that its limits hold, and then that the pin is elsewhere."""
    m = jp.loads(examples.text("press-running"))
    held, loose = (verdict(loaded.compute(m.with_({"drives.crank.speed": speed}))) for speed in (200, 1000))
    assert held.outcome == HELD
    assert loose.outcome == NOT_SHOWN
    assert loose.gist.startswith("contact may be lost near ")


def test_an_acceleration_is_in_the_angle_unit_whatever_the_unit_of_speeds_is() -> None:
    """Its description did not say so, and a speed beside it is in turns per minute."""
    torques = []
    for unit in ("deg/s", "rad/s", "1/min"):
        b = planar(turning_speed=unit)
        b.revolute("pivot", ground=(0, 0), arm=(0, 0))
        b.body("arm", mass=1.0, centre=(100, 0))
        b.drive("q", joint="pivot", values=[0], speed=0, acceleration=180)
        b.output(body="arm", at=(200, 0))
        torques.append(jp.loaded(b.mechanism()).drive_torque.item())
    # m r^2 alpha, in N mm.
    assert torques == pytest.approx([1.0 * 0.1**2 * np.pi * 1e3] * 3, rel=1e-9)
    told = re.findall(r"how fast that changes, in [^,]*", json.dumps(json_schema()))
    assert told
    assert all(words.endswith("units.angle per second squared") for words in told)
