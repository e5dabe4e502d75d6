"""Friction for random mechanisms, and equilibrium of every body by forces at points of contact.

Nothing here knows how joints with friction are solved: from poses, offsets and reactions the points follow where
something touches, and the forces there are judged by Coulomb's law.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

import jointplay as jp
from helpers.builders import spatial
from helpers.rods import rod_and_slider
from helpers.slider_crank import slider_crank
from jointplay.analyses import friction
from jointplay.analyses.displaced import at_offsets
from jointplay.analyses.nominal import nominal
from jointplay.basics import poses

#: change of the drives by which the directions of motion are found
STEP = 1e-5
#: forces below this part of the largest are none, and touch nowhere
NONE = 1e-9

#: the mechanism with reference values of friction
SLIDER_CRANK = slider_crank(
    {
        "shaft": {"friction": {"coefficient": 0.1, "diameter": 24}},
        "pin": {"friction": {"coefficient": 0.1, "diameter": 20}},
        "wrist": {"friction": {"coefficient": 0.1, "diameter": 16}},
        "guide": {"friction": {"coefficient": 0.1, "height": 30}},
    },
    drive="q",
).mechanism()

BALL = {"coefficient": 0.1, "diameter": 18}
#: the same in space, with a rod between two balls
RSSP = (
    rod_and_slider("q", spatial())
    .mechanism()
    .with_(
        {
            "joints.shaft.friction": {"coefficient": 0.1, "diameter": 24, "collar": 28},
            "joints.A.friction": BALL,
            "joints.B.friction": BALL,
            "joints.guide.friction": 0.1,
            "start.crank": {"rotation": [0, 0, 30]},
        }
    )
)


def with_friction(m: jp.Mechanism, seed: int, most: float = 0.3) -> jp.Mechanism:
    """The mechanism with random friction in all of its joints."""
    rng = np.random.default_rng([37, seed])
    changes: dict[str, Any] = {}
    for name, joint in m.raw["joints"].items():
        given: dict[str, float] = {"coefficient": float(rng.uniform(0.0, most))}
        if joint["type"] == "revolute":
            given["diameter"] = m.length / m.units.length * float(rng.uniform(0.05, 0.2))
        elif joint["type"] == "prismatic":
            given["height"] = m.length / m.units.length * float(rng.uniform(0.0, 0.5))
            if "clearance" not in joint:
                given["length"] = m.length / m.units.length * float(rng.uniform(0.5, 1.0))
        changes[f"joints.{name}.friction"] = given
    return m.with_(changes)


@dataclass
class Contacts:
    """What was found at the points of contact of a mechanism in one configuration."""

    #: largest force or moment that is left on a body, as a part of the largest force
    unbalanced: float
    #: of every contact tangential over normal force, less its coefficient
    ratio: list[float]
    #: of every contact cosine of friction and sliding speed
    along: list[float]
    #: of every contact the part of its normal force that pulls
    pulling: list[float]


def contacts(m: jp.Mechanism, sign: float) -> Contacts:
    """Forces at the points of contact of a planar mechanism without weight, coming from one side, SI."""
    result = jp.loaded(m, approach="forward" if sign > 0.0 else "backward").isel(configuration=0)
    unit, force = m.units.length, m.units.force
    at = nominal(m)
    u = result.offset.values[None]
    placed = at_offsets(m, at, u)
    origin = {k: poses.position(placed.poses[0, k]) for k in range(len(m.bodies))} | {-1: np.zeros(3)}
    turn = {k: poses.matrix(placed.poses[0, k]) for k in range(len(m.bodies))} | {-1: np.eye(3)}
    at_points = placed.points[0]
    units = np.array([1.0 if m.coordinate_kind(joint) == "angle" else m.length for joint in m.drive_joints])
    moved = [m.core.trace(at.drives + k * STEP * units) for k in (-sign, sign)]
    rates = {}
    for k in range(len(m.bodies)):
        ends = [end["poses"][0, k] for end in moved]
        rates[k] = (poses.position(ends[1]) - poses.position(ends[0]), ends[1][2] - ends[0][2])
    rates[-1] = (np.zeros(3), 0.0)
    nominal_origin = {k: poses.position(at.poses[0, k]) for k in range(len(m.bodies))} | {-1: np.zeros(3)}
    torque = dict(zip(m.drives, result.drive_torque.values, strict=True))
    left = {k: np.zeros(6) for k in (-1, *range(len(m.bodies)))}
    largest, most = 0.0, float(np.abs(result.reaction.sel(wrench=["fx", "fy"])).max()) * force
    ratio, along, pulling = [], [], []

    def push(body: int, where: np.ndarray, what: np.ndarray, moment: float = 0.0) -> None:
        nonlocal largest
        left[body][:3] += what
        left[body][3:] += np.cross(where - origin[body], what) + np.array([0.0, 0.0, moment])
        largest = max(largest, float(np.linalg.norm(what)))

    for load in m.core_spec["loads"]:
        body = m.points[load["point"]].body
        where = origin[body] + turn[body] @ at_points[load["point"]]
        push(body, where, np.array(load["force"]), load["moment"][2])
    for j, name in enumerate(m.joints):
        p1, p2 = m.joint_points[j]
        first, second = m.points[p1].body, m.points[p2].body
        hole = origin[second] + turn[second] @ at_points[p2]
        pin = origin[first] + turn[first] @ at_points[p1]
        fx, fy, moment = result.reaction.values[j]
        pressed = np.array([fx, fy, 0.0]) * force
        moment = moment * force * unit
        axis = turn[first] @ np.array(m.core_spec["joints"][j]["axis_first"])
        entry = m.data.joints[name].friction
        sliding = _sliding(m, at, nominal_origin, rates, j)
        drive = next((d for d, own in zip(m.drives, m.drive_joints, strict=True) if own == j), None)
        if drive is not None:
            value = torque[drive]
            if m.joint_kinds[j] == "revolute":
                moment -= value * force * unit
                push(second, hole, np.zeros(3), value * force * unit)
                push(first, hole, np.zeros(3), -value * force * unit)
            else:
                pressed = pressed - value * force * axis
                push(second, hole, value * force * axis)
                push(first, hole, -value * force * axis)
        mu = entry.coefficient
        if m.joint_kinds[j] == "revolute":
            radius = entry.diameter * unit / 2.0
            # The line of force through the point of contact has this moment about the hole's centre.
            size = float(np.linalg.norm(pressed))
            if size <= NONE * most:
                continue
            # C - P2 = -radius n; the force is -N n + T t.
            d = hole - pin
            n = d / np.linalg.norm(d) if np.linalg.norm(d) > NONE * m.length else _normal(pressed, moment / radius)
            contact = hole - radius * n
            push(second, contact, pressed)
            push(first, contact, -pressed)
            ratio.append(abs(moment / size / radius) - (np.sin(np.arctan(mu)) if sliding else 0.0))
            left[second][5] += moment - np.cross(contact - hole, pressed)[2]
            left[first][5] -= moment - np.cross(contact - hole, pressed)[2]
            normal = -float(pressed @ n)
            pulling.append(max(-normal / size, 0.0))
            tangent = pressed + normal * n
            if mu and sliding and np.linalg.norm(tangent) > 1e-9 * size:
                # The hole's wall moves at the contact by the turning of the second body about the first.
                speed = sliding * np.cross([0.0, 0.0, 1.0], contact - hole)
                along.append(float(tangent @ speed) / np.linalg.norm(tangent) / np.linalg.norm(speed))
            continue
        across = np.cross([0.0, 0.0, 1.0], axis)
        f_n, f_t = float(pressed @ across), float(pressed @ axis)
        s = np.sign(sliding)
        if m.joint_kinds[j] == "pin_in_slot":
            push(second, hole, pressed)
            push(first, hole, -pressed)
            ratio.append((f_t + s * mu * abs(f_n)) / max(abs(f_n), 1e-300) if f_n else 0.0)
            continue
        play = m.data.joints[name].clearance
        length = (play.length if play is not None else entry.length) * unit
        height = entry.height * unit
        # Normal forces by which the slider presses up at both ends, with friction at the faces.
        face = mu * s * height / 2
        both = np.linalg.solve([[-1.0, -1.0], [face - length / 2, face + length / 2]], [f_n, moment])
        total = 0.0
        for end, normal in zip((1.0, -1.0), both, strict=True):
            where = hole + end * length / 2 * axis + np.sign(normal) * height / 2 * across
            what = -normal * across - s * mu * abs(normal) * axis
            total -= s * mu * abs(normal)
            push(second, where, what)
            push(first, where, -what)
        ratio.append((f_t - total) / max(np.abs(both).sum(), 1e-300) if np.abs(both).sum() else 0.0)
        if play is not None:
            names = [f"{name}.normal", f"{name}.angle"]
            shift, tilt = (float(u[0, m.parameters.index(p)]) for p in names)
            tilt = tilt * m.units.angle / unit
            gap = play.gap
            for end, normal in zip((1.0, -1.0), both, strict=True):
                offset = shift + end * tilt * length / 2
                pulling.append(abs(offset - np.sign(normal) * gap) / gap if abs(normal) > NONE * most else 0.0)
    arm = m.length
    worst = max(max(np.abs(left[k][:3]).max(), np.abs(left[k][3:]).max() / arm) for k in range(len(m.bodies)))
    return Contacts(worst / largest if largest else 0.0, ratio, along, pulling)


def _normal(force: np.ndarray, lever: float) -> np.ndarray:
    """Where a pin without play touches: -n x F has this moment over the radius."""
    size = float(np.linalg.norm(force))
    # With n turned by a from -F the product is |F| sin a.
    angle = np.arctan2(-force[1], -force[0]) + np.arcsin(np.clip(-lever / size, -1.0, 1.0))
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def _sliding(m: jp.Mechanism, at: Any, origin: dict[int, np.ndarray], rates: dict[int, Any], j: int) -> float:
    """Relative turn of a pin, or sliding of a slider, while the drives move by a step."""
    p1, p2 = m.joint_points[j]
    first, second = m.points[p1].body, m.points[p2].body
    if m.joint_kinds[j] == "revolute":
        return float(rates[second][1] - rates[first][1])
    matrix = {k: poses.matrix(at.poses[0, k]) for k in range(len(m.bodies))} | {-1: np.eye(3)}
    axis = matrix[first] @ np.array(m.core_spec["joints"][j]["axis_first"])

    def speed(point: int) -> np.ndarray:
        body = m.points[point].body
        arm = matrix[body] @ np.array(m.points[point].at)
        return rates[body][0] + rates[body][1] * np.cross([0.0, 0.0, 1.0], arm)

    return float((speed(p2) - speed(p1)) @ axis)


def powers(m: jp.Mechanism, approach: str) -> tuple[np.ndarray, np.ndarray]:
    """What friction takes from the drives, by equilibrium, and in the joints, at their speeds at nominal poses."""
    at = nominal(m)
    without = m.core.loaded(at.drives, at.poses, True, True, True, partly=True, loads=None)
    asked = friction.setting(m, at, None, without, "middle", None)
    state = friction.sliding(asked, approach)
    speeds = asked.speeds * friction.SIDES[approach]
    return ((state.found["drive_force"] - without["drive_force"]) * speeds).sum(axis=1), -state.friction.sum(axis=1)
