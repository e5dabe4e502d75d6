"""The machine as it runs: accelerations, inertia as loads, drive torques and powers, and whether contact follows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.graphs import graph
from helpers.longer import some
from helpers.oracles.moving import CutOpen, Part, differenced
from helpers.rods import RSSR
from jointplay import examples
from jointplay.analyses.nominal import nominal
from jointplay.analyses.running import contact_rates, moving
from jointplay.model.inertia import kinematics

#: examples that have drives
DRIVEN = [name for name in examples.names() if "[drives" in examples.text(name)]

SLIDER_CRANK = """
format = 1
space = "planar"
units = { length = "mm", angle = "deg", force = "N", turning_speed = "rad/s" }
gravity = [0, -9.81]
[joints.shaft]
type = "revolute"
on = { ground = [0, 0], crank = [0, 0] }
clearance = { radial = 0.02 }
[joints.pin]
type = "revolute"
on = { crank = [40, 0], rod = [0, 0] }
clearance = { radial = 0.02 }
[joints.wrist]
type = "revolute"
on = { rod = [120, 0], ram = [0, 0] }
clearance = { radial = 0.02 }
[joints.guide]
type = "prismatic"
on = { ground = { at = [0, -10], axis = [1, 0] }, ram = [0, 0] }
clearance = { gap = 0.03, length = 60 }
[start]
crank = { angle = 30 }
rod = { angle = -5 }
[drives.crank]
joint = "shaft"
values = [30, 75, 120]
speed = 50
acceleration = 17188.733853924696
[output]
body = "ram"
at = [50, -20]
[[loads]]
force = [-200, 30]
[bodies.crank]
mass = 0.8
centre = [15, 0]
rotational_inertia = 900
[bodies.rod]
mass = 0.5
centre = [50, 4]
rotational_inertia = 800
[bodies.ram]
mass = 1.2
centre = [5, -3]
rotational_inertia = 600
"""

#: a crank about z, a rod between two balls, a slider along x beside and below
RSSP = """
format = 1
space = "spatial"
units = { length = "mm", angle = "deg", force = "N", turning_speed = "rad/s" }
gravity = [0, 0, -9.81]
[joints.shaft]
type = "revolute"
on = { ground = { at = [0, 0, 0], axis = [0, 0, 1] }, crank = { at = [0, 0, 0], axis = [0, 0, 1] } }
clearance = { radial = 0.02, axial = 0.03, length = 30 }
[joints.A]
type = "spherical"
on = { crank = [40, 0, 10], rod = [0, 0, 0] }
clearance = { radial = 0.015 }
[joints.B]
type = "spherical"
on = { rod = [120, 0, 0], slider = [0, 0, 0] }
clearance = { radial = 0.015 }
[joints.guide]
type = "prismatic"
on.ground = { at = [0, 15, -30], axis = [1, 0, 0], side = [0, 1, 0] }
on.slider = { at = [0, 0, 0], axis = [1, 0, 0], side = [0, 1, 0] }
clearance = { gap = 0.03, length = 60, width = 30, height = 20 }
[start]
rod = { x = 34, y = 20, z = 10, rotation = [0, 20, 0] }
slider = { x = 150, y = 15, z = -30 }
[drives.crank]
joint = "shaft"
values = [30, 75]
speed = 50
acceleration = 17188.733853924696
[output]
body = "slider"
at = [50, -20, 10]
[[loads]]
force = [-200, 30, 40]
[bodies.crank]
mass = 0.8
centre = [15, 0, 4]
rotational_inertia = [700, 800, 900]
[bodies.rod]
mass = 0.5
centre = [50, 0, 0]
rotational_inertia = [0, 800, 800]
[bodies.slider]
mass = 1.2
centre = [5, -3, 2]
rotational_inertia = [500, 650, 600]
"""

#: a body on a pin, turned by a drive
WHEEL = """
format = 1
space = "planar"
units = { length = "mm", angle = "rad", force = "N" }
[joints.pin]
type = "revolute"
on = { ground = [0, 0], wheel = [0, 0] }
clearance = { radial = 0.02 }
[drives.q]
joint = "pin"
from = 0
to = 6
count = 25
speed = 80
[output]
body = "wheel"
at = [30, 0]
[bodies.wheel]
mass = 0.7
centre = [12, 0]
"""


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

    @pytest.mark.parametrize("seed", some(range(60), 8))
    def test_of_random_mechanisms(self, seed: int) -> None:
        m = jp.loads(graph(seed))
        at = nominal(m)
        check_differences(m, at.drives, at.poses, seed)

    def test_held_drives_move_nothing(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        at = nominal(m)
        still = kinematics(m, at.drives, at.poses, np.zeros((2, 1, 1)))
        assert not still.velocity.any()
        assert not still.acceleration.any()

    def test_at_a_singular_pose_there_is_no_motion(self) -> None:
        """At its dead centre a slider-crank that is driven by its slider moves either way."""
        m = jp.loads(SLIDER_CRANK).with_(
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
        m = jp.loads(SLIDER_CRANK)
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
            m = jp.loads(RSSP).with_({"bodies.rod.rotational_inertia": [about, 800, 800]})
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
        m = jp.loads(RSSP if ball else SLIDER_CRANK)
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
        m = jp.loads(SLIDER_CRANK)
        at = nominal(m)
        motion = moving(m, at)
        loads = [dict(m.raw["loads"][0])]
        for name, body in m.data.bodies.items():
            k = m.bodies.index(name)
            _, acceleration = motion.of_point(k, (*np.array(body.centre) * 1e-3, 0.0))
            force = -body.mass * acceleration[:, :2]
            moment = -body.rotational_inertia * acceleration[:, 5] * 1e-3
            loads.append(
                {"body": name, "at": [*body.centre], "force": force.tolist(), "moment": moment.tolist()}
            )
        rest = m.with_({"drives.crank.speed": None, "drives.crank.acceleration": None, "loads": loads})
        running, written = jp.loaded(m), jp.loaded(rest)
        assert "velocity" not in written
        for name in ("error", "reaction", "offset", "drive_torque", "undetermined"):
            assert running[name].values == pytest.approx(written[name].values, rel=1e-9, abs=1e-9), name

    @pytest.mark.parametrize("seed", some(range(40), 6))
    def test_power_balance_of_random_mechanisms(self, seed: int) -> None:
        """What drives and loads do is the change of kinetic energy, found from poses alone."""
        m = jp.loads(graph(seed))
        rng = np.random.default_rng([41, seed])
        speeds, accelerations = in_motion(m, seed)
        changes: dict[str, Any] = {"gravity": [0.4, -9.81]}
        units = [1.0 if m.coordinate_kind(j) == "angle" else m.units.length for j in m.drive_joints]
        turning = m.units.angle
        for k, drive in enumerate(m.drives):
            unit = turning if m.coordinate_kind(m.drive_joints[k]) == "angle" else units[k]
            changes |= {f"drives.{drive}.speed": speeds[0, k] / unit, f"drives.{drive}.acceleration": accelerations[0, k] / unit}
        for body in m.bodies:
            changes[f"bodies.{body}"] = {
                "mass": float(rng.uniform(0.2, 2)),
                "centre": rng.uniform(-50, 50, 2).tolist(),
                "rotational_inertia": float(rng.uniform(0, 4000)),
            }
        running = m.with_(changes)
        at = nominal(running)
        velocity, acceleration = differenced(running, at.drives, at.poses, speeds, accelerations)
        power = 0.0
        for inertial in running.loads.inertial:
            weight = running.loads.first[inertial.load]
            point = running.points[weight["point"]]
            v, a, w, turning = _of_centre(at.poses[0, point.body], point.at, velocity[point.body], acceleration[point.body])
            power += (inertial.mass * a - weight["force"]) @ v + inertial.matrix[2, 2] * turning * w
        for load in running.loads.first[: len(running.data.loads)]:
            point = running.points[load["point"]]
            v, _, w, _ = _of_centre(at.poses[0, point.body], point.at, velocity[point.body], acceleration[point.body])
            power -= np.array(load["force"]) @ v + load["moment"][2] * w
        result = jp.loaded(running, exact=False)
        scale = max(1e-3, float(np.abs(result.drive_power).max()))
        # Accelerations that are differenced are right to 1e-6 or so.
        assert float(result.drive_power.sum()) == pytest.approx(power, abs=1e-4 * scale)

    def test_energy_over_a_turn(self) -> None:
        """At constant speed the drive does no work over a turn against inertia and weight alone."""
        turn = {"drives.crank.values": None, "drives.crank.from": 0, "drives.crank.to": 360, "drives.crank.count": 721}
        m = jp.loads(SLIDER_CRANK).with_({**turn, "drives.crank.acceleration": None, "loads": None})
        result = jp.loaded(m, exact=False)
        power, time = result.drive_power.values[:, 0], result.time.values
        assert time[-1] == pytest.approx(2 * math.pi / 50)
        # The trapezoidal rule is exact for periodic functions as smooth as this one.
        assert abs(np.trapezoid(power, time)) < 1e-9 * np.trapezoid(np.abs(power), time)

    def test_a_rotor_takes_moment_of_the_motor_only(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        before, after = jp.loaded(m), jp.loaded(m.with_({"drives.crank.rotor_inertia": 2000}))
        assert (after.error == before.error).all()
        assert (after.drive_torque == before.drive_torque).all()
        # 2000 kg mm^2 times 300 rad/s^2 are 0.6 N m.
        assert (after.motor_torque - after.drive_torque).values == pytest.approx(600.0)
        assert after.drive_power.values == pytest.approx(after.motor_torque.values / 1e3 * 50.0)
        assert "motor_torque" not in before

    def test_elastic_bodies_are_pieces_that_move_together(self) -> None:
        """A body that gives way moves as a rigid one does nominally; its inertia bends it."""
        m = jp.loads(SLIDER_CRANK)
        elastic = m.with_({"bodies.rod.E": 2e5, "bodies.rod.area": 100, "bodies.rod.inertia": 800, "bodies.rod.centre": [50, 0]})
        rigid = m.with_({"bodies.rod.centre": [50, 0]})
        one, other = jp.loaded(rigid, exact=False), jp.loaded(elastic, exact=False)
        assert other.drive_torque.values == pytest.approx(one.drive_torque.values, rel=1e-6)
        assert np.abs(other.deformation).max() > 0.0
        assert "contact_rate" not in other, "judged of determinate mechanisms only"


def _of_centre(pose: np.ndarray, at: Any, velocity: np.ndarray, acceleration: np.ndarray) -> tuple[Any, ...]:
    """Velocity and acceleration of a point in the plane, and those of the angle."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    arm = np.array([c * at[0] - s * at[1], s * at[0] + c * at[1], 0.0])
    across = np.array([-arm[1], arm[0], 0.0])
    w, turning = velocity[5], acceleration[5]
    return velocity[:3] + w * across, acceleration[:3] + turning * across - w**2 * arm, w, turning


