"""Gears, racks and belts on the drawing of a mechanism in the plane: pitch circles with their teeth, and strands.

A wheel of pitch radius r with z teeth has marks of the height of its teeth, the module 2 r / z, which turn with its
body. The strands of a belt touch both pulleys: with the angle gamma between a strand and the line of centres,

    sin(gamma) = (r1 - r2) / a  (open),   (r1 + r2) / a  (crossed).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle

from .style import GREY

Points = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

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


def strands(axes: Axes, first: Points, second: Points, radii: tuple[float, float], crossed: bool) -> None:
    """Both strands of a belt between the points where they touch the pulleys."""
    apart = second - first
    distance = float(np.hypot(*apart))
    sine = (radii[0] + radii[1] if crossed else radii[0] - radii[1]) / distance
    if not abs(sine) < 1.0:
        return
    along = apart / distance
    across = np.array([-along[1], along[0]])
    for side in (-1.0, 1.0):
        out = sine * along + side * np.sqrt(1.0 - sine * sine) * across
        ends = np.array([first + radii[0] * out, second + (-radii[1] if crossed else radii[1]) * out])
        axes.plot(*ends.T, color=GREY, linewidth=1.6, zorder=2)


def draw(axes: Axes, joint: dict[str, Any], ends: tuple[Points, Points], turns: tuple[float, float],
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
        turn = turns[0] + np.arctan2(joint["axis_first"][1], joint["axis_first"][0])
        along = np.array([np.cos(turn), np.sin(turn)])
        radius, teeth = radii[0], int(coupling["teeth"][0])
        rack(axes, ends[0], along, ends[1], radius, 2.0 * np.pi * radius / max(teeth, 12), colours[0])
        wheel(axes, ends[1], radius, teeth, turns[1], colours[1])
        return
    for end, radius, teeth, turn, colour in zip(ends, radii, coupling["teeth"], turns, colours, strict=True):
        wheel(axes, end, radius, int(teeth), turn, colour)
    if kind == "belt":
        strands(axes, *ends, (radii[0], radii[1]), bool(coupling["crossed"]))
