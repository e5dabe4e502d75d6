"""Worms, crossed helical, bevel and hypoid gears on fixed axes, as the text of their files."""

import math
from typing import Any

import numpy as np

UNITS = 'format = 1\nspace = "spatial"\nunits = { length = "mm", angle = "deg", force = "N" }\n'


def table(values: Any) -> str:
    return "[" + ", ".join(table(v) if isinstance(v, (list, tuple, np.ndarray)) else f"{v:.17g}" for v in values) + "]"


def pair(
    axes: Any,
    at: Any,
    mesh: str,
    *,
    torque: float = 0.0,
    bearing: str = "",
    values: str = "[0, 10, 300]",
    parts: tuple[str, str] = ("", ""),
) -> str:
    """Two wheels of fixed axes, the first driven, the second loaded; both drawn where they are."""
    names = ("first", "second")
    text = UNITS
    for name, axis, centre, part in zip(names, axes, at, parts, strict=True):
        text += f'[joints.{name[0]}]\ntype = "revolute"\nbodies = ["ground", "{name}"]\nat = {table(centre)}\n'
        text += f"axis = {table(axis)}\n{part or bearing}\n"
    text += f'[joints.m]\ntype = "crossed_gear"\nbodies = ["first", "second"]\nat = {table(at)}\naxes = {table(axes)}\n'
    text += f'{mesh}\n[drives.q]\njoint = "f"\nvalues = {values}\n[output]\nbody = "second"\nat = {table(at[1])}\n'
    if torque:
        text += f'[[loads]]\nbody = "second"\nmoment = {table(torque * np.array(axes[1]))}\n'
    return text


def worm(hand: str = "right", teeth: tuple[int, int] = (1, 180), more: str = "", **options: Any) -> str:
    mesh = f'teeth = {list(teeth)}\nradii = [4, 36]\nhand = "{hand}"\nclearance = {{ backlash = 0.02 }}\n{more}'
    return pair([[0, 1, 0], [0, 0, 1]], [[40, 0, 0], [0, 0, 0]], mesh, **options)


def bevel(teeth: tuple[int, int] = (20, 40), shaft: float = 90.0, more: str = "", **options: Any) -> str:
    """A bevel pair of module 2 with its apex in the origin."""
    (z1, z2), angle = teeth, math.radians(shaft)
    first = math.atan2(math.sin(angle) * z1, z2 + z1 * math.cos(angle))
    cones = (first, angle - first)
    axes = np.array([[0.0, 0.0, 1.0], [math.sin(angle), 0.0, math.cos(angle)]])
    at = [axis * z / math.tan(cone) for axis, z, cone in zip(axes, teeth, cones, strict=True)]
    return pair(axes, at, f"teeth = {list(teeth)}\nradii = [{z1}, {z2}]\n{more}", **options)


def crossed(seed: int) -> tuple[str, dict[str, float]]:
    """A pair of crossed helical gears from its helix angles, both of one hand or not, at any place."""
    chance = np.random.default_rng(seed)
    z1, z2 = (int(z) for z in chance.integers(5, 60, 2))
    module, alpha = chance.uniform(1, 4), math.radians(chance.uniform(14, 25))
    hands = chance.choice([-1, 1], 2)
    b1, b2 = (hand * math.radians(chance.uniform(15, 60)) for hand in hands)
    if abs(b1 + b2) < math.radians(12):
        b2 = -b2
    r1, r2 = (0.5 * module * z / math.cos(b) for z, b in ((z1, b1), (z2, b2)))
    turn = np.linalg.qr(chance.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    # Seen from the first wheel the second axis is turned by the sum of the helix angles about the line of centres.
    axes = np.array([[0.0, 0.0, 1.0], [0.0, math.sin(b1 + b2), math.cos(b1 + b2)]]) @ turn.T
    at = np.array([[0.0, 0.0, 0.0], [r1 + r2, 0.0, 0.0]]) @ turn.T + chance.normal(size=3) * 30
    hand = "right" if b1 > 0 else "left"
    mesh = f'teeth = {[z1, z2]}\nradii = {table([r1, r2])}\nhand = "{hand}"\n'
    mesh += f"clearance = {{ backlash = {0.02 * module} }}\n"
    mesh += f"pressure_angle = {math.degrees(alpha)}"
    told = {"z1": z1, "z2": z2, "b1": b1, "b2": b2, "r1": r1, "r2": r2, "alpha": alpha}
    return pair(axes, at, mesh, torque=1000.0 * float(chance.choice([-1, 1]))), told


def hypoid(offset: float = 20.0) -> tuple[str, np.ndarray, np.ndarray, np.ndarray]:
    """A pinion beside a gear, from two cones that touch in a plane: text, pitch point, axes, normal of the plane."""
    # In the plane z = 0 the generators of the cones are at an angle to each other; their axes are below and above it.
    angles, cones, radii = (0.0, math.radians(offset)), (math.radians(18), math.radians(68)), (20.0, 70.0)
    axes, at = [], []
    for angle, cone, radius, side in zip(angles, cones, radii, (-1.0, 1.0), strict=True):
        line = np.array([math.cos(angle), math.sin(angle), 0.0])
        axis = math.cos(cone) * line + side * math.sin(cone) * np.array([0.0, 0.0, 1.0])
        centre = radius * (side * math.cos(cone) * np.array([0.0, 0.0, 1.0]) - math.sin(cone) * line)
        axes.append(axis)
        at.append(centre)
    mesh = f'teeth = [11, 43]\nradii = {table(radii)}\nhand = "left"\nclearance = {{ backlash = 0.1 }}'
    return pair(axes, at, mesh, torque=7000.0), np.zeros(3), np.array(axes), np.array([0.0, 0.0, 1.0])


def loose(seed: int) -> str:
    """A worm, bevel or crossed pair on loose bearings, with run-out, ratio error and a load across."""
    bearing = "clearance = { radial = 0.01, axial = 0.008, length = 15 }"
    more = "ratio_error = 0.004\nrunout = { first = 0.003, second = 0.002 }"
    load = '\n[[loads]]\nbody = "second"\nforce = [3, -20, 11]\n'
    match seed % 3:
        case 0:
            return worm("left", (2, 41), more, torque=900.0, bearing=bearing) + load
        case 1:
            spiral = f'spiral_angle = 30\nhand = "right"\nclearance = {{ backlash = 0.08 }}\n{more}'
            return bevel((17, 30), 80.0, spiral, torque=-2000.0, bearing=bearing) + load
    text = crossed(seed)[0].replace("[drives.q]", f"{more}\n[drives.q]", 1)
    return text.replace("axis = ", f"{bearing}\naxis = ") + load