class TestAtRest:
    """Without speed everything is as it was."""

    @pytest.mark.parametrize("text", [SLIDER_CRANK, RSSP])
    def test_speed_zero_is_no_speed(self, text: str) -> None:
        m = jp.loads(text)
        still = m.with_({"drives.crank.speed": 0, "drives.crank.acceleration": None})
        plain = still.with_({"drives.crank.speed": None} | {f"bodies.{b}.rotational_inertia": None for b in m.bodies})
        one, other = jp.loaded(still), jp.loaded(plain)
        assert set(one) == set(other)
        for name in one:
            assert np.array_equal(one[name].values, other[name].values, equal_nan=one[name].dtype.kind == "f"), name
        assert "speeds" not in one.attrs

    def test_the_worst_case_does_not_depend_on_it(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        still = m.with_({"drives.crank.speed": None, "drives.crank.acceleration": None})
        for ask in (jp.worst, jp.solve):
            one, other = ask(m), ask(still)
            assert all(np.array_equal(one[n].values, other[n].values, equal_nan=one[n].dtype.kind == "f") for n in one)

    def test_a_machine_is_assembled_while_it_stands(self) -> None:
        m = jp.loads(examples.text("redundant-bar"))
        assert m.at_rest_under(0) is m

    def test_speed_alone_loads_nothing(self) -> None:
        m = jp.loads(WHEEL).with_({"bodies": None})
        with pytest.raises(jp.InputError, match="nothing loads the mechanism"):
            jp.loaded(m)
        result = jp.loaded(m.with_({"loads": [{"force": [0, -5]}]}))
        assert result.attrs["inertia"] == "none"
        assert result.velocity.values[0] == pytest.approx([0, 2400, 80])


class TestAsked:
    """What follows from the loads."""

    def test_specimens_that_do_not_scatter_are_where_the_load_has_them(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        exact = jp.loaded(m)
        scattered = jp.random(m, samples=16, contact="loaded")
        assert scattered.error_mean.values == pytest.approx(exact.error.values, abs=1e-12)
        assert scattered.attrs["speeds"] == exact.attrs["speeds"] == "crank 50 rad/s"

    def test_corrected_drives_bring_it_back_while_it_runs(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        result = jp.compensate(m)
        moved = m.with_({"drives.crank.values": result.drive_corrected.values[:, 0].tolist()})
        there = jp.loaded(moved).nominal.values[:, 0] + jp.loaded(moved).error.values[:, 0]
        # Of 0.05 to 0.09 mm; the inertia is that of the nominal motion, which moves with the drive by 1e-3 of itself.
        assert there == pytest.approx(jp.solve(m).nominal.values[:, 0], abs=1e-3)

    def test_a_map_has_the_errors_of_its_nodes(self) -> None:
        text = examples.text("serial-2r")
        m = jp.loads(text)
        one, other = m.drives
        changes: dict[str, Any] = {f"bodies.{body}": {"mass": 1 + k, "centre": [40, 5]} for k, body in enumerate(m.bodies)}
        changes |= {f"drives.{one}.speed": 300, f"drives.{other}.speed": -500}
        m = m.with_(changes)
        nodes = {one: {"from": 10, "to": 50, "count": 2}, other: {"from": 20, "to": 60, "count": 3}}
        found = jp.map(m, "loaded", grid=nodes)
        for i, p in enumerate((10, 50)):
            for k, q in enumerate((20, 40, 60)):
                alone = m.with_({f"drives.{d}.{key}": None for d in (one, other) for key in ("from", "to", "count")} | {f"drives.{one}.values": [p], f"drives.{other}.values": [q], "path": None})
                assert found.error.values[i, k] == pytest.approx(jp.loaded(alone).error.values[0], abs=1e-9)

    def test_a_map_needs_constant_speeds(self) -> None:
        m = jp.loads(SLIDER_CRANK).with_({"drives.crank.speed": [50, 60, 70]})
        with pytest.raises(jp.InputError, match="hold for its configurations only"):
            jp.map(m, "loaded", grid={"crank": {"from": 0, "to": 90, "count": 4}})

    def test_inertia_acts_in_every_load_case(self) -> None:
        m = jp.loads(SLIDER_CRANK)
        cases = m.with_({"loads": None, "load_cases": {"push": [{"body": "ram", "at": [50, -20], "force": [-200, 30]}], "free": [{"body": "ram", "force": [0, 0]}]}})
        found = jp.loaded(cases)
        alone = jp.loaded(m)
        assert found.error.sel(load_case="push").values == pytest.approx(alone.error.values, abs=1e-12)
        assert np.abs(found.error.sel(load_case="free") - found.error.sel(load_case="push")).max() > 1e-3

    def test_displaced_poses_are_those_of_the_machine_that_runs(self) -> None:
        from jointplay.analyses.displaced import under_load

        m = jp.loads(SLIDER_CRANK)
        at = nominal(m)
        moved = under_load(m, at)
        shift = m.core.output(moved.poses) - at.output
        assert shift[:, :2] * 1e3 == pytest.approx(PLANAR_ERRORS[:, :2], abs=1e-7)
