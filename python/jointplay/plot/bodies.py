"""Bodies on a drawing: their colours, their outlines, and where the output is."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.file.schema import PlanarBody

from .style import Theme, mixed, scaled, theme

if TYPE_CHECKING:
    from jointplay.analyses.nominal import Nominal
    from jointplay.model.mechanism import Mechanism

#: what is left of a colour when all colours have been used
PALER = 0.6
#: what is left of it in the area and the lines of an outline
FAINT, LIGHT = 0.12, 0.6


def body_colour(m: Mechanism, body: int, look: Theme | None = None) -> str:
    """The colour of a body, by its index, in a theme or the one in use; of a piece of an elastic body its body's."""
    look = look or theme()
    if body == -1:
        return look.grey
    # Further bodies have the same colours, nearer to the paper each time: no two entries of a legend look alike.
    turn, colour = divmod(m.bodies.index(m.owners[body]), len(look.colours))
    return mixed(look.colours[colour], look.paper, PALER**turn)


def on_ground(m: Mechanism, at: Floats, error: Floats) -> Floats:
    """An error of the output's position in ground axes; `at` are the poses of all bodies."""
    if m.seen_from is None:
        return error
    turned: Floats = poses.matrix(at[m.seen_from])[: len(error), : len(error)] @ error
    return turned


def path_of_output(m: Mechanism, at: Nominal) -> Floats:
    """The place of the output point in every configuration, ground axes, metres; three coordinates."""
    point = m.points[m.output_point]
    return poses.place(at.poses[:, point.body], point.at)


def drawn_outline(m: Mechanism, body: int) -> list[Floats]:
    """The closed lines that a file has of a body, by its index, in body axes: (corner, axis), three coordinates, SI.

    A piece of an elastic body has none: its body has them.
    """
    name = m.bodies[body] if body >= 0 else "ground"
    table = m.data.bodies.get(name)
    lines = (table.outline or ()) if isinstance(table, PlanarBody) else ()
    return [np.pad(m.units.length * np.array(line), ((0, 0), (0, 1))) for line in lines]


def put_outline(axes: Axes, lines: list[Floats], colour: str) -> None:
    """Draw closed lines of a body behind all else: filled, but for lines within lines."""
    if not lines:
        return
    turned = []
    starts = np.array([line[0] for line in lines])
    within = np.array([Path(line).contains_points(starts) for line in lines])
    for k, line in enumerate(lines):
        depth = int(within[:, k].sum() - within[k, k])
        area = float(sum(_turn(line[0], one, other) for one, other in pairwise(line)))
        # What turns against the line around it is a hole of it, in all formats that are written.
        way = 1 if (area > 0.0) == (depth % 2 == 0) else -1
        turned.append(Path(np.vstack([line, line[:1]])[::way], closed=True))
    whole = Path.make_compound_path(*turned)
    axes.add_patch(PathPatch(whole, facecolor=mixed(colour, theme().paper, FAINT), edgecolor="none", zorder=0.4))
    light = mixed(colour, theme().paper, LIGHT)
    axes.add_patch(PathPatch(whole, fill=False, edgecolor=light, linewidth=scaled(0.9), zorder=0.6))


def outline(points: Floats, near: float) -> Floats:
    """The corners of a body's outline, in turn and closed: the convex hull of its points in the plane they span most.

    Points on one line, within the distance `near`, make a line.
    """
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    flat = centred @ axes[:2].T
    order = np.lexsort(flat.T[::-1])
    if len(points) < 3 or float(np.abs(flat[:, 1:]).max(initial=0.0)) <= near:
        return np.asarray(points[order[[0, -1]]])
    corners: list[int] = []
    for way in (order, order[::-1]):
        chain: list[int] = []
        for k in way.tolist():
            while len(chain) > 1 and _turn(flat[chain[-2]], flat[chain[-1]], flat[k]) <= 0.0:
                chain.pop()
            chain.append(k)
        corners += chain[:-1]
    return np.asarray(points[[*corners, corners[0]]])


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    """Twice the area of a triangle, positive counter-clockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
