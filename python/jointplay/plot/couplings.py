"""Gears, racks and belts on the drawing of a mechanism: pitch circles with their teeth, and strands.

In the plane a wheel of pitch radius r with z teeth has marks of the height of its teeth, the module 2 r / z, which turn
with its body. The strands of a belt touch both pulleys: with the angle gamma between a strand and the line of centres,

    sin(gamma) = (r1 - r2) / a  (open),   (r1 + r2) / a  (crossed).
"""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle

from jointplay.core.spec import JointSpec

from .style import theme

Points = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: axis and side of a joint
Basis = tuple[Points, Points]

#: no more marks than this on a wheel: they would run together
TEETH = 90


def wheel(axes: Axes, centre: Points, radius: float, teeth: int, turn: float, colour: str) -> None:
    """A pitch circle, with a mark for each tooth if there is room for them."""
    axes.add_patch(Circle((centre[0], centre[1]), radius, fill=False, edgecolor=colour, linewidth=1.2, zorder=2))
    shown = teeth if teeth <= TEETH else 12
    half = radius / max(teeth, 12)
    angles = turn + 2.0 * np.pi * np.arange(shown) / shown
    out = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    marks = np.stack([centre + (radius - half) * out, centre + (radius + half) * out], axis=1)
    axes.add_collection(LineCollection(list(marks), colors=colour, linewidths=0.8, zorder=2))


def rack(axes: Axes, at: Points, along: Points, pinion: Points, radius: float, pitch: float, colour: str) -> None:
    """The pitch line below a pinion, with a mark for each tooth."""
    across = np.array([-along[1], along[0]])
    side = np.sign((pinion - at) @ across) or 1.0
    middle = float((pinion - at) @ along)
    reach = 1.6 * radius
    ends = np.array([at + (middle + s * reach) * along for s in (-1.0, 1.0)])
    axes.plot(*ends.T, color=colour, linewidth=1.2, zorder=2)
    first, last = np.ceil((middle - reach) / pitch), np.floor((middle + reach) / pitch)
    feet = at + np.outer(np.arange(first, last + 1) * pitch, along)
    height = side * pitch / np.pi * across
    axes.add_collection(LineCollection(list(np.stack([feet - height, feet], axis=1)), colors=colour, linewidths=0.8))


def strands(first: Points, second: Points, across: Points, radii: tuple[float, float], crossed: bool) -> list[Points]:
    """Both strands of a belt, each between the points where it touches the pulleys; none around wheels in one another.

    `across` is a direction of the pulleys' plane at right angles to the line of centres.
    """
    apart = second - first
    distance = float(np.linalg.norm(apart))
    sine = (radii[0] + radii[1] if crossed else radii[0] - radii[1]) / distance if distance else np.inf
    if not abs(sine) < 1.0:
        return []
    outward = [sine * apart / distance + side * np.sqrt(1.0 - sine * sine) * across for side in (-1.0, 1.0)]
    return [np.array([first + radii[0] * out, second + (-radii[1] if crossed else radii[1]) * out]) for out in outward]


def contact(joint: JointSpec, ends: tuple[Points, Points], along: Points, unit: float,
            axes: tuple[Points, Points] | None = None) -> Points:  # fmt: skip
    """Where a coupling acts: the pitch point of teeth, the middle between pulleys.

    `along` is the pitch line of a rack, `axes` are those of two wheels in space.
    """
    apart = ends[1] - ends[0]
    told = joint["coupling"].get("contact")
    if told is not None and axes is not None:
        drawn, now = (np.stack([a, b, np.cross(a, b)], axis=-1) for a, b in (told["axes"], axes))
        met: Points = ends[0] + now @ np.linalg.solve(drawn, np.array(told["at"])) / unit
        return met
    distance = float(np.linalg.norm(apart))
    radius = abs(joint["coupling"]["radii"][0]) / unit
    if joint["kind"] == "rack":
        foot: Points = ends[0] + (apart @ along) * along
        return foot
    if joint["kind"] == "belt" or not distance:
        middle: Points = ends[0] + 0.5 * apart
        return middle
    pitch_point: Points = ends[0] + (-radius if joint["coupling"]["internal"] else radius) * apart / distance
    return pitch_point


def direction(joint: JointSpec, turn: float) -> Points:
    """The axis of a joint in the plane whose first body is turned so far, ground axes."""
    angle = turn + np.arctan2(joint["axis_first"][1], joint["axis_first"][0])
    return np.array([np.cos(angle), np.sin(angle)])


def draw(axes: Axes, joint: JointSpec, ends: tuple[Points, Points], turns: tuple[float, float],
         colours: tuple[str, str], unit: float) -> None:  # fmt: skip
    """A coupling between two bodies.

    Parameters
    ----------
    axes : matplotlib axes
    joint : dict
        As the core reads it, with its ``coupling``.
    ends : tuple of ndarray
        The places of the joint on both bodies, ground axes, in the drawing's unit.
    turns : tuple of float
        Angles of both bodies, radians.
    colours : tuple of str
        Those of the bodies.
    unit : float
        Metres per unit of the drawing.
    """
    coupling, kind = joint["coupling"], joint["kind"]
    radii = tuple(abs(r) / unit for r in coupling["radii"])
    if kind == "rack":
        along = direction(joint, turns[0])
        radius, teeth = radii[0], int(coupling["teeth"][0])
        rack(axes, ends[0], along, ends[1], radius, 2.0 * np.pi * radius / max(teeth, 12), colours[0])
        wheel(axes, ends[1], radius, teeth, turns[1], colours[1])
        return
    for end, radius, teeth, turn, colour in zip(ends, radii, coupling["teeth"], turns, colours, strict=True):
        wheel(axes, end, radius, int(teeth), turn, colour)
    if kind == "belt":
        apart = ends[1] - ends[0]
        across = np.array([-apart[1], apart[0]]) / (float(np.hypot(*apart)) or 1.0)
        for strand in strands(*ends, across, (radii[0], radii[1]), bool(coupling["crossed"])):
            axes.plot(*strand.T, color=theme().grey, linewidth=1.6, zorder=2)


def draw_in_space(line: Callable[..., None], joint: JointSpec, ends: tuple[Points, Points], frames: tuple[Basis, Basis],
                  colours: tuple[str, str], unit: float) -> None:  # fmt: skip
    """A coupling in space: circles about the axes of its wheels, a rack as its pitch line, the strands of a belt.

    `line` draws through points in space; `frames` are the axis and the side of the joint as each body carries them, in
    ground axes.
    """
    coupling = joint["coupling"]
    radii = tuple(abs(r) / unit for r in coupling["radii"])
    angles = np.linspace(0.0, 2.0 * np.pi, 73)
    for end, place, radius, (axis, side), colour in zip((0, 1), ends, radii, frames, colours, strict=True):
        if joint["kind"] == "rack" and end == 0:
            foot = contact(joint, ends, side, unit)
            line(np.array([foot - 1.6 * radius * side, foot + 1.6 * radius * side]), color=colour)
            continue
        rim = place + radius * (np.outer(np.cos(angles), side) + np.outer(np.sin(angles), np.cross(axis, side)))
        line(rim, color=colour, linewidth=1.2)
        # A spoke shows how the wheel is turned.
        line(np.array([place, rim[0]]), color=colour, linewidth=0.8)
    if joint["kind"] == "belt":
        across = np.cross(frames[0][0], ends[1] - ends[0])
        across /= float(np.linalg.norm(across)) or 1.0
        for strand in strands(*ends, across, (radii[0], radii[1]), bool(coupling["crossed"])):
            line(strand, color=theme().grey, linewidth=1.4)
