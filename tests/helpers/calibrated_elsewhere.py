"""An arm whose deviations are planted, and what other packages find of them from the same readings, without priors."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

import jointplay as jp
from jointplay.analyses.nominal import at_drives

from .built import MACHINES
from .denavit import rows_of

JOINTS = ("waist", "shoulder", "elbow", "roll", "pitch", "flange")
#: standard deviation of the readings, mm
NOISE = 0.01
#: the elbow is parallel to the shoulder, so that a shift along one axis does what one along the other does
FIXED = "L2.d"


@dataclass(frozen=True)
class PlantedArm:
    """The mechanism, a table of places of its tool, and what was planted, in millimetres and degrees."""

    m: jp.Mechanism
    drives: np.ndarray
    table: dict[str, Any]
    planted: dict[str, float]


def planted_arm(seed: int, noise: float = NOISE) -> PlantedArm:
    """A six-axis arm with deviations of a tenth of a millimetre and a twentieth of a degree, at 48 poses."""
    machine, rng = MACHINES["6r"](), np.random.default_rng(seed)
    m = machine.m.with_({"joints.*.clearance": None})
    drives = np.concatenate([machine.drives, machine.drives[::-1] + 0.3 * rng.standard_normal(machine.drives.shape)])
    u, planted = m.centre.copy(), {}
    for k, name in enumerate(m.sources):
        if name.startswith("L") and name != FIXED:
            planted[name] = float(rng.standard_normal()) * (0.1 if name[-2:] in (".a", ".d") else 0.05)
            (parameter,) = np.flatnonzero(m.parameter_source == k)
            u[parameter] = planted[name] * m.parameter_factors[parameter]
    at = at_drives(m, drives)
    errors = [m.core.errors_of(at.drives[k : k + 1], at.poses[k : k + 1], u[None])[0] for k in range(len(at))]
    places = (at.output + errors)[:, :3] / m.units.length + noise * rng.standard_normal((len(at), 3))
    table: dict[str, Any] = {name: np.degrees(drives[:, k]) for k, name in enumerate(m.drives)}
    return PlantedArm(m, drives, table | dict(zip("xyz", places.T, strict=True)), planted)


def by_robotkinecal(arm: PlantedArm, others: np.ndarray) -> tuple[np.ndarray, float]:
    """Places at other drive values, mm, after its fit, and by how much its kinematics differ at the drawing.

    It knows an arm by the screws of its axes, and corrects all of them and the tool.
    """
    from roboticstoolbox import PoERevolute, PoERobot
    from robotkinecal import SerialRobotKineCal
    from spatialmath import SE3

    m, unit = arm.m, arm.m.units.length
    at = unit * np.array([m.value(f"joints.{name}.at") for name in JOINTS], dtype=float)
    axes = np.array([m.value(f"joints.{name}.axis") for name in JOINTS], dtype=float)
    tool = SE3.Trans(at_drives(m, np.zeros((1, len(JOINTS)))).output[0, :3])
    fit = SerialRobotKineCal(PoERobot([*map(PoERevolute, axes, at)], tool))
    # Later versions of the toolbox count the tool as a joint.
    fit.joint_screw_axis = [np.r_[np.cross(place, axis), axis] for place, axis in zip(at, axes, strict=True)]
    fit.N_JOINTS, fit.zero_conf_EE_pose = len(JOINTS), tool

    def places(drives: np.ndarray) -> np.ndarray:
        return np.array([fit.forward_kinematics(len(JOINTS) + 1, q).t for q in drives]) / unit

    apart = np.abs(places(arm.drives) - at_drives(m, arm.drives).output[:, :3] / unit).max()
    fit.set_observations([*arm.drives], [*(unit * np.column_stack([arm.table[axis] for axis in "xyz"]))])
    # It ends where a step is small, not where none is left.
    for _ in range(5):
        fit.solve()
    return places(others), float(apart)


def by_pybotics(arm: PlantedArm) -> tuple[dict[str, float], np.ndarray, float]:
    """Deviations by name, residuals in millimetres, and by how much its kinematics differ at the drawing.

    Its chain, its mask of what is free, and the optimiser of its examples, on all coordinates of the places.
    """
    from pybotics.kinematic_chain import MDHKinematicChain
    from pybotics.optimization import OptimizationHandler
    from pybotics.robot import Robot

    drawn = at_drives(arm.m, np.zeros((1, len(JOINTS)))).output[0, :3] / arm.m.units.length
    rows, base, tool = rows_of(arm.m, JOINTS, drawn)
    robot = Robot(MDHKinematicChain.from_parameters(rows.ravel()))
    robot.world_frame, robot.tool.matrix = base, tool
    reached = np.array([robot.fk(q)[:3, 3] for q in arm.drives])
    apart = np.abs(reached - at_drives(arm.m, arm.drives).output[:, :3] / arm.m.units.length).max()
    # Link k turns and shifts about axis k, then along and about the normal to axis k + 1.
    names = [[f"L{k}.alpha", f"L{k}.a", f"L{k + 1}.theta", f"L{k + 1}.d"] for k in range(len(JOINTS))]
    mask = np.array([[name in arm.planted for name in row] for row in names])
    handler = OptimizationHandler(robot, kinematic_chain_mask=mask.ravel())
    places = np.column_stack([arm.table[axis] for axis in "xyz"])

    def missed(x: np.ndarray) -> np.ndarray:
        handler.apply_optimization_vector(x)
        return np.concatenate([place - handler.robot.fk(q)[:3, 3] for place, q in zip(places, arm.drives, strict=True)])

    start = handler.generate_optimization_vector()
    found = least_squares(missed, start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    free = np.array(names)[mask].tolist()
    values = {
        name: float(np.degrees(value) if name.endswith(("alpha", "theta")) else value)
        for name, value in zip(free, found.x - start, strict=True)
    }
    return values, missed(found.x).reshape(-1, 3), float(apart)
