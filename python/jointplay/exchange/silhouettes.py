"""The outline of a body as it is seen along z: the union of the projections of its faces.

Every face becomes flat pieces with directed edges around them: a plane as it is, its circles cut into chords; what is
curved in strips of its parameters, which are cut into triangles. On the drawing pieces are turned so that all lie on
the left of their edges. Then as many pieces cover a point as edges on its left go down, less those that go up; edges
that two pieces have in common cancel.

The drawing is cut into slabs between the heights of all corners. What is covered in a slab are trapezoids. Their sides
are the outline, with those parts of the lines between slabs that are covered on one side only. No edge is intersected
with another one: where two cross within a slab, the outline is off by less than its height.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointplay.errors import listed

from .bounds import FARTHEST
from .brep import Met, PartShape, Unreadable
from .fcstd import MM
from .skeleton import Facets, Matrix, Skeleton, Vector, noted
from .solids import Patch, curve_of

#: strips of a whole turn, which are off by 5e-4 of its radius; chords of an edge for each point of its integrals
ROUND, CHORDS = 96, 2
#: how far an outline may be off, as a part of the size of its body
TOLERANCE = 1e-3
#: gaps as wide as this are rounding, in parts of `SAME`
NARROW = 3.0
#: an area that is thinner than two of these parts of the size is rounding
THIN = 5e-5
#: what is at one place: as a part of the size of a face, and of a body
WELDED, SAME = 1e-5, 1e-6
#: sine of an angle below which a line goes straight on
STRAIGHT = 1e-9
#: turns around a face: those of a kernel have one
MOST_TURNS = 2
#: edges of the pieces of a body, how often edges meet slabs, and points of an outline; seconds are taken at most
MOST_EDGES, MOST_MEETINGS, MOST_POINTS = 500_000, 2_000_000, 2_000


class _Slabs(NamedTuple):
    """Trapezoids: the slab that each is in, and its left and right ends at the lower and at the upper height."""

    number: Vector
    left: Matrix
    right: Matrix


# --- pieces ---------------------------------------------------------------------------------------------------------


def facets(shape: PartShape) -> Facets:
    """The faces of a shape as flat pieces.

    Raises
    ------
    Unreadable
        When a face or an edge is of another kind than those that have a volume, or a face does not close.
    """
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            made = [np.zeros((0, 1, 2, 3))]
            for face in shape.faces():
                patch = Patch(shape, face, np.zeros(3))
                loops = _loops(shape, patch, face)
                made.append(_whole(patch, loops) if patch.kind == "plane" else _cut(patch, loops))
                if sum(pieces[..., 0, 0].size for pieces in made) > MOST_EDGES:
                    raise Unreadable(f"its faces have more than {MOST_EDGES} pieces")
    except (ValueError, OverflowError, IndexError, KeyError, FloatingPointError) as error:
        raise Unreadable(str(error)) from None
    counts = np.concatenate([np.full(len(pieces), pieces.shape[1]) for pieces in made])
    ends = np.concatenate([pieces.reshape(-1, 2, 3) for pieces in made])
    return Facets(MM * ends, np.repeat(np.arange(len(counts)), counts))


def _loops(shape: PartShape, patch: Patch, face: Met) -> Matrix:
    """The edges of a face in the parameters of its surface, cut into chords, all in their direction."""
    from scipy.spatial import KDTree

    lines = []
    for trace in shape.boundary(face):
        curve, spans, points = curve_of(patch, trace)
        if len(spans) > MOST_EDGES // (CHORDS * points):
            raise Unreadable(f"its edges have more than {MOST_EDGES} pieces")
        for low, high in spans:
            line = _bent(curve(np.linspace(low, high, CHORDS * points + 1))[0])
            lines.append(line[::-1].copy() if trace.is_reversed else line)
    # Edges end where others begin, but for what a kernel tolerates.
    ends = np.array([end for line in lines for end in (line[0], line[-1])])
    size = np.maximum(np.ptp(np.concatenate(lines), axis=0), SAME)
    first = [min(near) for near in KDTree(ends / size).query_ball_point(ends / size, WELDED)]
    if sorted(first[::2]) != sorted(first[1::2]):
        raise Unreadable("a face does not close")
    for line, begin, end in zip(lines, first[::2], first[1::2], strict=True):
        line[0], line[-1] = ends[begin], ends[end]
    return np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])


def _bent(line: Matrix) -> Matrix:
    """Without the points at which a line goes straight on."""
    along = np.diff(line, axis=0)
    turn = np.abs(_cross(along[:-1], along[1:]))
    sharp = turn > STRAIGHT * np.hypot(*along[:-1].T) * np.hypot(*along[1:].T)
    return np.asarray(line[np.concatenate([[True], sharp, [True]])])


def _cross(a: Matrix, b: Matrix) -> Vector:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _whole(patch: Patch, loops: Matrix) -> Matrix:
    """The edges of a plane, which is one piece, in the axes of the part, shape (piece, edge, end, axis)."""
    return patch.places(loops[..., 0], loops[..., 1])[None]


def _cut(patch: Patch, loops: Matrix) -> Matrix:
    """The edges of the triangles of a curved face."""
    step = 2.0 * np.pi / ROUND
    u = loops[..., 0]
    if np.ptp(u) > MOST_TURNS * 2.0 * np.pi:
        raise Unreadable("a face goes around more than once")
    heights = np.unique(np.concatenate([u.ravel(), step * np.arange(np.ceil(u.min() / step), u.max() / step)]))
    slabs = _covered(loops[..., ::-1], np.ones(len(loops)), heights)
    # What goes straight along v needs no more pieces there.
    count = 1 if patch.kind in ("cylinder", "cone") else int(np.ceil(np.ptp(loops[..., 1]) / step))
    if 6 * count * len(slabs.number) > MOST_EDGES:
        raise Unreadable(f"its faces have more than {MOST_EDGES} pieces")
    part = np.linspace(0.0, 1.0, count + 1)
    low, high = (
        patch.places(heights[slabs.number + k][:, None], (1.0 - part) * left[:, None] + part * right[:, None])
        for k, (left, right) in enumerate(zip(slabs.left.T, slabs.right.T, strict=True))
    )
    corners = [[low[:, :-1], low[:, 1:], high[:, :-1]], [high[:, :-1], low[:, 1:], high[:, 1:]]]
    triangles = np.moveaxis(np.array(corners), 1, 3).reshape(-1, 3, 3)
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)


# --- what they cover ------------------------------------------------------------------------------------------------


def _covered(ends: Matrix, weights: Vector, heights: Vector, narrow: float = 0.0) -> _Slabs:
    """What closed lines have inside, where every end of an edge is at one of the heights; without narrow gaps."""
    ends, weights = (given[ends[:, 0, 1] != ends[:, 1, 1]] for given in (ends, weights))
    downward = ends[:, 0, 1] > ends[:, 1, 1]
    low, high = (np.where(downward[:, None], ends[:, k], ends[:, 1 - k]) for k in (1, 0))
    first, last = (np.searchsorted(heights, end[:, 1]) for end in (low, high))
    count = last - first
    if count.sum() > MOST_MEETINGS:
        raise Unreadable("its faces have too many edges")
    edge = np.repeat(np.arange(len(ends)), count)
    slab = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)

    def across(height: Vector) -> Vector:
        (x, y), (dx, dy) = low[edge].T, (high - low)[edge].T
        return np.asarray(np.where(height == last[edge], high[edge, 0], x + (heights[height] - y) / dy * dx))

    places = np.stack([across(slab), across(slab + 1)], axis=1)
    steps = np.where(downward, weights, -weights)[edge]
    middle = places.mean(axis=1)
    order = np.lexsort((middle, slab))
    slab, places, middle, depth = slab[order], places[order], middle[order], np.cumsum(steps[order])
    is_last = np.append(slab[1:] != slab[:-1], True)[: len(slab)]
    if depth[is_last].any():
        raise Unreadable("a face does not close")
    # What rounding leaves open between two pieces is no gap: it is as narrow across both of their edges.
    rise = heights[slab + 1] - heights[slab]
    steep = rise / np.hypot(rise, places[:, 1] - places[:, 0])
    gaps = np.append(np.diff(middle) * np.maximum(steep[1:], steep[:-1]), 0.0)[: len(slab)]
    inside = (depth != 0) | (~is_last & (gaps <= narrow))
    before = np.append(False, inside[:-1])[: len(inside)]
    return _Slabs(slab[inside & ~before], places[inside & ~before], places[before & ~inside])


def silhouette(seen: Facets) -> list[Matrix]:
    """The outline along z as closed lines, shape (corner, axis): counter-clockwise outside, clockwise around holes.

    Raises
    ------
    Unreadable
        When it is too large, or has too many edges.
    """
    flat = seen.ends[..., :2]
    if len(flat) > MOST_EDGES or np.abs(flat).max(initial=0.0) > FARTHEST:
        raise Unreadable("it is too large")
    size = float(np.ptp(flat, axis=(0, 1)).max()) if len(flat) else 0.0
    if not size > 0.0:
        return []
    start, unit = flat.min(axis=(0, 1)), SAME * size
    # Whole numbers, so that what is equal is so.
    ends = np.rint((flat - start) / unit)
    areas = np.bincount(seen.piece, _cross(ends[:, 0], ends[:, 1]))
    ends, weights = _left_over(ends, np.sign(areas)[seen.piece])
    if not len(ends):
        return []
    step = TOLERANCE / SAME
    heights = np.unique(np.concatenate([ends[..., 1].ravel(), np.arange(0.0, ends[..., 1].max(), step)]))
    lines = [*_around(_covered(ends, weights, heights, NARROW), heights)]
    lines = [line for line in lines if abs(_area(line)) > THIN / SAME * _length(line)]
    off = step / 2.0
    while sum(map(len, found := _simplified(lines, off))) > MOST_POINTS:
        off *= 2.0
    return [start + unit * line for line in found]


def outlined(skeleton: Skeleton) -> Skeleton:
    """With the outlines of the bodies in the plane."""
    bodies, unknown = dict(skeleton.bodies), []
    for name, body in skeleton.bodies.items():
        try:
            bodies[name] = replace(body, outline=tuple(silhouette(body.facets)))
        except Unreadable:
            unknown.append(name)
    notes = [f"Outlines of these bodies, which are too large or too detailed, are left out: {listed(unknown)}."]
    return noted(replace(skeleton, bodies=bodies), *notes[: len(unknown)])


def _left_over(ends: Matrix, weights: Vector) -> tuple[Matrix, Vector]:
    """Every edge once, with how often it is there in its direction less in the other one; without those that cancel."""
    keys = ends[..., 0] * (2.0 / SAME) + ends[..., 1]
    back = keys[:, 0] > keys[:, 1]
    ends, keys = np.where(back[:, None, None], ends[:, ::-1], ends), np.sort(keys, axis=1)
    order = np.lexsort(keys.T)
    ends, keys, weights = ends[order], keys[order], np.where(back, -weights, weights)[order]
    new = np.append(True, (np.diff(keys, axis=0) != 0.0).any(axis=1))
    sums = np.bincount(np.cumsum(new) - 1, weights)
    return ends[new][sums != 0.0], sums[sums != 0.0]


def _around(slabs: _Slabs, heights: Vector) -> Iterator[Matrix]:
    """The closed lines around trapezoids."""
    below, above = slabs.number, slabs.number + 1
    sides = [
        (above, slabs.left[:, 1], below, slabs.left[:, 0]),
        (below, slabs.right[:, 0], above, slabs.right[:, 1]),
    ]
    # Along a line between slabs: what is covered above it, less what is below.
    at = np.concatenate([below, below, above, above])
    x = np.concatenate([slabs.left[:, 0], slabs.right[:, 0], slabs.left[:, 1], slabs.right[:, 1]])
    steps = np.repeat([1, -1, -1, 1], len(below))
    order = np.lexsort((x, at))
    at, x, excess = at[order], x[order], np.cumsum(steps[order])
    here = np.repeat(np.arange(len(excess)), np.abs(excess))
    here = here[x[here] != x[here + 1]]
    one, other = here + (excess[here] < 0), here + (excess[here] > 0)
    sides.append((at[one], x[one], at[other], x[other]))
    ways = np.concatenate([np.array(side, dtype=float).T for side in sides]).reshape(-1, 2)
    nodes, numbers = np.unique(ways, axis=0, return_inverse=True)
    following: dict[int, list[int]] = {}
    for one, other in numbers.reshape(-1, 2).tolist():
        following.setdefault(one, []).append(other)
    for first in following:
        while following[first]:
            chain = [first]
            while (found := following[chain[-1]].pop()) != first:
                chain.append(found)
            at, x = nodes[chain].T
            yield np.stack([x, heights[at.astype(int)]], axis=1)


def _area(line: Matrix) -> float:
    return float(_cross(line, np.roll(line, -1, axis=0)).sum() / 2.0)


def _length(line: Matrix) -> float:
    return float(np.hypot(*(np.roll(line, -1, axis=0) - line).T).sum())


def _simplified(lines: Iterable[Matrix], off: float) -> list[Matrix]:
    """Closed lines with those of their points without which they would be off by more; those that have an inside."""
    return [found for line in lines if len(found := _cornered(line, off)) > 2]


def _cornered(line: Matrix, off: float) -> Matrix:
    """One of them (Douglas and Peucker)."""
    line = np.roll(line, -int(np.hypot(*(line - line.mean(axis=0)).T).argmax()), axis=0)
    far = int(np.hypot(*(line - line[0]).T).argmax())
    line = np.vstack([line, line[:1]])
    kept, waiting = {0, far}, [(0, far), (far, len(line) - 1)]
    while waiting:
        one, other = waiting.pop()
        if other - one < 2:
            continue
        chord, inner = line[other] - line[one], line[one + 1 : other] - line[one]
        part = np.clip(inner @ chord / (float(chord @ chord) or 1.0), 0.0, 1.0)
        away = np.hypot(*(inner - part[:, None] * chord).T)
        if away.max() > off:
            middle = one + 1 + int(away.argmax())
            kept.add(middle)
            waiting += [(one, middle), (middle, other)]
    return line[sorted(kept)]
